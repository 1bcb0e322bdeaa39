"""A new domain for a workspace, from the starting pack or like another domain."""

import re
from pathlib import Path

from rdflib import URIRef

from adaptbot_cli import bounded
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.keeper import create, renamed
from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import TERMS, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.errors import UsageError
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.sources import settled
from adaptbot_cli.workspace import Workspace

PDDL_FILES = ("domain.pddl", "problem.pddl")
"""Where a pack's folder holds the PDDL that it was made of."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")


def start(workspace: Workspace, name: str, like: str | None = None) -> tuple[Kg, str]:
    """Write a new domain into the workspace and commit it; return its graph and the revision.

    It is the starting pack, or a copy of the domain `like` with its plans.

    Raises:
        UsageError: the name will not do or is taken, or there is no domain to copy.
        KnowledgeError: the workspace cannot be written, or the pack to copy has faults.
    """
    from adaptbot_cli.adapters.planner.library import library_files

    _refuse(workspace, name)
    source = workspace.folder(like) if like else bundled("starter")
    library = workspace.library(like) if like else (bundled("starter"),)
    files = settled(workspace.root, lambda: workspace.files(like) if like else read_files(source))
    iri = load_kg(files, str(source)).domain.iri
    pack = renamed(files, iri, URIRef(iri[: -len(local(iri))] + name), name)
    kg = load_kg(pack, f"kg/{name}")
    written = {f"kg/{name}/{file}": data for file, data in pack.items()}
    for path in library_files(*library):
        written[f"prompts/library/{name}/{path.name}"] = path.read_bytes()
    origin = f"like {like}" if like else "from the starting pack"
    message = f"domain: start {name} {origin}"
    return kg, create(workspace.root, written, workspace.own_files(), message)


def take_over(
    workspace: Workspace, domain: Path, problem: Path | None, name: str | None = None
) -> tuple[Kg, str]:
    """Write a domain of PDDL, with the things and the goal of a problem, into the workspace; return
    its graph and the revision.

    The PDDL itself is kept beside the pack, for plans that are exported to go with it.

    Raises:
        UsageError: as `start`, or a file cannot be read.
        KnowledgeError: a file is no PDDL, or has what a graph cannot hold.
    """
    from adaptbot_cli.adapters.pddl import packed

    called = name or normal(domain.stem)
    _refuse(workspace, called)
    pack = packed(domain, problem, called)
    kg = load_kg(pack, f"kg/{called}")
    for path, file in zip((domain, problem), PDDL_FILES, strict=True):
        if path:
            pack[file] = bounded.read_bytes(path, bounded.PLAN, UsageError)
    written = {f"kg/{called}/{file}": data for file, data in pack.items()}
    message = f"domain: import {called} from PDDL"  # a file's name is a stranger's text
    return kg, create(workspace.root, written, workspace.own_files(), message)


def _refuse(workspace: Workspace, name: str) -> None:
    """Make sure that a new domain may have a name. Raises UsageError."""
    if not _NAME.fullmatch(name):
        better = normal(name)
        hint = f"; {better} would do" if _NAME.fullmatch(better) else ", such as post_room"
        raise UsageError(
            f'"{name}" cannot name a domain: a name has small letters, digits and underscores, '
            f"begins with a letter and has 40 characters at most{hint}"
        )
    if name in TERMS:
        raise UsageError(f'"{name}" cannot name a domain: ab:{name} means something else already')
    if name in workspace.domains():
        where = "in this workspace" if workspace.has(name) else "bundled with the program"
        raise UsageError(
            f'there is a domain "{name}" already, {where}; choose another name, '
            f"perhaps with --like {name}"
        )
