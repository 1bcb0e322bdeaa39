"""A report's pictures for the terminal."""

from collections.abc import Iterator
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.evaluation.tables import HEADS, percent
from adaptbot_cli.evaluation.views import BAR_MEASURES, Bar, Bars, Line, Lines, views

WIDE = 30
COLOURS = {"llm": "bright_black", "llm+kg": "yellow", "llm+kg+human": "blue"}
LEVELS = " ▁▂▃▄▅▆▇█"


def charts(report: dict[str, Any]) -> RenderableType:
    """Draw the arms as bars, and questions and growth over task order as small lines."""
    shown = views(report)
    parts: list[RenderableType] = []
    for bars in shown.arms:
        parts += [Text(f"\n{bars.title} (n = {bars.n})", "bold"), _bars(bars)]
    for lines in (shown.questions, shown.growth):
        if lines.lines:
            parts += [Text(f"\n{lines.title} ({lines.note})", "bold"), _lines(lines)]
    return Group(*parts)


def _bars(bars: Bars) -> Table:
    table = Table.grid(padding=(0, 1))
    last = ""
    for bar in bars.bars:
        label = BAR_MEASURES[bar.measure].replace("\n", " ") if bar.measure != last else ""
        last = bar.measure
        table.add_row(label, Text(HEADS[bar.arm], "dim"), _drawn(bar), f"{percent(bar.value)} %")
    return table


def _drawn(bar: Bar) -> Text:
    """A bar with its interval drawn over it as ├───┤."""
    filled, low, high = (round(WIDE * value) for value in (bar.value, bar.low, bar.high))
    text = Text()
    for place in range(WIDE + 1):
        if low < high and low <= place <= high:
            mark = "├" if place == low else "┤" if place == high else "─"
            text.append(mark, f"white on {COLOURS[bar.arm]}" if place < filled else "dim")
        elif place < filled:
            text.append("█", COLOURS[bar.arm])
        else:
            text.append(" ")
    return text


def _lines(lines: Lines) -> Table:
    table = Table.grid(padding=(0, 1))
    most = max((value for line in lines.lines for value in line.values), default=0)
    for line in lines.lines:
        table.add_row(
            line.name, Text("".join(_levels(line, most)), "blue"), _told(line, lines.unit)
        )
    return table


def _levels(line: Line, most: float) -> Iterator[str]:
    """One character a task, as high as its value."""
    for value in line.values:
        yield LEVELS[round(value / most * (len(LEVELS) - 1))] if most else LEVELS[0]


def _told(line: Line, unit: str) -> Text:
    first, last = line.values[0], line.values[-1]
    return Text(f"{first:g} → {last:g} {unit}", "dim")
