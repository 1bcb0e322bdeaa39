"""`adaptbot run`, from the outside."""

import io
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml
from rich.console import Console

from adaptbot_cli.session import build, sources
from adaptbot_cli.workspace import Workspace
from tests.cli.command import ROOT, Ended, Home, mapped
from tests.cli.shape import is_summary

PACK = ROOT / "kg" / "kitchen"


@dataclass(frozen=True)
class First:
    """The first run of a home: `adaptbot run "make omelette" --json`, recorded."""

    home: Home
    ended: Ended
    transcript: Path

    @property
    def told(self) -> Any:
        return self.ended.json()


@pytest.fixture(scope="module")
def first(used: Home) -> First:
    """Run for the first time."""
    transcript = used.folder / "first.yaml"
    ended = used.adaptbot("run", "make omelette", "--json", "--record", str(transcript))
    assert ended.code == 0, ended.err
    return First(used, ended, transcript)


@pytest.fixture
def again(first: First, tmp_path: Path) -> Home:
    """Return a home as the first run has left it."""
    shutil.copytree(first.home.folder, tmp_path, dirs_exist_ok=True)
    return Home(tmp_path)


def documents(path: Path) -> list[Any]:
    return list(yaml.safe_load_all(path.read_text(encoding="utf-8")))


def test_the_omelette_succeeds(first: First) -> None:
    assert first.told["outcome"] == "executable"
    assert first.told["goal"] == {"met": True, "missing": []}
    assert first.told["findings"] == []
    assert first.told["usage"]["model_calls"] == 0


def test_json_is_one_object_of_the_documented_form(first: First) -> None:
    assert is_summary(first.told)
    assert first.told["planner"] == "plan library"


def test_everything_but_json_goes_to_stderr(first: First) -> None:
    assert "checked" in first.ended.err
    assert "Traceback" not in first.ended.err


def test_replaced_names_come_with_their_evidence(first: First) -> None:
    changes = [change for step in first.told["steps"] for change in step["changes"]]
    assert {("skillet", "pan"), ("whisk", "stir_contents")} <= set(mapped(changes, "from", "to"))
    evidence = {change["from"]: change["evidence"] for change in changes}
    assert "skillet is a kind of pan" in evidence["skillet"]
    assert "whisk" in evidence["whisk"]
    calls = [step["call"] for step in first.told["steps"]]
    assert ["stir_contents", "bowl"] in calls
    assert not any("skillet" in call for call in calls)


def test_what_nobody_needs_is_dropped_and_said_to_be(first: First) -> None:
    dropped = [step for step in first.told["steps"] if step["status"] == "dropped"]
    assert [step["call"][1] for step in dropped] == ["chives", "chives"]
    assert all("chives" in step["message"] for step in dropped)
    assert first.told["questions"] == [{"about": "chives", "kind": "existence", "answer": None}]


def test_the_first_run_makes_a_workspace_with_history(first: First) -> None:
    root = first.home.workspace
    for path in PACK.glob("*.ttl"):
        assert (root / "kg" / "kitchen" / path.name).read_bytes() == path.read_bytes()
    assert (root / "adaptbot.toml").is_file()
    assert first.home.subjects() == ["start: the kitchen as it comes"]
    kg = first.told["kg"]
    assert kg["before"] == kg["after"] and len(kg["before"]) == 40


def test_the_transcript_goes_where_it_is_asked_for(first: First) -> None:
    header, *turns = documents(first.transcript)
    assert header["task"] == "make omelette"
    assert header["graph"] == first.told["kg"]["before"]
    assert [turn["turn"] for turn in turns[:2]] == ["understood", "propose"]
    assert turns[-1]["turn"] == "finished"
    assert not (first.home.workspace / "transcripts").exists()


def test_the_transcript_replays(first: First) -> None:
    ended = first.home.adaptbot("replay", str(first.transcript))
    assert (ended.code, ended.err) == (0, "")
    assert "goal met" in ended.out


def test_the_same_run_leaves_the_same_transcript(first: First, again: Home) -> None:
    second = again.folder / "second.yaml"
    ended = again.adaptbot("run", "make omelette", "--no-human", "--record", str(second))
    assert ended.code == 0
    assert second.read_bytes() == first.transcript.read_bytes()


def test_a_dry_run_shows_everything_and_writes_nothing(home: Home) -> None:
    ended = home.adaptbot("run", "make omelette", "--dry-run", "--apply")
    assert ended.code == 0
    assert home.files() == set()
    assert "executable, goal met" in ended.said
    for told in ('stir_contents("bowl")', 'pick_up_rec("pan")', "dropped", "skillet → pan"):
        assert told in ended.said
    assert "what chives is" in ended.said


def test_apply_commits_the_state_that_the_plan_leaves(first: First, again: Home) -> None:
    ended = again.adaptbot("run", "make omelette", "--apply", "--json")
    told = ended.json()
    assert again.subjects()[1:] == ['state: after "omelette"']
    assert again.trailers()["Task"] == ["omelette"]
    assert told["kg"]["before"] == first.told["kg"]["after"] != told["kg"]["after"]
    show = ["kg", "show", "egg", "--json"]
    now, then, at_first, bad = again.adaptbots(
        [
            show,
            [*show, "--at", told["kg"]["before"][:10]],
            [*show, "--at", "HEAD~1"],
            [*show, "--at", "HEAD~9"],
        ]
    )
    assert (now.json()["place"], now.json()["states"]["IsFried"]) == ("plate", True)
    assert (then.json()["place"], then.json()["states"]["IsFried"]) == ("fridge", False)
    assert at_first.json() == then.json()
    assert bad.code == 4 and "HEAD~9" in bad.err


