"""Text from outside as plain text, marks, counts, and the layouts that all tables share."""

import io
from collections.abc import Iterable
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, OverflowMethod, RenderableType, RenderResult
from rich.measure import Measurement
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.visible import visible

LONGEST, LONGEST_CELL = 90, 400
"""How many columns of a terminal a name or a line from outside may take, wrapped or not; and a text
that the person has asked to see."""

GAP = 2
"""Blank columns between two columns of a table."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A sign and its colour: what a thing is called must be readable without either."""

    sign: str
    style: str


def recorder(width: int) -> Console:
    """Return a console that shows nothing and remembers it in colour, to be exported."""
    return Console(
        record=True,
        width=width,
        file=io.StringIO(),
        highlight=False,
        force_terminal=True,
        color_system="standard",
    )


GOOD = Mark("✓", "green")
BAD = Mark("✗", "red")
WARNING = Mark("!", "yellow")
PASSING = Mark("·", "dim")


def plain_text(text: str, style: str = "", longest: int = LONGEST) -> Text:
    """Return text from outside as it may be shown: never markup, never an escape code."""
    shown = Text(visible(text), style)
    shown.truncate(longest, overflow="ellipsis")
    return shown


@dataclass(frozen=True, slots=True)
class Wrapped:
    """A text that goes on in the next line behind a space, a comma or a bracket.

    Rich breaks at spaces only, and a call without any would be broken in the middle of a name.
    """

    text: Text

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the text in lines of the width there is."""
        lines = self.text.divide(_breaks(self.text.plain, options.max_width))
        for line in lines:
            line.rstrip()
        text = Text("\n").join(lines)
        text.no_wrap, text.overflow = False, "fold"
        yield text

    def __rich_measure__(self, console: Console, options: ConsoleOptions) -> Measurement:
        """Measure it as Rich measures the text."""
        return Measurement.get(console, options, self.text)


def _breaks(plain: str, width: int) -> list[int]:
    """Return where a text is broken into lines: behind the last mark that fits, else in a word."""
    found, start, mark, used = [], 0, 0, 0
    for at, char in enumerate(plain):
        used += cell_len(char)
        if used > width and char != " " and at > start:
            start = mark if mark > start else at
            found.append(start)
            used = cell_len(plain[start : at + 1])
        if char in " ,(":
            mark = at + 1
    return found


def cell(text: str, style: str = "") -> Text:
    """Return a text from outside that the person has asked to see, as `plain_text` does."""
    return plain_text(text, style, LONGEST_CELL)


def joined(parts: Iterable[str], style: str = "dim") -> Text:
    """Return parts in one line, empty ones left out."""
    return cell(" · ".join(part for part in parts if part), style)


def minute(when: str) -> str:
    """Return an ISO time to the minute, as people write it."""
    return when[:16].replace("T", " ")


def noted(mark: Mark, text: str, style: str = "", longest: int = LONGEST_CELL) -> Text:
    """Return a line that begins with a mark."""
    return Text.assemble((f"{mark.sign} ", mark.style), plain_text(text, style, longest))


def warn(console: Console, text: str) -> None:
    """Print a line that the person should know of, left to the terminal to wrap."""
    console.print(Text(f"! {visible(text)}", WARNING.style), soft_wrap=True)


def hanging(line: Text) -> RenderableType:
    """Return such a line with its continuation set off from its mark."""
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_row(line[:1], line[2:])
    return table


def count(number: int, one: str, many: str = "") -> str:
    """Say how many there are: "1 step", "2 steps"."""
    return f"{number} {one if number == 1 else many or one + 's'}"


def columns(*widths: int | None) -> Table:
    """Return an empty table without lines; a column of width None takes what it needs and wraps."""
    table = Table.grid(padding=(0, GAP, 0, 0), pad_edge=False)
    for width in widths:
        overflow: OverflowMethod = "fold" if width is None else "ellipsis"
        table.add_column(width=width, no_wrap=width is not None, overflow=overflow)
    return table


def table(*headers: str) -> Table:
    """Return an empty table with headings."""
    return Table(*headers, box=None, header_style="dim", padding=(0, GAP, 0, 0), pad_edge=False)


def indented(rows: Iterable[tuple[RenderableType, ...]]) -> Padding:
    """Return rows as columns, indented; the last column wraps."""
    found = Table.grid(padding=(0, GAP, 0, 0), pad_edge=False)
    for row in rows:
        while len(found.columns) < len(row):
            found.add_column(overflow="fold")
        found.add_row(*row)
    return Padding(found, (0, 0, 0, GAP))
