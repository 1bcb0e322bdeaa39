"""Two experiments side by side: what changed, and whether it got worse."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli import bounded
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.visible import visible
from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.figures import (
    HEADS,
    MEANS,
    SHARES,
    TITLES,
    WORLD_SHARES,
    Interval,
    bootstrap,
    mcnemar,
)
from adaptbot_cli.evaluation.recordings import ARMS, read_text

Json = dict[str, Any]

BETTER_HIGH = ("executable", "goal_met", "overlap", "effective_overlap")
QUALITY = (*BETTER_HIGH, "required_lost")
"""Measures of what comes out: any change to the worse beyond the tolerance is a regression."""

COSTS = tuple(name for name in MEANS if name not in BETTER_HIGH)
"""Measures of what it takes: only a rise by more than the cost tolerance is one."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One measure of one arm, before and after, over the trials that both experiments have.

    `interval` is that of the mean difference of the pairs; `better` and `worse` count the pairs
    that changed, `p` is that of McNemar's test where a measure is true or false.
    """

    arm: str
    measure: str
    n: int
    before: float
    after: float
    interval: Interval
    better: int
    worse: int
    p: float | None
    regression: bool

    @property
    def changed(self) -> bool:
        """Whether anything changed, in the mean or in a pair."""
        return self.before != self.after or bool(self.better or self.worse)

    def as_json(self) -> Json:
        """Return the difference as a plain object."""
        return {name: getattr(self, name) for name in self.__slots__}


def read_report(path: Path) -> Json:
    """Read what `eval --json` printed. Raises UsageError."""
    record = bounded.parse_json(read_text(path), path, UsageError)
    if not isinstance(record, dict) or not isinstance(record.get("trials"), list):
        raise UsageError(f"{path} is not what `adaptbot eval --json` prints: it lacks `trials`")
    for number, trial in enumerate(record["trials"], start=1):
        lacking = [
            name
            for name in ("id", "arm", "required_lost", *SHARES, *MEANS)
            if not isinstance(trial, dict) or name not in trial
        ]
        if lacking:
            raise UsageError(f"{path}, trial {number} lacks `{lacking[0]}`")
    return record


def compare(before: Json, after: Json, tolerance: float, cost: float) -> list[Difference]:
    """Compare experiments pair by pair: the same task in the same arm.

    Raises:
        UsageError: they have no trial in common.
    """
    old = {(t["id"], t["arm"]): t for t in before["trials"]}
    new = {(t["id"], t["arm"]): t for t in after["trials"]}
    found = []
    for arm in ARMS:
        pairs = [(old[key], new[key]) for key in old if key in new and key[1] == arm]
        if pairs:
            in_world = all(WORLD_SHARES[0] in trial for pair in pairs for trial in pair)
            names = (*QUALITY, *(WORLD_SHARES if in_world else ()), *COSTS)
            found += [_difference(arm, name, pairs, tolerance, cost) for name in names]
    if not found:
        raise UsageError("the two experiments have no trial in common, so nothing can be compared")
    return found


def _difference(
    arm: str, name: str, pairs: list[tuple[Json, Json]], tolerance: float, cost: float
) -> Difference:
    values = [(float(a[name]), float(b[name])) for a, b in pairs if None not in (a[name], b[name])]
    n = len(values)
    if not n:
        return Difference(arm, name, 0, 0.0, 0.0, (0.0, 0.0), 0, 0, None, False)
    before, after = (sum(side) / n for side in zip(*values, strict=True))
    changes = [b - a for a, b in values]
    good = 1 if name in (*BETTER_HIGH, *WORLD_SHARES) else -1
    better, worse = sum(good * c > 0 for c in changes), sum(good * c < 0 for c in changes)
    p = mcnemar(better, worse) if name in (*SHARES, *WORLD_SHARES) else None
    loss = good * (before - after)
    allowed = cost * before if name in COSTS else tolerance
    regression = loss > allowed + 1e-9
    return Difference(arm, name, n, before, after, bootstrap(changes), better, worse, p, regression)


def other_settings(before: Json, after: Json) -> dict[str, tuple[Any, Any]]:
    """Return the settings in which two experiments differ, by name: both values.

    What only one of the reports has, such as one of an older version, is passed over.
    """
    old, new = (
        record["settings"] if isinstance(record.get("settings"), dict) else {}
        for record in (before, after)
    )
    return {name: (old[name], new[name]) for name in old if name in new and old[name] != new[name]}


def only_in_one(before: Json, after: Json) -> Iterator[str]:
    """Say which trials one experiment has and the other has not."""
    keys = [{(t["id"], t["arm"]) for t in record["trials"]} for record in (before, after)]
    for name, extra in (("first", keys[0] - keys[1]), ("second", keys[1] - keys[0])):
        if extra:
            yield f"{len(extra)} trials are only in the {name}"


WORSE = "worse"
_NARROW = 12
"""Columns that a measure's title keeps on a narrow screen, where it wraps."""


