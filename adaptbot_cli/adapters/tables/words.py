"""What the tables share: text from outside as it may be shown, times, lists of facts."""

from collections.abc import Iterable

from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.visible import visible

_LONGEST = 400
_INDENT = (0, 0, 0, 2)


def cell(text: str, style: str = "", longest: int = _LONGEST) -> Text:
    """Return text from outside: never markup, never an escape code, cut to a bearable length."""
    shown = Text(visible(text), style, overflow="fold")
    shown.truncate(longest, overflow="ellipsis")
    return shown


def joined(parts: Iterable[str], style: str = "dim") -> Text:
    """Return what is told of something in one line, what is empty left out."""
    return cell(" · ".join(part for part in parts if part), style)


def minute(when: str) -> str:
    """Return an ISO time to the minute, as people write it."""
    return when[:16].replace("T", " ")


def indented(rows: Iterable[tuple[Text, ...]]) -> Padding:
    """Return rows as columns, indented; the last column wraps."""
    table = Table.grid(padding=(0, 2, 0, 0), pad_edge=False)
    for row in rows:
        while len(table.columns) < len(row):
            table.add_column(overflow="fold")
        table.add_row(*row)
    return Padding(table, _INDENT)


def count(number: int, one: str, many: str = "") -> str:
    """Say how many there are: "1 fact", "2 facts"."""
    return f"{number} {one if number == 1 else many or one + 's'}"
