"""The git repository of a workspace, through libgit2: no git binary, no hook, no filter program.

`Repo.commit` makes files, index and branch one, whatever interrupts it:

1. the objects of the commit, which nothing names yet; git's own locks on index and branch;
2. the intent record: this commit is due, and what its files hold before and after;
3. the files, each old or new; then the index; then the branch; then the intent is forgotten.

A kill before 2 leaves the old state and objects that `git gc` sweeps away. After it the next writer
rolls forward, or back where somebody has changed the files meanwhile. Locks, intent and caches lie
in the folder `adaptbot` of the git directory, where no clone brings them.
"""

import json
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta, timezone
from functools import cache, cached_property, lru_cache, partial
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from adaptbot_cli import bounded
from adaptbot_cli.adapters.store import files
from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    import pygit2

    from adaptbot_cli.adapters.store.trailers import Commit

PATIENCE: float = 10.0
"""Seconds to wait for another git process."""

_INTENT: Final = "adaptbot/intent.json"
UNFINISHED: Final = ".git.adaptbot-"
"""How a repository is called that is being made."""

_ROOM: Final = 256 * 1024
"""Bytes that a commit may need: with less, a failure without a reason is the full disk's."""
_FULL: Final = "No space left on the disk"

_SHA: Final = re.compile(r"[0-9a-f]{40}")
_ODD: Final = re.compile(r"^/|//|\.\.|[:@?*\[\\]|[\x00-\x20\x7f]")
"""What no revision's name has: it would mean something else than a commit."""
_NONE: Final[Mapping[str, bytes]] = MappingProxyType({})
_BARRED: Final = re.compile(
    r"[\\/:\x00-\x1f\x7f\ud800-\udfff]|^(\.|\.\.|\.git|git~\d+)$|[. ]$", re.IGNORECASE
)
"""Names that a stranger's tree may not bring: some file system takes them for something else."""
_MOST_FILES, _DEEPEST = 20_000, 20


@dataclass(frozen=True, slots=True)
class Intent:
    """A commit that is being made: `commit` on `parent`, and by path the blobs that a file holds
    before (`old`), after (`new`) and in the index (`staged`); None where there is no file."""

    commit: str
    parent: str | None
    old: Mapping[str, str | None]
    new: Mapping[str, str | None]
    staged: Mapping[str, str | None]


