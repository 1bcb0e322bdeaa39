"""Files of a workspace: opened relative to its folder, through no link, and written whole.

A workspace may be a stranger's: what it links to is not the workspace's. Only regular files are
read, so that nothing (a pipe, a device) can keep a reader waiting.
"""

import errno
import fcntl
import logging
import os
import random
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Final

from adaptbot_cli.bounded import folder, not_wanted, unlinked
from adaptbot_cli.core.visible import visible
from adaptbot_cli.errors import KnowledgeError

_LOG: Final = logging.getLogger(__name__)

LARGEST: Final = 256 * 1024 * 1024
"""Bytes of a file that are read at most."""

FOLDERS: Final = ("attributes", "state")
"""The folders of a domain in which a large home's facts stand, beside the files of these names."""
MOST: Final = 20_000
"""Files of a domain that are read at most."""

_REASONS: Final = {
    errno.ENOSPC: "the disk is full; free some space and try again",
    errno.EDQUOT: "your disk quota is used up; free some space and try again",
    errno.EFBIG: "the file would be larger than is allowed; raise the limit and try again",
    errno.EROFS: "the disk is read-only; choose a workspace that can be written with --workspace",
    errno.EACCES: "permission is denied; make its folder writable or choose another --workspace",
    errno.EPERM: "permission is denied; make its folder writable or choose another --workspace",
}


@contextmanager
def refusing(path: Path, what: str = "written, nothing was changed") -> Iterator[None]:
    """Turn an error of the system into a KnowledgeError about a file."""
    try:
        yield
    except OSError as error:
        reason = _REASONS.get(error.errno or 0, f"{error.strerror or error}; correct that")
        raise KnowledgeError(f"{path} could not be {what}: {reason}.") from error


def read(root: Path, path: str) -> bytes | None:
    """Return the content of a file below `root`, None if there is none.

    Raises:
        KnowledgeError: it is reached through a link, is no regular file, or is too large.
    """
    name = inside(root, path)
    with refusing(root / path, "read"):
        try:
            handle = unlinked(root, name)
        except FileNotFoundError:
            return None
        with os.fdopen(handle, "rb") as opened:
            data = opened.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise KnowledgeError(
            f"{root / path} is larger than {LARGEST // 1024**2} MB; divide it: facts may stand in "
            "several files of a folder of its name, such as state/1.ttl."
        )
    return data


def names(root: Path, path: str) -> list[str]:
    """Return the sorted names in a folder below `root`; none if it is not there."""
    with refusing(root / path, "read"):
        try:
            with folder(root, path) as handle:
                return sorted(os.listdir(handle))  # noqa: PTH208 - of a descriptor
        except FileNotFoundError:
            return []


def read_files(folder: Path, root: Path | None = None) -> dict[str, bytes]:
    """Return the contents of a pack's files, those that are there, by their names in its folder.

    Those in its folders `attributes` and `state` belong to it, too. With `root`, a workspace that
    the folder lies in, no link below it is followed.

    Raises:
        KnowledgeError: the folder or a file cannot be read, or is reached through a link; they are
            too many, or one has a name that is no text.
    """
    if root is None:
        with refusing(folder, "read"):
            paths = (p for pattern in ("*.ttl", *(f"{f}/*.ttl" for f in FOLDERS))
                     for p in sorted(folder.glob(pattern)))  # fmt: skip
            return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    path = folder.relative_to(root).as_posix()
    there = names(root, path)
    found = [name for name in there if name.endswith(".ttl")]
    for part in (part for part in FOLDERS if part in there):
        inside = names(root, f"{path}/{part}")
        found += [f"{part}/{name}" for name in inside if name.endswith(".ttl")]
    if odd := next((name for name in found if not name.isprintable()), None):
        raise KnowledgeError(f"{folder} has a file {odd!r}, whose name nobody can read; rename it.")
    if len(found) > MOST:
        raise KnowledgeError(f"{folder} has more than {MOST:,} files; put several into one.")
    held = {name: read(root, f"{path}/{name}") for name in found}
    return {name: data for name, data in held.items() if data is not None}


