"""Draws a report's pictures for a paper: SVG, PDF or PNG, in colours that all people tell apart."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.figures import HEADS

Json = dict[str, Any]

BAR_MEASURES = {
    "executable": "executable",
    "goal_met": "goal met",
    "overlap": "ingredient\noverlap",
    "effective_overlap": "effective\noverlap",
}
HUMAN = "llm+kg+human"


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar: a share from 0 to 1 with its 95 % interval."""

    arm: str
    measure: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Bars:
    """The arms side by side, for one model and domain."""

    title: str
    n: int
    bars: tuple[Bar, ...]


@dataclass(frozen=True, slots=True)
class Line:
    """A value after each task, in the order of tasks."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Lines:
    """One value of several series over task order; `note` says what is counted, and from where."""

    title: str
    note: str
    unit: str
    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True)
class Views:
    """Everything that is drawn of a report."""

    arms: tuple[Bars, ...]
    questions: Lines
    growth: Lines


def views(report: Json) -> Views:
    """Return what the pictures of a report show."""
    groups = report["groups"]
    together = {"model": "all tasks", "domain": "", "arms": report["arms"]}
    shown = groups if len(groups) <= 4 else [together]
    series = list(_series(report["trials"]))
    carried = report["settings"]["cumulative"]
    asked = tuple(Line(name, _column(trials, "questions")) for name, trials in series)
    taught = tuple(Line(name, _taught(trials, carried)) for name, trials in series)
    return Views(tuple(_bars(group) for group in shown), *_over_tasks(asked, taught, carried))


def _over_tasks(
    asked: tuple[Line, ...], taught: tuple[Line, ...], carried: bool
) -> tuple[Lines, Lines]:
    """Questions and growth; each says whether a task knows what was taught in those before it."""
    order = "knowledge carried over" if carried else "each task from the same graph"
    growth = "Growth of the knowledge graph" if carried else "What the person taught"
    sofar = (
        "facts added since before task 1"
        if carried
        else "different facts so far; none carried over"
    )
    return (
        Lines("Questions to the person", order, "questions", asked),
        Lines(growth, sofar, "facts", taught),
    )


def name_of(group: Json) -> str:
    """Return what a group is called in a title."""
    return ", ".join(part for part in (group["model"], group["domain"]) if part) or "tasks"


def _bars(group: Json) -> Bars:
    n = next(iter(group["arms"].values()))["n"]
    bars = tuple(
        Bar(arm, measure, figures[measure], *figures["intervals"][measure])
        for measure in BAR_MEASURES
        for arm, figures in group["arms"].items()
        if figures[measure] is not None
    )
    return Bars(name_of(group), n, bars)


def _series(trials: Sequence[Json]) -> Iterator[tuple[str, list[Json]]]:
    """The trials of each series in the arm with a person, in the order of tasks."""
    asked = [trial for trial in trials if trial["arm"] == HUMAN]
    for model, domain in dict.fromkeys((t["model"], t["domain"]) for t in asked):
        those = [t for t in asked if (t["model"], t["domain"]) == (model, domain)]
        name = name_of({"model": model, "domain": domain})
        yield name, sorted(those, key=lambda trial: trial["index"])


def _column(trials: Sequence[Json], name: str) -> tuple[float, ...]:
    return tuple(trial[name] for trial in trials)


def _taught(trials: Sequence[Json], carried: bool) -> tuple[float, ...]:
    """How many facts all tasks so far have added."""
    if carried:
        return tuple(trial["edges"][1] - trials[0]["edges"][0] for trial in trials)
    known: set[str] = set()
    found = []
    for trial in trials:
        known |= set(trial["taught"])
        found.append(float(len(known)))
    return tuple(found)


ENDINGS = (".svg", ".pdf", ".png")
WIDTH, ROW = 7.16, 2.2
"""Inches: the width of a page of two columns, and the height of one row of pictures."""

COLOURS = {"llm": "#CCCCCC", "llm+kg": "#E69F00", "llm+kg+human": "#0072B2"}
SERIES = ("#009E73", "#CC79A7", "#D55E00", "#000000")
"""Colours of Okabe and Ito (2008), each for one thing: an arm's is no model's. Lines differ in
marker and dash as well, bars in their hatching."""

MARKERS, DASHES = "osD^vP", ("-", "--", ":", "-.", (0, (5, 1)), (0, (1, 1)))
HATCHES = ("", "////", "....", "xxxx")
COLUMNS = 2
"""How many names of series stand side by side in a panel's legend."""
STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "svg.hashsalt": "adaptbot",
    "pdf.fonttype": 42,
}


def check(path: Path | None) -> None:
    """Say at once, not after hours, that nothing can be drawn there. Raises UsageError."""
    if path is None:
        return
    if path.suffix.lower() not in ENDINGS:
        raise UsageError(f"--plot {path}: the file must end in {', '.join(ENDINGS)}")
    if find_spec("matplotlib") is None:
        raise UsageError("--plot needs matplotlib: pip install 'adaptbot-cli[plot]'")


def draw(report: dict[str, Any], path: Path) -> None:
    """Draw a report to a file; the same report gives the same bytes. Raises UsageError."""
    check(path)
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        figure = _figure(report)
        dated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
        record = dated.get(path.suffix.lower(), {})
        try:
            figure.savefig(path, dpi=300, metadata=record)
        except OSError as error:
            raise UsageError(f"cannot write {path}: {error.strerror}") from error


