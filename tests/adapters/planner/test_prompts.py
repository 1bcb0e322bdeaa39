"""The prompts: what they name, and that their size does not grow with the graph."""

import json
import os
from dataclasses import replace

import pytest
from rdflib import RDF, Literal, URIRef

from adaptbot_cli.adapters.planner.prompts import (
    MARK,
    MOST_ACTIONS,
    MOST_NAMES,
    PARTS,
    STYLES,
    Prompts,
    Style,
)
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.resources import bundled
from tests.asking import task_for
from tests.packs import KITCHEN, PUBLISHED

EX = "http://example.org/"
PREVIOUS = 'pick_up_obj("egg")\n' * 20


def messages(kg: Kg, task: str, *findings: Finding) -> list[str]:
    attempt = 1 if findings else 0
    turn = Propose(task_for(task, kg), attempt, PREVIOUS if findings else "", findings)
    return [m["content"] for m in Prompts(bundled("prompts"), kg).messages(turn)]


def tokens(text: str) -> int:
    os.environ.setdefault("LITELLM_LOCAL_MODEL_COST_MAP", "True")
    import litellm

    return int(litellm.token_counter(model="gpt-4", text=text))


def many_findings() -> list[Finding]:
    """As many findings as a bad plan has: twelve, each with its names."""
    return [
        Finding(
            "E201",
            f"item_{n} is not in the knowledge graph; near it: pan and pot",
            f"item_{n}",
            n,
            ("pan", "pot"),
            line=n,
        )
        for n in range(1, 13)
    ]


def test_the_prompt_names_actions_classes_required_items_and_an_example() -> None:
    rules, example, asked = messages(KITCHEN.kg(), "make omelette")
    assert "slice(obj, tool?" in rules and rules.endswith("Use all of: egg, oil, salt")
    assert 'fry("egg", "skillet")' in example
    assert "Ingredient or object: egg, oil, salt" in asked and "knife" in asked
    text = rules + example + asked
    assert "fetched" not in text and "http" not in text and ".ttl" not in text


def test_an_example_is_the_nearest_plan_with_the_thoughts_that_lead_to_it() -> None:
    kg = KITCHEN.kg()
    assert "Task: soup\n" in messages(kg, "make pumpkin soup")[0]
    turn = Propose(task_for("make pumpkin soup", kg))
    thought = Prompts(bundled("prompts"), kg, style="cot").messages(turn)[1]["content"]
    items, todo, tools, mark, *calls = thought.splitlines()
    assert items == "Items: water, salt, onion, potato" and mark == MARK
    assert todo == "To do: boil water, slice onion, slice potato, boil onion, boil potato"
    assert tools == "With: pot, stove, knife, bowl, table" and calls[0] == 'pick_up_rec("pot")'
    told = json.loads(Prompts(bundled("prompts"), kg, style="schema").messages(turn)[1]["content"])
    assert told["plan"][0] == {"action": "pick_up_rec", "args": ["pot"]} and told["reasoning"]


def test_a_task_that_nobody_listed_is_told_what_the_home_has() -> None:
    kg = KITCHEN.kg()
    asked = messages(kg, "make ratatouille")[-1]
    assert all(name in asked for name in ("tomato", "onion", "potato", "oil"))
    without = messages(kg, "make ratatouille without onions")[-1]
    assert "Never use: onion" in without and "onion" not in without.partition("Task:")[0]


def test_what_an_experiment_leaves_out_is_not_told() -> None:
    kg = KITCHEN.kg()
    turn = Propose(task_for("make omelette", kg))
    bare = Prompts(bundled("prompts"), kg, leave_out=frozenset(PARTS)).messages(turn)
    assert len(bare) == 1 and "Here are" not in bare[0]["content"]
    unseen = Prompts(bundled("prompts"), kg, unseen=True).messages(turn)
    assert "Task: omelette" not in unseen[0]["content"]


def test_a_re_prompt_tells_each_finding_once_in_the_models_own_lines() -> None:
    finding = Finding("E201", "chives is not in the knowledge graph", "chives", 7, line=3)
    first, previous, again = messages(KITCHEN.kg(), "make omelette", finding, finding)
    assert previous == PREVIOUS and "Task: omelette" in first
    assert again.count("line 3: chives is not in the knowledge graph") == 1
    assert "Still use all of: egg, oil, salt" in again and "Use all of" not in first


