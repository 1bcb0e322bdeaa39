"""The index of names: what it finds for a spelling, a word, a slip."""

from pathlib import Path

import pytest

from adaptbot_cli.core.graph.index import BASE, FOLDED, WITHOUT_S, WORD, NameIndex
from adaptbot_cli.core.names import nearest

WORDS = [f"{a}{b}" for a in ("cup", "span", "tow", "mar", "lin") for b in ("", "ner", "el", "ker")]


def index_of(*names: str, place: str = ":memory:") -> NameIndex:
    found = NameIndex(place)
    found.add((name, name) for name in names)
    return found


@pytest.mark.parametrize(
    ("form", "key", "expected"),
    [
        (FOLDED, "greentea", ["Green Tea", "green_tea"]),
        (WITHOUT_S, "green tea", ["Green Tea", "green_tea", "greens_teas"]),
        (WORD, "green", ["Green Tea", "green_tea"]),
        (BASE, "cup", ["cup", "cup_1", "cup_2"]),
        (WORD, "2", []),
        (WORD, "nothing", []),
    ],
)
def test_things_are_found_by_a_key_of_their_names(form: int, key: str, expected: list[str]) -> None:
    known = index_of("green_tea", "Green Tea", "greens_teas", "cup_2", "cup_1", "cup")
    assert known.things(form, key) == expected


def test_names_worth_comparing_come_with_the_most_shared_pairs_first() -> None:
    known = index_of("onion", "union jack", "salt", "green onion")
    assert known.alike("onoin", 2) == ["onion", "green onion"]
    assert "salt" not in known.alike("onion", 9)
    assert known.alike("", 9) == []


def test_of_many_names_the_nearest_are_the_same_as_by_comparing_all() -> None:
    names = [f"{first}_{second}" for first in ("red", "big", "old", "wet") for second in WORDS]
    known = index_of(*names)
    for wanted in ("red_spaner", "oldcup", "wett_towel"):
        assert nearest(wanted, known.alike(wanted, 100)) == nearest(wanted, names)


def test_things_that_a_number_tells_apart() -> None:
    known = index_of("cup_1", "cup_2", "cup", "cup 22")
    assert known.things(BASE, "cup", "2") == ["cup_2"]
    assert known.things(BASE, "cup", "") == ["cup"]
    assert known.alike("cupp_22", 2) == ["cup 22", "cup"]
    assert known.bases() == ["cup"]


def test_an_index_in_a_file_is_there_the_next_time(tmp_path: Path) -> None:
    place = str(tmp_path / "names")
    index_of("onion", place=place)
    again = index_of("onion", "leek", place=place)
    assert again.things(WORD, "onion") == ["onion"]
    assert again.things(WORD, "leek") == ["leek"]
