"""Two experiments side by side on the screen: their settings, what changed, the verdict."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.visible import visible
from adaptbot_cli.evaluation.comparing import Difference
from adaptbot_cli.evaluation.tables import HEADS, TITLES

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
    said = verdict(found)
    return Group(*parts, Text(said, "bold red" if any(d.regression for d in found) else "bold"))


def verdict(found: Sequence[Difference]) -> str:
    """Say in a sentence whether the second experiment is worse, and where."""
    worse = [change for change in found if change.regression]
    if worse:
        told = []
        for arm in dict.fromkeys(change.arm for change in worse):
            titles = [_title(change) for change in worse if change.arm == arm]
            told.append(f"{HEADS[arm]} in {sentence_list(titles, len(titles))}")
        return f"B is worse than A: {'; '.join(told)}."
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
        table.add_row(Text(visible(name)), *(Text(visible(_told(value))) for value in values))
    return table


def _told(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(_told, value)) or "none"
    if isinstance(value, dict):
        return "; ".join(f"{name} {_told(each)}" for name, each in value.items()) or "none"
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
    mark = Text(WORSE, "bold red") if change.regression else Text()
    values = [_title(change), f"{change.before:.4g}", f"{change.after:.4g}", _gap(change)]
    values += [f"{change.better}, {change.worse}", _probability(change.p)]
    return [mark, *map(Text, values)]


def _title(change: Difference) -> str:
    return TITLES.get(change.measure, change.measure)


def _gap(change: Difference) -> str:
    gap, (low, high) = change.after - change.before, change.interval
    if abs(gap) >= 10:
        return f"{gap:+.0f} [{low:.0f}, {high:.0f}]".replace("-", "−")
    return f"{gap:+.2g} [{low:.2g}, {high:.2g}]".replace("-", "−")


def _probability(p: float | None) -> str:
    if p is None:
        return ""
    return f"{p:.2g}" if p >= 0.001 else "<.001"
