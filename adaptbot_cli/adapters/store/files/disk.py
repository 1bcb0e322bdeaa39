"""Single steps on the disk, and its errors as sentences."""

import errno
import os
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from adaptbot_cli.errors import KnowledgeError

FOLDER: Final = ".adaptbot"
"""The tool's own folder in a workspace."""

_REASONS: Final = {
    errno.ENOSPC: "the disk is full; free some space and try again",
    errno.EDQUOT: "your disk quota is used up; free some space and try again",
    errno.EFBIG: "the file would be larger than is allowed; raise the limit and try again",
    errno.EROFS: "the disk is read-only; choose a workspace that can be written with --workspace",
    errno.EACCES: "permission is denied; make its folder writable or choose another --workspace",
    errno.EPERM: "permission is denied; make its folder writable or choose another --workspace",
}


def own_folder(root: Path) -> Path:
    """Make the tool's own folder, which tells git to leave it out."""
    folder = root / FOLDER
    ignore = folder / ".gitignore"
    with told(folder):
        if not ignore.exists():
            folder.mkdir(parents=True, exist_ok=True)
            ignore.write_bytes(b"*\n")
    return folder


def write_new(path: Path, data: bytes, like: Path | None) -> None:
    """Write a new file through to the disk, with the mode of another one if there is one."""
    with path.open("wb") as file:
        if like and like.exists():
            # First of all, so that no one reads what only the owner may.
            path.chmod(like.stat().st_mode & 0o7777)
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def sync_folders(paths: Iterable[Path]) -> None:
    """Make the entries of these files' folders last."""
    for folder in sorted({path.parent for path in paths}):
        sync_folder(folder)


def sync_folder(folder: Path) -> None:
    """Make a folder's entries last. Windows has no way to, and does it by itself."""
    if sys.platform == "win32":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def told(path: Path) -> Iterator[None]:
    """Turn an error of the system into a sentence about a file."""
    try:
        yield
    except OSError as error:
        raise failure(path, error) from error


def failure(path: Path, error: OSError) -> KnowledgeError:
    """Say which file could not be written, why, and what to do."""
    reason = _REASONS.get(
        error.errno or 0, f"{error.strerror or error}; correct that and try again"
    )
    return KnowledgeError(f"{path} could not be written, nothing was changed: {reason}.")
