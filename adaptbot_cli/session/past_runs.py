"""The runs of a workspace, from their transcripts: listed, found, traced again, gone on with."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from difflib import SequenceMatcher
from itertools import zip_longest
from pathlib import Path
from typing import Any

from adaptbot_cli import trust
from adaptbot_cli.adapters.transcript.loading import (
    glanced,
    has_end,
    header_of,
    read,
    read_cut,
    text_of,
    unfinished,
)
from adaptbot_cli.adapters.transcript.memory import Memory, RememberingHuman, RememberingPlanner
from adaptbot_cli.adapters.transcript.recorder import is_signed
from adaptbot_cli.core.ask.learning import safe_name
from adaptbot_cli.core.names import words
from adaptbot_cli.core.report import Outcome, Report
from adaptbot_cli.core.turns import Checked, Executed, Human, Planner, Turn
from adaptbot_cli.core.usage import Usage
from adaptbot_cli.core.view.progress import Progress, progress
from adaptbot_cli.errors import ReplayError, UsageError
from adaptbot_cli.session.drive import Noting
from adaptbot_cli.session.replay import replay
from adaptbot_cli.session.sources import is_edited, kg_of, robot_of
from adaptbot_cli.workspace import Workspace


@dataclass(frozen=True, slots=True)
class PastRun:
    """A run as its transcript tells it; `outcome` is "" if it has not ended.

    `short` is the beginning of its id that no other run's id begins with; `robot` is "" if the
    domain's own acted.
    """

    id: str
    short: str
    task: str
    domain: str
    planner: str
    world: str
    outcome: str
    goal_met: bool
    robot: str = ""

    @property
    def told(self) -> str:
        """What it came to, in words."""
        if not self.outcome:
            return "not ended: adaptbot resume"
        if self.goal_met:
            return "goal met"
        plain = {"executable": "executable, goal not met", "no_plan": "no plan"}
        return plain.get(self.outcome, "findings remain")

    def as_json(self) -> dict[str, Any]:
        """Return the run as a plain object."""
        found = {**asdict(self), "outcome": self.outcome or None, "world": self.world or None}
        return {name: value for name, value in found.items() if name != "robot" or value}


def found_runs(workspace: Workspace, task: str = "", last: int = 20) -> list[PastRun]:
    """Return the newest runs, those of a task if words of it are given; other files are no runs."""
    found: list[PastRun] = []
    paths = sorted(workspace.transcripts.glob("*.yaml"), reverse=True)
    short = _short_ids(paths)
    for path in paths:
        try:
            header, end = glanced(path)
        except UsageError:
            continue
        if not set(words(task)) <= set(words(str(header.get("task", "")))):
            continue
        found.append(_past(path, short[path], header, end))
        if len(found) == last:
            break
    return found


_LENGTHS = (13, 15, 18)
"""How much of a run's time may tell it from others: to the minute, the second, the millisecond."""


def _short_ids(paths: Sequence[Path]) -> dict[Path, str]:
    """The beginnings of their names, to the minute, the second or what else tells all apart."""
    names = [path.stem.partition("-")[0] for path in paths]
    most = len(set(names))
    length = next((n for n in _LENGTHS if len({name[:n] for name in names}) == most), None)
    return {path: name[:length] for path, name in zip(paths, names, strict=True)}


