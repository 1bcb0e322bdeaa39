"""What was learned is kept whole or not at all, beside what other runs have learned meanwhile."""

import threading
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import pytest
from rdflib import RDF, Literal, URIRef

from adaptbot_cli import session
from adaptbot_cli.adapters.store import keeper as keeping
from adaptbot_cli.adapters.store.files import lock, settle
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper, Origin
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.questions import Answer, Question
from adaptbot_cli.core.terms import Triple
from adaptbot_cli.core.turns import Keep
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.workspace import Workspace

EX = "http://example.org/"
ORIGIN = Origin("plan library", "t.yaml", lambda: datetime(2025, 1, 1, tzinfo=UTC))


def ex(name: str) -> URIRef:
    return URIRef(EX + name)


def keeper(root: Path) -> Keeper:
    """Return the keeper of a run that begins now."""
    home = Workspace(root)
    kg = session.load(home, "kitchen")
    return Keeper(root, "kitchen", kg, ORIGIN, partial(home.first_files, "kitchen"))


def learned(*triples: Triple) -> Keep:
    """Return the turn that keeps these facts."""
    question = Question("existence", "leek", "Is there leek?")
    lesson = Lesson(Delta(added=frozenset(triples)), question, Answer("exists"), "there is leek")
    return Keep(Task("soup", ()), (lesson,))


def leek(place: str, kind: str = "object") -> Keep:
    """Return the turn that keeps a new item."""
    return learned(
        (ex("leek"), RDF.type, ex(kind)),
        (ex("leek"), ex("obj_name" if kind == "object" else "tool_name"), Literal("leek")),
        (ex("leek"), ex("obj_location"), ex(place)),
    )


def files(root: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (root / "kg" / "kitchen").iterdir()}


def test_a_second_first_run_leaves_what_a_first_one_has_learned(tmp_path: Path) -> None:
    one, two = keeper(tmp_path), keeper(tmp_path)
    one.start()
    head = one.keep(leek("fridge")).revision
    (tmp_path / "adaptbot.toml").write_text("replans = 1\n", encoding="utf-8")
    assert two.start() == head
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

    Keeper(tmp_path, "kitchen", keeper(tmp_path).kg, ORIGIN, first).start()
    assert asked == ["locked"]


def test_a_commit_that_fails_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adaptbot_cli.adapters.store.git.repo._PATIENCE", 0.0)
    one = keeper(tmp_path)
    head = one.start()
    before = files(tmp_path)
    index = tmp_path / ".git" / "index.lock"
    index.write_bytes(b"")
    with pytest.raises(KnowledgeError, match="Another git process is busy"):
        one.keep(leek("fridge"))
    assert files(tmp_path) == before
    index.unlink()
    assert Repo.open_or_init(tmp_path).head() == head
    assert one.keep(leek("fridge")).revision != head


def test_ctrl_c_in_a_commit_changes_nothing(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.start()
    before = files(tmp_path)

    def stopped() -> datetime:
        """The clock is read when the files are written and the commit is about to be made."""
        assert files(tmp_path) != before
        raise KeyboardInterrupt

    interrupted = replace(one, origin=replace(one.origin, now=stopped))
    with pytest.raises(KeyboardInterrupt):
        interrupted.keep(leek("fridge"))
    assert files(tmp_path) == before


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (leek("counter"), "leek: obj_location has 2 values: counter and fridge"),
        (leek("fridge", "tool"), "leek: is an? .* and an? .*; it can be only one of them"),
        (
            learned((ex("fridge"), ex("rec_location"), ex("fridge"))),
            "rec_location is not declared",
        ),
        (learned((ex("leek"), ex("obj_location"), ex("robot"))), "obj_location must be a"),
    ],
    ids=["two places", "two classes", "undeclared", "wrong range"],
)
def test_what_goes_not_with_what_another_run_has_learned_is_refused(
    tmp_path: Path, other: Keep, said: str
) -> None:
    one = keeper(tmp_path)
    one.start()
    head = one.keep(leek("fridge")).revision
    before = files(tmp_path)
    with pytest.raises(KnowledgeError, match=said) as caught:
        one.keep(other)
    assert "Nothing was changed; the answers are in the transcript t.yaml." in str(caught.value)
    assert files(tmp_path) == before
    assert Repo.open_or_init(tmp_path).head() == head


def test_a_thing_in_itself_is_refused(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.start()
    pan = next(iter(one.kg.find("pan")))
    [(_, place, where)] = one.kg.facts.triples((pan, ex("mrec_location"), None))
    delta = Delta(frozenset({(pan, place, where)}), frozenset({(pan, place, pan)}))
    with pytest.raises(KnowledgeError, match="pan: is in itself: pan in pan"):
        one.apply("soup", [delta])


def test_a_fault_that_was_there_before_refuses_nothing(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.start()
    state = tmp_path / "kg" / "kitchen" / "state.ttl"
    state.write_bytes(state.read_bytes() + b"\nex:egg ex:obj_location ex:counter .\n")
    assert one.keep(leek("fridge")).revision


def interrupted(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave a write of state.ttl that was killed once it held."""
    one = keeper(root)
    one.start()

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("adaptbot_cli.adapters.store.files.journal._settle", killed)
        with pytest.raises(KeyboardInterrupt), lock(root):
            attributes = root / "kg" / "kitchen" / "attributes.ttl"
            leek = b'\nex:leek a ex:object ; ex:obj_name "leek" .\n'
            keeping.write_files(root, {"kg/kitchen/attributes.ttl": attributes.read_bytes() + leek})


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
    keeper(tmp_path).start()
    with lock(tmp_path):
        assert session.load(Workspace(tmp_path), "kitchen").find("egg")
