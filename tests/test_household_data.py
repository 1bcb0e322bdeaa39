"""Check what is particular to the household: its tasks, its things, its plans end to end."""

import io
from collections.abc import Mapping
from typing import Final

import pytest
from rdflib import RDF
from rich.console import Console

from adaptbot_cli.adapters.planner.library import nearest_plan
from adaptbot_cli.core.report import Result
from adaptbot_cli.session.build import Request, build
from adaptbot_cli.session.replay import check
from adaptbot_cli.session.sources import load
from adaptbot_cli.workspace import Workspace
from tests.asking import task_for
from tests.packs import EX, FALSE, HOUSEHOLD, KITCHEN, TRUE, names

TASKS: Final[Mapping[str, set[str]]] = {
    "clean the bedroom_floor": {"mop_cloth"},
    "clean the hallway_floor": {"mop_cloth"},
    "clean the kitchen_floor": {"mop_cloth"},
    "clean the living_room_floor": {"mop_cloth"},
    "clean the washroom_floor": {"mop_cloth"},
    "dust the TV": {"mop_cloth"},
    "wash the clothes": {"washing_machine", "clothes", "detergent"},
    "wash the dishes": {"plate", "bowl"},
    "water the plants": {"water", "plant"},
    "take out trash": {"trash", "dustbin"},
    "clean the window": {"mop_cloth"},
    "mop the countertop": {"mop_cloth"},
    "clean the table": {"mop_cloth"},
    "pick up and put all the toys in the toy box": {"toy_1", "toy_2", "toy_3", "toy_4", "toy_box"},
    "charge the phone": {"phone", "charging_pod"},
    "play the music": {"music_player"},
}
"""The paper's 12 tasks and the items that each requires."""

OTHER_NAMES: Final = {
    "clean the bedroom": "clean the bedroom_floor",
    "water the plant": "water the plants",
    "Dust the TV": "dust the TV",
    "pick up and put all the toys to the toy box": "pick up and put all the toys in the toy box",
    "do the laundry": "wash the clothes",
}
UNLISTED: Final = names("""
    iron the shirt, fold the laundry, set the table, clear the table, turn on the TV, turn
    off the lamp, put away the books, put away the dishes, wipe the kitchen floor, clean the
    windows with the sponge, wash the shirt, wash the cup, throw away the newspaper, bring
    the newspaper, water the houseplant, clean the bathroom
""")
FACTS: Final = HOUSEHOLD.facts


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """An empty workspace."""
    return Workspace(tmp_path_factory.mktemp("household"))


def run(task: str, home: Workspace) -> Result:
    """Run a task from the plan library, asking nobody and keeping nothing."""
    request = Request(task, "household", model="library", ask=False, dry_run=True)
    with build(request, home, {}, Console(file=io.StringIO()), None) as session:
        return session.run()


def checked(plan: str, task: str, home: Workspace) -> Result:
    """Check a plan for a task in this home."""
    kg = load(home, "household")
    return check(plan, task_for(task, kg), kg)


def steps(result: Result) -> list[str]:
    """Return the calls of a result's plan, those left out excepted."""
    return [step.call.render() for step in result.report.steps if step.status != "dropped"]


def test_size_is_at_least_that_of_the_published_graph() -> None:
    assert len(set(FACTS.subjects())) >= 40
    assert len(FACTS) >= 331
    assert len(set(FACTS.subjects(RDF.type, EX.room))) >= 4


def test_the_actions_are_the_kitchens_with_iron_and_fold() -> None:
    assert HOUSEHOLD.action_names() == KITCHEN.action_names() | {"iron", "fold"}


def test_the_task_list_is_the_papers_and_the_other_floors() -> None:
    assert {task: set(HOUSEHOLD.needs(task)) for task in HOUSEHOLD.tasks()} == TASKS


@pytest.mark.parametrize(("said", "task"), OTHER_NAMES.items())
def test_other_names_mean_the_same_task(said: str, task: str, home: Workspace) -> None:
    assert task_for(said, load(home, "household")).name == task


def test_switching_off_the_music_is_not_playing_it(home: Workspace) -> None:
    assert not task_for("turn off the music", load(home, "household")).known


def test_the_faults_of_the_published_graph_are_gone() -> None:
    assert FACTS.value(EX.rack, EX.toggleable) == FALSE
    assert FACTS.value(EX.laundry_bag, EX.toggleable) == FALSE
    assert FACTS.value(EX.dustbin, EX.common_rec) == FALSE
    assert FACTS.value(EX.living_room_floor, EX.imrec_location) == EX.living_room
    assert not list(FACTS.subjects(EX.IsMopped, TRUE))
    assert not list(FACTS.subjects(EX.switched_on, TRUE))


def test_what_may_not_stay_on_is_known_of_all_that_can_be_switched() -> None:
    switched = set(FACTS.subjects(EX.toggleable, TRUE))
    assert switched == set(FACTS.subjects(EX.runs_unattended, None))
    assert set(FACTS.subjects(EX.runs_unattended, FALSE)) == {EX.iron, EX.stove}


def test_every_room_has_a_floor_to_mop() -> None:
    for room in FACTS.subjects(RDF.type, EX.room):
        floors = [str(place) for place in FACTS.subjects(EX.imrec_location, room)]
        assert sum(place.endswith("_floor") for place in floors) == 1, room


@pytest.mark.parametrize("task", TASKS)
def test_a_library_plan_serves_each_task_to_its_goal(task: str, home: Workspace) -> None:
    result = run(task, home)
    assert result.verdict == "executable"
    assert result.goal_met
    assert not result.report.findings


@pytest.mark.parametrize("task", UNLISTED)
def test_a_library_plan_serves_tasks_of_the_same_kinds(task: str, home: Workspace) -> None:
    assert nearest_plan(task, HOUSEHOLD.library().values())
    assert run(task, home).goal_met


