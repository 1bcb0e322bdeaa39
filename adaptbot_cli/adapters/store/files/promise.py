"""A commit that is being made: what a kill interrupts after the files are written is made up for.

A promise is written before the files are. If the files are found as it says, the commit that it
names is due, with its message and so with who said what; else nothing of it has become true.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from adaptbot_cli.adapters.store.files.disk import own_folder, sync_folder, told, write_new

_PROMISE: Final = "promise.json"


def make_promise(root: Path, commit: str, files: Mapping[str, bytes], paths: list[str]) -> None:
    """Write down that `commit`, of these paths, is due once the files hold these contents.

    The caller holds `lock(root)`. Raises KnowledgeError.
    """
    folder = own_folder(root) / "journal"
    digests = {path: _digest(data) for path, data in files.items()}
    said = json.dumps({"commit": commit, "files": digests, "paths": paths}).encode()
    with told(folder):
        folder.mkdir(exist_ok=True)
        new = folder / f"{_PROMISE}.new"
        write_new(new, said, None)
        new.replace(folder / _PROMISE)
        sync_folder(folder)


def keep_promise(root: Path, due: Callable[[str, list[str]], object]) -> None:
    """Call `due` with the commit and its paths if a kill has left one undone; forget the promise.

    The caller holds `lock(root)` and has called `recover`. Raises what `due` raises; a later call
    tries again.
    """
    path = own_folder(root) / "journal" / _PROMISE
    with told(path):
        if not path.exists():
            return
        said = json.loads(path.read_bytes())
        holds = all(_holds(root / name, digest) for name, digest in said["files"].items())
    if holds:
        due(said["commit"], said["paths"])
    forget_promise(root)


def forget_promise(root: Path) -> None:
    """Forget a promise: it is kept, or nothing has become of it."""
    path = own_folder(root) / "journal" / _PROMISE
    with told(path):
        path.unlink(missing_ok=True)


def _holds(path: Path, digest: str) -> bool:
    return path.is_file() and _digest(path.read_bytes()) == digest


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
