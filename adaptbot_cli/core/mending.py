"""The offer to change a plan so that it reaches its goal, as one question to the person."""

from collections.abc import Generator
from dataclasses import replace
from typing import Any

from adaptbot_cli.core.amending import amended, unsolved
from adaptbot_cli.core.dialogue import ask, ask_about
from adaptbot_cli.core.learning import attribute_question
from adaptbot_cli.core.mend import Mended, mended
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.questions import EDIT, LATER, NO, STOP, YES, Answer, Choice, Question
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.run import Run, as_edited, look_at
from adaptbot_cli.core.turns import Ask, Turn

_CHOICES = (
    Choice(YES, "yes, change it"),
    Choice(NO, "no, leave it as it is"),
    Choice(EDIT, "let me change it myself"),
)


def mend(run: Run, report: Report) -> Generator[Turn, Any, Report]:
    """Offer the changes that bring a plan nearer to its goal, each once; make them if agreed to.

    What they need and nobody has said is asked first, and so is what an edit instead of them brings
    up. The paper's policy offers nothing.
    """
    if run.policy == "paper" or run.stopped or not unsolved(run, report):
        return report
    offered = mended(report, run.scene, run.parse)
    if offered is not None and offered.supposed:
        for question in _unknown(run, offered):
            report = yield from ask_about(run, report, question)
        offered = None if run.stopped else mended(report, run.scene, run.parse)
    if offered is None or offered.supposed:
        return report
    return (yield from _offer(run, report, offered))


def _unknown(run: Run, offered: Mended) -> list[Question]:
    """The questions that nobody has been asked for what an offer supposes."""
    kg = run.kg
    found = [
        attribute_question(kg, normal(kg.name(entity)), kg.domain.properties[prop], "")  # type: ignore[index]
        for entity, prop, _ in offered.supposed
        if prop in kg.domain.properties
    ]
    return [question for question in found if question.key not in run.asked]


def _offer(run: Run, report: Report, offered: Mended) -> Generator[Turn, Any, Report]:
    then = "Then it reaches its goal." if offered.reaches else "Then it is nearer to its goal."
    question = Question(
        "mend",
        normal(run.task.name),
        f"Shall I change the plan like this? {then}",
        offered.text,  # who agreed to one plan has not agreed to another
        choices=_CHOICES,
        notes=offered.changes,
    )
    if question.key in run.asked:
        return report
    answer: Answer = yield Ask(replace(question, answered=run.answered))
    if answer.value == EDIT:
        edited = yield from amended(run, report, "asked")
        return report if edited is report else (yield from ask(run, edited))
    if answer.value == STOP.value:
        run.stopped, answer = True, LATER
    run.asked[question.key] = (question, answer)
    if answer.value != LATER.value:
        run.usage = replace(run.usage, questions=run.usage.questions + 1)
    if answer.value != YES:
        return report
    return (yield from look_at(run, as_edited(run, offered.text)))
