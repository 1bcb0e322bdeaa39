"""What Tab completes, in a shell and in a session: names that the files of a home hold.

They are answered from an index that is kept in the user's cache by what the files hold, so that no
Tab reads a graph twice. A Tab only looks: where anything is wrong it completes nothing, and the
command says why.
"""

import os
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from adaptbot_cli.errors import AdaptbotError

if TYPE_CHECKING:
    from adaptbot_cli.workspace import Workspace

Pairs = Iterator[tuple[str, str]]
"""What can be put in, each with a word about it."""

_FORM = b"names 2"
"""Changes with what the index holds."""

_SAFE = re.compile(r"\w[\w.+~-]*")
_ODD = re.compile(r"[^\w ,.+-]+")
_REVISIONS, _MOST = 50, 32


def index(home: "Workspace", domain: str) -> dict[str, list[str]]:
    """Return the names in a domain of a home by what they name: thing, class, action, task,
    robot.

    Raises:
        UsageError, KnowledgeError, PackError: there is no such domain, or it cannot be read.
    """
    from adaptbot_cli import cache

    files = home.files(domain)
    parts = (part for name, data in files.items() for part in (name.encode(), data))
    key = cache.key_of((_FORM, *parts))
    data = cache.read("names", key)
    if data is None:
        data = "\n".join(_rows(files, str(home.folder(domain)))).encode()
        cache.write("names", key, data, _MOST)
    found: dict[str, list[str]] = {
        kind: [] for kind in ("thing", "class", "action", "task", "robot")
    }
    for row in data.decode("utf-8", "replace").splitlines():
        kind, _, name = row.partition(" ")
        found.get(kind, []).append(name)
    return found


def _rows(files: dict[str, bytes], where: str) -> Iterator[str]:
    from adaptbot_cli.adapters.store.reading import load_kg
    from adaptbot_cli.core.names import normal
    from adaptbot_cli.core.visible import visible

    kg = load_kg(files, where)
    named = {
        "thing": kg.names(),
        "class": {normal(kind.label) for kind in kg.domain.classes.values()},
        "action": set(kg.domain.actions),
        "task": {normal(task.name) for task in kg.domain.tasks},
        "robot": {kg.name(robot) for robot in kg.robots},
    }
    for kind, names in named.items():
        yield from (f"{kind} {visible(name)}" for name in sorted(names))


def _home(context: typer.Context) -> "tuple[Workspace, str]":
    """The workspace and the domain that the words before name. Of a folder of another account
    nothing is read, whoever names it: a Tab is no consent."""
    from adaptbot_cli.errors import KnowledgeError
    from adaptbot_cli.workspace import find, refuse_another_owner

    option = context.params.get("workspace_dir") or os.environ.get("ADAPTBOT_WORKSPACE")
    root = Path(option) if option else None
    if root is not None:
        refuse_another_owner(root)
    home = find(root)  # one that nobody names is refused there if it is somebody else's
    domain = str(home.setting("domain", context.params.get("domain")))
    if domain not in home.domains():
        raise KnowledgeError(f"there is no domain {domain}")
    return home, domain


def _completer(find: Callable[["Workspace", str], Pairs]) -> Callable[..., list[Any]]:
    """Make what `find` gives of a home and a domain into a function of typer's `autocompletion`.

    A shell puts in what it gets as it stands, and some evaluate what is said about it: what would
    have to be quoted is left out. Of a list with commas the last entry is completed.
    """

    def complete(ctx: typer.Context, incomplete: str) -> list[Any]:
        before, comma, last = incomplete.rpartition(",")
        found = []
        with suppress(AdaptbotError, OSError, LookupError, ValueError, RecursionError):
            for name, about in find(*_home(ctx)):
                if name.startswith(last) and _SAFE.fullmatch(name):
                    text = before + comma + name
                    about = " ".join(_ODD.sub(" ", about).split())
                    found.append((text, about) if about else text)
        return found

    return complete


def _named(*kinds: str) -> Callable[..., list[Any]]:
    def find(home: "Workspace", domain: str) -> Pairs:
        names = index(home, domain)
        return ((name, "") for name in dict.fromkeys(n for kind in kinds for n in names[kind]))

    return _completer(find)


def _stems(home: "Workspace", folder: str, ending: str) -> list[str]:
    """The names of a workspace's files of a kind, sorted; no link is followed."""
    from adaptbot_cli.adapters.store import files

    names = files.names(home.root, folder)
    return sorted(name.removesuffix(ending) for name in names if name.endswith(ending))


def _runs(home: "Workspace", domain: str) -> Pairs:
    stems = reversed(_stems(home, "transcripts", ".yaml"))
    return ((when, task) for when, _, task in (stem.partition("-") for stem in stems))


def _revisions(home: "Workspace", domain: str) -> Pairs:
    """The newest commits, as the repository's own log of HEAD has them: libgit2 takes longer to
    import than a Tab may take."""
    from adaptbot_cli import bounded

    log = home.root / ".git" / "logs" / "HEAD"
    text = bounded.read_bytes(log, bounded.JSON, root=home.root).decode("utf-8", "replace")
    for line in islice(reversed(text.splitlines()), _REVISIONS):
        about, _, done = line.partition("\t")
        yield about.split(" ")[1][:7], done.partition(": ")[2]


def _settings(home: "Workspace", domain: str) -> Pairs:
    from adaptbot_cli.workspace import SETTINGS

    return ((name, "") for name in SETTINGS)


def _plans(home: "Workspace", domain: str) -> Pairs:
    return ((stem, "") for stem in _stems(home, f"plans/{domain}", ".plan"))


domains = _completer(lambda home, _: ((name, "") for name in home.domains()))
things = _named("thing")
taught = _named("thing", "action")
anything = _named("thing", "class", "action", "task")
tasks = _named("task")
robots = _named("robot")
plans = _completer(_plans)
runs = _completer(_runs)
revisions = _completer(_revisions)
settings = _completer(_settings)
