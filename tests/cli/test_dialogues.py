"""Whole dialogues in a real terminal of 80 columns, and Ctrl-C at each of their questions."""

import re
import shutil
import signal
from pathlib import Path
from typing import Any

import pytest
import yaml

from adaptbot_cli.adapters.store.git import Repo
from tests.cli.attended import CTRL_C, DOWN, ENTER, UP, tty
from tests.cli.command import Home

EXISTS, ABSENT, SAME, LATER = "y", "n", "a", "l"

CHIVES = 'I do not know "chives"'
FORM = 'What do you know of "chives"'
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


def turns(home: Home) -> list[Any]:
    """Return the turns of the only transcript."""
    (path,) = (home.workspace / "transcripts").glob("*.yaml")
    _, *found = yaml.safe_load_all(path.read_text(encoding="utf-8"))
    return found


def told(home: Home) -> list[str]:
    """Return the answers that the only transcript holds."""
    return [turn["answer"] for turn in turns(home) if turn["turn"] == "ask"]


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
    assert "finished" not in {turn["turn"] for turn in turns(there)}


def test_an_item_that_exists_is_learned_with_its_place(home: Home) -> None:
    dialogue = [(CHIVES, EXISTS), ('What is "chives"', "1"), (FORM, f"fri{ENTER}\t")]
    with tty(home, "run", "make omelette") as opened:
        opened.answers(*dialogue, ("Keep this", ENTER))
        opened.sees("executable, goal met")
        assert opened.ends() == 0
    assert told(home) == ["exists", "object", "fridge"]
    assert len(home.subjects()) == 2
    trailers = home.trailers()
    assert "+ chives obj_location fridge" in trailers["Fact-2"]
    assert trailers["Answer-2"] == ["fridge"] and trailers["By-2"][0]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT.*", trailers["At-2"][0])


def test_another_name_is_learned(home: Home) -> None:
    dialogue = [(CHIVES, SAME), ("Which one is", f"parsl{ENTER}"), ("Keep this", "y")]
    with tty(home, "run", "make omelette") as opened:
        opened.answers(*dialogue)
        assert opened.ends() == 0
    assert told(home) == ["is parsley"]
    assert home.trailers()["Fact-1"] == ["+ parsley alias chives"]


def test_an_absence_is_learned(home: Home) -> None:
    with tty(home, "run", "make omelette") as opened:
        opened.answers((CHIVES, ABSENT), ("Keep this", "y"))
        assert opened.ends() == 0
    assert "dropped" in opened.screen
    assert home.trailers()["Fact-1"] == ["+ kitchen absentItem chives"]


def test_what_is_refused_in_the_review_is_not_committed(there: Home) -> None:
    forget(there, "salad")
    before = knowledge(there)
    with tty(there, "run", "salad") as opened:
        opened.answers(('Can "cucumber" be sliced', "y"), ("Keep this", "n"))
        assert opened.ends() == 3  # without the answer the plan is not known to be executable
    assert "committed as" not in opened.screen
    assert knowledge(there) == before
    assert [turn["kept"] for turn in turns(there) if turn["turn"] == "review"] == [False]


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
SALAD = ("make salad", "--requires", "shallot")


def test_one_new_object_costs_four_prompts_and_at_most_eight_keys(home: Home) -> None:
    dialogue = [
        (SHALLOT, EXISTS),
        ('What is "shallot"', ENTER),
        ('What do you know of "shallot"', f"fri{ENTER}{ENTER}"),
        ("Keep this", ENTER),
    ]
    with tty(home, "run", *SALAD) as opened:
        opened.answers(*dialogue)
        assert opened.ends() == 0
    assert len(dialogue) <= 4
    assert sum(len(keys) for _, keys in dialogue) <= 8
    assert "executable, goal met" in opened.screen
    assert told(home) == ["exists", "object", "fridge"]


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
    path = next((home.workspace / "transcripts").glob("*.yaml"))
    assert "suggestion" in path.read_text() and "✓" in home.adaptbot("replay", str(path)).out

    assert home.adaptbot("undo", "--suggestions", "--yes").code == 0
    left = home.adaptbot("kg", "why", "shallot", "--json")
    assert "suggestion" not in left.out
    again = home.adaptbot("undo", "--suggestions", "--yes")
    assert again.code == 2 and "no suggestion that was accepted" in again.err


def test_back_corrects_an_answer_and_keeps_the_others(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "3"))
        opened.answers(('What do you know of "shallot"', "\x1b"), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}\t"), ("Keep this", ENTER))
        assert opened.ends() == 0
    facts = learned(home)
    assert "+ shallot type object" in facts and "+ shallot type tool" not in facts
    path = next((home.workspace / "transcripts").glob("*.yaml"))
    assert "✓" in home.adaptbot("replay", str(path)).out


def test_the_review_keeps_a_part(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}{ENTER}"))
        opened.answers(("Keep this", f"\x1b[B\x1b[B {ENTER}"))
        assert opened.ends() == 0
    facts = learned(home)
    assert "+ shallot type object" in facts and "+ shallot obj_location fridge" in facts
    assert not any("IsLiquid" in fact for fact in facts) and "all but 1" in opened.screen