def write(root: Path, path: str, data: bytes | None) -> None:
    """Give a file new content, through to the disk, or remove it (None); old or new, never half.

    It keeps its mode; missing folders are made. Raises KnowledgeError.
    """
    name = inside(root, path)
    new = beside(name.name)
    with refusing(root / path), folder(root, str(name.parent), make=data is not None) as handle:
        if data is None:
            with suppress(FileNotFoundError):
                os.unlink(name.name, dir_fd=handle)
            os.fsync(handle)
            return
        with suppress(FileNotFoundError):
            os.unlink(new, dir_fd=handle)
        try:
            about = os.stat(name.name, dir_fd=handle, follow_symlinks=False)
            if not stat.S_ISREG(about.st_mode):
                raise not_wanted(root / path, "file", name.name, handle)
            mode = stat.S_IMODE(about.st_mode)
        except FileNotFoundError:
            mode = None
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        file = os.open(new, flags, 0o666 if mode is None else mode & 0o600, dir_fd=handle)
        try:
            with os.fdopen(file, "wb") as opened:
                if mode is not None:
                    os.fchmod(file, mode)
                opened.write(data)
                opened.flush()
                os.fsync(file)
            os.replace(new, name.name, src_dir_fd=handle, dst_dir_fd=handle)
        except BaseException:
            with suppress(OSError):
                os.unlink(new, dir_fd=handle)
            raise
        os.fsync(handle)


def clear(root: Path, path: str) -> None:
    """Remove what a killed `write` of a file has left beside it."""
    name = inside(root, path)
    with (
        refusing(root / path),
        suppress(FileNotFoundError),
        folder(root, str(name.parent)) as handle,
    ):
        os.unlink(beside(name.name), dir_fd=handle)


def beside(name: str) -> str:
    """Return the name of the new file that is about to take a file's place."""
    return f".{name[:200]}.adaptbot"


def inside(root: Path, path: str) -> PurePosixPath:
    """Return a path below `root`; raise KnowledgeError if it leaves it."""
    parts = PurePosixPath(path).parts
    outside = path.startswith("/") or "\0" in path or {"..", ".git"} & {p.lower() for p in parts}
    if not parts or outside:
        raise KnowledgeError(f"{path!r} is not the name of a file in the workspace {root}.")
    return PurePosixPath(path)


@contextmanager
def locked(state: int, root: Path, timeout: float = 30.0) -> Iterator[None]:
    """Hold the write lock in a folder that is open as `state`, against processes and threads.

    The kernel frees it when the process dies. Who waits at the head of the queue comes before
    whoever has just let go and wants it again.

    Raises:
        KnowledgeError: another holds it for longer than `timeout` seconds.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
    held = []
    try:
        for name in ("queue", "lock"):
            with refusing(root):
                held.append(os.open(name, flags, 0o666, dir_fd=state))
        wait(
            lambda: all(map(_flocked, held)),
            timeout,
            f"Another adaptbot is writing to {root}",
            "wait until it is done, or end it if it was stopped, then try again.",
        )
        os.close(held.pop(0))
        yield
    finally:
        for handle in held:
            os.close(handle)


def wait(ready: Callable[[], bool], seconds: float, busy: str, remedy: str) -> None:
    """Wait until something is ready; after a second it is logged as a warning why.

    Raises:
        KnowledgeError: it is not ready after so many seconds.
    """
    start, logged = time.monotonic(), False
    while not ready():
        waited = time.monotonic() - start
        if waited >= seconds:
            raise KnowledgeError(f"{busy}; {remedy}")
        if waited > 1 and not logged:
            logged = True
            _LOG.warning("! %s: waiting for it, %g s at most", visible(busy), seconds)
        time.sleep(random.uniform(0.005, 0.01))


def _flocked(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
