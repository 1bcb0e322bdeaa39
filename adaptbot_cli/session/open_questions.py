"""The open questions of a workspace: found in its transcripts, answered in one sitting."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.transcript.loading import LeftOver, left_over, read_cut, unfinished
from adaptbot_cli.adapters.transcript.memory import Memory, RememberingHuman
from adaptbot_cli.core.ask.pending import Pending, Sitting, Waiting, listed, sitting
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.turns import Human, Observer
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.session.author import now
from adaptbot_cli.session.build import human_of, keeper_of, recording
from adaptbot_cli.session.drive import Ports, drive, without_planner
from adaptbot_cli.session.past_runs import is_own
from adaptbot_cli.session.sources import EDITS, load, reader, started_on
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from rich.console import Console


@dataclass(frozen=True, slots=True)
class Open:
    """What waits in a domain: tasks, the questions that they wait for, the transcripts they are
    from; and how many tasks wait in `others`, by domain."""

    kg: Kg
    waiting: Sequence[Waiting]
    pending: Sequence[Pending]
    runs: Sequence[str] = ()
    others: dict[str, int] = field(default_factory=dict)


def find_open(workspace: Workspace, domain: str) -> Open:
    """Find the questions that are open in a domain. Raises UsageError, KnowledgeError."""
    runs = left_over(workspace.transcripts, _sittings(workspace))
    words = WordNet()
    found = _open_in(workspace, domain, runs, words)
    others = dict[str, int]()
    for other in sorted({run.domain for run in runs} - {domain}):
        with suppress(UsageError, KnowledgeError):  # one that cannot be read tells nothing
            there = _open_in(workspace, other, runs, words)
            if tasks := {task for each in there.pending for task in each.tasks}:
                others[other] = len(tasks)
    return replace(found, others=others)


def _open_in(workspace: Workspace, domain: str, runs: Sequence[LeftOver], words: Lexicon) -> Open:
    kg = load(workspace, domain)
    here = [run for run in runs if run.domain == domain]
    waiting = []
    for run in here:
        reading = reader(kg, workspace, run.requires, run.without, words)(run.task)
        reading = reading.confirmed() if run.confirmed else reading
        for task in reading.tasks:
            plan = run.plans.get(task.name, run.plan if len(reading.tasks) == 1 else "")
            waiting += [Waiting(task, plan, run.unknown)] if plan else []
    pending = drive(listed(waiting, kg, parser(kg)), without_planner(human_of(None, None)))
    return Open(kg, waiting, pending, [run.path.stem for run in here])


def _sittings(workspace: Workspace) -> Path:
    return workspace.transcripts / "sittings"


@contextmanager
def sit_down(
    open_: Open,
    workspace: Workspace,
    answers: Path | None,
    prompts: "Console | None",
    observers: Sequence[Observer] = (),
) -> Iterator[Ports]:
    """Wire a sitting: a human to ask, a store to keep what is learned, a transcript of its own.

    What an earlier sitting was told and did not come to keep is given again. Raises KnowledgeError.
    """
    name = f"{now():%Y%m%dT%H%M%S%f}-pending.yaml"
    path = _sittings(workspace) / name
    human = _remembering(workspace, human_of(answers, prompts))
    domain = open_.kg.domain
    start = started_on(domain.name, workspace)
    keeper = keeper_of(domain, workspace, "pending answer", path)
    header = {
        "sitting": list(open_.runs),
        "domain": domain.name,
        "graph": (start.revision or "bundled") + (EDITS if start.edited else ""),
    }
    with recording(path, open_.kg, header) as recorder:
        yield without_planner(human, keeper, [*observers, recorder])
        recorder.ended()


def _remembering(workspace: Workspace, human: Human) -> Human:
    """A human who first gives what the last sitting was told, if that one was cut off."""
    latest = max(_sittings(workspace).glob("*.yaml"), default=None)
    if latest is None or latest not in unfinished(_sittings(workspace)):
        return human
    header, turns = read_cut(latest)
    if not is_own(latest, header):  # who has answered in it nobody knows
        return human
    memory = Memory()
    memory.take(turns)
    return RememberingHuman(memory, human) if memory.answers else human


def answer(open_: Open, ports: Ports) -> Sitting:
    """Go through the open questions, learn, and look at the tasks again."""
    return drive(sitting(open_.waiting, open_.kg, parser(open_.kg)), ports)
