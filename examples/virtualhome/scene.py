"""VirtualHome's households, tasks and judge as the package `virtualhome-eval` has them.

Nothing of them is copied here: all is read from the installed package. What this module adds are
names (the package has numbers), and which of its relations a robot's belief has a word for.
"""

import importlib.util
import json
import re
import sys
import types
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

Fact = tuple[str, str, Any]
"""Thing, property, and the other thing or the value, as the pack names them."""

ROBOT = 65
"""The number of the character in the first scene, which is the one that has tasks with goals."""

STATES = {
    "OPEN": ("is_open", True),
    "CLOSED": ("is_open", False),
    "ON": ("is_on", True),
    "OFF": ("is_on", False),
    "PLUGGED_IN": ("plugged_in", True),
    "PLUGGED_OUT": ("plugged_in", False),
    "CLEAN": ("clean", True),
    "DIRTY": ("clean", False),
    "SITTING": ("sitting", True),
    "LYING": ("lying", True),
}
"""What each state of the simulator says in the pack."""

OF_THINGS = {"ON": "on", "CLOSE": "close_to", "FACING": "looks_at"}
OF_THE_ROBOT = {
    "ON": "rests_on",
    "CLOSE": "near",
    "FACING": "faces",
    "HOLDS_RH": "holds_rh",
    "HOLDS_LH": "holds_lh",
}
"""What a relation says in the pack, of things and of the robot; INSIDE says one of two things."""

BACKGROUND = {"Walls", "Ceiling", "Floor", "Floors", "Windows"}
"""Categories of which no task needs anything: a home without them is large enough."""


@cache
def package() -> Path:
    """Return where the package is installed.

    Raises:
        ModuleNotFoundError: it is not.
    """
    found = importlib.util.find_spec("virtualhome_eval")
    if found is None or not found.submodule_search_locations:
        raise ModuleNotFoundError("virtualhome-eval is not installed: see README.md")
    return Path(found.submodule_search_locations[0])


@cache
def simulator() -> Any:
    """Return the simulator's modules, without those that only call models and draw prompts."""
    for absent in ("openai", "ipdb"):  # imported there and not used by what is used here
        if importlib.util.find_spec(absent) is None:
            sys.modules.setdefault(absent, types.ModuleType(absent))
    from virtualhome_eval.simulation.evolving_graph import (
        environment,
        eval_utils,
        execution,
        scripts,
        utils,
    )

    return types.SimpleNamespace(
        environment=environment, execution=execution, scripts=scripts, judge=eval_utils, utils=utils
    )


@cache
def goals() -> dict[str, dict[str, Any]]:
    """Return the goal of each task by its number, such as 27_2."""
    path = package() / "resources" / "virtualhome" / "task_state_LTL_formula_accurate.json"
    kinds = json.loads(path.read_text())["scene_1"]
    return {
        number: {"kind": kind, **found["vh_goal"]}
        for kind, tasks in kinds.items()
        for number, found in tasks.items()
    }


