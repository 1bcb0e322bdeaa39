"""The person at the terminal, asked in a real one, 80 columns wide."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.adapters.terminal.canvas import heading
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.questions import ABSENT, EXISTS, LATER, UNKNOWN, Choice
from tests.adapters.person import HOSTILE, LESSONS, QUESTIONS
from tests.cli.attended import CTRL_C, DOWN, ENTER, UP, Tty, tty
from tests.cli.command import Home

ESCAPE = "\x1b"
Terminal = Callable[..., "Asked"]


class Asked:
    """A person who is asked one thing; the answer goes to a file, all else to the screen."""

    def __init__(self, opened: Tty, out: Path) -> None:
        self.opened, self.out = opened, out

    @property
    def raw(self) -> str:
        """What is on the screen, with what colours it."""
        return self.opened.screen

    def sees(self, *texts: str) -> "Asked":
        """Wait for texts, one after the other."""
        self.opened.sees(*texts)
        return self

    def types(self, *keys: str) -> "Asked":
        self.opened.types(*keys)
        return self

    def ends(self, code: int = 0) -> Any:
        """Wait for the end; return what is on stdout."""
        assert self.opened.ends() == code, self.raw
        text = self.out.read_text()
        return json.loads(text) if text else None


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    """Return what asks a person one thing in a terminal, however often."""
    with ExitStack() as stack:

        def asked(what: str, **env: str) -> Asked:
            out = tmp_path / "stdout"
            person = tty(Home(tmp_path), what, entry="tests.adapters.person:main", out=out, **env)
            return Asked(stack.enter_context(person), out)

        yield asked


def by_ann(value: str) -> list[str]:
    return [value, "ann", "2030-01-02T03:04:05+00:00"]


LATER_SAID = [LATER.value, LATER.by, LATER.at]


@pytest.mark.parametrize(
    ("key", "said"), [("y", by_ann(EXISTS)), ("n", by_ann(ABSENT)), ("l", LATER_SAID)]
)
def test_existence_is_answered_by_one_key(terminal: Terminal, key: str, said: list[str]) -> None:
    asked = terminal("existence")
    asked.sees('step: take("spaner")', "near it: spanner", "Is there one?", "ask me later")

    assert asked.types(key).ends() == said


def test_arrows_and_enter_answer_too(terminal: Terminal) -> None:
    asked = terminal("existence").sees("ask me later")

    assert asked.types(DOWN, DOWN, DOWN, ENTER).ends() == by_ann(ABSENT)


def test_a_key_pressed_too_early_teaches_nothing(terminal: Terminal) -> None:
    """Enter at a question that was not read yet leaves it open."""
    assert terminal("existence").sees("ask me later").types(ENTER).ends() == LATER_SAID


def test_what_was_typed_before_the_question_was_there_answers_nothing(
    terminal: Terminal, tmp_path: Path
) -> None:
    asked = terminal("existence", HOLD=str(tmp_path / "go")).types("n", "n").sees("nn")
    (tmp_path / "go").touch()

    assert asked.sees("ask me later").types("y").ends() == by_ann(EXISTS)


def test_something_known_is_used_instead_this_time(terminal: Terminal) -> None:
    asked = terminal("existence").sees("this time only", "ask me later").types("u")

    asked.sees("What is used instead").types("green", ENTER)
    assert asked.ends() == by_ann("instead green_box")


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
    asked = terminal(what).sees("?: keys" if what != "value" else "long").types("?", ENTER)
    asked.opened.process.expect(re.escape(key).replace("\\ ", r"\s+"))


@pytest.mark.parametrize(
    ("what", "lines", "said"),
    [
        ("existence", "?\n3\n", by_ann(ABSENT)),
        ("existence", "a\ngreen\n", None),
        ("kind", "2\n", by_ann("tool")),
        ("place", "part 7\n1\n", by_ann("part_7")),
        ("value", "long\n7\n", by_ann("7")),
        ("form", "2 n\n1 gre\n1\n-\n", ["green_box", "no", "later", "later", "later"]),
        ("review", "1\n\n", [[list(lesson.question.key) for lesson in LESSONS[1::-1]], None]),
        ("review", "c 3\n", [[], ["place", "spaner", "in", "item"]]),
    ],
)
def test_numbered_lines_ask_the_same_where_a_terminal_can_do_no_more(
    terminal: Terminal, what: str, lines: str, said: Any
) -> None:
    asked = terminal(what, TERM="dumb").sees("?: keys)" if what != "value" else "long", "> ")
    answer = asked.types(lines).ends()

    assert answer == (said or by_ann("is green_box"))
    assert "\x1b" not in asked.raw


@pytest.mark.parametrize(
    ("typed", "name"),
    [("", "spanner"), ("een", "green_box"), ("part 119", "part_119"), ("part_7", "part_7")],
)
def test_a_known_name_is_picked_by_typing_part_of_it(
    terminal: Terminal, typed: str, name: str
) -> None:
    asked = terminal("existence").sees("ask me later").types("a")
    asked.sees('Which one is "spaner"?', "type to filter 124", "part 9").types(typed)

    assert asked.types(ENTER).ends() == by_ann(f"is {name}")


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (("2", ENTER), "2"),
        (("1", ENTER, "2", ENTER), "12"),  # there is no step 1: nothing else is taken for it
        (("3", ENTER, "3", ENTER, ESCAPE), None),
        (("part_23", ENTER), "23"),
        (("pick_up", DOWN, ENTER), "2"),
    ],
)
def test_a_step_is_found_by_its_own_number(terminal: Terminal, keys: Any, said: str | None) -> None:
    asked = terminal("steps").sees("Which?", "12  pick_up(part_12)").types(*keys)

    assert asked.ends() == said


def test_names_beyond_ascii_can_be_typed(terminal: Terminal) -> None:
    asked = terminal("existence").sees("ask me later").types("a").sees("part 9")

    assert asked.types("ös", ENTER).ends() == by_ann("is öse")


def test_enter_picks_nothing_where_no_name_matches(terminal: Terminal) -> None:
    asked = terminal("existence").sees("ask me later").types("a").sees("part 9")
    asked.types("een", "z").sees("nothing matches “eenz”").types(ENTER, "\x7f", ENTER)

    assert asked.ends() == by_ann("is green_box")


def test_escape_leads_back_to_the_first_prompt(terminal: Terminal) -> None:
    asked = terminal("existence").sees("ask me later").types("a").sees("part 9")
    asked.types(ESCAPE).sees("ask me later")

    assert asked.types("n").ends() == by_ann(ABSENT)


def test_another_name_is_not_offered_where_nothing_is_known(terminal: Terminal) -> None:
    asked = terminal("nothing known").sees("ask me later")

    assert asked.types("a", "n").ends() == by_ann(ABSENT)
    assert "another name" not in asked.raw


@pytest.mark.parametrize(("key", "value"), [("y", "yes"), ("n", "no"), ("d", UNKNOWN)])
def test_an_attribute_is_answered_by_one_key(terminal: Terminal, key: str, value: str) -> None:
    asked = terminal("attribute").sees("Can one drill plank?", "I don't know")

    assert asked.types(key).ends() == by_ann(value)


@pytest.mark.parametrize("length", range(50, 80))
def test_a_hint_is_never_cut(length: int) -> None:
    for line in heading(("word " * 20)[: length - 1] + "?", "one key, b: back", 80):
        assert sum(len(text) for _, text in line) < 80


def test_the_name_that_is_typed_goes_before_those_that_hold_it() -> None:
    choices = [Choice(name, name) for name in ("pantry_shelf", "frying_pan", "egg", "pan")]
    picker = Picker("Which?", choices=choices)
    assert [choice.value for choice in picker.matching()] == [c.value for c in choices]
    picker.typed = "pan"
    found = [choice.value for choice in picker.matching()]
    assert found == ["pan", "pantry_shelf", "frying_pan"]


def test_a_question_that_an_answer_raised_is_no_step(terminal: Terminal) -> None:
    asked = terminal("new place").sees("Where is plank kept?", "What is crate?")
    asked.sees("1)").types("1")
    asked.ends()
    assert "step:" not in asked.raw


def test_a_kind_is_answered_by_its_number(terminal: Terminal) -> None:
    asked = terminal("kind").sees("What is spaner?", "1) part", "2) tool")

    assert asked.types("2").ends() == by_ann("tool")


@pytest.mark.parametrize(("keys", "value"), [((ENTER,), "spanner"), ((UP, ENTER), UNKNOWN)])
def test_a_place_is_picked_from_many(terminal: Terminal, keys: tuple[str, ...], value: str) -> None:
    asked = terminal("place").sees("Where is spaner kept?", "part 9")

    assert asked.types(*keys).ends() == by_ann(value)
    assert re.search(r"kept\?.*(spanner|I don't know)\r\n$", asked.opened.plain)


def test_a_question_without_choices_takes_a_line(terminal: Terminal) -> None:
    asked = terminal("value").sees("How long is it?")

    asked.types("2 metres", ENTER).sees("no whole number").types("\x7f" * 7, ENTER)

    assert asked.ends() == by_ann("2")


@pytest.mark.parametrize("what", ["existence", "attribute", "place", "value"])
def test_ctrl_c_interrupts(terminal: Terminal, what: str) -> None:
    asked = terminal(what).sees("?").types(CTRL_C)

    assert asked.ends(130) is None


@pytest.mark.parametrize(("key", "kept", "code"), [("y", True, 0), ("n", None, 130)])
def test_ctrl_c_at_the_review_asks_whether_to_keep_it(
    terminal: Terminal, key: str, kept: bool | None, code: int
) -> None:
    asked = terminal("review").sees("Keep this?", "Esc: back, ?: keys)").types(CTRL_C)

    assert asked.sees("Keep what you have told").types(key).ends(code) is kept


def test_escape_at_the_review_goes_back_to_the_last_answer(terminal: Terminal) -> None:
    asked = terminal("review").sees("Keep this?").types("\x1b")

    assert asked.ends() == [[], ["place", "spaner", "in", "item"]]


def test_ctrl_c_interrupts_the_second_prompt(terminal: Terminal) -> None:
    asked = terminal("existence").sees("ask me later").types("a").sees("part 9")

    assert asked.types(CTRL_C).ends(130) is None


@pytest.mark.parametrize(("key", "kept"), [("y", True), (ENTER, True), ("n", False)])
def test_review_tells_everything_learned_and_asks(terminal: Terminal, key: str, kept: bool) -> None:
    asked = terminal("review")
    asked.sees("Keep this?", "there is shelf", "plank is kept in the [bold]rack␛[2J")

    assert asked.types(key).ends() is kept


def test_what_rests_on_a_lesson_is_left_out_with_it_and_comes_back_with_it(
    terminal: Terminal,
) -> None:
    asked = terminal("review").sees("Keep this?", "rack").types(" ")
    asked.sees("✗", "there is shelf", "✗", "shelf: open yes").types(ENTER)
    out = [["attribute", "shelf", "open", "item"], ["kind", "shelf", "", "item"]]
    assert asked.ends() == [out, None]

    for again in (DOWN, ""):  # from either end
        asked = terminal("review").sees("Keep this?", "rack").types(" ")
        asked.sees("left out with it: shelf: open yes").types(again, " ", ENTER)
        assert asked.ends() is True


def test_a_lesson_is_picked_to_be_corrected(terminal: Terminal) -> None:
    asked = terminal("review").sees("Keep this?", "rack").types(DOWN, DOWN, "c")

    assert asked.ends() == [[], ["place", "spaner", "in", "item"]]


def test_one_key_takes_all_likely_answers(terminal: Terminal) -> None:
    asked = terminal("form").sees("plank", "drill(plank)", "rack", "as for board")

    assert asked.sees("heavy").types(ENTER).ends() == ["rack", "yes", "no", "later", "later"]


def test_one_key_leaves_what_is_not_needed(terminal: Terminal) -> None:
    asked = terminal("form").sees("heavy").types("\t")

    assert asked.ends() == ["rack", "yes", "later", "later", "later"]


def test_each_answer_of_a_form_can_be_changed_and_others_follow(terminal: Terminal) -> None:
    asked = terminal("form").sees("heavy").types(DOWN, "n", "y", "d")
    asked.sees("follows").types(ENTER)

    assert asked.ends() == ["rack", "no", "yes", UNKNOWN, "yes"]


def test_ctrl_c_in_a_form_keeps_what_was_told_there_and_nothing_that_was_only_likely(
    terminal: Terminal,
) -> None:
    for key, said in (("y", ["later", "no", "yes", "later", "later"]), (CTRL_C, None)):
        asked = terminal("form").sees("heavy").types(DOWN, "n", "y", CTRL_C)
        asked.sees("Keep what you have told").types(key)
        assert asked.ends(0 if said else 130) == said


def test_a_place_of_a_form_is_found_by_typing(terminal: Terminal) -> None:
    asked = terminal("form").sees("heavy").types("gre", ENTER).sees("green box")

    assert asked.types("\t").ends()[0] == "green_box"


def test_a_new_place_is_told_by_its_name(terminal: Terminal) -> None:
    asked = terminal("form").sees("heavy").types("saw").sees("a new place: saw")
    asked.types(ENTER).sees("known already, as something else").types("horse", ENTER)

    assert asked.sees("sawhorse").types("\t").ends()[0] == "new sawhorse"


def test_a_place_that_is_written_otherwise_is_shown_below_a_new_one(terminal: Terminal) -> None:
    asked = terminal("form").sees("heavy").types("xx\x15", "gren boks")
    asked.sees("a new place: gren boks", "green box").types(DOWN, ENTER)

    assert asked.sees("green box").types("\t").ends()[0] == "green_box"


def test_what_is_only_offered_is_skipped_by_one_key(terminal: Terminal) -> None:
    asked = terminal("offer").sees("Tab: skip", "heavy").types("\t")

    assert asked.ends() == ["later"] * 3


def test_b_goes_back_to_the_question_before(terminal: Terminal) -> None:
    asked = terminal("back").sees("b: back").types("b")

    assert asked.ends() == ["back", ["kind", "plank", "", "item"]]


def test_ctrl_c_after_an_answer_asks_whether_to_keep_it(terminal: Terminal) -> None:
    asked = terminal("back").sees("b: back").types(CTRL_C).sees("Keep what you have")
    assert asked.types("y").ends()[0] == "stop"

    for no in ("n", CTRL_C):
        asked = terminal("back").sees("b: back").types(CTRL_C).sees("Keep what")
        assert asked.types(no).ends(130) is None


def test_hostile_names_are_shown_and_do_nothing(terminal: Terminal) -> None:
    asked = terminal("hostile").sees("[red]x[/red] ␛[31mESC <b>b</b> {x} %s �right �2J")
    asked.sees("ask me later").types("a").sees("type to filter 2", "spanner").types(ENTER)
    value, _, _ = asked.ends()

    assert value == f"is {HOSTILE}"
    assert "\x1b[31mESC" not in asked.raw
    assert "\x9b" not in asked.raw
    assert "\u202e" not in asked.raw
    assert "y" * 300 not in asked.opened.plain.replace("\r\n", "")


def test_no_color_leaves_no_colour_in_the_prompts(terminal: Terminal) -> None:
    asked = terminal("existence", NO_COLOR="1").sees("ask me later").types("n")
    asked.ends()
    codes = [c for codes in re.findall(r"\x1b\[([\d;]*)m", asked.raw) for c in codes.split(";")]

    assert not [
        code for code in codes if code.isdigit() and 30 <= int(code) != 39 and int(code) != 49
    ]


def test_nobody_leaves_questions_for_later_and_keeps_what_was_learned() -> None:
    assert AbsentHuman().ask(QUESTIONS["kind"]) is LATER
    assert AbsentHuman().review(LESSONS)
