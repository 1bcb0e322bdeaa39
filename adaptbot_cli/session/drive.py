"""The only loop that performs turns."""

import signal
import threading
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from adaptbot_cli.adapters.lexicon import WordNet
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
    Surprised,
    Trace,
    Turn,
    Volunteer,
    World,
)
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.core.world import STOPPED, Seen
from adaptbot_cli.errors import ModelError

R = TypeVar("R")

_OF_THE_WORLD = (Act, Believe, Surprised, Stop)
"""The turns at which the robot is acting."""


@dataclass(frozen=True, slots=True)
class Ports:
    """What the method's turns are performed with."""

    planner: Planner
    human: Human
    lexicon: Lexicon
    store: Store
    observers: Sequence[Observer] = ()
    world: World | None = None


def without_planner(
    human: Human, store: Store | None = None, observers: Sequence[Observer] = ()
) -> Ports:
    """Return the ports of turns that propose nothing; nothing is kept without a store."""
    nobody: Any = None
    return Ports(nobody, human, WordNet(), store or Nowhere(), observers)


def drive(turns: Generator[Turn, Any, R], ports: Ports) -> R:
    """Perform every turn through the ports, show each to the observers, return the result."""
    reply: object = None
    with _CtrlC(ports.world is not None) as ctrl_c:
        while True:
            try:
                turn = turns.send(reply)
            except StopIteration as stop:
                result: R = stop.value
                return result
            ctrl_c.turn = turn
            if ctrl_c.pressed and isinstance(turn, Act):
                reply = None
                continue
            for observer in ports.observers:
                observer.asked(turn)
            reply = perform(turn, ports)
            if ctrl_c.pressed and isinstance(reply, Seen):
                reply = replace(reply, over=reply.over or STOPPED)
            for observer in ports.observers:
                observer.replied(turn, reply)


@dataclass(slots=True)
class _CtrlC:
    """While the robot acts, Ctrl-C stops the run after the step at hand, and a second one at once;
    at a question or a prompt it does what it always does."""

    held: bool
    pressed: bool = False
    turn: Turn | None = None
    _before: Any = None

    def __enter__(self) -> "_CtrlC":
        self.held = self.held and threading.current_thread() is threading.main_thread()
        if self.held:
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(self, *error: object) -> None:
        if self.held:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, number: int, frame: object) -> None:
        if self.pressed or not isinstance(self.turn, _OF_THE_WORLD):
            raise KeyboardInterrupt
        self.pressed = True


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
            return ports.world.act(turn)
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


@dataclass(frozen=True, slots=True)
class Noting:
    """An observer that passes each turn on with its reply."""

    note: Callable[[Turn, Any], None]

    def asked(self, turn: Turn) -> None:
        """Wait for the reply."""

    def replied(self, turn: Turn, reply: object) -> None:
        """Pass it on."""
        self.note(turn, reply)


class Nowhere:
    """The store of a dry run: keeps nothing."""

    def believe(self, turn: Believe) -> Kept:
        """Keep nothing."""
        return Kept(None)

    def keep(self, turn: Keep) -> Kept:
        """Keep nothing."""
        return Kept(None)
