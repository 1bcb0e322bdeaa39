"""One writer at a time, among processes and among threads."""

import errno
import os
import random
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from adaptbot_cli.adapters.store.files.disk import FOLDER, own_folder, told
from adaptbot_cli.errors import KnowledgeError

_POLL: Final = 0.01

if sys.platform == "win32":
    import msvcrt

    # Beyond the content, so that others can read whose lock it is.
    _LOCKED_BYTE: Final = 1 << 20

    def _try_lock(handle: int) -> bool:
        os.lseek(handle, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        os.lseek(handle, 0, os.SEEK_SET)
        return True
else:
    import fcntl

    def _try_lock(handle: int) -> bool:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EACCES):
                return False
            raise
        return True


@contextmanager
def lock(root: Path, timeout: float = 30.0) -> Iterator[None]:
    """Hold the workspace's write lock, against other processes and other threads.

    Waits up to `timeout` seconds, then raises KnowledgeError. The lock ends with the process. Who
    waits at the head of the queue comes before whoever has just let go and wants it again.
    """
    folder = own_folder(root)
    deadline = time.monotonic() + timeout
    with (
        _held(folder / "lock.queue", root, deadline) as queue,
        _held(folder / "lock", root, deadline) as handle,
    ):
        os.close(queue.pop())
        with suppress(OSError):  # It only tells others whom they wait for.
            os.truncate(handle[0], 0)
            os.write(handle[0], f"{os.getpid()}\n".encode())
        yield


@contextmanager
def _held(path: Path, root: Path, deadline: float) -> Iterator[list[int]]:
    """Hold the lock of a file until the end, or until the handle is taken out and closed."""
    with told(path):
        handles = [os.open(path, os.O_RDWR | os.O_CREAT, 0o666)]
    try:
        while not _locked(handles[0], path):
            if time.monotonic() >= deadline:
                raise KnowledgeError(
                    f"Another adaptbot is writing to {root}{_owner(root)}; "
                    "wait until it is done, then try again."
                )
            time.sleep(random.uniform(_POLL / 2, _POLL))
        yield handles
    finally:
        for handle in handles:
            os.close(handle)


def _locked(handle: int, path: Path) -> bool:
    with told(path):
        return _try_lock(handle)


def _owner(root: Path) -> str:
    try:
        number = (root / FOLDER / "lock").read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""
    return f" (process {number})" if number.isdigit() else ""
