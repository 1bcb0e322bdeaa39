"""The index of a repository: changed under git's own lock, and only where asked."""

import hashlib
import io
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    from dulwich.file import _GitFile
    from dulwich.index import ConflictedIndexEntry, IndexEntry

_FOLDER: Final = 0o040000


class LockedIndex:
    """An index that no one else can change; `save` and leaving the lock make a change real."""

    def __init__(self, path: Path, file: "_GitFile") -> None:
        from dulwich.index import read_index_dict_with_version

        self._file = file
        self._version: int | None = None
        self.entries: dict[bytes, IndexEntry | ConflictedIndexEntry] = {}
        self._saved = False
        if path.exists():
            data = path.read_bytes()
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
        write_index_dict(buffer, self.entries, version=self._version)
        data = buffer.getvalue()
        self._file.write(data + hashlib.sha1(data, usedforsecurity=False).digest())
        self._file.flush()
        self._saved = True

    def leave(self) -> None:
        """Give up the lock, with what was saved."""
        if self._saved:
            self._file.close()
        else:
            self._file.abort()


def _in_the_way(entries: Mapping[bytes, object], name: bytes) -> list[bytes]:
    """Find entries that are a folder of this file, or that this file is a folder of."""
    parents = {name[:at] for at, char in enumerate(name) if char == ord("/")}
    return [other for other in entries if other in parents or other.startswith(name + b"/")]


@contextmanager
def locked_index(path: Path) -> Iterator[LockedIndex]:
    """Hold `index.lock`, as git does while it commits; raises dulwich's FileLocked."""
    from dulwich.file import GitFile

    file = GitFile(path, "wb")
    try:
        index = LockedIndex(path, file)
        yield index
    except BaseException:
        file.abort()
        raise
    index.leave()
