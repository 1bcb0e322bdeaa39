"""What `adaptbot domain check` does not judge of a bundled domain's graphs, tasks and plans."""

import re
from pathlib import Path

import pytest
from rdflib import RDF, RDFS
from rdflib.collection import Collection

from tests.cli.command import Home
from tests.packs import AB, EX, NAMES, PACKS, TRUE, Pack, calls

pytestmark = pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.name)


def test_its_check_finds_no_fault(pack: Pack, tmp_path: Path) -> None:
    checked = Home(tmp_path).adaptbot("domain", "check", pack.name)
    assert checked.code == 0, checked.said


def test_names_are_the_identifiers_and_no_alias_is_a_name(pack: Pack) -> None:
    named = [(s, str(n)) for p in NAMES for s, n in pack.facts.subject_objects(p)]
    assert all(subject == EX[name] for subject, name in named)
    aliases = [str(alias) for alias in pack.facts.objects(None, AB.alias)]
    assert len(aliases) == len(set(aliases))
    assert set(aliases).isdisjoint(name for _, name in named)


def test_what_the_domain_asks_for_and_starts_with_is_there(pack: Pack) -> None:
    for kind in pack.schema.subjects(RDF.type, RDFS.Class):
        for thing in pack.facts.subjects(RDF.type, kind):
            asked = pack.schema.value(kind, AB.asks)
            for attribute in Collection(pack.schema, asked) if asked else ():
                assert pack.facts.value(thing, attribute) is not None, (thing, attribute)
            for start in pack.schema.objects(kind, AB.starts):
                when = pack.schema.value(start, AB.when)
                state = pack.schema.value(start, AB.property)
                applies = when is None or pack.facts.value(thing, when) == TRUE
                value = pack.facts.value(thing, state)
                assert (value is not None) == applies, (thing, state)


def test_what_follows_from_another_fact_is_not_denied(pack: Pack) -> None:
    for prop, implied in pack.schema.subject_objects(AB.impliedBy):
        source, equals, value = (
            pack.schema.value(implied, term) for term in (AB.property, AB.equals, AB.value)
        )
        for thing in pack.facts.subjects(source, equals):
            assert pack.facts.value(thing, prop) in (value, None), (thing, prop)


def test_every_default_of_an_action_has_an_answer(pack: Pack) -> None:
    for default in pack.graph("actions").objects(None, AB.default):
        assert list(pack.facts.query(str(default), initNs={"ex": EX})), default


def test_no_action_bears_the_iri_of_a_thing(pack: Pack) -> None:
    actions = set(pack.graph("actions").subjects(RDF.type, AB.Action))
    assert actions.isdisjoint(pack.facts.subjects())


@pytest.mark.parametrize("name", ["attributes", "state"])
def test_a_fact_is_a_line_and_things_are_sorted(pack: Pack, name: str) -> None:
    text = (pack.folder / f"{name}.ttl").read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if line and not line.startswith(("#", "@prefix"))]
    subjects = [line.split()[0] for line in lines if line.startswith("ex:")]
    assert subjects == sorted(set(subjects))
    assert all(line == "." or line.endswith(" ;") for line in lines)
    assert sum(line != "." for line in lines) == len(pack.graph(name))


def test_each_task_has_known_needs_and_goals_of_its_own(pack: Pack) -> None:
    tasks = pack.graph("tasks")
    for node in tasks.subjects(RDF.type, AB.Task):
        needs = {str(item) for item in tasks.objects(node, AB.needs)}
        assert needs, node
        assert needs <= pack.names(), node
        goals = list(tasks.objects(node, AB.goal))
        orders = sorted(int(str(tasks.value(goal, AB.order))) for goal in goals)
        assert orders == list(range(1, len(goals) + 1)), node
        assert goals, node
        assert all(tasks.value(goal, AB.message) for goal in goals)


def test_no_goal_of_a_task_holds_before_the_plan(pack: Pack) -> None:
    tasks = pack.graph("tasks")
    goals = {g for t in tasks.subjects(RDF.type, AB.Task) for g in tasks.objects(t, AB.goal)}
    for ask in (str(tasks.value(goal, AB.ask)) for goal in goals):
        assert pack.facts.query(ask, initNs={"ex": EX}).askAnswer is False, ask
        for name in re.findall(r"\bex:(\w+)", ask):
            known = (EX[name], None, None)
            assert known in pack.facts or known in pack.schema, f"unknown: ex:{name}"


def test_each_plan_renders_to_known_calls(pack: Pack) -> None:
    for plan in pack.library().values():
        for items in (plan.ingredients, (*(plan.base or ()), "unheard_of")):
            parsed = calls(plan.render(plan.names[0], items).splitlines())
            assert parsed, plan.path
            assert {action for action, _ in parsed} <= pack.action_names() | {"whisk"}
