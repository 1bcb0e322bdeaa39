"""Where a graph comes from: the bundle, the workspace, a revision of it, files."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import load_kg, read_graphs
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.robots import acting_as
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.resources import bundled
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.adapters.store.keeper import WorkspaceStart
    from adaptbot_cli.core.request.understand import Reading

T = TypeVar("T")

_TRIES = 20
"""How often files are read again because a writer came in between, before it is waited for."""

EDITS = " with edits"
"""Marks in a transcript that the graph was no revision: such a run cannot be played again."""


def load(
    workspace: Workspace,
    domain: str,
    facts: Sequence[Path] = (),
    at: str | None = None,
    robot: str = "",
) -> Kg:
    """Load a domain's graph: the workspace's or the bundled one.

    `facts` are Turtle files to take the facts from instead; `at` is a revision of the workspace;
    `robot` is the name of the one that acts, "" for the domain's own.
    What a killed run left half written is finished or undone first; what is being written is read
    before or after, not in between.

    Raises:
        UsageError, KnowledgeError, PackError: what is asked for is not there or makes no sense.
    """
    if at is not None:
        workspace.folder(domain)
        return acting_as(load_kg(_files_at(workspace, domain, at), f"kg/{domain} at {at}"), robot)
    files = settled(workspace.root, lambda: workspace.files(domain))
    where = str(workspace.folder(domain))
    return acting_as(load_kg(files, where, read_graphs(facts), workspace.large), robot)


def started_on(domain: str, workspace: Workspace) -> "WorkspaceStart":
    """Make the workspace ready; what follows is on its files as they are then."""
    from adaptbot_cli.adapters.store.keeper import start
    from adaptbot_cli.session.author import now

    workspace.folder(domain)  # a domain that is not there makes no workspace
    first = partial(workspace.first_files, domain)
    return start(workspace.root, domain, first, now, workspace.large)


def settled(root: Path, read: Callable[[], T]) -> T:
    """Return what `read` gives between two writes, so that it sees files of one revision only.

    What a kill has interrupted is finished or undone first; a workspace that may not be written is
    read as it is. Takes no lock unless a writer is at work or was. Raises what `read` raises.
    """
    repo = Repo.open(root) if root.is_dir() else None
    if repo is None:
        return read()
    for _ in range(_TRIES):
        before = repo.generation()
        if repo.interrupted():
            break
        found = read()
        if not repo.interrupted() and repo.generation() == before:
            return found
    if not repo.may_write():
        return read()
    with repo.writing():
        return read()


def reader(
    kg: Kg,
    workspace: Workspace,
    requires: Sequence[str] = (),
    without: Sequence[str] = (),
    lexicon: Lexicon | None = None,
) -> "Callable[[str], Reading]":
    """Return what reads requests on a graph, with the names of the plan library's dishes."""
    from adaptbot_cli.adapters.planner.library import names_in
    from adaptbot_cli.core.request.understand import understand

    dishes = names_in(*workspace.library(kg.domain.name))
    words = lexicon or WordNet()
    return lambda text: understand(text, kg, words, requires, without, dishes)


def kg_of(header: Mapping[str, Any], path: Path, workspace: Workspace, edited: bool = False) -> Kg:
    """Return the graph that a transcript was made on, a new one each time: the bundled one, or a
    revision of the workspace, as the robot of its run acts on it. With `edited`, files edited by
    hand, which were no revision, are taken as they are now.

    Raises:
        UsageError: its domain or robot is none of those there are, or it cannot be played again.
        KnowledgeError: the workspace has no such revision.
    """
    domain, graph = str(header.get("domain", "")), str(header.get("graph", "bundled"))
    if is_edited(header) and edited:
        return load(workspace, domain, robot=robot_of(header))
    if is_edited(header):
        raise UsageError(f"{path} was made on hand-edited files that were not committed: no replay")
    if domain not in workspace.domains():  # never a path: a transcript may be a stranger's
        known = ", ".join(workspace.domains())
        raise UsageError(f'{path}: there is no domain "{domain}"; there is {known}')
    where = f"kg/{domain} at {graph[:10]}"
    if graph == "bundled":
        folder, where = bundled("kg") / domain, f"kg/{domain}"
        if not (folder / "domain.ttl").is_file():
            raise UsageError(f'{path}: there is no bundled domain "{domain}"')
    files = read_files(folder) if graph == "bundled" else _files_at(workspace, domain, graph)
    return acting_as(load_kg(files, where), robot_of(header))


def is_edited(header: Mapping[str, Any]) -> bool:
    """Tell whether a transcript was made on files edited by hand and not committed."""
    return str(header.get("graph", "")).endswith(EDITS)


def robot_of(header: Mapping[str, Any]) -> str:
    """Return which robot acted in a transcript's run, "" if it was the domain's own."""
    return str(header.get("robot") or "")


def _files_at(workspace: Workspace, domain: str, revision: str) -> dict[str, bytes]:
    from adaptbot_cli.adapters.store.versions import Versions

    repo = Repo.open(workspace.root) if workspace.exists else None
    if repo is None:
        raise KnowledgeError(f"no workspace is at {workspace.root}, so no revision {revision}")
    return Versions(domain, repo).files(revision)
