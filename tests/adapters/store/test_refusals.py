"""A disk that is full, a folder that may not be written, a repository in a bad state: a sentence,
and nothing has changed."""

import os
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper, create
from adaptbot_cli.adapters.store.versions import Versions
from adaptbot_cli.bounded import open_text
from adaptbot_cli.errors import KnowledgeError
from tests.adapters.store.homes import ORIGIN, begun, files, item, keeper, leek

AS_ROOT = pytest.mark.skipif(
    os.name == "nt" or os.geteuid() != 0, reason="needs root, to mount or to act as another user"
)
NEEDS_GIT = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git binary here")


def git(folder: Path, *args: str) -> str:
    command = ["git", "-c", "user.name=User", "-c", "user.email=user@example.org", *args]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def apart(work: Callable[[], object]) -> str:
    """Do something in a process of its own; return the sentence of the KnowledgeError it raised."""
    listen, tell = os.pipe()
    if os.fork() == 0:
        said = "died"
        try:
            work()
            said = ""
        except KnowledgeError as error:
            said = str(error)
        except BaseException as error:
            said = f"not a sentence: {error!r}"
        finally:
            os.write(tell, said.encode())
            os._exit(0)
    os.close(tell)
    with os.fdopen(listen, "rb") as pipe:
        said = pipe.read().decode()
    os.wait()
    return said


