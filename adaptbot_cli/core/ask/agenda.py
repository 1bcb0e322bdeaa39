"""What to ask the person next, and what stands on one form (paper, III-C)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from rdflib import RDF, XSD, URIRef

from adaptbot_cli.core.ask import learning, new_action, suggest
from adaptbot_cli.core.ask.questions import (
    ABSENT,
    EDIT,
    EXISTS,
    FIXED,
    INSTEAD,
    KINDS,
    LATER,
    MOST_SHOWN,
    SAME,
    Answer,
    Choice,
    Key,
    Names,
    Question,
    Subject,
)
from adaptbot_cli.core.domain import Action, ItemClass, Parameter, Property
from adaptbot_cli.core.graph.sparql import mentions
from adaptbot_cli.core.graph.terms import TRUE, local
from adaptbot_cli.core.names import nearest, normal, words
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.grounding import known_values
from adaptbot_cli.core.report import GroundAction, Report
from adaptbot_cli.core.scene import Scene

Asked = Mapping[Key, tuple[Question, Answer]]


def next_question(
    report: Report,
    scene: Scene,
    asked: Asked,
    required_only: bool = False,
    doubt: bool = False,
) -> Question | None:
    """Return the next question that this plan needs an answer to, if any is left to ask.

    Questions about something just taught come first; the rest in the order of the plan. Nothing
    is asked twice. With `required_only` only required items are asked about. With `doubt` the
    person is also asked whether what is known is so, where nothing else will do.
    """
    for question in _about_the_taught(scene, asked):
        if question.key not in asked:
            return question
    for finding in report.blocking:
        if required_only and not scene.requires(finding.subject):
            continue
        if finding.code == "E302" and not (doubt and _is_needed(finding, report, scene)):
            continue
        if finding.code == "E402" and not doubt:
            continue
        about_default = finding.code == "E401" and doubt
        for found in (
            (_about_a_default if about_default else _question)(finding, report, scene),
            _kind_question(finding, report, scene, asked),
            _action_question(finding, report, scene, asked),
        ):
            if found is not None and found.key not in asked:
                return found
    return None


def all_open(report: Report, scene: Scene, asked: Asked) -> list[Question]:
    """Return every question that this plan needs an answer to now, in the order of the plan."""
    found: list[Question] = []
    put_off = dict(asked)
    while (question := next_question(report, scene, put_off)) is not None:
        put_off[question.key] = (question, LATER)
        found.append(question)
    return found


def following(name: str, report: Report, scene: Scene, asked: Asked) -> Question | None:
    """Return the next question that answers about one thing have led to."""
    about_taught = (q for q in _about_the_taught(scene, asked) if q.key not in asked)
    led_to = (q for q in all_open(report, scene, asked) if q.about == name)
    return next(about_taught, None) or next(led_to, None)


def taught(asked: Asked) -> tuple[str, ...]:
    """Return the names of the items that this run has taught, in the order of their teaching."""
    names = [
        question.about
        for question, answer in asked.values()
        if (question.kind, question.subject, answer.value) == ("existence", "item", EXISTS)
        or (question.kind == "kind" and answer.value in {c.value for c in question.choices})
    ]
    return tuple(dict.fromkeys(names))


def _about_the_taught(scene: Scene, asked: Asked) -> Iterable[Question]:
    """What each new place is, and where each item that this run has taught is kept."""
    for question, answer in asked.values():
        kinds = kinds_of_place(question.prop, scene) if answer.new else []
        if len(kinds) > 1 and not scene.kg.find(answer.new):
            yield what_is(normal(answer.new), kinds, question.text)
    for name in taught(asked):
        yield from _place_questions(name, scene)


def _place_questions(name: str, scene: Scene) -> Iterable[Question]:
    for entity in scene.kg.find(name):
        prop = place_property(entity, scene)
        if prop is not None and scene.kg.value(entity, prop.iri) is None:
            yield learning.attribute_question(scene.kg, name, prop, "")


def kinds_of_place(prop: str, scene: Scene) -> list[ItemClass]:
    """Return the kinds that can be taught and that a location property leads to."""
    found = property_called(prop, scene)
    return [
        k for k in scene.domain.teachable if found is not None and found.range in k.superclasses
    ]


def needed_of(name: str, report: Report, scene: Scene, asked: Asked) -> list[Question]:
    """Return the questions about one item that this plan needs an answer to."""
    places = list(_place_questions(name, scene)) if name in taught(asked) else []
    findings = [f for f in report.blocking if f.code == "E301" and normal(f.subject) == name]
    found = [_question(finding, report, scene) for finding in findings]
    return [question for question in (*places, *found) if question and question.key not in asked]


def place_property(entity: URIRef, scene: Scene) -> Property | None:
    """Return the location property of a thing's class, if it has one."""
    for iri in scene.kg.facts.objects(entity, RDF.type):
        kind = scene.domain.classes.get(iri)  # type: ignore[call-overload]
        if kind is not None and kind.location_property is not None:
            return scene.domain.properties.get(kind.location_property)
    return None


