"""From a written name to a thing or an action: each remedy, and where none may be used."""

import pytest
from rdflib import URIRef

from adaptbot_cli.core.ask import learning
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Call, Finding, Task
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Related
from tests.worlds import W, related, scene, workshop

PART, TOOL, FURNITURE = URIRef(W + "part"), URIRef(W + "tool"), URIRef(W + "furniture")
ANYTHING = (PART, TOOL, FURNITURE)


def item(name: str, *classes: URIRef, at: Scene | None = None) -> resolve.Named:
    return resolve.item(name, classes or ANYTHING, at or scene())


def meant(named: resolve.Named | resolve.NamedAction) -> tuple[str, str]:
    """The thing or action that a name means, and by which remedy; "" for none."""
    if isinstance(named, resolve.NamedAction):
        what = named.action.name if named.action else ""
    else:
        what = named.entity.removeprefix(W) if named.entity else ""
    return what, named.change.by if named.change else ""


def found(named: resolve.Named | resolve.NamedAction) -> Finding:
    """What is found where a name means nothing."""
    assert meant(named) == ("", "") and named.finding is not None
    return named.finding


def with_alias(name: str, thing: str) -> Kg:
    kg = workshop()
    kg.learn(learning.alias(name, URIRef(W + thing)))
    return kg


def without(name: str, subject: str) -> Kg:
    kg = workshop()
    kg.learn(learning.absence(kg.domain, name, subject))
    return kg


def by_words(name: str, *words: Related, required: str = "", used: str = "") -> resolve.Named:
    at = scene(workshop(), *([required] if required else []), **{name: words})
    at.notice([Call("take", tuple(part for part in (name, used) if part))])
    return item(name, PART, at=at)


WRITTEN = {
    ("board", ""): ("board",),
    ("board", "normalisation"): (
        *("Board", "boards", "BOARD", " board ", "board_", "-Boards", "the board"),
    ),
    ("board", "amount"): (
        *("2 boards", "a board", "a pile of boards", "3 kg of board", "board (2 m)"),
    ),
    ("board", "part"): (
        *("board's surface", "board\u2019s surface", "surface of the board", "board surface"),
    ),
    ("board", "state"): ("drilled_board", "board_drilled", "the bored board", "drilled boards"),
    # What may belong to the name is not taken away; two places are not one; not every part
    # stands for its thing; a state word of another kind of thing, or alone, means nothing.
    ("", ""): (
        *("2 white boards", "a lid of the box of boards x", "edge of board", "board 2"),
        *("2 benches", "board's edge", "surface", "drilled_bench", "drilled"),
    ),
}


@pytest.mark.parametrize(
    ("written", "thing", "by"), [(w, *said) for said, each in WRITTEN.items() for w in each]
)
def test_a_name_is_read_however_it_is_written(written: str, thing: str, by: str) -> None:
    named = item(written)
    assert meant(named) == (thing, by)
    assert named.states == ((URIRef(W + "drilled"),) if by == "state" else ())
    assert named.change is None or named.change.target == "board"


@pytest.mark.parametrize(
    ("name", "code"),
    [("It", "E201"), ("everything", "E204"), ("assembly", "E203"), ("drilll", "E201")],
)
def test_what_a_name_that_means_nothing_is(name: str, code: str) -> None:
    assert found(item(name)).code == code


def test_what_is_said_of_a_name_that_means_nothing() -> None:
    it = found(item("It"))
    assert it.candidates == ()
    assert it.message == '"It" stands for nothing: no step before names a thing that it could mean'
    near = found(item("drilll", TOOL))
    assert near.candidates == ("drill",)
    assert near.message == "drilll is not in the knowledge graph; near it: drill"
    assert found(item("a pinch of chalk", at=scene(workshop(), "chalk"))).subject == "chalk"


def test_a_learned_alias_is_the_thing_and_says_so() -> None:
    at = scene(with_alias("slab", "board"))
    named = item("slab", at=at)
    assert meant(named) == ("board", "alias") and named.change is not None
    assert named.change.evidence == "slab is another name for board"
    assert item("Slabs", at=at).entity == named.entity


def test_of_two_things_of_one_name_the_one_of_the_right_kind_is_meant() -> None:
    at = scene(workshop(attributes='w:drill_part a w:part ; w:called "drill" .'))
    assert meant(item("drill", PART, at=at))[0] == "drill_part"
    assert meant(item("drill", TOOL, at=at))[0] == "drill"


def test_a_phrase_that_ends_at_a_place_is_that_place_and_no_part() -> None:
    for phrase in ("vase on the bench", "vase_in_cupboard_on_bench"):  # the last place counts
        assert meant(item(phrase, FURNITURE)) == ("bench", "place of the phrase")
        assert meant(item(phrase, PART))[0] != "bench"


def test_the_name_of_the_task_is_a_product_and_a_required_item_is_none() -> None:
    assert found(item("stool", at=Scene(workshop(), Task("build a stool")))).code == "E203"
    assert found(item("assembly", at=scene(workshop(), "assembly"))).code == "E201"


SYNONYM = related("board", "synonym")
OTHERS = [Related(w, "hyponym", 1, 1, "noun.artifact", w) for w in ("beam", "stave", "lath")]


