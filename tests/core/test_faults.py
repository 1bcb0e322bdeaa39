"""What is wrong with a graph's facts, and with what a pack's conditions name."""

import pytest

from adaptbot_cli.core.faults import faults
from tests.worlds import changed, workshop

SOUND = set(faults(workshop()))


def new_faults(**extra: str) -> list[str]:
    return [fault for fault in faults(workshop(**extra)) if fault not in SOUND]


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
    assert [fault for fault in faults(kg) if fault not in SOUND] == [
        'actions.ttl, entry put: hold in "{thing} must be in the hand" is not declared in '
        "domain.ttl; the nearest there is holds",
        'actions.ttl, entry charge: changed in "{tool} is charged already" is not declared in '
        "domain.ttl; the nearest there is charged",
    ]
