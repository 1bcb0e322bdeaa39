"""The branch that is checked out, and its log."""

import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, cast

from adaptbot_cli.adapters.store.git.locks import locked
from adaptbot_cli.adapters.store.git.trouble import Moved

if TYPE_CHECKING:
    from dulwich.objects import Commit, ObjectID
    from dulwich.refs import DiskRefsContainer, Ref
    from dulwich.repo import Repo as DulwichRepo


def head_file(repo: "DulwichRepo") -> Path:
    """Give the file that names the commit that is checked out: the branch's, or HEAD itself."""
    refs = cast("DiskRefsContainer", repo.refs)  # `refuse_format` has seen to that
    return Path(os.fsdecode(refs.refpath(_branch(repo))))


def _branch(repo: "DulwichRepo") -> "Ref":
    from dulwich.refs import HEADREF

    return repo.refs.follow(HEADREF)[0][-1]


def move_head(repo: "DulwichRepo", owner: Path, old: "ObjectID | None", commit: "Commit") -> None:
    """Let the branch that is checked out name a new commit instead of the old one.

    Raises:
        Moved: it names another commit by now, or another branch is checked out.
        FileLocked: dulwich's; someone else is changing it.
    """
    from dulwich.refs import HEADREF

    branch = _branch(repo)
    path = head_file(repo)
    path.parent.mkdir(parents=True, exist_ok=True)
    with locked(path, owner, repo.object_store.shared_perm) as file:
        names, now = repo.refs.follow(HEADREF)
        if now != old or names[-1] != branch:
            raise Moved
        file.write(commit.id + b"\n")
    for name in dict.fromkeys((HEADREF, branch)):
        with suppress(OSError):  # The log is a help for people; the commit is made.
            _log(repo, name, old, commit)


def _log(repo: "DulwichRepo", name: "Ref", old: "ObjectID | None", commit: "Commit") -> None:
    from dulwich.file import adjust_shared_perm
    from dulwich.reflog import format_reflog_line
    from dulwich.refs import HEADREF

    if not repo.get_config_stack().get_boolean((b"core",), b"logallrefupdates", True):
        return
    base = repo.controldir() if name == HEADREF else repo.commondir()
    path = Path(base) / "logs" / os.fsdecode(name)
    path.parent.mkdir(parents=True, exist_ok=True)
    message = b"commit: " + commit.message.split(b"\n")[0]
    line = format_reflog_line(
        old, commit.id, commit.committer, commit.commit_time, commit.commit_timezone, message
    )
    with path.open("ab") as file:
        file.write(line + b"\n")
    adjust_shared_perm(path, repo.object_store.shared_perm)
