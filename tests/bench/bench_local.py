"""The model on board on the paper's 30 recipes, beside the plan library, with nobody answering.

`python tests/bench/bench_local.py [--published DIR] [--replans N] [--arm NAME]…` prints one table.
Each recipe goes through the loop with the plan library; with the model on board, which is shown the
nearest plans of the library; and with the model when the library's own plan of the recipe is taken
out of what it is shown. The model needs the extra `local`.
"""

import argparse
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner.library import Library, nearest_plan, read_library
from adaptbot_cli.adapters.planner.local.prompts import for_model
from adaptbot_cli.adapters.planner.model import Model
from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Ask, Planner, Turn
from adaptbot_cli.core.tutor import pursue
from adaptbot_cli.errors import ModelError
from adaptbot_cli.resources import bundled
from adaptbot_cli.session import Ports, drive, load
from adaptbot_cli.session.driving import Nowhere
from adaptbot_cli.workspace import Workspace
from tests.asking import task_for

LIBRARY, SHOWN, LEFT_OUT = "library", "on board", "on board, own plan left out"
ARMS = (LIBRARY, SHOWN, LEFT_OUT)
KITCHEN = Path("library") / "kitchen"


@dataclass(frozen=True, slots=True)
class Trial:
    """What came of one recipe in one arm."""

    executable: bool
    goal_met: bool
    used: float
    questions: int
    tokens: int
    seconds: float


class Questions:
    """Counts the questions that a person would have been asked."""

    def __init__(self) -> None:
        self.count = 0

    def asked(self, turn: Turn) -> None:
        self.count += isinstance(turn, Ask)

    def replied(self, turn: Turn, reply: object) -> None:
        pass


@contextmanager
def planner(arm: str, task: Task, kg: Kg) -> Iterator[Planner]:
    """Make an arm's planner; nobody changes the bundled prompts, so one is left out of a copy."""
    if arm == LIBRARY:
        yield Library((bundled("prompts") / KITCHEN,), kg.domain)
        return
    with tempfile.TemporaryDirectory() as folder:
        prompts = shutil.copytree(bundled("prompts"), Path(folder) / "prompts")
        own = nearest_plan(task.name, read_library(prompts / KITCHEN))
        if arm == LEFT_OUT and own is not None:
            own[0].path.unlink()
        yield Model(*for_model("local", Prompts(prompts, kg)))


def trial(arm: str, recipe: dict[str, Any], replans: int) -> Trial:
    """Pursue one recipe in one arm, on a fresh kitchen."""
    kg = load(Workspace(Path(tempfile.gettempdir()) / "no workspace"), "kitchen")
    task = task_for(recipe["task"], kg, recipe["ingredients"])
    questions = Questions()
    with planner(arm, task, kg) as plans:
        ports = Ports(plans, AbsentHuman(), WordNet(), Nowhere(), [questions])
        started = time.monotonic()
        try:
            result = drive(pursue(task, kg, parse, "tutor", replans), ports)
        except ModelError:  # no plan in time
            return Trial(False, False, 0.0, 0, 0, time.monotonic() - started)
        seconds = time.monotonic() - started
    named = {
        normal(arg) for written in parse(result.report.text).calls for arg in written.call.args
    }
    return Trial(
        result.verdict == "executable",
        result.goal_met,
        sum(normal(item) in named for item in task.required) / len(task.required),
        questions.count,
        result.usage.prompt_tokens + result.usage.completion_tokens,
        seconds,
    )


def table(trials: dict[str, list[Trial]]) -> Table:
    """Lay the arms out, one a line."""
    columns = ("planner", "recipes", "executable", "goal met", "required items named", "questions")
    out = Table(*columns, "tokens", "seconds", box=None, header_style="bold")
    for arm, done in trials.items():
        n = len(done) or 1
        out.add_row(
            arm,
            str(len(done)),
            str(sum(t.executable for t in done)),
            str(sum(t.goal_met for t in done)),
            f"{sum(t.used for t in done) / n:.0%}",
            f"{sum(t.questions for t in done) / n:.1f}",
            f"{sum(t.tokens for t in done) / n:.0f}",
            f"{sum(t.seconds for t in done) / n:.1f}",
        )
    return out


def main() -> None:
    """Print each trial as it ends, then the table; means are a recipe's."""
    here = Path(__file__).parents[2]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--published", type=Path, default=here.parent / "shared" / "published")
    parser.add_argument("--replans", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="take each Nth recipe only")
    parser.add_argument("--arm", action="append", choices=ARMS)
    options = parser.parse_args()
    listed = json.loads((options.published / "tasks.json").read_text(encoding="utf-8"))
    out = Console(width=120, highlight=False)
    trials: dict[str, list[Trial]] = {arm: [] for arm in options.arm or ARMS}
    for recipe in listed["paper_cooking_30"][:: options.every]:
        for arm, done in trials.items():
            done.append(trial(arm, recipe, options.replans))
            out.print(f"{recipe['task']} | {arm} | {done[-1]}", markup=False, soft_wrap=True)
    out.print(table(trials))


if __name__ == "__main__":
    main()
