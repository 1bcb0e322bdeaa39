"""The repository that a workspace is in."""

import hashlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from adaptbot_cli.adapters.store.git.authoring import new_commit
from adaptbot_cli.adapters.store.git.heads import head_file, move_head
from adaptbot_cli.adapters.store.git.history import Commit, commit_from
from adaptbot_cli.adapters.store.git.index import locked_index
from adaptbot_cli.adapters.store.git.locks import free
from adaptbot_cli.adapters.store.git.objects import write_objects
from adaptbot_cli.adapters.store.git.revisions import commit_at
from adaptbot_cli.adapters.store.git.snapshot import (
    FOLDER,
    File,
    TreeEntry,
    lookup,
    new_file,
    read_file,
    tree_with,
)
from adaptbot_cli.adapters.store.git.trouble import busy, busy_message, refuse_format, told
from adaptbot_cli.errors import KnowledgeError

# dulwich takes a tenth of a second to import, so what needs it imports it.
if TYPE_CHECKING:
    from dulwich.index import IndexEntry
    from dulwich.objects import Commit as DulwichCommit
    from dulwich.objects import ObjectID
    from dulwich.repo import Repo as DulwichRepo

_PATIENCE: Final = 10.0
_PAUSE: Final = 0.02


@dataclass(frozen=True, slots=True)
class _Change:
    """What a commit is to change: files as git names them, and contents that are not the disk's."""

    names: Sequence[bytes]
    contents: Mapping[bytes, bytes]
    staged: Mapping[bytes, bytes]
    ready: Callable[[str], None] | None


