"""Merging what several have learned: on every graph that hypothesis makes of a few facts."""

from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import RDF, Literal

from adaptbot_cli.core.ask.questions import Answer
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.merge import Facts, Merge, conflicts, question, side_of
from adaptbot_cli.core.graph.terms import AB, FALSE, TRUE, Triple
from tests import packs
from tests.adapters.store.homes import ex
from tests.properties import examples

EGG, LEEK = ex("egg"), ex("leek")
AT, LIQUID, SLICEABLE = ex("obj_location"), ex("IsLiquid"), ex("IsSliceable")
NO_LEEK = (AB.kitchen, AB.absentItem, Literal("leek"))
BASE: Facts = frozenset(
    {
        (EGG, RDF.type, ex("object")),
        (EGG, ex("obj_name"), Literal("egg")),
        (EGG, AT, ex("fridge")),
        (EGG, AB.alias, Literal("ovum")),
        (ex("knife"), ex("tool_location"), ex("drawer")),
    }
)
FACTS: list[Triple] = [
    *((EGG, AT, ex(place)) for place in ("fridge", "table", "counter")),
    *((EGG, LIQUID, value) for value in (TRUE, FALSE)),
    *((EGG, SLICEABLE, value) for value in (TRUE, FALSE)),
    *((EGG, AB.alias, Literal(name)) for name in ("ovum", "oeuf")),
]
NEW: Facts = frozenset({(LEEK, RDF.type, ex("object")), (LEEK, ex("obj_name"), Literal("leek"))})


KITCHEN = packs.KITCHEN.kg()


@pytest.fixture(scope="module")
def domain() -> Domain:
    return KITCHEN.domain


@st.composite
def learned(draw: st.DrawFn) -> Facts:
    """What somebody knows who began with BASE: values changed, facts more and fewer."""
    if draw(st.integers(0, 9)) == 0:
        return frozenset(t for t in BASE if EGG not in t)
    facts = set(BASE)
    for subject, predicate, value in draw(st.lists(st.sampled_from(FACTS), max_size=3)):
        several = predicate == AB.alias
        facts -= {t for t in facts if t[:2] == (subject, predicate) and not several}
        facts.add((subject, predicate, value))
        if predicate == LIQUID and value == TRUE:
            facts -= {(subject, SLICEABLE, TRUE)}
        if predicate == SLICEABLE and value == TRUE:
            facts -= {(subject, LIQUID, TRUE)}
    facts -= draw(
        st.sets(st.sampled_from(sorted(BASE - {(EGG, RDF.type, ex("object"))})), max_size=1)
    )
    more = draw(st.sampled_from([frozenset(), NEW, frozenset({NO_LEEK})]))
    return frozenset(facts | more)


def merged(base: Facts, ours: Facts, theirs: Facts, domain: Domain) -> tuple[Facts, Facts]:
    """The merge where whoever says that there is no such thing is right, else the first by the
    alphabet, whichever side that is; and what was given up for it."""
    merge = Merge(base, ours, theirs)
    facts, disputed = merge.facts, Facts()
    for conflict in conflicts(merge, domain):
        sides = {"ours": conflict.ours, "theirs": conflict.theirs}
        there = {side: any(p == RDF.type for _, p, _ in facts) for side, facts in sides.items()}
        stands = min(sides, key=lambda s: (there[s], sorted(sides[s])))
        facts = conflict.settled(facts, stands)  # type: ignore[arg-type]
        disputed |= conflict.ours | conflict.theirs
    return facts, disputed


@examples(150)
@given(st.lists(learned(), min_size=2, max_size=3))
def test_what_neither_has_retracted_stays_and_either_side_gives_the_same(
    domain: Domain, each: list[Facts]
) -> None:
    ours, theirs = each[:2]
    facts, disputed = merged(BASE, ours, theirs, domain)
    assert facts == merged(BASE, theirs, ours, domain)[0]
    retracted = (BASE - ours) | (BASE - theirs)
    assert (ours | theirs) - retracted - disputed <= facts
    assert facts <= ours | theirs
    assert not (retracted - disputed) & facts
    assert merged(BASE, facts, ours, domain)[0] == facts or disputed
    assert Merge(BASE, ours, BASE).facts == Merge(BASE, ours, ours).facts == ours


@examples(150)
@given(st.lists(learned(), min_size=3, max_size=3))
def test_any_order_of_merging_gives_the_same_graph(domain: Domain, each: list[Facts]) -> None:
    """Each of three brings what they know to one place, where the others have been before."""
    ends = set()
    for order in permutations(each):
        hub = BASE
        for mine in order:
            hub, _ = merged(BASE, mine, hub, domain)
        ends.add(hub)
    assert len(ends) == 1


def test_a_conflict_is_one_question_that_tells_both_answers_and_who_gave_them() -> None:
    kg = KITCHEN
    ours, theirs = (BASE - {(EGG, AT, ex("fridge"))} | {(EGG, AT, ex(p))} for p in ("table", "pan"))
    [one] = conflicts(Merge(BASE, ours, theirs), kg.domain)
    asked = question(one, kg, ("ann, 2026-01-02", "bob, 2026-01-03"))
    assert (asked.text, asked.prop) == ('Where is "egg" kept?', "obj_location")
    told = [(c.value, c.then) for c in asked.choices[:2]]
    assert told == [("table", "here, ann, 2026-01-02"), ("pan", "there, bob, 2026-01-03")]
    assert [side_of(Answer(v), asked) for v in ("pan", "table", "later")] == [
        "theirs",
        "ours",
        None,
    ]
    assert (EGG, AT, ex("pan")) in one.settled(Merge(BASE, ours, theirs).facts, "theirs")


@pytest.mark.parametrize(
    ("ours", "theirs", "prop"),
    [
        (NEW, frozenset({NO_LEEK}), None),
        (frozenset({(EGG, LIQUID, TRUE)}), frozenset({(EGG, SLICEABLE, TRUE)}), SLICEABLE),
    ],
    ids=["there and absent", "liquid and sliceable"],
)
def test_what_excludes_each_other_by_the_pack_is_a_conflict(
    domain: Domain, ours: Facts, theirs: Facts, prop: object
) -> None:
    for a, b in ((ours, theirs), (theirs, ours)):
        [found] = conflicts(Merge(BASE, BASE | a, BASE | b), domain)
        assert found.prop == prop
        assert a <= found.settled(BASE | a | b, "ours")
        assert not b & found.settled(BASE | a | b, "ours")


def test_a_thing_that_one_has_retracted_and_the_other_has_moved_is_a_conflict(
    domain: Domain,
) -> None:
    gone = frozenset(t for t in BASE if EGG not in t)
    moved = BASE - {(EGG, AT, ex("fridge"))} | {(EGG, AT, ex("table"))}
    merge = Merge(BASE, gone, moved)
    [found] = conflicts(merge, domain)
    assert (found.about, found.prop) == (EGG, None)
    assert found.settled(merge.facts, "ours") == gone
    assert found.settled(merge.facts, "theirs") == moved
    assert conflicts(Merge(BASE, gone, BASE), domain) == []
