"""A git repository elsewhere: what it holds is fetched, and what was merged is pushed.

Through libgit2: no git binary, no hook, no helper program. Where the repository is comes from the
command line, or from this workspace's own git under a name; nothing that the other one says is
obeyed. A password comes from the environment alone, and goes to the host that was named alone.
"""

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit
from urllib.request import url2pathname
from uuid import uuid4

import pygit2

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.errors import KnowledgeError, UsageError

REF: Final = "refs/adaptbot/sync"
"""What was last fetched, so that a conflict can be looked at and settled later."""

_STATE: Final = "sync"
_LARGEST: Final = 1024**3
"""Bytes that are fetched at most."""
_CONNECT, _ANSWER = 10_000, 60_000
"""Milliseconds to wait for a connection, and for each answer."""
_SCHEMES: Final = ("https", "http", "ssh", "git", "file")
_SCP: Final = re.compile(r"(?:[\w.-]+@)?[\w.-]+:(?!:)[^\s:][^\s]*")
USER, PASSWORD = "ADAPTBOT_SYNC_USER", "ADAPTBOT_SYNC_PASSWORD"


@dataclass(frozen=True, slots=True)
class Remote:
    """A repository elsewhere: the `name` it was given, and its `url`."""

    repo: Repo
    name: str
    url: str

    @classmethod
    def of(cls, repo: Repo, name: str) -> "Remote":
        """Find what a person has named: a remote of this workspace's git, an address, a folder.

        Raises:
            UsageError: there is none such, or it is reached in a way that is not taken.
            KnowledgeError: the workspace has no repository of its own to share.
        """
        if repo.top != repo.root:
            raise KnowledgeError(
                f"{repo.root} is a part of the repository {repo.top}, and `kg sync` shares a whole "
                "one; share that with git, or take a workspace of its own"
            )
        known = repo.setting(f"remote.{name}.url") if re.fullmatch(r"[\w.-]+", name) else ""
        url = known or name
        scheme = url.partition("://")[0]
        if "::" in url or not url.isprintable() or ("://" in url and scheme not in _SCHEMES):
            raise UsageError(f"{_shown(url)} is not fetched: there is {', '.join(_SCHEMES)}")
        if scheme == "file":
            url = url2pathname(urlsplit(url).path)
        if "://" not in url and not (_SCP.fullmatch(url) and not Path(url).exists()):
            if not Path(url).expanduser().is_dir():
                raise UsageError(f"{url} is no folder, no address and no remote of {repo.root}")
            url = str(Path(url).expanduser().resolve())
        return cls(repo, _shown(name), url)

    def fetch(self) -> tuple[str, str | None]:
        """Fetch the branch of the same name, else the default one; return it and its commit, None
        if there is nothing yet.

        Raises:
            KnowledgeError: it cannot be reached, denies access or sends too much.
        """
        with self._talking("read from") as link:
            heads = {head.name: head for head in link.list_heads(_Callbacks(self.url))}
            default = heads["HEAD"].symref_target if "HEAD" in heads else None
            branch = next((n for n in (self.repo.branch, default) if n in heads), None)
            if branch is None:
                return self.repo.branch, None
            link.fetch([f"+{branch}:{REF}"], callbacks=_Callbacks(self.url))
        self.repo.cache(_STATE, json.dumps({"remote": self.name}).encode())
        return branch, self.repo.reference(REF)

    def push(self, branch: str, sha: str, seen: str | None) -> bool:
        """Let the remote's branch follow from the commit `seen` there to another one; False if it
        has moved meanwhile.

        Raises:
            KnowledgeError: it cannot be reached, or does not take what is pushed.
        """
        answers, folder = _Callbacks(self.url), Path(self.url)
        refused = answers.refused
        target = f"refs/adaptbot/incoming/{uuid4().hex}" if folder.is_dir() else branch
        with self._talking("pushed to") as link:
            try:
                link.push([f"{self.repo.branch}:{target}"], callbacks=answers)
                if target != branch and not refused and not _moved(folder, branch, seen, target):
                    return False
            except pygit2.GitError as error:
                if not _MOVED.search(str(error)):
                    raise
                return False
        if any(map(_MOVED.search, refused)):
            return False
        if refused:
            raise KnowledgeError(
                f"{self.name} did not take what was merged: {refused[0]}. It is committed "
                f"here as {sha[:7]}; `kg sync` sends it when {self.name} takes it."
            )
        return True

    @contextmanager
    def _talking(self, what: str) -> "Iterator[pygit2.Remote]":
        pygit2.settings.server_connect_timeout = _CONNECT
        pygit2.settings.server_timeout = _ANSWER
        try:
            yield self.repo.libgit2.remotes.create_anonymous(self.url)
        except (pygit2.GitError, OSError, ValueError, KeyError) as error:
            text = " ".join(_shown(str(error)).split()).rstrip(".")
            raise KnowledgeError(
                f"{self.name} could not be {what}: {text}. Nothing is lost: try again later, or "
                "see whether the address is right and you may go there."
            ) from error


