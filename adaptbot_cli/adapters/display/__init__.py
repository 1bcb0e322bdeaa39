"""What the person sees: the plan beside what it changes, and a line for everything on the way."""

from adaptbot_cli.adapters.display.diff import diff_table
from adaptbot_cli.adapters.display.plan import plan_table
from adaptbot_cli.adapters.display.screen import Screen
from adaptbot_cli.adapters.display.stream import Stream

__all__ = ["Screen", "Stream", "diff_table", "plan_table"]
