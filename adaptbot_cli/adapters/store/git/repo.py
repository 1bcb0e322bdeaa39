"""The repository that a workspace is in."""

import os
import re
import time
from collections.abc import Iterator, Sequence
from datetime import datetime, timedelta, timezone
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Final

from adaptbot_cli.adapters.store.git.history import Commit, commit_from
from adaptbot_cli.adapters.store.git.index import locked_index
from adaptbot_cli.adapters.store.git.snapshot import (
    FOLDER,
    File,
    TreeEntry,
    lookup,
    read_file,
    tree_with,
)
from adaptbot_cli.adapters.store.git.trouble import Moved, busy, busy_message, refuse_format, told
from adaptbot_cli.errors import KnowledgeError

# dulwich takes a tenth of a second to import, so what needs it imports it.
if TYPE_CHECKING:
    from dulwich.objects import Commit as DulwichCommit
    from dulwich.objects import ObjectID
    from dulwich.repo import Repo as DulwichRepo

_NAME: Final = "adaptbot"
_EMAIL: Final = "adaptbot@localhost"
_PATIENCE: Final = 10.0
_PAUSE: Final = 0.02


class Repo:
    """The repository that a workspace is in. Paths are relative to the workspace, with `/`.

    Methods raise KnowledgeError if the repository cannot be read or written.
    """

    def __init__(self, repo: "DulwichRepo", root: Path) -> None:
        """Wrap a dulwich repository; `open_or_init` is the way to get one."""
        self._repo = repo
        self._top = Path(repo.path).resolve()
        self._prefix = PurePosixPath(root.resolve().relative_to(self._top).as_posix())
        # A commit must not outlive a power cut without its objects.
        repo.object_store.fsync_object_files = True

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

    def commit(self, paths: Sequence[str], message: str, when: datetime | None = None) -> str:
        """Commit these files as they are on disk (or as gone), and nothing else; give the sha.

        Without a difference to HEAD no commit is made and HEAD's sha given. What else is staged
        or changed stays as it is. No hook is run. `when` is now if None.
        """
        names = [self._name(path) for path in paths]
        deadline = time.monotonic() + _PATIENCE
        with told(self._top):
            while True:
                try:
                    return self._commit(names, message, when or datetime.now().astimezone())
                except busy() as error:
                    if time.monotonic() > deadline:
                        raise KnowledgeError(busy_message(self._top, error)) from error
                    time.sleep(_PAUSE)

    def read(self, path: str, rev: str) -> bytes | None:
        """Give a file's content at a revision, None if it is not there.

        A revision is a sha, a short sha, a branch, a tag or HEAD, perhaps with ~2 or ^ after it.
        Raises KnowledgeError if there is no such revision.
        """
        name = self._name(path)
        with told(self._top):
            found = lookup(self._repo.object_store, self._commit_at(rev).tree, name)
            if found is None or found[0] == FOLDER:
                return None
            return self._repo.object_store[found[1]].as_raw_string()

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

    def _commit_at(self, rev: str) -> "DulwichCommit":
        from dulwich.errors import RefFormatError
        from dulwich.objectspec import AmbiguousShortId, parse_commit, parse_object

        base = re.split(r"[~^]", rev, maxsplit=1)[0]
        steps = rev[len(base) :].encode()
        try:
            if not base:
                raise KeyError(rev)
            commit = parse_commit(self._repo, base)
            if not steps:
                return commit
            return parse_commit(self._repo, parse_object(self._repo, commit.id + steps).id)
        except AmbiguousShortId as error:
            raise KnowledgeError(f"{rev!r} is short for several commits; write more.") from error
        except (KeyError, ValueError, IndexError, AssertionError, RefFormatError) as error:
            raise KnowledgeError(
                f"There is no version {rev!r} in {self._top}; `git log` lists them."
            ) from error

    def _commit(self, names: Sequence[bytes], message: str, when: datetime) -> str:
        store = self._repo.object_store
        with locked_index(Path(self._repo.index_path())) as index:
            index.refuse_conflicts(names)
            head = self._head()
            tree = self._tree_of(head) if head else None
            files = {name: self._file(name, lookup(store, tree, name)) for name in names}
            entries = {name: file.index_entry() if file else None for name, file in files.items()}
            if index.replace(entries):
                index.save()
            new_tree = tree_with(store, tree, files)
            if head and new_tree == tree:
                return head.decode()
            return self._add_commit(head, new_tree, message, when).decode()

    def _add_commit(
        self, head: "ObjectID | None", tree: "ObjectID", message: str, when: datetime
    ) -> "ObjectID":
        from dulwich.objects import ZERO_SHA
        from dulwich.objects import Commit as DulwichCommit
        from dulwich.refs import HEADREF

        commit = DulwichCommit()
        commit.tree, commit.parents = tree, [head] if head else []
        commit.author, commit.committer = self._identity("AUTHOR"), self._identity("COMMITTER")
        when = when.astimezone() if when.tzinfo is None else when
        commit.author_time = commit.commit_time = int(when.timestamp())
        offset = (when.utcoffset() or timedelta()) // timedelta(minutes=1) * 60
        commit.author_timezone = commit.commit_timezone = offset
        text = message.replace("\0", "").strip("\n") + "\n"
        commit.message = text.encode("utf-8", "replace")
        self._repo.object_store.add_object(commit)
        moved = self._repo.refs.set_if_equals(
            HEADREF,
            head or ZERO_SHA,
            commit.id,
            committer=commit.committer,
            timestamp=commit.commit_time,
            timezone=offset,
            message=b"commit: " + commit.message.split(b"\n")[0],
        )
        if not moved:
            raise Moved
        return commit.id

    def _identity(self, kind: str) -> bytes:
        name = self._setting(kind, "NAME") or _NAME
        return f"{name} <{self._setting(kind, 'EMAIL') or _EMAIL}>".encode("utf-8", "replace")

    def _setting(self, kind: str, what: str) -> str:
        """Look a part of an identity up where git does: environment, then configuration."""
        told = os.environ.get(f"GIT_{kind}_{what}", "")
        config = self._repo.get_config_stack()
        for section in (kind.lower(), "user"):
            if not told:
                try:
                    told = config.get((section.encode(),), what.lower().encode()).decode()
                except KeyError:
                    continue
        return re.sub(r"[<>\x00-\x1f]", "", told).strip()


def _readable(commit: "DulwichCommit") -> Commit:
    zone = timezone(timedelta(seconds=commit.author_timezone))
    return commit_from(
        commit.id.decode(),
        commit.author.decode("utf-8", "replace"),
        datetime.fromtimestamp(commit.author_time, zone),
        commit.message.decode("utf-8", "replace"),
    )
