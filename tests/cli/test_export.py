"""A checked plan for a robot's own executive, read by libraries that are not ours."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import pyoxigraph
import pytest
from rdflib import Graph

from adaptbot_cli.adapters.plan_forms import spellings
from tests.cli.command import ROOT, Home
from tests.cli.shape import misfits

DATA: Final = Path(__file__).parents[1] / "data" / "pddl"
GUARD: Final = {"ask": str, "given": dict, "otherwise": str}
SHAPE: Final = {
    "adaptbot": int,
    "task": str,
    "domain": str,
    "steps": [
        {
            "n": int,
            "action": str,
            "arguments": dict,
            "call": str,
            "inserted": bool,
            "conditions": [GUARD],
            "expects": {"added": [list], "removed": [list]},
        }
    ],
    "goal": [GUARD],
}
EX: Final = "http://example.org/"


class Facts:
    """The kitchen's facts in a store of its own, changed by what an export says of its steps."""

    def __init__(self, told: Any) -> None:
        self.steps = {step["call"]: step["expects"] for step in told["steps"]}
        self.done: list[str] = []
        self.store = pyoxigraph.Store()
        for name in ("domain", "attributes", "state"):
            graph = Graph().parse(ROOT / "kg" / "kitchen" / f"{name}.ttl")
            self.store.load(graph.serialize(format="nt").encode(), pyoxigraph.RdfFormat.N_TRIPLES)

    def holds(self, ask: str) -> bool:
        return bool(self.store.query(ask))

    def do(self, call: str) -> None:
        self.done.append(call)
        for fact in self.steps[call]["removed"]:
            self.store.update(f"DELETE DATA {{ {written(fact)} }}")
        for fact in self.steps[call]["added"]:
            self.store.update(f"INSERT DATA {{ {written(fact)} }}")


def written(fact: list[Any]) -> str:
    subject, prop, value = fact
    told = f"<{EX}{value}>" if isinstance(value, str) else json.dumps(value)
    return f"<{EX}{subject}> <{EX}{prop}> {told}"


@pytest.fixture(scope="module")
def tea(used: Home) -> Home:
    """Return a home in which tea was made."""
    assert used.adaptbot("run", "make tea", "--no-human").code == 0
    return used


def test_json_tells_conditions_that_hold_step_by_step_and_effects_that_reach_the_goal(
    tea: Home,
) -> None:
    told = tea.adaptbot("export", "make tea").json()
    assert misfits(told, SHAPE) == []
    assert told["task"] == "make tea" and len(told["steps"]) == 14
    facts = Facts(told)
    for step in told["steps"]:
        assert all(facts.holds(each["ask"]) for each in step["conditions"]), step
        facts.do(step["call"])
    assert told["goal"] and all(facts.holds(each["ask"]) for each in told["goal"])
    boil = next(step for step in told["steps"] if step["action"] == "boil")
    assert boil["arguments"] == {"obj": "water", "utensil": "pot", "stove": "stove"}
    assert "stove must be switched on" in {each["otherwise"] for each in boil["conditions"]}
    assert not Facts(told).holds(boil["conditions"][-1]["ask"])


def test_a_script_has_the_form_of_virtualhome(tea: Home) -> None:
    lines = tea.adaptbot("export", "make tea", "--as", "script").out.splitlines()
    assert lines[0] == "[PICK_UP_REC] <pot> (1)" and "[SWITCH_OFF] <stove> (1)" in lines
    assert "[WAIT] # minutes=3" in lines
    form = re.compile(r"\[[A-Z_]+\]( <\w+> \(\d+\))*( # .*)?")
    assert [line for line in lines if not form.fullmatch(line)] == []


def trees(
    text: str, holds: Callable[[str], bool], do: Callable[[str, dict[str, str]], bool]
) -> Any:
    """Load a tree of BehaviorTree.CPP with py_trees, a library that is not ours."""
    py_trees = pytest.importorskip("py_trees")
    status, compose = py_trees.common.Status, py_trees.composites

    class Leaf(py_trees.behaviour.Behaviour):  # type: ignore[misc, name-defined]
        def __init__(self, node: ET.Element) -> None:
            super().__init__(node.get("name", node.get("ID", "")))
            self.node = dict(node.attrib)
            self.asks = node.tag == "Condition"

        def update(self) -> Any:
            good = holds(self.node["ask"]) if self.asks else do(self.node["ID"], self.node)
            return status.SUCCESS if good else status.FAILURE

    def loaded(node: ET.Element) -> Any:
        if node.tag in ("Action", "Condition"):
            return Leaf(node)
        kind = {"Sequence": compose.Sequence, "Fallback": compose.Selector}[node.tag]
        return kind(node.get("name", node.tag), memory=True, children=[*map(loaded, node)])

    root = ET.fromstring(text)
    assert root.get("BTCPP_format") == "4"
    named = {tree.get("ID"): tree for tree in root.iter("BehaviorTree")}
    (main,) = named[root.get("main_tree_to_execute")]
    tree = py_trees.trees.BehaviourTree(loaded(main))
    tree.setup()
    tree.tick()
    return tree.root.status.name


def test_a_tree_is_ticked_to_its_goal_and_recovers_where_a_condition_does_not_hold(
    tea: Home,
) -> None:
    told = tea.adaptbot("export", "make tea").json()
    text = tea.adaptbot("export", "make tea", "--as", "bt").out
    facts, recovered = Facts(told), []

    def do(kind: str, node: dict[str, str]) -> bool:
        if kind == "Recover":
            recovered.append((node["step"], node["call"]))
            return False
        facts.do(node["name"])
        return True

    assert trees(text, facts.holds, do) == "SUCCESS" and recovered == []
    assert facts.done == [step["call"] for step in told["steps"]]

    facts = Facts(told)
    facts.steps['switch("stove", "on")'] = {"added": [], "removed": []}  # it does not go on
    assert trees(text, facts.holds, do) == "FAILURE"
    assert [number for number, _ in recovered] == ["6"] and len(facts.done) == 5