@dataclass(frozen=True, slots=True)
class RunDetails:
    """What a run's transcript tells of it. Steps are those of the last plan, as it was checked;
    `learned` is what was kept of it."""

    run: PastRun
    policy: str
    requires: tuple[str, ...]
    without: tuple[str, ...]
    steps: tuple[str, ...]
    questions: Mapping[str, str]
    learned: tuple[str, ...]
    tokens: int

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain object."""
        return {**asdict(self), "run": self.run.as_json(), "questions": dict(self.questions)}


def details(workspace: Workspace, path: Path) -> RunDetails:
    """Return what a transcript tells of its run. Raises UsageError: it is none."""
    header, turns = read_cut(path)
    runs = sorted(workspace.transcripts.glob("*.yaml"))
    short = _short_ids(runs).get(path, path.stem)
    end = turns[-1] if turns and turns[-1]["turn"] == "finished" else {}
    task, plans, tokens = "", dict[str, list[str]](), 0
    questions, learned = dict[str, str](), list[str]()
    for turn in turns:
        match turn["turn"]:
            case "propose":
                task = str(turn.get("task", ""))
                tokens += sum((turn.get("tokens") or {}).values())
            case "checked":
                steps = turn.get("steps")
                plans[task] = [*map(str, steps)] if isinstance(steps, list) else []
            case "ask":
                questions[str(turn.get("text", ""))] = str(turn.get("answer", ""))
            case "offer":
                answers = turn.get("answers")
                for prop, answer in answers.items() if isinstance(answers, dict) else ():
                    questions[f"{turn.get('about')}: {prop}"] = str(answer)
            case "keep":
                lessons = turn.get("lessons")
                learned += map(str, lessons) if isinstance(lessons, list) else ()
    return RunDetails(
        _past(path, short, header, end),
        str(header.get("policy", "")),
        tuple(map(str, header.get("requires") or ())),
        tuple(map(str, header.get("without") or ())),
        tuple(step for steps in plans.values() for step in steps),
        questions,
        tuple(learned),
        tokens,
    )


_SAME = ("ok", "changed", "inserted")
"""How a step came to be what it is makes no other step of it."""

Differing = tuple[tuple[int | None, int | None], str | None, str | None]


def differing_steps(before: RunDetails, after: RunDetails) -> list[Differing]:
    """Return the steps that one of two plans has and the other has not, side by side: their numbers
    in each, and what they are. A step that was left out or not possible tells so."""

    def plain(step: str) -> str:
        status, _, call = step.partition(": ")
        return call if status in _SAME else step

    a, b = [plain(s) for s in before.steps], [plain(s) for s in after.steps]
    rows: list[Differing] = []
    for tag, i, i_end, j, j_end in SequenceMatcher(None, a, b, autojunk=False).get_opcodes():
        if tag != "equal":
            for m, n in zip_longest(range(i, i_end), range(j, j_end)):
                numbers = (None if m is None else m + 1, None if n is None else n + 1)
                rows.append((numbers, None if m is None else a[m], None if n is None else b[n]))
    return rows


def _past(path: Path, short: str, header: Mapping[str, Any], end: Mapping[str, Any]) -> PastRun:
    task, domain, planner, world = (
        str(header.get(key) or "") for key in ("task", "domain", "planner", "world")
    )
    outcome, met = str(end.get("outcome") or ""), end.get("goal_met") is True
    robot = robot_of(header)
    return PastRun(path.stem, short, task, domain, planner, world, outcome, met, robot)


_EDITED = "hand-edited files were not committed before this run: told on the files as they are now"
_CUT = "the transcript ends before the run did: told as far as it goes"


def retrace(path: Path, workspace: Workspace) -> Progress:
    """Replay a transcript and return the ways of its things, as far as an interrupted one tells.

    Raises:
        UsageError: it is no transcript, or ended before there was a plan.
        ReplayError: a finished one no longer tells the same story.
    """
    header, turns = read(path)
    # Hand-edited files were no revision; if they are as they were, the replay shows it.
    kg = kg_of(header, path, workspace, edited=True)
    last: list[tuple[Report, Outcome | None]] = []
    notes = [_EDITED] if is_edited(header) else []

    def note(turn: Turn, reply: object) -> None:
        if isinstance(turn, Checked | Executed):
            last[:] = [(turn.report, turn.outcome if isinstance(turn, Executed) else None)]

    try:
        replay(path, workspace, [Noting(note)], kg)
    except ReplayError:
        if turns and turns[-1]["turn"] == "finished":
            raise
        notes.append(_CUT)
    if not last:
        raise UsageError(f"{path} ended before there was a plan: nothing has a way yet")
    [(report, outcome)] = last
    if any(step.done for step in report.steps):
        kg = kg_of(header, path, workspace, edited=True)  # the state before the robot acted
    return replace(progress(report, outcome, kg), note="; ".join(notes))


def find_run(workspace: Workspace, name: str | None) -> Path:
    """Return the transcript that is meant: a file, a run by the beginning of its name or of its
    task, or the latest run.

    Raises:
        UsageError: there is none, or the name may mean several.
    """
    if name is not None and Path(name).is_file():
        return Path(name)
    runs = sorted(workspace.transcripts.glob("*.yaml"))
    if not runs:
        raise UsageError(f'no run is recorded in {workspace.root}; try adaptbot run "…" first')
    if name is None:
        return runs[-1]
    task = safe_name(name)
    fitting = [run for run in runs if run.stem == name]
    fitting = fitting or [run for run in runs if run.stem.startswith(name)]
    fitting = fitting or [run for run in runs if run.stem.partition("-")[2].startswith(task)]
    if len(fitting) == 1:
        return fitting[0]
    text = ", ".join(run.stem for run in (fitting or runs)[-3:])
    if fitting:
        raise UsageError(f'"{name}" may mean {len(fitting)} runs: {text}; write more of the name')
    raise UsageError(f'no run or file is called "{name}"; the latest runs are {text}')


def cut_off(workspace: Workspace, name: str = "") -> Path:
    """Return the transcript of the run to go on with: the one that is named, or the latest.

    `name` is as for `find_run`.

    Raises:
        UsageError: there is no such run, there are several, or it has ended.
    """
    open_ = unfinished(workspace.transcripts)
    if not name:
        if not open_:
            raise UsageError(f"no run in {workspace.root} was cut off: there is nothing to resume")
        return open_[0]
    found = find_run(workspace, name)
    if has_end(text_of(found)):
        others = ", ".join(path.stem for path in open_[:5])
        told = f"cut off: {others}" if others else "none was cut off"
        raise UsageError(f"{found.stem} has ended: there is nothing to resume; {told}")
    later = next((path for path in open_ if found in chain(path)[:-1]), None)
    return later or found


def guarded(header: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a header says that is obeyed only where the user trusts it."""
    return {name: header[name] for name in trust.GUARDED if name in header}


