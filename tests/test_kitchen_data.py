"""Check what is particular to the kitchen: its tasks, its things, its plan library."""

from typing import Any, Final

import pytest

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner.library import LibraryPlan, nearest_plan
from adaptbot_cli.core.ask import suggest
from adaptbot_cli.core.ask.questions import Question, Suggestion
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.scene import Scene
from tests.packs import EX, FALSE, KITCHEN, TRUE, calls, names

PAPER_RECIPES: Final = names("""
    chocolate cookies, peanut butter cookies, italian burger, bbq crunch burger, mac and
    cheese burger, onion sandwich, mushroom sandwich, chicken salad sandwich, french toast
    sandwich, tomato soup, cucumber salad, greek salad, peppermint iced tea, chai tea latte,
    ginger iced tea, chargrilled bbq burger, chili burger, tea scones, stop and go tea
    sandwich, green tea lava cake, egg and spinach sandwich, chocolate and banana toasted
    sandwich, veggie sandwich panini, split pea soup, potato soup, weight watchers golden
    cream soup, basil tomato mozzarella salad, ham pea and cheese salad, anja's egg salad,
    mozzarella beef burger
""")
RECORDED_DISHES: Final = names("""
    omelette, lime water, coffee, french toast, fruit cake, lime tea, potato fry, bread
    pudding, avocado toast, mashed potato, fruit salad, butter chicken, mango lassi, egg
    sandwich, hot chocolate, apple smoothie, samosa, onion soup, carrot pudding, banana
    chips
""")
ATTRIBUTE_OF_ROLE: Final = {
    "sliced": EX.IsSliceable,
    "boiled": EX.Boilable,
    "fried": EX.Fryable,
}
FACTS: Final = KITCHEN.facts


def known_names() -> set[str]:
    """Return the names of the kitchen's ingredients and objects."""
    return KITCHEN.names(EX.obj_name)


def test_size_is_at_least_that_of_the_published_graph() -> None:
    assert len(set(FACTS.subjects())) >= 79
    assert len(FACTS) >= 772


def test_a_liquid_is_neither_sliced_nor_washed_nor_fried() -> None:
    for thing in FACTS.subjects(EX.IsLiquid, TRUE):
        for attribute in (EX.IsSliceable, EX.NeedsToBeCleaned, EX.Fryable):
            assert FACTS.value(thing, attribute) == FALSE, (thing, attribute)


def test_the_one_place_for_each_purpose() -> None:
    assert list(FACTS.subjects(EX.used_for_slicing, TRUE)) == [EX.cutting_board]
    assert list(FACTS.subjects(EX.cleaning_area, TRUE)) == [EX.sink]
    assert list(FACTS.subjects(EX.common_rec, TRUE)) == [EX.countertop]
    assert set(FACTS.subjects(EX.serving_place, TRUE)) == {EX.countertop, EX.table}
    assert set(FACTS.subjects(EX.toggleable, TRUE)) == {EX.oven, EX.stove, EX.blender}


def test_the_demos_missing_things_are_missing() -> None:
    for name in ("chives", "whisk", "skillet", "frying_pan"):
        assert not list(FACTS.predicate_objects(EX[name]))


def test_the_task_list_is_the_paper_recipes_and_the_recorded_dishes() -> None:
    assert KITCHEN.tasks() == sorted([*PAPER_RECIPES, *RECORDED_DISHES])


def check_plan(plan: LibraryPlan, task: str, items: list[str]) -> None:
    """Fail unless the plan renders to known calls in which every item occurs."""
    parsed = calls(plan.render(task, items).splitlines())
    assert {action for action, _ in parsed} <= KITCHEN.action_names() | {"whisk"}
    named = {argument for _, arguments in parsed for argument in arguments}
    assert set(items) <= named, f"forgotten: {set(items) - named}"
    for action, arguments in parsed:
        attribute = {"slice": EX.IsSliceable, "boil": EX.Boilable, "fry": EX.Fryable}.get(action)
        if attribute and arguments[0] in known_names():
            assert FACTS.value(EX[arguments[0]], attribute) == TRUE, (action, arguments)


@pytest.mark.parametrize("task", [*PAPER_RECIPES, *RECORDED_DISHES])
@pytest.mark.parametrize("extra", [[], ["tuna"]], ids=["own", "with tuna"])
def test_a_library_plan_serves_each_task(task: str, extra: list[str]) -> None:
    found = nearest_plan(task, KITCHEN.library().values())
    assert found
    check_plan(found[0], task, KITCHEN.needs(task) + extra)


@pytest.mark.parametrize("name", sorted(KITCHEN.library()))
def test_each_plan_renders_with_its_own_ingredients(name: str) -> None:
    plan = KITCHEN.library()[name]
    check_plan(plan, plan.names[0], list(plan.ingredients))
    check_plan(plan, plan.names[0], ["tuna"])


@pytest.mark.parametrize("name", sorted(KITCHEN.library()))
def test_roles_hold_in_this_kitchen(name: str) -> None:
    roles: dict[str, Any] = KITCHEN.library()[name].roles
    for role in ATTRIBUTE_OF_ROLE.keys() & roles.keys():
        for item in known_names() & set(roles[role]):
            value = FACTS.value(EX[item], ATTRIBUTE_OF_ROLE[role])
            assert value == TRUE, (role, item)


def test_the_omelette_plan_holds_what_the_demo_shows() -> None:
    text = KITCHEN.library()["omelette"].render("omelette", ["egg", "oil", "salt"])
    parsed = calls(text.splitlines())
    assert 13 <= len(parsed) <= 20
    assert ("whisk", ["bowl"]) in parsed
    assert ("put_down_rec", ["skillet", "stove"]) in parsed
    assert ("put_down_obj", ["chives", "plate"]) in parsed
    assert ("fry", ["egg", "skillet"]) in parsed


def test_a_likely_kind_is_told_with_what_the_things_have_in_common() -> None:
    """Nothing but garlic: that words have no definition here is nothing in common."""
    kg = KITCHEN.kg()
    scene, lexicon = Scene(kg, Task("none")), WordNet()
    for word in suggest.words_to_look_up(Question("kind", "leek", ""), scene):
        scene.around[word] = lexicon.related(word, kg.domain.noun_fields)
    told = suggest.Likely("leek", kg.domain.teachable, scene).kind()
    assert told == Suggestion("object", "as for garlic (alliaceous plant)")