_MOVED: Final = re.compile(
    "non-?fast|fetch first|cannot lock|failed to lock|already exists|incorrect old value|"
    "stale info|not present locally|failed to update",
    re.IGNORECASE,
)
"""What the sides say of a push that comes after another one."""


def _moved(folder: Path, branch: str, seen: str | None, incoming: str) -> bool:
    """Move a branch of a repository on this machine to what came in, if it is still where it was
    seen. A server compares and moves at once; libgit2 on a folder compares first and moves later,
    and what somebody else pushed in between would be lost."""
    there = pygit2.Repository(str(folder))
    came = there.references[incoming].target
    try:
        with there.transaction() as moving:
            moving.lock_ref(branch)
            now = there.references.get(branch)
            if (str(now.target) if now else None) != seen:
                return False
            moving.set_target(branch, came)
    finally:
        there.references.delete(incoming)
    return True


def last_fetched(repo: Repo) -> tuple[str, str] | None:
    """Return the name of the remote that was last fetched and the commit it had, if any."""
    state = repo.cached(_STATE)
    found = repo.reference(REF)
    return (str(json.loads(state)["remote"]), found) if state and found else None


class _Callbacks(pygit2.RemoteCallbacks):
    """Answers libgit2's questions; `refused` is what the remote did not take, in its words."""

    def __init__(self, url: str) -> None:
        super().__init__()
        self._host = urlsplit(url).hostname
        self._asked: set[Any] = set()
        self.refused: list[str] = []

    def credentials(self, url: str, username_from_url: str | None, allowed_types: Any) -> Any:
        kinds = pygit2.enums.CredentialType
        user = os.environ.get(USER) or username_from_url
        password = os.environ.get(PASSWORD)
        if allowed_types & kinds.USERNAME:
            return pygit2.Username(user or "git")
        kind = kinds.SSH_KEY if allowed_types & kinds.SSH_KEY else kinds.USERPASS_PLAINTEXT
        if kind in self._asked:
            raise KnowledgeError(f"{_shown(url)}: access was denied to {user or 'you'}.")
        self._asked.add(kind)
        if kind == kinds.SSH_KEY:
            return pygit2.KeypairFromAgent(user or "git")
        if urlsplit(url).hostname != self._host:
            raise KnowledgeError(f"{_shown(url)} is not where it was to be; no password goes there")
        if not password:
            raise KnowledgeError(
                f"{_shown(url)} asks who you are; set {USER} and {PASSWORD} in the environment"
            )
        return pygit2.UserPass(user or "git", password)

    def transfer_progress(self, stats: Any) -> None:
        if stats.received_bytes > _LARGEST:
            raise KnowledgeError(f"it sends more than {_LARGEST // 1024**2} MB; nothing was taken")

    def push_update_reference(self, refname: str, message: str | None) -> None:
        if message:
            self.refused.append(message)


def _shown(text: str) -> str:
    """A text without the passwords that an address in it may bear."""
    return re.sub(r"(?<=//)[^/@\s]*@", "", text)
