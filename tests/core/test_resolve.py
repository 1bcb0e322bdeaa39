"""From a written name to a thing or an action: each remedy, and where none may be used."""

from rdflib import URIRef

from adaptbot_cli.core.ask import learning
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Call, Task
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Related
from tests.worlds import W, related, scene, workshop

PART, TOOL, FURNITURE = URIRef(W + "part"), URIRef(W + "tool"), URIRef(W + "furniture")
ANYTHING = (PART, TOOL, FURNITURE)


def item(name: str, *classes: URIRef, at: Scene | None = None) -> resolve.Named:
    return resolve.item(name, classes or ANYTHING, at or scene())


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


def test_the_name_itself_is_no_change() -> None:
    named = item("board")
    assert (named.entity, named.change, named.finding) == (URIRef(W + "board"), None, None)


def test_case_plural_hyphen_and_space_are_normalised() -> None:
    for written in ("Board", "boards", "BOARD", " board ", "board_", "-Boards"):
        named = item(written)
        assert named.entity == URIRef(W + "board"), written
        assert named.change is not None
        assert (named.change.by, named.change.target) == ("normalisation", "board")


def test_an_amount_of_a_known_thing_is_the_thing() -> None:
    for written in ("2 boards", "a board", "a pile of boards", "3 kg of board", "board (2 m)"):
        named = item(written)
        assert named.entity == URIRef(W + "board"), written
        assert named.change is not None and named.change.by == "amount"
    the = item("the board").change
    assert the is not None and the.by == "normalisation"


def test_an_amount_takes_no_word_away_that_may_belong_to_the_name() -> None:
    for written in ("2 white boards", "a lid of the box of boards x", "edge of board", "board 2"):
        assert item(written).entity is None, written
    assert item("2 benches").entity is None, "two places are not one"
    asked = item("a pinch of chalk", at=scene(workshop(), "chalk")).finding
    assert asked is not None and (asked.code, asked.subject) == ("E201", "chalk")


def test_a_word_for_a_part_that_stands_for_the_thing() -> None:
    for written in (
        "board's surface",
        "board\u2019s surface",
        "surface of the board",
        "board surface",
    ):
        named = item(written)
        assert named.entity == URIRef(W + "board"), written
        assert named.change is not None and named.change.by == "part"
    assert item("board's edge").entity is None, "not every part stands for its thing"
    assert item("surface").entity is None


def test_a_pronoun_that_stands_for_nothing_says_so() -> None:
    finding = item("It").finding
    assert finding is not None and (finding.code, finding.candidates) == ("E201", ())
    assert (
        finding.message
        == '"It" stands for nothing: no step before names a thing that it could mean'
    )


def test_a_learned_alias_is_the_thing_and_says_so() -> None:
    named = item("slab", at=scene(with_alias("slab", "board")))
    assert named.entity == URIRef(W + "board")
    assert named.change is not None
    assert (named.change.by, named.change.evidence) == ("alias", "slab is another name for board")


def test_an_alias_is_known_in_the_plural_too() -> None:
    assert item("Slabs", at=scene(with_alias("slab", "board"))).entity == URIRef(W + "board")


def test_of_two_things_of_one_name_the_one_of_the_right_kind_is_meant() -> None:
    kg = workshop(attributes='w:drill_part a w:part ; w:called "drill" .')
    assert item("drill", PART, at=scene(kg)).entity == URIRef(W + "drill_part")
    assert item("drill", TOOL, at=scene(kg)).entity == URIRef(W + "drill")


def test_a_word_for_several_items_is_reported() -> None:
    finding = item("everything").finding
    assert finding is not None
    assert finding.code == "E204"


def test_a_phrase_that_ends_at_a_place_is_that_place() -> None:
    named = item("vase on the bench", FURNITURE)
    assert named.entity == URIRef(W + "bench")
    assert named.change is not None
    assert named.change.by == "place of the phrase"


def test_the_last_place_of_a_phrase_counts() -> None:
    assert item("vase_in_cupboard_on_bench", FURNITURE).entity == URIRef(W + "bench")


def test_a_place_phrase_is_no_part() -> None:
    assert item("vase on bench", PART).entity != URIRef(W + "bench")


