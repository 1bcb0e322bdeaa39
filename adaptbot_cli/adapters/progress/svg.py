"""Progress lines as a picture: a row for each thing, a column for each step, a colour a place."""

from collections.abc import Iterator
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

from adaptbot_cli.adapters.progress.spans import columns, phrase, places, spans
from adaptbot_cli.core.progress import Event, Line, Progress
from adaptbot_cli.core.visible import visible

_FONT = "ui-sans-serif, system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif"
_COLOURS = (
    "#9cc9f5", "#a9dfbf", "#f9d991", "#d7bdf0", "#f5b7a8", "#9fe0dd", "#e3d3b4", "#c3cfd9",
    "#f3b6d3", "#cbe08f",
)  # fmt: skip
_STEP, _BAR, _LEVEL, _GAP, _MARGIN = 62, 22, 15, 16, 18
_LETTER = 6.3
"""The width of a letter of 11 px, on average."""


@dataclass(frozen=True, slots=True)
class _Mark:
    """What happened at a step, and on which of the levels below the bar it is written."""

    event: Event
    x: float
    text: str
    level: int


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where things stand in the picture, in pixels."""

    progress: Progress
    left: float
    first: float
    top: float
    colours: dict[str, str]

    def x(self, column: int) -> float:
        """Return where a column begins; the first, before any step, has a width of its own."""
        return self.left + (self.first + (column - 1) * _STEP if column else 0)

    @property
    def right(self) -> float:
        """Where the last column ends."""
        return self.x(len(self.progress.steps) + 1)


def svg(progress: Progress) -> str:
    """Return the picture as an SVG document."""
    layout = _layout(progress)
    y, rows = layout.top, []
    for line in progress.lines:
        marks = list(_marks(line, layout))
        levels = max((mark.level for mark in marks), default=-1) + 1
        rows += list(_row(line, marks, layout, y))
        y += _BAR + levels * _LEVEL + _GAP
    longest = max((len(call) for _, call in progress.steps), default=0)
    width = layout.right + max(longest * _LETTER * 0.8 - _STEP, _MARGIN)
    height = y + _MARGIN
    title = f"{progress.task} · {'executed' if progress.executed else 'rehearsed, not executed'}"
    parts = (f"stopped: {progress.stopped}" if progress.stopped else "", progress.note)
    why = "; ".join(filter(None, parts))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}" font-family={quoteattr(_FONT)} font-size="11" '
        f'role="img" aria-label={quoteattr(visible(title))}>'
    )
    ground = '<rect width="100%" height="100%" fill="#ffffff"/>'
    name = _said(_MARGIN, _MARGIN + 8, title, 'font-size="15" font-weight="bold" fill="#222"')
    stopped = _said(_MARGIN, _MARGIN + 26, _cut(why, width), 'font-size="12" fill="#b3261e"')
    grid = list(_grid(layout, y))
    return "\n".join([head, ground, name, stopped, *grid, *rows, "</svg>", ""])


def _layout(progress: Progress) -> _Layout:
    longest = max((len(visible(line.name)) for line in progress.lines), default=4)
    calls = max((len(visible(call)) for _, call in progress.steps), default=0)
    named = {place: _COLOURS[n % len(_COLOURS)] for n, place in enumerate(places(progress))}
    left = _MARGIN + longest * _LETTER * 1.35 + 28
    start = max((len(visible(line.start)) for line in progress.lines), default=0)
    # The calls stand above the steps, slanting upwards.
    top = _MARGIN + 30 + calls * _LETTER * 0.62 + 12
    return _Layout(progress, left, max(start * _LETTER + 16, _STEP), top, named)


def _said(x: float, y: float, text: str, style: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(visible(text))}</text>'


def _grid(layout: _Layout, bottom: float) -> Iterator[str]:
    """The steps: a thin line down, the call above it."""
    for column, (number, call) in enumerate(layout.progress.steps, start=1):
        x, y = layout.x(column), layout.top - 10
        yield f'<path d="M{x:.1f} {y:.1f}V{bottom:.1f}" stroke="#e4e7ea"/>'
        turned = f'transform="rotate(-38 {x:.1f} {y - 4:.1f})" fill="#555"'
        yield _said(x, y - 4, f"{number}  {call}", turned)


def _row(line: Line, marks: list[_Mark], layout: _Layout, y: float) -> Iterator[str]:
    name = visible(line.name)
    if name in layout.colours:
        swatch = layout.colours[name]
        yield f'<rect x="{_MARGIN}" y="{y + 5:.1f}" width="12" height="12" rx="3" fill="{swatch}"/>'
    style = f'font-size="13" fill="#222" font-weight="{"bold" if line.required else "normal"}"'
    yield _said(_MARGIN + 18, y + 16, name, style)
    for span in spans(line, layout.progress):
        x = layout.x(span.start)
        width = layout.x(span.end) - x
        middle = y + _BAR / 2
        if span.place in layout.progress.hands:
            yield (
                f'<path d="M{x:.1f} {middle:.1f}h{width:.1f}" stroke="#8a949e" stroke-width="2" '
                'stroke-dasharray="2 4"/>'
            )
            continue
        yield (
            f'<rect x="{x + 1:.1f}" y="{y:.1f}" width="{width - 2:.1f}" height="{_BAR}" rx="6" '
            f'fill="{layout.colours[span.place]}"/>'
        )
        yield _said(x + 7, middle + 4, _cut(span.place, width - 10), 'fill="#222"')
    for mark in marks:
        yield from _mark(mark, layout, y)


def _mark(mark: _Mark, layout: _Layout, y: float) -> Iterator[str]:
    own = mark.event.kind == "state" and not mark.event.of
    colour = "#b3261e" if own else "#5b6570"
    base = y + _BAR + 12 + mark.level * _LEVEL
    at = layout.x(columns(layout.progress)[mark.event.step])
    yield f'<circle cx="{at:.1f}" cy="{y + _BAR:.1f}" r="3" fill="{colour}"/>'
    weight = ' font-weight="bold"' if own else ""
    yield _said(mark.x, base, mark.text, f'fill="{colour}"{weight}')


def _marks(line: Line, layout: _Layout) -> Iterator[_Mark]:
    """The events of a line, each on the first level where it meets no other."""
    ends: list[float] = []
    at = columns(layout.progress)
    for event in line.events:
        if event.kind == "place":
            continue
        text = phrase(event)
        size = len(text) * _LETTER
        x = max(min(layout.x(at[event.step]) + 5, layout.right - size), layout.left)
        level = next((n for n, end in enumerate(ends) if end < x), len(ends))
        ends[level : level + 1] = [x + size + 8]
        yield _Mark(event, x, text, level)


def _cut(text: str, width: float) -> str:
    """Cut a text to a width in pixels."""
    most = max(int(width / _LETTER), 1)
    return text if len(text) <= most else f"{text[: most - 1]}…"
