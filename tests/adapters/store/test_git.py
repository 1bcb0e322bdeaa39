"""Commits of chosen files, checked by the real git where there is one."""

import os
import shutil
import subprocess
import sys
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest

from adaptbot_cli.adapters.store.files import read
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.errors import KnowledgeError

NEEDS_GIT = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git binary here")
WHEN = datetime(2024, 5, 6, 7, 8, 9, tzinfo=timezone(timedelta(hours=5, minutes=30)))


@pytest.fixture(autouse=True)
def _no_configuration(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Keep the tests from the configuration of whoever runs them."""
    for key in [key for key in os.environ if key.startswith("GIT_")]:
        monkeypatch.delenv(key)
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "gitconfig"))
    monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")


def git(folder: Path, *args: str) -> str:
    return subprocess.run(
        ["git", "-c", "user.name=User", "-c", "user.email=user@example.org", *args],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    ).stdout


def commit(repo: Repo, paths: list[str], message: str, when: datetime | None = None) -> str:
    """Commit files as they are on the disk, or as gone."""
    with repo.writing():
        return repo.commit({path: read(repo.root, path) for path in paths}, message, when)


def put(root: Path, **files: str) -> None:
    """Write files; `__` in a name stands for a folder."""
    for name, text in files.items():
        path = root / f"{name.replace('__', '/')}.ttl"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


@pytest.fixture
def users(tmp_path: Path) -> Path:
    """A repository with staged, unstaged, staged-and-changed, deleted and untracked files."""
    top = tmp_path / "users"
    top.mkdir()
    git(top, "init", "-q", "-b", "trunk")
    put(top, kept="1\n", staged="1\n", changed="1\n", both="1\n", gone="1\n", sub__other="1\n")
    git(top, "add", "-A")
    git(top, "commit", "-q", "-m", "start")
    put(top, staged="2\n", both="2\n", new_staged="2\n")
    git(top, "add", "-A")
    git(top, "rm", "-q", "gone.ttl")
    put(top, changed="2\n", both="3\n", untracked="2\n")
    return top


def test_the_first_commit_makes_a_repository(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    assert repo.head() is None
    assert list(repo.log([])) == []
    put(root, kg__a="one\n", b="no\n")
    assert repo.dirty(["kg/a.ttl", "missing.ttl"]) == ["kg/a.ttl"]
    sha = commit(repo, ["kg/a.ttl"], "Learn a", WHEN)
    assert repo.head() == sha
    assert (root / ".git" / "HEAD").read_text() == "ref: refs/heads/main\n"
    assert repo.read("kg/a.ttl", "HEAD") == b"one\n"
    assert repo.read("b.ttl", "HEAD") is None
    assert repo.read("kg", "HEAD") is None
    assert repo.dirty(["kg/a.ttl", "b.ttl"]) == ["b.ttl"]
    assert Repo.open_or_init(root).head() == sha


def test_nothing_changed_makes_no_commit(tmp_path: Path) -> None:
    repo = Repo.open_or_init(tmp_path / "home")
    put(tmp_path / "home", a="one\n")
    sha = commit(repo, ["a.ttl"], "One")
    assert commit(repo, ["a.ttl", "never.ttl"], "Again") == sha
    assert [commit.sha for commit in repo.log(["a.ttl"])] == [sha]


def test_a_removed_file_is_removed(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    put(root, kg__a="one\n", b="two\n")
    commit(repo, ["kg/a.ttl", "b.ttl"], "Two")
    (root / "kg" / "a.ttl").unlink()
    assert repo.dirty(["kg/a.ttl"]) == ["kg/a.ttl"]
    commit(repo, ["kg/a.ttl"], "Gone")
    assert repo.read("kg/a.ttl", "HEAD") is None
    assert repo.read("kg/a.ttl", "HEAD~1") == b"one\n"


@NEEDS_GIT
def test_a_file_and_a_folder_may_change_places(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    (root / "a").write_text("file\n")
    (root / "b").mkdir()
    (root / "b" / "c").write_text("in a folder\n")
    commit(repo, ["a", "b/c"], "One way")
    (root / "a").unlink()
    (root / "a").mkdir()
    (root / "a" / "c").write_text("in a folder\n")
    shutil.rmtree(root / "b")
    (root / "b").write_text("file\n")
    commit(repo, ["a/c", "b"], "The other way")
    assert git(root, "ls-tree", "-r", "--name-only", "HEAD").split() == ["a/c", "b"]
    assert git(root, "status", "--porcelain") == ""
    git(root, "fsck", "--strict")


def test_log_tells_who_when_and_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    put(root, a="1\n", b="1\n")
    commit(repo, ["a.ttl"], "One", WHEN)
    monkeypatch.setenv("GIT_AUTHOR_NAME", "Añn <x>")
    message = (
        "Learn 2 facts\n\nThe body: text.\n\nMore\nlines.\n\n"
        "Task: tea\nQuestion: Is it\n  hot?\nTask: soup\nEmpty:"
    )
    commit(repo, ["b.ttl"], message, WHEN + timedelta(days=1))
    put(root, a="2\n")
    commit(repo, ["a.ttl"], "Not: a trailer", WHEN.astimezone(UTC))
    two, one = repo.log(["a.ttl"])
    assert (two.subject, two.trailers, one.subject) == ("Not: a trailer", (), "One")
    assert one.author == "adaptbot <adaptbot@localhost>"
    assert (one.when, one.when.utcoffset()) == (WHEN, timedelta(hours=5, minutes=30))
    middle = list(repo.log([]))[1]
    assert middle.author == "Añn x <adaptbot@localhost>"
    assert middle.body == "The body: text.\n\nMore\nlines."
    assert middle.trailers == (
        ("Task", "tea"), ("Question", "Is it hot?"), ("Task", "soup"), ("Empty", ""),
    )  # fmt: skip


def test_the_author_is_the_configured_one(tmp_path: Path) -> None:
    (tmp_path / "gitconfig").write_text("[user]\n\tname = Glo\n\temail = glo@example.org\n")
    repo = Repo.open_or_init(tmp_path / "home")
    put(tmp_path / "home", a="1\n")
    commit(repo, ["a.ttl"], "One")
    with (tmp_path / "home" / ".git" / "config").open("a") as config:
        config.write("[user]\n\tname = Loc\n")
    put(tmp_path / "home", a="2\n")
    commit(repo, ["a.ttl"], "Two")
    assert [c.author for c in repo.log([])] == ["Loc <glo@example.org>", "Glo <glo@example.org>"]


def test_revisions_are_found_as_git_finds_them(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    shas = []
    for text in "abc":
        put(root, a=text)
        shas.append(commit(repo, ["a.ttl"], text))
    (root / ".git" / "refs" / "tags" / "first").write_text(shas[0] + "\n")
    for rev, content in [
        ("HEAD", b"c"), ("HEAD~2", b"a"), ("HEAD^", b"b"), (shas[1], b"b"), (shas[1][:7], b"b"),
        (shas[1][:9] + "~1", b"a"),
        ("main", b"c"), ("main~1", b"b"), ("first", b"a"), ("refs/heads/main", b"c"),
    ]:  # fmt: skip
        assert repo.read("a.ttl", rev) == content, rev
    for rev in ["HEAD~3", "nothing", "", "0" * 40, "HEAD:a.ttl", "..", "a b", "HEAD@{0}", "é"]:
        with pytest.raises(KnowledgeError, match="There is no version"):
            repo.read("a.ttl", rev)


@pytest.mark.parametrize("path", ["", "/etc/passwd", "../x", "kg/../../x", ".git/config", "."])
def test_paths_stay_in_the_workspace(tmp_path: Path, path: str) -> None:
    repo = Repo.open_or_init(tmp_path / "home")
    with pytest.raises(KnowledgeError, match="not the name of a file"):
        commit(repo, [path], "No")


@NEEDS_GIT
@pytest.mark.parametrize("folder", [".", "deep/workspace"])
def test_the_users_changes_stay(users: Path, folder: str) -> None:
    root = users / folder
    repo = Repo.open_or_init(root)
    before = git(users, "status", "--porcelain"), git(users, "diff"), git(users, "diff", "--cached")
    put(root, kg__mine="mine\n")
    sha = commit(repo, ["kg/mine.ttl"], "Mine")
    after = git(users, "status", "--porcelain"), git(users, "diff"), git(users, "diff", "--cached")
    assert after == before
    assert git(users, "rev-parse", "trunk").strip() == sha
    assert git(users, "show", "--format=", "--name-status", sha).split() == [
        "A", str(Path(folder) / "kg" / "mine.ttl"),
    ]  # fmt: skip
    git(users, "fsck", "--strict")
    git(users, "commit", "-q", "-m", "user's own")
    assert git(users, "show", "--format=", "--name-only", "HEAD").split() == [
        "both.ttl", "gone.ttl", "new_staged.ttl", "staged.ttl",
    ]  # fmt: skip
    assert repo.read("kg/mine.ttl", "HEAD") == b"mine\n"


@NEEDS_GIT
def test_plain_git_reads_it_well(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    put(root, a="one\ntwo\n")
    first = commit(repo, ["a.ttl"], "One\n\nTask: tea", WHEN)
    put(root, a="one\n2\n")
    second = commit(repo, ["a.ttl"], "Two", WHEN)
    assert git(root, "status", "--porcelain") == ""
    git(root, "fsck", "--strict")
    blame = git(root, "blame", "-l", "-s", "--root", "a.ttl").splitlines()
    assert [line.split()[0] for line in blame] == [first, second]
    assert "-two\n+2\n" in git(root, "log", "-p")
    assert git(root, "log", "--format=%(trailers:key=Task,valueonly)", first).strip() == "tea"
    assert git(root, "log", "-1", "--format=%aI", first).strip() == WHEN.isoformat()


@NEEDS_GIT
def test_modes_are_kept_and_links_refused(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    put(root, tool="#!\n")
    (root / "tool.ttl").chmod(0o755)
    git(root, "add", "tool.ttl")
    git(root, "commit", "-q", "-m", "tool")
    with repo.writing():
        repo.commit({"tool.ttl": b"#!!\n"}, "Tool")
    assert git(root, "ls-tree", "HEAD").split()[0] == "100755"
    assert (root / "tool.ttl").stat().st_mode & 0o777 == 0o755
    assert git(root, "status", "--porcelain") == ""
    (root / "link.ttl").symlink_to("tool.ttl")
    (root / "folder").mkdir()
    (root / "way").symlink_to("folder")
    (root / "folder" / "a.ttl").write_text("a")
    for name in ("link.ttl", "way/a.ttl"):
        with pytest.raises(KnowledgeError, match="symbolic link"):
            commit(repo, [name], "No")
        with pytest.raises(KnowledgeError, match="symbolic link"), repo.writing():
            repo.commit({name: b"no"}, "No")
    assert (root / "tool.ttl").read_bytes() == b"#!!\n"


@NEEDS_GIT
def test_line_ends_are_those_that_git_is_configured_for(users: Path) -> None:
    git(users, "config", "core.autocrlf", "true")
    (users / "mine").write_bytes(b"a\r\nb\r\n")
    repo = Repo.open_or_init(users)
    commit(repo, ["mine"], "Mine")
    shown = subprocess.run(["git", "cat-file", "-p", "HEAD:mine"], cwd=users, capture_output=True)
    assert shown.stdout == b"a\nb\n"
    assert (users / "mine").read_bytes() == b"a\r\nb\r\n"
    assert repo.dirty(["mine"]) == [] and " mine" not in git(users, "status", "--porcelain")


@NEEDS_GIT
def test_a_detached_head_moves_alone(users: Path) -> None:
    git(users, "checkout", "-q", "--detach")
    repo = Repo.open_or_init(users)
    put(users, mine="1\n")
    sha = commit(repo, ["mine.ttl"], "Mine")
    assert git(users, "rev-parse", "HEAD").strip() == sha
    assert git(users, "rev-parse", "trunk~0").strip() == git(users, "rev-parse", "HEAD~1").strip()


@NEEDS_GIT
def test_packed_refs_objects_and_worktrees_are_fine(users: Path, tmp_path: Path) -> None:
    git(users, "gc", "-q")
    git(users, "worktree", "add", "-q", "-b", "side", str(tmp_path / "side"))
    put(tmp_path / "side", kept="side\n")
    sha = commit(Repo.open_or_init(tmp_path / "side"), ["kept.ttl"], "Side")
    assert git(users, "rev-parse", "side").strip() == sha
    put(users, kept="trunk\n")
    assert git(users, "rev-parse", "trunk").strip() != sha
    sha = commit(Repo.open_or_init(users), ["kept.ttl"], "Trunk")
    assert git(users, "rev-parse", "trunk").strip() == sha
    git(users, "fsck", "--strict")


@NEEDS_GIT
def test_a_file_in_a_merge_is_refused(users: Path) -> None:
    git(users, "stash", "-q")
    git(users, "checkout", "-q", "-b", "other")
    put(users, kept="other\n")
    git(users, "commit", "-q", "-a", "-m", "other")
    git(users, "checkout", "-q", "trunk")
    put(users, kept="trunk\n")
    git(users, "commit", "-q", "-a", "-m", "trunk")
    with pytest.raises(subprocess.CalledProcessError):
        git(users, "merge", "other")
    with pytest.raises(KnowledgeError, match="middle of a merge"):
        commit(Repo.open_or_init(users), ["kept.ttl"], "No")


@NEEDS_GIT
def test_no_hook_is_run(users: Path) -> None:
    for name in ("pre-commit", "commit-msg", "post-commit"):
        hook = users / ".git" / "hooks" / name
        hook.parent.mkdir(exist_ok=True)
        hook.write_text("#!/bin/sh\necho ran > ran\nexit 1\n")
        hook.chmod(0o755)
    put(users, mine="1\n")
    commit(Repo.open_or_init(users), ["mine.ttl"], "Mine")
    assert not (users / "ran").exists()


@NEEDS_GIT
def test_what_cannot_be_written_is_refused(tmp_path: Path, users: Path) -> None:
    other = tmp_path / "sha256"
    other.mkdir()
    git(other, "init", "-q", "--object-format=sha256")
    with pytest.raises(KnowledgeError, match="sha256"):
        Repo.open_or_init(other)
    git(users, "update-index", "--split-index")
    put(users, mine="1\n")
    with pytest.raises(KnowledgeError, match="split"):
        commit(Repo.open_or_init(users), ["mine.ttl"], "Mine")


def test_two_processes_lose_no_commit(tmp_path: Path) -> None:
    root = tmp_path / "home"
    repo = Repo.open_or_init(root)
    script = (
        "import sys; from pathlib import Path; from adaptbot_cli.adapters.store.git import Repo\n"
        "root, name = Path(sys.argv[1]), sys.argv[2]\n"
        "for n in range(15):\n"
        "    repo = Repo.open_or_init(root)\n"
        "    with repo.writing():\n"
        "        repo.commit({name: str(n).encode()}, f'{name} {n}')\n"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    command = [sys.executable, "-c", script, str(root)]
    running = [subprocess.Popen([*command, name], env=env) for name in ("a", "b")]
    assert [process.wait() for process in running] == [0, 0]
    assert {c.subject for c in repo.log([])} == {f"{name} {n}" for name in "ab" for n in range(15)}
    assert repo.read("a", "HEAD") == repo.read("b", "HEAD") == b"14"


def test_importing_the_module_does_not_import_pygit2() -> None:
    script = "import sys, adaptbot_cli.adapters.store.git; sys.exit('pygit2' in sys.modules)"
    env = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    assert subprocess.run([sys.executable, "-c", script], env=env).returncode == 0