def state(root: Path) -> tuple[dict[str, bytes], str | None]:
    return files(root), Repo.open_or_init(root).head()


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of two megabytes."""
    disk = tmp_path / "disk"
    disk.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(disk)], capture_output=True
    )
    if done.returncode:
        pytest.skip("no disk can be mounted here")
    yield disk
    subprocess.run(["umount", str(disk)], check=True)


@AS_ROOT
def test_a_full_disk_changes_nothing(small_disk: Path) -> None:
    """However little room is left, a commit is made whole or refused in a sentence."""
    root = small_disk / "home"
    one = keeper(root)
    filler = small_disk / "filler"
    refused = 0
    for left in (0, 4096, 8192, 16384, 32768, 49152, 57344, 65536, 73728, 98304, 131072):
        free = os.statvfs(small_disk).f_bavail * os.statvfs(small_disk).f_frsize
        with filler.open("wb") as file:
            file.write(b"\0" * max(0, free - left))
        before = state(root)
        said = apart(lambda left=left: one.keep(item(f"thing_{left}", "fridge")))
        filler.unlink()
        if said:
            refused += 1
            assert "No space left" in said or "disk is full" in said, said
            assert state(root) == before
        assert begun(root).edited == ()
    assert refused >= 3
    assert one.keep(leek("fridge")).revision == Repo.open_or_init(root).head()


@AS_ROOT
def test_a_first_use_of_a_full_disk_says_so(small_disk: Path) -> None:
    (small_disk / "filler").write_bytes(b"\0" * (2 * 1024 * 1024 - 8 * 4096))
    said = apart(lambda: keeper(small_disk / "home"))
    assert "No space left" in said or "disk is full" in said
    (small_disk / "filler").unlink()
    assert begun(small_disk / "home").revision


@pytest.mark.skipif(os.name == "nt", reason="POSIX only")
def test_a_limit_of_the_file_size_changes_nothing(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    before = state(tmp_path)

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
        one.keep(leek("fridge"))

    assert "could not be written, nothing was changed" in apart(limited)
    assert state(tmp_path) == before
    assert one.keep(leek("fridge")).revision != before[1]


@AS_ROOT
@pytest.mark.parametrize("folder", ["", ".git", ".git/objects", "kg/kitchen", ".git/adaptbot"])
def test_a_folder_that_may_not_be_written_changes_nothing(folder: str) -> None:
    with tempfile.TemporaryDirectory() as name:
        root = Path(name) / "home"
        keeper(root)
        Path(name).chmod(0o755)
        for path in (root, *root.rglob("*")):
            os.chown(path, 65534, 65534)
        for path in ((root / folder), *(root / folder).rglob("*")):
            if not folder or path.is_relative_to(root / folder):
                os.chown(path, 0, 0)

        def as_another() -> None:
            os.setgroups([])
            os.setgid(65534)
            os.setuid(65534)
            os.environ["HOME"] = name
            Keeper(root, "kitchen", ORIGIN).keep(leek("fridge"))

        subprocess.run(
            ["git", "config", "--global", "--add", "safe.directory", "*"],
            env={"HOME": name, "PATH": os.environ["PATH"]},
        )
        before = files(root)
        said = apart(as_another)
        assert "ermission" in said and "not a sentence" not in said, said
        assert files(root) == before


@AS_ROOT
@NEEDS_GIT
def test_two_accounts_of_a_group_write_what_is_shared_by_it() -> None:
    """Each with a umask that lets nobody else write; each over what the other has written."""
    with tempfile.TemporaryDirectory() as name:
        root = Path(name) / "home"
        root.mkdir()
        git(root, "init", "-q", "--shared=group")
        keeper(root).keep(item("beet", "sink"))
        list(Versions.of(root, "kitchen").taught())  # another account may not import what it takes
        Path(name).chmod(0o755)
        for path in (root, *root.rglob("*")):
            os.chown(path, 65001, 65010)
            path.chmod(0o2775 if path.is_dir() else path.stat().st_mode)

        def by(account: int, work: Callable[[], object]) -> None:
            def as_account() -> None:
                os.setgroups([])
                os.setgid(65010)
                os.setuid(account)
                os.umask(0o022)
                os.environ["HOME"] = name
                work()

            assert apart(as_account) == ""

        by(65001, lambda: Keeper(root, "kitchen", ORIGIN).keep(leek("fridge")))
        by(65002, lambda: Keeper(root, "kitchen", ORIGIN).keep(item("chard", "table")))
        by(65002, lambda: list(Versions.of(root, "kitchen").taught()))
        by(65001, lambda: Keeper(root, "kitchen", ORIGIN).keep(item("okra", "sink")))
        by(65001, lambda: list(Versions.of(root, "kitchen").taught()))
        for n, account in enumerate((65001, 65002, 65001)):
            by(account, lambda n=n: open_text(root / f"transcripts/{n}.yaml", root).close())
            by(account, lambda: open_text(root / "transcripts/0.yaml", root).close())
        kg = begun(root).kg
        assert all(kg.find(thing) for thing in ("leek", "chard", "okra"))
        owners = {path.stat().st_uid for path in (root / ".git/objects").rglob("*")}
        assert {65001, 65002} <= owners
        git(root, "-c", "safe.directory=*", "fsck", "--strict")


@NEEDS_GIT
class TestRepositories:
    """A workspace in a repository that somebody works in."""

    @pytest.fixture(autouse=True)
    def _no_configuration(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(tmp_path / "gitconfig"))
        monkeypatch.setenv("GIT_CONFIG_NOSYSTEM", "1")

    @pytest.fixture
    def top(self, tmp_path: Path) -> Path:
        """A repository with a staged, an unstaged and an untracked change of other files."""
        top = tmp_path / "top"
        top.mkdir()
        git(top, "init", "-q", "-b", "trunk")
        git(top, "config", "user.name", "Configured")
        git(top, "config", "user.email", "configured@example.org")
        (top / "sub" / "home").mkdir(parents=True)
        for name in ("staged", "unstaged", "sub/home/README"):
            (top / name).write_text("1\n")
        git(top, "add", "-A")
        git(top, "commit", "-q", "-m", "begin")
        (top / "staged").write_text("2\n")
        git(top, "add", "staged")
        (top / "unstaged").write_text("2\n")
        (top / "untracked").write_text("2\n")
        return top

    CHANGES = "M  staged\n M unstaged\n?? untracked\n"

    def test_only_our_paths_in_a_folder_of_it(self, top: Path) -> None:
        root = top / "sub" / "home"
        one = keeper(root)
        one.keep(leek("fridge"))
        assert git(top, "status", "--porcelain") == self.CHANGES
        assert not (root / ".git").exists()
        shown = git(top, "show", "--stat", "--format=%an %ae %cn", "HEAD")
        assert shown.startswith("Configured configured@example.org Configured\n")
        assert "sub/home/kg/kitchen/attributes.ttl" in shown and "staged" not in shown
        blamed = git(top, "blame", "-s", "HEAD", "--", "sub/home/kg/kitchen/attributes.ttl")
        new = [line for line in blamed.splitlines() if "leek" in line]
        head = git(top, "rev-parse", "HEAD").strip()
        assert new and all(head.startswith(line.split()[0].strip("^")) for line in new)

    def test_without_a_git_binary(self, top: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("PATH", "")
        revision = keeper(top / "sub" / "home").keep(leek("fridge")).revision
        monkeypatch.undo()
        assert git(top, "rev-parse", "HEAD").strip() == revision

    def test_a_detached_head(self, top: Path) -> None:
        keeper(top / "sub" / "home")
        git(top, "checkout", "-q", "--detach")
        trunk = git(top, "rev-parse", "trunk")
        revision = Keeper(top / "sub" / "home", "kitchen", ORIGIN).keep(leek("fridge")).revision
        assert git(top, "rev-parse", "HEAD").strip() == revision
        assert git(top, "rev-parse", "trunk") == trunk

    def test_a_merge_under_way_elsewhere(self, top: Path) -> None:
        one = keeper(top / "sub" / "home")
        git(top, "stash", "-q")
        git(top, "checkout", "-q", "-b", "other")
        (top / "unstaged").write_text("other\n")
        git(top, "commit", "-q", "-am", "other")
        git(top, "checkout", "-q", "trunk")
        (top / "unstaged").write_text("trunk\n")
        git(top, "commit", "-q", "-am", "trunk")
        subprocess.run(["git", "merge", "-q", "other"], cwd=top, capture_output=True)
        assert "UU unstaged" in git(top, "status", "--porcelain")
        assert one.keep(leek("fridge")).revision
        assert "UU unstaged" in git(top, "status", "--porcelain")
        (top / "unstaged").write_text("both\n")
        git(top, "commit", "-q", "-am", "merged")
        assert begun(top / "sub" / "home").kg.find("leek")

    def test_a_lock_left_by_a_killed_git(self, top: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("adaptbot_cli.adapters.store.git.PATIENCE", 0.1)
        one = keeper(top / "sub" / "home")
        before = state(top / "sub" / "home")
        for name in ("index.lock", "refs/heads/trunk.lock"):
            (top / ".git" / name).write_bytes(b"")
            with pytest.raises(KnowledgeError, match="if none is, remove .*lock"):
                one.keep(leek("fridge"))
            assert state(top / "sub" / "home") == before
            (top / ".git" / name).unlink()
        assert one.keep(leek("fridge")).revision

    @pytest.mark.parametrize("broken", ["HEAD", "index", "config", "objects", "refs/heads/trunk"])
    def test_a_damaged_repository_is_told_in_a_sentence(self, top: Path, broken: str) -> None:
        root = top / "sub" / "home"
        keeper(root)
        path = top / ".git" / broken
        if path.is_dir():
            shutil.rmtree(path)
            path.mkdir()
        else:
            path.write_bytes(b"\0garbage\xff" * 9)
        before = files(root)
        with pytest.raises(KnowledgeError) as caught:
            Keeper(root, "kitchen", ORIGIN).keep(leek("fridge"))
        assert str(top) in str(caught.value) or ".git" in str(caught.value)
        assert files(root) == before

    def test_a_bare_repository_around_it_does_not_count(self, tmp_path: Path) -> None:
        git(tmp_path, "init", "-q", "--bare", "bare.git")
        root = tmp_path / "bare.git" / "home"
        root.mkdir()
        assert keeper(root).keep(leek("fridge")).revision
        assert (root / ".git").is_dir()


def test_a_start_that_git_refuses_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("adaptbot_cli.adapters.store.git.PATIENCE", 0.1)
    root = tmp_path / "home"
    create(root, {"kg/one/domain.ttl": b"# one\n"}, {}, "one")
    held = root / ".git" / "index.lock"
    held.write_bytes(b"")
    with pytest.raises(KnowledgeError, match="if none is, remove .*lock"):
        create(root, {"kg/two/domain.ttl": b"# two\n"}, {}, "two")
    assert not (root / "kg/two/domain.ttl").exists()
    held.unlink()
    assert create(root, {"kg/two/domain.ttl": b"# two\n"}, {}, "two")
