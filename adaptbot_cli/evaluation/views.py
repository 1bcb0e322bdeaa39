"""What the pictures show, before anything is drawn: one specification for screen and paper."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

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
