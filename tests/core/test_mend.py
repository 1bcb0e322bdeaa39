"""What can be offered where no knowledge helps: steps to add and steps to leave out."""

import re
from dataclasses import replace

import pytest

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.refine.mend import Mended, mended, with_remedies
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from tests import packs
from tests.asking import task_for

KITCHEN, HOUSEHOLD = packs.KITCHEN.kg(), packs.HOUSEHOLD.kg()

LIME_WATER = """
pick_up_obj("lime")
put_down_obj("lime", "countertop")
pick_up_rec("glass")
put_down_rec("glass", "countertop")
pick_up_obj("water")
pour_contents("water", "glass")
stir_contents("glass")
"""
CHIPS = """
slice("potato", "knife")
pick_up_obj("oil")
put_down_obj("oil", "countertop")
fry("potato", "pan")
pour_contents("pan", "plate")
"""


def looked_at(text: str, task: Task, kg: Kg) -> tuple[Report, Scene]:
    scene = Scene(kg, task, drop=False)
    return examine(parse(text), text, scene), scene


def mend(text: str, kg: Kg, *required: str) -> Mended | None:
    return mended(*looked_at(text, Task("it", required), kg), parse)


def test_an_item_that_is_fetched_and_never_used_goes_in_before_the_vessel_is_worked_on() -> None:
    found = mend(LIME_WATER, KITCHEN, "lime", "water")
    assert found is not None
    lines = found.text.splitlines()
    assert lines[lines.index('stir_contents("glass")') - 1] == 'put_down_obj("lime", "glass")'
    [change] = found.changes
    assert change.startswith(
        'add put_down_obj("lime", "glass") before stir_contents("glass"): lime'
    )


def test_it_goes_where_a_hidden_vessel_is_worked_on_too() -> None:
    found = mend(CHIPS, KITCHEN, "potato", "oil")
    assert found is not None
    assert found.changes[0].startswith('add put_down_obj("oil", "pan") before fry("potato", "pan")')


def test_the_mended_plan_is_executable_meets_its_goal_and_needs_no_more_mending() -> None:
    task = Task("it", ("lime", "water"))
    found = mended(*looked_at(LIME_WATER, task, KITCHEN), parse)
    assert found is not None
    report, scene = looked_at(found.text, task, KITCHEN)
    assert report.executable
    assert not report.open
    assert mended(report, scene, parse) is None


def test_an_item_that_no_step_names_is_brought_in_as_well() -> None:
    found = mend(LIME_WATER, KITCHEN, "lime", "water", "sugar")
    assert found is not None
    assert any('put_down_obj("sugar", "glass")' in change for change in found.changes)


def test_what_the_task_wants_is_done_where_fewest_steps_do_it() -> None:
    text = """
pick_up_rec("pan")
put_down_rec("pan", "stove")
switch("stove", "on")
pick_up_obj("egg")
put_down_obj("egg", "pan")
wait(5)
switch("stove", "off")
pick_up_rec("plate")
put_down_rec("plate", "countertop")
pick_up_rec("pan")
pour_contents("pan", "plate")
"""
    task = replace(task_for("egg sandwich", KITCHEN, ()), required=("egg",))
    report, scene = looked_at(text, task, KITCHEN)
    found = mended(report, scene, parse)
    assert found is not None
    [change] = found.changes
    assert re.match(r'add (fry|boil)\("egg", "pan"\) before wait\(5\): ', change)


def test_two_steps_that_do_together_what_neither_does_alone() -> None:
    text = """
pick_up_obj("all_purpose_flour")
put_down_obj("all_purpose_flour", "bowl")
mix_contents("bowl")
pick_up_rec("bowl")
put_down_rec("bowl", "table")
"""
    task = replace(task_for("fruit cake", KITCHEN, ()), required=("all_purpose_flour",))
    found = mended(*looked_at(text, task, KITCHEN), parse)
    assert found is not None
    [change] = found.changes
    assert change.startswith('add put_down_rec("bowl", "oven"), switch("oven", "on") before ')


def test_what_cannot_be_done_is_left_out_if_the_goal_is_met_without_it() -> None:
    text = 'switch("sink")\nclean("plate")\nclean("bowl")'
    report, scene = looked_at(text, task_for("wash the dishes", HOUSEHOLD, ()), HOUSEHOLD)
    assert not report.executable
    found = mended(report, scene, parse)
    assert found is not None
    assert found.changes == ('leave out switch("sink"): sink cannot be switched',)


@pytest.mark.parametrize(
    ("text", "required"),
    [
        ("juggle(plate)", ("water",)),
        ('pick_up_obj("moonstone")', ("water",)),
        ("", ("water",)),
        ('pick_up_obj("water")', ("moonstone",)),
    ],
    ids=["unknown action", "unknown item", "no plan", "unknown required item"],
)
def test_nothing_is_offered_where_knowledge_is_what_lacks(text: str, required: tuple) -> None:
    assert mend(text, KITCHEN, *required) is None


def test_the_finding_tells_the_step_that_would_mend_it() -> None:
    report = with_remedies(*looked_at(LIME_WATER, Task("it", ("lime", "water")), KITCHEN))
    [finding] = report.open
    assert finding.code == "E503"
    assert finding.remedy == 'put_down_obj("lime", "glass") before stir_contents("glass")'


def test_looking_for_a_mend_leaves_the_graph_as_it_was() -> None:
    before = set(KITCHEN.facts)
    mend(CHIPS, KITCHEN, "potato", "oil")
    assert set(KITCHEN.facts) == before