def _figure(report: dict[str, Any]) -> Any:
    from matplotlib.figure import Figure

    shown = views(report)
    has_person = bool(shown.questions.lines)
    rows = (len(shown.arms) + 1) // 2 + has_person
    figure = Figure(figsize=(WIDTH, ROW * rows + 0.3), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    for n, bars in enumerate(shown.arms):
        alone = len(shown.arms) == n + 1 and n % 2 == 0
        place = grid[n // 2, :] if alone else grid[n // 2, n % 2]
        _draw_bars(figure.add_subplot(place), bars)
    if has_person:
        _draw_counts(figure.add_subplot(grid[rows - 1, 0]), shown.questions)
        _draw_steps(figure.add_subplot(grid[rows - 1, 1]), shown.growth)
    return figure


def _draw_bars(axes: Any, bars: Bars) -> None:
    arms = list(dict.fromkeys(bar.arm for bar in bars.bars))
    measures = [name for name in BAR_MEASURES if any(bar.measure == name for bar in bars.bars)]
    width = 0.8 / len(arms)
    for n, arm in enumerate(arms):
        mine = [bar for bar in bars.bars if bar.arm == arm]
        at = [measures.index(bar.measure) + (n - (len(arms) - 1) / 2) * width for bar in mine]
        heights = [100 * bar.value for bar in mine]
        errors = [
            [100 * max(0.0, bar.value - bar.low) for bar in mine],
            [100 * max(0.0, bar.high - bar.value) for bar in mine],
        ]
        axes.bar(
            at,
            heights,
            width * 0.92,
            yerr=errors,
            color=COLOURS[arm],
            label=HEADS[arm],
            error_kw={"elinewidth": 0.7, "capsize": 1.8, "capthick": 0.7, "ecolor": "#222222"},
        )
    axes.set_xticks(range(len(measures)), [BAR_MEASURES[name] for name in measures])
    axes.tick_params(axis="x", length=0)
    axes.set_ylim(0, 100 * _headroom(1))
    axes.set_yticks(range(0, 101, 25))
    axes.set_ylabel("%")
    axes.set_title(f"{bars.title} (n = {bars.n})", loc="left")
    _legend(axes, len(arms))


def _headroom(rows: int) -> float:
    """How much higher than its highest value a panel is, for the rows of its legend."""
    return 1.15 + 0.15 * rows


def _legend(axes: Any, columns: int = COLUMNS) -> None:
    axes.legend(
        fontsize=7,
        loc="upper left",
        ncols=columns,
        handlelength=2.4,
        columnspacing=1.2,
        borderaxespad=0.2,
    )


def _draw_counts(axes: Any, lines: Lines) -> None:
    """Draw small counts as bars side by side: lines between them would mean nothing."""
    width = 0.8 / len(lines.lines)
    for n, line in enumerate(lines.lines):
        at = [place + (n - (len(lines.lines) - 1) / 2) * width for place in _places(line)]
        axes.bar(
            at,
            line.values,
            width * 0.92,
            facecolor=SERIES[n % len(SERIES)],
            edgecolor="white",
            linewidth=0,
            hatch=HATCHES[n % len(HATCHES)],
            label=line.name,
        )
    _task_order(axes, lines)


def _draw_steps(axes: Any, lines: Lines) -> None:
    """Draw what grows: it stays as it is until the next task adds to it."""
    for n, line in enumerate(lines.lines):
        axes.plot(
            _places(line),
            line.values,
            color=SERIES[n % len(SERIES)],
            marker=MARKERS[n % len(MARKERS)],
            linestyle=DASHES[n % len(DASHES)],
            drawstyle="steps-post",
            markersize=3.2,
            linewidth=1,
            label=line.name,
            clip_on=False,
        )
    _task_order(axes, lines)


def _places(line: Line) -> range:
    return range(1, len(line.values) + 1)


def _task_order(axes: Any, lines: Lines) -> None:
    longest = max(len(line.values) for line in lines.lines)
    most = max(value for line in lines.lines for value in line.values)
    axes.set_xlim(0.4, longest + 0.6)
    axes.set_ylim(0, max(1, most) * _headroom(-(-len(lines.lines) // COLUMNS)))
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("task, in order")
    axes.set_ylabel(lines.unit)
    axes.set_title(f"{lines.title}, {HEADS[HUMAN]}\n({lines.note})", loc="left")
    _legend(axes)


LEVELS = " ▁▂▃▄▅▆▇█"


def over_tasks(report: Json) -> RenderableType:
    """Draw questions and growth over task order as small lines; the arms are in the tables."""
    shown = views(report)
    parts: list[RenderableType] = []
    for lines in (shown.questions, shown.growth):
        table = Table.grid(padding=(0, 1))
        most = max((value for line in lines.lines for value in line.values), default=0) or 1
        for line in lines.lines:
            drawn = "".join(LEVELS[round(value / most * 8)] for value in line.values)
            text = f"{line.values[0]:g} → {line.values[-1]:g} {lines.unit}"
            table.add_row(line.name, Text(drawn, "blue"), Text(text, "dim"))
        if lines.lines:
            parts += [Text(f"\n{lines.title} ({lines.note})", "bold"), table]
    return Group(*parts)
