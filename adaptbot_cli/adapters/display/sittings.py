"""The open questions on the terminal: what waits, what is being learned, what came of it."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.display.cells import GOOD, WARNING, cell, count, joined, noted, table
from adaptbot_cli.adapters.display.screen import kept, verdict
from adaptbot_cli.core.ask.pending import Pending, Sitting
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Ask, Learned, Review, Turn


def listing(pending: Sequence[Pending]) -> Table:
    """Show the open questions, the most useful first, with the tasks that wait for them."""
    found = table("question", "tasks", "steps")
    for column, ratio in zip(found.columns, (3, 2), strict=False):
        column.ratio = ratio
    found.columns[2].justify = "right"
    for each in pending:
        found.add_row(cell(each.question.text), cell(", ".join(each.tasks)), str(each.steps))
    return found


def came_of(sitting: Sitting) -> RenderableType:
    """Show what each task is worth now, and what is still open."""
    lines = [_result(result, sitting) for result in sitting.results]
    still = f"{count(len(sitting.still), 'question')} still open" if sitting.still else ""
    return Group(*lines, Text("  ") + joined((kept(sitting.lessons, sitting.revision), still)))


def _result(result: Result, sitting: Sitting) -> Text:
    name = result.report.task.name
    waits = sum(name in each.tasks for each in sitting.still)
    mark, text = verdict(result)
    if waits and result.goal_met:
        mark, text = WARNING, "executable without what is open"
    return noted(mark, f"{name}: {text}" + (f"; {count(waits, 'question')} open" if waits else ""))


@dataclass(frozen=True, slots=True)
class SittingScreen:
    """Shows what each answer has taught, with a line between the questions."""

    console: Console

    def asked(self, turn: Turn) -> None:
        """Leave a line blank before a question."""
        if isinstance(turn, Ask | Review):
            self.console.print()

    def replied(self, turn: Turn, reply: object) -> None:
        """Show what was learned."""
        if isinstance(turn, Learned):
            self.console.print(noted(GOOD, f"learned: {turn.lesson.sentence}"))
