"""Copies of large homes on disk, so that a command need not read a home's files to know it.

A copy is the graph as a database of Oxigraph, with an index of its names. It lies in the user's
cache under a digest of the files that it was made from: no workspace can bring one, and one that
does not match is never found. A process works on links to it of its own, and so may change them.
"""

import atexit
import fcntl
import json
import os
import shutil
import sqlite3
import tempfile
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import pyoxigraph

from adaptbot_cli import cache
from adaptbot_cli.adapters.store.domains import program
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.index import NameIndex
from adaptbot_cli.core.graph.kg import Kg

_MOST = 4
"""How many copies are kept; versions of one home share most of what they hold."""
_FORM = b"2"
_ROOM = 64 * 1024 * 1024
"""Bytes free without which no copy is used: what is tried or learned is written to that disk."""
_OLD = 60.0
"""Seconds after which what a process has not opened it never will."""

_GRAPH, _NAMES, _ABOUT = "graph", "names", "about.json"
_UNUSABLE = (OSError, RuntimeError, ValueError, TypeError, KeyError, sqlite3.Error)


def open_copy(
    parts: Mapping[str, bytes], domain: Domain, fill: Callable[[pyoxigraph.Store], None]
) -> Kg | None:
    """Return the graph of a home from its copy, which is made if there is none.

    `parts` are the files that the graph is made of, which `fill` reads into a store. None if no
    copy can be had, for want of room or rights: it costs time, and nothing else. Raises what `fill`
    raises.
    """
    try:
        folder = cache.folder("graphs")
        _sweep(folder)
        if shutil.disk_usage(folder).free < _ROOM:
            return None
    except OSError:
        return None
    kept = folder / _key(parts)
    if kept.exists():
        with suppress(*_UNUSABLE):
            return _linked(kept, domain, _own(folder))
        with suppress(OSError):  # it is damaged
            _remove(kept)
    own = _own(folder)
    with suppress(OSError, RuntimeError, sqlite3.Error):
        store = pyoxigraph.Store(str(own / _GRAPH))
        fill(store)
        kg = Kg.over(domain, store)
        kg.indexed_in(NameIndex(str(own / _NAMES)))
        kg.size()
        store.optimize()
        keep_copy(kg, parts)
        return kg
    return None


def keep_copy(kg: Kg, parts: Mapping[str, bytes]) -> None:
    """Keep a graph that `open_copy` returned as the copy of its files, as they are now.

    None is kept of one with strays, which are known only to who has read the files.
    """
    if kg.strays:
        return
    with suppress(*_UNUSABLE):
        folder = cache.folder("graphs")
        new, kept = _own(folder), folder / _key(parts)
        kg.engine.backup(str(new / _GRAPH))
        kg.spellings.copy(str(new / _NAMES))
        parts_of_it = [p for p in new.rglob("*") if p.is_file()]
        sizes = {str(p.relative_to(new)): p.stat().st_size for p in parts_of_it}
        (new / _ABOUT).write_text(json.dumps({"size": kg.size(), "files": sizes}))
        new.rename(kept)
        there = [p for p in folder.iterdir() if "-" not in p.name]
        for old in sorted(there, key=lambda p: p.stat().st_mtime)[:-_MOST]:
            _remove(old)


def _remove(kept: Path) -> None:
    """Remove a copy at once, as another process may be opening it."""
    shutil.rmtree(kept.rename(_own(kept.parent)), ignore_errors=True)


def _key(parts: Mapping[str, bytes]) -> str:
    named = sorted(parts.items())
    given = (part for name, data in named for part in (os.fsencode(name), data))
    return cache.key_of([_FORM, program().encode(), *given])


def _linked(kept: Path, domain: Domain, own: Path) -> Kg:
    """Open a copy of a copy: what never changes is linked. Raises one of `_UNUSABLE`."""
    about = json.loads((kept / _ABOUT).read_text())
    nodes, edges = about["size"]
    (own / _GRAPH).mkdir()
    for name, size in about["files"].items():
        if name.endswith(".sst"):
            with suppress(OSError):  # a disk that cannot
                (own / name).hardlink_to(kept / name)
        if not (own / name).exists():
            shutil.copyfile(kept / name, own / name)
        if (own / name).stat().st_size != size:
            raise ValueError(f"{name} is not whole")
    os.utime(kept)
    names = NameIndex(str(own / _NAMES))
    return Kg.of_copy(domain, pyoxigraph.Store(str(own / _GRAPH)), names, (nodes, edges))


def _own(folder: Path) -> Path:
    """A new folder of this process's, which goes when it ends."""
    own = Path(tempfile.mkdtemp(prefix=f"own-{os.getpid()}-", dir=folder))
    atexit.register(_forget, own, os.getpid())
    return own


def _forget(own: Path, process: int) -> None:
    if os.getpid() == process:  # and no child that has its parent's memory
        shutil.rmtree(own, ignore_errors=True)


def _sweep(folder: Path) -> None:
    """Remove what killed processes have left: the engine's lock on it is free."""
    for left in folder.glob("own-*"):
        if left.name.startswith(f"own-{os.getpid()}-"):
            continue
        with suppress(OSError):
            if time.time() - left.stat().st_mtime > _OLD and _is_free(left / _GRAPH / "LOCK"):
                shutil.rmtree(left, ignore_errors=True)


def _is_free(lock: Path) -> bool:
    try:
        with lock.open("r+b") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return True
