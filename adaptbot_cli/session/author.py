"""Who says something, and when."""

import getpass
from datetime import UTC, datetime


def person() -> str:
    """Return the name of the person at this machine, empty if it cannot be told."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return ""


def now() -> datetime:
    """Return the time."""
    return datetime.now(UTC)


def stamp() -> str:
    """Return the time as a transcript tells it."""
    return now().isoformat(timespec="seconds")
