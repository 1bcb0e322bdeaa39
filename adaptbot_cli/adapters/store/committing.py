"""Files and their commit, as one: both are made, or neither, whatever interrupts them.

The order in which things reach the disk, each through to it (fsync, and that of its folder):

1. the commit's objects, which nothing names yet;
2. the promise: this commit is due once the files hold these contents;
3. the new files beside the old ones; the journal that says that they hold; their places
   (`files.journal`);
4. the branch, which names the commit;
5. the index; then the promise is forgotten.

A kill before 3 leaves the old files and objects that `git gc` sweeps away; one after it leaves
the new files, and the next run, or the next commit, makes up for what is missing of 4 and 5.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

from adaptbot_cli.adapters.store.files import (
    forget_promise,
    keep_promise,
    make_promise,
    recover,
    write_files,
)
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.errors import KnowledgeError


@dataclass(frozen=True, slots=True)
class Change:
    """What is written and what is committed: by path in the workspace.

    `files` are written; `commit` is what the commit holds of them and of others, if that is not
    what the disk holds; `staged` what the index holds where the user has staged something.
    """

    files: Mapping[str, bytes]
    paths: list[str]
    commit: Mapping[str, bytes] = field(default_factory=dict)
    staged: Mapping[str, bytes] = field(default_factory=dict)


def recovered(root: Path, own: bool = False) -> Repo:
    """Finish or undo what a kill interrupted, and open the repository; `own` as it takes it.

    The caller holds `lock(root)`. Raises KnowledgeError.
    """
    recover(root)
    repo = Repo.open_or_init(root, own=own)
    repo.free()
    keep_promise(root, repo.adopt)
    return repo


def commit(root: Path, repo: Repo, change: Change, message: str, when: datetime) -> str:
    """Write files and commit them; return the revision.

    The caller holds `lock(root)` and has called `recovered`.

    Raises:
        KnowledgeError: the files cannot be written or committed; nothing has changed then.
    """
    old = {path: (root / path).read_bytes() for path in change.files if (root / path).exists()}
    head = repo.head()
    contents = {**change.files, **change.commit}

    def ready(sha: str) -> None:
        make_promise(root, sha, change.files, change.paths)
        write_files(root, change.files)

    try:
        revision = repo.commit(change.paths, message, when, contents, change.staged, ready)
    except BaseException:
        if repo.head() == head:
            write_files(root, old)
            for path in change.files.keys() - old.keys():
                (root / path).unlink(missing_ok=True)
        with suppress(KnowledgeError):
            forget_promise(root)
        raise
    forget_promise(root)
    return revision
