"""How many damaged plans are repaired, and how many of the others are mended with a person.

`python tests/bench/mending.py [--domain NAME] [--details]`: the library's plan of each task of both
domains, whole and damaged: any one step dropped or done twice, any two neighbours swapped, one name
written wrongly. The person is simulated and knows what the graph knows.
"""

import argparse
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner.library import Library
from adaptbot_cli.adapters.simulated_person import SimulatedHuman
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.core.tutor import inspect, pursue
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.drive import Nowhere, Ports, drive

DOMAINS = ("kitchen", "household")


class Plan:
    """A planner that has one text."""

    name = "variant"

    def __init__(self, text: str) -> None:
        self.text = text

    def propose(self, turn: Propose) -> Proposal:
        return Proposal(self.text, calls=0)


def variants(text: str) -> Iterator[tuple[str, str]]:
    """Give the plan and each way of damaging it once, with what was done to it."""
    lines = [line for line in text.splitlines() if line.strip()]
    yield "whole", "\n".join(lines)
    for n, line in enumerate(lines):
        yield "dropped", "\n".join(lines[:n] + lines[n + 1 :])
        yield "twice", "\n".join([*lines[: n + 1], *lines[n:]])
        if n:
            yield "swapped", "\n".join([*lines[: n - 1], line, lines[n - 1], *lines[n + 1 :]])
        if '"' in line:
            name = line.split('"')[1]
            wrong = line.replace(f'"{name}"', f'"{name}x"', 1)
            yield "misnamed", "\n".join([*lines[:n], wrong, *lines[n + 1 :]])


def checked(text: str, task: Task, kg: Kg, lexicon: WordNet) -> Result:
    """What `check` says."""
    nobody: Any = None
    ports = Ports(nobody, nobody, lexicon, Nowhere())
    return drive(inspect(task, kg, parse, text), ports)


def with_person(text: str, task: Task, kg: Kg, lexicon: WordNet) -> Result:
    """What a run with the simulated person comes to; the graph is as before afterwards."""
    ports = Ports(Plan(text), SimulatedHuman(kg), lexicon, Nowhere())
    return drive(pursue(task, kg, parse, replans=0), ports)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--domain", choices=DOMAINS)
    parser.add_argument("--details", action="store_true")
    options = parser.parse_args()
    out = Console(width=160, highlight=False)
    table = Table("domain", "plan", "plans", "met by check", "met with a person", "s", box=None)
    lexicon = WordNet()
    for domain in [options.domain] if options.domain else DOMAINS:
        kg = load_kg(read_files(bundled("kg") / domain), domain)
        library = Library((bundled("prompts/library") / domain,), kg.domain)
        seen: Counter[str] = Counter()
        met: Counter[str] = Counter()
        mended: Counter[str] = Counter()
        seconds: defaultdict[str, float] = defaultdict(float)
        for task in kg.domain.tasks:
            for how, text in variants(library.propose(Propose(task)).text):
                start = time.perf_counter()
                seen[how] += 1
                result = checked(text, task, kg, lexicon)
                met[how] += result.goal_met
                if not result.goal_met:
                    fresh = load_kg(read_files(bundled("kg") / domain), domain)
                    result = with_person(text, task, fresh, lexicon)
                mended[how] += result.goal_met
                seconds[how] += time.perf_counter() - start
                if options.details and not result.goal_met:
                    told = [f"{f.code} {f.message}" for f in result.report.findings]
                    out.print(f"{domain} | {task.name} | {how}", *told, "", sep="\n  ")
                    out.print(text, "", sep="\n")
        for how in seen:
            figures = (seen[how], met[how], mended[how])
            table.add_row(domain, how, *map(str, figures), f"{seconds[how]:.1f}")
    out.print(table)


if __name__ == "__main__":
    main()
