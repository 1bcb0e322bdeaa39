"""What trials come to: shares and means with their intervals, as one object and as tables."""

import json
import math
import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.visible import visible
from adaptbot_cli.evaluation.recordings import ARMS

Json = dict[str, Any]

Z = 1.959963984540054
"""The 97.5 % quantile of the normal distribution."""

RESAMPLES = 2000
Interval = tuple[float, float]


def wilson(successes: int, n: int) -> Interval:
    """Return Wilson's score interval for a share (Wilson, 1927); needs n > 0."""
    share = successes / n
    spread = Z * Z / n
    centre = (share + spread / 2) / (1 + spread)
    half = Z * math.sqrt(share * (1 - share) / n + spread / (4 * n)) / (1 + spread)
    return max(0.0, centre - half), min(1.0, centre + half)


def bootstrap(values: Sequence[float], resamples: int = RESAMPLES) -> Interval:
    """Return the percentile bootstrap interval of a mean (Efron, 1979), the same each time."""
    n = len(values)
    if min(values) == max(values):
        return float(values[0]), float(values[0])
    chance = random.Random(n)
    means = sorted(sum(chance.choices(values, k=n)) / n for _ in range(resamples))
    return means[int(0.025 * resamples)], means[int(0.975 * resamples) - 1]


def mcnemar(better: int, worse: int) -> float:
    """Return the exact two-sided p of McNemar's test for pairs that changed (Fay, 2010)."""
    n = better + worse
    if n == 0:
        return 1.0
    tail: float = sum(math.comb(n, k) for k in range(min(better, worse) + 1)) / 2**n
    return min(1.0, 2 * tail)


SHARES = ("executable", "goal_met")
"""Measures that are true or false of a trial."""

MEANS = (
    "overlap",
    "effective_overlap",
    "model_calls",
    "prompt_tokens",
    "completion_tokens",
    "questions",
    "prompts",
    "person_seconds",
)
"""Measures that are averaged; those that a trial does not have are left out."""

WORLD_SHARES = ("world_goal_met",)
WORLD_MEANS = ("steps_failed", "recovered", "repaired_by_person", "repaired_by_seeing")
"""The same of trials in a world: only these have them."""

_TYPE = " <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> "


def figures(trials: Sequence[Json], cumulative: bool) -> dict[str, Json]:
    """Return the figures of each arm that has trials."""
    return {
        arm: _of_arm([t for t in trials if t["arm"] == arm], cumulative)
        for arm in ARMS
        if any(t["arm"] == arm for t in trials)
    }


def groups(trials: Sequence[Json], cumulative: bool) -> list[Json]:
    """Return the figures of each model and domain, as in the paper's tables."""
    keys = dict.fromkeys((t["model"], t["domain"]) for t in trials)
    found = []
    for model, domain in keys:
        those = [t for t in trials if (t["model"], t["domain"]) == (model, domain)]
        arms = figures(those, cumulative)
        recorded = {arm: _recorded([t for t in those if t["arm"] == arm]) for arm in arms}
        found.append({"model": model, "domain": domain, "arms": arms, "recorded": recorded})
    return found


def _of_arm(trials: Sequence[Json], cumulative: bool) -> Json:
    n = len(trials)
    record: Json = {"n": n}
    intervals: Json = {}
    in_world = all(WORLD_SHARES[0] in t for t in trials)
    for name in (*SHARES, *(WORLD_SHARES if in_world else ())):
        count = sum(bool(t[name]) for t in trials)
        record[name] = count / n
        intervals[name] = wilson(count, n)
    for name in (*MEANS, *(WORLD_MEANS if in_world else ())):
        values = [t[name] for t in trials if t[name] is not None]
        record[name] = sum(values) / len(values) if values else None
        intervals[name] = bootstrap(values) if values else None
    nodes, edges = _sizes(trials, cumulative)
    return {
        **record,
        "required_lost": sum(t["required_lost"] for t in trials),
        "nodes": nodes,
        "edges": edges,
        "seconds": round(sum(t["seconds"] for t in trials), 3),
        "findings": _findings(trials),
        "intervals": intervals,
    }


def _findings(trials: Iterable[Json]) -> dict[str, int]:
    found: Counter[str] = Counter()
    for trial in trials:
        found.update(trial["findings"])
    return dict(sorted(found.items()))


def _sizes(trials: Sequence[Json], cumulative: bool) -> tuple[list[float], list[float]]:
    """Nodes and edges before the first trial and with all that the trials taught.

    Carried over, that is the size after the last one; else the base and every fact taught in any
    of them. Of several series it is the mean.
    """
    before = after = (0.0, 0.0)
    keys = dict.fromkeys((t["model"], t["domain"]) for t in trials)
    for key in keys:
        those = [t for t in trials if (t["model"], t["domain"]) == key]
        base = min(t["nodes"][0] for t in those), min(t["edges"][0] for t in those)
        facts = {fact for t in those for fact in t["taught"]}
        grown = base[0] + sum(_TYPE in fact for fact in facts), base[1] + len(facts)
        if cumulative:
            grown = max(t["nodes"][1] for t in those), max(t["edges"][1] for t in those)
        before = before[0] + base[0] / len(keys), before[1] + base[1] / len(keys)
        after = after[0] + grown[0] / len(keys), after[1] + grown[1] / len(keys)
    return [_plain(before[0]), _plain(after[0])], [_plain(before[1]), _plain(after[1])]