def content_of(header: Mapping[str, Any]) -> bytes:
    """Return the part of a transcript that trust is bound to, as it grows with every turn."""
    return json.dumps(guarded(header), sort_keys=True, default=str).encode()


def is_own(path: Path, header: Mapping[str, Any]) -> bool:
    """Whether a transcript is of a run of this user, or trusted as if it were."""
    return trust.is_trusted(path, content_of(header))


def answered(path: Path) -> bool:
    """Tell whether a transcript holds a person's replies."""
    return any(map(is_signed, read_cut(path)[1]))


def chain(path: Path) -> list[Path]:
    """Return the transcripts that a run goes on with, the first one first, and its own."""
    found = [path]
    while True:
        before = header_of(found[0]).get("resumes")
        older = path.parent / f"{before}.yaml"
        if not before or older in found or not older.is_file():
            return found
        found.insert(0, older)


def spent(path: Path) -> list[Usage]:
    """Return what a run that was cut off has spent on its model, as far as its transcripts tell."""
    turns = [turn for each in chain(path) for turn in read_cut(each)[1]]
    found = []
    for turn in (turn for turn in turns if turn["turn"] == "propose"):
        tokens = turn.get("tokens") or {}
        prompt, completion = tokens.get("prompt", 0), tokens.get("completion", 0)
        found.append(Usage(turn.get("calls", 1), prompt, completion, turn.get("cost_usd")))
    return found


def remembering(
    path: Path, planner: Planner, human: Human
) -> tuple[Planner, Human, tuple[tuple[str, str], ...], tuple[str, ...]]:
    """Return a planner and a human that first give the replies of a run that was cut off; the tasks
    that came to their end in its world, each with what it came to; the calls that it executed there
    for the next one.

    Who has answered in a transcript that is not of this user nobody knows: only its plans count.
    """
    memory = Memory()
    for each in chain(path):
        header, turns = read_cut(each)
        own = is_own(each, header)
        memory.take(turn for turn in turns if own or turn["turn"] in ("propose", "checked"))
    known = RememberingPlanner(memory, planner), RememberingHuman(memory, human)
    return *known, tuple(memory.over), tuple(memory.done)
