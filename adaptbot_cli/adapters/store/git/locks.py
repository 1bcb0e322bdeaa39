"""git's lock files, taken so that one left behind by a killed run can be told from all others."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.adapters.store.files.disk import sync_folder

if TYPE_CHECKING:
    from dulwich.file import SharedPerm


@contextmanager
def locked(path: Path, owner: Path, perm: "SharedPerm | None") -> Iterator[io.BytesIO]:
    """Hold git's lock on a file, `path` with `.lock`; what is written becomes the file's content.

    Nothing becomes of it if there is an error or nothing is written. The lock is a hard link to
    the file `owner`, where the disk has hard links: after a kill, `free` finds both and that they
    are one, which no lock of git's or of another workspace's is.

    Raises:
        FileLocked: dulwich's; someone else holds the lock.
    """
    handle = _take(path, owner)
    lock = _lock_of(path)
    buffer = io.BytesIO()
    try:
        try:
            yield buffer
            data = buffer.getvalue()
            if data:
                _write(handle, data)
        finally:
            os.close(handle)
        if data:
            _place(lock, path, perm)
    except BaseException:
        lock.unlink(missing_ok=True)
        raise
    finally:
        owner.unlink(missing_ok=True)
    if not data:
        lock.unlink(missing_ok=True)


def free(path: Path, owner: Path) -> None:
    """Remove the lock of a file if a killed run of this owner holds it."""
    if not owner.exists():
        return
    lock = _lock_of(path)
    with suppress(FileNotFoundError):
        if lock.samefile(owner):
            lock.unlink()


def _lock_of(path: Path) -> Path:
    return path.with_name(path.name + ".lock")


def _take(path: Path, owner: Path) -> int:
    from dulwich.file import FileLocked

    # A file that is there may be the very file that a killed run has put in place.
    owner.unlink(missing_ok=True)
    handle = os.open(owner, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, 0o666)
    lock = _lock_of(path)
    try:
        try:
            os.link(owner, lock)
        except FileExistsError:
            raise
        except OSError:
            # A disk without hard links: the lock is as good, but after a kill it is nobody's.
            os.close(handle)
            handle = os.open(lock, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, 0o666)
    except BaseException as error:
        with suppress(OSError):
            os.close(handle)
        owner.unlink(missing_ok=True)
        if isinstance(error, FileExistsError):
            raise FileLocked(os.fspath(path), os.fspath(lock)) from error
        raise
    return handle


_BINARY = getattr(os, "O_BINARY", 0)


def _write(handle: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(handle, view) :]
    os.fsync(handle)


def _place(lock: Path, path: Path, perm: "SharedPerm | None") -> None:
    from dulwich.file import adjust_shared_perm

    adjust_shared_perm(lock, perm)
    lock.replace(path)
    sync_folder(path.parent)
