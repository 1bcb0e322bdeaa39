"""Answers that contradict what is known: both are shown, and the person says which stands."""

from collections.abc import Sequence
from dataclasses import replace

from rdflib import RDF, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.questions import NEW, OLD, Choice, Question
from adaptbot_cli.core.refine.calls import known_values
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.terms import AB, FALSE, TRUE, Triple, local


def contradicted(lesson: Lesson, scene: Scene) -> tuple[Triple, ...]:
    """Return the known facts that cannot be true beside what a lesson adds.

    These are other values of an attribute that has one value, values that its new facts exclude
    (`ab:impliedBy`), facts that exclude its new values, and that there is no such thing.
    """
    if lesson.question.kind == "contradiction":
        return ()
    found = set(lesson.delta.removed)
    for fact in lesson.delta.added:
        found |= set(_excluded_by(fact, scene)) | set(_excluding(fact, scene))
        found |= set(_stated_absent(fact, lesson, scene))
    return tuple(sorted(found - lesson.delta.added))


def doubted(question: Question, scene: Scene) -> tuple[Triple, ...]:
    """Return the known facts that say what a question about an attribute asks all the same."""
    props = [p for p in scene.domain.properties.values() if local(p.iri) == question.prop]
    if question.kind != "attribute" or not props:
        return ()
    implying = {(i.prop, i.equals) for i in props[0].implied}
    found = (fact for entity in scene.kg.find(question.about)
             for fact in scene.kg.facts.triples((entity, None, None)))  # fmt: skip
    return tuple(f for f in found if f[1] == props[0].iri or (f[1], f[2]) in implying)


def is_so(question: Question, scene: Scene) -> bool:
    """Tell whether it is known, or follows, that a yes is the answer to a question."""
    props = [p for p in scene.domain.properties.values() if local(p.iri) == question.prop]
    things = scene.kg.find(question.about)
    return any(TRUE in known_values(scene.kg, e, p.iri) for e in things[:1] for p in props)


def _excluded_by(fact: Triple, scene: Scene) -> list[Triple]:
    """Known values other than those that follow from a new fact."""
    subject, predicate, value = fact
    return [
        (subject, prop.iri, known)
        for prop in scene.domain.properties.values()
        for implied in prop.implied
        if (implied.prop, implied.equals) == (predicate, value)
        for known in scene.kg.facts.objects(subject, prop.iri)
        if known != implied.value
    ]


def _excluding(fact: Triple, scene: Scene) -> list[Triple]:
    """Known facts from which another value than the new one follows."""
    subject, predicate, value = fact
    prop = scene.domain.properties.get(predicate)  # type: ignore[call-overload]
    return [
        (subject, implied.prop, implied.equals)
        for implied in (prop.implied if prop else ())
        if implied.value != value and (subject, implied.prop, implied.equals) in scene.kg.facts
    ]


def _stated_absent(fact: Triple, lesson: Lesson, scene: Scene) -> list[Triple]:
    if fact[1] != RDF.type or lesson.action is not None:
        return []
    absent = (scene.domain.iri, AB.absentItem, Literal(normal(lesson.question.about)))
    return [absent] if absent in scene.kg.facts else []


def which_stands(
    lesson: Lesson,
    old: Sequence[Triple],
    origins: Sequence[str],
    learned: Sequence[Lesson],
    scene: Scene,
) -> Question:
    """Return the question which of two facts stands; `origins` say where the old ones come from."""
    lines = [in_words(fact, scene) for fact in old]
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


def settled(lesson: Lesson, old: Sequence[Triple], scene: Scene) -> Lesson:
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
    other = {f for f in doubted if f[:2] in found and f not in lesson.delta.added}
    old = sorted({*contradicted(lesson, scene), *other})
    return settled(lesson, old, scene) if old else None


def in_words(fact: Triple, scene: Scene) -> str:
    """Write a fact as people say it: "papaya: sliceable, no"."""
    subject, predicate, value = fact
    if predicate in (AB.absentItem, AB.absentAction):
        return f"there is no {str(value).replace('_', ' ')} here"
    prop = scene.domain.properties.get(predicate)  # type: ignore[call-overload]
    label = prop.label if prop else local(predicate)
    words: dict[Node, str] = {TRUE: "yes", FALSE: "no"}
    shown = words.get(value) or (scene.kg.name(value) if isinstance(value, URIRef) else str(value))
    name = scene.kg.name(subject)
    return f"{name.replace('_', ' ')}: {label} {shown.replace('_', ' ')}"


def short(fact: Triple) -> str:
    """Write a fact as commits do: `papaya IsSliceable true`."""
    return " ".join(local(node) for node in fact)