def test_a_tree_documents_every_node_and_port_that_it_uses(tea: Home) -> None:
    root = ET.fromstring(tea.adaptbot("export", "make tea", "--as", "bt").out)
    model = {
        node.get("ID"): {port.get("name") for port in node} for node in root.find("TreeNodesModel")
    }
    (tree,) = root.iter("BehaviorTree")
    for tag in ("Action", "Condition"):
        for node in tree.iter(tag):
            ports = node.attrib.keys() - {"ID", "name"}
            assert ports <= model[node.get("ID")], node.attrib


PLANS: Final = {
    "gripper": """(pick ball-1 kitchen left) (pick ball-2 kitchen right) (move kitchen hall)
        (drop ball-1 hall left) (drop ball-2 hall right)""",
    "blocks": "(unstack red green) (stack red blue) (stack green red)",
    "laundry": """(open-door machine) (take shirt hamper) (put shirt machine) (close-door machine)
        (wash machine) (stop machine) (open-door machine) (take shirt machine) (walk balcony)
        (hang shirt)""",
}
"""Plans; the last two lack a step, so that what is exported is what was repaired."""


@pytest.mark.parametrize("name", PLANS)
def test_a_plan_of_pddl_is_accepted_by_a_validator_beside_its_domain_and_problem(
    home: Home, name: str
) -> None:
    up = pytest.importorskip("unified_planning.shortcuts")
    io = pytest.importorskip("unified_planning.io")
    up.get_environment().credits_stream = None
    files = [str(DATA / f"{name}.pddl"), str(DATA / f"{name}-problem.pddl")]
    assert home.adaptbot("domain", "import", *files).code == 0
    plan = home.write("short.plan", PLANS[name].replace(")", ")\n"))
    goal = {"gripper": "two balls", "blocks": "turn the tower", "laundry": "wash and hang"}[name]
    asked = ("export", plan, "--domain", name, "--task", goal, "--as", "pddl")
    ended = home.adaptbot(*asked, "-o", str(home.folder / "out.plan"))
    assert ended.code == 0 and "written to" in ended.err
    kept = home.workspace / "kg" / name
    problem = io.PDDLReader().parse_problem(str(kept / "domain.pddl"), str(kept / "problem.pddl"))
    read = io.PDDLReader().parse_plan(problem, str(home.folder / "out.plan"))
    assert len(read.actions) == PLANS[name].count("(") + (name != "gripper")
    with up.PlanValidator(problem_kind=problem.kind) as validator:
        assert validator.validate(problem, read)


def test_what_is_not_executable_is_not_handed_over(home: Home) -> None:
    plan = home.write("odd.plan", 'slice("unicorn", "knife")\n')
    ended = home.adaptbot("export", plan, "--domain", "kitchen", "--as", "bt")
    assert ended.code == 3 and ended.out == "" and "E201" in ended.err and "unicorn" in ended.err
    short = home.write("short.plan", 'pick_up_rec("cup")\n')
    ended = home.adaptbot("export", short, "--domain", "kitchen", "--task", "make tea")
    assert ended.code == 3 and ended.out == "" and "E50" in ended.err


def test_a_run_in_a_world_is_exported_as_it_was_checked_before_the_robot_acted(home: Home) -> None:
    world = home.write(
        "world.ttl",
        "@prefix ab: <urn:adaptbot:> . @prefix ex: <http://example.org/> .\n"
        'ex:stove ab:fails [ ab:action "switch" ; ab:times 1 ; ab:reason "it slipped" ] .\n',
    )
    run = ("run", "make tea", "--no-human", "--world", world, "--json")
    tried = [step["call"][0] for step in home.adaptbot(*run).json()["steps"]]
    told = home.adaptbot("export").json()
    assert tried.count("switch") == 3
    assert [step["action"] for step in told["steps"]].count("switch") == 2


def test_a_run_that_fell_short_is_not_handed_over(home: Home) -> None:
    asked = ("run", "make tea", "--without", "tea", "--no-human")
    assert home.adaptbot(*asked).code == 3
    ended = home.adaptbot("export")
    assert ended.code == 3 and ended.out == "" and "E5" in ended.err
    assert home.adaptbot("export", "no such run").code == 2
    into = str(home.folder / "no" / "tea.xml")
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    ended = home.adaptbot("export", "-o", into)
    assert ended.code == 2 and "cannot write" in ended.err


def test_a_request_for_two_tasks_is_one_plan(home: Home) -> None:
    asked = ("run", "switch off the lamp and then wipe the table", "--domain", "household")
    assert home.adaptbot(*asked, "--no-human").code == 0
    told = home.adaptbot("export").json()
    assert [step["n"] for step in told["steps"]] == [*range(1, len(told["steps"]) + 1)]
    assert {"switch", "mop"} <= {step["action"] for step in told["steps"]}


def test_names_of_pddl_are_spelt_as_its_files_spell_them() -> None:
    found = spellings(["(:action Pick-Up :parameters (?b) ; put-down\n)", "(ball-1 ball_2)"])
    assert found["pick_up"] == "Pick-Up" and found["ball_1"] == "ball-1"
    assert "put_down" not in found
