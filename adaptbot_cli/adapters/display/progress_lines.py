"""Progress lines as pictures: for the terminal, as SVG, as a Mermaid flowchart."""

import itertools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.display.cells import plain_text, recorder
from adaptbot_cli.core.view.progress import Event, Progress, ProgressLine
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


def svg(progress: Progress) -> str:
    """Return the chart as an SVG document, with room for every name and word of it."""
    first, steps = _NARROWEST * 4, max(len(progress.steps), 1)
    width = _LONGEST_NAME + 2 + first + steps * _WIDEST
    console = recorder(width)
    console.print(progress_lines(progress, width))
    return console.export_svg(title="adaptbot progress", unique_id="lines")


def mermaid(progress: Progress) -> str:
    """Return the flowchart: a row for each thing, its stations in order, the steps between them."""
    calls = dict(progress.steps)
    lines = ["flowchart LR"]
    # Mermaid stacks what is not connected from below.
    for number, line in reversed(list(enumerate(progress.lines))):
        lines.append(f"  subgraph t{number}[{_quoted(line.name)}]")
        lines.append("    direction LR")
        lines += [f"    {text}" for text in _nodes(f"t{number}s", line, calls)]
        lines.append("  end")
    if not progress.lines:
        lines.append(f"  nothing[{_quoted('no step moves or changes anything')}]")
    return "\n".join(lines) + "\n"


def _nodes(prefix: str, line: ProgressLine, calls: dict[int, str]) -> Iterator[str]:
    """The nodes of a thing's way: one for where it starts, one for each step it takes part in."""
    steps: dict[int, list[str]] = {}
    moved = set()
    for event in line.events:
        # A line that begins with + or − would be a list to Mermaid.
        words = _phrase(event).plain.replace("+ ", "with ", 1).replace("− ", "without ", 1)
        steps.setdefault(event.step, []).append(words)
        moved |= {event.step} if event.kind == "place" else set()
    yield f"{prefix}0([{_quoted(line.start or line.kind)}])"
    for count, (step, lines) in enumerate(steps.items(), start=1):
        text = _quoted(*lines)
        node = f"[{text}]" if step in moved else f"({text})"
        edge = _quoted(f"{step} {visible(calls[step]).partition('(')[0]}")
        yield f"{prefix}{count - 1} -->|{edge}| {prefix}{count}{node}"


def _quoted(*lines: str) -> str:
    """Return quoted text; what Mermaid or HTML would read as more than text is an entity code."""
    texts = (
        "".join(c if c.isalnum() or c in " _-,:()" else f"#{ord(c)};" for c in visible(line))
        for line in lines
    )
    return f'"{"<br/>".join(texts)}"'


@dataclass(frozen=True, slots=True)
class _Columns:
    """The columns of the chart: one of `start` letters before any step, one of `step` for each."""

    start: int
    step: int

    def x(self, column: int) -> int:
        """Return where a column begins."""
        return self.start + (column - 1) * self.step if column else 0


def _title(progress: Progress) -> Text:
    text = "executed" if progress.executed else "rehearsed, not executed"
    title = Text.assemble((visible(progress.task), "bold"), (f" · {text}", "dim"))
    if progress.stopped:
        title.append(f" · stopped: {visible(progress.stopped)}", "yellow")
    if progress.note:
        title.append(f"\n! {visible(progress.note)}", "yellow")
    return title


def _styles(progress: Progress) -> dict[str, str]:
    """A colour for each place, hands left out, the same wherever it appears."""
    stays = (place for line in progress.lines for place, _, _ in _stays(line, progress))
    places = (place for place in dict.fromkeys(stays) if place not in progress.hands)
    return dict(zip(places, itertools.cycle(_COLOURS), strict=False))


def _name(line: ProgressLine, styles: dict[str, str], longest: int) -> Text:
    """A thing's name; one that is a place has its colour."""
    style = styles.get(visible(line.name), "")
    return plain_text(line.name, f"bold {style}".strip(), longest)


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


