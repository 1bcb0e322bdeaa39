"""The prompts: what they name, and that their size does not grow with the graph."""

import os
from pathlib import Path

import pytest
from rdflib import RDF, Literal, URIRef

from adaptbot_cli.adapters.planner.prompts import MOST_NAMES, Prompts
from adaptbot_cli.adapters.store.reading import load_kg, read_files, read_graphs
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.resources import bundled
from tests.asking import task_for

DEFAULT = Path(__file__).parents[4] / "shared" / "published"
PUBLISHED = Path(os.environ.get("ADAPTBOT_PUBLISHED", DEFAULT))
EX = "http://example.org/"
PREVIOUS = 'pick_up_obj("egg")\n' * 20


def kitchen(facts: Path | None = None) -> Kg:
    paths = [facts] if facts else []
    return load_kg(read_files(bundled("kg") / "kitchen"), "kitchen", read_graphs(paths))


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


def test_the_prompt_names_actions_tools_required_items_and_an_example() -> None:
    text = messages(kitchen(), "make omelette")[0]
    for part in ("slice(obj, tool?", "knife", "Use all of: egg, oil, salt", "Example,"):
        assert part in text
    assert "fetched" not in text and "http" not in text and ".ttl" not in text


def test_an_example_is_the_nearest_plan_of_the_library() -> None:
    assert 'Example, "soup"' in messages(kitchen(), "make pumpkin soup")[0]


def test_a_re_prompt_tells_each_finding_once_in_the_models_own_lines() -> None:
    finding = Finding("E201", "chives is not in the knowledge graph", "chives", 7, line=3)
    first, previous, again = messages(kitchen(), "make omelette", finding, finding)
    assert previous == PREVIOUS and "Task: omelette" in first
    assert again.count("line 3: chives is not in the knowledge graph") == 1
    assert "Still use all of: egg, oil, salt" in again and "Use all of" not in first


def test_a_re_prompt_tells_no_name_of_a_predicate() -> None:
    finding = Finding(
        "E301", "it is not known whether carrot is fryable", "carrot", 1, ("Fryable",)
    )
    assert "Fryable" not in messages(kitchen(), "make omelette", finding)[2]


def test_a_hundred_times_more_items_make_no_prompt_longer() -> None:
    sizes = [
        sum(map(len, messages(grown(count), "make omelette", *many_findings())))
        for count in (100, 10_000)
    ]
    assert sizes[0] == sizes[1]


def test_of_many_things_those_that_the_nearest_plan_needs_are_named() -> None:
    text = messages(grown(100), "make omelette")[0]
    [vessels] = [line for line in text.splitlines() if line.startswith("Vessel")]
    assert {"bowl", "skillet", "plate"} & set(vessels.partition(": ")[2].split(", "))
    assert vessels.count(", ") == MOST_NAMES - 1


def grown(count: int) -> Kg:
    """The kitchen with so many more objects, vessels and tools."""
    kg = kitchen()
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
    kg = kitchen(PUBLISHED / "kg" / "cooking.initial.d65fe35.ttl")
    tasks = [task.name for task in kg.domain.tasks]
    assert max(tokens(messages(kg, task)[0]) for task in tasks) < 700
    again = messages(kg, "greek salad", *many_findings())[2]
    assert tokens(again) < 450
