"""What was learned is kept whole or not at all, beside what other runs have learned meanwhile."""

import sys
import threading
from pathlib import Path
from types import FrameType

import pytest

from adaptbot_cli import session
from adaptbot_cli.adapters.store.files import lock, settle, write_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.opening import start
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.turns import Keep
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import ORIGIN, begun, ex, files, item, keeper, learned, leek


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
                with lock(tmp_path, timeout=0):
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
    monkeypatch.setattr("adaptbot_cli.adapters.store.git.repo._PATIENCE", 0.0)
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


@pytest.mark.parametrize("step", [1, 5, 10, 15, 20, 25, 30, 35, 40])
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


def interrupted(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave a write of state.ttl that was killed once it held."""
    keeper(root)

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("adaptbot_cli.adapters.store.files.journal._settle", killed)
        with pytest.raises(KeyboardInterrupt), lock(root):
            attributes = root / "kg" / "kitchen" / "attributes.ttl"
            leek = b'\nex:leek a ex:object ; ex:obj_name "leek" .\n'
            write_files(root, {"kg/kitchen/attributes.ttl": attributes.read_bytes() + leek})


def test_reading_finishes_what_a_killed_run_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(tmp_path, monkeypatch)
    assert b"ex:leek" not in files(tmp_path)["attributes.ttl"]
    assert session.load(Workspace(tmp_path), "kitchen").find("leek") == (ex("leek"),)
    assert b"ex:leek" in files(tmp_path)["attributes.ttl"]


def test_a_workspace_that_cannot_be_written_is_read_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(tmp_path, monkeypatch)
    monkeypatch.setattr("os.access", lambda *_: False)
    assert session.load(Workspace(tmp_path), "kitchen").find("leek") == ()


def test_reading_without_an_interrupted_write_takes_no_lock(tmp_path: Path) -> None:
    settle(tmp_path)
    settle(tmp_path / "missing")
    assert list(tmp_path.iterdir()) == []
    keeper(tmp_path)
    with lock(tmp_path):
        assert session.load(Workspace(tmp_path), "kitchen").find("egg")


def test_where_a_fact_comes_from_is_told_from_the_commit_that_has_it(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.keep(leek("fridge"))
    assert one.trace("leek obj_location fridge") == "exists"
    assert one.trace("onion IsLiquid false") == "from the kitchen as it came"
