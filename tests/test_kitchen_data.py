"""Check the kitchen's graphs, its tasks and its plan library against the domain's vocabulary."""

import re
from functools import cache
from pathlib import Path
from typing import Any, Final

import pytest
from rdflib import RDF, RDFS, XSD, Graph, Literal, Namespace, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from adaptbot_cli.adapters.planner.library import LibraryPlan, nearest_plan, read_library

ROOT: Final = Path(__file__).resolve().parents[1]
KITCHEN: Final = ROOT / "kg" / "kitchen"
LIBRARY: Final = ROOT / "prompts" / "library" / "kitchen"
AB: Final = Namespace("urn:adaptbot:")
EX: Final = Namespace("http://example.org/")

PAPER_RECIPES: Final = (
    "chocolate cookies",
    "peanut butter cookies",
    "italian burger",
    "bbq crunch burger",
    "mac and cheese burger",
    "onion sandwich",
    "mushroom sandwich",
    "chicken salad sandwich",
    "french toast sandwich",
    "tomato soup",
    "cucumber salad",
    "greek salad",
    "peppermint iced tea",
    "chai tea latte",
    "ginger iced tea",
    "chargrilled bbq burger",
    "chili burger",
    "tea scones",
    "stop and go tea sandwich",
    "green tea lava cake",
    "egg and spinach sandwich",
    "chocolate and banana toasted sandwich",
    "veggie sandwich panini",
    "split pea soup",
    "potato soup",
    "weight watchers golden cream soup",
    "basil tomato mozzarella salad",
    "ham pea and cheese salad",
    "anja's egg salad",
    "mozzarella beef burger",
)
RECORDED_DISHES: Final = (
    "omelette",
    "lime water",
    "coffee",
    "french toast",
    "fruit cake",
    "lime tea",
    "potato fry",
    "bread pudding",
    "avocado toast",
    "mashed potato",
    "fruit salad",
    "butter chicken",
    "mango lassi",
    "egg sandwich",
    "hot chocolate",
    "apple smoothie",
    "samosa",
    "onion soup",
    "carrot pudding",
    "banana chips",
)
OBJECT_ATTRIBUTES: Final = (
    EX.IsLiquid,
    EX.IsSliceable,
    EX.Boilable,
    EX.Fryable,
    EX.NeedsToBeCleaned,
    EX.IsBig,
)
STATE_OF_ATTRIBUTE: Final = {
    EX.IsSliceable: EX.sliced,
    EX.Boilable: EX.IsBoiled,
    EX.Fryable: EX.IsFried,
    EX.NeedsToBeCleaned: EX.IsCleaned,
}
ATTRIBUTE_OF_ROLE: Final = {
    "sliced": EX.IsSliceable,
    "boiled": EX.Boilable,
    "fried": EX.Fryable,
}
CALL: Final = re.compile(r'(\w+)\(((?:"[^"]*"|[\d.]+)(?:, (?:"[^"]*"|[\d.]+))*)\)( +#.*)?')
TRUE: Final = Literal(True)
FALSE: Final = Literal(False)


@cache
def graph(*names: str) -> Graph:
    """Return the union of the named Turtle files of the kitchen."""
    union = Graph()
    for name in names:
        union.parse(KITCHEN / f"{name}.ttl")
    return union


def facts() -> Graph:
    return graph("attributes", "state")


def schema() -> Graph:
    return graph("domain")


def known_names() -> set[str]:
    """Return the names of the kitchen's ingredients and objects."""
    return {str(name) for name in graph("attributes").objects(None, EX.obj_name)}


def classes_of(node: Node) -> set[Node]:
    """Return a thing's class and all classes above it."""
    found: set[Node] = set()
    for kind in facts().objects(node, RDF.type):
        found.update(c for c in schema().transitive_objects(kind, RDFS.subClassOf) if c)
    return found


def needs(task: str) -> list[str]:
    """Return a task's required items in alphabetical order."""
    node = graph("tasks").value(None, RDFS.label, Literal(task))
    return sorted(str(item) for item in graph("tasks").objects(node, AB.needs))


def action_names() -> set[str]:
    actions = graph("actions")
    return {str(actions.value(a, RDFS.label)) for a in actions.subjects(RDF.type, AB.Action)}


@cache
def library() -> dict[str, LibraryPlan]:
    """Return the plans of the library by file name."""
    return {plan.path.stem: plan for plan in read_library(LIBRARY)}


def calls(lines: list[str]) -> list[tuple[str, list[str]]]:
    """Return a rendered plan's calls as (action, arguments); every line must be one."""
    parsed = []
    for line in lines:
        match = CALL.fullmatch(line)
        assert match, f"not a call: {line!r}"
        parsed.append((match[1], re.findall(r'"([^"]*)"', match[2])))
    return parsed


