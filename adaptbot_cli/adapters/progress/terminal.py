"""Progress lines in the terminal: a chart where its columns fit, else each way as a text."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import groupby

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.progress.spans import columns, phrase, places, spans
from adaptbot_cli.core.progress import Event, Line, Progress
from adaptbot_cli.core.visible import visible

_COLOURS = ("cyan", "green", "yellow", "magenta", "blue", "bright_red", "bright_cyan")
_NARROWEST, _WIDEST = 5, 14
"""How wide a step's column of the chart may be."""
_LONGEST_NAME = 18


def progress_lines(progress: Progress, width: int) -> RenderableType:
    """Return the ways of all things, at most `width` columns wide."""
    parts: list[RenderableType] = [_title(progress), Text()]
    if not progress.lines:
        return Group(*parts, Text("no step was taken that moves or changes anything", "dim"))
    names = min(max(len(visible(line.name)) for line in progress.lines), _LONGEST_NAME)
    start = max(max(len(visible(line.start)) for line in progress.lines) + 1, _NARROWEST)
    room = (width - names - 2 - start) // max(len(progress.steps), 1)
    if room < _NARROWEST:
        return Group(*parts, _ways(progress, names, width))
    parts.append(_chart(progress, names, _Columns(start, min(room, _WIDEST))))
    return Group(*parts, Text(), _steps(progress, width))


@dataclass(frozen=True, slots=True)
class _Columns:
    """The columns of the chart: one of `start` letters before any step, one of `step` for each."""

    start: int
    step: int

    def x(self, column: int) -> int:
        """Return where a column begins."""
        return self.start + (column - 1) * self.step if column else 0


def _title(progress: Progress) -> Text:
    told = "executed" if progress.executed else "rehearsed, not executed"
    title = Text.assemble((visible(progress.task), "bold"), (f" · {told}", "dim"))
    if progress.stopped:
        title.append(f" · stopped: {visible(progress.stopped)}", "yellow")
    if progress.note:
        title.append(f"\n! {visible(progress.note)}", "yellow")
    return title


def _styles(progress: Progress) -> dict[str, str]:
    """A colour for each place, the same wherever it appears."""
    named = enumerate(places(progress))
    return {place: _COLOURS[number % len(_COLOURS)] for number, place in named}


def _name(line: Line, styles: dict[str, str], longest: int) -> Text:
    """A thing's name; one that is a place has its colour."""
    name = visible(line.name)
    text = Text(name, f"bold {styles.get(name, '')}".strip())
    text.truncate(longest, overflow="ellipsis")
    return text


# ------------------------------------------------------------------------------------ the chart


def _chart(progress: Progress, names: int, grid: _Columns) -> Table:
    styles = _styles(progress)
    table = Table.grid(padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column(width=names, no_wrap=True)
    table.add_column(no_wrap=True)
    numbers = "".join(f"{number:<{grid.step}}" for number, _ in progress.steps)
    table.add_row(Text(), Text(" " * grid.start + numbers.rstrip(), "dim"))
    for line in progress.lines:
        rows = [_bar(line, progress, styles, grid), *_marks(line, progress, grid)]
        table.add_row(_name(line, styles, names), Text("\n").join(rows))
    return table


def _bar(line: Line, progress: Progress, styles: dict[str, str], grid: _Columns) -> Text:
    bar = Text()
    for span in spans(line, progress):
        bar.append(" " * (grid.x(span.start) - bar.cell_len))
        size = grid.x(span.end) - grid.x(span.start)
        if span.place in progress.hands:
            bar.append("┄" * size, "dim")
        else:
            label = Text(span.place)
            label.truncate(size, overflow="ellipsis")
            label.append(f" {'━' * (size - label.cell_len - 1)}" if label.cell_len < size else "")
            label.stylize(styles[span.place])
            bar.append_text(label)
    return bar


def _marks(line: Line, progress: Progress, grid: _Columns) -> list[Text]:
    """What happened on the way, each below its step, on as few rows as they fit on."""
    at = columns(progress)
    end = grid.x(len(at) + 1)
    rows: list[Text] = []
    for event in line.events:
        if event.kind == "place":
            continue
        text, x = Text(f"╵{phrase(event)}", _style(event)), grid.x(at[event.step])
        if x + text.cell_len > end:  # no room to the right: written to the left of its step
            text = Text(f"{phrase(event)}╵", _style(event))
            x = max(x + 1 - text.cell_len, 0)
            text.truncate(end, overflow="ellipsis")
        row = next((row for row in rows if row.cell_len < x), None)
        if row is None:
            row = Text()
            rows.append(row)
        row.append(" " * (x - row.cell_len))
        row.append_text(text)
    return rows


def _style(event: Event) -> str:
    if event.kind == "state":
        return "bold" if not event.of else ""
    return "dim"


def _steps(progress: Progress, width: int) -> RenderableType:
    """The steps by number, in as many columns as fit."""
    told = [f"{number:>2} {visible(call)}" for number, call in progress.steps]
    longest = min(max(map(len, told)), width)
    across = max(width // (longest + 3), 1)
    down = -(-len(told) // across)
    table = Table.grid(padding=(0, 3, 0, 0), pad_edge=False)
    for row in range(down):
        table.add_row(*(Text(text, "dim") for text in told[row::down]))
    return table


# ------------------------------------------------------------------------------------- the ways


def _ways(progress: Progress, names: int, width: int) -> Table:
    styles = _styles(progress)
    room = max(width - names - 2, 20)
    table = Table.grid(padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column(width=names, no_wrap=True)
    table.add_column(no_wrap=True, overflow="ellipsis")
    for line in progress.lines:
        table.add_row(_name(line, styles, names), _way(_stations(line, progress, styles), room))
    return table


def _way(stations: Iterable[Text], room: int) -> Text:
    """A way as a text that wraps between its stations only."""
    rows: list[Text] = []
    for station in stations:
        if rows and rows[-1].cell_len + 2 + station.cell_len <= room:
            rows[-1].append("  ").append_text(station)
        else:
            rows.append(station)
    return Text("\n").join([*rows, Text()])


def _stations(line: Line, progress: Progress, styles: dict[str, str]) -> Iterator[Text]:
    """Where a thing starts, and each step that does something to it but lifting it."""
    start = visible(line.start)
    if start:
        yield Text(start, styles.get(start, ""))
    last = max((event.step for event in line.events if event.kind == "place"), default=0)
    for step, events in groupby(line.events, key=lambda event: event.step):
        parts: list[Text] = []
        for event in events:
            place = visible(event.what[0])
            if event.kind != "place":
                parts.append(Text(phrase(event), _style(event)))
            elif place not in progress.hands:
                parts.append(Text.assemble("→ ", (place, styles.get(place, ""))))
            elif step == last:  # it is still in the hand
                parts.append(Text(f"→ {place}", "dim"))
        if parts:
            yield Text.assemble((f"{step} ", "dim"), Text(", ").join(parts))
