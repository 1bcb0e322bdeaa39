"""Whole dialogues in a real terminal of 80 columns, and Ctrl-C at each of their questions."""

import re
import shutil
import signal
from pathlib import Path

import pytest

from adaptbot_cli.adapters.store.git import Repo
from tests.cli.attended import CTRL_C, DOWN, ENTER, ESC, UP, tty
from tests.cli.command import Home

EXISTS, ABSENT, SAME, LATER = "y", "n", "a", "l"

CHIVES = 'I do not know "chives"'
TABLE = 'I do not know "table"'
KIND = 'What is "table"'

Dialogue = list[tuple[str, str]]

QUESTIONS: dict[str, tuple[str, Dialogue, str]] = {
    "existence": ("omelette", [], TABLE),
    "which one": ("omelette", [(TABLE, SAME)], "Which one is"),
    "kind": ("omelette", [(TABLE, EXISTS)], KIND),
    "place": (
        "omelette",
        [(TABLE, EXISTS), (KIND, "1")],
        'What do you know of "table"',
    ),
    "attribute": ("salad", [], 'Can "cucumber" be sliced'),
    "review": ("salad", [('Can "cucumber" be sliced', "y")], "Keep this"),
}


@pytest.fixture
def there(seeded: Home, tmp_path: Path) -> Home:
    """Return a home with a workspace and no transcript."""
    shutil.copytree(seeded.folder, tmp_path, dirs_exist_ok=True)
    return Home(tmp_path)


FORGET = {
    "omelette": r"(?ms)^ex:table .*?^\.\n",  # the table
    "salad": r"(?ms)(?<=^ex:cucumber rdf:type ex:object ;\n)(.*?)    ex:IsSliceable true ;\n",
}
"""What a home has to forget so that a task raises questions: entries of its Turtle files."""


def forget(home: Home, task: str) -> None:
    """Take something out of a home's knowledge, and commit that."""
    pack = home.workspace / "kg" / "kitchen"
    for path in (pack / "attributes.ttl", pack / "state.ttl"):
        text = path.read_text(encoding="utf-8")
        path.write_text(re.sub(FORGET[task], _first_group, text, count=1), encoding="utf-8")
    files = [f"kg/kitchen/{path.name}" for path in pack.glob("*.ttl")]
    repo = Repo.open_or_init(home.workspace)
    with repo.writing():
        repo.commit({name: (home.workspace / name).read_bytes() for name in files}, "forget")


def _first_group(match: re.Match[str]) -> str:
    return match[1] if match.re.groups else ""


def knowledge(home: Home) -> dict[str, bytes]:
    """Return what must not change unless it is committed: the graph, and where HEAD is."""
    found = {str(path): path.read_bytes() for path in home.workspace.rglob("*.ttl")}
    return {**found, "HEAD": str(Repo.open_or_init(home.workspace).head()).encode()}


def told(home: Home) -> list[str]:
    """Return the answers that the only transcript holds."""
    return [turn["answer"] for turn in home.documents()[1:] if turn["turn"] == "ask"]


def learned(home: Home) -> list[str]:
    """Return the facts of the last commit."""
    return [f for key, facts in home.trailers().items() if key.startswith("Fact") for f in facts]


@pytest.mark.parametrize(
    ("question", "way"),
    [
        *((name, "key") for name in QUESTIONS),
        *((name, "signal") for name in ("existence", "place", "review")),
    ],
)
def test_ctrl_c_changes_nothing_and_keeps_the_answers(there: Home, question: str, way: str) -> None:
    task, dialogue, waiting = QUESTIONS[question]
    forget(there, task)
    before = knowledge(there)
    with tty(there, "run", task) as opened:
        opened.answers(*dialogue).waits(waiting)
        if way == "key":
            opened.process.send(CTRL_C)
        else:
            opened.command.kill(signal.SIGINT)
        if question in ("kind", "place", "review"):
            opened.answers(("Keep what you have told so far", "n"))
        assert opened.ends() == 130
    assert "Traceback" not in opened.screen
    assert "interrupted; nothing was committed. To go on: adaptbot resume" in opened.screen
    assert knowledge(there) == before
    assert len(told(there)) == {"which one": 0}.get(question, len(dialogue))
    assert "finished" not in {turn["turn"] for turn in there.documents()[1:]}


def test_what_is_refused_in_the_review_is_not_committed(there: Home) -> None:
    forget(there, "salad")
    before = knowledge(there)
    with tty(there, "run", "salad") as opened:
        opened.answers(('Can "cucumber" be sliced', "y"), ("Keep this", "n"))
        assert opened.ends() == 3  # without the answer the plan is not known to be executable
    assert "committed as" not in opened.screen
    assert knowledge(there) == before
    assert [turn["kept"] for turn in there.documents()[1:] if turn["turn"] == "review"] == [False]


def test_json_in_a_terminal_has_stdout_alone(home: Home) -> None:
    out = home.folder / "out.json"
    with tty(home, "run", "omelette", "--json", out=out) as opened:
        assert opened.answers((CHIVES, LATER)).ends() == 0
    assert out.read_text(encoding="utf-8").startswith("{\n") and "\x1b" not in out.read_text()


