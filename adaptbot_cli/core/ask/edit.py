"""A plan changed by hand: a pure function from its calls and an edit to its new text."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from adaptbot_cli.core.plan import Call, Finding, Parsed
from adaptbot_cli.core.report import Report
from adaptbot_cli.errors import UsageError

EditKind = Literal["replace", "drop", "insert", "move", "reject"]
EDITS: tuple[EditKind, ...] = ("replace", "drop", "insert", "move", "reject")


@dataclass(frozen=True, slots=True)
class Edit:
    """A change of a plan, by the numbers of its steps as the report has them, counted from 1.

    `replace` puts `text`, a call, in the place of `step`; `insert` puts it before `step`, which is
    one more than the last to append; `move` takes `step` to before `to`; `drop` leaves it out.
    `reject` wants another plan: `text` is the reason. `by` and `at` say who said so and when.
    """

    kind: EditKind
    step: int = 0
    to: int = 0
    text: str = ""
    by: str = ""
    at: str = ""


@dataclass(frozen=True, slots=True)
class EditableCall:
    """A call of a plan that can be edited, with the number that its step has in the report."""

    number: int
    call: Call


def lines(report: Report) -> list[EditableCall]:
    """Return the calls that a plan writes, each as it is written, with the numbers of their steps.

    A call that stands for several is those several. Inserted steps are not among them: a check
    inserts them again.
    """
    numbered = [(n, s) for n, s in enumerate(report.steps, start=1) if s.place is not None]
    found = []
    for number, step in numbered:
        alone = sum(other.place == step.place for _, other in numbered) == 1
        written = alone and step.place is not None
        found.append(
            EditableCall(number, report.written[step.place or 0].call if written else step.call)
        )
    return found


def edited(edit: Edit, report: Report, parse: Callable[[str], Parsed]) -> str:
    """Return the text of a plan after an edit, one call a line.

    Raises:
        UsageError: there is no such step to edit, or the text is no call.
    """
    there = lines(report)
    calls = [line.call for line in there]
    if edit.kind == "insert":
        at = _before(edit.step, there, report)
        return _text([*calls[:at], *called(edit.text, parse), *calls[at:]])
    at = _index(edit.step, there)
    if edit.kind == "replace":
        return _text([*calls[:at], *called(edit.text, parse), *calls[at + 1 :]])
    if edit.kind == "drop":
        return _text([*calls[:at], *calls[at + 1 :]])
    if edit.kind == "move":
        to = _before(edit.to, there, report)
        rest = [*calls[:at], *calls[at + 1 :]]
        to -= to > at
        return _text([*rest[:to], calls[at], *rest[to:]])
    raise UsageError(f"a plan that is rejected has no new text ({edit.kind})")


def called(text: str, parse: Callable[[str], Parsed]) -> list[Call]:
    """Return the calls that a person has written. Raises UsageError if it is none."""
    parsed = parse(text)
    if parsed.findings or not parsed.calls:
        why = parsed.findings[0].message if parsed.findings else "there is none"
        raise UsageError(f'"{text}" is no call: {why}')
    return [written.call for written in parsed.calls]


def _index(number: int, there: list[EditableCall]) -> int:
    for n, line in enumerate(there):
        if line.number == number:
            return n
    text = ", ".join(str(line.number) for line in there)
    raise UsageError(f"step {number} cannot be edited; the steps that the plan writes are {text}")


def _before(number: int, there: list[EditableCall], report: Report) -> int:
    """Where in the plan's calls something goes that is to stand before a step of the report."""
    if not 1 <= number <= len(report.steps) + 1:
        raise UsageError(f"there is no step {number} to put anything before")
    return sum(line.number < number for line in there)


def _text(calls: list[Call]) -> str:
    return "\n".join(call.render() for call in calls) + "\n"


def rejection(edit: Edit) -> Finding:
    """Return the finding of a plan that a person has rejected."""
    because = f": {edit.text}" if edit.text else ""
    return Finding("E504", f"a person has rejected this plan{because}")
