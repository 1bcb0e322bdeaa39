"""The only loop that performs turns."""

import signal
import threading
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from adaptbot_cli.core.turns import (
    Act,
    Amend,
    Ask,
    Begin,
    Believe,
    Editor,
    Human,
    Keep,
    Kept,
    LookUp,
    Observer,
    Offer,
    Planner,
    Proposal,
    Propose,
    Review,
    Source,
    Stop,
    Store,
    Trace,
    Turn,
    Volunteer,
    World,
)
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.core.world import STOPPED, Seen
from adaptbot_cli.errors import ModelError

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Ports:
    """What the method's turns are performed with."""

    planner: Planner
    human: Human
    lexicon: Lexicon
    store: Store
    observers: Sequence[Observer] = ()
    world: World | None = None


def drive(turns: Generator[Turn, Any, R], ports: Ports) -> R:
    """Perform every turn through the ports, show each to the observers, return the result."""
    reply: object = None
    while True:
        try:
            turn = turns.send(reply)
        except StopIteration as stop:
            result: R = stop.value
            return result
        for observer in ports.observers:
            observer.asked(turn)
        reply = perform(turn, ports)
        for observer in ports.observers:
            observer.replied(turn, reply)


def perform(turn: Turn, ports: Ports) -> object:
    """Perform one turn through its port."""
    match turn:
        case Propose():
            return _proposal(turn, ports.planner)
        case LookUp():
            return {word: ports.lexicon.related(word, turn.fields) for word in turn.words}
        case Ask():
            return ports.human.ask(turn.question)
        case Amend():
            return ports.human.amend(turn) if isinstance(ports.human, Editor) else None
        case Offer() if isinstance(ports.human, Volunteer):
            return ports.human.offer(turn.questions)
        case Offer():
            return ()
        case Trace() if isinstance(ports.store, Source):
            return tuple(ports.store.trace(fact) for fact in turn.facts)
        case Trace():
            return ()
        case Begin() if ports.world:
            return ports.world.begin(turn)
        case Act() if ports.world:
            return _at_hand(turn, ports.world)
        case Stop() if ports.world:
            return ports.world.stop(turn)
        case Believe():
            return ports.store.believe(turn)
        case Review():
            return ports.human.review(turn.lessons)
        case Keep():
            return ports.store.keep(turn)
        case _:
            return None


def _proposal(turn: Propose, planner: Planner) -> Proposal:
    """Ask the planner; one that fails at a re-prompt ends the re-prompting, not the run, so that
    what the person has answered by then is kept."""
    try:
        return planner.propose(turn)
    except ModelError as error:
        if turn.attempt == 0:
            raise
        return Proposal(turn.previous, *error.spent, failure=str(error))


def _at_hand(turn: Act, world: World) -> Seen:
    """Have a step carried out; Ctrl-C stops the run after it, a second one at once."""
    interrupted: list[int] = []

    def note(number: int, frame: object) -> None:
        if interrupted:
            raise KeyboardInterrupt
        interrupted.append(number)

    if threading.current_thread() is not threading.main_thread():
        return world.act(turn)
    before = signal.signal(signal.SIGINT, note)
    try:
        seen = world.act(turn)
    finally:
        signal.signal(signal.SIGINT, before)
    return replace(seen, over=seen.over or STOPPED) if interrupted else seen


class Nowhere:
    """The store of a dry run: keeps nothing."""

    def believe(self, turn: Believe) -> Kept:
        """Keep nothing."""
        return Kept(None)

    def keep(self, turn: Keep) -> Kept:
        """Keep nothing."""
        return Kept(None)
