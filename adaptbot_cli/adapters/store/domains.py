"""Domains that were read before, kept in the user's cache by what their files hold.

Reading a pack checks every query in it, which takes longer than most commands: a domain that was
read without a fault is not read again until its files or this program change. What is kept is no
workspace's: it lies where only the user writes, and what is taken from there is values alone.
"""

import hashlib
import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from adaptbot_cli import core
from adaptbot_cli.core import domain, plan
from adaptbot_cli.core.domain import Domain

_MOST: Final = 32
"""How many domains are kept; those longest unused go."""

_RDF: Final = ("URIRef", "Literal", "Variable")

Read = tuple[Domain, list[str]]
"""A domain, and what is doubtful in its pack."""


def kept(files: tuple[bytes, ...], read: Callable[[], Read]) -> Read:
    """Return what `read` makes of a pack's files, which these bytes are, or once made of them.

    Raises what `read` raises: nothing is kept of a pack with faults.
    """
    path = _folder() / _key(files)
    with suppress(OSError, ValueError, TypeError, AttributeError, EOFError, pickle.PickleError):
        if path.stat().st_uid == os.getuid():
            found: Read = _Values(BytesIO(path.read_bytes())).load()
            if isinstance(found[0], Domain):
                os.utime(path)
                return found
    read_now = read()
    with suppress(OSError):  # a disk that is full or read-only costs time, nothing else
        _keep(path, pickle.dumps(read_now, protocol=5))
    return read_now


def _folder() -> Path:
    from platformdirs import user_cache_path

    return user_cache_path("adaptbot", appauthor=False) / "domains"


def _key(files: tuple[bytes, ...]) -> str:
    digest = hashlib.sha256(_program().encode())
    for data in files:
        digest.update(b"%d\n" % len(data))
        digest.update(data)
    return digest.hexdigest()


@lru_cache(maxsize=1)
def _program() -> str:
    """What tells one version of the code that reads packs from another."""
    found = (p for top in core.__path__ for p in sorted(Path(top).rglob("*.py")))
    return "\n".join(f"{p} {p.stat().st_mtime_ns} {p.stat().st_size}" for p in found)


def _keep(path: Path, data: bytes) -> None:
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = path.with_name(f"{path.name}.{os.getpid()}")
    new.write_bytes(data)
    new.replace(path)
    for old in list(_by_use(path.parent))[:-_MOST]:
        old.unlink(missing_ok=True)


def _by_use(folder: Path) -> Iterator[Path]:
    yield from sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime)


class _Values(pickle.Unpickler):
    """Reads the records of a domain and RDF terms; anything else is refused, and calls nothing."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a class by its name. Raises PickleError for all but those of a domain."""
        own = {domain.__name__: domain, plan.__name__: plan}.get(module)
        found = getattr(own, name, None)
        if isinstance(found, type) and found.__module__ == module:
            return found
        if module == "rdflib.term" and name in _RDF:
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"{module}.{name} is no part of a domain")
