"""Words that are put in for others: right where it is done unasked, and worth having at all."""

import pytest

from adaptbot_cli.adapters.lexicon import NoLexicon, WordNet
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.session.replay import check
from tests import packs
from tests.bench.names import meant, measured

KITCHEN, HOUSEHOLD = packs.KITCHEN.kg(), packs.HOUSEHOLD.kg()
WORDS = WordNet()


def test_what_is_put_in_unasked_is_right() -> None:
    count, told = measured(WORDS)
    assert count["put in rightly"] >= 0.95 * count["put in"], told


def test_word_knowledge_makes_a_difference() -> None:
    with_words, without = measured(WORDS)[0], measured(NoLexicon())[0]
    assert with_words["put in rightly"] >= 2 * without["put in rightly"]


@pytest.mark.parametrize(
    ("name", "thing"),
    [
        ("refrigerator", "fridge"),
        ("Cutting Board", "cutting_board"),
        ("cuttingboard", "cutting_board"),
        ("PeanutButter", "peanut_butter"),
        ("frying pan", "pan"),
        ("caf\u00e9", ""),
        ("spin\u00e2ch", "spinach"),
    ],
)
def test_a_name_is_known_however_it_is_written(name: str, thing: str) -> None:
    assert meant(name, KITCHEN, WORDS)[0] == thing


def test_separators_make_no_difference_in_a_room() -> None:
    assert meant("livingroom", HOUSEHOLD, WORDS)[0] == "living_room"


def test_where_two_things_could_be_meant_both_are_suggested() -> None:
    taken, near = meant("counter", KITCHEN, WORDS)
    assert taken == ""
    assert {"countertop", "table"} <= set(near)


def test_the_other_sense_of_a_candidate_is_not_meant() -> None:
    taken, near = meant("chili pepper", KITCHEN, WORDS)
    assert taken == ""
    assert "pepper" in near


def looked_at(plan: str) -> Result:
    return check(plan, Task("cook"), KITCHEN)


@pytest.mark.parametrize("verb", ["saut\u00e9", "saute", "Saut\u00e9"])
def test_an_accent_makes_no_difference_in_an_action(verb: str) -> None:
    [step] = [s for s in looked_at(f'{verb}("onion")').report.steps if s.source]
    assert (step.call.action, step.status) == ("fry", "changed")


def test_nothing_is_put_in_that_the_step_could_not_be_done_with() -> None:
    [finding] = looked_at('boil("icebox lettuce")\nslice("icing")').report.findings[:1]
    assert finding.code == "E201"