def test_size_is_at_least_that_of_the_published_graph() -> None:
    assert len(set(facts().subjects())) >= 79
    assert len(facts()) >= 772


@pytest.mark.parametrize(("name", "kind"), [("attributes", AB.attribute), ("state", AB.state)])
def test_every_predicate_is_declared_for_its_graph(name: str, kind: URIRef) -> None:
    for predicate in set(graph(name).predicates()) - {RDF.type}:
        assert schema().value(predicate, AB.graph) == kind, predicate


def test_types_stand_with_the_attributes_only() -> None:
    assert not list(graph("state").triples((None, RDF.type, None)))
    assert set(graph("state").subjects()) <= set(graph("attributes").subjects())
    for node in set(facts().subjects()):
        assert len(list(facts().objects(node, RDF.type))) == 1, node


def test_every_fact_keeps_domain_and_range() -> None:
    for subject, predicate, value in facts():
        if predicate == RDF.type:
            assert (value, RDF.type, RDFS.Class) in schema()
            continue
        assert schema().value(predicate, RDFS.domain) in classes_of(subject), (subject, predicate)
        wanted = schema().value(predicate, RDFS.range)
        if isinstance(value, Literal):
            assert value.datatype in ({XSD.string, None} if wanted == XSD.string else {wanted})
        else:
            assert wanted in classes_of(value), (subject, predicate, value)


def test_no_functional_property_has_two_values() -> None:
    for predicate in schema().subjects(AB.functional, TRUE):
        subjects = list(facts().subjects(predicate, None))
        assert len(subjects) == len(set(subjects)), predicate


def test_names_are_the_identifiers() -> None:
    for predicate in (EX.room_name, EX.rec_name, EX.obj_name, EX.tool_name):
        for subject, name in graph("attributes").subject_objects(predicate):
            assert subject == EX[str(name)]


def test_every_object_has_all_attributes_and_its_states() -> None:
    objects = set(facts().subjects(RDF.type, EX.object))
    assert objects
    for thing in objects:
        assert facts().value(thing, EX.obj_location) is not None, thing
        for attribute in OBJECT_ATTRIBUTES:
            assert facts().value(thing, attribute) in (TRUE, FALSE), (thing, attribute)
        for attribute, state in STATE_OF_ATTRIBUTE.items():
            applies = facts().value(thing, attribute) == TRUE
            assert facts().value(thing, state) == (FALSE if applies else None), (thing, state)


def test_what_the_domain_asks_for_and_starts_with_is_there() -> None:
    for kind in schema().subjects(RDF.type, RDFS.Class):
        for thing in facts().subjects(RDF.type, kind):
            asked = schema().value(kind, AB.asks)
            for attribute in Collection(schema(), asked) if asked else ():
                assert facts().value(thing, attribute) is not None, (thing, attribute)
            for start in schema().objects(kind, AB.starts):
                when = schema().value(start, AB.when)
                if when is None or facts().value(thing, when) == TRUE:
                    state = schema().value(start, AB.property)
                    assert facts().value(thing, state) in (TRUE, FALSE), (thing, state)


def test_a_liquid_is_neither_sliced_nor_washed_nor_fried() -> None:
    for thing in facts().subjects(EX.IsLiquid, TRUE):
        for attribute in (EX.IsSliceable, EX.NeedsToBeCleaned, EX.Fryable):
            assert facts().value(thing, attribute) == FALSE, (thing, attribute)


def test_the_one_place_for_each_purpose() -> None:
    assert list(facts().subjects(EX.used_for_slicing, TRUE)) == [EX.cutting_board]
    assert list(facts().subjects(EX.cleaning_area, TRUE)) == [EX.sink]
    assert list(facts().subjects(EX.common_rec, TRUE)) == [EX.countertop]
    assert set(facts().subjects(EX.serving_place, TRUE)) == {EX.countertop, EX.table}
    assert set(facts().subjects(EX.toggleable, TRUE)) == {EX.oven, EX.stove, EX.blender}


def test_the_demos_missing_things_are_missing() -> None:
    for name in ("chives", "whisk", "skillet", "frying_pan"):
        assert not list(facts().predicate_objects(EX[name]))


def test_every_default_of_an_action_has_an_answer() -> None:
    actions = graph("actions")
    for default in actions.objects(None, AB.default):
        rows = list(facts().query(str(default), initNs={"ex": EX}))
        assert rows, default


