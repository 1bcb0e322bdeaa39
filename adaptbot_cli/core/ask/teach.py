"""What an answer teaches, and what known facts it contradicts (paper, III-C)."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from rdflib import RDF, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.ask import learning, new_action
from adaptbot_cli.core.ask.agenda import (
    Asked,
    kinds_of_place,
    possible_kinds,
    property_called,
    unknown_action,
)
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import ABSENT, EXISTS, NEW, OLD, Answer, Choice, Key, Question
from adaptbot_cli.core.domain import Action, ItemClass
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.robots import held_by_others
from adaptbot_cli.core.graph.terms import AB, FALSE, TRUE, Triple, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.grounding import known_values
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene


def lessons(
    question: Question, answer: Answer, report: Report, scene: Scene, asked: Asked
) -> Iterator[Lesson]:
    """Give what an answer teaches, one by one: each is to be taken before the next is asked for.

    A new place is taught before what is kept there: answers that name it as a place wait for it.
    """
    kinds = kinds_of_place(question.prop, scene) if answer.new else []
    if len(kinds) == 1 and not scene.kg.find(answer.new):
        yield _taught(replace(question, about=normal(answer.new)), answer, kinds[0], scene)
    lesson = learn(question, answer, report, scene, asked)
    if lesson is not None:
        yield lesson
    if question.kind == "kind":
        for waiting, reply in list(asked.values()):
            if normal(reply.new) == question.about and reply.new:
                placed = _learn_attribute(waiting, reply, scene)
                if placed is not None:
                    yield placed


def learn(
    question: Question, answer: Answer, report: Report, scene: Scene, asked: Asked
) -> Lesson | None:
    """Return what an answer teaches, or None if it teaches nothing yet.

    `asked` are the answers of the run, this one included.
    """
    if question.kind == "action":
        return _learn_action(question, answer, report, scene, asked)
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
    if answer.same_as or answer.instead:
        return _learn_alias(question, answer, scene)
    if answer.value == ABSENT:
        delta = learning.absence(kg.domain, name, question.subject)
        return Lesson(delta, question, answer, f"there is no {name} here")
    if answer.value != EXISTS:
        return None
    if question.subject == "action":
        return None
    kinds = possible_kinds(name, report, scene)
    return _taught(question, answer, kinds[0], scene) if len(kinds) == 1 else None


def _learn_alias(question: Question, answer: Answer, scene: Scene) -> Lesson | None:
    """Another name for something known; what is only used instead is called so for this run."""
    target: URIRef | None
    meant = answer.same_as or answer.instead
    if question.subject == "action":
        known = resolve.action(meant, scene).action
        target = known.iri if known else None
    else:
        target = next(iter(scene.kg.find(meant)), None)
    if target is None:
        return None
    delta = learning.alias(question.about, target)
    if answer.instead:
        sentence = f"{normal(meant)} instead of {question.about}, this time only"
        return Lesson(delta, question, answer, sentence, once=True)
    sentence = f"{question.about} is another name for {normal(meant)}"
    return Lesson(delta, question, answer, sentence)


def _taught(question: Question, answer: Answer, kind: ItemClass, scene: Scene) -> Lesson:
    delta = learning.existence(scene.kg, question.about, kind)
    return Lesson(delta, question, answer, f"there is {question.about} ({kind.label})")


def _learn_action(
    question: Question, answer: Answer, report: Report, scene: Scene, asked: Asked
) -> Lesson | None:
    """The lesson of a dialogue about an action, with all its answers in the question's text."""
    text = asked[("existence", question.about, "", "action")][1].value
    taught = new_action.played(unknown_action(question.about, report), text, scene.kg, asked)
    if not isinstance(taught, new_action.TaughtAction):
        return None
    question = replace(question, text=f"{question.text} {' · '.join(taught.notes)}")
    return Lesson(
        taught.delta,
        question,
        answer,
        taught.sentence,
        taught.action,
        taught.replaces,
        taught.notes,
    )