@dataclass(frozen=True)
class Task:
    """One of the package's tasks: its kind, its scene, its own steps and what is judged."""

    number: str

    @property
    def kind(self) -> str:
        """What it is called, such as "Wash clothes"."""
        return str(goals()[self.number]["kind"])

    @property
    def wanted(self) -> tuple[list[dict[str, Any]], list[str]]:
        """The states and relations that must hold at the end, and the actions that must be done."""
        found = goals()[self.number]
        return found["goal"], found["actions"]

    @cached_property
    def graph(self) -> dict[str, Any]:
        """The scene before the task, as the package stores it."""
        stored = json.loads(self._file("init_and_final_graphs", "json").read_text())
        graph: dict[str, Any] = stored["init_graph"]
        return graph

    @cached_property
    def script(self) -> list[str]:
        """Its own steps, as `[WALK] <couch> (352)`."""
        lines = self._file("executable_programs", "txt").read_text().splitlines()
        return [re.sub(r"\(\d+\.(\d+)\)", r"(\1)", s.strip()) for s in lines if s.startswith("[")]

    @cached_property
    def names(self) -> dict[int, str]:
        """The name of each thing by its number: its class, with the number if others have it."""
        several = Counter(node["class_name"] for node in self.graph["nodes"])
        return {
            node["id"]: "robot"
            if node["id"] == ROBOT
            else node["class_name"]
            if several[node["class_name"]] == 1
            else f"{node['class_name']}_{node['id']}"
            for node in self.graph["nodes"]
        }

    @cached_property
    def known(self) -> dict[int, dict[str, Any]]:
        """The things that the robot knows of: all but the background, and what the task names."""
        named = {int(n) for line in self.script for n in re.findall(r"\((\d+)\)", line)}
        named |= {g[k] for g in self.wanted[0] for k in ("id", "from_id", "to_id") if k in g}
        return {
            node["id"]: node
            for node in self.graph["nodes"]
            if node["category"] not in BACKGROUND or node["id"] in named
        }

    def _file(self, kind: str, ending: str) -> Path:
        folder = package() / "dataset" / "programs_processed_precond_nograb_morepreconds" / kind
        (found,) = folder.glob(f"TrimmedTestScene1_graph/*/file{self.number}.{ending}")
        return found

    def call(self, line: str) -> str:
        """Return a step of a script as a step of a plan: `walk("couch")`."""
        action = line.partition("]")[0].strip("[ ").lower()
        things = [self.names[int(n)] for n in re.findall(r"\((\d+)\)", line)]
        return f"{action}({', '.join(json.dumps(thing) for thing in things)})"

    def line(self, action: str, things: list[str]) -> str:
        """Return a step of a plan as a step of a script. Raises KeyError for what is not there."""
        numbers = {name: number for number, name in self.names.items()}
        classes = {node["id"]: node["class_name"] for node in self.graph["nodes"]}
        told = [f"<{classes[numbers[thing]]}> ({numbers[thing]})" for thing in things]
        return " ".join([f"[{action.upper()}]", *told])

    def facts(self, graph: dict[str, Any]) -> set[Fact]:
        """Return what a graph of the simulator says in the words of the pack."""
        return {*self._states(graph), *self._relations(graph)}

    def _states(self, graph: dict[str, Any]) -> Iterator[Fact]:
        for node in graph["nodes"]:
            for state in node["states"] if node["id"] in self.known else ():
                if state in STATES:
                    yield self.names[node["id"]], *STATES[state]

    def _relations(self, graph: dict[str, Any]) -> Iterator[Fact]:
        for edge in graph["edges"]:
            source, target = edge["from_id"], edge["to_id"]
            if source not in self.known or target not in self.known or source == target:
                continue
            prop = self._property(edge["relation_type"], source, target)
            if prop:
                yield self.names[source], prop, self.names[target]

    def _property(self, relation: str, source: int, target: int) -> str:
        if relation == "INSIDE":
            return "in_room" if self.is_room(target) else "" if source == ROBOT else "inside"
        if source == ROBOT:
            return OF_THE_ROBOT.get(relation, "")
        if target == ROBOT:
            return "worn" if relation == "ON" else ""
        prop = OF_THINGS.get(relation, "")
        # A thing is near what stays where it is: what is carried takes no other thing along.
        carried = self.has(target, "GRABBABLE") or self.known[target]["class_name"] == "water"
        if prop == "close_to" and (carried or self.is_room(source)):
            return ""
        if prop == "looks_at" and not (self.has(source, "SITTABLE") or self.has(source, "LIEABLE")):
            return ""
        return prop

    def is_room(self, number: int) -> bool:
        """Whether this is a room."""
        return bool(self.known[number]["category"] == "Rooms")

    def has(self, number: int, trait: str) -> bool:
        """Whether a thing has one of the simulator's properties, such as GRABBABLE."""
        return trait in self.known[number]["properties"]

    def unmet(self, graph: dict[str, Any], done: list[str]) -> list[str]:
        """Return what is not so in the end, as the package's own judge sees it.

        It is asked about one thing at a time, as its loop over relations ends at the first that
        holds.
        """
        judge = simulator().judge.scene_evaluate_wID
        states, actions = self.wanted
        found = []
        for goal in states:
            of_node = "state" in goal
            met = judge(graph, [goal] if of_node else [], [] if of_node else [goal], ROBOT)[3]
            if not met:
                found.append(self._told(goal))
        if actions and not judge(graph, [], [], ROBOT, done, actions)[3]:
            found.append(f"{' then '.join(actions)} was not done")
        return found

    def _told(self, goal: dict[str, Any]) -> str:
        if "state" in goal:
            return f"{self.names.get(goal['id'], '?')} is not {goal['state']}"
        source, target = (self.names.get(goal[k], "?") for k in ("from_id", "to_id"))
        return f"{source} is not {goal['relation_type']} {target}"


class World:
    """A scene in which steps are done by the package's own executor."""

    def __init__(self, graph: dict[str, Any]) -> None:
        sim = simulator()
        self._execution, self._scripts = sim.execution, sim.scripts
        environment = sim.environment.EnvironmentGraph(graph)
        names = sim.utils.load_name_equivalence()
        self._state = sim.environment.EnvironmentState(environment, names, instance_selection=True)
        self._executor = sim.execution.ScriptExecutor(environment, names)
        self.done: list[str] = []

    @property
    def graph(self) -> dict[str, Any]:
        """The scene as it is now."""
        graph: dict[str, Any] = self._state.to_dict()
        return graph

    def do(self, line: str) -> str:
        """Do a step; return why it failed, "" if it did not."""
        info = self._execution.ExecutionInfo(eval_mode=True)
        try:
            script = self._scripts.Script([self._scripts.parse_script_line(line, len(self.done))])
            following = self._executor.call_action_method(script, self._state, info, 0)
            state = next(following, None)
        except Exception as error:  # its executors raise what they please
            return " ".join(str(error).split()) or type(error).__name__
        if state is None:
            return str(info.get_error_string()) or "it could not be done"
        self._state = state
        self.done.append(line)
        return ""
