"""How the whole suite runs: how far properties are searched, and where its files lie."""

import os
import shutil
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("short", max_examples=60, deadline=None, derandomize=True)
settings.register_profile("long", max_examples=2_000, deadline=None)
settings.load_profile("short")

MEMORY = Path("/dev/shm")
ROOM = 4 << 30


def pytest_configure(config: pytest.Config) -> None:
    """Let files lie in memory where there is room for them: they are synced thousands of times.

    `--basetemp` and PYTEST_DEBUG_TEMPROOT say otherwise.
    """
    if "PYTEST_DEBUG_TEMPROOT" not in os.environ and _has_room(MEMORY):
        os.environ["PYTEST_DEBUG_TEMPROOT"] = str(MEMORY)


def _has_room(folder: Path) -> bool:
    if not (folder.is_dir() and os.access(folder, os.W_OK)):
        return False
    may_run = not os.statvfs(folder).f_flag & os.ST_NOEXEC  # some tests put programs there
    return may_run and shutil.disk_usage(folder).free > ROOM
