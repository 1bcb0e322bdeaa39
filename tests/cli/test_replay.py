"""`adaptbot replay`, from the outside."""

import os
import shutil

import pytest

from tests.cli.command import ROOT, TRANSCRIPTS, Ended, Home

ABSENT = (TRANSCRIPTS / "item-absent.yaml").read_text(encoding="utf-8")
HEADER = "adaptbot: 1\ntask: make omelette\ndomain: kitchen\ngraph: bundled\n"
PLAN = '---\nturn: propose\nreply: |\n  pick_up_obj("egg")\n'

FILES = {
    "same": ABSENT,
    "other step": ABSENT.replace("'changed: stir_contents(\"bowl\")'", "'ok: wait(1)'"),
    "other answer": ABSENT.replace("answer: absent", "answer: later"),
    "other outcome": ABSENT.replace("goal_met: true", "goal_met: false"),
    "left over": ABSENT + "---\nturn: propose\nreply: 'wait(1)'\n",
    "cut short": ABSENT[: ABSENT.index("---\nturn: ask")],
    "unknown key": ABSENT.replace("about: chives\n", "about: chives\nmood: calm\n"),
    "empty": "",
    "prose": "Once upon a time, there was a robot.\n",
    "no yaml": "{[}\n",
    "no header": PLAN,
    "other version": HEADER.replace("1", "99") + PLAN,
    "a turn without a name": HEADER + "---\nreply: 'wait(1)'\n",
    "a number for a text": HEADER + "---\nturn: propose\nreply: 5\n",
    "a text for a number": HEADER + "replans: many\n" + PLAN,
    "one name for a list": HEADER + "requires: egg\n" + PLAN,
    "no policy": HEADER + "policy: fancy\n" + PLAN,
    "an object": HEADER + "---\n!!python/object/apply:os.system ['true']\n",
    "other domain": HEADER.replace("kitchen", "../../etc") + PLAN,
    "a folder beside the workspace's": HEADER.replace("kitchen", "../beside").replace(
        "bundled", "HEAD"
    )
    + PLAN,
    "no such revision": HEADER.replace("bundled", "0123456789") + PLAN,
}
DIFFERENT = {
    "other step": ("turn 4 (checked)", "entry 7", "wait(1)", "stir_contents"),
    "other answer": ("turn 3", "learned"),
    "other outcome": ("(finished)", "goal_met"),
    "left over": ("turn 7", "goes on with propose"),
    "cut short": ("turn 2", "ask chives", "its end"),
    "unknown key": ("turn 2 (ask)", "mood"),
}
UNREADABLE = {
    "empty": "holds no YAML documents",
    "prose": "is no transcript",
    "no yaml": "is no transcript",
    "no header": "adaptbot: 1",
    "other version": "adaptbot: 1",
    "a turn without a name": "document 2",
    "a number for a text": "`reply:`",
    "a text for a number": "`replans:`",
    "one name for a list": "`requires:`",
    "no policy": "`policy:`",
    "an object": "is no transcript",
    "other domain": 'no domain "../../etc"',
    "a folder beside the workspace's": 'no domain "../beside"',
}


@pytest.fixture(scope="module")
def ended(used: Home) -> dict[str, Ended]:
    """Replay every file alone."""
    files = {name: used.write(f"{name}.yaml", text) for name, text in FILES.items()}
    (used.folder / "binary.yaml").write_bytes(bytes(range(256)))
    files |= {"binary": "binary.yaml", "missing": "missing.yaml", "a folder": str(used.folder)}
    good = [str(TRANSCRIPTS / name) for name in ("goal-not-met.yaml", "re-prompt.yaml")]
    several = ["replay", good[0], files["other outcome"], good[1]]
    told = used.adaptbots([*(["replay", file] for file in files.values()), several])
    return dict(zip([*files, "several"], told, strict=True))