def test_a_re_prompt_tells_kinds_of_findings_apart_and_what_was_tried_before() -> None:
    kg = KITCHEN.kg()
    codes = {"E401": "the hand is full", "E503": "nothing is served", "E504": "no frying"}
    findings = tuple(Finding(code, message) for code, message in codes.items())
    broken = Finding("E601", "the egg slipped")
    before = (Finding("E201", "no skillet"), Finding("E201", "no skillet", step=3))
    task = task_for("make omelette", kg)
    turn = Propose(task, 2, PREVIOUS, (*findings, broken), before=before)
    prompts = Prompts(bundled("prompts"), kg)
    again = prompts.messages(turn)[-1]["content"]
    for heading, message in (
        ("This cannot be done here", "the hand is full"),
        ("The plan does not reach its goal", "nothing is served"),
        ("The person objects", "no frying"),
        ("This failed when the robot did it", "the egg slipped"),
        ("Of plans before that, which is not to come back", "no skillet"),
    ):
        assert f"{heading}:\n- {message}\n" in again
    assert "no skillet" not in replace(prompts, leave_out=frozenset({"memory"})).again(turn)


def test_a_re_prompt_tells_no_name_of_a_predicate() -> None:
    finding = Finding(
        "E301", "it is not known whether carrot is fryable", "carrot", 1, ("Fryable",)
    )
    assert "Fryable" not in messages(KITCHEN.kg(), "make omelette", finding)[2]


def test_a_hundred_times_more_items_make_no_prompt_longer() -> None:
    sizes = [
        sum(map(len, messages(grown(count), "make omelette", *many_findings())))
        for count in (100, 10_000)
    ]
    assert sizes[1] <= sizes[0]


@pytest.mark.parametrize("style", STYLES)
def test_neither_things_nor_actions_make_a_prompt_grow(style: Style) -> None:
    kg = grown(10_000)
    act = kg.domain.actions["fry"]
    more = {f"do_{n}_well": replace(act, name=f"do_{n}_well", family="") for n in range(1_700)}
    kg = kg.under(replace(kg.domain, actions={**more, **kg.domain.actions}))
    prompts = Prompts(bundled("prompts"), kg, style=style)
    for request in ("make omelette", "make ratatouille", "make a tomato soup without salt"):
        turn = Propose(task_for(request, kg))
        told = prompts.messages(turn)
        assert sum(tokens(message["content"]) for message in told) < 700
        assert len(prompts.form(turn).actions) == MOST_ACTIONS
        assert "fry(obj" in told[0]["content"] and "slice(obj" in told[0]["content"]


def test_of_many_things_those_that_the_nearest_plan_needs_are_named() -> None:
    text = messages(grown(1_000), "make omelette")[-1]
    [vessels] = [line for line in text.splitlines() if line.startswith("Vessel")]
    named = set(vessels.partition(": ")[2].split(", "))
    assert {"bowl", "pan", "plate"} <= named and len(named) <= MOST_NAMES


def grown(count: int) -> Kg:
    """The kitchen with so many more objects, vessels and tools."""
    kg = KITCHEN.kg()
    facts = set()
    for n in range(count):
        iri = URIRef(f"{EX}a_thing_{n:05}")
        kind, name = (("object", "obj"), ("mreceptacle", "rec"), ("tool", "tool"))[n % 3]
        facts.add((iri, RDF.type, URIRef(EX + kind)))
        facts.add((iri, URIRef(f"{EX}{name}_name"), Literal(f"a_thing_{n:05}")))
    kg.learn(Delta(added=frozenset(facts)))
    return kg


@pytest.mark.skipif(not PUBLISHED.is_dir(), reason="the published recordings are not here")
def test_prompts_on_the_published_graph_are_small() -> None:
    kg = KITCHEN.kg(PUBLISHED / "kg" / "cooking.initial.d65fe35.ttl")
    tasks = [task.name for task in kg.domain.tasks]
    assert max(sum(map(tokens, messages(kg, task))) for task in tasks) < 700
    again = messages(kg, "greek salad", *many_findings())[2]
    assert tokens(again) < 450
