"""What can go wrong with a repository, as sentences."""

import os
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    from dulwich.repo import Repo as DulwichRepo


class Moved(Exception):
    """Someone else committed in between."""


def refuse_format(repo: "DulwichRepo") -> None:
    """Refuse what this module cannot write: hashes other than SHA-1, refs in other than files."""
    config = repo.get_config()
    for key, usual in ((b"objectformat", b"sha1"), (b"refstorage", b"files")):
        try:
            value = config.get((b"extensions",), key)
        except KeyError:
            continue
        if value != usual:
            raise KnowledgeError(
                f"The git repository {repo.path} has {key.decode()} {value.decode()}, which "
                "adaptbot cannot write; choose a workspace outside it with --workspace."
            )


def busy() -> tuple[type[Exception], ...]:
    """Give the errors that pass when one waits."""
    from dulwich.file import FileLocked

    return (FileLocked, Moved)


def busy_message(top: Path, error: Exception) -> str:
    """Say that waiting did not help."""
    lock = getattr(error, "lockfilename", None)
    hint = f"; if none is, remove {os.fsdecode(lock)}" if lock else ""
    return f"Another git process is busy in {top}. Wait until it is done, then try again{hint}."


@contextmanager
def told(place: Path) -> Iterator[None]:
    """Turn errors of the disk and of a damaged repository into a sentence."""
    from dulwich.errors import ChecksumMismatch, FileFormatException, RefFormatError
    from dulwich.repo import UnsupportedExtension, UnsupportedVersion

    try:
        yield
    except OSError as error:
        raise KnowledgeError(
            f"The git repository of {place} could not be used: {error.strerror or error} "
            f"({error.filename or place}); correct that and try again."
        ) from error
    except (
        ChecksumMismatch,
        FileFormatException,
        RefFormatError,
        UnsupportedExtension,
        UnsupportedVersion,
    ) as error:
        raise KnowledgeError(
            f"The git repository of {place} cannot be read: {error}; `git fsck` tells more."
        ) from error
    except (KeyError, ValueError, AssertionError, IndexError, struct.error, zlib.error) as error:
        # What dulwich raises where an object, a ref or the index is missing or is not what it
        # should be.
        raise KnowledgeError(
            f"The git repository of {place} is damaged ({type(error).__name__}); `git fsck` tells "
            "where. Restore it, or move its .git away: the next run begins a new one."
        ) from error
