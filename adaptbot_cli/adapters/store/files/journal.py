"""A change of several files as one unit."""

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final
from uuid import uuid4

from adaptbot_cli.adapters.store.files.disk import (
    FOLDER,
    failure,
    own_folder,
    sync_folder,
    sync_folders,
    told,
    write_new,
)
from adaptbot_cli.errors import KnowledgeError

_INTENT: Final = "intent.json"
_COMMIT: Final = "commit.json"


@dataclass(frozen=True, slots=True)
class _Journal:
    """What is to be done: each target gets its new file; the files in `drop` go."""

    moves: tuple[tuple[str, str], ...]
    drop: tuple[str, ...] = ()

    def dumps(self) -> bytes:
        return json.dumps({"moves": self.moves, "drop": self.drop}).encode()

    @classmethod
    def read(cls, path: Path) -> "_Journal | None":
        """Read a journal; None if it was not written to its end, so that nothing came after."""
        try:
            said = json.loads(path.read_bytes())
        except ValueError:
            return None
        return cls(tuple((old, new) for old, new in said["moves"]), tuple(said["drop"]))


def write_files(root: Path, changes: Mapping[str, bytes]) -> None:
    """Give files (named relative to `root`, with `/`) new contents: all of them or none.

    A file keeps its mode, a symbolic link its target; missing folders are made. The caller holds
    `lock(root)`. What an earlier call left unfinished is finished first. Raises KnowledgeError,
    with nothing changed, if a name leaves the workspace or a file cannot be written.
    """
    targets = {_target(root, name): data for name, data in changes.items()}
    recover(root)
    new = {path: data for path, data in targets.items() if _content(path) != data}
    if not new:
        return
    made: list[Path] = []
    try:
        journal = _prepare(root, new, made)
        _settle_or_undo(root, journal)
    except KnowledgeError:
        _remove_folders(made)
        raise


def interrupted(root: Path) -> bool:
    """Tell whether a write has begun and not ended: it is under way or was interrupted."""
    folder = root / FOLDER / "journal"
    try:
        return (folder / _COMMIT).exists() or (folder / _INTENT).exists()
    except OSError:
        return False  # who may not look into the tool's folder may still read the workspace


def recover(root: Path) -> bool:
    """Bring the files to the state before or after an interrupted write; tell if there was one.

    The caller holds `lock(root)`. Raises KnowledgeError if that state cannot be reached now; a
    later call tries again.
    """
    folder = root / FOLDER / "journal"
    intent, commit = folder / _INTENT, folder / _COMMIT
    with told(folder):
        if not commit.exists() and not intent.exists():
            return False
        if commit.exists():
            journal = _Journal.read(commit)
            if journal is None:
                raise KnowledgeError(f"{commit} is damaged; compare the files with git, remove it.")
            _settle(root, journal)
        if intent.exists():
            abandoned = _Journal.read(intent)
            _unlink(root / new for _, new in (abandoned.moves if abandoned else ()))
            _unlink([intent])
            sync_folder(folder)
    return True


def _target(root: Path, name: str) -> Path:
    path = PurePosixPath(name)
    if not path.parts or path.is_absolute() or ".." in path.parts or path.parts[0] == FOLDER:
        raise KnowledgeError(f"{name!r} is not the name of a file in the workspace {root}.")
    target = (root / path).resolve()
    if target.is_dir():
        raise KnowledgeError(f"{target} could not be written: it is a folder.")
    return target


def _content(path: Path) -> bytes | None:
    with told(path):
        return path.read_bytes() if path.exists() else None


def _prepare(root: Path, new: Mapping[Path, bytes], made: list[Path]) -> _Journal:
    """Write the new contents beside the old ones; the journal of intent says where."""
    folder = own_folder(root) / "journal"
    mark = uuid4().hex[:12]
    moves = tuple((_name(root, path), _name(root, _beside(path, mark))) for path in new)
    intent, commit = folder / _INTENT, folder / _COMMIT
    try:
        with told(folder):
            folder.mkdir(exist_ok=True)
            write_new(intent, _Journal(moves).dumps(), None)
            sync_folder(folder)
        for path, data in new.items():
            with told(path):
                _make_folders(path.parent, made)
                write_new(_beside(path, mark), data, path)
                sync_folder(path.parent)
        with told(folder):
            intent.replace(commit)
    except BaseException:
        # From the rename on, what was written belongs to the journal.
        for path in [] if commit.exists() else [*(_beside(path, mark) for path in new), intent]:
            with suppress(OSError):
                path.unlink()
        raise
    return _Journal(moves)


def _beside(path: Path, mark: str) -> Path:
    return path.with_name(f".{path.name[:40]}.{mark}.adaptbot")


def _name(root: Path, path: Path) -> str:
    """Name a file in a way that lasts when the workspace is moved, if it is in it."""
    base = root.resolve()
    return str(path.relative_to(base)) if path.is_relative_to(base) else str(path)


def _settle_or_undo(root: Path, journal: _Journal) -> None:
    """Put the new files in place; if one cannot be, put the old ones back and say why."""
    old = {name: _content(root / name) for name, _ in journal.moves}
    try:
        sync_folder(root / FOLDER / "journal")
        _settle(root, journal)
    except OSError as error:
        done = [name for name, new in journal.moves if not (root / new).exists()]
        _undo(root, journal, {name: old[name] for name in done})
        raise failure(Path(str(error.filename2 or error.filename or root)), error) from error


def _undo(root: Path, journal: _Journal, old: Mapping[str, bytes | None]) -> None:
    """Write a journal that leads back over the one that led on, and follow it."""
    folder = root / FOLDER / "journal"
    mark = uuid4().hex[:12]
    before = {name: data for name, data in old.items() if data is not None}
    moves = tuple((name, str(_beside(Path(name), mark))) for name in before)
    created = (name for name, data in old.items() if data is None)
    back = _Journal(moves, (*(new for _, new in journal.moves), *created))
    with told(folder):
        write_new(folder / _INTENT, back.dumps(), None)
        for name, new in moves:
            write_new(root / new, before[name], root / name)
            sync_folder((root / new).parent)
        (folder / _INTENT).replace(folder / _COMMIT)
        _settle(root, back)


def _settle(root: Path, journal: _Journal) -> None:
    """Do what a journal says, then remove it; may be repeated after an interruption."""
    for target, new in journal.moves:
        if (root / new).exists():
            (root / new).replace(root / target)
    _unlink(root / name for name in journal.drop)
    sync_folders(root / name for name, _ in journal.moves)
    folder = root / FOLDER / "journal"
    (folder / _COMMIT).unlink()
    sync_folder(folder)


def _make_folders(folder: Path, made: list[Path]) -> None:
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir()
        made.append(path)
        sync_folder(path.parent)


def _remove_folders(made: list[Path]) -> None:
    for path in reversed(made):
        with suppress(OSError):
            path.rmdir()


def _unlink(paths: Iterable[Path]) -> None:
    for path in paths:
        with suppress(FileNotFoundError, NotADirectoryError):
            path.unlink()
