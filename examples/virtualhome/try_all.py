"""Have tasks of VirtualHome carried out through adaptbot, with plans that are right and wrong.

    python try_all.py --adaptbot PATH/TO/adaptbot --tasks 60 --output figures.json

Each task is run with the package's own steps as the plan (`own`), with every second step left out
(`missing`), with things called by other names from the package's own table (`renamed`), and with
the home changed behind the robot's back (`moved`: what is carried lies somewhere else, in turn
inside something closed and on another surface; where nothing is carried, what is switched on is
unplugged). The same plan is also given to the simulator without adaptbot, which goes on after a
step that it refuses.
"""

import argparse
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from bridge import Bridge
from make_pack import DOMAIN, asked_for, write
from scene import Task, goals, simulator

HERE = Path(__file__).parent
ARMS = ("own", "missing", "renamed", "moved")


@dataclass(frozen=True)
class Trial:
    """A plan for a task, and what is done behind the robot's back."""

    task: str
    arm: str
    plan: list[str]
    disturbed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What came of a trial: in the simulator, in adaptbot's eyes, and without adaptbot."""

    task: str
    kind: str
    arm: str
    met: bool
    claimed: bool
    acted: bool
    refused: int
    recovered: int
    inserted: int
    met_alone: bool
    refused_alone: int
    disturbed: tuple[str, ...]
    findings: list[str]


def chosen(count: int) -> list[Task]:
    """Return tasks, from each kind in turn, whose own steps reach their goal in the simulator."""
    kinds: dict[str, list[str]] = {}
    for number, goal in goals().items():
        kinds.setdefault(goal["kind"], []).append(number)
    mixed = (number for row in zip_longest(*kinds.values()) for number in row if number)
    found: list[Task] = []
    for number in mixed:
        task = Task(number)
        if len(found) < count and not alone(Trial(number, "own", plan_of(task)))["unmet"]:
            found.append(task)
    return found


def plan_of(task: Task) -> list[str]:
    """Return the package's own steps as a plan."""
    return [task.call(line) for line in task.script]


def trials(task: Task, turn: int) -> Iterator[Trial]:
    """Give the trials of a task; one that would be as the first is left out."""
    own = plan_of(task)
    yield Trial(task.number, "own", own)
    if len(own) > 1:
        yield Trial(task.number, "missing", own[::2])
    renamed = [rename(step, task) for step in own]
    if renamed != own:
        yield Trial(task.number, "renamed", renamed)
    disturbed = disturbance(task, turn)
    if disturbed:
        yield Trial(task.number, "moved", own, disturbed)


def rename(step: str, task: Task) -> str:
    """Call the things of a step by the first other name that the package's table has for them."""
    others = simulator().utils.load_name_equivalence()
    taken = {node["class_name"] for node in task.graph["nodes"]}

    def other(match: re.Match[str]) -> str:
        name, number = re.fullmatch(r"(.*?)(_\d+)?", match[1]).groups(default="")
        names = [n for n in others.get(name, ()) if n not in taken]
        return f'"{names[0]}{number}"' if names else match[0]

    return re.sub(r'"([^"]*)"', other, step)


def disturbance(task: Task, turn: int) -> tuple[str, ...]:
    """Return the arguments that change the home, () where there is nothing to change."""
    numbers = {name: number for number, name in task.names.items()}
    steps = [re.match(r'(\w+)\("([^"]*)"', step) for step in plan_of(task)]
    named = {name for step in plan_of(task) for name in re.findall(r'"([^"]*)"', step)}
    for found in filter(None, steps):
        action, name = found.groups()
        if action == "grab" and task.has(numbers[name], "GRABBABLE"):
            shut = {s for s, p, o in task.facts(task.graph) if p == "is_open" and o is False}
            boxes = [n for n, node in task.known.items() if "CONTAINERS" in node["properties"]]
            tops = [n for n, node in task.known.items() if "SURFACES" in node["properties"]]
            inside = [task.names[n] for n in boxes if task.names[n] in shut - named]
            on = [task.names[n] for n in tops if task.names[n] not in named]
            places = [f"inside:{n}" for n in inside], [f"on:{n}" for n in on]
            wanted = places[turn % 2] or places[1]
            return ("--move", f"{name}={wanted[turn % len(wanted)]}") if wanted else ()
    for found in filter(None, steps):
        action, name = found.groups()
        if action == "switchon" and task.has(numbers[name], "HAS_PLUG"):
            return "--set", f"{name}=PLUGGED_OUT"
    return ()


