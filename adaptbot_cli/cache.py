"""The user's cache: what was once worked out of some bytes, kept by their digest.

It lies where only the user writes, never in a workspace; whatever is wrong with it costs time, and
nothing else.
"""

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path


def key_of(parts: Iterable[bytes]) -> str:
    """Return the key of what is worked out of some parts: where one ends makes a difference."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(b"%d\n" % len(part))
        digest.update(part)
    return digest.hexdigest()


def read(kind: str, key: str) -> bytes | None:
    """Return what is kept under a key, None if nothing is or it may be somebody else's."""
    with suppress(OSError):
        path = _folder(kind) / key
        if path.stat().st_uid == os.getuid():
            os.utime(path)
            return path.read_bytes()
    return None


def write(kind: str, key: str, data: bytes, most: int) -> None:
    """Keep bytes under a key; of more than `most` of a kind those longest unused go."""
    with suppress(OSError):  # a disk that is full or read-only
        path = folder(kind) / key
        new = path.with_name(f"{path.name}.{os.getpid()}")
        new.write_bytes(data)
        new.replace(path)
        by_use = sorted(path.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in by_use[:-most]:
            old.unlink(missing_ok=True)


def folder(kind: str) -> Path:
    """Return the folder of a kind that only this user writes. Raises OSError if it cannot be."""
    found = _folder(kind)
    found.mkdir(mode=0o700, parents=True, exist_ok=True)
    if found.stat().st_uid != os.getuid():
        raise PermissionError(f"{found} belongs to somebody else")
    return found


def _folder(kind: str) -> Path:
    from platformdirs import user_cache_path

    return user_cache_path("adaptbot", appauthor=False) / kind