class Repo:
    """The repository that a workspace is in. Paths are relative to the workspace, with `/`.

    Methods raise KnowledgeError if the repository cannot be read or written.
    """

    def __init__(self, repo: "DulwichRepo", root: Path) -> None:
        """Wrap a dulwich repository; `open_or_init` is the way to get one."""
        self._repo = repo
        self._top = Path(repo.path).resolve()
        self._prefix = PurePosixPath(root.resolve().relative_to(self._top).as_posix())

    @classmethod
    def open_or_init(cls, root: Path, own: bool = False) -> "Repo":
        """Open the repository that `root` is in; if there is none, make one with branch main.

        With `own` the repository of a folder above does not count.
        """
        from dulwich.errors import NotGitRepository
        from dulwich.repo import Repo as Dulwich

        with told(root):
            root.mkdir(parents=True, exist_ok=True)
            try:
                found = Dulwich.discover(str(root))
            except NotGitRepository:
                found = None
            above = found is not None and Path(found.path).resolve() != root.resolve()
            if found is None or found.bare or (own and above):
                found = Dulwich.init(str(root), default_branch=b"main")
            refuse_format(found)
            return cls(found, root)

    def head(self) -> str | None:
        """Give the sha of the commit that is checked out; None before the first one."""
        with told(self._top):
            head = self._head()
        return head.decode() if head else None

    def commit(
        self,
        paths: Sequence[str],
        message: str,
        when: datetime | None = None,
        contents: Mapping[str, bytes] = MappingProxyType({}),
        staged: Mapping[str, bytes] = MappingProxyType({}),
        ready: Callable[[str], None] | None = None,
    ) -> str:
        """Commit these files as they are on disk (or as gone), and nothing else; give the sha.

        `contents` are committed instead of what the disk holds; `staged` goes into the index for a
        file of which the user has staged something else. `ready` is called with the commit's sha
        when all of it is stored, just before it is made the checked out one: what raises there
        makes no commit. Without a difference to HEAD no commit is made and HEAD's sha given. What
        else is staged or changed stays as it is. No hook is run. `when` is now if None.
        """
        given = {self._name(path): data for path, data in contents.items()}
        index = {self._name(path): data for path, data in staged.items()}
        change = _Change([self._name(path) for path in paths], given, index, ready)
        deadline = time.monotonic() + _PATIENCE
        with told(self._top):
            while True:
                try:
                    return self._commit(change, message, when or datetime.now().astimezone())
                except busy() as error:
                    if time.monotonic() > deadline:
                        raise KnowledgeError(busy_message(self._top, error)) from error
                    time.sleep(_PAUSE)

    def adopt(self, sha: str, paths: Sequence[str]) -> str:
        """Make a commit that was stored and never became the checked out one; give the sha.

        It is made anew if HEAD has moved meanwhile, and not at all if HEAD holds the same.
        """
        with told(self._top):
            commit = commit_at(self._repo, sha)
        found = {path: self.read(path, sha) for path in paths}
        contents = {path: data for path, data in found.items() if data is not None}
        readable = _readable(commit)
        return self.commit(
            paths, commit.message.decode("utf-8", "replace"), readable.when, contents
        )

    def free(self) -> None:
        """Remove the locks that a killed run of this workspace has left; call it under `lock`."""
        with told(self._top):
            for path, owner in (
                (Path(self._repo.index_path()), self._owner("index")),
                (head_file(self._repo), self._owner("head")),
            ):
                free(path, owner)
                owner.unlink(missing_ok=True)

    def _owner(self, what: str) -> Path:
        """The file that shows whose a lock is: this workspace's."""
        mark = hashlib.sha256(os.fsencode(str(self._prefix))).hexdigest()[:12]
        return Path(self._repo.controldir()) / f"adaptbot-{mark}.{what}"

    def staged(self, path: str) -> bytes | None:
        """Give a file's content in the index, None if it is not there or being merged."""
        from dulwich.index import IndexEntry

        with told(self._top):
            index, name = self._repo.open_index(), self._name(path)
            if name not in index or not isinstance(entry := index[name], IndexEntry):
                return None
            return self._repo.object_store[entry.sha].as_raw_string()

    def read(self, path: str, rev: str) -> bytes | None:
        """Give a file's content at a revision, None if it is not there.

        A revision is a sha, a short sha, a branch, a tag or HEAD, perhaps with ~2 or ^ after it.
        Raises KnowledgeError if there is no such revision.
        """
        name = self._name(path)
        with told(self._top):
            found = lookup(self._repo.object_store, commit_at(self._repo, rev).tree, name)
            if found is None or found[0] == FOLDER:
                return None
            return self._repo.object_store[found[1]].as_raw_string()

    def resolve(self, rev: str) -> str:
        """Give the sha of a revision. Raises KnowledgeError if there is no such revision."""
        with told(self._top):
            return str(commit_at(self._repo, rev).id.decode())

    def log(self, paths: Sequence[str] = ()) -> Iterator[Commit]:
        """Give the commits that changed these files or folders (all, if none), newest first."""
        names = [self._name(path) for path in paths] or None
        with told(self._top):
            head = self._head()
            if head is None:
                return
            for entry in self._repo.get_walker(include=[head], paths=names):
                yield _readable(entry.commit)

    def dirty(self, paths: Sequence[str]) -> list[str]:
        """Give those files that differ from HEAD: changed, new or gone."""
        with told(self._top):
            tree = self._head_tree()
            return [path for path in paths if self._differs(tree, self._name(path))]

    def _differs(self, tree: "ObjectID | None", name: bytes) -> bool:
        before = lookup(self._repo.object_store, tree, name)
        file = self._file(name, before)
        return before != (file.tree_entry() if file else None)

    def _file(self, name: bytes, before: "TreeEntry | None") -> File | None:
        config = self._repo.get_config_stack()
        filemode = bool(config.get_boolean((b"core",), b"filemode", os.name != "nt"))
        return read_file(self._top, name, filemode=filemode, before=before)

    def _name(self, path: str) -> bytes:
        """Give a path as git knows it; raise KnowledgeError if it leads out of the workspace."""
        parts = PurePosixPath(path).parts
        if not parts or path.startswith("/") or {"..", ".git"} & {part.lower() for part in parts}:
            raise KnowledgeError(f"{path!r} is not the name of a file in the workspace.")
        return os.fsencode(str(self._prefix / path))

    def _head(self) -> "ObjectID | None":
        from dulwich.refs import HEADREF

        return self._repo.refs.follow(HEADREF)[1]

    def _head_tree(self) -> "ObjectID | None":
        head = self._head()
        return self._tree_of(head) if head else None

    def _tree_of(self, sha: "ObjectID") -> "ObjectID":
        from dulwich.objectspec import parse_commit

        tree: ObjectID = parse_commit(self._repo, sha).tree
        return tree

    def _commit(self, change: "_Change", message: str, when: datetime) -> str:
        store = self._repo.object_store
        owner = self._owner("index")
        with locked_index(Path(self._repo.index_path()), owner, store.shared_perm) as index:
            index.refuse_conflicts(change.names)
            head = self._head()
            tree = self._tree_of(head) if head else None
            commit = self._stored(change, head, tree, message, when)
            if change.ready:
                change.ready((commit.id if commit else head or b"").decode())
            # Only now does the disk hold what it will.
            if index.replace(self._entries(change, tree)):
                index.save()
            if commit:
                move_head(self._repo, self._owner("head"), head, commit)
            return (commit.id if commit else head or b"").decode()

    def _stored(
        self,
        change: "_Change",
        head: "ObjectID | None",
        tree: "ObjectID | None",
        message: str,
        when: datetime,
    ) -> "DulwichCommit | None":
        """Store all objects of a commit; None if it would not differ from HEAD."""
        from dulwich.object_store import MemoryObjectStore, OverlayObjectStore
        from dulwich.objects import Blob

        store, new = self._repo.object_store, MemoryObjectStore()
        both = OverlayObjectStore([new, store], add_store=new)
        files = {name: self._to_commit(change, name, tree) for name in change.names}
        for data in change.staged.values():
            new.add_object(Blob.from_string(data))
        new_tree = tree_with(both, tree, files)
        commit = None
        if not head or new_tree != tree:
            commit = new_commit(self._repo, head, new_tree, message, when)
            new.add_object(commit)
        write_objects(store, [new[sha] for sha in new])
        return commit

    def _to_commit(self, change: "_Change", name: bytes, tree: "ObjectID | None") -> File | None:
        file = self._file(name, lookup(self._repo.object_store, tree, name))
        data = change.contents.get(name)
        if data is None:
            return file
        return file.holding(data) if file else new_file(data)

    def _entries(
        self, change: "_Change", tree: "ObjectID | None"
    ) -> "dict[bytes, IndexEntry | None]":
        """What the index says of the files from now on."""
        found: dict[bytes, IndexEntry | None] = {}
        for name in change.names:
            file = self._to_commit(change, name, tree)
            data = change.staged.get(name)
            if data is not None:
                on_disk = self._file(name, lookup(self._repo.object_store, tree, name))
                file = on_disk.holding(data) if on_disk else new_file(data)
            found[name] = file.index_entry() if file else None
        return found


def _readable(commit: "DulwichCommit") -> Commit:
    zone = timezone(timedelta(seconds=commit.author_timezone))
    return commit_from(
        commit.id.decode(),
        commit.author.decode("utf-8", "replace"),
        datetime.fromtimestamp(commit.author_time, zone),
        commit.message.decode("utf-8", "replace"),
        tuple(parent.decode() for parent in commit.parents),
    )