def test_a_state_word_means_the_thing_which_must_then_be_so() -> None:
    for written in ("drilled_board", "board_drilled", "the bored board", "drilled boards"):
        named = item(written, PART)
        assert named.entity == URIRef(W + "board"), written
        assert named.states == (URIRef(W + "drilled"),)
        assert named.change is not None
        assert named.change.by == "state"


def test_a_state_word_of_another_kind_of_thing_means_nothing() -> None:
    assert item("drilled_bench").entity is None


def test_a_state_word_alone_is_no_thing() -> None:
    assert item("drilled").entity is None


def test_a_product_of_the_plan_is_reported_as_such() -> None:
    finding = item("assembly").finding
    assert finding is not None
    assert finding.code == "E203"


def test_the_name_of_the_task_is_a_product() -> None:
    at = Scene(workshop(), Task("build a stool"))
    finding = item("stool", at=at).finding
    assert finding is not None
    assert finding.code == "E203"


def test_a_required_item_is_no_product() -> None:
    finding = item("assembly", at=scene(workshop(), "assembly")).finding
    assert finding is not None
    assert finding.code == "E201"


def test_a_synonym_that_names_one_thing_of_the_kind_is_taken() -> None:
    named = by_words("lumber", related("board", "synonym"))
    assert named.entity == URIRef(W + "board")
    assert named.change is not None
    assert named.change.by == "synonym"
    assert named.change.evidence == "WordNet: lumber means the same as board"


def test_a_broader_word_is_taken_one_edge_away_only() -> None:
    assert by_words("lumber", related("board", "hypernym", 1)).entity == URIRef(W + "board")
    assert by_words("lumber", related("board", "hypernym", 2)).entity is None


def test_one_of_few_narrower_words_is_meant_one_of_many_suggested() -> None:
    assert by_words("lumber", related("board", "hyponym", 1)).entity == URIRef(W + "board")
    others = (Related(w, "hyponym", 1, 1, "noun.artifact", w) for w in ("beam", "stave", "lath"))
    named = by_words("lumber", related("board", "hyponym", 1), *others)
    assert named.entity is None
    assert named.finding is not None and named.finding.candidates == ("board",)


def test_the_nearest_word_wins() -> None:
    words = (related("plank", "hypernym", 2), related("board", "hypernym", 1))
    assert by_words("lumber", *words).entity == URIRef(W + "board")


def test_only_the_words_own_first_sense_counts() -> None:
    first, second = related("anchor", "synonym", sense=1), related("board", "synonym", sense=2)
    assert by_words("lumber", first, second).entity is None
    assert by_words("lumber", second).entity is None


def test_two_names_never_become_one_thing() -> None:
    words = {"lumber": (related("board", "synonym"),), "timber": (related("board", "synonym"),)}
    looked = scene()
    looked.known.update(words)
    parts = [URIRef(W + "part")]
    assert resolve.item("lumber", parts, looked).entity == URIRef(W + "board")
    assert resolve.item("timber", parts, looked).entity is None


def test_two_candidates_are_a_suggestion() -> None:
    named = by_words("lumber", related("board", "synonym"), related("plank", "synonym"))
    assert named.entity is None
    assert named.finding is not None
    assert named.finding.candidates[:2] == ("board", "plank")


def test_two_words_for_one_thing_are_one_candidate() -> None:
    named = by_words("lumber", related("board", "synonym"), related("boards", "synonym"))
    assert named.entity == URIRef(W + "board")


def test_a_required_item_is_never_replaced_by_words() -> None:
    named = by_words("lumber", related("board", "synonym"), required="lumber")
    assert named.entity is None
    assert named.finding is not None
    assert named.finding.candidates[0] == "board"


def test_a_thing_of_the_wrong_kind_is_never_taken() -> None:
    named = by_words("lumber", related("bench", "synonym"))
    assert named.entity is None
    assert named.finding is not None
    assert "bench" not in named.finding.candidates


def test_a_thing_that_the_plan_uses_otherwise_is_a_suggestion() -> None:
    named = by_words("lumber", related("board", "synonym"), used="board")
    assert named.entity is None
    assert named.finding is not None
    assert named.finding.candidates[0] == "board"