def _plain(value: float) -> float:
    return int(value) if value == int(value) else round(value, 1)


def _recorded(trials: Sequence[Json]) -> dict[str, float]:
    """The means of what the recorded runs of these very tasks had."""
    names = sorted({name for t in trials for name in t["recorded"]})
    found = {}
    for name in names:
        values = [t["recorded"][name] for t in trials if name in t["recorded"]]
        found[name] = sum(values) / len(values)
    return found


@cache
def paper_figures(model: str, domain: str) -> Json | None:
    """Return the paper's figures for a model and domain: `tasks`, and those of each arm."""
    every = json.loads(Path(__file__).with_name("paper.json").read_text(encoding="utf-8"))
    found: Json | None = every.get(domain, {}).get(model)
    return found


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
    if len(groups) > 1:
        n = next(iter(report["arms"].values()))["n"]
        parts += [Text(f"all {n} tasks", "bold"), _means(report["arms"]), Text()]
    scored = [group for group in groups if group["paper"]]
    if scored:
        parts += [_scored(scored)]
    return Group(*parts)


def graphs(settings: Json) -> Iterator[str]:
    """Give a line for each graph that experiments run on, as their settings have them."""
    several = isinstance(settings["domain"], list)
    named = [settings[n] if several else [settings[n]] for n in ("domain", "kg", "truth")]
    for domain, base, truth in zip(*named, strict=True):
        text = f"{domain}: trials start from {' + '.join(base)}"
        if "llm+kg+human" in settings["arms"]:
            known = "the same" if truth == base else " + ".join(truth)
            text += f"; the simulated person knows {known}"
        yield text


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
    table = _means(arms, group)
    sizes = (f"{f['nodes'][1]}, {f['edges'][1]}" for f in arms.values())
    first = next(iter(arms.values()))
    table.add_row("nodes, edges after", *sizes)
    table.add_row(*_dim(["  before", *[f"{first['nodes'][0]}, {first['edges'][0]}"] * len(arms)]))
    if group["paper"]:
        paper = (group["paper"]["arms"].get(arm, {}) for arm in arms)
        sizes = (f"{p['nodes']}, {p['edges']}" if p else "" for p in paper)
        table.add_row(*_dim([f"  paper, {group['paper']['tasks']}", *sizes]))
    table.add_row("seconds, all tasks", *(f"{f['seconds']:.1f}" for f in arms.values()))
    return table


def _means(arms: Mapping[str, Json], group: Json | None = None) -> Table:
    """The measures of some arms, with what was published of them for a group."""
    table = framed("mean a task [95 %]", *map(HEADS.__getitem__, arms))
    for measure in MEASURES:
        if not any(measure.name in figures for figures in arms.values()):
            continue
        table.add_row(measure.title, *(_cell(measure, figures) for figures in arms.values()))
        for label, values in _published(measure, group) if group else ():
            if any(value is not None for value in values):
                written = ("" if value is None else measure.write(value) for value in values)
                table.add_row(*_dim((f"  {label}", *written)))
    return table


def framed(*heads: str) -> Table:
    """Return an empty table whose first column holds names and the others figures."""
    table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 1))
    for n, head in enumerate(heads):
        table.add_column(head, justify="right" if n else "left", no_wrap=True)
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


def _published(measure: Measure, group: Json) -> Iterator[tuple[str, list[float | None]]]:
    """What was published of a measure in each arm: for the same tasks, and in the paper."""
    name, arms, paper = measure.published, group["arms"], group["paper"]
    if name:
        yield "as recorded, same tasks", [group["recorded"][arm].get(name) for arm in arms]
    if name and paper:
        yield f"paper, {paper['tasks']}", [paper["arms"].get(arm, {}).get(name) for arm in arms]


def _dim(values: Iterable[str]) -> list[Text]:
    return [Text(value, "dim") for value in values]


def _scored(groups: Sequence[Json]) -> Group:
    """The paper's success rate on its own: 18 people scored it, which no program can repeat."""
    table = framed("", *HEADS.values())
    for group in groups:
        arms = group["paper"]["arms"]
        rates = [f"{100 * arms[arm]['scored_by_people']:.1f}" for arm in HEADS]
        name = f"{group['model']} · {group['domain']}, {group['paper']['tasks']}"
        table.add_row(name, *rates)
    title = "The paper's success rate, %: scored by people, comparable with no figure above"
    return Group(Text(title, "bold dim"), table)


def report(settings: Json, trials: Sequence[Json]) -> Json:
    """Return everything that trials came to, as one object (docs/evaluation.md)."""
    cumulative = bool(settings["cumulative"])
    found = groups(trials, cumulative)
    for group in found:
        group["paper"] = paper_figures(group["model"], group["domain"])
    return {
        "arms": figures(trials, cumulative),
        "groups": found,
        "settings": settings,
        "trials": list(trials),
    }
