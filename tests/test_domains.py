"""Check each bundled domain's graphs, tasks and plan library against its own vocabulary."""

import re

import pytest
from rdflib import RDF, RDFS, XSD, Literal, URIRef
from rdflib.collection import Collection

from tests.packs import AB, EX, NAMES, PACKS, TRUE, Pack, calls

pytestmark = pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.name)


@pytest.mark.parametrize(("name", "kind"), [("attributes", AB.attribute), ("state", AB.state)])
def test_every_predicate_is_declared_for_its_graph(pack: Pack, name: str, kind: URIRef) -> None:
    for predicate in set(pack.graph(name).predicates()) - {RDF.type, AB.alias}:
        assert pack.schema.value(predicate, AB.graph) == kind, predicate


def test_types_stand_with_the_attributes_only(pack: Pack) -> None:
    assert not list(pack.graph("state").triples((None, RDF.type, None)))
    assert set(pack.graph("state").subjects()) <= set(pack.graph("attributes").subjects())
    for node in set(pack.facts.subjects()):
        assert len(list(pack.facts.objects(node, RDF.type))) == 1, node


def test_every_fact_keeps_domain_and_range(pack: Pack) -> None:
    for subject, predicate, value in pack.facts:
        if predicate == AB.alias:
            continue
        if predicate == RDF.type:
            assert (value, RDF.type, RDFS.Class) in pack.schema
            continue
        domain = pack.schema.value(predicate, RDFS.domain)
        assert domain in pack.classes_of(subject), (subject, predicate)
        wanted = pack.schema.value(predicate, RDFS.range)
        if isinstance(value, Literal):
            assert value.datatype in ({XSD.string, None} if wanted == XSD.string else {wanted})
        else:
            assert wanted in pack.classes_of(value), (subject, predicate, value)


def test_no_functional_property_has_two_values(pack: Pack) -> None:
    for predicate in pack.schema.subjects(AB.functional, TRUE):
        subjects = list(pack.facts.subjects(predicate, None))
        assert len(subjects) == len(set(subjects)), predicate


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


def test_no_alias_is_another_tasks_name(pack: Pack) -> None:
    tasks = pack.graph("tasks")
    names = [str(n).lower() for p in (RDFS.label, AB.alias) for n in tasks.objects(None, p)]
    assert len(names) == len(set(names))


def test_no_name_belongs_to_two_plans(pack: Pack) -> None:
    names = [name for plan in pack.library().values() for name in plan.names]
    assert len(names) == len(set(names))


def test_each_plan_renders_to_known_calls(pack: Pack) -> None:
    for plan in pack.library().values():
        for items in (plan.ingredients, (*(plan.base or ()), "unheard_of")):
            parsed = calls(plan.render(plan.names[0], items).splitlines())
            assert parsed, plan.path
            assert {action for action, _ in parsed} <= pack.action_names() | {"whisk"}
