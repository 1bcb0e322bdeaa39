"""Prompt tokens of the paper's 30 recipes and 12 cleaning tasks, beside the published figures.

    python tests/bench/bench_prompts.py [--published DIR] [--prompt STYLE] [--tasks]

Tokens are counted as the published ones were: GPT-4's tokenizer over the messages of each prompt,
everything that is sent again included, answers not. The graph is the published one before any human
input. The model's answer is the task's plan of the plan library, and each re-prompt gets the same
answer again, under the paper's policy: so every task that has a finding is re-prompted three times
and never gets better, which is the most that a run can use.
"""

import argparse
import json
import os
import statistics
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner.library import Library
from adaptbot_cli.adapters.planner.prompts import STYLES, Prompts, Style, style_of
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg, read_graphs
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Keep, Kept, Proposal, Propose
from adaptbot_cli.core.tutor import pursue
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.drive import Ports, drive

HERE = Path(__file__).parents[2]
REPLANS = 3
DOMAINS = {
    "cooking": ("kitchen", "paper_cooking_30", "table_1_cooking_30_recipes"),
    "cleaning": ("household", "recorded_cleaning_12", "table_2_cleaning_12_tasks"),
}
"""Of each published domain: ours, the tasks (those of cleaning are the recorded ones: the paper's
12), and the table of the paper."""


@dataclass
class Row:
    """The tokens of one task's prompts: the first, and each re-prompt."""

    task: str
    tokens: list[int] = field(default_factory=list)


@dataclass
class Counting:
    """A planner that answers each prompt with the same plan, and counts the prompt's tokens."""

    prompts: Prompts
    library: Library
    row: Row
    name: str = "counting"

    def propose(self, turn: Propose) -> Proposal:
        """Return the library's plan."""
        sent = self.prompts.messages(turn)
        self.row.tokens.append(tokens("".join(message["content"] for message in sent)))
        return self.library.propose(turn)


class Nowhere:
    """A store that keeps nothing."""

    def keep(self, turn: Keep) -> Kept:
        """Keep nothing."""
        return Kept(None)


def tokens(text: str) -> int:
    """Count with the tokenizer that litellm brings for GPT-4."""
    os.environ.setdefault("LITELLM_LOCAL_MODEL_COST_MAP", "True")
    import litellm

    return int(litellm.token_counter(model="gpt-4", text=text))


def rows(domain: str, published: Path, style: Style) -> list[Row]:
    """Run every task of a domain."""
    name, tasks, _ = DOMAINS[domain]
    facts = read_graphs([published / "kg" / f"{domain}.initial.d65fe35.ttl"])
    kg = load_kg(read_files(bundled("kg") / name), name, facts)
    listed = json.loads((published / "tasks.json").read_text(encoding="utf-8"))[tasks]
    return [_row(kg, entry, style) for entry in listed]


def _row(kg: Kg, entry: Mapping[str, Any], style: Style) -> Row:
    task = Task(str(entry["task"]).replace("_", " "), tuple(entry["ingredients"]))
    row = Row(task.name)
    library = Library((bundled("prompts") / "library" / kg.domain.name,), kg.domain)
    planner = Counting(Prompts(bundled("prompts"), kg, style=style), library, row)
    ports = Ports(planner, AbsentHuman(), WordNet(), Nowhere())
    drive(pursue(task, kg, parse, "paper", REPLANS), ports)
    return row


@dataclass(frozen=True)
class Published:
    """The published tokens: of a first prompt and of a re-prompt in the recordings, and the
    paper's averages a task by model and configuration."""

    first: float
    again: float
    tasks: dict[tuple[str, str], int]


def published(domain: str, folder: Path) -> Published:
    """Read the published figures of a domain.

    The recordings tell the tokens of a task; one without feedback has had the first prompt alone.
    """
    lines = (folder / "plans.dev.jsonl").read_text(encoding="utf-8").splitlines()
    trials = [
        (int(trial["results"]["#token_used"]), int(trial["feedback_rounds"]))
        for run in map(json.loads, lines)
        if run["domain"] == domain
        for trial in run["trials"].values()
    ]
    first = statistics.mean(used for used, rounds in trials if rounds == 0)
    again = statistics.mean((used - first) / rounds for used, rounds in trials if rounds)
    table = json.loads((folder / "published-results.json").read_text(encoding="utf-8"))
    told = {
        (model, arm): figures["avg_tokens"]
        for model, arms in table[DOMAINS[domain][2]].items()
        for arm, figures in arms.items()
    }
    return Published(first, again, told)


def table(domain: str, found: list[Row], theirs: Published) -> list[str]:
    """Lay out a domain's figures as rows of a Markdown table."""
    firsts = [row.tokens[0] for row in found]
    agains = [count for row in found for count in row.tokens[1:]]
    totals = [sum(row.tokens) for row in found]
    told = theirs.tasks.values()
    return [
        _line(f"{domain}: first prompt", firsts, f"{theirs.first:.0f}", theirs.first),
        _line(f"{domain}: each re-prompt", agains, f"{theirs.again:.0f}", theirs.again),
        _line(
            f"{domain}: a task, at most {REPLANS} re-prompts, none of which helps",
            totals,
            f"{min(told)} to {max(told)}",
            statistics.mean(told),
        ),
    ]


def _line(what: str, ours: Iterable[int], theirs: str, their_mean: float) -> str:
    values = list(ours)
    mean = statistics.mean(values)
    shares = f"{mean / their_mean:.0%}"
    return f"| {what} | {mean:.0f} ({min(values)} to {max(values)}) | {theirs} | {shares} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    folder = os.environ.get("ADAPTBOT_PUBLISHED", HERE.parent / "shared" / "published")
    parser.add_argument("--published", type=Path, default=Path(folder))
    parser.add_argument("--tasks", action="store_true", help="one row a task")
    parser.add_argument("--prompt", choices=("auto", *STYLES), default="auto")
    options = parser.parse_args()
    style = style_of(options.prompt)
    found = {domain: rows(domain, options.published, style) for domain in DOMAINS}
    print("| prompt tokens | here, mean (range) | published | share |\n| --- | --- | --- | --- |")
    for domain, its in found.items():
        print("\n".join(table(domain, its, published(domain, options.published))))
    if options.tasks:
        print("\n| task | first prompt | each re-prompt | together |\n| --- | --- | --- | --- |")
        for row in (row for its in found.values() for row in its):
            again = ", ".join(map(str, dict.fromkeys(row.tokens[1:]))) or "none needed"
            print(f"| {row.task} | {row.tokens[0]} | {again} | {sum(row.tokens)} |")


if __name__ == "__main__":
    main()
