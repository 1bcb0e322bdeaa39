"""The person at the terminal, asked in a real one, 80 columns wide."""

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import pexpect
import pytest
from rdflib import Literal, URIRef

from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.questions import (
    ABSENT,
    EXISTS,
    LATER,
    UNKNOWN,
    Answer,
    Choice,
    Question,
    yes_no,
)

ROOT = Path(__file__).parents[2]
UP, DOWN, ESCAPE, ENTER, CTRL_C = "\x1b[A", "\x1b[B", "\x1b", "\r", "\x03"

DRIVER = """
import json, sys
from rich.console import Console
from tests.adapters.test_terminal import LESSONS, QUESTIONS
from adaptbot_cli.adapters.terminal import TerminalHuman

human = TerminalHuman(Console(stderr=True), "ann", lambda: "2030-01-02T03:04:05+00:00")
try:
    if sys.argv[1] == "review":
        said = human.review(LESSONS)
    else:
        answer = human.ask(QUESTIONS[sys.argv[1]])
        said = [answer.value, answer.by, answer.at]
except KeyboardInterrupt:
    sys.exit(130)
print(json.dumps(said))
"""

EXISTENCE = (
    Choice("is", "it is another name for something you know"),
    Choice(ABSENT, "no, there is none"),
    Choice(EXISTS, "yes, there is"),
    Choice("later", "ask me later"),
)
KNOWN = ("spanner", "span_rope", *(f"part_{n}" for n in range(120)), "green_box", "öse")
HOSTILE = "[red]x[/red] \x1b[31mESC <b>b</b> {x} %s \u202eright \x9b2J " + "y" * 300


def existence(about: str = "spaner", text: str = "", known: tuple[str, ...] = KNOWN) -> Question:
    text = text or f'I do not know "{about}". Is there one?'
    near = known[:2]
    context = f'take("{about}")'
    return Question("existence", about, text, "", "item", EXISTENCE, known, near, context)


QUESTIONS = {
    "existence": existence(),
    "nothing known": existence(known=()),
    "attribute": Question(
        "attribute", "plank", "Can one drill plank?", "drillable", "item", yes_no()
    ),
    "kind": Question(
        "kind",
        "spaner",
        "What is spaner?",
        choices=(Choice("part", "part"), Choice("tool", "tool")),
    ),
    "place": Question(
        "place",
        "spaner",
        "Where is spaner kept?",
        "in",
        choices=(*(Choice(n, n) for n in KNOWN), Choice(UNKNOWN, "I don't know")),
    ),
    "value": Question("value", "spaner", "How long is it?"),
    "hostile": existence(HOSTILE, f"Is there {HOSTILE}?", (HOSTILE, "spanner")),
}
LESSONS = (
    Lesson(
        Delta(
            frozenset({(URIRef("http://example.org/w#plank"), URIRef("urn:w:in"), Literal("box"))}),
            frozenset(
                {(URIRef("http://example.org/w#plank"), URIRef("urn:w:in"), Literal("rack"))}
            ),
        ),
        QUESTIONS["place"],
        Answer("rack"),
        "plank is kept in the [bold]rack\x1b[2J",
    ),
)


class Terminal:
    """A driver in a terminal: its stdout goes to a file, everything else to the screen."""

    def __init__(self, folder: Path, what: str, **env: str) -> None:
        self.out = folder / "stdout"
        command = f'exec "{sys.executable}" -c "$DRIVER" "$WHAT" > "$OUT"'
        self.process: Any = pexpect.spawn(
            "/bin/sh",
            ["-c", command],
            cwd=str(ROOT),
            dimensions=(40, 80),
            encoding="utf-8",
            timeout=20,
            env={
                **{k: v for k, v in os.environ.items() if k != "NO_COLOR"},
                "PYTHONPATH": str(ROOT),
                "PROMPT_TOOLKIT_NO_CPR": "1",
                "TERM": "xterm-256color",
                "DRIVER": DRIVER,
                "WHAT": what,
                "OUT": str(self.out),
                **env,
            },
        )
        self.raw = ""

    def sees(self, *texts: str) -> "Terminal":
        """Wait for texts, one after the other."""
        for text in texts:
            self.process.expect_exact(text)
            self.raw += self.process.before + self.process.after
        return self

    def types(self, *keys: str) -> "Terminal":
        for key in keys:
            self.process.send(key)
        return self

    def ends(self, code: int = 0) -> Any:
        """Wait for the end; return what is on stdout."""
        self.process.expect(pexpect.EOF)
        self.raw += self.process.before
        self.process.close()
        assert self.process.exitstatus == code, self.raw
        text = self.out.read_text()
        return json.loads(text) if text else None


def by_ann(value: str) -> list[str]:
    return [value, "ann", "2030-01-02T03:04:05+00:00"]


LATER_SAID = [LATER.value, LATER.by, LATER.at]


