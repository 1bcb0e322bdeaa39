"""The open questions on the terminal: what waits, what is being learned, what came of it."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.pending import Pending, Sitting
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Ask, Learned, Review, Turn
from adaptbot_cli.core.visible import visible


def listing(pending: Sequence[Pending]) -> Table:
    """Show the open questions, the most useful first, with the tasks that wait for them."""
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column("question", ratio=3)
    table.add_column("tasks", ratio=2)
    table.add_column("steps", justify="right")
    for each in pending:
        tasks = Text(visible(", ".join(each.tasks)))
        table.add_row(Text(visible(each.question.text)), tasks, Text(str(each.steps)))
    return table


def came_of(sitting: Sitting) -> RenderableType:
    """Show what each task is worth now, and what is still open."""
    lines = [_result(result, sitting) for result in sitting.results]
    kept = f"committed as {sitting.revision[:7]}" if sitting.revision else "not committed"
    learned = f"{_count(len(sitting.lessons), 'lesson')} {kept}" if sitting.lessons else ""
    still = f"{_count(len(sitting.still), 'question')} still open" if sitting.still else ""
    text = " · ".join(filter(None, (learned or "nothing learned", still)))
    return Group(*lines, Text(f"  {text}", "dim"))


def _result(result: Result, sitting: Sitting) -> Text:
    name = result.report.task.name
    waits = [each for each in sitting.still if name in each.tasks]
    if result.goal_met and not waits:
        return Text.assemble(("✓ ", "green"), visible(f"{name}: executable, goal met"))
    text = "executable without what is open" if result.goal_met else _lacking(result)
    if waits:
        text += f"; {_count(len(waits), 'question')} open"
    sign = ("! ", "yellow") if result.goal_met else ("✗ ", "red")
    return Text.assemble(sign, visible(f"{name}: {text}"))


def _lacking(result: Result) -> str:
    text = "executable, but the goal is not met"
    if result.verdict != "executable":
        text = "not executable"
    open_ = [*result.report.open, *(result.outcome.unmet if result.outcome else ())]
    return f"{text}: {open_[0].message}" if open_ else text


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


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
            text = visible(f"learned: {turn.lesson.sentence}")
            self.console.print(Text.assemble(("✓ ", "green"), text))
