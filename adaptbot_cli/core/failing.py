"""What to ask the person when a step failed in the world, and what follows from the answer."""

from collections.abc import Generator, Iterator
from dataclasses import replace
from typing import Any

from rdflib import XSD, URIRef

from adaptbot_cli.core import teach
from adaptbot_cli.core.acts import by_hand, failure, lost, placed
from adaptbot_cli.core.learning import attribute_question
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.questions import (
    AGAIN,
    AT,
    BY_HAND,
    IS_NOT,
    IS_SO,
    LATER,
    NO,
    SKIP,
    STOP,
    UNKNOWN,
    YES,
    Answer,
    Choice,
    Question,
)
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.run import Acting, Run, look_at
from adaptbot_cli.core.terms import TRUE
from adaptbot_cli.core.turns import Ask, Learned, Turn
from adaptbot_cli.core.world import Acted


def ask_what_now(run: Run, acting: Acting, report: Report) -> Generator[Turn, Any, Report]:
    """Ask what to do about the step that failed last; return the report on the remaining plan.

    Where it is not known any more where a thing is, that is asked; else what the person knows.
    """
    finding = failure(acting)
    if finding is None or run.stopped:
        return report
    last, why = acting.acts[-1], finding.message
    missed = lost(run, last)
    question = _where(run, *missed[0], why) if missed else _what_now(run, acting, why)
    answer = yield from _answered(run, question)
    if answer is None:
        return report
    lines = acting.left.splitlines()
    if answer.value.startswith(AT):
        name = answer.value.removeprefix(AT)
        found = next(each for each in placed(run, last) if normal(run.kg.name(each[0])) == name)
        question = _where(run, *found, why)
        answer = yield from _answered(run, question)
        if answer is None:
            return report
    elif answer.value.startswith((IS_SO, IS_NOT)):
        denied = _attributes(run, last)
        question, value = next((q, v) for q, v in denied if _denial(q, v) == answer.value)
        answer = replace(answer, value=value)
    elif answer.value == BY_HAND:
        yield from by_hand(run, acting)
    if answer.value in (BY_HAND, SKIP) and last.step.status != "inserted":
        lines = lines[1:]
    if question.kind in ("place", "attribute"):
        yield from _teach(run, report, question, answer)
    acting.left = "\n".join(lines)
    if not lines:
        return Report(run.task, "", (), ())
    return (yield from look_at(run, acting.left))


def _answered(run: Run, question: Question) -> Generator[Turn, Any, Answer | None]:
    """The person's answer, None if it was put off or is unknown."""
    answer: Answer = yield Ask(question)
    run.asked[question.key] = (question, answer)
    run.stopped = run.stopped or answer.value == STOP.value or answer.last
    if answer.value in (LATER.value, STOP.value, UNKNOWN):
        return None
    run.usage = replace(run.usage, questions=run.usage.questions + 1)
    return answer


def _teach(
    run: Run, report: Report, question: Question, answer: Answer
) -> Generator[Turn, Any, None]:
    """Learn the answer unchecked for contradictions: the world has just refuted the belief."""
    run.asked[question.key] = (question, answer)
    for lesson in teach.lessons(question, answer, report, run.scene, run.asked):
        teach.take(lesson, run.scene)
        run.lessons.append(lesson)
        yield Learned(lesson)


def _where(run: Run, entity: URIRef, prop: URIRef, why: str) -> Question:
    name = normal(run.kg.name(entity))
    question = attribute_question(run.kg, name, run.kg.domain.properties[prop], "")
    notes = (why, *(f"seen: {sentence}" for sentence in run.seen(3, name)))
    return replace(question, notes=notes, text=f'Where is "{name.replace("_", " ")}"?')


def _attributes(run: Run, last: Acted) -> Iterator[tuple[Question, str]]:
    """The attributes the step requires, as questions, each with the answer that denies it."""
    for need in last.bound.action.attributes:
        entity = last.bound.values.get(need.of)
        prop = run.kg.domain.properties.get(need.prop)
        if entity is not None and prop is not None:
            name = normal(run.kg.name(entity))
            value = NO if need.value == TRUE else YES
            yield attribute_question(run.kg, name, prop, ""), value
    # What a condition asks of an attribute that is known may be known wrongly.
    asked = {p for c in last.bound.action.conditions for p in c.predicates}
    props = [p for p in run.kg.domain.properties.values() if p.iri in asked]
    for prop in (p for p in props if p.graph == "attribute" and p.range == XSD.boolean):
        for entity in last.bound.values.values():
            known = run.kg.value(entity, prop.iri)
            if known is not None:
                name = normal(run.kg.name(entity))
                yield attribute_question(run.kg, name, prop, ""), NO if known == TRUE else YES


def _denial(question: Question, value: str) -> str:
    """The choice that denies an attribute the step requires."""
    return f"{IS_SO if value == YES else IS_NOT}{question.prop} {question.about}"


def _what_now(run: Run, acting: Acting, why: str) -> Question:
    last = acting.acts[-1]
    choices = [
        Choice(AGAIN, "try it again"),
        Choice(BY_HAND, "it is done now: I have seen to it"),
        Choice(SKIP, "leave it out"),
    ]
    for entity, _ in placed(run, last):
        name = normal(run.kg.name(entity))
        choices.append(Choice(f"{AT}{name}", f"{name.replace('_', ' ')} is somewhere else"))
    for question, value in _attributes(run, last):
        text = f"{question.about.replace('_', ' ')}: {question.label} {value}"
        choices.append(Choice(_denial(question, value), text))
    choices.append(Choice(LATER.value, "I cannot say: stop here"))
    about = normal(
        next((run.kg.name(v) for v in last.bound.values.values()), last.step.call.action)
    )
    return Question(
        "failed",
        about,
        f"{why}. What now?",
        last.step.call.action,
        choices=tuple(dict.fromkeys(choices)),
        notes=tuple(f"seen: {sentence}" for sentence in run.seen(3)),
    )
