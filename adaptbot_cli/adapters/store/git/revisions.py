"""Revisions as people write them: a sha or its beginning, a branch, a tag, HEAD~2."""

import re
from typing import TYPE_CHECKING, Final

from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    from dulwich.objects import Commit as DulwichCommit
    from dulwich.repo import Repo as DulwichRepo

_NO_NAME: Final = re.compile(r"^/|//|\.\.")
"""What no revision's name has: it would be looked for as a file elsewhere."""


def commit_at(repo: "DulwichRepo", rev: str) -> "DulwichCommit":
    """Find a commit as git does. Raises KnowledgeError if there is no such one."""
    from dulwich.errors import RefFormatError
    from dulwich.objectspec import AmbiguousShortId, parse_commit, parse_object

    base = re.split(r"[~^]", rev, maxsplit=1)[0]
    try:
        steps = rev[len(base) :].encode()
        if not base or not base.isprintable() or _NO_NAME.search(base):
            raise KeyError(rev)
        commit = parse_commit(repo, base)
        if not steps:
            return commit
        return parse_commit(repo, parse_object(repo, commit.id + steps).id)
    except AmbiguousShortId as error:
        raise KnowledgeError(f"{rev!r} is short for several commits; write more.") from error
    except (KeyError, ValueError, IndexError, AssertionError, RefFormatError) as error:
        raise KnowledgeError(
            f"There is no version {rev!r} in {repo.path}; `git log` lists them."
        ) from error
