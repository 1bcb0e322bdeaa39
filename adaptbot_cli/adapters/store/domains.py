"""Domains that were read before, kept in the user's cache by what their files hold.

Reading a pack checks every query in it, which takes longer than most commands: a domain that was
read without a fault is not read again until its files or this program change. What is kept is no
workspace's: it lies where only the user writes, and what is taken from there is values alone.
"""

import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from adaptbot_cli import cache, core
from adaptbot_cli.core import domain, plan
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph import faults
from adaptbot_cli.core.graph.faults import Fault

_KIND: Final = "domains"
_MOST: Final = 32
"""How many domains are kept; those longest unused go."""

_RDF: Final = ("URIRef", "Literal", "Variable")

Read = tuple[Domain, list[Fault]]
"""A domain, and what is doubtful in its pack."""


def kept(files: tuple[bytes, ...], read: Callable[[], Read]) -> Read:
    """Return what `read` makes of a pack's files, which these bytes are, or once made of them.

    Raises what `read` raises: nothing is kept of a pack with faults.
    """
    key = cache.key_of((program().encode(), *files))
    data = cache.read(_KIND, key)
    with suppress(ValueError, TypeError, AttributeError, EOFError, pickle.PickleError):
        found: Read = _Values(BytesIO(data or b"")).load()
        if isinstance(found[0], Domain):
            return found
    read_now = read()
    cache.write(_KIND, key, pickle.dumps(read_now, protocol=5), _MOST)
    return read_now


@lru_cache(maxsize=1)
def program() -> str:
    """Return what tells one version of the code that reads packs and homes from another."""
    found = (p for top in core.__path__ for p in sorted(Path(top).rglob("*.py")))
    return "\n".join(f"{p} {p.stat().st_mtime_ns} {p.stat().st_size}" for p in found)


class _Values(pickle.Unpickler):
    """Reads the records of a domain and RDF terms; anything else is refused, and calls nothing."""

    def find_class(self, module: str, name: str) -> Any:
        """Return a class by its name. Raises PickleError for all but those of a domain."""
        own = next((m for m in (domain, plan, faults) if m.__name__ == module), None)
        found = getattr(own, name, None)
        if isinstance(found, type) and found.__module__ == module:
            return found
        if module == "rdflib.term" and name in _RDF:
            return super().find_class(module, name)
        raise pickle.UnpicklingError(f"{module}.{name} is no part of a domain")
