"""Finds the run that was cut off, and what it knew."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adaptbot_cli import trust
from adaptbot_cli.core.turns import Human, Planner
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.adapters.planner.budget import Spent


def cut_off(workspace: Workspace, name: str = "") -> Path:
    """Return the transcript of the run to go on with: the one that is named, or the latest.

    `name` is a transcript's name without ending, the beginning of one, or a file.

    Raises:
        UsageError: there is no such run, there are several, or it has ended.
    """
    from adaptbot_cli.adapters.transcript import has_end, text_of, unfinished
    from adaptbot_cli.errors import UsageError

    open_ = unfinished(workspace.transcripts)
    if not name:
        if not open_:
            raise UsageError(f"no run in {workspace.root} was cut off: there is nothing to resume")
        return open_[0]
    if Path(name).is_file():
        found = [Path(name)]
    else:
        found = sorted(workspace.transcripts.glob("*.yaml"))
        exact = [path for path in found if path.stem == name]
        found = exact or [path for path in found if path.stem.startswith(name)]
    if not found:
        raise UsageError(f'there is no run "{name}" in {workspace.root}; {_listed(open_)}')
    if len(found) > 1:
        raise UsageError(f'"{name}" is short for {len(found)} runs; {_listed(open_)}')
    if has_end(text_of(found[0])):
        raise UsageError(f"{found[0].stem} has ended: there is nothing to resume; {_listed(open_)}")
    later = next((path for path in open_ if found[0] in chain(path)[:-1]), None)
    return later or found[0]


def _listed(paths: list[Path]) -> str:
    if not paths:
        return "none was cut off"
    return f"cut off: {', '.join(path.stem for path in paths[:5])}"


def header_of(path: Path) -> Mapping[str, Any]:
    """Return a transcript's header. Raises UsageError."""
    from adaptbot_cli.adapters import transcript

    return transcript.header_of(path)


def guarded(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a header says that is obeyed only where the user trusts it."""
    return {name: header[name] for name in trust.GUARDED if name in header}


def content_of(header: Mapping[str, Any]) -> bytes:
    """Return the part of a transcript that trust is bound to, as it grows with every turn."""
    return json.dumps(guarded(header), sort_keys=True, default=str).encode()


def is_own(path: Path, header: Mapping[str, Any]) -> bool:
    """Whether a transcript is of a run of this user, or trusted as if it were."""
    return trust.is_trusted(path, content_of(header))


def chain(path: Path) -> list[Path]:
    """Return the transcripts that a run goes on with, the first one first, and its own."""
    found = [path]
    while True:
        before = header_of(found[0]).get("resumes")
        older = path.parent / f"{before}.yaml"
        if not before or older in found or not older.is_file():
            return found
        found.insert(0, older)


def spent(path: Path) -> "list[Spent]":
    """Return what a run that was cut off has spent on its model, as far as its transcripts tell."""
    from adaptbot_cli.adapters.planner.budget import Spent
    from adaptbot_cli.adapters.transcript import read_cut

    turns = [turn for each in chain(path) for turn in read_cut(each)[1]]
    found = []
    for turn in (turn for turn in turns if turn["turn"] == "propose"):
        tokens = turn.get("tokens") or {}
        prompt, completion = tokens.get("prompt", 0), tokens.get("completion", 0)
        found.append(Spent(turn.get("calls", 1), prompt, completion, turn.get("cost_usd")))
    return found


def remembering(
    path: Path, planner: Planner, human: Human
) -> tuple[Planner, Human, tuple[tuple[str, str], ...], tuple[str, ...]]:
    """Return a planner and a human that first give the replies of a run that was cut off; the tasks
    that came to their end in its world, each with what it came to; the calls that it executed there
    for the next one.

    Who has answered in a transcript that is not of this user nobody knows: only its plans count.
    """
    from adaptbot_cli.adapters.transcript import (
        Memory,
        RememberingHuman,
        RememberingPlanner,
        read_cut,
    )

    memory = Memory()
    for each in chain(path):
        header, turns = read_cut(each)
        own = is_own(each, header)
        memory.take(turn for turn in turns if own or turn["turn"] in ("propose", "checked"))
    known = RememberingPlanner(memory, planner), RememberingHuman(memory, human)
    return *known, tuple(memory.over), tuple(memory.done)
