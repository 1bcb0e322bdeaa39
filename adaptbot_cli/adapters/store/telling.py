"""What a commit says: what was learned, and the question and answer behind every fact."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

from adaptbot_cli.core.faults import Fault
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.terms import local
from adaptbot_cli.core.turns import Keep


@dataclass(frozen=True, slots=True)
class Origin:
    """Where what is learned comes from: named in every commit."""

    planner: str
    transcript: str
    now: Callable[[], datetime]


def lessons_message(turn: Keep, origin: Origin) -> str:
    """Write the message of a commit of lessons, with a trailer for each fact's provenance."""
    title = turn.lessons[0].sentence
    more = len(turn.lessons) - 1
    subject = f"learn: {title}" + (f" (and {more} more)" if more else "")
    facts = "\n".join(f"  {lesson.sentence}" for lesson in turn.lessons)
    trailers = [f"Task: {turn.task.name}", f"Planner: {origin.planner}"]
    trailers += [f"Transcript: {origin.transcript}"] if origin.transcript else []
    for number, lesson in enumerate(turn.lessons, start=1):
        trailers += list(_provenance(number, lesson))
    return f"{_one_line(subject)}\n\n{facts}\n\n" + "\n".join(map(_one_line, trailers)) + "\n"


def _provenance(number: int, lesson: Lesson) -> Iterator[str]:
    yield f"Question-{number}: {lesson.question.text}"
    said = " ".join(part for part in (lesson.answer.value, _by(lesson)) if part)
    yield f"Answer-{number}: {said}"
    for sign, triples in (("-", lesson.delta.removed), ("+", lesson.delta.added)):
        for triple in sorted(triples):
            yield f"Fact-{number}: {sign} {' '.join(local(node) for node in triple)}"


def _by(lesson: Lesson) -> str:
    by, at = lesson.answer.by, lesson.answer.at
    return f"({', '.join(part for part in (by, at) if part)})" if by or at else ""


def state_message(task: str, origin: Origin) -> str:
    """Write the message of a commit of the state that a plan leaves."""
    subject = _one_line(f'state: after "{task}"')
    return f"{subject}\n\nTask: {_one_line(task)}\nPlanner: {origin.planner}\n"


def _one_line(text: str) -> str:
    return " ".join(text.split())


def refusal(where: str, faults: Iterable[Fault], lessons: Sequence[Lesson], hint: str) -> str:
    """Say why a change is refused: each fault, and the answers that caused it."""
    told = "; ".join(f"{fault.plain}{_cause(fault, lessons)}" for fault in faults)
    rest = f"; {hint}" if hint else ""
    return f"this cannot be kept beside what {where} holds now: {told}. Nothing was changed{rest}."


def _cause(fault: Fault, lessons: Sequence[Lesson]) -> str:
    direct = [lesson for lesson in lessons if lesson.delta.added & fault.facts]
    near = [lesson for lesson in lessons if fault.about in {t[0] for t in _all_of(lesson)}]
    said = [f'"{x.answer.value}" to "{x.question.text}"' for x in direct or near]
    return f" (from the answer {' and '.join(said)})" if said else ""


def _all_of(lesson: Lesson) -> Iterable[tuple[object, object, object]]:
    return lesson.delta.added | lesson.delta.removed
