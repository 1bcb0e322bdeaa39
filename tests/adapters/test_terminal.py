"""The person at the terminal, asked in a real one, 80 columns wide."""

import json
import os
import re
import sys
from pathlib import Path
from typing import Any

import pexpect
import pytest
from rdflib import RDF, Literal, URIRef

from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.adapters.terminal.canvas import heading
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.questions import (
    ABSENT,
    EXISTS,
    LATER,
    UNKNOWN,
    Answer,
    Choice,
    Follows,
    Question,
    Suggestion,
    yes_no,
)

ROOT = Path(__file__).parents[2]
UP, DOWN, ESCAPE, ENTER, CTRL_C = "\x1b[A", "\x1b[B", "\x1b", "\r", "\x03"

DRIVER = """
import json, sys
from dataclasses import replace
from rich.console import Console
from tests.adapters.test_terminal import LESSONS, QUESTIONS, STEPS
from adaptbot_cli.adapters.terminal import TerminalHuman
from adaptbot_cli.adapters.terminal.canvas import Canvas
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.questions import Reviewed

human = TerminalHuman(Console(stderr=True), "ann", lambda: "2030-01-02T03:04:05+00:00")
try:
    if sys.argv[1] == "review":
        said = human.review(LESSONS)
    elif sys.argv[1] == "steps":
        said = Picker("Which?", STEPS, back="back", numbered=True).ask(Canvas(human.console))
        said = said and said.value
    elif sys.argv[1] == "offer":
        said = [answer.value for answer in human.offer(QUESTIONS["form"].offered)]
    else:
        answer = human.ask(QUESTIONS[sys.argv[1]])
        said = [answer.value, answer.by, answer.at]
        question = QUESTIONS[sys.argv[1]]
        if answer.to or question.together or question.offered:
            later = question.together
            asked = [
                replace(each, together=later[n + 1 :], offered=question.offered)
                for n, each in enumerate(later)
            ]
            rest = [human.ask(each).value for each in asked]
            if question.offered:
                rest += [each.value for each in human.offer(question.offered)]
            said = [answer.value, list(answer.to)] if answer.to else [answer.value, *rest]
    if isinstance(said, Reviewed):
        said = [sorted(map(list, said.left_out)), said.back and list(said.back)]
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


def boolean(prop: str, likely: str = "", **more: Any) -> Question:
    suggested = Suggestion(likely, "as for board") if likely else None
    text = f"Is plank {prop}?"
    return Question(
        "attribute", "plank", text, prop, "item", yes_no(), label=prop, suggested=suggested, **more
    )


FORM = Question(
    "place",
    "plank",
    "Where is plank kept?",
    "in",
    choices=(Choice("rack", "rack"), Choice("green_box", "green_box"), Choice(UNKNOWN, "?")),
    known=("saw",),
    label="place",
    context="drill(plank)",
    suggested=Suggestion("rack", "as for board"),
    together=(boolean("drillable", "yes"),),
    offered=(
        boolean("glass", "no"),
        boolean("heavy"),
        boolean("dry", follows=(Follows("glass", "yes", "yes"),)),
    ),
)

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
    "value": Question("value", "spaner", "How long is it?", number="whole number"),
    "back": Question(
        "attribute",
        "plank",
        "Can one drill plank?",
        "drillable",
        "item",
        yes_no(),
        answered=((Question("kind", "plank", "What is plank?"), Answer("part")),),
    ),
    "new place": Question(
        "kind",
        "crate",
        "What is crate?",
        choices=(Choice("part", "part"), Choice("tool", "tool")),
        context="Where is plank kept?",
        answered=((Question("place", "plank", "Where is plank kept?"), Answer("new crate")),),
    ),
    "form": FORM,
    "hostile": existence(HOSTILE, f"Is there {HOSTILE}?", (HOSTILE, "spanner")),
}


def lesson(key: tuple[str, str], sentence: str, *facts: Any) -> Lesson:
    question = Question(key[0], "shelf", "?", key[1])  # type: ignore[arg-type]
    return Lesson(Delta(added=frozenset(facts)), question, Answer("yes"), sentence)


STEPS = tuple(Choice(n, f"{n}  pick_up(part_{n})") for n in ("12", "2", "23", "31"))
SHELF = URIRef("http://example.org/w#shelf")
LESSONS = (
    lesson(("kind", ""), "there is shelf", (SHELF, RDF.type, URIRef("urn:w:furniture"))),
    lesson(("attribute", "open"), "shelf: open yes", (SHELF, URIRef("urn:w:open"), Literal(True))),
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
            timeout=60,
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
def test_a_step_is_found_by_its_own_number(tmp_path: Path, keys: Any, said: str | None) -> None:
    terminal = Terminal(tmp_path, "steps").sees("Which?", "12  pick_up(part_12)").types(*keys)

    assert terminal.ends() == said


def test_names_beyond_ascii_can_be_typed(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")

    assert terminal.types("ös", ENTER).ends() == by_ann("is öse")


def test_enter_picks_nothing_where_no_name_matches(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")
    terminal.types("een", "z").sees("nothing matches “eenz”").types(ENTER, "\x7f", ENTER)

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


@pytest.mark.parametrize("length", range(50, 80))
def test_a_hint_is_never_cut(length: int) -> None:
    for line in heading(("word " * 20)[: length - 1] + "?", "one key, b: back", 80):
        assert sum(len(text) for _, text in line) < 80


def test_the_name_that_is_typed_goes_before_those_that_hold_it() -> None:
    choices = [Choice(name, name) for name in ("pantry_shelf", "frying_pan", "egg", "pan")]
    picker = Picker("Which?", choices)
    assert [choice.value for choice in picker.matching()] == [c.value for c in choices]
    picker.typed = "pan"
    found = [choice.value for choice in picker.matching()]
    assert found == ["pan", "pantry_shelf", "frying_pan"]


def test_a_question_that_an_answer_raised_is_no_step(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "new place").sees("Where is plank kept?", "What is crate?")
    terminal.sees("1)").types("1")
    terminal.ends()
    assert "step:" not in terminal.raw


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

    terminal.types("2 metres", ENTER).sees("no whole number").types("\x7f" * 7, ENTER)

    assert terminal.ends() == by_ann("2")


@pytest.mark.parametrize("what", ["existence", "attribute", "place", "value"])
def test_ctrl_c_interrupts(tmp_path: Path, what: str) -> None:
    terminal = Terminal(tmp_path, what).sees("?").types(CTRL_C)

    assert terminal.ends(130) is None


@pytest.mark.parametrize(("key", "kept", "code"), [("y", True, 0), ("n", None, 130)])
def test_ctrl_c_at_the_review_asks_whether_to_keep_it(
    tmp_path: Path, key: str, kept: bool | None, code: int
) -> None:
    terminal = Terminal(tmp_path, "review").sees("Keep this?", "Esc: back)").types(CTRL_C)

    assert terminal.sees("Keep what you have told").types(key).ends(code) is kept


def test_escape_at_the_review_goes_back_to_the_last_answer(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "review").sees("Keep this?").types("\x1b")

    assert terminal.ends() == [[], ["place", "spaner", "in", "item"]]


def test_ctrl_c_interrupts_the_second_prompt(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "existence").sees("ask me later").types("a").sees("part 9")

    assert terminal.types(CTRL_C).ends(130) is None


@pytest.mark.parametrize(("key", "kept"), [("y", True), (ENTER, True), ("n", False)])
def test_review_tells_everything_learned_and_asks(tmp_path: Path, key: str, kept: bool) -> None:
    terminal = Terminal(tmp_path, "review")
    terminal.sees("Keep this?", "there is shelf", "plank is kept in the [bold]rack␛[2J")

    assert terminal.types(key).ends() is kept


def test_what_rests_on_a_lesson_is_left_out_with_it_and_comes_back_with_it(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "review").sees("Keep this?", "rack").types(" ")
    terminal.sees("✗", "there is shelf", "✗", "shelf: open yes").types(ENTER)
    out = [["attribute", "shelf", "open", "item"], ["kind", "shelf", "", "item"]]
    assert terminal.ends() == [out, None]

    terminal = Terminal(tmp_path, "review").sees("Keep this?", "rack").types(" ", DOWN, " ", ENTER)
    assert terminal.ends() is True


def test_a_lesson_is_picked_to_be_corrected(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "review").sees("Keep this?", "rack").types(DOWN, DOWN, "c")

    assert terminal.ends() == [[], ["place", "spaner", "in", "item"]]


def test_one_key_takes_all_likely_answers(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "form").sees("plank", "drill(plank)", "rack", "as for board")

    assert terminal.sees("heavy").types(ENTER).ends() == ["rack", "yes", "no", "later", "later"]


def test_one_key_leaves_what_is_not_needed(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "form").sees("heavy").types("\t")

    assert terminal.ends() == ["rack", "yes", "later", "later", "later"]


def test_each_answer_of_a_form_can_be_changed_and_others_follow(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "form").sees("heavy").types(DOWN, "n", "y", "d")
    terminal.sees("follows").types(ENTER)

    assert terminal.ends() == ["rack", "no", "yes", UNKNOWN, "yes"]


def test_ctrl_c_in_a_form_keeps_what_was_told_there_and_nothing_that_was_only_likely(
    tmp_path: Path,
) -> None:
    for key, said in (("y", ["later", "no", "yes", "later", "later"]), (CTRL_C, None)):
        terminal = Terminal(tmp_path, "form").sees("heavy").types(DOWN, "n", "y", CTRL_C)
        terminal.sees("Keep what you have told").types(key)
        assert terminal.ends(0 if said else 130) == said


def test_a_place_of_a_form_is_found_by_typing(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "form").sees("heavy").types("gre", ENTER).sees("green box")

    assert terminal.types("\t").ends()[0] == "green_box"


def test_a_new_place_is_told_by_its_name(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "form").sees("heavy").types("saw").sees("a new place: saw")
    terminal.types(ENTER).sees("known already, as something else").types("horse", ENTER)

    assert terminal.sees("sawhorse").types("\t").ends()[0] == "new sawhorse"


def test_a_place_that_is_written_otherwise_is_shown_below_a_new_one(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "form").sees("heavy").types("xx\x15", "gren boks")
    terminal.sees("a new place: gren boks", "green box").types(DOWN, ENTER)

    assert terminal.sees("green box").types("\t").ends()[0] == "green_box"


def test_what_is_only_offered_is_skipped_by_one_key(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "offer").sees("Tab: skip", "heavy").types("\t")

    assert terminal.ends() == ["later"] * 3


def test_b_goes_back_to_the_question_before(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "back").sees("b: back").types("b")

    assert terminal.ends() == ["back", ["kind", "plank", "", "item"]]


def test_ctrl_c_after_an_answer_asks_whether_to_keep_it(tmp_path: Path) -> None:
    terminal = Terminal(tmp_path, "back").sees("b: back").types(CTRL_C).sees("Keep what you have")
    assert terminal.types("y").ends()[0] == "stop"

    for no in ("n", CTRL_C):
        terminal = Terminal(tmp_path, "back").sees("b: back").types(CTRL_C).sees("Keep what")
        assert terminal.types(no).ends(130) is None


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
