"""What to ask the person next, and what an answer teaches (paper, III-C)."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from rdflib import RDF, URIRef

from adaptbot_cli.core import learning, resolve
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.domain import Action, Kind, Property
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.questions import ABSENT, EXISTS, Answer, Choice, Question
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.static import number
from adaptbot_cli.core.terms import local

Key = tuple[str, str, str, str]
Asked = Mapping[Key, tuple[Question, Answer]]


def next_question(
    report: Report, scene: Scene, asked: Asked, required_only: bool = False
) -> Question | None:
    """Return the next question that this plan needs an answer to, if any is left to ask.

    Questions about something just taught come first; the rest in the order of the plan. Nothing
    is asked twice. With `required_only` only required items are asked about.
    """
    about_taught = next(iter(_about_the_taught(scene, asked)), None)
    if about_taught is not None:
        return about_taught
    for finding in report.blocking:
        if required_only and not scene.requires(finding.subject):
            continue
        question = _question(finding, report, scene)
        if question is not None and question.key not in asked:
            return question
        follow_up = _kind_question(finding, report, scene, asked)
        if follow_up is not None:
            return follow_up
    return None


def unfinished(scene: Scene, asked: Asked) -> bool:
    """Tell whether something just taught still has a question of its own open."""
    return next(iter(_about_the_taught(scene, asked)), None) is not None


def _about_the_taught(scene: Scene, asked: Asked) -> Iterable[Question]:
    """Where each item that this run has taught is kept."""
    names = [
        question.about
        for question, answer in asked.values()
        if question.kind == "kind" or (question.kind == "existence" and answer.value == EXISTS)
    ]
    for name in dict.fromkeys(names):
        for entity in scene.kg.find(name):
            prop = _place_property(entity, scene)
            if prop is None or scene.kg.value(entity, prop.iri) is not None:
                continue
            question = learning.attribute_question(scene.kg, name, prop, "")
            if question.key not in asked:
                yield question


def _place_property(entity: URIRef, scene: Scene) -> Property | None:
    for iri in scene.kg.facts.objects(entity, RDF.type):
        kind = scene.domain.kinds.get(iri)  # type: ignore[call-overload]
        if kind is not None and kind.location_property is not None:
            return scene.domain.properties.get(kind.location_property)
    return None


def _question(finding: Finding, report: Report, scene: Scene) -> Question | None:
    context = _source(finding, report)
    if finding.code == "E201":
        return _existence("item", finding, context, scene)
    if finding.code == "E101":
        return _existence("action", finding, context, scene)
    if finding.code == "E301":
        prop = _property(finding.candidates[0], scene)
        if prop is not None:
            return learning.attribute_question(scene.kg, finding.subject, prop, context)
    return None


def _source(finding: Finding, report: Report) -> str:
    if finding.step is None:
        return ""
    step = report.steps[finding.step - 1]
    return step.source or step.call.render()


def _existence(subject: str, finding: Finding, context: str, scene: Scene) -> Question | None:
    name = normal(finding.subject)
    if not name or learning.is_absent(scene.kg, name, subject):
        return None
    said = name.replace("_", " ")
    if subject == "action":
        text = f'I do not know how to "{said}". Is it something I can do here?'
        known = (*finding.candidates, *scene.domain.actions)
        return Question(
            "existence",
            name,
            text,
            "",
            "action",
            _EXISTENCE_ACTION,
            tuple(dict.fromkeys(known)),
            finding.candidates,
            context,
        )
    text = f'I do not know "{said}". Is there such a thing in this {scene.domain.name}?'
    known = (*finding.candidates, *_everything(scene))
    return Question(
        "existence",
        name,
        text,
        "",
        "item",
        _EXISTENCE_ITEM,
        tuple(dict.fromkeys(known)),
        finding.candidates,
        context,
    )


_EXISTENCE_ITEM = (
    Choice("is", "it is another name for something you know"),
    Choice(ABSENT, "no, there is none"),
    Choice(EXISTS, "yes, there is: let me tell you about it"),
    Choice("later", "ask me later"),
)
_EXISTENCE_ACTION = (
    Choice("is", "it is another name for something you can do"),
    Choice(ABSENT, "no, it is not possible here"),
    Choice(EXISTS, "yes, it is possible"),
    Choice("later", "ask me later"),
)


def _everything(scene: Scene) -> list[str]:
    kinds = [kind.iri for kind in scene.domain.teachable]
    return sorted(scene.kg.name(entity) for entity in scene.kg.instances(kinds))


def _property(name: str, scene: Scene) -> Property | None:
    return next((p for p in scene.domain.properties.values() if local(p.iri) == name), None)


def _kind_question(finding: Finding, report: Report, scene: Scene, asked: Asked) -> Question | None:
    """What kind of thing something is that a person has said exists."""
    name = normal(finding.subject)
    said = asked.get(("existence", name, "", "item"))
    if finding.code != "E201" or said is None or said[1].value != EXISTS:
        return None
    kinds = possible_kinds(name, report, scene)
    choices = tuple(Choice(local(k.iri), _kind_label(k)) for k in kinds)
    text = f"What is {name.replace('_', ' ')}?"
    question = Question("kind", name, text, choices=choices, context=_source(finding, report))
    return None if question.key in asked else question


def _kind_label(kind: Kind) -> str:
    return f"{kind.label}: {kind.comment}" if kind.comment else kind.label


def possible_kinds(name: str, report: Report, scene: Scene) -> list[Kind]:
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
                kinds = [k for k in kinds if classes & set(k.supers)] or kinds
    return sorted(kinds, key=lambda kind: not likely & set(kind.supers))


def _of_family(action: Action, position: int, scene: Scene) -> set[URIRef]:
    """The classes that an action or others of its family take at a position."""
    family = [a for a in scene.domain.actions.values() if a.family and a.family == action.family]
    return {
        iri
        for member in family or [action]
        for parameter in member.visible[position : position + 1]
        for iri in parameter.classes
    }


def learn(question: Question, answer: Answer, report: Report, scene: Scene) -> Lesson | None:
    """Return what an answer teaches, or None if it teaches nothing yet."""
    if question.kind == "existence":
        return _learn_existence(question, answer, report, scene)
    if question.kind == "kind":
        kind = next((k for k in scene.domain.teachable if local(k.iri) == answer.value), None)
        return None if kind is None else _taught(question, answer, kind, scene)
    return _learn_attribute(question, answer, scene)


def _learn_existence(
    question: Question, answer: Answer, report: Report, scene: Scene
) -> Lesson | None:
    name, kg = question.about, scene.kg
    if answer.same_as:
        return _learn_alias(question, answer, scene)
    if answer.value == ABSENT:
        delta = learning.absence(kg.domain, name, question.subject)
        return Lesson(delta, question, answer, f"there is no {name} here")
    if answer.value != EXISTS:
        return None
    if question.subject == "action":
        return _learn_action(question, answer, report, scene)
    kinds = possible_kinds(name, report, scene)
    return _taught(question, answer, kinds[0], scene) if len(kinds) == 1 else None


def _learn_alias(question: Question, answer: Answer, scene: Scene) -> Lesson | None:
    target: URIRef | None
    if question.subject == "action":
        known = resolve.action(answer.same_as, scene).action
        target = known.iri if known else None
    else:
        target = next(iter(scene.kg.find(answer.same_as)), None)
    if target is None:
        return None
    delta = learning.alias(scene.kg, question.about, target)
    sentence = f"{question.about} is another name for {normal(answer.same_as)}"
    return Lesson(delta, question, answer, sentence)


def _taught(question: Question, answer: Answer, kind: Kind, scene: Scene) -> Lesson:
    delta = learning.existence(scene.kg, question.about, kind)
    return Lesson(delta, question, answer, f"there is {question.about} ({kind.label})")


def _learn_action(question: Question, answer: Answer, report: Report, scene: Scene) -> Lesson:
    step = next(s for s in report.steps if normal(s.call.action) == question.about)
    known = scene.kg.find
    kinds = [
        None if number(arg) and not known(arg) else _kind_of(arg, scene) for arg in step.call.args
    ]
    action, delta = learning.new_action(scene.kg, question.about, kinds)
    sentence = f"{question.about} is possible; its effect is not known"
    return Lesson(delta, question, answer, sentence, action)


def _kind_of(name: str, scene: Scene) -> Kind:
    """The kind of a known thing; of an unknown one, the kind that the domain asks for first."""
    for entity in scene.kg.find(name):
        for kind in scene.domain.teachable:
            if scene.kg.is_a(entity, [kind.iri]):
                return kind
    return scene.domain.teachable[0]


def _learn_attribute(question: Question, answer: Answer, scene: Scene) -> Lesson | None:
    prop = _property(question.prop, scene)
    found = scene.kg.find(question.about)
    if prop is None or not found:
        return None
    value = learning.attribute_value(scene.kg, prop, answer.value)
    if value is None:
        return None
    delta = learning.attribute(scene.kg, found[0], prop, value)
    shown = answer.value if question.kind == "attribute" else scene.kg.name(value)
    return Lesson(delta, question, answer, f"{question.about}: {prop.label} {shown}")


def take(lesson: Lesson, scene: Scene) -> None:
    """Let a lesson be known from now on."""
    if lesson.action is None:
        scene.kg.learn(lesson.delta)
        return
    actions = {**scene.domain.actions, lesson.action.name: lesson.action}
    scene.kg.domain = replace(scene.domain, actions=actions)


def forget(lesson: Lesson, scene: Scene) -> None:
    """Take a lesson back: what it added goes, what it replaced returns."""
    if lesson.action is None:
        scene.kg.learn(Delta(removed=lesson.delta.added, added=lesson.delta.removed))
        return
    actions = {n: a for n, a in scene.domain.actions.items() if n != lesson.action.name}
    scene.kg.domain = replace(scene.domain, actions=actions)
