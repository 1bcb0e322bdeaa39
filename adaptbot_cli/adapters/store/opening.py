"""What a run starts from: a workspace that is there, and its files as they are."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from adaptbot_cli.adapters.store.committing import Change, commit, recovered
from adaptbot_cli.adapters.store.files import lock, recover
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import load_kg, paths_of, read_files
from adaptbot_cli.core.faults import faults
from adaptbot_cli.core.kg import Kg

FirstFiles = Callable[[], Mapping[str, bytes]]


@dataclass(frozen=True, slots=True)
class Start:
    """The revision of a workspace, the files edited by hand since, and the graph of both."""

    revision: str | None
    edited: tuple[str, ...]
    kg: Kg


def start(root: Path, domain: str, first: FirstFiles, now: Callable[[], datetime]) -> Start:
    """Write and commit what a first use of a domain needs; return what a run starts from.

    `first` gives the files that a first use writes. It is asked while the workspace is locked, so
    that it sees what another run has just made. No file that is there already is written. Files
    that are there and were never committed are committed if the domain finds nothing wrong with
    them, else left as hand edits.

    A folder that is made here is a repository of its own; one that was there already is versioned
    by the repository that it lies in.

    Raises:
        KnowledgeError: the workspace cannot be written, or its files make no domain.
    """
    made = not root.is_dir() or not any(root.iterdir())
    with lock(root):
        recover(root)
        new = {path: data for path, data in first().items() if not (root / path).exists()}
        kg = load_kg(_with(root, domain, new), f"kg/{domain}")
        repo = recovered(root, own=made)
        unknown = _unknown(repo, domain) - new.keys()
        paths = sorted(new.keys() | (set() if unknown and faults(kg) else unknown))
        if paths:
            message = f"start: the {domain} as it comes"
            commit(root, repo, Change(new, paths), message, now())
        return Start(repo.head(), tuple(repo.dirty(paths_of(domain))), kg)


def _with(root: Path, domain: str, new: Mapping[str, bytes]) -> dict[str, bytes]:
    """The domain's files with those that a first use adds."""
    folder, own = root / "kg" / domain, f"kg/{domain}/"
    added = {path.removeprefix(own): data for path, data in new.items() if path.startswith(own)}
    return {**(read_files(folder) if folder.is_dir() else {}), **added}


def _unknown(repo: Repo, domain: str) -> set[str]:
    """The domain's files that no commit holds."""
    head = repo.head()
    return {path for path in paths_of(domain) if not head or repo.read(path, head) is None}
