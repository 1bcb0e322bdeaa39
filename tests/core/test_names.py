"""Names as people and models write them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adaptbot_cli.core.names import (
    nearest,
    normal,
    sentence_list,
    singulars,
    variants,
    words,
)

NAMES = st.text(alphabet=st.characters(codec="utf-8"), max_size=40)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("Cutting-Board ", "cutting_board"),
        ("cutting  board", "cutting_board"),
        ("__cutting__board__", "cutting_board"),
        ("O\u2019Brien's", "o'brien's"),
        ("", ""),
        ("-", ""),
    ],
)
def test_the_normal_form(written: str, expected: str) -> None:
    assert normal(written) == expected


@given(NAMES)
def test_the_normal_form_is_its_own_normal_form(name: str) -> None:
    assert normal(normal(name)) == normal(name)


@pytest.mark.parametrize(
    ("plural", "singular"),
    [
        ("eggs", "egg"),
        ("tomatoes", "tomato"),
        ("berries", "berry"),
        ("knives", "knife"),
        ("leaves", "leaf"),
        ("shelves", "shelf"),
        ("boxes", "box"),
        ("dishes", "dish"),
        ("plates", "plate"),
        ("cutting_boards", "cutting_board"),
    ],
)
def test_a_plural_may_be_its_singular(plural: str, singular: str) -> None:
    assert singular in variants(plural)


@pytest.mark.parametrize("word", ["glass", "gas", "press", "is", "s", ""])
def test_what_is_no_plural_has_no_singular(word: str) -> None:
    assert singulars(word) == ()


@given(NAMES)
def test_a_name_is_the_first_of_its_variants_and_none_is_there_twice(name: str) -> None:
    forms = variants(name)
    assert forms[0] == name
    assert len(forms) == len(set(forms))
    assert normal(name) in forms


def test_a_singular_is_a_variant_of_a_known_plural() -> None:
    assert "scissors" in variants("scissor")


def test_words_are_the_parts_of_a_name() -> None:
    assert words("Sliced-red_onion, the O'Brien") == ("sliced", "red", "onion", "the", "o'brien")


def test_the_nearest_share_a_word_or_are_spelt_alike() -> None:
    known = ["red_onion", "onion", "union", "spoon", "zebra"]
    assert nearest("red_onions", known)[0] == "red_onion"
    assert nearest("onoin", known) == ["onion"]
    assert nearest("onions", known)[:2] == ["onion", "union"]
    assert nearest("qqqq", known) == []


def test_the_nearest_are_the_same_whatever_the_order() -> None:
    known = ["cup_a", "cup_b", "cup_c"]
    assert nearest("cup", known) == nearest("cup", reversed(known)) == known


def test_the_nearest_are_few() -> None:
    assert len(nearest("cup", [f"cup_{n}" for n in range(20)])) == 5


@given(NAMES, st.lists(NAMES, max_size=6))
def test_the_nearest_are_among_the_known(name: str, known: list[str]) -> None:
    assert set(nearest(name, known)) <= set(known)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        ([], ""),
        (["a"], "a"),
        (["a", "b"], "a and b"),
        (["a", "b", "c"], "a, b and c"),
        (["a", "b", "c", "d", "e", "f"], "a, b, c, d and 2 more"),
    ],
)
def test_a_list_in_a_sentence(names: list[str], expected: str) -> None:
    assert sentence_list(names) == expected
