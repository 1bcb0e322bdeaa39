"""The first line of a run, which is there before anything slow is imported."""

from rich.console import Console
from rich.text import Text

from adaptbot_cli.core.visible import visible

_LONGEST = 300


def show_opening(console: Console, task: str, domain: str, planner: str, why: str) -> None:
    """Print what is pursued, who plans, and why."""
    planned = Text(visible(f"{planner} ({why})"), "dim")
    parts = [Text(visible(task), "bold"), Text(visible(domain)), planned]
    for part in parts:
        part.truncate(_LONGEST, overflow="ellipsis")
    console.print(Text(" · ").join(parts))