def _bar(line: ProgressLine, progress: Progress, styles: dict[str, str], grid: _Columns) -> Text:
    bar = Text()
    for place, start, end in _stays(line, progress):
        bar.append(" " * (grid.x(start) - bar.cell_len))
        size = grid.x(end) - grid.x(start)
        if place in progress.hands:
            bar.append("┄" * size, "dim")
        else:
            label = plain_text(place, styles[place], size)
            label.append(f" {'━' * (size - label.cell_len - 1)}" if label.cell_len < size else "")
            bar.append_text(label)
    return bar


def _marks(line: ProgressLine, progress: Progress, grid: _Columns) -> list[Text]:
    """What happened on the way, each below its step, on as few rows as they fit on."""
    at = _columns(progress)
    end = grid.x(len(at) + 1)
    rows: list[Text] = []
    for event in line.events:
        if event.kind == "place":
            continue
        text, x = Text("╵") + _phrase(event), grid.x(at[event.step])
        if x + text.cell_len > end:  # no room to the right: written to the left of its step
            text = _phrase(event) + Text("╵")
            x = max(x + 1 - text.cell_len, 0)
            text.truncate(end, overflow="ellipsis")
        row = next((row for row in rows if row.cell_len < x), None)
        if row is None:
            row = Text()
            rows.append(row)
        row.append(" " * (x - row.cell_len))
        row.append_text(text)
    return rows


def _steps(progress: Progress, width: int) -> RenderableType:
    """The steps by number, in as many columns as fit."""
    lines = [f"{number:>2} {visible(call)}" for number, call in progress.steps]
    longest = min(max(map(len, lines)), width)
    across = max(width // (longest + 3), 1)
    down = -(-len(lines) // across)
    table = Table.grid(padding=(0, 3, 0, 0), pad_edge=False)
    for row in range(down):
        table.add_row(*(Text(text, "dim") for text in lines[row::down]))
    return table


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


def _stations(line: ProgressLine, progress: Progress, styles: dict[str, str]) -> Iterator[Text]:
    """Where a thing starts, and each step that does something to it but lifting it."""
    start = visible(line.start)
    if start:
        yield Text(start, styles.get(start, ""))
    last = max((event.step for event in line.events if event.kind == "place"), default=0)
    for step, events in itertools.groupby(line.events, key=lambda event: event.step):
        parts: list[Text] = []
        for event in events:
            place = visible(event.what[0])
            if event.kind != "place":
                parts.append(_phrase(event))
            elif place not in progress.hands:
                parts.append(Text.assemble("→ ", (place, styles.get(place, ""))))
            elif step == last:  # it is still in the hand
                parts.append(Text(f"→ {place}", "dim"))
        if parts:
            yield Text.assemble((f"{step} ", "dim"), Text(", ").join(parts))


def _columns(progress: Progress) -> dict[int, int]:
    """Return the column of each step that was taken, from 1."""
    return {number: at for at, (number, _) in enumerate(progress.steps, start=1)}


def _stays(line: ProgressLine, progress: Progress) -> Iterator[tuple[str, int, int]]:
    """Give the stays of a thing in order: place, first column (0 is the start), and the one after
    the last; a place that is not known gives none."""
    at = _columns(progress)
    place, start = line.start, 0
    for event in line.events:
        if event.kind == "place":
            if place:
                yield visible(place), start, at[event.step]
            place, start = event.what[0], at[event.step]
    if place:
        yield visible(place), start, len(at) + 1


def _phrase(event: Event) -> Text:
    """Say an event in a few words; a change of place is no phrase but a new stay."""
    what, of = visible(", ".join(event.what)), visible(event.of)
    match event.kind:
        case "with" | "gained":
            return Text(f"+ {what}", "dim")
        case "lost":
            return Text(f"− {what}", "dim")
        case "carried":
            return Text(f"in {of} to {what}", "dim")
        case "state":
            return Text(f"{of}: {what}") if of else Text(what, "bold")
        case _:
            return Text(what, "dim")
