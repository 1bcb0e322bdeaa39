"""What was learned is kept whole or not at all, beside what other runs have learned meanwhile."""

import itertools
import re
import subprocess
import sys
import threading
from pathlib import Path
from types import FrameType

import pytest

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper, start
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.turns import Keep
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session import sources
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import ORIGIN, begun, ex, files, item, keeper, learned, leek
from tests.adapters.store.kills import at_one, killed_at


def test_a_second_first_run_leaves_what_a_first_one_has_learned(tmp_path: Path) -> None:
    head = keeper(tmp_path).keep(leek("fridge")).revision
    (tmp_path / "adaptbot.toml").write_text("replans = 1\n", encoding="utf-8")
    assert begun(tmp_path).revision == head
    assert b"ex:leek" in files(tmp_path)["attributes.ttl"]
    assert (tmp_path / "adaptbot.toml").read_text(encoding="utf-8") == "replans = 1\n"


def test_what_a_first_use_writes_is_asked_for_under_the_lock(tmp_path: Path) -> None:
    asked: list[str] = []

    def first() -> dict[str, bytes]:
        def other() -> None:
            try:
                with Repo.open_or_init(tmp_path).writing(timeout=0):
                    asked.append("free")
            except KnowledgeError:
                asked.append("locked")

        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        return Workspace(tmp_path).first_files("kitchen")

    start(tmp_path, "kitchen", first, ORIGIN.now)
    assert asked == ["locked"]


def test_a_commit_that_fails_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adaptbot_cli.adapters.store.git.PATIENCE", 0.0)
    one = keeper(tmp_path)
    head = Repo.open_or_init(tmp_path).head()
    before = files(tmp_path)
    index = tmp_path / ".git" / "index.lock"
    index.write_bytes(b"")
    with pytest.raises(KnowledgeError, match="Another git process is busy"):
        one.keep(leek("fridge"))
    assert files(tmp_path) == before
    index.unlink()
    assert Repo.open_or_init(tmp_path).head() == head
    assert one.keep(leek("fridge")).revision != head


@pytest.mark.parametrize("step", [1, 3, 5, 8, 10, 13, 15, 18, 20])
def test_ctrl_c_in_a_commit_leaves_the_old_or_the_new(tmp_path: Path, step: int) -> None:
    """Ctrl-C at a step of the commit, wherever that is: what is said is what is there."""
    one = keeper(tmp_path)
    one.keep(item("warm", "fridge"))
    before, head = files(tmp_path), Repo.open_or_init(tmp_path).head()
    steps = iter(range(1, 1_000_000))

    def interrupting(frame: FrameType, event: str, argument: object) -> None:
        name = getattr(argument, "__name__", "") if event == "c_call" else ""
        if name in ("fsync", "replace", "link") and next(steps) == step:
            sys.setprofile(None)
            raise KeyboardInterrupt

    sys.setprofile(interrupting)
    with pytest.raises(KeyboardInterrupt):
        one.keep(leek("fridge"))
    now = Repo.open_or_init(tmp_path).head()
    assert (files(tmp_path) == before) == (now == head)
    assert begun(tmp_path).edited == ()
    assert one.keep(item("chard", "fridge")).revision not in (now, head)


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (
            leek("counter"),
            r"leek: place .* has 2 values: counter and fridge \(from the answer",
        ),
        (leek("fridge", "tool"), "leek: is an? .* and an? .*; it can be only one of them"),
        (
            learned((ex("fridge"), ex("rec_location"), ex("fridge"))),
            "rec_location is not declared",
        ),
        (learned((ex("leek"), ex("obj_location"), ex("robot"))), "obj_location.* must be a"),
    ],
    ids=["two places", "two classes", "undeclared", "wrong range"],
)
def test_what_goes_not_with_what_another_run_has_learned_is_refused(
    tmp_path: Path, other: Keep, said: str
) -> None:
    one = keeper(tmp_path)
    head = one.keep(leek("fridge")).revision
    before = files(tmp_path)
    with pytest.raises(KnowledgeError, match=said) as caught:
        one.keep(other)
    assert "Nothing was changed; the answers are in the transcript t.yaml." in str(caught.value)
    assert files(tmp_path) == before
    assert Repo.open_or_init(tmp_path).head() == head


