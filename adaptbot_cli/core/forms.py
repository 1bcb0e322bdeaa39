"""What is to be known of one thing, asked together; and what is offered besides (need first)."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from rdflib import URIRef

from adaptbot_cli.core import asking, learning, suggest
from adaptbot_cli.core.domain import Kind, Property
from adaptbot_cli.core.questions import Question
from adaptbot_cli.core.refine.calls import known_values
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.terms import local


def around(
    question: Question, report: Report, scene: Scene, asked: asking.Asked, full: bool
) -> tuple[Question, ...]:
    """Return a question and the others that this plan needs answers to about the same thing.

    With `full` those of a new thing are all that its kind is asked. Each comes with its likely
    answer.
    """
    if question.kind == "kind":
        kinds = asking.kinds_of_choices(question, scene)
        likely = suggest.Likely(question.about, kinds, scene)
        return (replace(question, suggested=likely.kind()),)
    if not question.spec.together:
        return (question,)
    found = [question, *asking.needed_of(question.about, report, scene, asked)]
    if full and question.about in asking.taught(asked):
        found += _questions(question.about, scene)
    by_key = {each.key: each for each in found if each.key == question.key or each.key not in asked}
    order = _order(question.about, scene)
    first = sorted(by_key.values(), key=lambda each: order.get(each.prop, len(order)))
    return _with_suggestions(first, scene)


def rest(
    name: str,
    scene: Scene,
    asked: asking.Asked,
    besides: Sequence[Question] = (),
) -> tuple[Question, ...]:
    """Return what the kind of a new thing is asked, of which this plan needs nothing."""
    there = {question.key for question in besides}
    found = (question for question in _questions(name, scene) if question.key not in asked)
    return _with_suggestions([question for question in found if question.key not in there], scene)


def unoffered(asked: asking.Asked, offers: set[str], question: Question | None) -> str | None:
    """Return a new thing of which nothing more is needed, but that could be told more of."""
    about = question.about if question is not None else None
    return next((n for n in asking.taught(asked) if n not in offers and n != about), None)


def is_open(question: Question, scene: Scene) -> bool:
    """Tell whether a question still has no answer: none was learned, and none follows."""
    prop = asking.property_called(question.prop, scene)
    entities = scene.kg.find(question.about)
    return prop is None or not entities or not known_values(scene.kg, entities[0], prop.iri)


def _questions(name: str, scene: Scene) -> Iterable[Question]:
    """All that the kind of a thing is asked, in the domain's order, where it is not known."""
    for entity in scene.kg.find(name)[:1]:
        for prop in _asked_of(entity, scene):
            question = learning.attribute_question(scene.kg, name, prop, "")
            if is_open(question, scene):
                yield question


def _asked_of(entity: URIRef, scene: Scene) -> list[Property]:
    props = scene.domain.properties
    return [props[iri] for k in _kinds(entity, scene) for iri in k.asks if iri in props]


def _kinds(entity: URIRef, scene: Scene) -> list[Kind]:
    return [kind for kind in scene.domain.teachable if scene.kg.is_of(entity, kind)]


def _order(name: str, scene: Scene) -> dict[str, int]:
    """The domain's order of what is asked of a thing: places first, as a rule."""
    found = [local(p.iri) for e in scene.kg.find(name)[:1] for p in _asked_of(e, scene)]
    return {prop: n for n, prop in enumerate(dict.fromkeys(found))}


def _with_suggestions(questions: Sequence[Question], scene: Scene) -> tuple[Question, ...]:
    """Questions about one thing, each with its likely answer if there is one."""
    if not questions:
        return ()
    entities = scene.kg.find(questions[0].about)[:1]
    kinds = [kind for entity in entities for kind in _kinds(entity, scene)]
    likely = suggest.Likely(questions[0].about, kinds, scene)
    return tuple(_with_suggestion(question, likely, scene) for question in questions)


def _with_suggestion(question: Question, likely: suggest.Likely, scene: Scene) -> Question:
    prop = asking.property_called(question.prop, scene)
    if prop is None or question.kind == "value":
        return question
    found = likely.attribute(prop)
    if found is not None and found.value not in {choice.value for choice in question.choices}:
        return question
    return replace(question, suggested=found)