def test_a_new_thing_is_not_kept_without_the_place_that_the_plan_was_judged_on(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}{ENTER}"))
        opened.answers(("Keep this", f"\x1b[B {ENTER}"))
        assert opened.ends() == 3
    assert "all but 5" in opened.screen


def test_what_the_review_left_out_stays_so_after_a_correction(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}{ENTER}"))
        up = "\x1b[A"
        opened.answers(("Keep this", f"{up} {up}c"))  # the last left out, the one before corrected
        opened.answers(('What do you know of "shallot"', ENTER), ("Keep this", ENTER))
        opened.ends()
    assert "all but 1" in opened.screen


def test_ctrl_c_keeps_what_was_told_if_the_person_says_so(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}"))
        opened.answers(('What do you know of "shallot"', CTRL_C))
        opened.answers(("Keep what you have told so far", "y"), ("Keep this", ENTER))
        opened.ends()
    facts = learned(home)
    assert "+ shallot type object" in facts and "+ shallot obj_location fridge" in facts
    assert not any("shallot sliceable" in fact for fact in facts)
    assert turns(home)[-1]["turn"] == "finished"


def test_the_review_goes_back_and_asks_at_ctrl_c_as_a_question_does(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}\t"), ("Keep this", "\x1b"))
        opened.answers(('What do you know of "shallot"', f"\x7fcup{ENTER}\t"))
        opened.answers(("Keep this", CTRL_C), ("Keep what you have told so far", "y"))
        assert opened.ends() == 0
    assert "a correction" in opened.screen
    assert "+ shallot obj_location fridge" not in learned(home)
    assert any(fact.startswith("+ shallot obj_location") for fact in learned(home))


FILLED = f"fri{ENTER}nyn{ENTER}"
"""The fridge; no liquid, to be sliced, not to be boiled; the rest as it is likely."""


def test_a_correction_shows_the_whole_form_and_keeps_its_other_lines(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', FILLED))
        opened.answers(("Keep this", f"{DOWN * 4}c"))  # its being boiled
        opened.waits('What do you know of "shallot"')
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
    path = next((home.workspace / "transcripts").glob("*.yaml"))
    assert "✓" in home.adaptbot("replay", str(path)).out


def test_ctrl_c_in_a_form_that_is_shown_again_keeps_all_of_it(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', FILLED))
        opened.answers(("Keep this", f"{DOWN * 3}c"))  # its being sliced
        opened.answers(('What do you know of "shallot"', f"n{CTRL_C}"))
        opened.answers(("Keep what you have told so far", "y"), ("Keep this", ENTER))
        opened.ends()
    facts = learned(home)
    assert "+ shallot obj_location fridge" in facts and "+ shallot IsLiquid false" in facts
    assert "+ shallot IsSliceable false" in facts


def test_a_run_cut_off_in_a_correction_goes_on_with_the_whole_form(home: Home) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.answers(('What do you know of "shallot"', FILLED))
        opened.answers(("Keep this", f"{DOWN * 4}c"), ('What do you know of "shallot"', CTRL_C))
        opened.answers(("Keep what you have told so far", "n"))
        assert opened.ends() == 130
    with tty(home, "resume") as opened:
        opened.answers(('What do you know of "shallot"', f"{DOWN * 3}y{ENTER}"))
        opened.answers(("Keep this", ENTER))
        assert opened.ends() == 0
    facts = learned(home)
    assert "+ shallot obj_location fridge" in facts and "+ shallot IsSliceable true" in facts
    assert "+ shallot IsLiquid false" in facts and "+ shallot Boilable true" in facts


@pytest.mark.parametrize("way", ["ctrl-c", "kill", "cut"])
def test_a_run_that_was_cut_off_goes_on_with_its_answers(home: Home, way: str) -> None:
    with tty(home, "run", *SALAD) as opened:
        opened.answers((SHALLOT, EXISTS), ('What is "shallot"', "1"))
        opened.waits('What do you know of "shallot"')
        opened.command.kill(signal.SIGINT if way == "ctrl-c" else signal.SIGKILL)
        if way == "ctrl-c":
            opened.answers(("Keep what you have told so far", "n"))
            assert opened.ends() == 130
        else:
            opened.command.wait()
    if way == "cut":
        (path,) = (home.workspace / "transcripts").glob("*.yaml")
        path.write_bytes(path.read_bytes() + b"---\nturn: ask\nkind: place\nabout: shal")
    with tty(home, "resume") as opened:
        opened.answers(('What do you know of "shallot"', f"fri{ENTER}\t"), ("Keep this", ENTER))
        assert opened.ends() == 0
    assert SHALLOT not in opened.screen.replace("? " + SHALLOT, "")
    assert "+ shallot obj_location fridge" in home.trailers()["Fact-2"]
    ended = home.adaptbot("resume")
    assert ended.code == 2 and "nothing to resume" in ended.said
    assert "not ended" not in home.adaptbot("kg", "status").said