@pytest.mark.parametrize("env", [{"NO_COLOR": "1"}, {"TERM": "dumb"}], ids=["NO_COLOR", "dumb"])
def test_no_colour_where_none_is_wanted(home: Home, env: dict[str, str]) -> None:
    with tty(home, "run", "make omelette", **env) as opened:
        opened.answers((CHIVES, f"{LATER}{ENTER if 'TERM' in env else ''}"))
        assert opened.ends() == 0
    colours = re.findall(r"\x1b\[(?:\d+;)*[34]\d[;m]", opened.screen)
    assert colours == []
    assert "executable, goal met" in opened.screen


SHALLOT = 'I do not know "shallot"'
WHAT, ABOUT = 'What is "shallot"', 'What do you know of "shallot"'
TOLD = "Keep what you have told so far"
OMELETTE = ("make omelette",)
SALAD = ("make salad", "--requires", "shallot")
FRIDGE = (ABOUT, f"fri{ENTER}{ENTER}")
FILLED = f"fri{ENTER}nyn{ENTER}"
"""The fridge; no liquid, to be sliced, not to be boiled; the rest as it is likely."""


LEARNED: dict[str, tuple[tuple[str, ...], Dialogue, list[str], list[str]]] = {
    "an item that exists, with its place": (
        SALAD,
        [(SHALLOT, EXISTS), (WHAT, ENTER), FRIDGE, ("Keep this", ENTER)],
        ["exists", "object", "fridge"],
        ["+ shallot type object", "+ shallot obj_location fridge"],
    ),
    "another name": (
        OMELETTE,
        [(CHIVES, SAME), ("Which one is", f"parsl{ENTER}"), ("Keep this", "y")],
        ["is parsley"],
        ["+ parsley alias chives"],
    ),
    "an absence": (
        OMELETTE,
        [(CHIVES, ABSENT), ("Keep this", "y")],
        ["absent"],
        ["+ kitchen absentItem chives"],
    ),
}


@pytest.mark.parametrize("name", LEARNED)
def test_what_is_answered_is_learned(home: Home, name: str) -> None:
    task, dialogue, answers, facts = LEARNED[name]
    assert len(dialogue) <= 4
    if task is SALAD:  # a new object, which costs no more than eight keys
        assert sum(len(keys) for _, keys in dialogue) <= 8
    with tty(home, "run", *task) as opened:
        opened.answers(*dialogue)
        opened.sees("executable, goal met")
        assert opened.ends() == 0
    assert told(home) == answers and {*facts} <= {*learned(home)}
    assert len(home.subjects()) == 2
    trailers, last = home.trailers(), f"-{len(facts)}"
    assert trailers[f"Answer{last}"] == answers[-1:] and trailers[f"By{last}"][0]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT.*", trailers[f"At{last}"][0])


def test_what_was_only_suggested_is_told_from_what_was_said_and_taken_back_at_once(
    home: Home,
) -> None:
    """Through a pipe, as a screen reader or a program answers."""
    keys = b"y\n\n1 fri\n1\n\n\n"
    run = home.adaptbot("run", *SALAD, stdin=keys, ADAPTBOT_PLAIN="1")
    assert run.code == 0, run.err
    trailers = home.trailers()
    assert "+ shallot obj_location fridge" in learned(home)
    suggested = [key for key in trailers if key.startswith("Suggested")]
    assert suggested and len(suggested) < sum(key.startswith("Answer") for key in trailers)
    assert "accepted suggestion, as for" in home.adaptbot("kg", "why", "shallot").said
    assert "accepted suggestion, as for" in home.adaptbot("kg", "log").said
    assert "suggestion" in home.transcript.read_text() and home.replays()

    assert home.adaptbot("undo", "--suggestions", "--yes").code == 0
    left = home.adaptbot("kg", "why", "shallot", "--json")
    assert "suggestion" not in left.out
    again = home.adaptbot("undo", "--suggestions", "--yes")
    assert again.code == 2 and "no suggestion that was accepted" in again.err


