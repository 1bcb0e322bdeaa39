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
from tests.worlds import GOOD, W, facts, parsed, replaced, scene, workshop

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


def test_a_closed_door_is_opened() -> None:
    assert steps("take_part(board)\nput(board)") == [
        "+ open(cupboard)",
        "take_part(board)",
        "put(board)",
    ]


def test_an_inserted_step_says_why() -> None:
    inserted = check("take_part(board)\nput(board)").steps[0]
    assert inserted.source is None
    assert inserted.reason == "the door must be open to take board out"


def test_a_full_hand_is_freed_by_putting_down_what_it_holds() -> None:
    assert steps("take_part(plank)\ntake_tool(saw)\nput(saw)") == [
        "take_part(plank)",
        "+ put(plank, bench)",
        "take_tool(saw)",
        "put(saw)",
    ]


def test_what_is_put_down_is_picked_up_before() -> None:
    assert steps("put(saw, bench)") == ["+ take_tool(saw)", "put(saw, bench)"]


def test_two_steps_deep_the_door_is_opened_to_take_what_is_put_down() -> None:
    assert steps("put(board)") == ["+ open(cupboard)", "+ take_part(board)", "put(board)"]


def test_a_tool_is_charged_before_use() -> None:
    assert steps("drill_hole(plank)", workshop(attributes="w:plank w:drillable true .")) == [
        "+ charge(drill)",
        "drill_hole(plank)",
    ]


def test_it_is_not_charged_again() -> None:
    assert steps("charge(drill)\ndrill_hole(board)") == ["charge(drill)", "drill_hole(board)"]


def test_a_thing_is_switched_on_before_use_and_off_at_the_end() -> None:
    assert steps("dry_part(plank)\nwait(5)") == [
        "+ switch(stove, on)",
        "dry_part(plank)",
        "wait(5)",
        "+ switch(stove, off)",
    ]


def test_what_the_plan_switches_off_itself_is_left_alone() -> None:
    assert steps("turn_on(stove)\ndry_part(plank)\nturn_off(stove)") == [
        "switch(stove, on)",
        "dry_part(plank)",
        "switch(stove, off)",
    ]


def test_a_state_that_the_wording_wants_is_made() -> None:
    assert steps("put(drilled_board, bench)") == [
        "+ charge(drill)",
        "+ drill_hole(board, drill)",
        "+ open(cupboard)",
        "+ take_part(board)",
        "put(board, bench)",
    ]


def test_the_shortest_way_is_taken() -> None:
    # The bench has no door, so taking the plank needs one step and not two.
    assert steps("put(plank)") == ["+ take_part(plank)", "put(plank)"]


def test_what_no_action_can_do_is_a_finding() -> None:
    assert findings("sell(board)") == [("E401", "board must be blessed")]


def test_a_condition_that_can_never_hold_ends() -> None:
    with ends():
        assert findings("stretch(board)") == [("E401", "board must be in two places")]


def test_a_step_whose_repair_would_need_itself_ends() -> None:
    kg = replaced(
        "actions.ttl",
        '"{spot} has no door" ]',
        '"{spot} has no door" ] , [ ab:order 2 ;'
        ' ab:ask "ASK { ?spot w:doorOpen true }" ; ab:message "{spot} must be open" ]',
    )
    assert ("E401", "cupboard must be open") in findings("open(cupboard)", kg)


def test_a_repair_that_fails_leaves_no_steps_behind() -> None:
    assert steps("stretch(board)\nwait(1)") == ["! stretch(board)", "wait(1)"]


def test_a_missing_step_is_never_one_that_an_attribute_rules_out() -> None:
    kg = workshop(attributes="w:stove w:switchable false .", state="")
    stove = (URIRef(W + "stove"), URIRef(W + "switchable"), Literal(True))
    kg.learn(Delta(removed=frozenset({stove})))
    assert findings("dry_part(plank)", kg) == [("E401", "stove must be on")]


def test_a_default_is_taken_from_the_state_at_that_point() -> None:
    report = check("dry_part(plank)")
    ground = next(b for s, b in zip(report.steps, report.grounded, strict=True) if s.source)
    assert ground is not None
    assert ground.values["heater"] == URIRef(W + "stove")


def test_without_anything_that_can_serve_it_says_so() -> None:
    kg = replaced("attributes.ttl", "w:heats true ; ", "")
    message = "there is no piece of furniture here that can serve as heater"
    assert ("E401", message) in findings("dry_part(plank)", kg)


def test_one_bad_step_does_not_flood_the_report() -> None:
    plan = "fetch(board)\nput(board, bench)\nsell(board)\ncharge(drill)"
    assert [code for code, _ in findings(plan)] == ["E101"]


def test_no_advice_is_given_on_what_a_bad_step_was_about() -> None:
    assert [code for code, _ in findings("unplug(drill)\ncharge(drill)\ncharge(drill)")] == ["E101"]


def test_other_things_are_still_checked_after_a_bad_step() -> None:
    assert [code for code, _ in findings("fetch(board)\nsell(plank)")] == ["E101", "E401"]


def test_missing_steps_are_found_for_a_step_that_is_written_otherwise() -> None:
    assert steps("grab(Boards)\nput(board)")[0] == "+ open(cupboard)"


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


def test_a_rehearsal_within_a_rehearsal_takes_back_its_own_changes_only() -> None:
    kg = workshop()
    before = facts(kg)
    one = (URIRef(W + "plank"), URIRef(W + "dry"), Literal(True))
    two = (URIRef(W + "vase"), URIRef(W + "dry"), Literal(True))
    with kg.rehearsal():
        kg.apply(Delta(added=frozenset({one})))
        with kg.rehearsal():
            kg.apply(Delta(added=frozenset({two})))
            assert {one, two} <= facts(kg)
        assert facts(kg) - before == {one}
    assert facts(kg) == before


def test_a_mark_takes_back_what_came_after_it() -> None:
    kg = workshop()
    one = (URIRef(W + "plank"), URIRef(W + "dry"), Literal(True))
    with kg.rehearsal():
        kg.apply(Delta(added=frozenset({one})))
        mark = kg.mark
        kg.apply(Delta(removed=frozenset({one})))
        kg.undo_to(mark)
        assert one in kg.facts


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


def test_a_goal_for_each_required_item() -> None:
    plan = "take_part(plank)\nput(plank, cupboard)"
    assert findings(plan, None, "plank") == [("E503", "plank does not end on the bench")]
    assert findings(plan, None) == []


def test_a_goal_for_the_world() -> None:
    assert findings("take_part(plank)") == [("E503", "the hand is not empty at the end")]


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


def test_a_required_item_named_by_an_alias_of_the_plan_counts_as_used() -> None:
    assert findings("take(Boards)\nput(board)", None, "board") == []


def test_an_advice_warns_of_what_cannot_be_put_right() -> None:
    assert findings("light(candle)") == [("W601", "candle is left on")]


def test_what_was_on_before_the_plan_is_not_the_plans_fault() -> None:
    kg = workshop(state="w:candle w:on true .")
    assert findings("wait(5)", kg) == []
    assert findings("light(candle)", kg) == []


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
