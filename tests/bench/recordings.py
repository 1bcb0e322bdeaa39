"""The published recordings through parse, check, refine and repair, without model or human.

`python tests/bench/recordings.py [--published DIR] [--details]` prints one table: each recorded
first answer on the published graph before any human input and on the one after it, beside what the
published implementation recorded. Substitutions are all listed, for judging.
"""

import argparse
import os
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg, read_graphs
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.tutor import inspect
from adaptbot_cli.evaluation.recordings import Recording, read_recordings
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.drive import Nowhere, Ports, drive

DOMAINS = {"cooking": "kitchen", "cleaning": "household"}
PUBLISHED_SECONDS_A_STEP = 0.5


@dataclass
class Checked:
    """One recorded run's first answer, on both graphs."""

    row: Recording
    before: Result
    after: Result
    seconds: float


class Bench:
    """Loads each graph once, then checks plans on it."""

    def __init__(self, published: Path) -> None:
        self.published = published
        self.lexicon = WordNet()
        self.graphs: dict[str, Kg] = {}

    def kg(self, domain: str, file: str) -> Kg:
        if file not in self.graphs:
            pack = read_files(bundled("kg") / DOMAINS[domain])
            facts = read_graphs([self.published / "kg" / file])
            self.graphs[file] = load_kg(pack, DOMAINS[domain], facts)
        return self.graphs[file]

    def check(self, text: str, task: Task, kg: Kg) -> Result:
        nobody: Any = None
        ports = Ports(nobody, nobody, self.lexicon, Nowhere())
        return drive(inspect(task, kg, parser(kg), text), ports)

    def row(self, row: Recording) -> Checked:
        text = row.replies("llm")[0]
        task = Task(row.task, row.required)
        before = self.kg(row.domain, f"{row.domain}.initial.d65fe35.ttl")
        after = self.kg(row.domain, f"{row.domain}.after-human.{row.model}.d65fe35.ttl")
        first = self.check(text, task, before)
        started = time.perf_counter()
        second = self.check(text, task, after)
        return Checked(row, first, second, time.perf_counter() - started)


def unknown(result: Result) -> set[str]:
    """Return the names that a result reports as unknown."""
    return {f.subject for f in result.report.findings if f.code in ("E101", "E201")}


def table(rows: list[Checked]) -> Table:
    """Lay the rows out beside what was recorded."""
    out = Table(
        "row",
        "task",
        "steps",
        "initial graph: unknown",
        "after-human graph",
        "goal",
        "codes",
        "ms",
        "recorded llm_kg: overlap",
        box=None,
        header_style="bold",
    )
    for row in rows:
        codes = Counter(f.code for f in row.after.report.findings)
        overlap = row.row.recorded.get("llm+kg", {}).get("overlap", 0)
        out.add_row(
            row.row.id,
            row.row.task,
            str(len(row.after.report.steps)),
            ", ".join(sorted(unknown(row.before))) or row.before.verdict,
            row.after.verdict,
            "met" if row.after.goal_met else "not met",
            " ".join(f"{code}x{n}" for code, n in sorted(codes.items())),
            f"{row.seconds * 1000:.0f}",
            f"{overlap:.0%}",
        )
    return out


def substitutions(rows: list[Checked]) -> list[tuple[str, str, str, str, str]]:
    """Return every substitution of every row, once: row, from, to, by, evidence."""
    found = [
        (row.row.id, change.source, change.target, change.by, change.evidence)
        for row in rows
        for result in (row.before, row.after)
        for step in result.report.steps
        for change in step.changes
    ]
    return list(dict.fromkeys(found))


def summary(rows: list[Checked]) -> list[str]:
    """Return the figures of all rows together."""
    n, seconds = len(rows), sum(row.seconds for row in rows)
    steps = sum(len(row.after.report.steps) for row in rows)
    executable = sum(row.after.verdict == "executable" for row in rows)
    met = sum(row.after.goal_met for row in rows)
    lost = sum(
        normal(item) not in {normal(f.subject) for f in row.after.report.findings}
        for row in rows
        for item in row.after.report.missing
    )
    speed = PUBLISHED_SECONDS_A_STEP / (seconds / steps)
    return [
        f"executable on the after-human graph: {executable} of {n} ({executable / n:.0%})",
        f"goal of the domain met as well: {met} of {n} ({met / n:.0%})",
        f"required items lost unreported: {lost}",
        f"{n} first answers in {seconds:.2f} s after loading, "
        f"{speed:.0f} times the published implementation's speed a step",
    ]


def main() -> None:
    """Print the report."""
    here = Path(__file__).parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    usual = os.environ.get("ADAPTBOT_PUBLISHED", here.parent / "shared" / "published")
    parser.add_argument("--published", type=Path, default=Path(usual))
    parser.add_argument("--details", action="store_true", help="list every finding")
    options = parser.parse_args()
    bench = Bench(options.published)
    rows = [bench.row(row) for row in read_recordings(options.published / "plans.dev.jsonl")]
    out = Console(width=200, highlight=False)
    out.print(table(rows))
    out.print("\n[bold]Substitutions, for judging[/bold]")
    for entry in substitutions(rows):
        out.print("  " + " | ".join(entry), markup=False)
    if options.details:
        out.print("\n[bold]Findings on the after-human graph[/bold]")
        for row in rows:
            for finding in (
                *row.after.report.findings,
                *(row.after.outcome.unmet if row.after.outcome else ()),
            ):
                out.print(f"  {row.row.id} {finding.code} {finding.message}", markup=False)
    out.print()
    for line in summary(rows):
        out.print(line, markup=False)


if __name__ == "__main__":
    main()
