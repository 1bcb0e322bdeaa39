"""The plan tried on the graph: missing steps, effects, goals; and the graph as it was before."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from rdflib import Literal, URIRef, Variable

from adaptbot_cli.core.domain import Effect
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import STATES
from adaptbot_cli.core.plan import Finding, Goal, Task
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.refine.goals import rehearsed
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from tests.hanging import ends
from tests.worlds import GOOD, W, changed, facts, parsed, scene, workshop

ROOT = Path(__file__).parents[2]


def check(plan: str, kg: Kg | None = None, *required: str) -> Report:
    return examine(parsed(plan), plan, scene(kg, *required))


def steps(plan: str, kg: Kg | None = None) -> list[str]:
    """The steps of a checked plan; the inserted ones with a plus."""
    report = check(plan, kg)
    mark = {"inserted": "+ ", "dropped": "- ", "finding": "! "}
    return [mark.get(s.status, "") + s.call.render().replace('"', "") for s in report.steps]


def findings(plan: str, kg: Kg | None = None, *required: str) -> list[tuple[str, str]]:
    return [(f.code, f.message) for f in check(plan, kg, *required).findings]


def messages(found: tuple[Finding, ...]) -> list[str]:
    return [finding.message for finding in found]


DRILLABLE = {"attributes": "w:plank w:drillable true ."}
REPAIRED: dict[str, tuple[str, dict[str, str], str]] = {
    "a closed door is opened": (
        "take_part(board)\nput(board)", {}, "+ open(cupboard), take_part(board), put(board)"
    ),
    "a full hand puts down what it holds": (
        "take_part(plank)\ntake_tool(saw)\nput(saw)", {},
        "take_part(plank), + put(plank, bench), take_tool(saw), put(saw)",
    ),
    "what is put down is picked up before": (
        "put(saw, bench)", {}, "+ take_tool(saw), put(saw, bench)"
    ),
    "two steps deep, a door is opened to take what is put down": (
        "put(board)", {}, "+ open(cupboard), + take_part(board), put(board)"
    ),
    "a tool is charged before use": (
        "drill_hole(plank)", DRILLABLE, "+ charge(drill), drill_hole(plank)"
    ),
    "it is not charged again": (
        "charge(drill)\ndrill_hole(board)", {}, "charge(drill), drill_hole(board)"
    ),
    "a thing is switched on before use and off at the end": (
        "dry_part(plank)\nwait(5)", {},
        "+ switch(stove, on), dry_part(plank), wait(5), + switch(stove, off)",
    ),
    "what the plan switches off itself is left alone": (
        "turn_on(stove)\ndry_part(plank)\nturn_off(stove)", {},
        "switch(stove, on), dry_part(plank), switch(stove, off)",
    ),
    "a state that the wording wants is made": (
        "put(drilled_board, bench)", {},
        "+ charge(drill), + drill_hole(board, drill), + open(cupboard), + take_part(board), "
        "put(board, bench)",
    ),
    "the shortest way is taken": ("put(plank)", {}, "+ take_part(plank), put(plank)"),
    "a repair that fails leaves no steps behind": (
        "stretch(board)\nwait(1)", {}, "! stretch(board), wait(1)"
    ),
    "a step that is written otherwise is repaired": (
        "grab(Boards)\nput(board)", {}, "+ open(cupboard), take_part(board), put(board)"
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", REPAIRED)
def test_missing_steps_are_put_in(what: str) -> None:
    plan, more, repaired = REPAIRED[what]
    assert ", ".join(steps(plan, workshop(**more))) == repaired


def test_an_inserted_step_says_why() -> None:
    inserted = check("take_part(board)\nput(board)").steps[0]
    assert inserted.source is None
    assert inserted.reason == "the door must be open to take board out"


ITSELF = (
    "actions.ttl",
    '"{spot} has no door" ]',
    '"{spot} has no door" ] , [ ab:order 2 ;'
    ' ab:ask "ASK { ?spot w:doorOpen true }" ; ab:message "{spot} must be open" ]',
)
NO_HEATER = ("attributes.ttl", "w:heats true ; ", "")
NO_SWITCH = ("attributes.ttl", "w:switchable true ;", "w:switchable false ;")
LIT = ("state.ttl", "w:stove w:on false", "w:candle w:on true . w:stove w:on false")
ELSEWHERE = "take_part(plank)\nput(plank, cupboard)"
FOUND: dict[str, tuple[str, list[tuple[str, str]], tuple[str, str, str] | None, list[str]]] = {
    "what no action can do": ("sell(board)", [("E401", "board must be blessed")], None, []),
    "a condition that can never hold ends": (
        "stretch(board)", [("E401", "board must be in two places")], None, []
    ),
    "a step whose repair would need itself ends": (
        "open(cupboard)", [("E401", "cupboard must be open")], ITSELF, []
    ),
    "no missing step is one that an attribute rules out": (
        "dry_part(plank)", [("E401", "stove must be on")], NO_SWITCH, []
    ),
    "nothing can serve": (
        "dry_part(plank)",
        [("E401", "there is no piece of furniture here that can serve as heater")], NO_HEATER, [],
    ),
    "a goal for each required item": (
        ELSEWHERE, [("E503", "plank does not end on the bench")], None, ["plank"]
    ),
    "no such goal where none is required": (ELSEWHERE, [], None, []),
    "a goal for the world": (
        "take_part(plank)", [("E503", "the hand is not empty at the end")], None, []
    ),
    "a required item is used by another name": ("take(Boards)\nput(board)", [], None, ["board"]),
    "an advice warns of what cannot be put right": (
        "light(candle)", [("W601", "candle is left on")], None, []
    ),
    "what was on before is not the plan's fault": ("wait(5)", [], LIT, []),
    "nor is it when it is lit again": ("light(candle)", [], LIT, []),
}  # fmt: skip


@pytest.mark.parametrize("what", FOUND)
def test_what_cannot_be_repaired_is_a_finding(what: str) -> None:
    plan, told, change, required = FOUND[what]
    with ends():
        assert findings(plan, changed(*[change] if change else []), *required) == told


@pytest.mark.parametrize(
    ("plan", "codes"),
    [
        ("fetch(board)\nput(board, bench)\nsell(board)\ncharge(drill)", ["E101"]),
        ("unplug(drill)\ncharge(drill)\ncharge(drill)", ["E101"]),  # nor is advice given on it
        ("fetch(board)\nsell(plank)", ["E101", "E401"]),
    ],
)
def test_after_a_bad_step_only_other_things_are_checked(plan: str, codes: list[str]) -> None:
    assert [code for code, _ in findings(plan)] == codes


def test_a_default_is_taken_from_the_state_at_that_point() -> None:
    report = check("dry_part(plank)")
    ground = next(b for s, b in zip(report.steps, report.grounded, strict=True) if s.source)
    assert ground is not None
    assert ground.values["heater"] == URIRef(W + "stove")


def test_the_deltas_say_what_each_step_changes() -> None:
    report = check("take_part(plank)\nput(plank, cupboard)")
    plank, arm = URIRef(W + "plank"), URIRef(W + "arm")
    place, holds = URIRef(W + "in"), URIRef(W + "holds")
    took, put = report.deltas
    assert took == Delta(
        frozenset({(plank, place, URIRef(W + "bench"))}), frozenset({(arm, holds, plank)})
    )
    assert put.added == frozenset({(plank, place, URIRef(W + "cupboard"))})


PLANS = (
    GOOD,
    "put(drilled_board, bench)\ndry_part(vase)",
    "stretch(board)\nsell(plank)\nlight(candle)",
    "polish(gadget)\ntake(gadget)\nput(gadget)",
    "",
)


@pytest.mark.parametrize("plan", PLANS)
def test_checking_and_executing_never_change_the_world(plan: str) -> None:
    kg = workshop()
    before, quads = facts(kg), set(kg.facts.engine)
    report = check(plan, kg, "board")
    rehearsed(report, kg)
    assert facts(kg) == before
    assert set(kg.facts.engine) == quads


def test_an_exception_in_the_middle_changes_nothing_either() -> None:
    kg = workshop()
    before = facts(kg)
    broken = Task("work", goals=(Goal("ASK { this is no SPARQL }", "never"),))
    with pytest.raises(SyntaxError):
        examine(parsed(GOOD), GOOD, Scene(kg, broken))
    assert facts(kg) == before
    assert steps(GOOD, kg)[0] == "+ open(cupboard)"


def test_a_state_fact_that_stands_among_the_attributes_is_a_state() -> None:
    kg = workshop(attributes="w:plank w:dry false .")
    quads = set(kg.facts.engine)
    assert (URIRef(W + "plank"), URIRef(W + "dry"), Literal(False)) in kg.graph(STATES)
    check("dry_part(plank)", kg)
    assert set(kg.facts.engine) == quads


def test_a_rehearsal_and_a_mark_take_back_what_came_after_them_only() -> None:
    kg = workshop()
    before = facts(kg)
    one, two = (
        (URIRef(W + thing), URIRef(W + "dry"), Literal(True)) for thing in ("plank", "vase")
    )
    with kg.rehearsal():
        kg.apply(Delta(added=frozenset({one})))
        with kg.rehearsal():
            kg.apply(Delta(added=frozenset({two})))
            assert {one, two} <= facts(kg)
        assert facts(kg) - before == {one}
        mark = kg.mark
        kg.apply(Delta(removed=frozenset({one})))
        kg.undo_to(mark)
        assert one in kg.facts
    assert facts(kg) == before


def test_the_same_plan_gives_the_same_report_whatever_the_hash_seed() -> None:
    code = (
        "from tests.worlds import *; from adaptbot_cli.core.refine.check import examine\n"
        "plan = 'put(drilled_board, bench)\\ndry_part(plank)\\nstretch(vase)\\ntake(gadgt)'\n"
        "report = examine(parsed(plan), plan, scene(workshop(), 'board', 'vase'))\n"
        "print(report.steps, report.findings, report.missing)"
    )

    def run(seed: str) -> str:
        env = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True
        )
        return done.stdout

    assert run("1") == run("2") != ""


def test_a_goal_of_the_task() -> None:
    kg = workshop()
    stool = Scene(kg, kg.domain.task_names["wooden_stool"])
    plan = "take(board)\nput(board, bench)"
    assert messages(examine(parsed(plan), plan, stool).findings) == ["the board has no hole"]
    assert examine(parsed(GOOD), GOOD, stool).findings == ()


def test_a_required_item_that_is_not_used_is_told_once() -> None:
    report = check("wait(5)", None, "board")
    assert [f.code for f in report.findings] == ["E501"]
    assert report.missing == ("board",)


def test_execution_stops_at_a_step_whose_condition_no_longer_holds() -> None:
    kg = workshop()
    report = check(GOOD, kg)
    door = URIRef(W + "cupboard"), URIRef(W + "hasDoor"), Literal(True)
    wet = (URIRef(W + "arm"), URIRef(W + "holds"), URIRef(W + "vase"))
    kg.learn(Delta(frozenset({door}), frozenset({wet})))
    outcome = rehearsed(report, kg)
    assert outcome.error is not None
    assert (outcome.error.code, outcome.error.step) == ("E401", 2)
    assert outcome.error.message == "the hand must be free to take board"
    assert len(outcome.deltas) == 1


def test_execution_tells_which_goals_are_not_met() -> None:
    kg = workshop()
    task = Task("work", ("plank",))
    plan = "take_part(plank)\nput(plank, cupboard)"
    report = examine(parsed(plan), plan, Scene(kg, task))
    outcome = rehearsed(report, kg)
    assert messages(outcome.unmet) == ["plank does not end on the bench"]
    assert outcome.missing == ("plank",)
    assert len(outcome.deltas) == len(report.steps)


def test_effects_that_find_the_same_and_change_it_otherwise_are_told_apart() -> None:
    kg = workshop()
    board, said = URIRef(f"{W}board"), {}
    for value in (True, False):
        fact = (Variable("it"), URIRef(f"{W}dry"), Literal(value))
        effect = Effect(f"INSERT {{ ?it w:dry {value} }}", "SELECT ?it WHERE {}", (), (fact,))
        said[value] = kg.delta(effect, {"it": board}).added
    assert {fact[2].toPython() for added in said.values() for fact in added} == {True}
    assert not said[False]  # the board is not dry: nothing changes
