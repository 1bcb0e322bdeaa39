"""The simulated person: the truth, errors, and what answering takes."""

import pytest

from adaptbot_cli.adapters.simulated_person import KEY, THINK, SimulatedHuman
from adaptbot_cli.core.ask.questions import ABSENT, EXISTS, Choice, Names, Question, yes_no
from tests.worlds import workshop

HUMAN = SimulatedHuman(workshop(attributes="\nw:board <urn:adaptbot:alias> 'slab' .\n"))
KINDS = (Choice("tool", "tool"), Choice("part", "part"), Choice("furniture", "furniture"))
PLACES = (Choice("bench", "bench"), Choice("cupboard", "cupboard"), Choice("unknown", "?"))


@pytest.mark.parametrize(
    ("question", "answer"),
    [
        (Question("existence", "board", "?"), EXISTS),
        (Question("existence", "boards", "?"), EXISTS),
        (Question("existence", "slab", "?", known=Names(("board",))), "is board"),
        (Question("existence", "peg", "?", known=Names(("board",))), ABSENT),
        (Question("existence", "bore", "?", subject="action"), "is drill_hole"),
        (Question("existence", "weld", "?", subject="action"), ABSENT),
        (Question("kind", "drill", "?", choices=KINDS), "tool"),
        (Question("kind", "drill", "?", choices=KINDS[1:]), "unknown"),
        (Question("attribute", "board", "?", "drillable", choices=yes_no()), "yes"),
        (Question("attribute", "vase", "?", "drillable", choices=yes_no()), "no"),
        (Question("attribute", "plank", "?", "drillable", choices=yes_no()), "unknown"),
        (Question("place", "board", "?", "in", choices=PLACES), "cupboard"),
        (Question("place", "board", "?", "in", choices=PLACES[:1]), "unknown"),
        (Question("value", "board", "?"), "later"),
        (Question("value", "board", "Add steps?", choices=yes_no()), "yes"),
    ],
)
def test_the_truth(question: Question, answer: str) -> None:
    assert HUMAN.ask(question).value == answer


@pytest.mark.parametrize(
    ("question", "never"),
    [
        (Question("existence", "board", "?"), EXISTS),
        (Question("existence", "peg", "?"), ABSENT),
        (Question("attribute", "board", "?", "drillable", choices=yes_no()), "yes"),
        (Question("place", "board", "?", "in", choices=PLACES), "cupboard"),
        (Question("kind", "drill", "?", choices=KINDS), "tool"),
    ],
)
def test_always_wrong(question: Question, never: str) -> None:
    wrong = SimulatedHuman(HUMAN.truth, error=1.0)
    said = wrong.ask(question).value
    assert said not in (never, "later")
    assert SimulatedHuman(HUMAN.truth, error=1.0).ask(question).value == said


def test_errors_come_as_often_as_asked_for() -> None:
    question = Question("attribute", "board", "?", "drillable", choices=yes_no())
    people = (SimulatedHuman(HUMAN.truth, 0.1, str(seed)) for seed in range(2000))
    wrong = sum(person.ask(question).value == "no" for person in people)
    assert 150 < wrong < 250


def test_what_answering_takes() -> None:
    person = SimulatedHuman(HUMAN.truth)
    person.ask(Question("attribute", "board", "one two three", "drillable", choices=yes_no()))
    assert person.seconds == pytest.approx(3 * 60 / 238 + THINK + KEY)
    person.ask(Question("attribute", "board", "", "drillable", choices=yes_no()))
    assert (person.prompts, person.about) == (2, ["board"]), "one matter, two prompts"
    person.ask(
        Question("existence", "slab", "", known=Names(("board",)), choices=(Choice("is", "is"),))
    )
    assert (person.prompts, person.about) == (4, ["board", "slab"]), "the name is picked as well"
    assert person.review(()) is True and person.prompts == 5


def test_what_is_left_open_costs_nothing() -> None:
    person = SimulatedHuman(HUMAN.truth)
    person.ask(Question("value", "board", "How long?"))
    assert (person.prompts, person.seconds, person.about) == (0, 0, [])