def _learn_attribute(question: Question, answer: Answer, scene: Scene) -> Lesson | None:
    prop = property_called(question.prop, scene)
    found = scene.kg.find(question.about)
    if prop is None or not found:
        return None
    value = learning.attribute_value(scene.kg, prop, answer.new or answer.value)
    if value is None:
        return None
    delta = learning.attribute(scene.kg, found[0], prop, value)
    shown = scene.kg.name(value) if question.kind == "place" else answer.value
    return Lesson(delta, question, answer, f"{question.about}: {prop.label} {shown}")


def accept(lesson: Lesson, scene: Scene) -> None:
    """Let a lesson be known from now on."""
    if lesson.once:
        scene.instead.add(lesson.question.about)
    if lesson.action is None:
        scene.kg.learn(lesson.delta)
    else:
        _put(lesson.action.name, lesson.action, scene)


def retract(lesson: Lesson, scene: Scene) -> None:
    """Take a lesson back: what it added goes, what it replaced returns."""
    if lesson.once:
        scene.instead.discard(lesson.question.about)
    if lesson.action is None:
        scene.kg.learn(lesson.delta.inverse)
    else:
        _put(lesson.action.name, lesson.replaces, scene)


def _put(name: str, action: Action | None, scene: Scene) -> None:
    actions = {**scene.domain.actions, name: action}
    known = {name: action for name, action in actions.items() if action is not None}
    scene.kg.domain = replace(scene.domain, actions=known)


def resting_on(keys: Iterable[Key], lessons: Sequence[Lesson]) -> set[Key]:
    """Return the keys of the lessons that go if some do.

    Facts about a thing go with it; and a new thing goes with its place: a plan that fetches it was
    judged on that.
    """
    gone = set(keys)
    while True:
        out = [lesson for lesson in lessons if lesson.question.key in gone]
        placed = {
            s for each in out if each.question.kind == "place" for s, _, _ in each.delta.added
        }
        taught = {s for each in out for s, p, _ in each.delta.added if p == RDF.type}
        resting = {
            lesson.question.key
            for lesson in lessons
            for fact in lesson.delta.added
            if taught.intersection(fact) or (fact[1] == RDF.type and fact[0] in placed)
        }
        if resting <= gone:
            return gone
        gone |= resting


def contradicted(lesson: Lesson, scene: Scene) -> tuple[Triple, ...]:
    """Return the known facts that cannot be true beside what a lesson adds.

    These are other values of an attribute that has one value, values that its new facts exclude
    (`ab:impliedBy`), facts that exclude its new values, and that there is no such thing.
    """
    if lesson.question.kind == "contradiction":
        return ()
    found = set(lesson.delta.removed)
    for fact in lesson.delta.added:
        found |= set(_excluding(fact, lesson, scene))
    return tuple(sorted(found - lesson.delta.added))


def doubted(question: Question, scene: Scene) -> tuple[Triple, ...]:
    """Return the known facts that say what a question about an attribute asks all the same, or that
    another robot holds what a place is asked of."""
    prop = property_called(question.prop, scene)
    if question.kind == "place":
        things = scene.kg.find(question.about)[:1]
        return tuple(fact for fact in held_by_others(scene.kg) if fact[2] in things)
    if question.kind != "attribute" or prop is None:
        return ()
    implying = {(i.prop, i.equals) for i in prop.implied}
    found = (fact for entity in scene.kg.find(question.about)
             for fact in scene.kg.facts.triples((entity, None, None)))  # fmt: skip
    return tuple(f for f in found if f[1] == prop.iri or (f[1], f[2]) in implying)


def is_so(question: Question, scene: Scene) -> bool:
    """Tell whether it is known, or follows, that a yes is the answer to a question."""
    prop, things = property_called(question.prop, scene), scene.kg.find(question.about)[:1]
    return prop is not None and any(TRUE in known_values(scene.kg, e, prop.iri) for e in things)


