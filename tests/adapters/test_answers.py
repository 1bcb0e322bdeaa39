"""Answers from a file: understood as people write them, refused where they cannot be meant."""

from pathlib import Path

import pytest

from adaptbot_cli.adapters.answers import AnswersHuman, read_answers
from adaptbot_cli.core.ask.questions import LATER, Choice, Names, Question, yes_no
from adaptbot_cli.errors import UsageError

WAYS = (Choice("is", ""), Choice("absent", ""), Choice("exists", ""), Choice("later", ""))
EXISTENCE = Question(
    "existence",
    "chives",
    "?",
    choices=WAYS,
    known=Names(
        (
            "onion",
            "cutting_board",
        )
    ),
)
KIND = Question("kind", "chives", "?", choices=(Choice("object", ""), Choice("mreceptacle", "")))
PLACES = (Choice("fridge", ""), Choice("kitchen_counter", ""), Choice("unknown", ""))
PLACE = Question("place", "chives", "?", "obj_location", choices=PLACES)
SLICED = Question("attribute", "chives", "?", "IsSliceable", choices=yes_no())


def answer(text: str, question: Question, tmp_path: Path) -> str:
    path = tmp_path / "a.yaml"
    path.write_text(f"chives: {{{text}}}\n", encoding="utf-8")
    human = AnswersHuman(read_answers(path), "ada", str(path))
    return human.ask(question).value


@pytest.mark.parametrize(
    ("text", "question", "meant"),
    [
        ("existence: exists", EXISTENCE, "exists"),
        ("existence: yes", EXISTENCE, "exists"),
        ("existence: true", EXISTENCE, "exists"),
        ('existence: "Yes"', EXISTENCE, "exists"),
        ("existence: no", EXISTENCE, "absent"),
        ("existence: false", EXISTENCE, "absent"),
        ("existence: later", EXISTENCE, "later"),
        ("existence: is onion", EXISTENCE, "is onion"),
        ("existence: is Cutting Board", EXISTENCE, "is cutting_board"),
        ("existence:", EXISTENCE, "later"),
        ("kind: mreceptacle", KIND, "mreceptacle"),
        ("kind: later", KIND, "later"),
        ("obj_location: Kitchen counter", PLACE, "kitchen_counter"),
        ("place: fridge", PLACE, "fridge"),
        ("place: unknown", PLACE, "unknown"),
        ("IsSliceable: yes", SLICED, "yes"),
        ("attribute: false", SLICED, "no"),
        ("existence: exists", SLICED, "later"),
    ],
)
def test_an_answer_is_understood(text: str, question: Question, meant: str, tmp_path: Path) -> None:
    assert answer(text, question, tmp_path) == meant


@pytest.mark.parametrize(
    ("text", "question", "said"),
    [
        ("existence: maybe", EXISTENCE, '"maybe" is no answer for existence; there is absent, exi'),
        ("existence: is", EXISTENCE, "or is NAME with a known name, such as onion, cutting_board"),
        ("existence: is garlic", EXISTENCE, '"is garlic" is no answer for existence'),
        ("existence: [yes]", EXISTENCE, "is no answer for existence"),
        ("existence: unknown", EXISTENCE, '"unknown" is no answer for existence'),
        ("kind: plant", KIND, '"plant" is no answer for kind; there is object, mreceptacle, '),
        ("existence: exists", KIND, "exists, but its kind is not told; it can be object, mrec"),
        ("obj_location: moon", PLACE, '"moon" is no answer for obj_location; there is fridge, '),
        ("IsSliceable: 3", SLICED, '"3" is no answer for IsSliceable; there is yes, no, unknown'),
    ],
)
def test_what_cannot_be_meant_is_refused_with_the_choices(
    text: str, question: Question, said: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError) as caught:
        answer(text, question, tmp_path)
    assert str(caught.value).startswith(f"{tmp_path / 'a.yaml'}: chives: ")
    assert said in str(caught.value)


def test_a_subject_that_the_file_does_not_have_stays_open() -> None:
    assert AnswersHuman({}, "ada").ask(KIND) == LATER


def test_a_new_place_and_a_number_are_taken_if_they_can_be_meant(tmp_path: Path) -> None:
    length = Question("value", "chives", "?", "length", number="number")
    onion = Question(
        "place", "chives", "?", "obj_location", choices=PLACES, known=Names(("onion",))
    )
    assert answer("obj_location: new Wine Rack", PLACE, tmp_path) == "new wine_rack"
    assert answer("length: 2.5", length, tmp_path) == "2.5"
    for text, question in (("length: two", length), ("obj_location: new onion", onion)):
        with pytest.raises(UsageError):
            answer(text, question, tmp_path)


def test_what_was_not_asked_for_is_named_with_what_it_may_have_meant() -> None:
    told = {"chivs": {"existence": "absent"}, "chives": {"IsSlicable": "yes", "kind": "object"}}
    human = AnswersHuman(told, "ada", "a.yaml")
    human.ask(KIND)
    human.offer((SLICED,))
    assert human.unused() == [
        "a.yaml: chivs was not asked for; asked for was chives",
        "a.yaml: chives, IsSlicable was not asked for; asked for was IsSliceable",
    ]
