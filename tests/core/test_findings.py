"""One tiny plan for every code that raises it, and its sibling that does not."""

import re
from pathlib import Path

import pytest

from adaptbot_cli.core.ask.edit import Edit
from adaptbot_cli.core.ask.questions import LATER
from adaptbot_cli.core.findings import CODES
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Propose
from tests.driving import Script, drive
from tests.worlds import changed, parsed, scene, workshop

# code: (a plan with it, a plan without it); "board" is required.
PLANS = {
    "E101": ("polish(board)", "drill_hole(board)"),
    "E102": ("press(board)", "press(board, 3)"),
    "E103": ("press(board, hard)", "press(board, 3 kg)"),
    "E201": ("take(board)\nput(board)\ntake(gadget)", "take(board)\nput(board)\ntake(plank)"),
    "E202": ("take(bench)", "take(board)"),
    "E203": ("open(assembly)", "open(cupboard)"),
    "E204": ("open(everything)", "open(cupboard)"),
    "E301": ("drill_hole(plank)", "drill_hole(board)"),
    "E302": ("drill_hole(vase)", "drill_hole(board)"),
    "E401": ("sell(board)", "take(board)"),
    "E501": ("wait(5)", "take(board)"),
    "E503": ("dry_part(board)", "take(board)\nput(board, bench)"),
    "W601": ("light(candle)", "turn_on(stove)"),
    "W602": ("charge(drill)\ncharge(drill)", "charge(drill)"),
}
REPLANS = {
    "E502": ("take(board)\nput(board)\ntake(gadget)", "wait(5)", "take(board)\nput(board)"),
}
"""What only a second plan raises: the first plan, one that loses the board, one that keeps it."""

FETCHES = (
    "actions.ttl",
    'ab:explain "take a part" ;',
    'ab:explain "take a part" ; ab:fetches true ;',
)
NEEDLESS = {"W603": ("take_part(anvil)", "take_part(board)")}
"""What only a world raises in which taking a part is no end in itself."""


def looked_at(plan: str) -> Report:
    return examine(parsed(plan), plan, scene(workshop(), "board"))


def codes_of(report: Report) -> set[str]:
    return {finding.code for finding in report.findings}


@pytest.mark.parametrize("code", PLANS)
def test_one_plan_raises_the_code_and_its_sibling_does_not(code: str) -> None:
    raising, sibling = map(looked_at, PLANS[code])
    assert code in codes_of(raising) and code not in codes_of(sibling)
    if code < "E5":  # an error of a step
        assert not raising.executable


@pytest.mark.parametrize("code", NEEDLESS)
def test_a_step_that_cannot_be_done_is_told_even_where_it_is_not_needed(code: str) -> None:
    raising, sibling = (
        codes_of(examine(parsed(plan), plan, scene(changed(FETCHES)))) for plan in NEEDLESS[code]
    )
    assert code in raising and code not in sibling


def told_to_the_model(first: str, second: str) -> set[str]:
    """The codes that the model is told when it is asked for a third plan."""
    script = Script([first, second, first], LATER)
    drive(Task("work", ("board",)), workshop(), script, replans=2)
    last = [turn for turn in script.seen if isinstance(turn, Propose)][-1]
    return {finding.code for finding in last.findings}


def test_e502_where_a_new_plan_loses_a_required_item() -> None:
    first, losing, keeping = REPLANS["E502"]
    assert "E502" in told_to_the_model(first, losing)
    assert "E502" not in told_to_the_model(first, keeping)


REJECTED = {"E504"}
"""What only a person finds, and only the planner is told."""


@pytest.mark.parametrize(("edits", "told"), [([Edit("reject", text="no")], True), ([], False)])
def test_e504_where_a_person_rejects_a_plan(edits: list[Edit], told: bool) -> None:
    script = Script(["sell(board)"], LATER, edits=edits)
    drive(Task("work", ("board",)), workshop(), script, replans=1)
    proposed = [turn for turn in script.seen if isinstance(turn, Propose)]
    assert ("E504" in {f.code for turn in proposed for f in turn.findings}) == told


REQUESTS = {
    "E505": ({"excluded": ("plank",), "barred": frozenset({"plank"})}, {}),
    "E506": ({"amount": 2}, {"amount": 1}),
    "W604": ({"unread": ("quickly",)}, {}),
    "W606": ({"thin": True}, {"thin": False}),
}
"""What a task asks for besides, with which one plan has the finding, and without."""


