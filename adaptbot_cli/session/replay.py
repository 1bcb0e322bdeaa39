"""Runs that nobody takes part in: the check of a plan, and a transcript played again."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.core.acts import GOAL_MET
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Observer
from adaptbot_cli.core.tutor import inspect, pursue_each
from adaptbot_cli.errors import UsageError
from adaptbot_cli.session.drive import Ports, drive, without_planner
from adaptbot_cli.session.sources import kg_of, reader
from adaptbot_cli.workspace import Workspace


def check(text: str, task: Task, kg: Kg, repair: bool = True) -> Result:
    """Check a plan's text on a graph, without model or human. Nothing in the world changes.

    Without `repair` the plan is judged as it is.
    """
    from adaptbot_cli.adapters.terminal import AbsentHuman

    return drive(inspect(task, kg, parser(kg), text, repair), without_planner(AbsentHuman()))


def check_request(
    text: str,
    request: str,
    workspace: Workspace,
    kg: Kg,
    requires: Sequence[str] = (),
    without: Sequence[str] = (),
    repair: bool = True,
) -> Result:
    """Check a plan's text for what a request asks: one task, as a plan is for one."""
    reading = reader(kg, workspace, requires, without)(request)
    if not reading.tasks:
        return check(text, Task("", unread=(reading.refused,), said=request), kg, repair)
    first, *others = reading.tasks
    unread = (*first.unread, *(task.name for task in others))
    return check(text, replace(first, unread=unread), kg, repair)


def replay(
    path: Path, workspace: Workspace, observers: Sequence[Observer] = (), kg: Kg | None = None
) -> Result:
    """Replay a transcript: no key, no network, no change of the workspace.

    `kg` is the graph that the transcript was made on, if the caller has it loaded.

    Raises:
        ReplayError: the run differs from the transcript; the message says at which turn and how.
    """
    from adaptbot_cli.adapters.transcript.loading import read
    from adaptbot_cli.adapters.transcript.player import Player

    header, turns = read(path)
    if "sitting" in header:
        raise UsageError(f"{path} tells the answers of `adaptbot pending answer`; it is no run")
    kg = kg or kg_of(header, path, workspace)
    text = str(header.get("task", ""))
    read_it = reader(kg, workspace, header.get("requires") or (), header.get("without") or ())
    player = Player(path, kg, turns)
    ports = Ports(player, player, WordNet(), player, [player, *observers], player)
    policy, replans = header.get("policy", "tutor"), int(header.get("replans", 3))
    full = bool(header.get("full", False))
    planless = all(turn["turn"] != "propose" for turn in turns)
    if turns and turns[-1]["turn"] == "finished" and planless:  # the planner had no plan at all
        player.at = len(turns) - 1
        [task, *_] = read_it(text).tasks
        result = drive(inspect(task, kg, parser(kg), ""), ports)
    else:
        world = header.get("confirm", "none") if "world" in header else None
        done, found = (
            each if isinstance(each := header.get(key), list) else [] for key in ("done", "over")
        )
        # An older transcript has only the names of the tasks.
        ended = (e if isinstance(e, list) and len(e) == 2 else [e, GOAL_MET] for e in found)
        over = tuple((str(name), str(why)) for name, why in ended)
        how = (policy, replans, full, world, tuple(map(str, done)), over)
        turns_again = pursue_each(text, read_it, kg, parser(kg), *how, plans="any")
        result = drive(turns_again, ports)
    player.end(result)
    return result