SAID: dict[str, tuple[Dialogue, int, tuple[str, ...], tuple[str, ...], str]] = {
    "back corrects an answer and keeps the others": (
        [(WHAT, "3"), (ABOUT, ESC), (WHAT, "1"), (ABOUT, f"fri{ENTER}\t"), ("Keep this", ENTER)],
        0, ("type object", "obj_location fridge"), ("type tool",), "goal met",
    ),
    "the review keeps a part": (
        [(WHAT, "1"), FRIDGE, ("Keep this", f"{DOWN}{DOWN} {ENTER}")],
        0, ("type object", "obj_location fridge"), ("IsLiquid",), "all but 1",
    ),
    "a thing is not kept without the place that the plan was judged on": (
        [(WHAT, "1"), FRIDGE, ("Keep this", f"{DOWN} {ENTER}")], 3, (), (), "all but 5",
    ),
    "what the review left out stays so after a correction": (
        [(WHAT, "1"), FRIDGE, ("Keep this", f"{UP} {UP}c"), (ABOUT, ENTER), ("Keep this", ENTER)],
        0, ("type object",), (), "all but 1",
    ),
    "Ctrl-C keeps what was told": (
        [(WHAT, "1"), (ABOUT, f"fri{ENTER}"), (ABOUT, CTRL_C), (TOLD, "y"), ("Keep this", ENTER)],
        0, ("type object", "obj_location fridge"), ("IsSliceable",), "",
    ),
    "the review goes back, and asks at Ctrl-C as a question does": (
        [(WHAT, "1"), (ABOUT, f"fri{ENTER}\t"), ("Keep this", ESC),
         (ABOUT, f"\x7fcup{ENTER}\t"), ("Keep this", CTRL_C), (TOLD, "y")],
        0, ("obj_location",), ("obj_location fridge",), "a correction",
    ),
    "Ctrl-C in a form that is shown again keeps all of it": (
        [(WHAT, "1"), (ABOUT, FILLED), ("Keep this", f"{DOWN * 3}c"), (ABOUT, f"n{CTRL_C}"),
         (TOLD, "y"), ("Keep this", ENTER)],
        3, ("obj_location fridge", "IsLiquid false", "IsSliceable false"), (), "",
    ),
}  # fmt: skip
"""What is answered, the exit code, what is learned and what is not, and what is shown."""


@pytest.mark.parametrize("name", SAID)
def test_of_a_new_object_is_learned_what_was_told(home: Home, name: str) -> None:
    dialogue, code, there, never, shown = SAID[name]
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), *dialogue)
        assert opened.ends() == code
    facts = "\n".join(learned(home)) if there else ""
    assert all(f"+ shallot {fact}" in facts for fact in there), facts
    assert not any(f"+ shallot {fact}" in facts for fact in never), facts
    assert shown in opened.screen and home.documents()[1:][-1]["turn"] == "finished"
    assert home.replays()


def test_a_correction_shows_the_whole_form_and_keeps_its_other_lines(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), (WHAT, "1"))
        opened.answers((ABOUT, FILLED))
        opened.answers(("Keep this", f"{DOWN * 4}c"))  # its being boiled
        opened.waits(ABOUT)
        opened.process.expect_exact("y: yes, n: no")
        shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", opened.process.before)
        assert re.search(r"place +fridge", shown) and re.search(r"» boilable +no", shown)
        assert re.search(r"liquid +no", shown) and re.search(r"sliceable +yes", shown)
        opened.process.send(f"y{UP * 4}cup{ENTER}{ENTER}")
        opened.answers(("Keep this", ENTER))
        assert opened.ends() == 0
    facts = learned(home)
    assert "+ shallot IsLiquid false" in facts and "+ shallot IsSliceable true" in facts
    assert "+ shallot Boilable true" in facts and "+ shallot obj_location fridge" not in facts
    assert any(fact.startswith("+ shallot obj_location") for fact in facts)
    assert home.replays()


def test_a_run_cut_off_in_a_correction_goes_on_with_the_whole_form(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), (WHAT, "1"))
        opened.answers((ABOUT, FILLED))
        opened.answers(("Keep this", f"{DOWN * 4}c"), (ABOUT, CTRL_C))
        opened.answers((TOLD, "n"))
        assert opened.ends() == 130
    with tty(home, "resume") as opened:
        opened.answers((ABOUT, f"{DOWN * 3}y{ENTER}"))
        opened.answers(("Keep this", ENTER))
        assert opened.ends() == 0
    facts = learned(home)
    assert "+ shallot obj_location fridge" in facts and "+ shallot IsSliceable true" in facts
    assert "+ shallot IsLiquid false" in facts and "+ shallot Boilable true" in facts


@pytest.mark.parametrize("way", ["ctrl-c", "kill", "cut"])
def test_a_run_that_was_cut_off_goes_on_with_its_answers(home: Home, way: str) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), (WHAT, "1"))
        opened.waits(ABOUT)
        opened.command.kill(signal.SIGINT if way == "ctrl-c" else signal.SIGKILL)
        if way == "ctrl-c":
            opened.answers((TOLD, "n"))
            assert opened.ends() == 130
        else:
            opened.command.wait()
    if way == "cut":
        (path,) = (home.workspace / "transcripts").glob("*.yaml")
        path.write_bytes(path.read_bytes() + b"---\nturn: ask\nkind: place\nabout: shal")
    with tty(home, "resume") as opened:
        opened.answers((ABOUT, f"fri{ENTER}\t"), ("Keep this", ENTER))
        assert opened.ends() == 0
    assert SHALLOT not in opened.screen.replace("? " + SHALLOT, "")
    assert "+ shallot obj_location fridge" in home.trailers()["Fact-2"]
    ended = home.adaptbot("resume")
    assert ended.code == 2 and "nothing to resume" in ended.said
    assert "not ended" not in home.adaptbot("kg", "status").said