@pytest.mark.parametrize("name", ["attributes", "state"])
def test_a_fact_is_a_line_and_things_are_sorted(name: str) -> None:
    text = (KITCHEN / f"{name}.ttl").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith(("#", "@prefix"))]
    subjects = [line.split()[0] for line in lines if line.startswith("ex:")]
    assert subjects == sorted(set(subjects))
    assert all(line == "." or line.endswith(" ;") for line in lines)
    assert sum(line != "." for line in lines) == len(graph(name))


@pytest.mark.parametrize("task", [*PAPER_RECIPES, *RECORDED_DISHES])
def test_each_task_has_known_needs_and_goals_of_its_own(task: str) -> None:
    tasks = graph("tasks")
    node = tasks.value(None, RDFS.label, Literal(task))
    assert (node, RDF.type, AB.Task) in tasks
    assert needs(task)
    assert set(needs(task)) <= known_names()
    goals = list(tasks.objects(node, AB.goal))
    orders = sorted(int(str(tasks.value(goal, AB.order))) for goal in goals)
    assert orders == list(range(1, len(goals) + 1))
    asks = [str(tasks.value(goal, AB.ask)) for goal in goals]
    assert asks
    assert all(tasks.value(goal, AB.message) for goal in goals)
    for ask in asks:
        answer = facts().query(ask, initNs={"ex": EX}).askAnswer
        assert answer is False, f"holds before the plan: {ask}"
        for name in re.findall(r"\bex:(\w+)", ask):
            known = (EX[name], None, None)
            assert known in facts() or known in schema(), f"unknown: ex:{name}"


def test_the_task_list_is_the_paper_recipes_and_the_recorded_dishes() -> None:
    tasks = graph("tasks")
    labels = [str(tasks.value(node, RDFS.label)) for node in tasks.subjects(RDF.type, AB.Task)]
    assert sorted(labels) == sorted([*PAPER_RECIPES, *RECORDED_DISHES])


def test_no_alias_is_another_tasks_name() -> None:
    tasks = graph("tasks")
    names = [str(n) for p in (RDFS.label, AB.alias) for n in tasks.objects(None, p)]
    assert len(names) == len(set(names))


def check_plan(plan: LibraryPlan, task: str, items: list[str]) -> None:
    """Fail unless the plan renders to known calls in which every item occurs."""
    parsed = calls(plan.render(task, items).splitlines())
    assert {action for action, _ in parsed} <= action_names() | {"whisk"}
    named = {argument for _, arguments in parsed for argument in arguments}
    assert set(items) <= named, f"forgotten: {set(items) - named}"
    for action, arguments in parsed:
        attribute = {"slice": EX.IsSliceable, "boil": EX.Boilable, "fry": EX.Fryable}.get(action)
        if attribute and arguments[0] in known_names():
            assert facts().value(EX[arguments[0]], attribute) == TRUE, (action, arguments)


@pytest.mark.parametrize("task", [*PAPER_RECIPES, *RECORDED_DISHES])
@pytest.mark.parametrize("extra", [[], ["tuna"]], ids=["own", "with tuna"])
def test_a_library_plan_serves_each_task(task: str, extra: list[str]) -> None:
    found = nearest_plan(task, library().values())
    assert found
    check_plan(found[0], task, needs(task) + extra)


@pytest.mark.parametrize("name", sorted(path.stem for path in LIBRARY.glob("*.plan")))
def test_each_plan_renders_with_its_own_ingredients(name: str) -> None:
    plan = library()[name]
    check_plan(plan, plan.names[0], list(plan.ingredients))
    check_plan(plan, plan.names[0], ["tuna"])


@pytest.mark.parametrize("name", sorted(path.stem for path in LIBRARY.glob("*.plan")))
def test_roles_hold_in_this_kitchen(name: str) -> None:
    roles: dict[str, Any] = library()[name].roles
    for role in ATTRIBUTE_OF_ROLE.keys() & roles.keys():
        for item in known_names() & set(roles[role]):
            value = facts().value(EX[item], ATTRIBUTE_OF_ROLE[role])
            assert value == TRUE, (role, item)


def test_no_name_belongs_to_two_plans() -> None:
    names = [name for plan in library().values() for name in plan.names]
    assert len(names) == len(set(names))


def test_the_omelette_plan_holds_what_the_demo_shows() -> None:
    text = library()["omelette"].render("omelette", ["egg", "oil", "salt"])
    parsed = calls(text.splitlines())
    assert 13 <= len(parsed) <= 20
    assert ("whisk", ["bowl"]) in parsed
    assert ("put_down_rec", ["skillet", "stove"]) in parsed
    assert ("put_down_obj", ["chives", "plate"]) in parsed
    assert ("fry", ["egg", "skillet"]) in parsed
