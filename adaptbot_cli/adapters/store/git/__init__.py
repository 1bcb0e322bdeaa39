"""Versions of a workspace in git, without a git binary; the user's other files are left alone."""

from adaptbot_cli.adapters.store.git.history import Commit
from adaptbot_cli.adapters.store.git.repo import Repo

__all__ = ["Commit", "Repo"]