def _question(finding: Finding, report: Report, scene: Scene) -> Question | None:
    context = _source(finding, report)
    if finding.code in KINDS["existence"].codes:
        return _existence("action" if finding.code == "E101" else "item", finding, report, scene)
    if finding.code in (*KINDS["attribute"].codes, *KINDS["place"].codes):
        prop = property_called(finding.prop, scene)
        if prop is not None:
            name = normal(finding.subject)
            prevents = f"“{context}” stays open" if context else ""
            return learning.attribute_question(scene.kg, name, prop, context, prevents)
    return None


def _is_needed(finding: Finding, report: Report, scene: Scene) -> bool:
    """Tell whether a thing that an attribute rules out is required, or the only one of its kind."""
    if finding.step is None or scene.requires(finding.subject):
        return finding.step is not None
    step = report.steps[finding.step - 1]
    action, things = resolve.action(step.call.action, scene).action, scene.kg.find(finding.subject)
    for need in action.attributes if action else ():
        if local(need.prop) == finding.prop and action is not None:
            taken = (p.classes for p in action.parameters if p.name == need.of)
            fitting = frozenset(iri for classes in taken for iri in classes)
            others = (s for s in scene.kg.facts.subjects(need.prop, need.value) if s not in things)
            return not any(scene.kg.is_a(other, fitting) for other in others)
    return False


def _about_a_default(finding: Finding, report: Report, scene: Scene) -> Question | None:
    """Whether a thing is as a step needs it that finds nothing else here to serve as its parameter.

    It bears the parameter's name, and one attribute keeps it from serving.
    """
    ground = report.grounded[finding.step - 1] if finding.step else None
    for parameter in ground.action.parameters if ground else ():
        if ground is None or not parameter.default or parameter.name in ground.values:
            continue
        called = (set(scene.kg.with_word(word)) for word in words(parameter.name))
        for entity in sorted(set.intersection(*called)):
            name = normal(scene.kg.name(entity))
            if not scene.kg.is_a(entity, parameter.classes):
                continue
            for prop in sorted(mentions(parameter.default) & scene.domain.properties.keys()):
                if _would_serve(entity, scene.domain.properties[prop], parameter, ground, scene):
                    context = _source(finding, report)
                    return learning.attribute_question(
                        scene.kg, name, scene.domain.properties[prop], context
                    )
    return None


def _would_serve(
    entity: URIRef, prop: Property, parameter: Parameter, ground: GroundAction, scene: Scene
) -> bool:
    """Tell whether a default would find a thing, were an attribute of it otherwise."""
    values = known_values(scene.kg, entity, prop.iri)
    if prop.range != XSD.boolean or TRUE in values:
        return False
    given = {"agent": scene.domain.agent, **ground.values}
    with scene.kg.rehearsal():
        scene.kg.apply(learning.attribute(scene.kg, entity, prop, TRUE))
        return entity in scene.kg.values(parameter.default, parameter.name, given)


def _source(finding: Finding, report: Report) -> str:
    if finding.step is None:
        return ""
    step = report.steps[finding.step - 1]
    return step.source or step.call.render()


def _existence(subject: Subject, finding: Finding, report: Report, scene: Scene) -> Question | None:
    name = normal(finding.subject)
    if not name or learning.is_absent(scene.kg, name, subject):
        return None
    message = name.replace("_", " ")
    text = f'I do not know "{message}". Is there such a thing in this {scene.domain.name}?'
    kinds = [kind.iri for kind in scene.domain.teachable]
    known = sorted(map(scene.kg.name, scene.kg.likest(name, kinds, MOST_SHOWN)))
    if subject == "action":
        text = f'I do not know how to "{message}". Is it something I can do here?'
        known = list(scene.domain.actions)
    by_nearness = nearest(name, known, len(known), floor=0.0)
    related = (word.word for word in scene.known.get(name, ()))
    parts = {part for text in (name, *related) for part in words(text)}
    return Question(
        "existence",
        name,
        text,
        "",
        subject,
        _outcomes(name, subject, report, scene),
        _all_or_found(dict.fromkeys((*finding.candidates, *by_nearness)), subject, scene),
        near=finding.candidates,
        alike=tuple(other for other in finding.candidates if not parts & set(words(other))),
        context=_source(finding, report),
    )