class Repo:
    """The repository that a workspace is in. Paths are relative to the workspace, with `/`.

    Methods raise KnowledgeError if the repository cannot be read or written.
    """

    def __init__(self, repo: "pygit2.Repository", root: Path) -> None:
        """Wrap a repository; `open` and `open_or_init` are the ways to get one."""
        self.root = root.resolve()
        self.libgit2 = repo
        self.top = Path(repo.workdir).resolve()
        """The folder whose repository it is: the workspace, or one above it."""
        self._gitdir = Path(repo.path)
        if not self.root.is_relative_to(self.top):
            raise KnowledgeError(
                f"{self._gitdir}/config says that its files are in {self.top}, and {root} is not; "
                "correct core.worktree there, or choose another --workspace."
            )
        self._prefix = PurePosixPath(self.root.relative_to(self.top).as_posix())
        self.notes: list[str] = []
        """What a recovery has to tell."""

    @classmethod
    def open(cls, root: Path) -> "Repo | None":
        """Open the repository that a workspace is in, None if there is none; nothing is written."""
        root = root.resolve()
        holder = next((p for p in (root, *root.parents) if (p / ".git").exists()), None)
        if holder is None:
            return None
        pygit2 = _pygit2()
        # libgit2 keeps the folders of its first use, fails at one that may not be entered, and does
        # not know GIT_CONFIG_GLOBAL, where `_setting` looks
        home = os.environ.get("HOME", "")
        own = os.environ.get("XDG_CONFIG_HOME") or f"{home}/.config"
        levels = pygit2.enums.ConfigLevel
        for level, folder in ((levels.GLOBAL, home), (levels.XDG, f"{own}/git")):
            used = not os.environ.get("GIT_CONFIG_GLOBAL") and os.access(folder, os.X_OK)
            pygit2.settings.search_path[level] = folder if used and Path(folder).is_dir() else ""
        with _error_messages(holder):
            _refuse_pipes(holder)
            try:
                found = pygit2.Repository(str(holder))
            except pygit2.GitError as error:
                if "not found" not in str(error).lower():
                    raise
                raise KnowledgeError(
                    f"{holder / '.git'} is no whole git repository: its HEAD or objects are "
                    "missing. Restore it from a copy; `git fsck` tells what is left."
                ) from error
            if found.is_bare:
                return None
            _refuse_borrowed(holder, Path(found.path))
            config = Path(found.path) / "config"
            if config.is_file() and b"\0" in config.read_bytes():  # libgit2 stops there, silently
                raise KnowledgeError(
                    f"{config} is damaged, it holds a NUL byte; correct that file."
                )
            repo = cls(found, root)
            repo.head()
            return repo

    @classmethod
    def open_or_init(cls, root: Path, own: bool = False) -> "Repo":
        """Open the repository that `root` is in; if there is none, make one with branch main.

        With `own` the repository of a folder above does not count.
        """
        with files.refusing(root):
            root.mkdir(parents=True, exist_ok=True)
        found = None if own and not (root / ".git").exists() else cls.open(root)
        if found is not None:
            return found
        with _error_messages(root), files.refusing(root):
            # Made apart and moved into place, so that it is whole or not there at all.
            new = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=root))
            try:
                _pygit2().init_repository(str(new), initial_head="main")
                (new / ".git").rename(root / ".git")
            except (OSError, _pygit2().GitError):
                if not (root / ".git").exists():  # another may have been quicker
                    raise
            finally:
                for left in root.glob(f"{UNFINISHED}*"):
                    shutil.rmtree(left, ignore_errors=True)
        return cls.open_or_init(root)

    # ---------------------------------------------------------------------------------- reading

    def head(self) -> str | None:
        """Return the sha of the commit that is checked out; None before the first one.

        Raises:
            KnowledgeError: HEAD or its branch is damaged: that is no new beginning.
        """
        name, path = self._branch()
        with _error_messages(self.top):
            if name == "HEAD":
                return str(self.libgit2.lookup_reference("HEAD").target)
            damaged = f"{path} is damaged: it names no commit"
            with suppress(FileNotFoundError):
                if not _SHA.fullmatch(path.read_bytes().strip().decode("ascii", "replace")):
                    raise KnowledgeError(f"{damaged}. {self._last_known(name)}")
            try:
                return str(self.libgit2.lookup_reference(name).target)
            except KeyError:
                if self._logged(name):
                    raise KnowledgeError(f"{path} is missing. {self._last_known(name)}") from None
                return None

    @property
    def branch(self) -> str:
        """The name of the branch that is checked out, such as refs/heads/main."""
        return self._branch()[0]

    def reference(self, name: str) -> str | None:
        """Return the commit that a reference names, None if there is none."""
        with _error_messages(self.top):
            found = self.libgit2.references.get(name)
            return str(found.target) if found is not None else None

    def _branch(self) -> tuple[str, Path]:
        """The reference that a commit moves (HEAD itself if detached) and the file it is in."""
        path = self._gitdir / "HEAD"
        with files.refusing(path, "read"):
            text = path.read_bytes()[:4096].decode("utf-8", "replace").strip()
        if _SHA.fullmatch(text):
            return "HEAD", path
        name = text.removeprefix("ref: ").strip()
        if not text.startswith("ref: ") or not name.startswith("refs/") or _ODD.search(name):
            raise KnowledgeError(
                f"{path} is damaged: it names no branch. Write the branch into it that was checked "
                "out, such as `git symbolic-ref HEAD refs/heads/main`; `git fsck` tells the rest."
            )
        return name, self._common / name

    @cached_property
    def _common(self) -> Path:
        """The git directory that the worktrees of a repository share."""
        with suppress(OSError):
            return (self._gitdir / (self._gitdir / "commondir").read_text().strip()).resolve()
        return self._gitdir

    def _logged(self, name: str) -> str:
        """The last commit that the branch's log knows of, empty if it has none."""
        try:
            lines = (self._common / "logs" / name).read_bytes()[-65536:].splitlines()
            found = lines[-1].split(b" ")[1].decode("ascii", "replace")
        except (OSError, IndexError):
            return ""
        return found if _SHA.fullmatch(found) and set(found) != {"0"} else ""

    def _last_known(self, name: str) -> str:
        sha = self._logged(name)
        if not sha:
            return "`git fsck --lost-found` finds the last commit."
        again = f"git -C {self.root} update-ref {name} {sha}"
        return f"Its log says {sha[:10]}: remove the file if it is there, then `{again}`."

    def _commit_at(self, rev: str) -> Any:
        pygit2 = _pygit2()
        with _error_messages(self.top):
            try:
                if _SHA.fullmatch(rev):
                    return self.libgit2[rev].peel(pygit2.Commit)
                if not rev or not rev.isprintable() or _ODD.search(re.sub(r"[~^][0-9]*", "", rev)):
                    raise KeyError(rev)
                return self.libgit2.revparse_single(rev).peel(pygit2.Commit)
            except (pygit2.GitError, ValueError, KeyError) as error:
                if "ambiguous" in str(error):
                    text = f"{rev!r} is short for several commits; write more."
                    raise KnowledgeError(text) from error
                raise KnowledgeError(
                    f"There is no version {rev!r} in {self.top}; `git log` lists them."
                ) from error

    def read(self, path: str, rev: str | None) -> bytes | None:
        """Return a file's content at a revision, None if it is not there.

        Raises:
            KnowledgeError: there is no such revision.
        """
        sha = self.blobs(rev, [path]).get(path)
        return None if sha is None else self.blob(sha)

    def blob(self, sha: str) -> bytes:
        """Return the content of a blob."""
        with _error_messages(self.top):
            return self.libgit2[sha].data  # type: ignore[attr-defined,no-any-return]

    def blobs(self, rev: str | None, paths: Iterable[str]) -> dict[str, str]:
        """Return the shas of the blobs of some files at a revision, those that are there."""
        tree = self._tree_at(rev)
        found = {path: self._entry(tree, path) for path in paths}
        return {path: str(entry.id) for path, entry in found.items() if entry is not None}

    def folder(self, path: str, rev: str | None) -> dict[str, str]:
        """Return the shas of the blobs in a folder and in its folders at a revision, by name."""
        tree, name, blob = self._tree_at(rev), self._name(path), _pygit2().Blob
        with _error_messages(self.top):
            here = tree[name] if name in tree else ()  # noqa: SIM401 - a tree has no `get`
            return {name: str(each.id) for name, each in _below(here, 1) if isinstance(each, blob)}

    def _tree_at(self, rev: str | None) -> Any:
        """The tree of a revision; an empty one before the first."""
        with _error_messages(self.top):
            return {} if rev is None else self._commit_at(rev).tree

    def _entry(self, tree: Any, path: str) -> "pygit2.Object | None":
        with _error_messages(self.top):
            name = self._name(path)
            entry = tree[name] if name in tree else None  # noqa: SIM401
            return entry if isinstance(entry, _pygit2().Blob) else None

    def log(
        self, paths: Sequence[str] = (), since: str | None = None, head: str | None = None
    ) -> "Iterator[Commit]":
        """Give the commits that changed these files or folders (all, if none), newest first;
        with `since` those that it does not lead back to; from `head` on, not what is checked out.
        """
        head = head or self.head()
        if head is None:
            return
        sort = _pygit2().enums.SortMode
        names = [self._name(path) for path in paths]
        with _error_messages(self.top):
            walk = self.libgit2.walk(head, sort.TOPOLOGICAL | sort.TIME)
            if since is not None:
                walk.hide(since)
            for commit in walk:
                parents = self._parents(commit)
                others = [self._ids(sha, *names) for sha in parents] or [(None,) * len(names)]
                if not names or self._ids(commit.id, *names) not in others:
                    yield _commit(commit, tuple(map(str, parents)))

    def commit_of(self, rev: str) -> "Commit":
        """Return the commit of a revision: a sha or its beginning, a branch, a tag, HEAD~2; in a
        shallow clone with the parents that are there.

        Raises:
            KnowledgeError: there is no such revision.
        """
        with _error_messages(self.top):
            found = self._commit_at(rev)
            return _commit(found, tuple(map(str, self._parents(found))))

    def _parents(self, commit: "pygit2.Commit") -> "list[pygit2.Oid]":
        """The parents that are there: a shallow clone lacks some."""
        shallow = self.libgit2.is_shallow
        return [sha for sha in commit.parent_ids if not shallow or sha in self.libgit2]

    def leads_to(self, sha: str, head: str) -> bool:
        """Tell whether a commit is an ancestor of another, or that one itself."""
        with _error_messages(self.top):
            return sha == head or (sha in self.libgit2 and self.libgit2.descendant_of(head, sha))

    def bases(self, one: str, other: str) -> list[str]:
        """Return the best common ancestors of two commits; none if they have none."""
        for sha, later in ((one, other), (other, one)):
            if self.leads_to(sha, later):
                return [sha]
        with _error_messages(self.top):
            walk = self.libgit2.walk(one)
            walk.hide(other)
            own = {str(commit.id): self._parents(commit) for commit in walk}
        edge = {str(sha) for parents in own.values() for sha in parents} - own.keys()
        return sorted(a for a in edge if not any(a != b and self.leads_to(a, b) for b in edge))

    def plain_files(self, rev: str) -> dict[str, str]:
        """Return the shas of the blobs of every file of a commit, by path.

        Raises:
            KnowledgeError: it holds a link, a submodule, a name that is none here, or too much.
        """
        found: dict[str, str] = {}
        with _error_messages(self.top):
            for path, entry in _below(self._commit_at(rev).tree, _DEEPEST):
                if any(map(_BARRED.search, path.split("/"))) or isinstance(entry, _pygit2().Tree):
                    text = "has a name that no file of a workspace has"
                elif entry.filemode == _pygit2().enums.FileMode.LINK:
                    text = "is a symbolic link"
                elif not isinstance(entry, _pygit2().Blob):
                    text = "is a submodule"
                elif len(found) == _MOST_FILES:
                    text = f"comes after {_MOST_FILES:,} files"
                else:
                    found[path] = str(entry.id)
                    continue
                raise KnowledgeError(f"{rev[:7]}: {path!r} {text}; it is not taken.")
        return found

    def merged(self, before: str | None, ours: str | None, theirs: str | None) -> bytes | None:
        """Merge three versions of a file by lines, as git does; None where both sides have changed
        the same ones."""
        entry, mode = _pygit2().IndexEntry, _pygit2().enums.FileMode.BLOB
        sides = (before, ours, theirs)
        a, b, c = (entry("file", _pygit2().Oid(hex=sha), mode) if sha else None for sha in sides)
        with _error_messages(self.top):
            result = self.libgit2.merge_file_from_index(a, b, c)
            return result.contents.encode() if result.automergeable else None

    @lru_cache(maxsize=64)  # noqa: B019 - a process opens few repositories
    def _ids(self, commit: "pygit2.Oid", *names: str) -> tuple[object, ...]:
        tree = self.libgit2[commit].tree
        return tuple(tree[name].id if name in tree else None for name in names)

    def dirty(
        self, paths: Sequence[str], held: Mapping[str, bytes | None] | None = None
    ) -> list[str]:
        """Return those files that differ from HEAD: changed, new or gone. `held` is what they hold,
        if that has been read.

        What git would change on the way into the repository (line ends) makes no difference.
        """
        before = self.blobs(self.head(), paths)
        held = {path: files.read(self.root, path) for path in paths} if held is None else held
        now = {
            path: str(_pygit2().hash(self._cleaned(path, data)))
            for path, data in held.items()
            if data is not None
        }
        return [path for path in paths if before.get(path) != now.get(path)]

    def _cleaned(self, path: str, data: bytes) -> bytes:
        """What git holds of a file with this content: with line ends as configured."""
        with _error_messages(self.top):
            filters = self.libgit2.load_filter_list(self._name(path))
            return bytes(filters.apply_to_buffer(data)) if filters is not None else data

    def staged(self, path: str) -> bytes | None:
        """Return a file's content in the index, None if it is not there or being merged."""
        with _error_messages(self.top):
            self.libgit2.index.read()
            sha = self._in_index(path)
            return None if sha is None else self.blob(sha)

    @lru_cache(maxsize=256)  # noqa: B019 - a process opens few repositories
    def _name(self, path: str) -> str:
        """Return a path as git knows it; raise KnowledgeError if it leaves the workspace."""
        return str(self._prefix / files.inside(self.root, path))

    # ---------------------------------------------------------------------------------- writing

    @contextmanager
    def writing(self, timeout: float = 30.0) -> Iterator[None]:
        """Hold the workspace's write lock; first finish or undo what a kill has interrupted."""
        with (
            self._shared(),
            files.refusing(self._gitdir / "adaptbot"),
            bounded.folder(self._gitdir, "adaptbot", make=True) as state,
            files.locked(state, self.root, timeout),
        ):
            self._recover()
            yield

    def interrupted(self) -> bool:
        """Tell whether a commit has begun and not ended: it is under way or was interrupted."""
        return files.read(self._gitdir, _INTENT) is not None

    def problems(self) -> Iterator[tuple[str, str]]:
        """Give what keeps, or may keep, a commit from being made, each with what to do."""
        for check in (self._refuse_signing, partial(self._refuse_conflicts, {}), self._intent):
            try:
                check()
            except KnowledgeError as error:
                yield str(error), "see there"
        with suppress(KnowledgeError):
            if intent := self._intent():
                text = f"a commit of {len(intent.new)} files was interrupted"
                there = intent.commit in self.libgit2
                yield text, f"the next command {'finishes' if there else 'undoes'} it"
        for lock in (self._gitdir / "index.lock", self._branch()[1].with_suffix(".lock")):
            if lock.exists():
                yield f"{lock} is there", "if no git process is at work, remove it"

    def generation(self) -> int:
        """Return a number that each commit changes."""
        with suppress(OSError):
            return (self._gitdir / "adaptbot").stat().st_mtime_ns
        return 0

    def may_write(self) -> bool:
        """Tell whether this user may write here at all."""
        folder = self._gitdir / "adaptbot"
        return os.access(folder if folder.exists() else self._gitdir, os.W_OK)

    def commit(
        self,
        contents: Mapping[str, bytes | None],
        message: str,
        when: datetime | None = None,
        apart: Mapping[str, bytes] = _NONE,
        staged: Mapping[str, bytes] = _NONE,
        merging: str | None = None,
    ) -> str:
        """Give files new contents (None: gone) and commit them, and nothing else; return the sha.

        `apart` is committed instead of what the disk holds; `staged` is what the index holds where
        the user has staged something else. `merging` is the commit of a repository elsewhere that
        becomes a parent, or is itself the result where it follows HEAD. Without it and without a
        difference to HEAD no commit is made and HEAD's sha returned. The caller is in `writing`.
        `when` is now if None.

        Raises:
            KnowledgeError: it cannot be made; nothing has changed then.
        """
        pygit2 = _pygit2()
        self._refuse_signing()
        when = when or datetime.now().astimezone()
        with self._locked() as (index, branch, ref):
            head = self.head()
            tree = self._tree_at(head)
            disk = {name: files.read(self.root, name) for name in contents}
            kept = {
                name: apart[name] if name in apart else data and self._cleaned(name, data)
                for name, data in contents.items()
            }
            self._refuse_conflicts(contents)
            new_tree = self._tree(tree, kept)
            sha = head
            if merging is not None and (head is None or self.leads_to(head, merging)):
                sha = merging
            elif not head or new_tree != tree.id or merging is not None:
                made = self._author("AUTHOR", when), self._author("COMMITTER", when)
                text = message.replace("\0", "").strip("\n") + "\n"
                sha = str(self.libgit2.create_commit(
                    None, *made, text.encode("utf-8", "replace").decode(), new_tree,
                    [pygit2.Oid(hex=sha) for sha in (head, merging) if sha],
                ))  # fmt: skip
            elif disk == dict(contents):
                return str(head)
            intent = Intent(str(sha), head, *(
                {name: self._store(data) for name, data in given.items()}
                for given in (disk, contents, {**kept, **staged})
            ))  # fmt: skip
            files.write(self._gitdir, _INTENT, json.dumps(asdict(intent)).encode())
            try:
                self._finish(intent, index, branch, ref)
            except BaseException:
                if index.exists():
                    self._back(intent, index)
                elif self.head() != intent.commit:
                    self._move(intent, branch, ref)  # files and index are the new ones
                raise
            return str(sha)

    def _store(self, data: bytes | None) -> str | None:
        return None if data is None else str(self.libgit2.create_blob(data))

    def _tree(self, tree: Any, kept: Mapping[str, bytes | None]) -> Any:
        pygit2 = _pygit2()
        index = pygit2.Index()
        if tree:
            index.read_tree(tree)
        for path, data in kept.items():
            self._set(index, path, self._store(data), tree)
        return index.write_tree(self.libgit2)

    def _set(self, index: "pygit2.Index", path: str, blob: str | None, tree: Any) -> None:
        """Set or remove (None) a file in an index; it keeps its mode."""
        pygit2, name = _pygit2(), self._name(path)
        if blob is None:
            if name in index:
                index.remove(name)
            return
        entry = self._entry(tree, path)
        mode = entry.filemode if entry is not None else pygit2.enums.FileMode.BLOB
        if name not in index:  # perhaps a folder was there, or a file where its folder is now
            index.remove_directory(name)
            for parent in PurePosixPath(name).parents:
                if parent.as_posix() in index:
                    index.remove(parent.as_posix())
        index.add(pygit2.IndexEntry(name, pygit2.Oid(hex=blob), mode))

    def _finish(self, intent: Intent, index: Path, branch: Path, ref: str) -> None:
        """Do what an intent says: the files, the index, the branch; then forget it."""
        for path, blob in intent.new.items():
            if blob != intent.old[path] and self._on_disk(path) == intent.old[path]:
                files.write(self.root, path, None if blob is None else self.blob(blob))
        self._write_index(index, intent.staged, intent.commit)
        self._move(intent, branch, ref)

    def _move(self, intent: Intent, branch: Path, ref: str) -> None:
        """Let the branch name the commit of an intent, and forget the intent."""
        if intent.commit != intent.parent:
            _place(branch, f"{intent.commit}\n".encode())
            with suppress(OSError):  # the log is a help for people; the commit is made
                self._log(ref, intent)
        files.write(self._gitdir, _INTENT, None)

    def _on_disk(self, path: str) -> str | None:
        data = files.read(self.root, path)
        return None if data is None else str(_pygit2().hash(data))

    def _back(self, intent: Intent, index: Path) -> None:
        """Undo what an intent has done, leaving alone what somebody has changed since."""
        for path, blob in intent.old.items():
            files.clear(self.root, path)
            if blob != intent.new[path] and self._on_disk(path) == intent.new[path]:
                if blob is None:
                    files.write(self.root, path, None)
                elif blob in self.libgit2:
                    files.write(self.root, path, self.blob(blob))
        head = self.head()
        before = self.blobs(head, intent.old)
        self.libgit2.index.read()
        ours = {
            path: before.get(path)
            for path, blob in intent.staged.items()
            if blob is not None and self._in_index(path) == blob
        }
        if ours:
            self._write_index(index, ours, head)
        files.write(self._gitdir, _INTENT, None)

    def _in_index(self, path: str) -> str | None:
        try:
            return str(self.libgit2.index[self._name(path)].id)
        except KeyError:
            return None

    def _recover(self) -> None:
        """Finish or undo a commit that a kill has interrupted, and free its locks."""
        for held, at in (("index", self._gitdir / "index"), ("branch", self._branch()[1])):
            self._free(held, at)
        for name in ("index", "index.lock", files.beside("intent.json")):
            (self._gitdir / "adaptbot" / name).unlink(missing_ok=True)
        intent = self._intent()
        if intent is None:
            return
        with self._locked() as (index, branch, ref):
            for name in intent.new:
                files.clear(self.root, name)
            head = self.head()
            there = intent.commit in self.libgit2 and all(
                blob is None or blob in self.libgit2 for blob in intent.new.values()
            )
            whole = there and all(
                self._on_disk(name) in (intent.old[name], blob) for name, blob in intent.new.items()
            )
            if (there and head == intent.commit) or (whole and head == intent.parent):
                self._finish(intent, index, branch, ref)
                return
            again = whole and self._again(intent, head)
            if not there:
                text = "its objects are gone from the repository, so it was undone"
                self.notes.append(f"a commit was interrupted, and {text}; see `git status`")
            self._back(intent, index)
        if again:
            self.commit(*again)

    def _intent(self) -> Intent | None:
        """The commit that was interrupted, if one was."""
        data = files.read(self._gitdir, _INTENT)
        if data is None:
            return None
        try:
            intent = Intent(**json.loads(data))
            blobs = (intent.old, intent.new, intent.staged)
            shas = [intent.commit, intent.parent, *(sha for at in blobs for sha in at.values())]
            if any(sha is not None and not _SHA.fullmatch(sha) for sha in shas):
                raise ValueError("no sha")
            if not intent.old.keys() == intent.new.keys() == intent.staged.keys():
                raise ValueError("not the same files")
            for name in intent.new:
                self._name(name)
            return intent
        except (TypeError, AttributeError, ValueError, RecursionError) as error:
            raise KnowledgeError(
                f"{self._gitdir / _INTENT}, the record of an interrupted commit, is damaged. "
                f"Compare the files of {self.root} with `git status` and `git diff`, mend them if "
                "need be, then remove that record."
            ) from error

    def _again(self, intent: Intent, head: str | None) -> "tuple[Any, ...] | None":
        """What to commit anew, if somebody else has committed other files meanwhile."""
        revisions = (intent.commit, intent.parent, head)
        made, before, now = (self.blobs(each, intent.new) for each in revisions)
        if now != before:
            return None
        contents = {p: None if b is None else self.blob(b) for p, b in intent.new.items()}
        message = str(self._commit_at(intent.commit).message)
        commit = self.commit_of(intent.commit)
        apart = {p: self.blob(b) for p, b in made.items()}
        follows = intent.parent in (None, *commit.parents)
        merging = next((sha for sha in commit.parents if sha != intent.parent), None)
        return contents, message, commit.when, apart, _NONE, merging if follows else commit.sha

    def _write_index(
        self, lock: Path, staged: Mapping[str, str | None], commit: str | None
    ) -> None:
        """Set files in the index, whose lock is held, and leave all else in it as it is."""
        pygit2 = _pygit2()
        path = self._gitdir / "index"
        private = self._gitdir / "adaptbot" / "index"
        old = path.read_bytes() if path.exists() else None
        for left in (private, private.with_name("index.lock")):
            left.unlink(missing_ok=True)
        if old is not None:
            private.write_bytes(old)
        index = pygit2.Index(str(private))
        tree = self._tree_at(commit)
        for name, blob in staged.items():
            self._set(index, name, blob, tree)
        index.write()
        data = private.read_bytes()
        private.unlink()
        # git doubts an entry that is no older than the index: a new index must not seem newer.
        _place(lock, data, same_time=True)

    def _refuse_conflicts(self, paths: Mapping[str, object]) -> None:
        """Raise KnowledgeError if one of the files is being merged."""
        with _error_messages(self.top):
            self.libgit2.index.read()
        names = {self._name(path) for path in paths}
        for sides in self.libgit2.index.conflicts or ():
            for side in sides:
                if side is not None and side.path in names:
                    raise KnowledgeError(
                        f"{side.path} is in the middle of a merge; resolve it with git first."
                    )

    def setting(self, name: str, default: str = "") -> str:
        """Look up a setting of git's configuration."""
        named = os.environ.get("GIT_CONFIG_GLOBAL", "")
        with _error_messages(self.top):
            found: list[Any] = [self.libgit2.config]
            found += [_pygit2().Config(named)] if Path(named).is_file() else []
            return next((str(config[name]) for config in found if name in config), default)

    def _refuse_signing(self) -> None:
        with _error_messages(self.top):
            if self.setting("commit.gpgsign").lower() in ("true", "yes", "on", "1"):
                raise KnowledgeError(
                    "git is configured to sign every commit (commit.gpgsign), and adaptbot cannot "
                    f"sign: `git -C {self.root} config commit.gpgsign false` lets it commit here."
                )

    def _author(self, kind: str, when: datetime) -> Any:
        """Who is named where git looks for names: environment, then configuration."""

        def setting(what: str, default: str) -> str:
            text = os.environ.get(f"GIT_{kind}_{what}", "")
            for section in (kind.lower(), "user"):
                text = text or self.setting(f"{section}.{what.lower()}")
            return re.sub(r"[<>\x00-\x1f]", "", text).strip() or default

        name, email = setting("NAME", "adaptbot"), setting("EMAIL", "adaptbot@localhost")
        when = when.astimezone() if when.tzinfo is None else when
        offset = (when.utcoffset() or timedelta()) // timedelta(minutes=1)
        return _pygit2().Signature(name, email, int(when.timestamp()), offset, "utf-8")

    def _log(self, ref: str, intent: Intent) -> None:
        if self.setting("core.logallrefupdates").lower() in ("false", "no", "off", "0"):
            return
        commit = self._commit_at(intent.commit)
        who = commit.committer
        line = (
            f"{intent.parent or '0' * 40} {intent.commit} {who.name} <{who.email}> {who.time} "
            f"{_when(who):%z}\tcommit: {commit.message.partition(chr(10))[0]}\n"
        )
        branch = [self._common / "logs" / ref] if ref != "HEAD" else []
        for path in (self._gitdir / "logs" / "HEAD", *branch):
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("ab") as file:
                file.write(line.encode("utf-8", "replace"))

    # ------------------------------------------------------------------- git's locks, own state

    @contextmanager
    def _locked(self) -> Iterator[tuple[Path, Path, str]]:
        """Hold git's locks on the index and then on the branch; give both, and its reference."""
        with _error_messages(self.top), self._git_lock("index", self._gitdir / "index") as index:
            ref, path = self._branch()
            with self._git_lock("branch", path) as branch:
                yield index, branch, ref

    @contextmanager
    def _git_lock(self, key: str, path: Path) -> Iterator[Path]:
        """Hold git's lock on a file, `path` with `.lock`; give the lock's path.

        The lock is a hard link to a file of our own, where the disk has them: after a kill `_free`
        finds both and that they are one, which no lock of git's is.
        """
        lock, own = path.with_name(f"{path.name}.lock"), self._own(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        own.unlink(missing_ok=True)
        os.close(os.open(own, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        try:
            files.wait(
                lambda: _linked(own, lock),
                PATIENCE,
                f"Another git process is busy in {self.top}",
                f"wait until it is done, then try again; if none is, remove {lock}.",
            )
            try:
                yield lock
            finally:
                with suppress(FileNotFoundError):
                    if not own.exists() or lock.samefile(own):
                        lock.unlink()
        finally:
            own.unlink(missing_ok=True)

    def _free(self, name: str, path: Path) -> None:
        """Remove git's lock on a file if a killed run of ours has left it."""
        own, lock = self._own(name), path.with_name(f"{path.name}.lock")
        with suppress(FileNotFoundError):
            if lock.samefile(own):
                lock.unlink()
        own.unlink(missing_ok=True)

    def _own(self, name: str) -> Path:
        return self._gitdir / "adaptbot" / f"held-{name}"

    def cached(self, name: str) -> bytes | None:
        """Return what was last kept under a name, None if nothing can be had."""
        with suppress(KnowledgeError):
            return files.read(self._gitdir, f"adaptbot/cache-{name}")
        return None

    def cache(self, name: str, data: bytes) -> None:
        """Keep what was worked out; a workspace that may not be written goes without."""
        if self.may_write():
            with suppress(KnowledgeError), self._shared():
                files.write(self._gitdir, f"adaptbot/cache-{name}", data)

    @contextmanager
    def _shared(self) -> Iterator[None]:
        """Let others write what is written here, if the repository is shared by a group."""
        text = self.setting("core.sharedrepository").lower()
        free = {"group": 0o070, "true": 0o070, "1": 0o070, "all": 0o077, "world": 0o077,
                "everybody": 0o077, "2": 0o077}.get(text, 0)  # fmt: skip
        if re.fullmatch(r"0[0-7]{3}", text):
            free = int(text, 8) & 0o077
        mask = os.umask(0)
        os.umask(mask & ~free)
        try:
            yield
        finally:
            os.umask(mask)


_READ_WHOLE = ("HEAD", "index", "config", "commondir", "packed-refs", "shallow",
               "info/attributes", "info/exclude", "objects/info/alternates")  # fmt: skip
"""What libgit2 reads of a repository before anything is asked of it."""


def _refuse_pipes(holder: Path) -> None:
    """Refuse a repository in which reading would wait for ever. Raises KnowledgeError."""
    git = holder / ".git"
    paths = [git / name for name in _READ_WHOLE]
    paths += [holder / ".gitattributes", holder / ".gitignore"]
    for folder, _, names in os.walk(git / "refs"):
        paths += [Path(folder) / name for name in names]
    for path in paths:
        with suppress(OSError):
            if not stat.S_ISREG(path.stat().st_mode):
                raise KnowledgeError(f"{path} is not used: it is no regular file; move it away.")


def _refuse_borrowed(holder: Path, git: Path) -> None:
    """Refuse a folder that names a repository which does not name it: what is written here would
    go into somebody's other work. Raises KnowledgeError."""
    at = holder / ".git"
    if at.is_dir() and not at.is_symlink():
        return
    back = git / "gitdir"  # of a worktree; a submodule has its folder in its configuration
    text = back.read_text("utf-8", "replace").strip() if back.is_file() else ""
    config = _pygit2().Config(str(git / "config")) if (git / "config").is_file() else {}
    text = text or (str(config["core.worktree"]) if "core.worktree" in config else "")
    named = Path(os.path.normpath(git / text)) if text else git
    if at.is_symlink() or named not in (at, holder):
        raise KnowledgeError(
            f"{at} leads to {git}, which is the repository of another folder. If it is meant to be "
            f"that of this one, `git --git-dir {git} config core.worktree {holder}` says so."
        )


def _below(folder: Any, deep: int) -> Iterator[tuple[str, Any]]:
    """Give what is in a folder of a commit and in its folders, so deep at most, by path."""
    for each in folder:
        if deep and isinstance(each, _pygit2().Tree):
            yield from ((f"{each.name}/{path}", below) for path, below in _below(each, deep - 1))
        else:
            yield each.name, each


def _commit(commit: "pygit2.Commit", parents: tuple[str, ...]) -> "Commit":
    from adaptbot_cli.adapters.store.trailers import Commit

    who = commit.author
    message = commit.raw_message.decode("utf-8", "replace")
    return Commit(str(commit.id), f"{who.name} <{who.email}>", _when(who), message, parents)


def _when(who: "pygit2.Signature") -> datetime:
    return datetime.fromtimestamp(who.time, timezone(timedelta(minutes=who.offset)))


def _linked(own: Path, lock: Path) -> bool:
    """Take a lock as a hard link to a file of our own; tell whether it was free."""
    try:
        os.link(own, lock)
    except FileExistsError:
        return False
    except OSError:
        # A disk without hard links: the lock is as good, but after a kill it is nobody's.
        try:
            os.close(os.open(lock, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        except FileExistsError:
            return False
        own.unlink(missing_ok=True)
    return True


def _place(lock: Path, data: bytes, same_time: bool = False) -> None:
    """Let what a lock guards have new content, through to the disk; the lock is gone then."""
    path = lock.with_name(lock.name.removesuffix(".lock"))
    about = path.stat() if path.exists() else None
    with lock.open("r+b") as file:
        file.write(data)
        file.truncate()
        file.flush()
        if about is not None:
            with suppress(PermissionError):
                os.fchmod(file.fileno(), stat.S_IMODE(about.st_mode))
        os.fsync(file.fileno())
    if about is not None and same_time:
        os.utime(lock, ns=(about.st_mtime_ns, about.st_mtime_ns))
    lock.replace(path)
    with bounded.folder(lock.parent) as handle:
        os.fsync(handle)


@cache
def _pygit2() -> Any:
    """pygit2, imported when it is first used, and set up as this tool wants it."""
    import pygit2

    pygit2.settings.enable_fsync_gitdir(True)
    # Who may be trusted is looked at once, when the workspace is found.
    pygit2.settings.owner_validation = False
    if os.environ.get("GIT_CONFIG_NOSYSTEM"):
        pygit2.settings.search_path[pygit2.enums.ConfigLevel.SYSTEM] = ""
    return pygit2


def _full(place: Path) -> bool:
    """Is the disk full? libgit2 then raises with the words of an older error, or with none."""
    return shutil.disk_usage(place if place.is_dir() else place.parent).free < _ROOM


_SENTENCES: Final = (
    (("failed to parse config", "config file"),
     "git's configuration cannot be read: {1}; correct that file."),
    (("mandatory extension",),
     "{0} has a split or sparse index, which adaptbot cannot write; run `git update-index "
     "--no-split-index` or `git sparse-checkout reapply --no-sparse-index`."),
    (("unsupported", "unknown object format"),
     "The git repository of {0} cannot be written by adaptbot: {1}; choose a workspace outside it "
     "with --workspace."),
)  # fmt: skip
"""What is told of an error of libgit2 with one of some words in it."""


@contextmanager
def _error_messages(place: Path) -> Iterator[None]:
    """Turn errors of libgit2 into a KnowledgeError that says what to do."""
    pygit2 = _pygit2()
    try:
        yield
    except pygit2.GitError as error:
        text = str(error)
        sentence = next((found for words, found in _SENTENCES if any(w in text for w in words)), "")
        if not sentence:
            sentence = "The git repository of {0} could not be used: {1}; `git fsck` tells more."
            text = _FULL if _full(place) else text
        raise KnowledgeError(sentence.format(place, text)) from error
    except OSError as error:
        text = error.strerror or (_FULL if _full(place) else str(error))
        raise KnowledgeError(
            f"The git repository of {place} could not be used: {text} "
            f"({error.filename or place}); correct that and try again."
        ) from error
    except (KeyError, ValueError) as error:
        raise KnowledgeError(
            f"The git repository of {place} is damaged ({error}); `git fsck` tells where. Restore "
            "what is missing from a copy or a clone."
        ) from error