def test_a_replacement_that_the_person_has_seen_stays_when_both_names_are_used() -> None:
    at = scene(lumber=(related("board", "synonym"),))
    at.agreed.add("lumber")
    at.notice([Call("take", ("lumber", "board"))])
    assert item("lumber", PART, at=at).entity == URIRef(W + "board")


def test_a_name_that_a_person_said_is_not_here_is_not_replaced() -> None:
    at = scene(without("lumber", "item"), lumber=(related("board", "synonym"),))
    finding = item("lumber", PART, at=at).finding
    assert finding is not None
    assert "as a person has said" in finding.message


def test_an_unknown_name_says_what_is_near_it() -> None:
    finding = item("drilll", TOOL).finding
    assert finding is not None
    assert finding.candidates == ("drill",)
    assert finding.message == "drilll is not in the knowledge graph; near it: drill"


def test_the_remedies_are_tried_in_order() -> None:
    # "drilled_board" is first a thing of that name, then an alias, then the board in a state.
    kg = workshop(attributes='w:panel a w:part ; w:called "drilled_board" .')
    assert item("drilled_board", PART, at=scene(kg)).entity == URIRef(W + "panel")
    kg = with_alias("drilled_board", "plank")
    assert item("drilled_board", PART, at=scene(kg)).entity == URIRef(W + "plank")
    at = scene(workshop(), drilled_board=(related("vase", "synonym"),))
    assert item("drilled_board", PART, at=at).entity == URIRef(W + "board")


def action(name: str, at: Scene | None = None) -> tuple[str, str]:
    """The action that a name means, and by which remedy."""
    named = resolve.action(name, at or scene())
    return (
        named.action.name if named.action else "",
        named.change.by if named.change else "",
    )


def test_separators_make_no_difference_to_an_action() -> None:
    assert action("drillhole") == ("drill_hole", "normalisation")
    assert action("DrillHole") == ("drill_hole", "normalisation")
    assert action("turnoff") == ("switch", "alias")
    finding = resolve.action("drillinto", scene()).finding
    assert finding is not None and "drill_hole" in finding.candidates


def test_an_action_by_its_name_in_any_case() -> None:
    assert action("wait") == ("wait", "")
    assert action("Drill-Hole") == ("drill_hole", "")


def test_an_action_by_an_alias_of_the_domain() -> None:
    assert action("bore") == ("drill_hole", "alias")


def test_an_alias_may_have_an_ending_that_actions_have() -> None:
    # take_part and drill_hole end in what they are done to; bore_hole is bore.
    assert action("bore_hole") == ("drill_hole", "alias")
    assert action("bore_tunnel") == ("", "")


def test_an_action_by_an_alias_that_a_person_taught() -> None:
    assert action("puncture", scene(with_alias("puncture", "drill_hole"))) == (
        "drill_hole",
        "alias",
    )


def test_a_name_that_also_fixes_an_argument() -> None:
    named = resolve.action("turn_off", scene())
    assert named.action is not None
    assert (named.action.name, [f.parameter for f in named.fixed]) == ("switch", ["state"])


def test_an_action_by_a_synonym_of_its_verb() -> None:
    assert action("desiccate", scene(desiccate=(related("dry", "synonym"),))) == (
        "dry_part",
        "synonym",
    )


def test_an_action_stands_for_a_narrower_word_and_not_for_a_broader_one() -> None:
    # To desiccate is a way to dry; to dry is a way to change, which changing does not mean.
    assert action("desiccate", scene(desiccate=(related("dry", "hypernym", 1),)))[0] == "dry_part"
    assert action("change", scene(change=(related("dry", "hyponym", 1),)))[0] == ""


def test_two_actions_for_a_word_are_none() -> None:
    words = (related("dry", "synonym"), related("press", "synonym"))
    assert action("iron", scene(iron=words)) == ("", "")


def test_an_action_that_a_person_said_is_not_possible_is_not_replaced() -> None:
    at = scene(without("iron", "action"), iron=(related("press", "synonym"),))
    named = resolve.action("iron", at)
    assert named.action is None
    assert named.finding is not None
    assert "as a person has said" in named.finding.message


def test_an_unknown_action_says_what_is_near_it() -> None:
    finding = resolve.action("drill_holes", scene()).finding
    assert finding is not None
    assert finding.candidates[0] == "drill_hole"