def _all_or_found(shown: Iterable[str], subject: Subject, scene: Scene) -> Names:
    kinds = [kind.iri for kind in scene.domain.teachable]
    if subject == "action" or scene.kg.few(kinds, MOST_SHOWN) is not None:
        return Names(shown)
    return Names.of(shown, learning.finder(scene.kg, kinds))


def _outcomes(name: str, subject: Subject, report: Report, scene: Scene) -> tuple[Choice, ...]:
    """The outcomes of an existence check (III-C), each with what it leads to."""
    named = (step.call.args if subject == "item" else [step.call.action] for step in report.steps)
    count = sum(name in map(normal, names) for names in named)
    steps = f"{count} step{'s' * (count != 1)}"
    without = f"{steps} left out; I never ask again"
    if subject == "item" and scene.requires(name):
        without = "the task cannot be done as asked; I never ask again"
    if subject == "action":
        return (
            Choice(SAME, "it is another name for something you can do", "I remember the name", "a"),
            Choice(INSTEAD, "do something else instead", "this time only", "u"),
            Choice(ABSENT, "no, it is not possible here", without, "n"),
            Choice(FIXED, "it is one, always with the same argument", "I remember both", "f"),
            Choice(EXISTS, "yes, it is possible", "I ask what it does", "y"),
            Choice(EDIT, "change the plan instead", key="e"),
            Choice(LATER.value, "ask me later", "it stays open", "l"),
        )
    return (
        Choice(SAME, "it is another name for something you know", "I remember the name", "a"),
        Choice(INSTEAD, "use something else instead", "this time only", "u"),
        Choice(ABSENT, "no, there is none", without, "n"),
        Choice(EXISTS, "yes, there is", "I ask what it is, and what the plan needs", "y"),
        Choice(EDIT, "change the plan instead", key="e"),
        Choice(LATER.value, "ask me later", "it stays open", "l"),
    )


def property_called(name: str, scene: Scene) -> Property | None:
    """Return the property with a short name, if the domain has one."""
    return next((p for p in scene.domain.properties.values() if local(p.iri) == name), None)


def _kind_question(finding: Finding, report: Report, scene: Scene, asked: Asked) -> Question | None:
    """What kind of thing something is that a person has said exists."""
    name = normal(finding.subject)
    found = asked.get(("existence", name, "", "item"))
    if finding.code != "E201" or found is None or found[1].value != EXISTS:
        return None
    return what_is(name, possible_kinds(name, report, scene), _source(finding, report))


def _action_question(
    finding: Finding, report: Report, scene: Scene, asked: Asked
) -> Question | None:
    """The next question about an action that a person says is possible."""
    found = asked.get(("existence", normal(finding.subject), "", "action"))
    if finding.code != "E101" or found is None or found[1].value not in (EXISTS, FIXED):
        return None
    unknown = unknown_action(normal(finding.subject), report)
    question = new_action.played(unknown, found[1].value, scene.kg, asked)
    return question if isinstance(question, Question) else None


def unknown_action(name: str, report: Report) -> new_action.Unknown:
    """Return an action that a plan writes and that is not known, as the plan has it.

    There is a step of that name: the finding that is asked about was made of its call.
    """
    step = next(s for s in report.steps if normal(s.call.action) == name)
    found = [f for f in report.findings if f.code == "E101" and normal(f.subject) == name]
    near = found[0].candidates if found else ()
    return new_action.Unknown(name, step.call, near, step.source or step.call.render())


def what_is(name: str, kinds: Iterable[ItemClass], context: str) -> Question:
    """Return the question what kind of thing something is."""
    choices = tuple(Choice(local(kind.iri), kind.label, kind.comment) for kind in kinds)
    text = f'What is "{name.replace("_", " ")}"?'
    return Question("kind", name, text, choices=choices, context=context)