def test_a_transcript_replays(ended: dict[str, Ended]) -> None:
    assert ended["same"].code == 0
    assert "executable, goal met" in ended["same"].said


@pytest.mark.parametrize("name", DIFFERENT)
def test_a_difference_names_turn_and_content(ended: dict[str, Ended], name: str) -> None:
    assert ended[name].code == 3
    for told in (f"{name}.yaml", *DIFFERENT[name]):
        assert told in ended[name].said


@pytest.mark.parametrize("name", UNREADABLE)
def test_what_is_no_transcript_is_refused(ended: dict[str, Ended], name: str) -> None:
    assert (ended[name].code, ended[name].out) == (2, "")
    assert UNREADABLE[name] in ended[name].said
    assert "Traceback" not in ended[name].err


@pytest.mark.parametrize("name", ["binary", "missing", "a folder"])
def test_a_file_that_cannot_be_read(ended: dict[str, Ended], name: str) -> None:
    assert ended[name].code == 2
    assert ended[name].err.startswith("error: ")


def test_a_domain_that_is_a_path_is_never_read(home: Home) -> None:
    bundled = ROOT / "kg"
    pack = home.folder / "pack"
    shutil.copytree(bundled / "kitchen", pack)
    path = os.path.relpath(pack, bundled)
    told = home.adaptbot("replay", home.write("odd.yaml", ABSENT.replace("kitchen", path, 1)))
    assert (told.code, told.out) == (2, "")
    assert f'no domain "{path}"; there is household, kitchen' in told.said


def test_a_revision_of_no_workspace(ended: dict[str, Ended]) -> None:
    assert ended["no such revision"].code == 4
    assert "0123456789" in ended["no such revision"].err


def test_one_bad_transcript_among_good_ones(ended: dict[str, Ended]) -> None:
    several = ended["several"]
    assert several.code == 3
    assert [line[0] for line in several.out.splitlines() if line[0] in "✓✗"] == ["✓", "✗", "✓"]
    assert "goal not met" in several.out


def test_a_run_without_any_plan_has_ended(home: Home) -> None:
    assert home.adaptbot("run", "make shakshuka", "--no-human").code == 5
    path = home.transcript
    resumed = home.adaptbot("resume")
    assert resumed.code == 2 and "nothing to resume" in resumed.said
    replayed = home.adaptbot("replay", str(path))
    assert replayed.code == 0 and "no_plan, goal not met" in replayed.said


def test_a_replay_makes_no_workspace(ended: dict[str, Ended], used: Home) -> None:
    assert not used.workspace.exists()


def test_a_run_of_several_tasks_is_recorded_replayed_and_resumed(home: Home) -> None:
    ran = home.adaptbot("run", "make tea and then an omelette", "--no-human", "--json")
    path = home.transcript
    whole = path.read_text(encoding="utf-8")
    assert ran.code == 0 and ran.json()["request"]["tasks"] == ["tea", "omelette"]
    assert home.adaptbot("replay", str(path)).code == 0

    first, second = (n for n in range(len(whole)) if whole.startswith("---\nturn: propose", n))
    for cut in (first, second):  # as if the machine had stopped before each plan
        path.write_text(whole[:cut], encoding="utf-8")
        resumed = home.adaptbot("resume", "--json")
        assert resumed.code == 0, resumed.said
        told, before = resumed.json(), ran.json()
        assert told["request"] == before["request"] and told["steps"] == before["steps"]
        [new] = set((home.workspace / "transcripts").glob("*.yaml")) - {path}
        assert home.adaptbot("replay", str(new)).code == 0
        new.unlink()


def test_a_task_of_several_that_fails_replays_as_it_ended(home: Home) -> None:
    ran = home.adaptbot("run", "tea and an omelette without eggs", "--no-human", "--json")
    path = home.transcript
    assert (ran.code, ran.json()["goal"]["met"]) == (3, False)
    assert home.adaptbot("replay", str(path)).code == 0
