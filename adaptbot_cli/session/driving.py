"""The only loop that performs turns."""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from adaptbot_cli.core.turns import (
    Amend,
    Ask,
    Editor,
    Execute,
    Executor,
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
    Store,
    Trace,
    Turn,
    Volunteer,
)
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.errors import ModelError

R = TypeVar("R")


@dataclass(frozen=True, slots=True)
class Ports:
    """What the method's turns are performed with."""

    planner: Planner
    human: Human
    executor: Executor
    lexicon: Lexicon
    store: Store
    observers: Sequence[Observer] = ()


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
        case Execute():
            return ports.executor.execute(turn.report)
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


class Nowhere:
    """The store of a dry run: keeps nothing."""

    def keep(self, turn: Keep) -> Kept:
        """Keep nothing."""
        return Kept(None)
