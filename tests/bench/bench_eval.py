"""The figures to reach on the published recordings, and which rows keep them from being reached.

    python tests/bench/bench_eval.py [--published DIR] [--jobs N] [--details]

Each model and domain starts from the published initial graph; the simulated person knows the
published after-human graph. Prints all figures for both policies, with and without `--cumulative`.
"""

import argparse
import os
import resource
import sys
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from rich.console import Console
from rich.table import Table
from rich.text import Text

from adaptbot_cli.evaluation.experiment import (
    Experiment,
    Results,
    Setup,
    prepare,
    together,
)
from adaptbot_cli.evaluation.figures import figures, report, tables
from adaptbot_cli.evaluation.recordings import read_recordings
from adaptbot_cli.evaluation.trial import Rules
from adaptbot_cli.workspace import Workspace

Json = dict[str, Any]
DOMAINS = {"cooking": "kitchen", "cleaning": "household"}
TOGETHER = "llm+kg+human"


class Forgetful(Results):
    """Results that are not written down."""

    def __init__(self) -> None:
        super().__init__(Path("/dev/null"), "")


def experiments(published: Path, **changes: Any) -> Iterator[Experiment]:
    """One experiment for each model and domain, on its own graphs."""
    rows = read_recordings(published / "plans.dev.jsonl")
    for model, domain in dict.fromkeys(row.series for row in rows):
        setup = Setup(
            domain=DOMAINS[domain],
            kg=(published / "kg" / f"{domain}.initial.d65fe35.ttl",),
            truth=(published / "kg" / f"{domain}.after-human.{model}.d65fe35.ttl",),
            select=f"{model}/*",
        )
        own = {each.name for each in fields(Rules)}
        rules = Rules(**{key: value for key, value in changes.items() if key in own})
        rest = {key: value for key, value in changes.items() if key not in own}
        changed = replace(setup, rules=rules, **rest)
        yield prepare(changed, rows, Workspace(Path("/nonexistent")))


def run(published: Path, jobs: int, **changes: Any) -> Json:
    """Run the four experiments and put their trials together."""
    trials: list[Json] = []
    each = list(experiments(published, jobs=jobs, **changes))
    for experiment in each:
        results = Forgetful()
        with experiment.workers(results) as pool:
            trials += experiment.run(results, pool=pool)
    return report(together(each), trials)


def goals(
    tutor: Json, carried: Json, seconds: tuple[float, float]
) -> Iterator[tuple[str, str, bool]]:
    """Each figure to reach: what it is, what it is now, whether it is reached."""
    m = tutor["arms"][TOGETHER]
    n = m["n"]
    yield "goal met at least 97 %", f"{m['goal_met']:.1%} of {n}", m["goal_met"] >= 0.97
    effective = m["effective_overlap"]
    yield "effective overlap at least 97 %", f"{effective:.1%}", effective >= 0.97
    yield "required items lost unreported: none", str(m["required_lost"]), not m["required_lost"]
    beyond = m["model_calls"] - 1
    yield "fewer than 1 model call beyond the first", f"{beyond:.2f}", beyond < 1
    asked = f"{m['questions']:.2f} ({m['prompts']:.2f} prompts)"
    yield "at most 2 questions a task", asked, m["questions"] <= 2
    late = figures(second_halves(carried["trials"]), cumulative=True)[TOGETHER]
    asked = f"{late['questions']:.2f} ({late['prompts']:.2f} prompts)"
    yield "fewer than 1 question, second half carried over", asked, late["questions"] < 1
    for group in tutor["groups"]:
        name = f"{group['model']} {group['domain']}"
        ours, recorded = group["arms"]["llm+kg"], group["recorded"]
        tokens, theirs = ours["prompt_tokens"], recorded[TOGETHER]["prompt_tokens"]
        told = f"{tokens:.0f}, published {theirs:.0f}"
        yield f"{name}: llm+kg tokens below published +human", told, tokens < theirs
        overlap, theirs = ours["overlap"], recorded["llm+kg"]["overlap"]
        told = f"{overlap:.1%}, published {theirs:.1%}"
        yield f"{name}: llm+kg overlap above published", told, overlap > theirs
    wall, cpu = seconds
    told = f"{wall:.1f} s ({cpu:.1f} s of processor time)"
    yield "36 rows in three arms under 20 s", told, wall < 20


def cpu_seconds() -> float:
    """Processor time of this process and of those that it has ended."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


def second_halves(trials: list[Json]) -> list[Json]:
    """The later half of each series of tasks."""
    found: list[Json] = []
    for key in dict.fromkeys((t["model"], t["domain"]) for t in trials):
        those = [t for t in trials if (t["model"], t["domain"]) == key]
        order = sorted({t["index"] for t in those})
        found += [t for t in those if t["index"] in order[len(order) // 2 :]]
    return found


def short(trials: list[Json], details: bool) -> Iterator[str]:
    """The rows that fall short, and why."""
    for t in trials:
        if t["arm"] != TOGETHER:
            continue
        fine = t["goal_met"] and t["effective_overlap"] == 1 and not t["required_lost"]
        if fine and not details:
            continue
        unworked = ", ".join(t["unworked"])
        told = [] if t["executable"] else ["not executable"]
        told += [] if t["goal_met"] else ["goal not met"]
        told += [f"not really used: {unworked}"] if unworked else []
        told += [f"lost: {', '.join(t['lost'])}"] if t["lost"] else []
        told += [f"{t['model_calls']} calls, {t['questions']} questions"]
        yield f"{t['id']} {t['task']}: {'; '.join(told)}"
        yield from (f"    {message}" for message in t["messages"])


def main() -> None:
    """Print the report."""
    here = Path(__file__).parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    usual = os.environ.get("ADAPTBOT_PUBLISHED", here.parent / "shared" / "published")
    parser.add_argument("--published", type=Path, default=Path(usual))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--details", action="store_true", help="what was left open in each row")
    options = parser.parse_args()
    out = Console(width=140, highlight=False)
    started, worked = time.perf_counter(), cpu_seconds()
    tutor = run(options.published, options.jobs)
    seconds = (time.perf_counter() - started, cpu_seconds() - worked)
    paper = run(options.published, options.jobs, policy="paper")
    carried = run(options.published, options.jobs, cumulative=True)
    for told in (tutor, paper, carried):
        out.print(tables(told), "")
    table = Table("figure to reach", "now", "", box=None, header_style="bold")
    for name, now, reached in goals(tutor, carried, seconds):
        table.add_row(name, now, Text("reached", "green") if reached else Text("NOT", "bold red"))
    out.print(table)
    out.print("\n[bold]Rows that fall short, policy tutor[/bold]")
    for line in short(tutor["trials"], options.details):
        out.print(line, markup=False, soft_wrap=True)


if __name__ == "__main__":
    main()
