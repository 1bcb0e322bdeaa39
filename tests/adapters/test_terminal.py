"""The person at the terminal, asked in a real one, 80 columns wide."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.adapters.terminal.menu import heading
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.ask.questions import ABSENT, EXISTS, LATER, STOP, UNKNOWN, Choice
from tests.adapters.person import HOSTILE, LESSONS, QUESTIONS
from tests.cli.attended import CTRL_C, CTRL_U, DOWN, ENTER, ESC, TAB, UP, Tty, tty
from tests.cli.command import Home

Step = str | tuple[str, ...]
"""Keys to type, or texts to wait for."""

Terminal = Callable[..., "Asked"]
INTERRUPTED: Any = object()


class Asked:
    """A person who is asked one thing; the answer goes to a file, all else to the screen."""

    def __init__(self, opened: Tty, out: Path) -> None:
        self.opened, self.out = opened, out

    def does(self, *steps: Step) -> "Asked":
        """Wait for texts and type keys, one after the other."""
        for step in steps:
            self.opened.types(step) if isinstance(step, str) else self.opened.sees(*step)
        return self

    def ends(self) -> Any:
        """Wait for the end; return what is on stdout, or that it was interrupted."""
        code, text = self.opened.ends(), self.out.read_text()
        assert (code, bool(text)) in ((0, True), (130, False)), self.opened.screen
        return json.loads(text) if text else INTERRUPTED


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    """Return what asks a person one thing in a terminal, however often."""
    with ExitStack() as stack:

        def asked(what: str, *steps: Step, **env: str) -> Asked:
            out = tmp_path / "stdout"
            person = tty(Home(tmp_path), what, entry="tests.adapters.person:main", out=out, **env)
            return Asked(stack.enter_context(person), out).does(*steps)

        yield asked


def by_ann(value: str) -> list[str]:
    return [value, "ann", "2030-01-02T03:04:05+00:00"]


LATER_SAID = [LATER.value, LATER.by, LATER.at]
ASKED, FORM, KEEP = ("ask me later",), ("heavy",), ("Keep this?", "rack")
BACK = ["back", ["kind", "plank", "", "item"]]
LAST = [[], ["place", "spaner", "in", "item"]]
LEFT_OUT = [[["attribute", "shelf", "open", "item"], ["kind", "shelf", "", "item"]], None]
SHELF = ("left out with it: shelf: open yes",)
SHOWN = ("Keep this?", "there is shelf", "plank is kept in the [bold]rack␛[2J")

DIALOGUES: dict[str, tuple[str, tuple[Step, ...], Any]] = {
    "one key says yes": (
        "existence",
        (('step: take("spaner")', "near it: spanner", "Is there one?", "ask me later"), "y"),
        by_ann(EXISTS),
    ),
    "one key says no": ("existence", (ASKED, "n"), by_ann(ABSENT)),
    "one key puts off": ("existence", (ASKED, "l"), LATER_SAID),
    "arrows and Enter": ("existence", (ASKED, DOWN, DOWN, DOWN, ENTER), by_ann(ABSENT)),
    "Enter too early teaches nothing": ("existence", (ASKED, ENTER), LATER_SAID),
    "something known instead": (
        "existence",
        (("this time only", *ASKED), "u", ("What is used instead",), "green", ENTER),
        by_ann("instead green_box"),
    ),
    "another name": ("existence", (ASKED, "a", ("part 9",), ENTER), by_ann("is spanner")),
    "another name by a part of it": (
        "existence",
        (ASKED, "a", ('Which one is "spaner"?', "type to filter 124", "part 9"), "een", ENTER),
        by_ann("is green_box"),
    ),
    "another name in words": (
        "existence", (ASKED, "a", ("part 9",), "part 119", ENTER), by_ann("is part_119"),
    ),
    "the name that is typed goes first": (
        "existence", (ASKED, "a", ("part 9",), "part_7", ENTER), by_ann("is part_7"),
    ),
    "names beyond ASCII": ("existence", (ASKED, "a", ("part 9",), "ös", ENTER), by_ann("is öse")),
    "Enter picks nothing where no name matches": (
        "existence",
        (ASKED, "a", ("part 9",), "een", "z", ("nothing matches “eenz”",), ENTER, "\x7f", ENTER),
        by_ann("is green_box"),
    ),
    "Esc leads back to the first prompt": (
        "existence", (ASKED, "a", ("part 9",), ESC, ASKED, "n"), by_ann(ABSENT),
    ),
    "no other name where nothing is known": ("nothing known", (ASKED, "a", "n"), by_ann(ABSENT)),
    "Ctrl-C at the first prompt": ("existence", (ASKED, CTRL_C), INTERRUPTED),
    "Ctrl-C at the second prompt": ("existence", (ASKED, "a", ("part 9",), CTRL_C), INTERRUPTED),
    "a step that is not there": ("steps", (("Which?",), "1", ENTER, "2", ENTER), "12"),
    "a step by its number": ("steps", (("12  pick_up(part_12)",), "2", ENTER), "2"),
    "no step at all": ("steps", (("Which?",), "3", ENTER, "3", ENTER, ESC), None),
    "a step by what it names": ("steps", (("Which?",), "part_23", ENTER), "23"),
    "a step by what it does": ("steps", (("Which?",), "pick_up", DOWN, ENTER), "2"),
    "an attribute holds": ("attribute", (("Can one drill plank?",), "y"), by_ann("yes")),
    "an attribute does not hold": ("attribute", (("I don't know",), "n"), by_ann("no")),
    "an attribute is not known": ("attribute", (("I don't know",), "d"), by_ann(UNKNOWN)),
    "Ctrl-C at an attribute": ("attribute", (("?",), CTRL_C), INTERRUPTED),
    "a kind by its number": (
        "kind", (("What is spaner?", "1) part", "2) tool"), "2"), by_ann("tool"),
    ),
    "the first place": ("place", (("Where is spaner kept?", "part 9"), ENTER), by_ann("spanner")),
    "the last place is none": ("place", (("part 9",), UP, ENTER), by_ann(UNKNOWN)),
    "Ctrl-C at a place": ("place", (("?",), CTRL_C), INTERRUPTED),
    "a line is mended": (
        "value",
        (("How long is it?",), "2 metres", ENTER, ("no whole number",), "\x7f" * 7, ENTER),
        by_ann("2"),
    ),
    "Ctrl-C at a line": ("value", (("?",), CTRL_C), INTERRUPTED),
    "b goes back": ("back", (("b: back",), "b"), BACK),
    "Ctrl-C after an answer keeps it": (
        "back", (("b: back",), CTRL_C, ("Keep what",), "y"), [STOP.value, STOP.by, STOP.at],
    ),
    "Ctrl-C after an answer throws it away": (
        "back", (("b: back",), CTRL_C, ("Keep what",), "n"), INTERRUPTED,
    ),
    "Ctrl-C twice": ("back", (("b: back",), CTRL_C, ("Keep what",), CTRL_C), INTERRUPTED),
    "the review is agreed to": ("review", (SHOWN, "y"), True),
    "Enter agrees to the review": ("review", (KEEP, ENTER), True),
    "the review is refused": ("review", (KEEP, "n"), False),
    "what rests on a lesson is left out with it": (
        "review", (KEEP, " ", ("✗", "there is shelf", "✗", "shelf: open yes"), ENTER), LEFT_OUT,
    ),
    "it comes back with it": ("review", (KEEP, " ", SHELF, " ", ENTER), True),
    "it brings back what it rests on": ("review", (KEEP, " ", SHELF, DOWN, " ", ENTER), True),
    "a lesson is picked to be corrected": ("review", (KEEP, DOWN, DOWN, "c"), LAST),
    "Esc at the review goes back to the last answer": ("review", (KEEP, ESC), LAST),
    "Ctrl-C at the review keeps it": (
        "review", (KEEP, CTRL_C, ("Keep what you have told",), "y"), True,
    ),
    "Ctrl-C at the review throws it away": (
        "review", (KEEP, CTRL_C, ("Keep what you have told",), "n"), INTERRUPTED,
    ),
    "one key takes all likely answers": (
        "form",
        (("plank", "drill(plank)", "rack", "as for board", "heavy"), ENTER),
        ["rack", "yes", "no", "later", "later"],
    ),
    "one key leaves what is not needed": (
        "form", (FORM, TAB), ["rack", "yes", "later", "later", "later"],
    ),
    "answers of a form are changed, and others follow": (
        "form", (FORM, DOWN, "n", "y", "d", ("follows",), ENTER),
        ["rack", "no", "yes", UNKNOWN, "yes"],
    ),
    "Ctrl-C in a form keeps what was told, not what was likely": (
        "form", (FORM, DOWN, "n", "y", CTRL_C, ("Keep what you have told",), "y"),
        ["later", "no", "yes", "later", "later"],
    ),
    "Ctrl-C twice in a form": (
        "form", (FORM, DOWN, "n", CTRL_C, ("Keep what you have told",), CTRL_C), INTERRUPTED,
    ),
    "a place of a form is found by typing": (
        "form", (FORM, "gre", ENTER, ("green box",), TAB),
        ["green_box", "yes", "later", "later", "later"],
    ),
    "a new place, by a name that is free": (
        "form",
        (FORM, "saw", ("a new place: saw",), ENTER, ("known already, as something else",),
         "horse", ENTER, ("sawhorse",), TAB),
        ["new sawhorse", "yes", "later", "later", "later"],
    ),
    "a place that is written otherwise": (
        "form",
        (FORM, "xx", CTRL_U, "gren boks", ("gren boks", "green box"), DOWN, ENTER,
         ("green box",), TAB),
        ["green_box", "yes", "later", "later", "later"],
    ),
    "what is only offered is skipped": ("offer", (("Tab: skip", "heavy"), TAB), ["later"] * 3),
}  # fmt: skip


@pytest.mark.parametrize("name", DIALOGUES)
def test_what_the_person_types_is_what_they_say(terminal: Terminal, name: str) -> None:
    what, steps, said = DIALOGUES[name]
    assert terminal(what, *steps).ends() == said


def test_what_was_typed_before_the_question_was_there_answers_nothing(
    terminal: Terminal, tmp_path: Path
) -> None:
    asked = terminal("existence", "n", "n", ("nn",), HOLD=str(tmp_path / "go"))
    (tmp_path / "go").touch()
    assert asked.does(ASKED, "y").ends() == by_ann(EXISTS)


@pytest.mark.parametrize(
    ("what", "key"),
    [
        ("existence", "l: answer at once"),
        ("place", "letters: filter"),
        ("form", "Tab: take only what is needed"),
        ("review", "c: correct it"),
        ("value", "Ctrl-U: clear"),
    ],
)
def test_a_question_mark_shows_the_keys(terminal: Terminal, what: str, key: str) -> None:
    asked = terminal(what, ("?: keys" if what != "value" else "long",), "?", ENTER)
    asked.opened.process.expect(re.escape(key).replace("\\ ", r"\s+"))


@pytest.mark.parametrize(
    ("what", "lines", "said"),
    [
        ("existence", "?\n3\n", by_ann(ABSENT)),
        ("existence", "a\ngreen\n", by_ann("is green_box")),
        ("kind", "2\n", by_ann("tool")),
        ("place", "part 7\n1\n", by_ann("part_7")),
        ("value", "long\n7\n", by_ann("7")),
        ("form", "2 n\n1 gre\n1\n-\n", ["green_box", "no", "later", "later", "later"]),
        ("review", "1\n\n", [[list(lesson.question.key) for lesson in LESSONS[1::-1]], None]),
        ("review", "c 3\n", LAST),
    ],
)
def test_numbered_lines_ask_the_same_where_a_terminal_can_do_no_more(
    terminal: Terminal, what: str, lines: str, said: Any
) -> None:
    there = ("?: keys)" if what != "value" else "long", "> ")
    asked = terminal(what, there, lines, TERM="dumb")
    assert asked.ends() == said
    assert "\x1b" not in asked.opened.screen


@pytest.mark.parametrize("length", range(50, 80))
def test_a_hint_is_never_cut(length: int) -> None:
    for line in heading(("word " * 20)[: length - 1] + "?", "one key, b: back", 80):
        assert sum(len(text) for _, text in line) < 80


def test_the_name_that_is_typed_goes_before_those_that_hold_it() -> None:
    choices = [Choice(name, name) for name in ("pantry_shelf", "frying_pan", "egg", "pan")]
    picker = Picker("Which?", choices=choices)
    assert picker.matching() == choices
    picker.typed = "pan"
    assert [choice.value for choice in picker.matching()] == ["pan", "pantry_shelf", "frying_pan"]


@pytest.mark.parametrize(
    ("what", "steps", "never"),
    [
        ("nothing known", (ASKED, "n"), "another name"),
        ("new place", (("Where is plank kept?", "What is crate?", "1)"), "1"), "step:"),
    ],
)
def test_what_makes_no_sense_is_not_shown(
    terminal: Terminal, what: str, steps: tuple[Step, ...], never: str
) -> None:
    asked = terminal(what, *steps)
    asked.ends()
    assert never not in asked.opened.screen


def test_hostile_names_are_shown_and_do_nothing(terminal: Terminal) -> None:
    shown = ("[red]x[/red] ␛[31mESC <b>b</b> {x} %s �right �2J",)
    asked = terminal("hostile", shown, ASKED, "a", ("type to filter 2", "spanner"), ENTER)
    assert asked.ends()[0] == f"is {HOSTILE}"
    for never in ("\x1b[31mESC", "\x9b", "\u202e"):
        assert never not in asked.opened.screen
    assert "y" * 300 not in asked.opened.plain.replace("\r\n", "")


def test_no_color_leaves_no_colour_in_the_prompts(terminal: Terminal) -> None:
    asked = terminal("existence", ASKED, "n", NO_COLOR="1")
    asked.ends()
    codes = re.findall(r"\x1b\[([\d;]*)m", asked.opened.screen)
    found = {code for each in codes for code in each.split(";") if code.isdigit()}
    assert not {code for code in found if int(code) >= 30} - {"39", "49"}


def test_nobody_leaves_questions_for_later_and_keeps_what_was_learned() -> None:
    assert AbsentHuman().ask(QUESTIONS["kind"]) is LATER
    assert AbsentHuman().review(LESSONS)
