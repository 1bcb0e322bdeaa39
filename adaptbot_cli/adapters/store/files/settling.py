"""What a reader does about writes: those that were interrupted, and those under way."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Final, TypeVar

from adaptbot_cli.adapters.store.files.disk import FOLDER
from adaptbot_cli.adapters.store.files.journal import interrupted, recover
from adaptbot_cli.adapters.store.files.lock import lock

_TRIES: Final = 20
T = TypeVar("T")


def settle(root: Path) -> None:
    """Finish or undo an interrupted write, under the lock; without one, nothing is touched.

    Waits for a writer that is at work. A workspace that may not be written is left as it is.
    Raises KnowledgeError as `lock` and `recover` do.
    """
    if interrupted(root) and os.access(root / FOLDER, os.W_OK):
        with lock(root):
            recover(root)


def settled(root: Path, read: Callable[[], T]) -> T:
    """Return what `read` gives between two writes, so that it sees files of one revision only.

    Takes no lock unless writers leave it no peace. Raises what `settle` and `read` raise.
    """
    for _ in range(_TRIES):
        settle(root)
        before = _writes(root)
        found = read()
        if not interrupted(root) and _writes(root) == before:
            return found
    if not os.access(root / FOLDER, os.W_OK):
        return read()
    with lock(root):
        return read()


def _writes(root: Path) -> int:
    """When the journal was last changed: each write begins and ends there."""
    try:
        return (root / FOLDER / "journal").stat().st_mtime_ns
    except OSError:
        return 0