def test_an_answer_is_learned_and_not_asked_for_again(again: Home) -> None:
    text = "chives: {existence: exists, kind: object, obj_location: fridge}\n"
    answers = again.write("a.yaml", text)
    told = again.adaptbot("run", "make omelette", "--json", "--answers", answers).json()
    assert is_summary(told)
    assert ["chives", "obj_location", "fridge", "state"] in told["learned"]
    assert {("chives", "exists"), ("chives", "fridge")} <= set(
        mapped(told["questions"], "about", "answer")
    )
    assert told["kg"]["nodes"][1] == told["kg"]["nodes"][0] + 1
    assert not any(step["status"] == "dropped" for step in told["steps"])
    trailers = again.trailers()
    assert trailers["Task"] == ["omelette"] and trailers["Planner"] == ["plan library"]
    assert "chives" in trailers["Question-1"][0] and trailers["Answer-2"][0].startswith("fridge")
    assert trailers["Fact-2"] == ["+ chives obj_location fridge"]
    transcript = again.workspace / "transcripts" / trailers["Transcript"][0]
    assert again.adaptbot("replay", str(transcript)).code == 0
    later = again.adaptbot("run", "make omelette", "--json").json()
    assert later["questions"] == [] and later["learned"] == []
    assert ["pick_up_obj", "chives"] in [step["call"] for step in later["steps"]]


def test_an_absence_is_remembered(again: Home) -> None:
    answers = again.write("a.yaml", "chives: {existence: absent}\n")
    told = again.adaptbot("run", "make omelette", "--json", "--answers", answers).json()
    assert told["learned"] == [["kitchen", "absentItem", "chives", "attribute"]]
    assert told["kg"]["nodes"][0] == told["kg"]["nodes"][1]
    later = again.adaptbot("run", "make omelette", "--json").json()
    assert later["questions"] == [] and later["goal"]["met"]
    assert sum(step["status"] == "dropped" for step in later["steps"]) == 2


RUNS = {
    "requires": ["make tea", "--json", "--requires", "tea, moonstone"],
    "not listed": ["cheese sandwich", "--json"],
    "no plan": ["repair the roof", "--json"],
    "paper": ["make tea", "--policy", "paper", "--record", "paper.yaml"],
}


@pytest.fixture(scope="module")
def dry(tmp_path_factory: pytest.TempPathFactory) -> tuple[Home, dict[str, Ended]]:
    """Run several tasks, dry, in a home of their own."""
    home = Home(tmp_path_factory.mktemp("dry"))
    ended = home.adaptbots([["run", *arguments, "--dry-run"] for arguments in RUNS.values()])
    return home, dict(zip(RUNS, ended, strict=True))


Dry = tuple[Home, dict[str, Ended]]


def test_a_required_item_that_is_unknown_is_not_dropped(dry: Dry) -> None:
    ended = dry[1]["requires"]
    told = ended.json()
    assert ended.code == 3 and is_summary(told)
    assert told["outcome"] == "findings" and not told["goal"]["met"]
    assert "moonstone" in {finding["subject"] for finding in told["findings"]}


def test_a_task_that_is_not_listed_uses_what_its_name_tells(dry: Dry) -> None:
    ended = dry[1]["not listed"]
    assert ended.code == 0 and is_summary(ended.json())
    assert any("cheese" in step["call"] for step in ended.json()["steps"])


def test_a_task_without_any_plan_says_how_to_have_a_model(dry: Dry) -> None:
    ended = dry[1]["no plan"]
    assert (ended.code, ended.json()["error"]["code"]) == (5, "model")
    for way in ("--model", "adaptbot.toml", "ADAPTBOT_MODEL", "OPENAI_API_KEY"):
        assert way in ended.said


def test_the_policy_of_the_paper(dry: Dry) -> None:
    home, ended = dry[0], dry[1]["paper"]
    assert ended.code == 0 and "executable, goal met" in ended.said
    assert documents(home.folder / "paper.yaml")[0]["policy"] == "paper"
    assert home.files() == {"paper.yaml"}


def test_every_known_task_has_a_plan_that_meets_its_goal(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path / "none")
    tasks = sources.load(workspace, "kitchen").domain.tasks
    assert len(tasks) >= 50
    failed = [task.name for task in tasks if not _goal_met(task.name, workspace)]
    assert failed == []
    assert list(tmp_path.iterdir()) == []


def _goal_met(task: str, workspace: Workspace) -> bool:
    request = build.Request(task=task, domain="kitchen", model="library", dry_run=True)
    with build.build(request, workspace, {}, Console(file=io.StringIO()), None) as built:
        return built.run().goal_met


def test_a_fault_of_a_hand_edit_is_told(again: Home) -> None:
    path = again.workspace / "kg/kitchen/state.ttl"
    text = path.read_text(encoding="utf-8")
    path.write_text(f"{text}\nex:egg ex:obj_location ex:table .\n", encoding="utf-8")
    ended = again.adaptbot("run", "make tea", "--no-human")
    assert "edited by hand and not committed" in ended.said
    assert "egg" in ended.said and "see adaptbot kg validate" in ended.said