def contrast(
    found: Sequence[Difference], settings: Mapping[str, tuple[Any, Any]]
) -> RenderableType:
    """Lay out in what two experiments differ and what changed, arm by arm, and say the verdict."""
    parts: list[RenderableType] = []
    if settings:
        parts += [_settings(settings), Text()]
    changed = [difference for difference in found if difference.changed]
    if changed:
        parts += [_table(changed), Text()]
    text = verdict(found)
    return Group(*parts, Text(text, "bold red" if any(d.regression for d in found) else "bold"))


def verdict(found: Sequence[Difference]) -> str:
    """Say in a sentence whether the second experiment is worse, and where."""
    worse = [change for change in found if change.regression]
    if worse:
        lines = []
        for arm in dict.fromkeys(change.arm for change in worse):
            titles = [_title(change) for change in worse if change.arm == arm]
            lines.append(f"{HEADS[arm]} in {sentence_list(titles, len(titles))}")
        return f"B is worse than A: {'; '.join(lines)}."
    changed = sum(change.changed for change in found)
    if not changed:
        return "B is not worse than A: nothing changed."
    figures = "1 figure" if changed == 1 else f"{changed} figures"
    return f"B is not worse than A: {figures} changed, none for the worse beyond the tolerance."


def _settings(settings: Mapping[str, tuple[Any, Any]]) -> RenderableType:
    """The settings that differ: what changed may be due to them alone."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("settings that differ", no_wrap=True)
    for head in ("A", "B"):
        table.add_column(head, overflow="fold")
    for name, values in settings.items():
        table.add_row(Text(visible(name)), *(Text(visible(_written(value))) for value in values))
    return table


def _written(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(_written, value)) or "none"
    if isinstance(value, dict):
        return "; ".join(f"{name} {_written(each)}" for name, each in value.items()) or "none"
    return "none" if value is None else str(value)


def _table(changed: Sequence[Difference]) -> Table:
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("", min_width=len(WORSE), no_wrap=True)
    table.add_column("mean a task", min_width=_NARROW)
    for head in ("A", "B", "B − A [95 %]", "+, −", "p"):
        table.add_column(head, justify="right", no_wrap=True)
    for arm in dict.fromkeys(change.arm for change in changed):
        table.add_row("", Text(HEADS[arm], "bold"))
        for change in (each for each in changed if each.arm == arm):
            table.add_row(*_row(change))
    return table


def _row(change: Difference) -> list[Text]:
    p = "" if change.p is None else f"{change.p:.2g}" if change.p >= 0.001 else "<.001"
    mark = Text(WORSE, "bold red") if change.regression else Text()
    values = [_title(change), f"{change.before:.4g}", f"{change.after:.4g}", _gap(change)]
    values += [f"{change.better}, {change.worse}", p]
    return [mark, *map(Text, values)]


def _title(change: Difference) -> str:
    return TITLES.get(change.measure, change.measure)


def _gap(change: Difference) -> str:
    gap, (low, high) = change.after - change.before, change.interval
    if abs(gap) >= 10:
        return f"{gap:+.0f} [{low:.0f}, {high:.0f}]".replace("-", "−")
    return f"{gap:+.2g} [{low:.2g}, {high:.2g}]".replace("-", "−")
