"""`adaptbot pending`: what runs without a person leave open, and answering it."""

import shutil
from pathlib import Path

import pytest

from adaptbot_cli.adapters.terminal.plan_editor import Completions
from adaptbot_cli.adapters.transcript.loading import left_over
from tests.cli.attended import CTRL_C, tty
from tests.cli.command import Home
from tests.loopback import says, serving
from tests.worlds import workshop

CHIVES = 'I do not know "chives"'
ANSWERS = "chives: {existence: absent}\n"


@pytest.fixture(scope="module")
def once(used: Home) -> Home:
    """Return a home where a run without a person has left a question open."""
    assert used.adaptbot("run", "make omelette", "--no-human").code == 0
    return used


@pytest.fixture
def waiting(once: Home, tmp_path: Path) -> Home:
    """Return a copy of it."""
    shutil.copytree(once.folder, tmp_path, dirs_exist_ok=True)
    return Home(tmp_path)


def about(home: Home) -> list[str]:
    told = home.adaptbot("pending", "--json").json()
    return [question["about"] for question in told["questions"]]


def test_nothing_is_open_in_a_new_home(home: Home) -> None:
    told = home.adaptbot("pending")
    assert told.code == 0 and "no question is open" in told.said
    assert home.adaptbot("pending", "answer", "--answers", home.write("a", ANSWERS)).code == 0


def test_an_open_question_is_listed_with_what_waits_for_it(waiting: Home) -> None:
    told = waiting.adaptbot("pending", "--json").json()
    [question] = told["questions"]
    assert (question["about"], question["kind"]) == ("chives", "existence")
    assert question["tasks"] == ["omelette"] and question["steps"] > 0
    assert "adaptbot pending answer" in waiting.adaptbot("pending").said
    other = waiting.adaptbot("pending", "--domain", "household").said
    assert "no question is open" in other and "kitchen (1)" in other


def test_what_another_run_has_learned_is_no_longer_open(waiting: Home) -> None:
    told = waiting.write("told.yaml", ANSWERS)
    waiting.adaptbot("run", "omelette with chives and cheese", "--answers", told)
    assert about(waiting) == []
    other = waiting.adaptbot("pending", "--domain", "household").said
    assert "no question is open" in other and "kitchen" not in other


def test_a_file_answers_what_is_open(waiting: Home) -> None:
    told = waiting.write("told.yaml", ANSWERS)
    came = waiting.adaptbot("pending", "answer", "--answers", told, "--json").json()
    assert came["learned"] == ["there is no chives here"] and came["still"] == []
    assert [(task["task"], task["goal"]) for task in came["tasks"]] == [("omelette", True)]
    assert waiting.trailers()["Task"] == ["omelette"]
    assert waiting.trailers()["Transcript"][0].startswith("sittings/")
    assert about(waiting) == []


def test_what_a_file_does_not_tell_stays_open(waiting: Home) -> None:
    empty = waiting.write("told.yaml", "leek: {existence: absent}\n")
    assert waiting.adaptbot("pending", "answer", "--answers", empty).code == 0
    assert about(waiting) == ["chives"]


def test_nobody_is_there_to_answer(waiting: Home) -> None:
    ended = waiting.adaptbot("pending", "answer")
    assert ended.code == 2 and "--answers FILE" in ended.said


def test_a_sitting_in_a_terminal(waiting: Home) -> None:
    with tty(waiting, "pending", "answer") as opened:
        opened.answers((CHIVES, "n"), ("Keep this?", "y"))
        assert opened.ends() == 0
    assert "waiting for the answer: omelette" in opened.said
    assert "omelette: executable, goal met" in opened.said
    assert about(waiting) == []


def test_ctrl_c_changes_nothing_and_the_next_sitting_knows_the_answers(waiting: Home) -> None:
    with tty(waiting, "pending", "answer") as opened:
        opened.answers((CHIVES, "n")).waits("Keep this?")
        opened.process.send(CTRL_C)
        opened.answers(("Keep what you have told so far", "n"))
        assert opened.ends() == 130
    assert "adaptbot pending answer" in opened.said
    assert about(waiting) == ["chives"]
    with tty(waiting, "pending", "answer") as opened:
        opened.answers(("Keep this?", "y"))
        assert opened.ends() == 0
    assert about(waiting) == []


def test_a_sitting_that_is_killed_loses_no_answer(waiting: Home) -> None:
    with tty(waiting, "pending", "answer") as opened:
        opened.answers((CHIVES, "n")).waits("Keep this?")
        opened.kill()
    with tty(waiting, "pending", "answer") as opened:
        opened.answers(("Keep this?", "y"))
        assert opened.ends() == 0
    assert about(waiting) == []


def test_a_sitting_is_no_run(waiting: Home) -> None:
    told = waiting.write("told.yaml", ANSWERS)
    waiting.adaptbot("pending", "answer", "--answers", told)
    folder = waiting.workspace / "transcripts"
    [path] = (folder / "sittings").glob("*.yaml")
    ended = waiting.adaptbot("replay", str(path))
    assert ended.code == 2 and "it is no run" in ended.said
    assert "nothing to resume" in waiting.adaptbot("resume").said
    assert len(left_over(folder, folder / "sittings")) == 1  # the graph says that it is settled


def test_names_are_completed_where_they_can_stand() -> None:
    from prompt_toolkit.completion import CompleteEvent
    from prompt_toolkit.document import Document

    names = Completions.of(workshop())

    def completed(text: str) -> list[str]:
        found = names.get_completions(Document(text), CompleteEvent())
        return [text[: len(text) + c.start_position] + c.text for c in found]

    assert completed("drill") == ["drill_hole"]
    assert completed('drill_hole("boa') == ['drill_hole("board']
    assert "put(board, cupboard" in completed("put(board, cup")


def test_a_run_that_only_an_offer_to_change_the_plan_was_put_off_in_waits_for_nothing(
    home: Home,
) -> None:
    plan = 'pick_up_rec("glass")\nput_down_rec("glass", "countertop")\npick_up_obj("water")\n'
    with serving(says(f'{plan}pour_contents("water", "glass")\nstir_contents("glass")\n')) as at:
        model = ("--model", "openai/planner", "--api-base", at.url, "--replans", "0")
        run = home.adaptbot("run", "lime water", *model, "--requires", "lime,water", "--no-human")
    path = home.transcript
    assert run.code == 3 and "kind: mend" in path.read_text(encoding="utf-8")
    assert "kitchen (1)" not in home.adaptbot("pending", "--domain", "household").said
