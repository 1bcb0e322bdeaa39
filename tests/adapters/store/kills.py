"""Kills a process at every step that changes something on the disk, one after the other."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import paths_of

_AUDITED = {"os.rename", "os.remove", "os.link", "os.mkdir", "os.rmdir", "os.chmod", "os.utime",
            "os.truncate", "fcntl.flock"}  # fmt: skip
_CALLED = {"fsync", "write", "truncate", "flush", "create_blob", "create_commit", "write_tree",
           "init_repository"}  # fmt: skip


def killed_at(step: int, work: Callable[[], object]) -> bool:
    """Let a process work and kill itself before its `step`th change; tell whether it came so far.

    A step is a call of the system's that changes a file or a folder, or one of libgit2's, which
    makes its own. Raises AssertionError if the work failed by itself.
    """
    pid = os.fork()
    if pid == 0:
        left = step

        def counted() -> None:
            nonlocal left
            left -= 1
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)

        def audited(event: str, arguments: tuple[object, ...]) -> None:
            writing = event == "open" and isinstance(arguments[2], int)
            if event in _AUDITED or (writing and arguments[2] & (os.O_WRONLY | os.O_RDWR)):  # type: ignore[operator]
                counted()

        def called(frame: FrameType, event: str, argument: object) -> None:
            name = getattr(argument, "__name__", "")
            if event == "c_call" and (name in _CALLED or name.startswith("git_index_write")):
                counted()

        code = 1
        try:
            sys.addaudithook(audited)
            sys.setprofile(called)
            work()
            code = 0
        finally:
            os._exit(code)
    ended = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    assert ended in (0, -signal.SIGKILL), "the work failed by itself"
    return ended == -signal.SIGKILL


def steps(most: int = 2_000) -> Iterator[int]:
    """Give the numbers of steps; the work is to end before the last."""
    yield from range(1, most)
    raise AssertionError("there is no end of it")


def at_one(root: Path, domain: str = "kitchen") -> bool:
    """Tell whether index and HEAD say the same, and nothing is left lying about."""
    repo = Repo.open_or_init(root)
    head = repo.head() or ""
    same = all(repo.staged(path) == repo.read(path, head) for path in paths_of(domain))
    left = [p for p in root.rglob("*") if p.suffix in (".lock", ".adaptbot")]
    left = [p for p in left if not p.name.startswith(".cache-")]
    held = list((root / ".git" / "adaptbot").glob("held-*"))
    return same and not left and not held and not repo.interrupted()
