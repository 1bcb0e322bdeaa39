"""A run looked at again: from its transcript to the ways of the things in it."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.core.report import Outcome, Report
from adaptbot_cli.core.turns import Checked, Executed, Turn
from adaptbot_cli.session.loading import kg_again
from adaptbot_cli.session.playing import replay
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.core.progress import Progress

_EDITED = "hand-edited files were not committed before this run: told on the files as they are now"
_CUT = "the transcript ends before the run did: told as far as it goes"


class _Last:
    """An observer that keeps the last plan, and what its execution came to."""

    def __init__(self) -> None:
        self.report: Report | None = None
        self.outcome: Outcome | None = None

    def asked(self, turn: Turn) -> None:
        """Keep nothing: the reply is not there yet."""

    def replied(self, turn: Turn, reply: object) -> None:
        """Keep a checked plan, and the outcome of it."""
        if isinstance(turn, Checked):
            self.report, self.outcome = turn.report, None
        elif isinstance(turn, Executed):
            self.report, self.outcome = turn.report, turn.outcome


def retrace(path: Path, workspace: Workspace) -> "Progress":
    """Replay a transcript and return the ways of its things, as far as an interrupted one tells.

    Raises:
        UsageError: it is no transcript, or ended before there was a plan.
        ReplayError: a finished one no longer tells the same story.
    """
    from adaptbot_cli.adapters.transcript import read
    from adaptbot_cli.core.progress import progress
    from adaptbot_cli.errors import ReplayError, UsageError

    header, turns = read(path)
    # Hand-edited files were no revision; if they are as they were, the replay shows it.
    kg, edited = kg_again(header, path, workspace)
    last, notes = _Last(), [_EDITED] if edited else []
    try:
        replay(path, workspace, [last], kg)
    except ReplayError:
        if turns and turns[-1]["turn"] == "finished":
            raise
        notes.append(_CUT)
    if last.report is not None and any(step.done for step in last.report.steps):
        kg, _ = kg_again(header, path, workspace)  # the state before the robot acted
    if last.report is None:
        raise UsageError(f"{path} ended before there was a plan: nothing has a way yet")
    return replace(progress(last.report, last.outcome, kg), note="; ".join(notes))


def find_run(workspace: Workspace, name: str | None) -> Path:
    """Return the transcript that is meant: a file, a run by the beginning of its name or of its
    task, or the latest run.

    Raises:
        UsageError: there is none, or the name may mean several.
    """
    from adaptbot_cli.core.learning import safe_name
    from adaptbot_cli.errors import UsageError

    if name is not None and Path(name).is_file():
        return Path(name)
    runs = sorted(workspace.transcripts.glob("*.yaml"))
    if not runs:
        raise UsageError(f'no run is recorded in {workspace.root}; try adaptbot run "…" first')
    if name is None:
        return runs[-1]
    task = safe_name(name)
    fitting = [run for run in runs if run.stem.startswith(name)]
    fitting = fitting or [run for run in runs if run.stem.partition("-")[2].startswith(task)]
    if len(fitting) == 1:
        return fitting[0]
    text = ", ".join(run.stem for run in (fitting or runs)[-3:])
    if fitting:
        raise UsageError(f'"{name}" may mean {len(fitting)} runs: {text}; write more of the name')
    raise UsageError(f'no run or file is called "{name}"; the latest runs are {text}')