def _excluding(fact: Triple, lesson: Lesson, scene: Scene) -> Iterator[Triple]:
    """Known facts that a new one excludes, or from which another value than the new one follows."""
    (subject, predicate, value), facts = fact, scene.kg.facts
    for prop in scene.domain.properties.values():
        for implied in prop.implied:
            if (implied.prop, implied.equals) == (predicate, value):
                known = facts.triples((subject, prop.iri, None))
                yield from (other for other in known if other[2] != implied.value)
            cause = (subject, implied.prop, implied.equals)
            if prop.iri == predicate and implied.value != value and cause in facts:
                yield cause
    absent = (scene.domain.iri, AB.absentItem, Literal(normal(lesson.question.about)))
    if predicate == RDF.type and lesson.action is None and absent in facts:
        yield absent


def which_stands(
    lesson: Lesson,
    old: Sequence[Triple],
    origins: Sequence[str],
    learned: Sequence[Lesson],
    scene: Scene,
) -> Question:
    """Return the question which of two facts stands; `origins` say where the old ones come from."""
    lines = [in_words(fact, scene.kg) for fact in old]
    from_here = {fact for before in learned for fact in before.delta.added}
    sources = [
        "you said so in this run" if fact in from_here else origin
        for fact, origin in zip(old, [*origins, *[""] * len(old)], strict=False)
    ]
    known = "; ".join(f"{t} ({s})" if s else t for t, s in zip(lines, sources, strict=True))
    question = lesson.question
    return Question(
        "contradiction",
        question.about,
        f"{lesson.sentence}, but {' and '.join(lines)}. Which is right?",
        question.prop or question.kind,
        question.subject,
        (
            Choice(NEW, lesson.sentence, "what was known is corrected", "n"),
            Choice(OLD, " and ".join(lines), "your answer is not kept", "o"),
            Choice("later", "ask me later", "what was known stays", "l"),
        ),
        context=f"known so far: {known}",
    )


def settled(lesson: Lesson, old: Sequence[Triple]) -> Lesson:
    """Return a lesson that also corrects what it contradicts.

    A boolean that is excluded becomes its opposite; any other fact goes.
    """
    opposite: dict[Node, Node] = {TRUE: FALSE, FALSE: TRUE}
    changed = [fact for fact in old if fact not in lesson.delta.removed]
    added = {(s, p, opposite[v]) for s, p, v in changed if v in opposite}
    removed = lesson.delta.removed | set(changed)
    return replace(lesson, delta=Delta(removed, lesson.delta.added | added))


def corrected(lesson: Lesson, doubted: Sequence[Triple], scene: Scene) -> Lesson | None:
    """Return what an answer corrects of the facts that it was asked in doubt of, None if it says
    what they say."""
    found = {(subject, predicate) for subject, predicate, _ in lesson.delta.added}
    placed = {s for s, _, _ in lesson.delta.added} if lesson.question.kind == "place" else set()
    other = {
        fact
        for fact in doubted
        if (fact[:2] in found and fact not in lesson.delta.added) or fact[2] in placed
    }
    old = sorted({*contradicted(lesson, scene), *other})
    return settled(lesson, old) if old else None


def in_words(fact: Triple, kg: Kg) -> str:
    """Write a fact as people say it: "papaya: sliceable, no"."""
    subject, predicate, value = fact
    if predicate in (AB.absentItem, AB.absentAction):
        return f"there is no {str(value).replace('_', ' ')} here"
    words: dict[Node, str] = {TRUE: "yes", FALSE: "no"}
    shown = words.get(value) or (kg.name(value) if isinstance(value, URIRef) else str(value))
    name, label = kg.name(subject).replace("_", " "), kg.domain.label(predicate)
    return f"{name}: {label} {shown.replace('_', ' ')}"


def short(fact: Triple) -> str:
    """Write a fact as commits do: `papaya IsSliceable true`."""
    return " ".join(local(node) for node in fact)
