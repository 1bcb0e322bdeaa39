"""Draws a report's pictures for a paper: SVG, PDF or PNG, in colours that all people tell apart."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import accumulate
from operator import or_
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
class Lines:
    """One value of several series after each task, in the order of tasks, by the series' names.

    `note` is what is counted, and from where.
    """

    title: str
    note: str
    unit: str
    series: Mapping[str, Sequence[float]]


def questions_and_growth(report: Json) -> tuple[Lines, Lines]:
    """Return what was asked and what was taught over task order, in the arm with a person.

    Each says whether a task knows what was taught in those before it.
    """
    asked, taught = dict[str, list[float]](), dict[str, list[float]]()
    carried = report["settings"]["cumulative"]
    trials = [trial for trial in report["trials"] if trial["arm"] == HUMAN]
    for name in map(name_of, trials):
        if name not in asked:
            those = [trial for trial in trials if name_of(trial) == name]
            those.sort(key=lambda trial: trial["index"])
            asked[name] = [trial["questions"] for trial in those]
            taught[name] = _taught(those, carried)
    if carried:
        order, growth = "knowledge carried over", "Growth of the knowledge graph"
        sofar = "facts added since before task 1"
    else:
        order, growth = "each task from the same graph", "What the person taught"
        sofar = "different facts so far; none carried over"
    questions = Lines("Questions to the person", order, "questions", asked)
    return questions, Lines(growth, sofar, "facts", taught)


def name_of(group: Json) -> str:
    """Return what the trials of a model and domain are called."""
    return ", ".join(part for part in (group["model"], group["domain"]) if part) or "tasks"


def _taught(trials: Sequence[Json], carried: bool) -> list[float]:
    """How many facts all tasks so far have added."""
    if carried:
        return [trial["edges"][1] - trials[0]["edges"][0] for trial in trials]
    return [len(known) for known in accumulate((set(t["taught"]) for t in trials), or_)]


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

    groups = report["groups"]
    if len(groups) > 4:
        groups = [{"model": "all tasks", "domain": "", "arms": report["arms"]}]
    questions, growth = questions_and_growth(report)
    rows = (len(groups) + 1) // 2 + bool(questions.series)
    figure = Figure(figsize=(WIDTH, ROW * rows + 0.3), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    for n, group in enumerate(groups):
        alone = len(groups) == n + 1 and n % 2 == 0
        _draw_bars(figure.add_subplot(grid[n // 2, :] if alone else grid[n // 2, n % 2]), group)
    if questions.series:
        _draw_counts(figure.add_subplot(grid[rows - 1, 0]), questions)
        _draw_steps(figure.add_subplot(grid[rows - 1, 1]), growth)
    return figure


def _draw_bars(axes: Any, group: Json) -> None:
    """Draw the arms side by side: shares with their 95 % intervals, as percentages."""
    arms = group["arms"]
    shown = [m for m in BAR_MEASURES if any(each[m] is not None for each in arms.values())]
    width = 0.8 / len(arms)
    for n, (arm, figures) in enumerate(arms.items()):
        mine = [m for m in shown if figures[m] is not None]
        ends = [(figures[m], *figures["intervals"][m]) for m in mine]
        axes.bar(
            [shown.index(m) + (n - (len(arms) - 1) / 2) * width for m in mine],
            [100 * value for value, _, _ in ends],
            width * 0.92,
            yerr=[
                [100 * max(0.0, value - low) for value, low, _ in ends],
                [100 * max(0.0, high - value) for value, _, high in ends],
            ],
            color=COLOURS[arm],
            label=HEADS[arm],
            error_kw={"elinewidth": 0.7, "capsize": 1.8, "capthick": 0.7, "ecolor": "#222222"},
        )
    axes.set_xticks(range(len(shown)), [BAR_MEASURES[name] for name in shown])
    axes.tick_params(axis="x", length=0)
    axes.set_ylim(0, 100 * _headroom(1))
    axes.set_yticks(range(0, 101, 25))
    axes.set_ylabel("%")
    n = next(iter(arms.values()))["n"]
    axes.set_title(f"{name_of(group)} (n = {n})", loc="left")
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
    width = 0.8 / len(lines.series)
    for n, (name, values) in enumerate(lines.series.items()):
        first = 1 + (n - (len(lines.series) - 1) / 2) * width
        axes.bar(
            [first + place for place in range(len(values))],
            values,
            width * 0.92,
            facecolor=SERIES[n % len(SERIES)],
            edgecolor="white",
            linewidth=0,
            hatch=HATCHES[n % len(HATCHES)],
            label=name,
        )
    _task_order(axes, lines)


def _draw_steps(axes: Any, lines: Lines) -> None:
    """Draw what grows: it stays as it is until the next task adds to it."""
    for n, (name, values) in enumerate(lines.series.items()):
        axes.plot(
            range(1, len(values) + 1),
            values,
            color=SERIES[n % len(SERIES)],
            marker=MARKERS[n % len(MARKERS)],
            linestyle=DASHES[n % len(DASHES)],
            drawstyle="steps-post",
            markersize=3.2,
            linewidth=1,
            label=name,
            clip_on=False,
        )
    _task_order(axes, lines)


def _task_order(axes: Any, lines: Lines) -> None:
    longest = max(map(len, lines.series.values()))
    most = max(map(max, lines.series.values()))
    axes.set_xlim(0.4, longest + 0.6)
    axes.set_ylim(0, max(1, most) * _headroom(-(-len(lines.series) // COLUMNS)))
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.yaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("task, in order")
    axes.set_ylabel(lines.unit)
    axes.set_title(f"{lines.title}, {HEADS[HUMAN]}\n({lines.note})", loc="left")
    _legend(axes)


LEVELS = " ▁▂▃▄▅▆▇█"


def over_tasks(report: Json) -> RenderableType:
    """Draw questions and growth over task order as small lines; the arms are in the tables."""
    parts: list[RenderableType] = []
    for lines in questions_and_growth(report):
        table = Table.grid(padding=(0, 1))
        most = max(map(max, lines.series.values()), default=0) or 1
        for name, values in lines.series.items():
            drawn = "".join(LEVELS[round(value / most * 8)] for value in values)
            text = f"{values[0]:g} → {values[-1]:g} {lines.unit}"
            table.add_row(name, Text(drawn, "blue"), Text(text, "dim"))
        if lines.series:
            parts += [Text(f"\n{lines.title} ({lines.note})", "bold"), table]
    return Group(*parts)
