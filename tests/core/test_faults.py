"""What is wrong with a graph's facts, and with what a pack's conditions name."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import RDF, RDFS, Literal, URIRef

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import AB, Triple
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.core.graph.validate import new_faults as new_faults_of
from tests.packs import HOUSEHOLD, KITCHEN, PUBLISHED
from tests.properties import examples
from tests.worlds import W, changed, facts, workshop

GRAPHS = PUBLISHED / "kg"
SOUND = {*map(str, faults(workshop()))}


def new_faults(**extra: str) -> list[str]:
    return [fault for fault in map(str, faults(workshop(**extra))) if fault not in SOUND]


@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        (
            "w:board a w:tool .",
            "attributes.ttl, entry board: is a part and a tool; it can be only one of them",
        ),
        (
            'w:board ab:alais "plank" .',
            "attributes.ttl, entry board: ab:alais means nothing among the facts; ",
        ),
        (
            "w:board w:drillable true , false .",
            "attributes.ttl, entry board: drillable has 2 values: false and true; keep one",
        ),
    ],
)
def test_a_fault_of_the_facts(attributes: str, said: str) -> None:
    assert [fault for fault in new_faults(attributes=attributes) if fault.startswith(said)]


def test_a_class_and_its_superclass_are_no_two_classes() -> None:
    assert new_faults(attributes="w:board a w:thing .") == []


def test_what_people_have_said_is_no_fault() -> None:
    said = 'w:board ab:alias "slab_x" . ab:workshop ab:absentItem "gold" ; ab:absentAction "fly" .'
    assert new_faults(attributes=said) == []


def test_a_predicate_that_a_condition_misspells() -> None:
    kg = changed(
        ("actions.ttl", "ASK { ?agent w:holds ?thing }", "ASK { ?agent w:hold ?thing }"),
        ("actions.ttl", "?tool w:charged true } }", "?tool w:changed true } }"),
    )
    assert [fault for fault in map(str, faults(kg)) if fault not in SOUND] == [
        'actions.ttl, entry put: hold in "{thing} must be in the hand" is not declared in '
        "domain.ttl; the nearest there is holds",
        'actions.ttl, entry charge: changed in "{tool} is charged already" is not declared in '
        "domain.ttl; the nearest there is charged",
    ]


def entity(name: str) -> URIRef:
    return URIRef(W + name)


@pytest.mark.parametrize(
    ("attributes", "state", "said"),
    [
        ("", "w:ghost w:in w:bench .", "ghost: nothing says what it is"),
        ("w:board w:heavy 3 .", "", "heavy) must be a boolean, not 3"),
        ('w:board w:heavy "yes"^^xsd:boolean .', "", "heavy) is not written as a boolean is"),
        ("w:plank w:called 5 .", "", "called must be a string, not 5"),
        ("w:board w:glows true .", "", "board: glows is not declared in domain.ttl"),
        ("w:board a w:unicorn .", "", "board: unicorn is no class of domain.ttl"),
        ("w:lamp a w:part .", "", "lamp: lacks its name, called"),
        ("", "w:vase w:in w:pluto .", "place (in) is pluto, which is nothing known"),
        ("", "w:vase w:in w:drill .", "drill is not"),
        ('w:plank ab:alias "slab" . w:vase ab:alias "slab" .', "", "is that of vase too"),
        ('w:ghost ab:alias "spook" .', "", "ghost: has the other name spook, but is nothing known"),
    ],
)  # fmt: skip
def test_a_fault_in_plain_words(attributes: str, state: str, said: str) -> None:
    found = [fault.message for fault in faults(workshop(attributes=attributes, state=state))]
    assert any(said in fault for fault in found), found


def test_a_ring_of_places_is_told_once() -> None:
    state = "w:bench w:in w:cupboard . w:cupboard w:in w:stove . w:stove w:in w:bench ."
    found = [f.message for f in faults(workshop(state=state)) if "is in itself" in f.message]
    assert found == ["bench: is in itself: bench in cupboard in stove in bench"]


CHANGES = {
    "nothing wrong": ({("plank", "drillable", Literal(True))}, set(), []),
    "there already": ({("board", "drillable", Literal(True))}, set(), []),
    "a second value": (
        {("board", "drillable", Literal(False))}, set(), ["board: drillable has 2 values: "],
    ),
    "another value": (
        {("board", "drillable", Literal(False))}, {("board", "drillable", Literal(True))}, [],
    ),
    "what others are in is taken away": (
        set(),
        {("bench", "type", "furniture"), ("bench", "called", Literal("bench")),
         ("bench", "hasDoor", Literal(False))},
        ["plank: ", "vase: ", "drill: ", "saw: "],
    ),
}  # fmt: skip


def triple(subject: str, predicate: str, value: object) -> Triple:
    verb = RDF.type if predicate == "type" else entity(predicate)
    return entity(subject), verb, value if isinstance(value, Literal) else entity(str(value))


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_judged_by_what_it_touches(name: str) -> None:
    """The faults of a change are those that the whole graph has with it and has not without it."""
    added, removed, said = CHANGES[name]
    delta = Delta(
        frozenset(triple(*told) for told in removed), frozenset(triple(*told) for told in added)
    )
    kg = workshop()
    before = facts(kg)
    found = new_faults_of(kg, delta)
    assert facts(kg) == before
    assert len(found) == len(said) and all(
        any(fault.message.startswith(start) for fault in found) for start in said
    )
    old = {fault.key for fault in faults(kg)}
    kg.learn(delta)
    assert {fault.key for fault in faults(kg)} - old == {fault.key for fault in found}


@examples(60)
@given(st.data())
def test_any_change_is_judged_as_the_whole_graph_is(data: st.DataObject) -> None:
    kg = workshop()
    there = sorted(facts(kg), key=str)
    things = [entity(n) for n in ("board", "plank", "vase", "drill", "bench", "cupboard", "ghost")]
    verbs = [RDF.type, *(entity(n) for n in ("drillable", "in", "called", "hasDoor", "on", "odd"))]
    verbs += [AB.alias, AB.odd, RDFS.subClassOf]
    values = [*things, Literal(True), Literal(False), Literal("x"), entity("part"), entity("tool")]
    new = st.tuples(st.sampled_from(things), st.sampled_from(verbs), st.sampled_from(values))
    delta = Delta(
        data.draw(st.frozensets(st.sampled_from(there), max_size=4)),
        data.draw(st.frozensets(new, max_size=4)),
    )
    found = {fault.key for fault in new_faults_of(kg, delta)}
    old = {fault.key for fault in faults(kg)}
    kg.learn(Delta(delta.removed - delta.added, delta.added))
    assert {fault.key for fault in faults(kg)} - old == found


@pytest.mark.skipif(not GRAPHS.is_dir(), reason="the published graphs are not here")
@pytest.mark.parametrize("path", sorted(GRAPHS.glob("*.ttl")), ids=lambda path: path.name)
def test_every_published_graph_is_judged(path: Path) -> None:
    """Their oddities are told; what the domain packs allow for is none."""
    kg = (HOUSEHOLD if path.name.startswith("cleaning") else KITCHEN).kg(path)
    told = {fault.message for fault in faults(kg) if fault.facts}
    odd = {
        "living_room_floor: place (imrec_location) must be a room, living_room_floor is not",
        "living_room_floor: is in itself: living_room_floor in living_room_floor",
        "cutting_board: slicing board (used_for_slicing) has 2 values: false and true",
    }
    assert told <= odd
    assert told or path.name == "example.state-graph.d65fe35.ttl"
