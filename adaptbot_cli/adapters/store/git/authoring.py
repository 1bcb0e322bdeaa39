"""Who has made a commit, and when."""

import os
import re
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from dulwich.objects import Commit as DulwichCommit
    from dulwich.objects import ObjectID
    from dulwich.repo import Repo as DulwichRepo

_NAME: Final = "adaptbot"
_EMAIL: Final = "adaptbot@localhost"


def new_commit(
    repo: "DulwichRepo",
    head: "ObjectID | None",
    tree: "ObjectID",
    message: str,
    when: datetime,
) -> "DulwichCommit":
    """Make a commit, not stored yet, by who is named where git looks for names."""
    from dulwich.objects import Commit as DulwichCommit

    commit = DulwichCommit()
    commit.tree, commit.parents = tree, [head] if head else []
    commit.author, commit.committer = _identity(repo, "AUTHOR"), _identity(repo, "COMMITTER")
    when = when.astimezone() if when.tzinfo is None else when
    commit.author_time = commit.commit_time = int(when.timestamp())
    offset = (when.utcoffset() or timedelta()) // timedelta(minutes=1) * 60
    commit.author_timezone = commit.commit_timezone = offset
    text = message.replace("\0", "").strip("\n") + "\n"
    commit.message = text.encode("utf-8", "replace")
    return commit


def _identity(repo: "DulwichRepo", kind: str) -> bytes:
    name = _setting(repo, kind, "NAME") or _NAME
    return f"{name} <{_setting(repo, kind, 'EMAIL') or _EMAIL}>".encode("utf-8", "replace")


def _setting(repo: "DulwichRepo", kind: str, what: str) -> str:
    """Look a part of an identity up where git does: environment, then configuration."""
    told = os.environ.get(f"GIT_{kind}_{what}", "")
    config = repo.get_config_stack()
    for section in (kind.lower(), "user"):
        if not told:
            try:
                told = config.get((section.encode(),), what.lower().encode()).decode()
            except KeyError:
                continue
    return re.sub(r"[<>\x00-\x1f]", "", told).strip()
