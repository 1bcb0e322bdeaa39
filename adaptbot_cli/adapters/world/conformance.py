"""Whether a process keeps to the protocol of worlds: `adaptbot world check` (docs/worlds.md)."""

from collections.abc import Iterator
from dataclasses import dataclass

from rdflib import URIRef

from adaptbot_cli.adapters.world.process import Process
from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.plan import Call, Step, Task
from adaptbot_cli.core.report import GroundAction
from adaptbot_cli.core.turns import Act, Begin, Stop
from adaptbot_cli.core.world import Seen
from adaptbot_cli.errors import WorldError

UNKNOWN = "adaptbot_world_check"
"""An action that no robot has: to be refused, and no reason to die."""


@dataclass(frozen=True, slots=True)
class ProtocolCheck:
    """One thing that the protocol asks for: whether it is so, and what was seen instead."""

    what: str
    good: bool
    seen: str = ""


def conformance(process: Process) -> Iterator[ProtocolCheck]:
    """Give what a process was seen to do, one by one. It is asked to do nothing that moves it."""
    task = Task("world check", said="world check")
    starts = "it starts, and answers hello with ready"
    try:
        seen = process.begin(Begin(task))
    except WorldError as error:
        yield ProtocolCheck(starts, False, str(error))
        return
    yield ProtocolCheck(starts, True)
    yield _clean("it tells what it sees by names of this home", seen)
    for number, what in (
        (1, "it refuses an action that it does not know, with a reason"),
        (2, "it goes on after a step that failed"),
    ):
        action = Action(URIRef(f"urn:adaptbot:{UNKNOWN}"), UNKNOWN, "", ())
        seen = process.act(Act(number, Step(Call(UNKNOWN)), GroundAction(action, {}), Delta()))
        refused = bool(seen.failed) and not seen.over and process.answered
        why = "" if refused else seen.failed or "it said that it is done"
        yield ProtocolCheck(what, refused, why)
        yield _clean("it answers the step that was asked, and says nothing else", seen)
        if seen.over:
            return
    seen = process.stop(Stop(task, "world check"))
    process.close()
    by_itself = process.ended_by_itself
    yield ProtocolCheck("it ends when it is told to stop", by_itself, "it had to be ended")
    yield _clean("it says nothing wrong at the end", seen)


def _clean(what: str, seen: Seen) -> ProtocolCheck:
    return ProtocolCheck(what, not seen.odd, "; ".join(seen.odd))