def test_a_thing_in_itself_is_refused(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    kg = begun(tmp_path).kg
    pan = next(iter(kg.find("pan")))
    [(_, place, where)] = kg.facts.triples((pan, ex("mrec_location"), None))
    delta = Delta(frozenset({(pan, place, where)}), frozenset({(pan, place, pan)}))
    with pytest.raises(KnowledgeError, match="pan: is in itself: pan in pan"):
        one.apply("soup", [delta])


def test_a_fault_that_was_there_before_refuses_nothing(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    state = tmp_path / "kg" / "kitchen" / "state.ttl"
    state.write_bytes(state.read_bytes() + b"\nex:egg ex:obj_location ex:counter .\n")
    assert one.keep(leek("fridge")).revision


def interrupted(root: Path) -> Keeper:
    """Leave a commit of the leek that was killed once it was due."""
    one = keeper(root)
    for step in itertools.count(1):
        assert killed_at(step, lambda: one.keep(leek("fridge"))), "it was never due"
        if Repo.open_or_init(root).interrupted():
            break
        begun(root)
    return one


def test_reading_finishes_what_a_killed_run_left(tmp_path: Path) -> None:
    interrupted(tmp_path)
    assert b"ex:leek" not in files(tmp_path)["attributes.ttl"]
    assert sources.load(Workspace(tmp_path), "kitchen").find("leek") == (ex("leek"),)
    assert b"ex:leek" in files(tmp_path)["attributes.ttl"] and at_one(tmp_path)


def test_what_somebody_has_edited_meanwhile_is_left_alone(tmp_path: Path) -> None:
    """Neither forward nor over it: the interrupted commit is undone where it can be."""
    interrupted(tmp_path)
    head = Repo.open_or_init(tmp_path).head()
    attributes = tmp_path / "kg/kitchen/attributes.ttl"
    attributes.write_bytes(attributes.read_bytes() + b"\n# mine\n")
    assert not sources.load(Workspace(tmp_path), "kitchen").find("leek")
    assert attributes.read_bytes().endswith(b"# mine\n")
    assert Repo.open_or_init(tmp_path).head() == head and at_one(tmp_path)


def test_a_commit_of_other_files_meanwhile_comes_before(tmp_path: Path) -> None:
    interrupted(tmp_path)
    for name in ("index.lock", "refs/heads/main.lock"):  # as git itself would be told to
        (tmp_path / ".git" / name).unlink(missing_ok=True)
    (tmp_path / "notes").write_text("mine")
    git = ["git", "-c", "user.name=User", "-c", "user.email=user@example.org"]
    subprocess.run([*git, "add", "notes"], cwd=tmp_path, check=True)
    subprocess.run([*git, "commit", "-qm", "mine"], cwd=tmp_path, check=True)
    assert sources.load(Workspace(tmp_path), "kitchen").find("leek")
    subjects = [commit.subject for commit in Repo.open_or_init(tmp_path).log()]
    assert subjects[:2] == ["learn: there is leek", "mine"] and at_one(tmp_path)


def test_a_commit_whose_objects_are_gone_is_undone_and_said(tmp_path: Path) -> None:
    interrupted(tmp_path)
    record = tmp_path / ".git" / "adaptbot" / "intent.json"
    said = record.read_text()
    [commit] = re.findall('"commit": "([0-9a-f]{40})"', said)
    (tmp_path / ".git" / "objects" / commit[:2] / commit[2:]).unlink()
    start = begun(tmp_path)
    assert any("was interrupted" in note for note in start.notes)
    assert start.edited == () and not start.kg.find("leek") and at_one(tmp_path)
    assert keeper(tmp_path).keep(leek("fridge")).revision


@pytest.mark.parametrize("said", ["", "{}", "[1]", "[" * 100_000, '{"commit": 1}', "\0"])
def test_a_record_that_is_damaged_is_told(tmp_path: Path, said: str) -> None:
    keeper(tmp_path)
    (tmp_path / ".git" / "adaptbot" / "intent.json").write_text(said)
    with pytest.raises(KnowledgeError, match="is damaged.*remove that record"):
        begun(tmp_path)


def test_reading_without_an_interrupted_write_takes_no_lock(tmp_path: Path) -> None:
    keeper(tmp_path)
    with Repo.open_or_init(tmp_path).writing():
        assert sources.load(Workspace(tmp_path), "kitchen").find("egg")


def test_where_a_fact_comes_from_is_told_from_the_commit_that_has_it(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.keep(leek("fridge"))
    assert one.trace("leek obj_location fridge") == "exists"
    assert one.trace("onion IsLiquid false") == "from the kitchen as it came"
