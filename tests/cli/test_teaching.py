"""An action taught, and a plan changed by hand, in a real terminal of 80 columns."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

from tests.cli.attended import CTRL_U, ENTER, Tty, tty
from tests.cli.command import Home
from tests.loopback import Loopback, scripted

SNACK = "make a snack"
HOW = 'I do not know how to "{}"'
KEEP = ("Keep this?", ENTER)
NOT_AGAIN = ("Shall I keep this plan", "n")


@contextmanager
def snack(home: Home, plans: Sequence[str], *more: str) -> Iterator[tuple[Tty, Loopback]]:
    """Ask a model that has some plans for a task that is not listed, and confirm it."""
    with (
        scripted(*plans) as model,
        tty(home, "run", SNACK, *more, **model.environment()) as opened,
    ):
        opened.answers(("Do you mean this", "y"))
        yield opened, model


def runs(opened: Tty) -> bool:
    """Tell whether it ended with a plan that can be executed, for a task that has no goal."""
    return opened.ends() == 3 and "executable; no goal is known for this task" in opened.said


def plan(*lines: str) -> str:
    return "\n".join(lines)


def edits(home: Home) -> list[tuple[str, Any]]:
    return [(t["edit"], t.get("plan")) for t in home.documents()[1:] if t["turn"] == "edit"]


SERVED = ('put_down_obj("{}", "bowl")', 'put_down_rec("bowl", "table")')

TAUGHT = {
    "kitchen": (
        plan('peel("carrot", "knife")', *(line.format("carrot") for line in SERVED)),
        [(HOW.format("peel"), "y"), ("most like", f"slice{ENTER}"), ("Is this what", "y")],
        'peel("onion")',
    ),
    "household": (
        plan('defrost("fridge")'),
        [(HOW.format("defrost"), "y"), ("most like", f"mop{ENTER}"), ("Is this what", "y")],
        'defrost("fridge")',
    ),
}


@pytest.mark.parametrize("domain", TAUGHT)
def test_a_new_action_is_taught_kept_and_known_from_then_on(home: Home, domain: str) -> None:
    text, dialogue, again = TAUGHT[domain]
    with snack(home, [text], "--domain", domain) as (opened, _):
        opened.answers(*dialogue, KEEP)
        opened.ends()
    assert "noted: " in opened.screen and "Traceback" not in opened.screen
    trailers = home.trailers()
    assert "Is this what" in trailers["Question-1"][0] and "requires:" in trailers["Question-1"][0]
    assert any(" effect DELETE" in fact for fact in trailers["Fact-1"])
    assert home.adaptbot("domain", "check", domain).code == 0
    path = home.write("again.txt", again)
    told = home.adaptbot("check", path, "--domain", domain, "--json").json()
    assert {step["status"] for step in told["steps"]} <= {"ok", "changed", "inserted"}
    assert home.replays()


def test_a_new_action_is_put_together_from_what_it_changes_and_requires(home: Home) -> None:
    text = plan('glaze("carrot", "pan")', *(line.format("carrot") for line in SERVED))
    with snack(home, [text]) as (opened, _):
        opened.answers(
            (HOW.format("glaze"), "y"),
            ("most like", f"none of{ENTER}"),
            ("What is different", f"carrot: fried{ENTER}"),
            ("What is different", ENTER),
            ("What must hold", f"for frying{ENTER}"),
            ("What must hold", f"stove must be sw{ENTER}"),
            ("What must hold", ENTER),
            ("Is this what", "y"),
            KEEP,
        )
        assert runs(opened)
    assert "changes: carrot: fried" in opened.said
    actions = (home.workspace / "kg/kitchen/actions.ttl").read_text(encoding="utf-8")
    assert "INSERT { ?obj ex:IsFried true }" in actions
    assert 'ab:message "{stove} must be switched on"' in actions
    assert 'switch("stove", "on")' in opened.said
    assert home.replays()


def test_a_known_action_with_a_fixed_argument_is_taught(home: Home) -> None:
    text = plan('activate("stove")', *(line.format("carrot") for line in SERVED))
    with snack(home, [text]) as (opened, _):
        opened.answers(
            (HOW.format("activate"), "f"),
            ("Which of these is", f"switch{ENTER}"),
            ('Which part of "switch"', "2"),
            ('Which "state" is it', "1"),
            KEEP,
        )
        assert runs(opened)
    assert home.trailers()["Fact-1"] == [
        "+ switch calledAs switch_as_activate",
        "+ switch_as_activate alias activate",
        "+ switch_as_activate parameter state",
        "+ switch_as_activate value true",
    ]
    path = home.write("again.txt", 'activate("stove")')
    steps = home.adaptbot("check", path, "--json").json()["steps"]
    assert steps[0]["call"] == ["switch", "stove", "on"]


CARROT = plan('slice("carrot")', *(line.format("carrot") for line in SERVED))
STUCK = plan('fly("carrot")', CARROT)
EDITS: dict[str, tuple[str, list[tuple[str, str]], str]] = {
    "drop": (STUCK, [("How shall", "d"), ("Drop which", f"fly{ENTER}")], CARROT),
    "replace": (
        STUCK,
        [
            ("How shall", "r"),
            ("Replace which", f"1{ENTER}"),
            ("Step 1 becomes", f'{CTRL_U}clean("carrot"){ENTER}'),
        ],
        plan('clean("carrot")', CARROT),
    ),
}


@pytest.mark.parametrize("kind", EDITS)
def test_a_plan_is_changed_instead_of_answering(home: Home, kind: str) -> None:
    text, dialogue, wanted = EDITS[kind]
    with snack(home, [text], "--replans", "0") as (opened, _):
        opened.answers((HOW.format("fly"), "e"), *dialogue, NOT_AGAIN)
        assert runs(opened)
    assert edits(home) == [(kind, f"{wanted}\n")]
    assert home.replays()


MOVED = ('put_down_obj("carrot", "bowl")', 'put_down_rec("bowl", "table")', 'slice("carrot")')
LOOKED_OVER: dict[str, tuple[list[tuple[str, str]], str]] = {
    "insert": (
        [
            ("Shall it change", "i"),
            ("before which step", f"at the end{ENTER}"),
            ("The new step is", f"wait(5){ENTER}"),
        ],
        plan(CARROT, "wait(5)"),
    ),
    "move": (
        [
            ("Shall it change", "m"),
            ("Move which", f"slice{ENTER}"),
            ("To before which", f"at the end{ENTER}"),
        ],
        plan(*MOVED),
    ),
}


@pytest.mark.parametrize("kind", LOOKED_OVER)
def test_a_plan_is_looked_over_before_its_execution(home: Home, kind: str) -> None:
    dialogue, wanted = LOOKED_OVER[kind]
    with snack(home, [CARROT], "--edit") as (opened, _):
        opened.answers(*dialogue, ("Shall it change", "l"), NOT_AGAIN)
        assert runs(opened)
    assert edits(home) == [(kind, f"{wanted}\n")]
    assert home.replays()


def test_a_plan_with_nothing_open_is_executed_without_a_prompt(home: Home) -> None:
    with snack(home, [CARROT]) as (opened, _):
        assert runs(opened)
    _, understood, after = opened.said.partition("understood: make a snack")
    assert understood and "?" not in after.replace("?25", "")


def test_a_rejected_plan_goes_to_the_model_with_the_reason(home: Home) -> None:
    with snack(home, [STUCK, CARROT], "--replans", "0") as (opened, model):
        opened.answers(
            (HOW.format("fly"), "e"),
            ("How shall", "x"),
            ("What is wrong", f"no flying in the kitchen{ENTER}"),
            NOT_AGAIN,
        )
        assert runs(opened)
    assert "a person has rejected this plan: no flying in the kitchen" in model.prompts[-1]
    assert home.replays()


def test_a_plan_of_the_library_which_has_no_other_is_not_there_to_be_rejected(home: Home) -> None:
    with tty(home, "run", "make omelette", "--edit") as opened:
        opened.answers(('I do not know "chives"', "l"), ("Shall it change", "xl"))
        assert opened.ends() == 0
    assert "move a step" in opened.said and "reject" not in opened.said


def test_a_call_that_cannot_be_read_is_told_in_full_and_stays_to_be_mended(home: Home) -> None:
    with snack(home, [CARROT], "--edit") as (opened, _):
        opened.answers(
            ("Shall it change", "r"),
            ("Replace which", f"slice{ENTER}"),
            ("becomes", f"{CTRL_U}do something nice{ENTER}"),
        )
        opened.process.expect_exact("what it acts on in parentheses")
        opened.types(f"{CTRL_U}clean(carrot){ENTER}").answers(("Shall it change", "l"), NOT_AGAIN)
        assert runs(opened)
    assert edits(home)[0][1].splitlines()[0] == 'clean("carrot")'
