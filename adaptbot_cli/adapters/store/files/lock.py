"""One writer at a time, among processes and among threads."""

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from adaptbot_cli.adapters.store.files.disk import own_folder, told
from adaptbot_cli.errors import KnowledgeError

_POLL: Final = 0.05

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
def lock(root: Path, timeout: float = 10.0) -> Iterator[None]:
    """Hold the workspace's write lock, against other processes and other threads.

    Waits up to `timeout` seconds, then raises KnowledgeError. The lock ends with the process.
    """
    path = own_folder(root) / "lock"
    with told(path):
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        deadline = time.monotonic() + timeout
        while not _locked(handle, path):
            if time.monotonic() >= deadline:
                raise KnowledgeError(
                    f"Another adaptbot is writing to {root}{_owner(path)}; "
                    "wait until it is done, then try again."
                )
            time.sleep(_POLL)
        with suppress(OSError):  # It only tells others whom they wait for.
            os.truncate(handle, 0)
            os.write(handle, f"{os.getpid()}\n".encode())
        yield
    finally:
        os.close(handle)


def _locked(handle: int, path: Path) -> bool:
    with told(path):
        return _try_lock(handle)


def _owner(path: Path) -> str:
    try:
        number = path.read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""
    return f" (process {number})" if number.isdigit() else ""
