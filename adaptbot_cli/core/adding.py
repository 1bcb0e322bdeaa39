"""Teaching a thing without a task: existence is known; kind, place and attributes are asked."""

from collections.abc import Generator
from typing import Any

from rdflib import URIRef

from adaptbot_cli.core import learning, teach
from adaptbot_cli.core.domain import Kind
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.questions import Answer, Choice, Question
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.terms import local
from adaptbot_cli.core.turns import Ask, Keep, Kept, Learned, Review, Turn

Turns = Generator[Turn, Any, tuple[tuple[Lesson, ...], str | None]]


def teach_thing(name: str, kg: Kg) -> Turns:
    """Ask what a thing is, where it is kept and what is true of it; return lessons and revision.

    A thing that is known already is asked what is not known of it yet. The revision is None if
    nothing was kept: nothing was answered, or the review was refused.
    """
    task = Task(f"add {normal(name)}")
    scene = Scene(kg, task)
    report = Report(task, "", (), (), (), ())
    lessons: list[Lesson] = []
    if not kg.find(name):
        yield from _ask(_kind_question(name, kg), report, scene, lessons)
    for entity in kg.find(name)[:1]:
        for question in _open_questions(name, entity, kg):
            yield from _ask(question, report, scene, lessons)
    told = tuple(lessons)
    if not told or not (yield Review(told)):
        for lesson in reversed(told):
            teach.forget(lesson, scene)
        return told, None
    kept: Kept = yield Keep(task, told)
    return told, kept.revision


def _ask(
    question: Question, report: Report, scene: Scene, lessons: list[Lesson]
) -> Generator[Turn, Any, None]:
    answer: Answer = yield Ask(question)
    lesson = teach.learn(question, answer, report, scene, {question.key: (question, answer)})
    if lesson is not None:
        teach.take(lesson, scene)
        lessons.append(lesson)
        yield Learned(lesson)


def _kind_question(name: str, kg: Kg) -> Question:
    choices = tuple(Choice(local(kind.iri), _label(kind)) for kind in kg.domain.teachable)
    return Question("kind", normal(name), f"What is {_said(name)}?", choices=choices)


def _label(kind: Kind) -> str:
    return f"{kind.label}: {kind.comment}" if kind.comment else kind.label


def _said(name: str) -> str:
    return normal(name).replace("_", " ")


def _open_questions(name: str, entity: URIRef, kg: Kg) -> Generator[Question, None, None]:
    """The domain's questions for a kind, without those answered or settled by now."""
    kinds = [kind for kind in kg.domain.teachable if kg.is_a(entity, [kind.iri])]
    asked = [kg.domain.properties[iri] for kind in kinds for iri in kind.asks]
    for prop in dict.fromkeys(asked):
        implied = any(kg.value(entity, rule.prop) == rule.equals for rule in prop.implied)
        if kg.value(entity, prop.iri) is None and not implied:
            yield learning.attribute_question(kg, normal(name), prop, "")