@pytest.mark.parametrize(
    ("key", "said"), [("y", by_ann(EXISTS)), ("n", by_ann(ABSENT)), ("l", LATER_SAID)]
)
def test_existence_is_answered_by_one_key(tmp_path: Path, key: str, said: list[str]) -> None:
    terminal = Terminal(tmp_path, "existence")
    terminal.sees('step: take("spaner")', "near it: spanner", "Is there one?", "ask me later")

    assert terminal.types(key).ends() == said


def test_arrows_and_enter_answer_too(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later")

    assert terminal.types(DOWN, ENTER).ends() == by_ann(ABSENT)


@pytest.mark.parametrize(
    ("typed", "name"),
    [("", "spanner"), ("een", "green_box"), ("part 119", "part_119"), ("part_7", "part_7")],
)
def test_a_known_name_is_picked_by_typing_part_of_it(tmp_path: Path, typed: str, name: str) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a")
    terminal.sees('Which one is "spaner"?', "type to filter 124", "part 9").types(typed)

    assert terminal.types(ENTER).ends() == by_ann(f"is {name}")


def test_names_beyond_ascii_can_be_typed(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")

    assert terminal.types("ös", ENTER).ends() == by_ann("is öse")


def test_enter_picks_nothing_where_no_name_matches(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")
    terminal.types("een", "z", ENTER).sees("eenz").types("\x7f", ENTER)

    assert terminal.ends() == by_ann("is green_box")


def test_escape_leads_back_to_the_first_prompt(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")
    terminal.types(ESCAPE).sees("ask me later")

    assert terminal.types("n").ends() == by_ann(ABSENT)


def test_another_name_is_not_offered_where_nothing_is_known(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "nothing known").sees("ask me later")

    assert terminal.types("a", "n").ends() == by_ann(ABSENT)
    assert "another name" not in terminal.raw


@pytest.mark.parametrize(("key", "value"), [("y", "yes"), ("n", "no"), ("d", UNKNOWN)])
def test_an_attribute_is_answered_by_one_key(tmp_path: Path, key: str, value: str) -> None:
    terminal = Terminal(tmp_path, "attribute").sees("Can one drill plank?", "I don't know")

    assert terminal.types(key).ends() == by_ann(value)


def test_a_kind_is_answered_by_its_number(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "kind").sees("What is spaner?", "1) part", "2) tool")

    assert terminal.types("2").ends() == by_ann("tool")


@pytest.mark.parametrize(("keys", "value"), [((ENTER,), "spanner"), ((UP, ENTER), UNKNOWN)])
def test_a_place_is_picked_from_many(tmp_path: Path, keys: tuple[str, ...], value: str) -> None:
    terminal = Terminal(tmp_path, "place").sees("Where is spaner kept?", "part 9")

    assert terminal.types(*keys).ends() == by_ann(value)
    assert re.search(r"kept\?.*(spanner|I don't know)\r\n$", _plain(terminal.raw))


def test_a_question_without_choices_takes_a_line(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "value").sees("How long is it?")

    assert terminal.types("two metres", ENTER).ends() == by_ann("two metres")


@pytest.mark.parametrize("what", ["existence", "attribute", "place", "value", "review"])
def test_ctrl_c_interrupts(tmp_path: Path, what: str) -> None:
    terminal = Terminal(tmp_path, what).sees("?").types(CTRL_C)

    assert terminal.ends(130) is None


def test_ctrl_c_interrupts_the_second_prompt(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")

    assert terminal.types(CTRL_C).ends(130) is None


@pytest.mark.parametrize(("key", "kept"), [("y", True), (ENTER, True), ("n", False)])
def test_review_shows_every_fact_and_asks(tmp_path: Path, key: str, kept: bool) -> None:
    terminal = Terminal(tmp_path, "review")
    terminal.sees(
        "plank is kept in the [bold]rack␛[2J", "plank in box", "plank in rack", "Keep this?"
    )

    assert terminal.types(key).ends() is kept


def test_hostile_names_are_shown_and_do_nothing(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "hostile").sees(
        "[red]x[/red] ␛[31mESC <b>b</b> {x} %s �right �2J"
    )
    terminal.sees("ask me later").types("a").sees("type to filter 2", "spanner").types(ENTER)
    value, _, _ = terminal.ends()

    assert value == f"is {HOSTILE}"
    assert "\x1b[31mESC" not in terminal.raw
    assert "\x9b" not in terminal.raw
    assert "\u202e" not in terminal.raw
    assert "y" * 300 not in _plain(terminal.raw).replace("\r\n", "")


def test_no_color_leaves_no_colour_in_the_prompts(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence", NO_COLOR="1").sees("ask me later").types("n")
    terminal.ends()
    codes = [c for codes in re.findall(r"\x1b\[([\d;]*)m", terminal.raw) for c in codes.split(";")]

    assert not [
        code for code in codes if code.isdigit() and 30 <= int(code) != 39 and int(code) != 49
    ]


def test_nobody_leaves_questions_for_later_and_keeps_what_was_learned() -> None:
    assert AbsentHuman().ask(QUESTIONS["kind"]) is LATER
    assert AbsentHuman().review(LESSONS)


def _plain(text: str) -> str:
    return re.sub(r"\x1b\[[\d;?]*[A-Za-z]", "", text)
