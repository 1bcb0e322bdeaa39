"""From trials to the figures of an arm: shares and means with their intervals."""

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from adaptbot_cli.evaluation.intervals import bootstrap, wilson
from adaptbot_cli.evaluation.recordings import ARMS

Json = dict[str, Any]

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
    told: Json = {"n": n}
    intervals: Json = {}
    in_world = all(WORLD_SHARES[0] in t for t in trials)
    for name in (*SHARES, *(WORLD_SHARES if in_world else ())):
        count = sum(bool(t[name]) for t in trials)
        told[name] = count / n
        intervals[name] = wilson(count, n)
    for name in (*MEANS, *(WORLD_MEANS if in_world else ())):
        values = [t[name] for t in trials if t[name] is not None]
        told[name] = sum(values) / len(values) if values else None
        intervals[name] = bootstrap(values) if values else None
    nodes, edges = _sizes(trials, cumulative)
    return {
        **told,
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