FAIR: Final = {
    "water the plants": [
        'pour_contents("water", "plant")',
        'pick_up_obj("water")\nput_down_obj("water", "plants")',
    ],
    "wash the clothes": [
        'put_down_obj("detergent", "washing_machine")\nput_down_obj("clothes", "washing_machine")\n'
        'start("washing_machine")',
        'switch("washing_machine")\nput_down_obj("clothes", "washing_machine")\n'
        'pour_contents("detergent", "washing_machine")',
        'load("clothes", "washing_machine")\nload("detergent", "washing_machine")',
    ],
    "take out trash": ['throw_away("trash", "dustbin")', 'put("trash", "dustbin")'],
    "wash the dishes": ['wash("dishes")', 'wipe("plate")\nclean("bowl")'],
    "clean the window": [
        'pick_up_tool("mop_cloth")\nmove("mop_cloth", "window")\nclean("window")',
        'wipe("window", "mop_cloth")',
    ],
    "clean the bedroom": ['pick_up("mop_cloth")\nclean("bedroom")'],
    "pick up and put all the toys in the toy box": [
        'pick_up_obj("toys")\nput_down_obj("toys", "toy_box")'
    ],
    "charge the phone": [
        'pick_up_obj("phone")\nput_down_obj("phone", "charging_pod")',
        'switch("charging_pod", "on")\nput_down_obj("phone", "charging_pod")\nwait(30)\n'
        'switch("charging_pod", "off")\npick_up_obj("phone")',
    ],
    "play the music": ['play("music")', 'turn_on("music_player")'],
}


@pytest.mark.parametrize(
    ("task", "plan"), [(task, plan) for task, plans in FAIR.items() for plan in plans]
)
def test_any_sensible_plan_meets_the_goal(task: str, plan: str, home: Workspace) -> None:
    assert checked(plan, task, home).goal_met


def test_a_switched_off_player_plays_no_music(home: Workspace) -> None:
    result = checked('switch("music_player")\nswitch("music_player")', "play the music", home)
    assert not result.goal_met


def test_a_thing_is_wiped_or_washed_by_its_kind(home: Workspace) -> None:
    plan = 'clean("window")\ndust("tv")\nmop("plate")\nwipe("spoon")\nclean("bedroom")'
    result = checked(plan, "", home)
    assert steps(result) == [
        'pick_up_obj("mop_cloth")',
        'mop("window")',
        'mop("tv")',
        'clean("plate")',
        'clean("spoon")',
        'mop("bedroom")',
    ]


def test_ironing_takes_its_missing_steps_and_ends_with_the_iron_off(home: Workspace) -> None:
    assert steps(checked('iron("clothes")', "", home)) == [
        'pick_up_obj("clothes")',
        'put_down_obj("clothes", "ironing_board")',
        'switch("iron", "on")',
        'pick_up_rec("iron")',
        'iron("clothes")',
        'switch("iron", "off")',
    ]


@pytest.mark.parametrize("call", ['iron("phone")', 'fold("plate")', 'fold("water")'])
def test_what_cannot_be_ironed_or_folded_is_found(call: str, home: Workspace) -> None:
    codes = {finding.code for finding in checked(call, "", home).report.findings}
    assert codes <= {"E202", "E302"}
    assert codes


@pytest.mark.parametrize("verb", ["close", "open", "charge", "empty"])
def test_no_verb_is_taken_for_one_that_it_is_not(verb: str, home: Workspace) -> None:
    result = checked(f'{verb}("washing_machine")', "", home)
    assert [finding.code for finding in result.report.findings] == ["E101"]


def test_a_bag_may_be_emptied_into_the_machine_but_not_onto_a_table(home: Workspace) -> None:
    plan = 'pour_contents("laundry_bag", "{}")'
    assert checked(plan.format("washing_machine"), "", home).goal_met
    assert not checked(plan.format("table"), "", home).goal_met


def test_what_is_thrown_away_goes_into_the_dustbin_unsaid(home: Workspace) -> None:
    result = checked('discard("newspaper")', "", home)
    assert steps(result)[-1] == 'put_down_obj("newspaper", "dustbin")'


def test_the_robots_room_follows_it(home: Workspace) -> None:
    plan = 'move("fridge")\nmove("bedroom")\npick_up_obj("towel")\nmove("towel", "sofa")'
    result = checked(plan, "", home)
    assert result.outcome is not None
    rooms = [
        [o for _, p, o in delta.added if p == EX.agent_location] for delta in result.outcome.deltas
    ]
    assert rooms == [[EX.kitchen], [EX.bedroom], [EX.washroom], [EX.living_room]]


def test_in_a_room_the_robot_is_near_no_place(home: Workspace) -> None:
    result = checked('move("bedroom")', "", home)
    assert result.outcome is not None
    assert not [o for d in result.outcome.deltas for _, p, o in d.added if p == EX.agent_near]


def test_to_switch_off_what_was_never_on_washes_nothing(home: Workspace) -> None:
    loaded = 'load("clothes", "washing_machine")\nload("detergent", "washing_machine")\n'
    result = checked(loaded + 'switch("washing_machine", "off")', "wash the clothes", home)
    assert steps(result)[-2:] == [
        'switch("washing_machine", "off")',
        'switch("washing_machine", "on")',
    ]
    assert result.goal_met


@pytest.mark.parametrize("asked", ["water the orchid", "water the plant and the orchid"])
def test_what_a_request_names_and_the_home_does_not_know_is_required(
    asked: str, home: Workspace
) -> None:
    result = checked('move("orchid")\nclean("plate")', asked, home)
    assert not result.goal_met
    assert "orchid" in result.report.missing
