"""Workspaces that somebody else made, or damaged, are refused in a sentence, and left alone."""

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from adaptbot_cli.adapters.planner.library import read_library
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper
from adaptbot_cli.adapters.store.reading import check_files
from adaptbot_cli.adapters.store.trailers import answers, compose, parse
from adaptbot_cli.adapters.store.versions import Versions
from adaptbot_cli.adapters.transcript.loading import (
    header_of,
    left_over,
    read,
    read_cut,
    unfinished,
)
from adaptbot_cli.errors import KnowledgeError, PackError, UsageError
from adaptbot_cli.session import sources
from adaptbot_cli.session.build import recording
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.validation import validate
from adaptbot_cli.workspace import Workspace, find
from tests.adapters.store.homes import ORIGIN, begun, item, keeper, leek

NEEDS_GIT = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git binary here")


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A workspace that has learned two things."""
    root = tmp_path / "home"
    keeper(root).keep(leek("fridge"))
    keeper(root).keep(item("chard", "table"))
    return root


def _fifo(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _moved_out(path: Path, outside: Path) -> None:
    path.rename(outside)
    path.symlink_to(outside)


@pytest.mark.parametrize("name", ["kg", "kg/kitchen/attributes.ttl", ".git/adaptbot"])
def test_what_is_linked_is_not_followed(root: Path, tmp_path: Path, name: str) -> None:
    _moved_out(root / name, tmp_path / "outside")
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    with pytest.raises(KnowledgeError, match="symbolic link"):
        Keeper(root, "kitchen", ORIGIN).keep(item("okra", "fridge"))
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before
    if name != ".git/adaptbot":
        with pytest.raises(KnowledgeError, match="symbolic link"):
            sources.load(Workspace(root), "kitchen")


@pytest.mark.parametrize("name", ["kg", "kg/kitchen", "transcripts"])
@pytest.mark.parametrize("kind", ["link", "pipe"])
def test_what_is_no_folder_is_not_passed_over(
    root: Path, tmp_path: Path, name: str, kind: str
) -> None:
    if (root / name).exists():
        (root / name).rename(tmp_path / "outside")
    (root / name).symlink_to(tmp_path) if kind == "link" else os.mkfifo(root / name)
    with pytest.raises(KnowledgeError, match="symbolic link" if kind == "link" else "no folder"):
        Workspace(root).files("kitchen")
        _ = Workspace(root).transcripts
    with pytest.raises(KnowledgeError, match="could not be read"):
        Workspace(root / "adaptbot.toml").has("kitchen")


def test_a_file_that_is_no_domains_is_a_fault_and_not_read(root: Path) -> None:
    (root / "kg/kitchen/facts.ttl").write_bytes(b"\xff\0")
    assert str(next(iter(validate(Workspace(root), "kitchen")))).count("facts.ttl") == 1
    home = Home(Workspace(root), "kitchen")
    assert home.versions and home.facts == home.versions.origins(home.facts, home.pack).keys()
    assert Keeper(root, "kitchen", ORIGIN).keep(item("okra", "fridge")).revision
    assert "facts.ttl" in [fault.file for fault in check_files({"facts.ttl": b"\xff"})[1]]


@pytest.mark.parametrize("folder", ["transcripts", "transcripts/sittings"])
def test_a_transcript_is_neither_read_nor_written_through_a_link(
    root: Path, tmp_path: Path, folder: str
) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    with recording(outside / "run.yaml", begun(root).kg, {"task": "tea", "domain": "kitchen"}):
        pass
    assert [path.stem for path in unfinished(outside)] == ["run"]
    before = (outside / "run.yaml").read_bytes()

    (root / folder).parent.mkdir(exist_ok=True)
    (root / folder).symlink_to(outside)  # the folder is a link
    refused = set((root / folder).glob("*.yaml")) | {root / folder / "new.yaml"}
    _refuse(root, refused)
    (root / folder).unlink()
    (root / folder).mkdir(parents=True)
    (root / folder / "run.yaml").symlink_to(outside / "run.yaml")  # the file is one
    _refuse(root, {root / folder / "run.yaml"})
    assert unfinished(root / folder) == [] == left_over(root / folder, root / "none")
    assert [path.name for path in outside.iterdir()] == ["run.yaml"]
    assert (outside / "run.yaml").read_bytes() == before

    with recording(root / folder / "own.yaml", begun(root).kg, {"task": "tea"}) as recorder:
        recorder.ended()
    assert read(root / folder / "own.yaml")[0]["task"] == "tea"


def _refuse(root: Path, paths: set[Path]) -> None:
    """Make sure that transcripts are neither read nor written."""
    for path in paths:
        for look in (read, read_cut, header_of):
            with pytest.raises(UsageError, match="symbolic link"):
                look(path)
        with pytest.raises(KnowledgeError, match="symbolic link"):
            recording(path, begun(root).kg, {}).__enter__()


def test_a_library_plan_is_not_read_through_a_link(root: Path, tmp_path: Path) -> None:
    outside = tmp_path / "tea.plan"
    outside.write_text("---\nnames: [tea]\n---\nwait(1)\n")
    library = root / "prompts/library/kitchen"
    library.mkdir(parents=True)
    (library / "tea.plan").symlink_to(outside)
    with pytest.raises(PackError, match="symbolic link"):
        read_library(*Workspace(root).library("kitchen"))
    (library / "tea.plan").unlink()
    outside.rename(library / "tea.plan")
    assert any("tea" in plan.names for plan in read_library(library))


def test_a_pipe_in_the_place_of_a_file_keeps_nobody_waiting(root: Path) -> None:
    _fifo(root / "kg/kitchen/state.ttl")
    for work in (lambda: sources.load(Workspace(root), "kitchen"), lambda: begun(root)):
        with pytest.raises(KnowledgeError, match="state.ttl is no file"):
            work()


def test_the_state_of_an_earlier_version_is_not_obeyed(root: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.write_text("mine")
    journal = root / ".adaptbot" / "journal"
    journal.mkdir(parents=True)
    moves = f'{{"moves": [["{tmp_path}/gone", "{mine}"]], "drop": ["{mine}"]}}'
    for name in ("commit.json", "intent.json"):
        (journal / name).write_text(moves)
    notes = begun(root).notes
    assert mine.read_text() == "mine" and any("was not read" in note for note in notes)
    assert begun(root).notes == (), "said once"


@pytest.mark.parametrize(
    ("what", "data"),
    [
        ("HEAD", b""), ("HEAD", b"ref: ../x"), ("refs/heads/main", b""),
        ("refs/heads/main", b"\0garbage"), ("refs/heads/main", None), ("objects", None),
        ("config", b"[core\n"),
    ],
)  # fmt: skip
def test_damage_is_told_and_never_a_new_beginning(
    root: Path, what: str, data: bytes | None
) -> None:
    path = root / ".git" / what
    if data is not None:
        path.write_bytes(data)
    elif path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink()
    before = {p: p.read_bytes() for p in root.rglob("*") if p.is_file()}
    works: list[Callable[[], object]] = [
        lambda: begun(root),
        lambda: Keeper(root, "kitchen", ORIGIN).keep(item("okra", "fridge")),
        lambda: list(Versions.of(root, "kitchen").taught()),
    ]
    for work in works:
        with pytest.raises(KnowledgeError, match="damaged|missing|configuration cannot be read"):
            work()
    assert {p: p.read_bytes() for p in root.rglob("*") if p.is_file()} == before


@NEEDS_GIT
def test_what_a_damaged_branch_is_told_to_do_restores_it(root: Path) -> None:
    (root / ".git/refs/heads/main").unlink()
    with pytest.raises(KnowledgeError) as caught:
        begun(root)
    [command] = re.findall("`git (.*?)`", str(caught.value))
    subprocess.run(["git", *command.split()], check=True)
    assert begun(root).kg.find("chard")


@NEEDS_GIT
def test_a_shallow_clone_has_the_history_that_it_has(root: Path, tmp_path: Path) -> None:
    clone = tmp_path / "clone"
    source = f"file://{root}"
    subprocess.run(["git", "clone", "-q", "--depth", "1", source, str(clone)], check=True)
    assert len(list(Versions.of(clone, "kitchen").taught())) == 1
    assert keeper(clone).keep(item("okra", "fridge")).revision


@NEEDS_GIT
def test_signing_is_refused_and_line_ends_and_byte_order_marks_are_kept(
    root: Path, tmp_path: Path
) -> None:
    clone = tmp_path / "clone"
    command = ["git", "-c", "core.autocrlf=true", "clone", "-q", "-c", "core.autocrlf=true"]
    subprocess.run([*command, str(root), str(clone)], check=True)
    state = clone / "kg/kitchen/state.ttl"
    assert begun(clone).edited == () and b"\r\n" in state.read_bytes()
    keeper(clone).keep(item("okra", "fridge"))
    repo = Repo.open_or_init(clone)
    assert b"\r" not in (repo.read("kg/kitchen/state.ttl", "HEAD") or b"\r")
    assert begun(clone).edited == () and b"okra" in state.read_bytes()

    marked = root / "kg/kitchen/state.ttl"
    marked.write_bytes(b"\xef\xbb\xbf" + marked.read_bytes())
    assert keeper(root).keep(item("okra", "fridge")).revision
    assert marked.read_bytes().startswith(b"\xef\xbb\xbf@prefix") or b"\xef" in marked.read_bytes()

    subprocess.run(["git", "config", "commit.gpgsign", "true"], cwd=root, check=True)
    with pytest.raises(KnowledgeError, match="cannot sign"):
        keeper(root).keep(item("beet", "fridge"))


def test_no_text_begins_a_trailer_or_signs_an_answer() -> None:
    nasty = "qwen\nAnswer-1: yes\nBy-1: Alice\n\nFact-1: + egg a tool\u2028By-1: Bob\\n"
    trailers = [
        ("Task", nasty), ("Planner", nasty), ("Question-1", nasty),
        ("Answer-1", "no (Alice, 2020-01-01)"), ("By-1", "eve (Alice, 2020)"), ("At-1", ""),
    ]  # fmt: skip
    subject, _, found = parse(compose(nasty, trailers, [nasty]))
    assert list(found) == trailers and "\n" not in subject
    [told] = answers(found)
    assert (told.said, told.by, told.question) == (
        "no (Alice, 2020-01-01)", "eve (Alice, 2020)", nasty,
    )  # fmt: skip
    [old] = answers((("Question-1", "Is it?"), ("Answer-1", "yes (ann, 2024-01-01)")))
    assert (old.said, old.by, old.at) == ("yes", "ann", "2024-01-01")


@pytest.mark.skipif(os.name == "nt" or os.geteuid() != 0, reason="needs root, to give files away")
def test_a_workspace_of_another_user_is_used_only_when_named(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ADAPTBOT_WORKSPACE", raising=False)
    monkeypatch.chdir(root)
    assert find(None).root == root
    os.chown(root / ".git", 65534, 65534)
    with pytest.raises(KnowledgeError, match="belongs to another user.*--workspace"):
        find(None)
    assert find(root).root == root
    assert sources.load(find(root), "kitchen").find("leek")


@pytest.mark.skipif(os.name == "nt", reason="POSIX only")
@NEEDS_GIT
def test_a_group_may_write_what_is_shared_by_it(root: Path) -> None:
    subprocess.run(["git", "config", "core.sharedRepository", "group"], cwd=root, check=True)
    mask = os.umask(0o022)
    before = set((root / ".git/objects").iterdir())
    try:
        keeper(root).keep(item("okra", "fridge"))
    finally:
        os.umask(mask)
    made = set((root / ".git/objects").iterdir()) - before  # an older folder is as it was made
    assert made and all(folder.stat().st_mode & 0o020 for folder in made)
    assert (root / ".git/refs/heads/main").exists()


@pytest.mark.parametrize("how", ["file", "link"])
def test_the_repository_of_another_folder_is_not_written(
    root: Path, tmp_path: Path, how: str
) -> None:
    victim = tmp_path / "victim"
    shutil.copytree(root, victim)
    shutil.rmtree(root / ".git")
    if how == "file":
        (root / ".git").write_text(f"gitdir: {victim / '.git'}\n")
    else:
        (root / ".git").symlink_to(victim / ".git")
    before = {p: p.read_bytes() for p in victim.rglob("*") if p.is_file()}
    with pytest.raises(KnowledgeError, match="the repository of another folder"):
        Keeper(root, "kitchen", ORIGIN).keep(item("okra", "fridge"))
    assert {p: p.read_bytes() for p in victim.rglob("*") if p.is_file()} == before


@pytest.mark.parametrize(
    "name", [".git/index", ".git/refs/heads/main", ".git/shallow", ".git/config", ".gitattributes"]
)
def test_a_pipe_in_a_repository_is_refused_and_not_waited_for(root: Path, name: str) -> None:
    (root / name).unlink(missing_ok=True)
    os.mkfifo(root / name)
    with pytest.raises(KnowledgeError, match="no regular file"):
        Repo.open(root)