def possible_kinds(name: str, report: Report, scene: Scene) -> list[ItemClass]:
    """Return the kinds that an unknown thing can be, from the steps that use it.

    Which action of a family was written says little of the thing, so all kinds that the family
    takes are possible; the one that was written for comes first.
    """
    kinds = list(scene.domain.teachable)
    likely: set[URIRef] = set()
    for step in report.steps:
        action = resolve.action(step.call.action, scene).action
        for position, arg in enumerate(step.call.args if action else ()):
            if action and normal(arg) == name and position < len(action.visible):
                likely |= set(action.visible[position].classes)
                classes = _of_family(action, position, scene)
                kinds = [k for k in kinds if classes & set(k.superclasses)] or kinds
    return sorted(kinds, key=lambda kind: not likely & set(kind.superclasses))


def _of_family(action: Action, position: int, scene: Scene) -> set[URIRef]:
    """The classes that an action or others of its family take at a position."""
    family = [a for a in scene.domain.actions.values() if a.family and a.family == action.family]
    return {
        iri
        for member in family or [action]
        for parameter in member.visible[position : position + 1]
        for iri in parameter.classes
    }


def around(
    question: Question, report: Report, scene: Scene, asked: Asked, full: bool
) -> tuple[Question, ...]:
    """Return a question and the others that this plan needs answers to about the same thing.

    With `full` those of a new thing are all that its kind is asked. Each comes with its likely
    answer.
    """
    if question.kind == "kind":
        known = {local(kind.iri): kind for kind in scene.domain.teachable}
        kinds = [known[choice.value] for choice in question.choices if choice.value in known]
        likely = suggest.Likely(question.about, kinds, scene)
        return (replace(question, suggested=likely.kind()),)
    if not question.spec.together:
        return (question,)
    found = [question, *needed_of(question.about, report, scene, asked)]
    if full and question.about in taught(asked):
        found += open_questions(question.about, scene)
    by_key = {each.key: each for each in found if each.key == question.key or each.key not in asked}
    # in the domain's order: places first, as a rule
    asks = [p for entity in scene.kg.find(question.about)[:1] for p in _asked_of(entity, scene)]
    order = {local(prop.iri): n for n, prop in enumerate(dict.fromkeys(asks))}
    first = sorted(by_key.values(), key=lambda each: order.get(each.prop, len(order)))
    return _with_suggestions(first, scene)


def rest(
    name: str,
    scene: Scene,
    asked: Asked,
    besides: Sequence[Question] = (),
) -> tuple[Question, ...]:
    """Return what the kind of a new thing is asked, of which this plan needs nothing."""
    there = {question.key for question in besides}
    found = (question for question in open_questions(name, scene) if question.key not in asked)
    return _with_suggestions([question for question in found if question.key not in there], scene)


def unoffered(asked: Asked, offers: set[str], question: Question | None) -> str | None:
    """Return a new thing that needs no more questions and was not offered further ones yet."""
    about = question.about if question is not None else None
    return next((n for n in taught(asked) if n not in offers and n != about), None)


def is_open(question: Question, scene: Scene) -> bool:
    """Tell whether a question still has no answer: none was learned, and none follows."""
    prop = property_called(question.prop, scene)
    entities = scene.kg.find(question.about)
    return prop is None or not entities or not known_values(scene.kg, entities[0], prop.iri)


def open_questions(name: str, scene: Scene) -> Iterable[Question]:
    """Give what the classes of a thing are asked, in the domain's order, where it is not known."""
    for entity in scene.kg.find(name)[:1]:
        for prop in _asked_of(entity, scene):
            question = learning.attribute_question(scene.kg, name, prop, "")
            if is_open(question, scene):
                yield question


def _asked_of(entity: URIRef, scene: Scene) -> list[Property]:
    props = scene.domain.properties
    return [props[iri] for k in _kinds(entity, scene) for iri in k.asks if iri in props]


def _kinds(entity: URIRef, scene: Scene) -> list[ItemClass]:
    return [kind for kind in scene.domain.teachable if scene.kg.is_a(entity, [kind.iri])]


def _with_suggestions(questions: Sequence[Question], scene: Scene) -> tuple[Question, ...]:
    """Questions about one thing, each with its likely answer if there is one."""
    if not questions:
        return ()
    entities = scene.kg.find(questions[0].about)[:1]
    kinds = [kind for entity in entities for kind in _kinds(entity, scene)]
    likely = suggest.Likely(questions[0].about, kinds, scene)
    return tuple(_with_suggestion(question, likely, scene) for question in questions)


def _with_suggestion(question: Question, likely: suggest.Likely, scene: Scene) -> Question:
    prop = property_called(question.prop, scene)
    if prop is None or question.kind == "value":
        return question
    found = likely.attribute(prop)
    if found is not None and found.value not in {choice.value for choice in question.choices}:
        return question
    return replace(question, suggested=found)