def alone(trial: Trial) -> dict[str, Any]:
    """Give the plan to the simulator as it stands, and go on where it refuses a step."""
    given = dict(zip(trial.disturbed[::2], trial.disturbed[1::2], strict=True))
    moves, states = ([given[key]] if key in given else [] for key in ("--move", "--set"))
    bridge = Bridge(Task(trial.task), moves, states)
    for number, step in enumerate(trial.plan, start=1):
        action, args = step.split("(", 1)
        said = {"act": number, "action": action, "args": json.loads(f"[{args[:-1]}]")}
        bridge.answer({**said, "expects": {"added": [], "removed": []}})
    return bridge.verdict()


def through_adaptbot(trial: Trial, adaptbot: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Run the trial; return what the simulator and what adaptbot tells of it."""
    task = Task(trial.task)
    with tempfile.TemporaryDirectory() as folder:
        workspace, log = Path(folder) / "W", Path(folder) / "log.json"
        write(task, workspace, "\n".join(trial.plan) + "\n")
        words = [sys.executable, str(HERE / "bridge.py"), trial.task, "--log", str(log)]
        world = "exec:" + " ".join(f"'{word}'" for word in (*words, *trial.disturbed))
        ended = subprocess.run(
            [adaptbot, "run", asked_for(task), "--domain", DOMAIN, "--workspace", str(workspace),
             "--model", "library", "--no-human", "--json", "--world", world],
            capture_output=True, text=True, timeout=600, check=False,
        )  # fmt: skip
        if not ended.stdout.startswith("{"):
            raise SystemExit(f"{trial.task}, {trial.arm}: {ended.stderr or ended.stdout}")
        seen = json.loads(log.read_text()) if log.exists() else {}
        return seen, json.loads(ended.stdout)


def tried(trial: Trial, adaptbot: str) -> Outcome:
    """Return what comes of a trial."""
    seen, told = through_adaptbot(trial, adaptbot)
    without = alone(trial)
    world = told.get("world") or {}
    return Outcome(
        task=trial.task,
        kind=Task(trial.task).kind,
        arm=trial.arm,
        met=bool(seen) and not seen["unmet"],
        claimed=bool((told.get("goal") or {}).get("met")),
        acted=bool(seen.get("done") or seen.get("refused")),
        refused=len(seen.get("refused", ())),
        recovered=int(world.get("recovered", 0)),
        inserted=sum(step["status"] == "inserted" for step in told["steps"]),
        met_alone=not without["unmet"],
        refused_alone=len(without["refused"]),
        disturbed=trial.disturbed,
        findings=[f"{finding['code']} {finding['message']}" for finding in told["findings"]],
    )


def summary(outcomes: list[Outcome]) -> Iterator[str]:
    """Write the figures as a table of Markdown."""
    columns = ("plans", "n", "goal met without adaptbot", "with", "adaptbot says so",
               "steps refused without adaptbot", "with", "recovered")  # fmt: skip
    yield f"| {' | '.join(columns)} |"
    yield "|---" * len(columns) + "|"
    for arm in ARMS:
        these = [outcome for outcome in outcomes if outcome.arm == arm]
        sums = (
            sum(o.met_alone for o in these), sum(o.met for o in these),
            sum(o.claimed for o in these), sum(o.refused_alone for o in these),
            sum(o.refused for o in these), sum(o.recovered for o in these),
        )  # fmt: skip
        yield f"| {arm} | {len(these)} | {' | '.join(map(str, sums))} |"


def main() -> None:
    """Run all trials, telling each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--adaptbot", default="adaptbot", help="the command, if not on the path")
    parser.add_argument("--tasks", type=int, default=60, help="how many tasks")
    parser.add_argument("--only", help="one task by its number")
    parser.add_argument("--arms", default=",".join(ARMS))
    parser.add_argument("--output", type=Path, help="write every outcome here, as JSON")
    given = parser.parse_args()
    outcomes = []
    for turn, task in enumerate([Task(given.only)] if given.only else chosen(given.tasks)):
        for trial in trials(task, turn):
            if trial.arm in given.arms.split(","):
                outcomes.append(tried(trial, given.adaptbot))
                sys.stderr.write(json.dumps(asdict(outcomes[-1])) + "\n")
                sys.stderr.flush()
    if given.output:
        given.output.write_text(json.dumps([asdict(o) for o in outcomes], indent=1))
    sys.stdout.write("\n".join(summary(outcomes)) + "\n")


if __name__ == "__main__":
    main()
