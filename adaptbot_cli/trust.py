"""Whose settings are obeyed: the user's own, and those of a file that the user has trusted.

A setting that moves secrets or money, or runs something, is obeyed from the command line, the
environment and the user's own configuration; from a workspace or a transcript only once the user
has trusted the file as it is. What is trusted is remembered in the user's own folder, by a digest
of path and content, where no workspace can reach it.
"""

import hashlib
import os
from contextlib import suppress
from pathlib import Path

from adaptbot_cli.errors import KnowledgeError

GUARDED = ("model", "api_base", "timeout", "max_tokens", "max_cost", "world",
           "kg.endpoint", "kg.update_endpoint", "kg.attributes", "kg.state", "kg.log")  # fmt: skip
"""The settings that move secrets or money, or run something."""


def own_settings_file() -> Path:
    """Return where the user's own adaptbot.toml is, if there is one."""
    from platformdirs import user_config_path

    return user_config_path("adaptbot", appauthor=False) / "adaptbot.toml"


def _remembered(path: Path, content: bytes) -> Path:
    """The file whose being there says that `path` is trusted while it has this content."""
    from platformdirs import user_state_path

    place = os.fsencode(path.resolve())
    digest = hashlib.sha256(b"%d:%b%b" % (len(place), place, content)).hexdigest()
    return user_state_path("adaptbot", appauthor=False) / "trusted" / digest


def is_trusted(path: Path, content: bytes) -> bool:
    """Whether the user has trusted a file with this content."""
    try:
        return _remembered(path, content).is_file()
    except (OSError, RuntimeError):
        return False


def trust(path: Path, content: bytes) -> None:
    """Trust a file as it is. Raises KnowledgeError: that cannot be remembered."""
    mark = _remembered(path, content)
    try:
        mark.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        mark.write_text(f"{path}\n", encoding="utf-8", errors="replace")
    except OSError as error:
        raise KnowledgeError(f"cannot write {mark}: {error.strerror}") from error


def trust_own(path: Path, content: bytes) -> None:
    """Trust what this process itself has written; where that cannot be remembered, it is as a
    stranger's later."""
    with suppress(KnowledgeError):
        trust(path, content)


def revoke(path: Path, content: bytes) -> bool:
    """Trust a file no longer; return whether it was trusted. Raises KnowledgeError."""
    mark = _remembered(path, content)
    try:
        mark.unlink()
    except FileNotFoundError:
        return False
    except OSError as error:
        raise KnowledgeError(f"cannot remove {mark}: {error.strerror}") from error
    return True


def is_ours(path: Path) -> bool:
    """Whether a file and its folder belong to this account, as git asks of a repository."""
    if not hasattr(os, "geteuid"):
        return True
    ours = {os.geteuid()}
    if ours == {0} and os.environ.get("SUDO_UID", "").isdecimal():
        ours.add(int(os.environ["SUDO_UID"]))
    try:
        return {path.lstat().st_uid, path.parent.stat().st_uid} <= ours
    except OSError:
        return False
