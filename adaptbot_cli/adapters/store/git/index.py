"""The index of a repository: changed under git's own lock, and only where asked."""

import hashlib
import io
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adaptbot_cli.adapters.store.git.locks import locked
from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    from dulwich.file import SharedPerm
    from dulwich.index import ConflictedIndexEntry, IndexEntry

_FOLDER: Final = 0o040000


class LockedIndex:
    """An index that no one else can change; `save` makes a change real when the lock is left."""

    def __init__(self, path: Path, file: io.BytesIO) -> None:
        from dulwich.index import read_index_dict_with_version

        self._file = file
        self._version: int | None = None
        self.entries: dict[bytes, IndexEntry | ConflictedIndexEntry] = {}
        self._written = 0
        self._ours: set[bytes] = set()
        if path.exists():
            data = path.read_bytes()
            self._written = int(path.stat().st_mtime)
            self.entries, self._version, _ = read_index_dict_with_version(io.BytesIO(data))
            self._refuse_partial(path, data)

    def _refuse_partial(self, path: Path, data: bytes) -> None:
        """Refuse an index that is not all there, for writing it back would lose the rest."""
        sparse = any(getattr(entry, "mode", 0) == _FOLDER for entry in self.entries.values())
        if sparse or (b"link" in data and any(path.parent.glob("sharedindex.*"))):
            raise KnowledgeError(
                f"{path} is a split or sparse index, which adaptbot cannot write; run `git "
                "update-index --no-split-index` or `git sparse-checkout reapply --no-sparse-index`."
            )

    def replace(self, changes: Mapping[bytes, "IndexEntry | None"]) -> bool:
        """Set entries, remove those that are None; tell if that makes a difference."""
        before = dict(self.entries)
        self._ours |= changes.keys()
        for name, entry in changes.items():
            for other in _in_the_way(self.entries, name):
                del self.entries[other]
            if entry is None:
                self.entries.pop(name, None)
            else:
                self.entries[name] = entry
        return before != self.entries

    def refuse_conflicts(self, names: Iterable[bytes]) -> None:
        """Raise KnowledgeError if one of these files is being merged."""
        from dulwich.index import ConflictedIndexEntry

        for name in names:
            if isinstance(self.entries.get(name), ConflictedIndexEntry):
                raise KnowledgeError(
                    f"{os.fsdecode(name)} is in the middle of a merge; resolve it with git first."
                )

    def save(self) -> None:
        """Write the index; it counts when the lock is left without an error."""
        from dulwich.index import write_index_dict

        # Without the old extensions: they are caches that describe the old entries.
        buffer = io.BytesIO()
        entries = {
            name: entry if name in self._ours else self._doubted(entry)
            for name, entry in self.entries.items()
        }
        write_index_dict(buffer, entries, version=self._version)
        data = buffer.getvalue()
        self._file.write(data + hashlib.sha1(data, usedforsecurity=False).digest())

    def _doubted(
        self, entry: "IndexEntry | ConflictedIndexEntry"
    ) -> "IndexEntry | ConflictedIndexEntry":
        """Let git look at a file again that may have changed in the second it was staged in.

        git knows such files by an index that is no newer than they are; the new index is newer. An
        entry without a size is what it writes itself then.
        """
        from dulwich.index import IndexEntry

        if not isinstance(entry, IndexEntry):
            return entry
        seconds = entry.mtime[0] if isinstance(entry.mtime, tuple) else int(entry.mtime)
        return replace(entry, size=0) if seconds >= self._written else entry


def _in_the_way(entries: Mapping[bytes, object], name: bytes) -> list[bytes]:
    """Find entries that are a folder of this file, or that this file is a folder of."""
    parents = {name[:at] for at, char in enumerate(name) if char == ord("/")}
    return [other for other in entries if other in parents or other.startswith(name + b"/")]


@contextmanager
def locked_index(path: Path, owner: Path, perm: "SharedPerm | None") -> Iterator[LockedIndex]:
    """Hold `index.lock`, as git does while it commits; raises dulwich's FileLocked."""
    with locked(path, owner, perm) as file:
        yield LockedIndex(path, file)