@pytest.mark.parametrize(
    ("words", "thing"),
    [
        ([SYNONYM], "board"),
        ([related("stave", "synonym"), SYNONYM], "board"),
        ([related("board", "hypernym", 1)], "board"),
        ([related("board", "hypernym", 2)], ""),
        ([related("board", "hyponym", 1)], "board"),
        ([related("board", "hyponym", 1), *OTHERS], ""),
        ([related("plank", "hypernym", 2), related("board", "hypernym", 1)], "board"),
        ([related("anchor", "synonym"), related("board", "synonym", sense=2)], ""),
        ([related("board", "synonym", sense=2)], ""),
        ([SYNONYM, related("plank", "synonym", sense=2)], "board"),
        ([SYNONYM, related("boards", "synonym")], "board"),
        ([SYNONYM, related("plank", "synonym")], ""),
        ([related("bench", "synonym")], ""),
    ],
)
def test_the_nearest_word_for_one_thing_of_the_kind_is_taken(
    words: list[Related], thing: str
) -> None:
    """One edge away, in the word's first sense, and of one among few narrower words."""
    assert meant(by_words("lumber", *words))[0] == thing


def test_a_word_that_is_taken_comes_with_its_evidence_and_others_are_suggested() -> None:
    named = by_words("lumber", SYNONYM)
    assert named.change is not None
    assert named.change.by == "synonym"
    assert named.change.evidence == "WordNet: lumber means the same as board"
    for near, *given in (
        (("board",), related("board", "hyponym", 1), *OTHERS),
        (("board", "plank"), SYNONYM, related("plank", "synonym")),
    ):
        assert found(by_words("lumber", *given)).candidates[: len(near)] == near
    assert "bench" not in found(by_words("lumber", related("bench", "synonym"))).candidates


def test_two_names_never_become_one_thing() -> None:
    looked = scene(lumber=(SYNONYM,), timber=(SYNONYM,))
    assert meant(item("lumber", PART, at=looked))[0] == "board"
    assert meant(item("timber", PART, at=looked))[0] == ""


def test_what_is_required_or_used_otherwise_is_a_suggestion_unless_the_person_has_seen_it() -> None:
    assert found(by_words("lumber", SYNONYM, required="lumber")).candidates[0] == "board"
    assert found(by_words("lumber", SYNONYM, used="board")).candidates[0] == "board"
    at = scene(lumber=(SYNONYM,))
    at.agreed.add("lumber")
    at.notice([Call("take", ("lumber", "board"))])
    assert meant(item("lumber", PART, at=at))[0] == "board"


def test_what_a_person_said_is_not_here_is_not_replaced() -> None:
    at = scene(without("lumber", "item"), lumber=(SYNONYM,))
    assert "as a person has said" in found(item("lumber", PART, at=at)).message
    at = scene(without("iron", "action"), iron=(related("press", "synonym"),))
    assert "as a person has said" in found(resolve.action("iron", at)).message


def test_the_remedies_are_tried_in_order() -> None:
    # "drilled_board" is first a thing of that name, then an alias, then the board in a state.
    for thing, at in (
        ("panel", scene(workshop(attributes='w:panel a w:part ; w:called "drilled_board" .'))),
        ("plank", scene(with_alias("drilled_board", "plank"))),
        ("board", scene(workshop(), drilled_board=(related("vase", "synonym"),))),
    ):
        assert meant(item("drilled_board", PART, at=at))[0] == thing


@pytest.mark.parametrize(
    ("name", "words", "action", "by"),
    [
        ("wait", [], "wait", ""),
        ("Drill-Hole", [], "drill_hole", ""),
        ("drillhole", [], "drill_hole", "normalisation"),
        ("DrillHole", [], "drill_hole", "normalisation"),
        ("turnoff", [], "switch", "alias"),
        ("bore", [], "drill_hole", "alias"),
        # An alias may have an ending that actions have: drill_hole ends in what it is done to.
        ("bore_hole", [], "drill_hole", "alias"),
        ("bore_tunnel", [], "", ""),
        ("desiccate", [related("dry", "synonym")], "dry_part", "synonym"),
        # To desiccate is a way to dry; to dry is a way to change, which changing does not mean.
        ("desiccate", [related("dry", "hypernym", 1)], "dry_part", "hypernym"),
        ("change", [related("dry", "hyponym", 1)], "", ""),
        ("iron", [related("dry", "synonym"), related("press", "synonym")], "", ""),
    ],
)
def test_an_action_by_its_name_an_alias_or_its_verb(
    name: str, words: list[Related], action: str, by: str
) -> None:
    assert meant(resolve.action(name, scene(**{name: tuple(words)}))) == (action, by)


def test_an_action_by_an_alias_that_a_person_taught() -> None:
    at = scene(with_alias("puncture", "drill_hole"))
    assert meant(resolve.action("puncture", at)) == ("drill_hole", "alias")


def test_a_name_that_also_fixes_an_argument() -> None:
    named = resolve.action("turn_off", scene())
    assert meant(named)[0] == "switch" and [f.parameter for f in named.fixed] == ["state"]


def test_an_unknown_action_says_what_is_near_it() -> None:
    assert found(resolve.action("drill_holes", scene())).candidates[0] == "drill_hole"
    assert "drill_hole" in found(resolve.action("drillinto", scene())).candidates
