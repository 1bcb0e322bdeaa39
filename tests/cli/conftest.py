"""Homes to run commands in."""

import shutil
from pathlib import Path

import pytest

from tests.cli.command import Home


@pytest.fixture
def home(tmp_path: Path) -> Home:
    """Return a home in which nothing has been run yet."""
    return Home(tmp_path)


@pytest.fixture(scope="module")
def used(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """Return a home for a module's tests to share: reading commands, or one story."""
    return Home(tmp_path_factory.mktemp("home"))


@pytest.fixture(scope="session")
def seeded(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """Return a home with a workspace and no transcript, to be copied."""
    home = Home(tmp_path_factory.mktemp("seeded"))
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    shutil.rmtree(home.workspace / "transcripts")
    return home
