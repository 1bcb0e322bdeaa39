"""Files of a working tree as they are on disk, and the trees that they make."""

import os
import stat
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeAlias

from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    from dulwich.index import IndexEntry
    from dulwich.object_store import BaseObjectStore
    from dulwich.objects import Blob, ObjectID

FOLDER: Final = 0o040000
_FILE: Final = 0o100644
_PROGRAM: Final = 0o100755
_LINK: Final = 0o120000

TreeEntry: TypeAlias = "tuple[int, ObjectID]"


@dataclass(frozen=True, slots=True)
class File:
    """A file as it is on disk, or, without `stat`, as it is to be committed."""

    mode: int
    blob: "Blob"
    stat: os.stat_result | None

    def tree_entry(self) -> TreeEntry:
        """Give what a tree says about it."""
        return self.mode, self.blob.id

    def index_entry(self) -> "IndexEntry":
        """Give what the index says about it; git compares one without `stat` by its content."""
        from dulwich.index import IndexEntry, index_entry_from_stat

        if self.stat is None:
            return IndexEntry((0, 0), (0, 0), 0, 0, self.mode, 0, 0, 0, self.blob.id)
        return index_entry_from_stat(self.stat, self.blob.id, mode=self.mode)

    def holding(self, data: bytes) -> "File":
        """Give the same file with this content; it is still itself if that is its content."""
        from dulwich.objects import Blob

        blob = Blob.from_string(data)
        return self if blob.id == self.blob.id else File(self.mode, blob, None)


def new_file(data: bytes) -> File:
    """Give a file that is not on disk."""
    from dulwich.objects import Blob

    return File(_FILE, Blob.from_string(data), None)


def read_file(top: Path, name: bytes, *, filemode: bool, before: "TreeEntry | None") -> File | None:
    """Read a file as it is; None if it is gone.

    Without `filemode` the disk cannot tell programs, which stay what they were `before`. Raises
    KnowledgeError for what is no file, or is reached through a symbolic link.
    """
    from dulwich.objects import Blob

    path = top / os.fsdecode(name)
    _refuse_link(top, path)
    try:
        about = path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return None
    if stat.S_ISLNK(about.st_mode):
        return File(_LINK, Blob.from_string(os.fsencode(path.readlink())), about)
    if not stat.S_ISREG(about.st_mode):
        raise KnowledgeError(f"{path} cannot be committed: it is not a file.")
    if filemode:
        mode = _PROGRAM if about.st_mode & stat.S_IXUSR else _FILE
    else:
        mode = before[0] if before and before[0] in (_FILE, _PROGRAM) else _FILE
    return File(mode, Blob.from_string(path.read_bytes()), about)


def _refuse_link(top: Path, path: Path) -> None:
    for folder in path.parents:
        if folder == top:
            return
        if folder.is_symlink():
            raise KnowledgeError(f"{path} cannot be committed: {folder} is a symbolic link.")


def lookup(store: "BaseObjectStore", tree: "ObjectID | None", name: bytes) -> "TreeEntry | None":
    """Find what stands at a path of a tree."""
    from dulwich.errors import NotTreeError
    from dulwich.object_store import tree_lookup_path
    from dulwich.objects import SubmoduleEncountered

    if tree is None:
        return None
    try:
        return tree_lookup_path(store.__getitem__, tree, name)
    except (KeyError, NotTreeError, SubmoduleEncountered):
        return None


def tree_with(
    store: "BaseObjectStore", tree: "ObjectID | None", files: Mapping[bytes, File | None]
) -> "ObjectID":
    """Store the tree that differs in these files; None takes a file out."""
    from dulwich.object_store import commit_tree_changes
    from dulwich.objects import Tree

    changes: list[tuple[bytes, int | None, ObjectID | None]] = []
    for name, file in files.items():
        if lookup(store, tree, name) == (file.tree_entry() if file else None):
            continue
        changes += [(parent, None, None) for parent in _file_parents(store, tree, name)]
        changes.append((name, file.mode, file.blob.id) if file else (name, None, None))
        if file:
            store.add_object(file.blob)
    if tree is not None and not changes:
        return tree
    return commit_tree_changes(store, Tree() if tree is None else tree, changes)


def _file_parents(store: "BaseObjectStore", tree: "ObjectID | None", name: bytes) -> list[bytes]:
    """Find what is a file in the tree and a folder on the way to this one."""
    parents = [name[:at] for at, char in enumerate(name) if char == ord("/")]
    found = [(parent, lookup(store, tree, parent)) for parent in parents]
    return [parent for parent, entry in found if entry and entry[0] != FOLDER]
