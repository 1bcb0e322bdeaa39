"""What was worked out from files, kept in the user's cache by what those files hold.

Nothing there is a workspace's: it lies where only the user writes. What is missing, damaged or
somebody else's is worked out anew, and a disk that cannot be written costs time, nothing else.
"""

import hashlib
import os
from contextlib import suppress
from pathlib import Path
from typing import Final

_MOST: Final = 32
"""How many are kept of a kind; those longest unused go."""


def place(kind: str, *parts: bytes) -> Path:
    """Return where what is worked out from these bytes is kept, below a folder of its kind."""
    from platformdirs import user_cache_path

    digest = hashlib.sha256()
    for data in parts:
        digest.update(b"%d\n" % len(data))
        digest.update(data)
    return user_cache_path("adaptbot", appauthor=False) / kind / digest.hexdigest()


def held(path: Path) -> bytes | None:
    """Return what is kept at a place, None if nothing of this user is."""
    with suppress(OSError):
        if path.stat().st_uid == os.getuid():
            data = path.read_bytes()
            os.utime(path)
            return data
    return None


def hold(path: Path, data: bytes) -> None:
    """Keep something at a place; of its kind the longest unused go, where there are too many."""
    with suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        new = path.with_name(f"{path.name}.{os.getpid()}")
        new.write_bytes(data)
        new.replace(path)
        by_use = sorted(path.parent.iterdir(), key=lambda each: each.stat().st_mtime)
        for old in by_use[:-_MOST]:
            old.unlink(missing_ok=True)