@pytest.mark.parametrize("code", REQUESTS)
def test_what_was_asked_raises_the_code_and_nothing_else_does(code: str) -> None:
    plan = "take(plank)\nput(plank, bench)"
    with_it, without = (
        codes_of(examine(parsed(plan), plan, Scene(workshop(), Task("work", (), **asked))))
        for asked in REQUESTS[code]
    )
    assert code in with_it and code not in without


OF_WORLDS = {"E601", "E602", "E603", "E604"}


def test_every_code_has_a_fixture() -> None:
    parsing = Path(__file__).with_name("parse").glob("*.py")
    of_texts = {code for p in parsing for code in re.findall(r"P\d{3}", p.read_text("utf-8"))}
    # W605 has its cases in test_repair.py, E402 in test_robots.py, a world's in test_world.py
    assert set(CODES) == set(PLANS) | (
        set(REPLANS)
        | set(NEEDLESS)
        | REJECTED
        | set(REQUESTS)
        | {"W605", "E402"}
        | of_texts
        | OF_WORLDS
    )


@pytest.mark.parametrize("code", ["W601", "W602"])
def test_a_warning_leaves_the_plan_executable(code: str) -> None:
    plan = PLANS[code][0]
    assert examine(parsed(plan), plan, scene()).executable


def test_all_findings_of_a_plan_are_reported_at_once() -> None:
    plan = "polish(gadget)\ndrill_hole(vase)\ndrill_hole(plank)\nsell(candle)\nwait()"
    codes = codes_of(looked_at(plan))
    assert {"E101", "E201", "E302", "E301", "E401"} <= codes


def test_a_name_unknown_in_three_steps_is_one_finding_at_its_first_step() -> None:
    plan = "wait(1)\ntake(gadget)\nput(gadget, bench)\ndry_part(gadget)"
    report = examine(parsed(plan), plan, scene())
    assert [(f.code, f.step, f.line) for f in report.findings] == [("E201", 2, 2)]
    assert [f.places for f in report.findings] == [(2, 3, 4)]
    assert [step.codes for step in report.steps] == [(), ("E201",), ("E201",), ("E201",)]


@pytest.mark.parametrize(
    "plan",
    [
        "take(gadget)\nput(gadget, bench)\ntake(bench)\ndry_part(gadget)\ntake(bench)",
        "polish(board)\nsell(board)\npolish(gadget)\nwait(1)\nsell(board)\nopen(everything)",
        "drill_hole(vase)\ndrill_hole(plank)\ndrill_hole(vase)\ncharge(drill)\ncharge(drill)",
    ],
)
def test_the_findings_name_every_step_that_the_table_marks(plan: str) -> None:
    report = looked_at(plan)
    marked = {(c, n) for n, step in enumerate(report.steps, start=1) for c in step.codes}
    named = {(f.code, place) for f in report.findings for place in f.places}
    assert marked == named
    assert all(f.step == next(iter(f.places), None) for f in report.findings)


def test_a_name_is_unknown_once_though_different_things_are_near_it_in_different_places() -> None:
    plan = "take(stov)\nput(board, stov)"
    report = examine(parsed(plan), plan, scene())
    assert [(f.code, f.subject) for f in report.findings] == [("E201", "stov")]


def test_a_condition_that_fails_at_two_points_is_two_findings() -> None:
    plan = "sell(board)\nwait(1)\nsell(board)"
    report = examine(parsed(plan), plan, scene())
    assert [(f.code, f.step) for f in report.findings if f.code == "E401"] == [
        ("E401", 1),
        ("E401", 3),
    ]


def test_a_finding_of_a_step_has_the_number_it_has_after_missing_steps_are_inserted() -> None:
    plan = "take(board)\nsell(board)"
    report = examine(parsed(plan), plan, scene())
    finding = next(f for f in report.findings if f.code == "E401")
    assert finding.step == 3
    assert finding.line == 2
    assert report.steps[finding.step - 1].source == "sell(board)"


def test_the_reference_has_a_row_for_each_code_and_no_other() -> None:
    text = (Path(__file__).parents[2] / "docs" / "findings.md").read_text()
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.splitlines()
        if re.match(r"\| [A-Z]\d", line)
    ]
    assert [row[0] for row in rows] == list(CODES)
    for code, meaning, blocks, remedy in rows:
        assert blocks == ("yes" if CODES[code].blocks else "no"), code
        assert meaning and remedy, code
