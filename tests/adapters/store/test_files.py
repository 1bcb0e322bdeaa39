"""Writes that leave the old or the new, whole: after kills, full disks and refused folders."""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from adaptbot_cli.adapters.store.files import lock, recover, write_files
from adaptbot_cli.errors import KnowledgeError

ENV = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), "PYTHONDONTWRITEBYTECODE": "1"}
IMPORTS = (
    "import os, sys; from pathlib import Path\n"
    "from adaptbot_cli.adapters.store.files import lock, recover, write_files\n"
    "from adaptbot_cli.errors import KnowledgeError\n"
    "root = Path(sys.argv[1])\n"
)
# Root may write anywhere, so it becomes someone else.
AS_ANOTHER = "if os.geteuid() == 0: os.setgroups([]), os.setgid(65534), os.setuid(65534)\n"
POSIX = pytest.mark.skipif(os.name == "nt", reason="POSIX only")
AS_ROOT = pytest.mark.skipif(
    os.name == "nt" or os.geteuid() != 0, reason="needs root, to act as another user"
)


def run(script: str, root: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", IMPORTS + script, str(root)]
    return subprocess.run(command, env=ENV, text=True, capture_output=True)


def content(root: Path) -> dict[str, bytes]:
    """Read all files but the tool's own."""
    files = (path for path in root.rglob("*") if path.is_file())
    names = {path.relative_to(root).as_posix(): path.read_bytes() for path in files}
    return {name: data for name, data in names.items() if not name.startswith(".adaptbot/")}


@pytest.fixture
def shared() -> Iterator[Path]:
    """A folder that other users can reach too."""
    folder = Path(tempfile.mkdtemp())
    folder.chmod(0o777)
    yield folder
    shutil.rmtree(folder)


def test_files_are_written_and_folders_made(tmp_path: Path) -> None:
    with lock(tmp_path):
        write_files(tmp_path, {"a": b"1", "kg/new/b.ttl": "é\r\n".encode()})
        write_files(tmp_path, {"a": b"2"})
    assert content(tmp_path) == {"a": b"2", "kg/new/b.ttl": "é\r\n".encode()}
    assert not recover(tmp_path)


def test_nothing_new_touches_nothing(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": b"1"})
    before = (tmp_path / "a").stat()
    write_files(tmp_path, {"a": b"1"})
    assert (tmp_path / "a").stat() == before


@POSIX
def test_modes_and_links_are_kept(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": b"1", "there/b": b"1"})
    (tmp_path / "a").chmod(0o750)
    (tmp_path / "link").symlink_to("there/b")
    write_files(tmp_path, {"a": b"2", "link": b"2"})
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o750
    assert (tmp_path / "link").is_symlink()
    assert content(tmp_path)["there/b"] == b"2"


@pytest.mark.parametrize("name", ["", "/a", "../a", "b/../../a", ".adaptbot/lock", "."])
def test_names_stay_in_the_workspace(tmp_path: Path, name: str) -> None:
    with pytest.raises(KnowledgeError, match="not the name of a file"):
        write_files(tmp_path / "home", {"good": b"", name: b""})
    assert not (tmp_path / "home").exists()


def test_git_does_not_see_the_tools_own_folder(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": b"1"})
    assert (tmp_path / ".adaptbot" / ".gitignore").read_bytes() == b"*\n"


def test_what_cannot_be_written_changes_nothing(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": b"1", "file": b"1"})
    before = content(tmp_path)
    with pytest.raises(KnowledgeError, match="could not be written, nothing was changed"):
        write_files(tmp_path, {"a": b"2", "new/b": b"2", "file/below": b"2"})
    (tmp_path / "folder").mkdir()
    with pytest.raises(KnowledgeError, match="is a folder"):
        write_files(tmp_path, {"a": b"2", "folder": b"2"})
    assert content(tmp_path) == before
    assert not (tmp_path / "new").exists()
    assert not recover(tmp_path)


@POSIX
def test_a_full_disk_changes_nothing(tmp_path: Path) -> None:
    """A limit of the file size stands in for the disk: the write fails halfway, just as then."""
    write_files(tmp_path, {"a": b"1", "b": b"1"})
    before = content(tmp_path)
    done = run(
        "import resource\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))\n"
        "write_files(root, {'a': b'2', 'b': b'2' * 9999})\n",
        tmp_path,
    )
    assert "KnowledgeError" in done.stderr
    assert f"{tmp_path}/b could not be written, nothing was changed" in done.stderr
    assert content(tmp_path) == before
    assert not recover(tmp_path)


@AS_ROOT
@pytest.mark.skipif(shutil.which("mount") is None, reason="there is no mount")
def test_a_really_full_disk_changes_nothing(tmp_path: Path) -> None:
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(tmp_path)], capture_output=True
    )
    if mounted.returncode:
        pytest.skip("mounting is not allowed here")
    try:
        write_files(tmp_path, {"a": b"1", "b": b"1"})
        with pytest.raises(KnowledgeError, match="the disk is full; free some space"):
            write_files(tmp_path, {"a": b"2" * 9999, "b": b"2" * 99999})
        assert content(tmp_path) == {"a": b"1", "b": b"1"}
    finally:
        subprocess.run(["umount", str(tmp_path)], check=True)


@POSIX
def test_a_read_only_folder_changes_nothing(shared: Path) -> None:
    write_files(shared, {"a": b"1", "kg/b": b"1"})
    for path in (shared, *shared.rglob("*")):
        path.chmod(0o777)
    (shared / "kg").chmod(0o555)
    script = (
        "try: write_files(root, {'a': b'2', 'kg/b': b'2'})\nexcept KnowledgeError as e: print(e)"
    )
    said = run(AS_ANOTHER + script, shared).stdout
    (shared / "kg").chmod(0o755)
    assert said.startswith(f"{shared}/kg/b could not be written, nothing was changed: permission")
    assert content(shared) == {"a": b"1", "kg/b": b"1"}


@AS_ROOT
def test_a_file_that_cannot_be_replaced_undoes_the_others(shared: Path) -> None:
    """In a sticky folder anyone can make a file, but not replace that of someone else."""
    write_files(shared, {"a": b"1", "sticky/b": b"1", "c": b"1"})
    for path in (shared, *shared.rglob("*")):
        path.chmod(0o777)
    (shared / "sticky").chmod(0o1777)
    change = "{'a': b'2', 'new': b'2', 'sticky/b': b'2', 'c': b'2'}"
    script = f"try: write_files(root, {change})\nexcept KnowledgeError as e: print(e)"
    for path in (shared, *shared.glob("*"), *(shared / ".adaptbot").rglob("*")):
        if path.name != "sticky":
            os.chown(path, 65534, 65534)
    said = run(AS_ANOTHER + script, shared)
    assert "could not be written, nothing was changed: permission is denied" in said.stdout
    assert content(shared) == {"a": b"1", "sticky/b": b"1", "c": b"1"}
    assert not recover(shared)


@POSIX
def test_a_kill_at_any_moment_leaves_old_or_new(tmp_path: Path) -> None:
    script = (
        "data = {name: (root / name).read_bytes() for name in ('a', 'kg/b')}\n"
        "n = int(data['a'][:9])\n"
        "print('ready', flush=True)\n"
        "while True:\n"
        "    n += 1\n"
        "    with lock(root):\n"
        "        write_files(root, {'a': b'%9d' % n * 999, 'kg/b': b'%9d' % n * 9})\n"
    )
    write_files(tmp_path, {"a": b"%9d" % 0 * 999, "kg/b": b"%9d" % 0 * 9})
    chance, recovered, last = random.Random(5), 0, 0
    for _ in range(40):
        process = subprocess.Popen(
            [sys.executable, "-c", IMPORTS + script, str(tmp_path)], env=ENV, stdout=subprocess.PIPE
        )
        assert process.stdout
        process.stdout.readline()
        time.sleep(chance.random() * 0.03)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        with lock(tmp_path):
            recovered += recover(tmp_path)
        files = content(tmp_path)
        number = int(files["a"][:9])
        assert files == {"a": b"%9d" % number * 999, "kg/b": b"%9d" % number * 9}
        assert number >= last
        last = number
    assert recovered > 0, "no kill hit a write"
    assert last > 0


@POSIX
def test_a_kill_between_any_two_steps_leaves_old_or_new(tmp_path: Path) -> None:
    """Die at the n-th call that the interpreter reports for a file, for every n there is."""
    script = (
        "left = int(sys.argv[2])\n"
        "steps = {'open', 'os.rename', 'os.remove', 'os.mkdir', 'os.chmod'}\n"
        "def count(event, args):\n"
        "    global left\n"
        "    if event in steps and str(root) in str(args[0]):\n"
        "        left -= 1\n"
        "        if left < 0: os.kill(os.getpid(), 9)\n"
        "sys.addaudithook(count)\n"
        "write_files(root, {'a': b'new', 'kg/b': b'new'})\n"
        "print('done')\n"
    )
    states = set()
    for step in range(100):
        root = tmp_path / str(step)
        write_files(root, {"a": b"old", "kg/b": b"old"})
        done = subprocess.run(
            [sys.executable, "-c", IMPORTS + script, str(root), str(step)],
            env=ENV, capture_output=True,
        )  # fmt: skip
        recover(root)
        files = content(root)
        assert files in [{"a": text, "kg/b": text} for text in (b"old", b"new")], step
        states.add(files["a"])
        assert not recover(root)
        if done.stdout:
            break
    assert done.stdout == b"done\n"
    assert step > 15
    assert states == {b"old", b"new"}


def test_one_writer_at_a_time(tmp_path: Path) -> None:
    told = f"Another adaptbot .*process {os.getpid()}"
    with lock(tmp_path), pytest.raises(KnowledgeError, match=told):
        lock(tmp_path, timeout=0.1).__enter__()
    with lock(tmp_path, timeout=0):
        pass


def test_two_processes_lose_no_write(tmp_path: Path) -> None:
    write_files(tmp_path, {"a": b"0", "b": b"0"})
    script = (
        "for _ in range(30):\n"
        "    with lock(root):\n"
        "        n = int((root / 'a').read_bytes()) + 1\n"
        "        write_files(root, {'a': b'%d' % n, 'b': b'%d' % n})\n"
    )
    command = [sys.executable, "-c", IMPORTS + script, str(tmp_path)]
    running = [subprocess.Popen(command, env=ENV) for _ in range(2)]
    assert [process.wait() for process in running] == [0, 0]
    assert content(tmp_path) == {"a": b"60", "b": b"60"}


def test_a_lock_ends_with_its_process(tmp_path: Path) -> None:
    run("lock(root).__enter__(); os._exit(9)", tmp_path)
    with lock(tmp_path, timeout=0):
        pass
