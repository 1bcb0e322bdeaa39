"""An experiment's figures as tables, in the form of the paper's tables 1 and 2."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.visible import visible

Json = dict[str, Any]
HEADS = {"llm": "LLM", "llm+kg": "LLM + KG", "llm+kg+human": "LLM + KG + Human"}


@dataclass(frozen=True, slots=True)
class Measure:
    """A row of the table: its title, the figure's name, how it is written.

    `published` is its name among the recorded and the paper's figures, where they have it.
    """

    title: str
    name: str
    write: Callable[[float], str]
    published: str = ""


def percent(value: float) -> str:
    """Write a share as a percentage, without decimals."""
    return f"{100 * value:.0f}"


def count(value: float) -> str:
    """Write a mean of counts with two decimals."""
    return f"{value:.2f}"


def whole(value: float) -> str:
    """Write a large number without decimals."""
    return f"{value:.0f}"


MEASURES = (
    Measure("executable, %", "executable", percent),
    Measure("goal met, %", "goal_met", percent),
    Measure("goal met in the world, %", "world_goal_met", percent),
    Measure("steps that failed", "steps_failed", count),
    Measure("recovered from", "recovered", count),
    Measure("planted errors, by the person", "repaired_by_person", count),
    Measure("planted errors, by seeing", "repaired_by_seeing", count),
    Measure("ingredient overlap, %", "overlap", percent, "overlap"),
    Measure("effective overlap, %", "effective_overlap", percent),
    Measure("required lost unreported", "required_lost", whole),
    Measure("model calls", "model_calls", count),
    Measure("prompt tokens", "prompt_tokens", whole, "prompt_tokens"),
    Measure("completion tokens", "completion_tokens", whole),
    Measure("questions", "questions", count, "questions"),
    Measure("prompts to the person", "prompts", count),
    Measure("the person's time, s", "person_seconds", whole),
)


TITLES = {measure.name: measure.title.removesuffix(", %") for measure in MEASURES}


def tables(report: Json) -> RenderableType:
    """Lay out a report: one table for each model and domain, and what people scored."""
    settings, groups = report["settings"], report["groups"]
    parts: list[RenderableType] = [Text(visible(line), "dim") for line in graphs(settings)]
    parts += [Text()]
    for group in groups:
        parts += [_title(group, settings), _table(group), Text()]
    parts += [_all_together(report), Text()] if len(groups) > 1 else []
    scored = [group for group in groups if group["paper"]]
    if scored:
        parts += [_scored(scored)]
    return Group(*parts)


def graphs(settings: Json) -> list[str]:
    """Say on which graphs experiments run, a line for each."""
    if isinstance(settings["domain"], str):
        return [_graphs(settings["domain"], settings["kg"], settings["truth"], settings["arms"])]
    each = zip(settings["domain"], settings["kg"], settings["truth"], strict=True)
    return [_graphs(domain, base, truth, settings["arms"]) for domain, base, truth in each]


def _graphs(domain: str, base: Sequence[str], truth: Sequence[str], arms: Sequence[str]) -> str:
    told = f"{domain}: trials start from {' + '.join(base)}"
    if "llm+kg+human" not in arms:
        return told
    known = "the same" if truth == base else " + ".join(truth)
    return f"{told}; the simulated person knows {known}"


def _title(group: Json, settings: Json) -> Text:
    n = next(iter(group["arms"].values()))["n"]
    name = " · ".join(part for part in (group["model"], group["domain"]) if part) or "tasks"
    carried = "knowledge carried over" if settings["cumulative"] else "each from the same graph"
    tasks = f"{n} task{'s' if n != 1 else ''}"
    return Text(name, "bold") + Text(
        f"  {tasks}, {carried}, policy {settings['policy']}", "not bold dim"
    )


def _table(group: Json) -> Table:
    arms = group["arms"]
    table = _frame("mean a task [95 %]", arms)
    for measure in _measured(arms):
        table.add_row(measure.title, *(_cell(measure, figures) for figures in arms.values()))
        for label, row in _published(measure, group):
            table.add_row(Text(f"  {label}", "dim"), *(Text(value, "dim") for value in row))
    sizes = (f"{f['nodes'][1]}, {f['edges'][1]}" for f in arms.values())
    first = next(iter(arms.values()))
    table.add_row("nodes, edges after", *sizes)
    table.add_row(
        Text("  before", "dim"), *_dim([f"{first['nodes'][0]}, {first['edges'][0]}"] * len(arms))
    )
    if group["paper"]:
        paper = (group["paper"]["arms"].get(arm, {}) for arm in arms)
        table.add_row(
            Text(f"  paper, {group['paper']['tasks']}", "dim"),
            *_dim([f"{p['nodes']}, {p['edges']}" if p else "" for p in paper]),
        )
    table.add_row("seconds, all tasks", *(f"{f['seconds']:.1f}" for f in arms.values()))
    return table


def _measured(arms: Mapping[str, Json]) -> list[Measure]:
    """The measures that the arms have."""
    return [m for m in MEASURES if any(m.name in figures for figures in arms.values())]


def _frame(head: str, arms: Mapping[str, Json]) -> Table:
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column(head, no_wrap=True)
    for arm in arms:
        table.add_column(HEADS[arm], justify="right", no_wrap=True)
    return table


def _cell(measure: Measure, figures: Json) -> Text:
    value = figures[measure.name]
    if value is None:
        return Text("–", "dim")
    text = Text(measure.write(value))
    interval = figures["intervals"].get(measure.name)
    if interval and interval[0] != interval[1]:
        low, high = (measure.write(end) for end in interval)
        text += Text(f" [{low}–{high}]", "dim")
    return text


def _published(measure: Measure, group: Json) -> Iterator[tuple[str, list[str]]]:
    """What was published of a measure: for the same tasks, and in the paper."""
    if not measure.published:
        return
    recorded = [group["recorded"][arm].get(measure.published) for arm in group["arms"]]
    if any(value is not None for value in recorded):
        yield "as recorded, same tasks", [_or_nothing(measure, value) for value in recorded]
    if group["paper"]:
        paper = [
            group["paper"]["arms"].get(arm, {}).get(measure.published) for arm in group["arms"]
        ]
        if any(value is not None for value in paper):
            yield f"paper, {group['paper']['tasks']}", [_or_nothing(measure, v) for v in paper]


def _or_nothing(measure: Measure, value: float | None) -> str:
    return "" if value is None else measure.write(value)


def _dim(values: Sequence[str]) -> list[Text]:
    return [Text(value, "dim") for value in values]


def _all_together(report: Json) -> Group:
    arms = report["arms"]
    table = _frame("mean a task [95 %]", arms)
    for measure in _measured(arms):
        table.add_row(measure.title, *(_cell(measure, figures) for figures in arms.values()))
    n = next(iter(arms.values()))["n"]
    return Group(Text(f"all {n} tasks", "bold"), table)


def _scored(groups: Sequence[Json]) -> Group:
    """The paper's success rate on its own: 18 people scored it, which no program can repeat."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    table.add_column("", no_wrap=True)
    for head in HEADS.values():
        table.add_column(head, justify="right", no_wrap=True)
    for group in groups:
        arms = group["paper"]["arms"]
        rates = [f"{100 * arms[arm]['scored_by_people']:.1f}" for arm in HEADS]
        name = f"{group['model']} · {group['domain']}, {group['paper']['tasks']}"
        table.add_row(name, *rates)
    title = "The paper's success rate, %: scored by people, comparable with no figure above"
    return Group(Text(title, "bold dim"), table)
