"""A person's edits of the Turtle files are used, told, and left for the person to commit."""

import itertools
import shutil
import subprocess
from pathlib import Path

import pytest
from rdflib import Literal

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper
from adaptbot_cli.errors import KnowledgeError
from tests.adapters.store.homes import begun, ex, files, item, keeper, learned, leek

ATTRIBUTES, STATE = "kg/kitchen/attributes.ttl", "kg/kitchen/state.ttl"
NEEDS_GIT = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git binary here")


@pytest.fixture
def one(tmp_path: Path) -> Keeper:
    return keeper(tmp_path)


def edit(root: Path, path: str, text: str) -> None:
    with (root / path).open("a", encoding="utf-8") as file:
        file.write(text)


def committed(root: Path, path: str) -> str:
    repo = Repo.open_or_init(root)
    return (repo.read(path, repo.head() or "") or b"").decode()


def test_edits_are_committed_first_as_a_commit_of_their_own(one: Keeper, tmp_path: Path) -> None:
    edit(tmp_path, ATTRIBUTES, '\n# mine\nex:mug a ex:mreceptacle ; ex:rec_name "mug" .\n')
    start = begun(tmp_path)
    assert start.edited == (ATTRIBUTES,) and start.kg.find("mug")
    one.keep(leek("fridge"))
    repo = Repo.open_or_init(tmp_path)
    learn, edits = itertools.islice(repo.log(), 2)
    assert edits.subject == "hand edit: attributes.ttl"
    assert edits.trailers == (("Source", "hand edit"),)
    before, after = (repo.read(ATTRIBUTES, commit.sha) or b"" for commit in (edits, learn))
    assert b"# mine\nex:mug a ex:mreceptacle" in before and b"ex:leek" not in before
    assert b"ex:leek" in after and repo.dirty([ATTRIBUTES, STATE]) == []


def test_what_is_learned_may_rest_on_an_edit(one: Keeper, tmp_path: Path) -> None:
    edit(tmp_path, ATTRIBUTES, '\nex:mug a ex:mreceptacle ; ex:rec_name "mug" .\n')
    one.keep(learned((ex("mug"), ex("deep_rec"), Literal(True))))
    assert "ex:mug" in committed(tmp_path, ATTRIBUTES)
    assert begun(tmp_path).edited == ()


@NEEDS_GIT
def test_what_is_staged_of_edits_with_faults_stays_staged(one: Keeper, tmp_path: Path) -> None:
    edit(tmp_path, ATTRIBUTES, "\nex:mug a ex:mreceptacle .\n")  # without a name
    subprocess.run(["git", "add", ATTRIBUTES], cwd=tmp_path, check=True)
    edit(tmp_path, ATTRIBUTES, '\nex:jug a ex:mreceptacle ; ex:rec_name "jug" .\n')
    one.keep(leek("fridge"))

    def added(*args: str) -> set[str]:
        shown = subprocess.run(
            ["git", "diff", *args], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout
        heads = [
            line.split()[0] for line in shown.splitlines() if line.startswith(("+ex:", "-ex:"))
        ]
        # A block may stand elsewhere in files that a person has not kept in order.
        return {h for h in heads if f"{'+-'[h[0] == '+']}{h[1:]}" not in heads}

    assert added("--cached") == {"+ex:mug"}
    assert added() == {"+ex:jug"}
    assert added("HEAD~1", "HEAD") == {"+ex:leek"}


def test_broken_turtle_ends_the_run_before_anything_is_written(one: Keeper, tmp_path: Path) -> None:
    edit(tmp_path, STATE, "\nex:egg ex:obj_location\n")
    before = files(tmp_path)
    for attempt in (lambda: begun(tmp_path), lambda: one.keep(leek("fridge"))):
        with pytest.raises(KnowledgeError, match=r"state.ttl, line \d+: this is no valid Turtle"):
            attempt()
    assert files(tmp_path) == before


def test_a_fault_in_an_edit_is_not_committed(one: Keeper, tmp_path: Path) -> None:
    edit(tmp_path, STATE, "\nex:egg ex:obj_location ex:counter .\n")
    one.keep(item("chard", "fridge"))
    assert "ex:counter ." not in committed(tmp_path, STATE)
    assert "ex:chard" in committed(tmp_path, STATE)


def test_nor_is_one_beside_a_damaged_version(one: Keeper, tmp_path: Path) -> None:
    one.keep(leek("fridge"))
    edit(tmp_path, ATTRIBUTES, "\nex:mug a ex:mreceptacle .\n")  # without a name
    repo = Repo.open_or_init(tmp_path)
    head = repo.head()
    sha = repo.blobs(head, [ATTRIBUTES])[ATTRIBUTES]
    (tmp_path / ".git/objects" / sha[:2] / sha[2:]).unlink()
    with pytest.raises(KnowledgeError, match="git fsck"):
        one.keep(item("chard", "fridge"))
    assert repo.head() == head


def test_a_hand_written_pack_with_faults_is_used_and_left_uncommitted(tmp_path: Path) -> None:
    keeper(tmp_path / "other")
    root = tmp_path / "home"
    shutil.copytree(tmp_path / "other" / "kg", root / "kg")
    edit(root, STATE, "\nex:egg ex:obj_location ex:pluto .\n")
    start = begun(root)
    assert STATE in start.edited and start.kg.find("egg")
    assert Repo.open_or_init(root).read(STATE, start.revision or "") is None


def test_comments_elsewhere_in_a_hand_written_file_survive(one: Keeper, tmp_path: Path) -> None:
    text = (tmp_path / ATTRIBUTES).read_text(encoding="utf-8")
    comments = [line for line in text.splitlines() if line.lstrip().startswith("#")]
    assert comments
    one.keep(leek("fridge"))
    egg = (ex("egg"), ex("IsBig"), Literal(False))
    one.keep(learned((ex("egg"), ex("IsBig"), Literal(True)), removed=frozenset({egg})))
    after = (tmp_path / ATTRIBUTES).read_text(encoding="utf-8").splitlines()
    assert [line for line in after if line.lstrip().startswith("#")] == comments
