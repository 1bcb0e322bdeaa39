"""Runs that nobody takes part in: the check of a plan, and a transcript played again."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Observer
from adaptbot_cli.core.tutor import inspect, pursue
from adaptbot_cli.session.driving import Nowhere, Ports, drive
from adaptbot_cli.session.loading import kg_of
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.core.kg import Kg
    from adaptbot_cli.core.plan import Task


def check(text: str, task: "Task", kg: "Kg", repair: bool = True) -> Result:
    """Check a plan's text on a graph, without model or human. Nothing in the world changes.

    Without `repair` the plan is judged as it is.
    """
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.terminal import AbsentHuman
    from adaptbot_cli.core.execute import Rehearsal
    from adaptbot_cli.core.parse import parser

    nobody: Any = None
    ports = Ports(nobody, AbsentHuman(), Rehearsal(kg), WordNet(), Nowhere())
    return drive(inspect(task, kg, parser(kg), text, repair), ports)


def replay(
    path: Path, workspace: Workspace, observers: Sequence[Observer] = (), kg: "Kg | None" = None
) -> Result:
    """Replay a transcript: no key, no network, no change of the workspace.

    `kg` is the graph that the transcript was made on, if the caller has it loaded.

    Raises:
        ReplayError: the run differs from the transcript; the message says at which turn and how.
    """
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.transcript import Player, read
    from adaptbot_cli.core.execute import Rehearsal
    from adaptbot_cli.core.parse import parser
    from adaptbot_cli.core.tasks import task_for
    from adaptbot_cli.errors import UsageError

    header, turns = read(path)
    if "sitting" in header:
        raise UsageError(f"{path} tells the answers of `adaptbot pending answer`; it is no run")
    kg = kg or kg_of(header, path, workspace)
    task = task_for(str(header.get("task", "")), kg, header.get("requires") or ())
    player = Player(path, kg, turns)
    ports = Ports(player, player, Rehearsal(kg), WordNet(), player, [player, *observers])
    policy, replans = header.get("policy", "tutor"), int(header.get("replans", 3))
    full = bool(header.get("full", False))
    if turns and turns[0]["turn"] == "finished":  # the planner had no plan at all
        result = drive(inspect(task, kg, parser(kg), ""), ports)
    else:
        result = drive(pursue(task, kg, parser(kg), policy, replans, full), ports)
    player.end(result)
    return result
