"""Progress lines: what becomes of each thing in an executed plan (paper, IV-A and figure 4)."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from rdflib import Literal as Value
from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.report import GroundAction, Outcome, Report

ItemClass = Literal["place", "state", "with", "gained", "lost", "carried", "used"]


@dataclass(frozen=True, slots=True)
class Event:
    """What happened to a thing at a step.

    `kind` says how to read `what`: a "place" it came to; a "state" it, or the thing `of` that it
    was in, came into; things that it is "with" from then on; things that it "gained" or "lost" as
    their place; a place where it was "carried" inside of `of`; the action it was "used" in.
    """

    step: int
    kind: ItemClass
    what: tuple[str, ...]
    of: str = ""


@dataclass(frozen=True, slots=True)
class ProgressLine:
    """A thing's way: where it was at first ("" if that is not known), and what happened to it.

    `kind` is its class in a word; `required` tells whether the task requires it.
    """

    name: str
    kind: str
    required: bool
    start: str
    events: tuple[Event, ...]


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress lines of all things that a plan touches.

    `steps` are number and call of those that were taken, in order; `executed` tells whether the
    plan was carried out, rather than rehearsed as far as it came; `stopped` what ended it early,
    if anything did; `hands` the places that mean: in the robot's hand; `note` what must be known of
    where all this is from.
    """

    task: str
    domain: str
    steps: tuple[tuple[int, str], ...]
    lines: tuple[ProgressLine, ...]
    executed: bool
    stopped: str = ""
    hands: frozenset[str] = frozenset()
    note: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return the progress as a plain object."""
        return {
            "task": self.task,
            "domain": self.domain,
            "executed": self.executed,
            "stopped": self.stopped or None,
            "note": self.note or None,
            "steps": [{"n": number, "call": call} for number, call in self.steps],
            "lines": [
                {
                    **asdict(line),
                    "start": line.start or None,
                    "events": [
                        {**asdict(e), "what": list(e.what), "of": e.of or None} for e in line.events
                    ],
                }
                for line in self.lines
            ],
        }


def progress(report: Report, outcome: Outcome | None, kg: Kg) -> Progress:
    """Return the progress lines of the things that a plan touches, from the deltas of its steps.

    `kg` holds the state before the plan. Without an `outcome` the changes are those of the
    rehearsal; a step that could not be taken has none.
    """
    deltas = report.deltas if outcome is None else outcome.deltas
    trace = _Trace(kg, kg.domain.moved)
    taken: list[tuple[int, str]] = []
    steps = zip(report.steps, report.grounded, deltas, strict=False)
    for number, (step, ground, delta) in enumerate(steps, start=1):
        if ground is not None and step.status != "finding":
            taken.append((number, f"{step.call.action}({', '.join(step.call.args)})"))
            trace.step(number, ground, delta)
    stopped = outcome.error.message if outcome is not None and outcome.error else ""
    if outcome is None and report.blocking:
        stopped = report.blocking[0].message
    return Progress(
        report.task.name.replace("_", " "),
        kg.domain.name,
        tuple(taken),
        trace.lines(report.task.required),
        outcome is not None,
        stopped,
        frozenset(kg.name(hand) for hand in trace.hands),
    )


@dataclass(slots=True)
class _Trace:
    """The lines so far: where each thing is, and its events."""

    kg: Kg
    locations: frozenset[URIRef]
    hands: set[Node] = field(default_factory=set)
    places: dict[Node, Node] = field(default_factory=dict)
    events: dict[Node, list[Event]] = field(default_factory=dict)
    starts: dict[Node, Node] = field(default_factory=dict)
    met: dict[Node, set[Node]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for prop in self.kg.domain.locations:
            found = {s: o for s, _, o in self.kg.facts.triples((None, prop, None))}
            self.starts |= found
            self.places |= found if prop in self.locations else {}

    def step(self, number: int, ground: GroundAction, delta: Delta) -> None:
        """Follow one step."""
        moves = self._moves(delta)
        before = dict(self.places)
        for thing, place in moves.items():
            self._note(number, thing, "place", (place,))
            self.places[thing] = place
        self._contents(number, moves, before)
        self._together(number, moves)
        self._states(number, delta)
        self._used(number, ground)

    def _moves(self, delta: Delta) -> dict[Node, Node]:
        """Note where things have moved: to a place, or to the robot that holds them."""
        agent = self.kg.domain.agent
        added = sorted(delta.added)
        moves = {s: o for s, p, o in added if p in self.locations}
        held = [
            o for s, p, o in added if s == agent and isinstance(o, URIRef) and self.kg.can_move(o)
        ]
        for thing in held:
            self.hands.add(moves.setdefault(thing, agent))
        return moves

    def _contents(
        self, number: int, moves: Mapping[Node, Node], before: Mapping[Node, Node]
    ) -> None:
        """Note what each place gained and lost, and what was carried inside of another thing."""
        left: dict[Node, list[Node]] = {}
        came: dict[Node, list[Node]] = {}
        for thing, place in moves.items():
            came.setdefault(place, []).append(thing)
            if thing in before:
                left.setdefault(before[thing], []).append(thing)
        for place, things in came.items():
            self._note(number, place, "gained", things)
        for place, things in left.items():
            self._note(number, place, "lost", things)
        for vessel, place in moves.items():
            for thing in self._inside(vessel):
                if thing not in moves and place not in self.hands:
                    self._note(number, thing, "carried", (place,), vessel)

    def _together(self, number: int, moves: Mapping[Node, Node]) -> None:
        """Note which things are together from now on, in a vessel that can be moved."""
        joined: dict[Node, list[Node]] = {}
        for thing, place in moves.items():
            if place in self.hands or not self.kg.can_move(place):
                continue
            met = self.met.setdefault(thing, set())
            new = [other for other in self._inside(place) if other != thing and other not in met]
            met.update(new)
            if new:
                self._note(number, thing, "with", new)
            for other in new:
                if other not in moves:
                    joined.setdefault(other, []).append(thing)
        for thing, others in joined.items():
            self.met.setdefault(thing, set()).update(others)
            self._note(number, thing, "with", others)

    def _states(self, number: int, delta: Delta) -> None:
        states: dict[Node, list[str]] = {}
        for triple in sorted(delta.added):
            if triple[0] != self.kg.domain.agent and triple[1] not in self.locations:
                states.setdefault(triple[0], []).append(self._state(triple))
        for thing, lines in states.items():
            self._add(thing, Event(number, "state", tuple(lines)))
            for inside in self._inside(thing):
                self._add(inside, Event(number, "state", tuple(lines), self.kg.name(thing)))

    def _state(self, triple: Triple) -> str:
        label, value = self.kg.domain.label(triple[1]), triple[2]
        if isinstance(value, Value) and isinstance(value.value, bool):
            return label if value.value else f"no longer {label}"
        return f"{label}: {self.kg.name(value) if isinstance(value, URIRef) else value}"

    def _used(self, number: int, ground: GroundAction) -> None:
        for thing in dict.fromkeys(ground.values.values()):
            shown = any(event.step == number for event in self.events.get(thing, ()))
            if isinstance(thing, URIRef) and not shown and self.kg.can_move(thing):
                self._add(thing, Event(number, "used", (ground.action.name,)))

    def _inside(self, place: Node) -> list[Node]:
        found = (thing for thing, where in self.places.items() if where == place)
        return sorted(found, key=str)

    def _note(
        self,
        number: int,
        thing: Node,
        kind: ItemClass,
        what: Sequence[Node],
        of: Node | None = None,
    ) -> None:
        names = tuple(self.kg.name(node) for node in what)
        self._add(thing, Event(number, kind, names, self.kg.name(of) if of is not None else ""))

    def _add(self, thing: Node, event: Event) -> None:
        self.events.setdefault(thing, []).append(event)

    def lines(self, required: Sequence[str]) -> tuple[ProgressLine, ...]:
        """The lines of all things that moved, changed or were used; the required ones first."""
        wanted = {normal(name) for name in required}
        aside = {*self.hands, self.kg.domain.agent}
        things = [t for t in self.events if t not in aside and self._matters(t, wanted)]
        made = [(self._rank(thing, wanted), self._line(thing, wanted)) for thing in things]
        return tuple(line for _, line in sorted(made, key=lambda pair: pair[0]))

    def _matters(self, thing: Node, wanted: set[str]) -> bool:
        """Whether a thing is more than a place that other things move through."""
        own = [e for e in self.events[thing] if e.kind not in ("gained", "lost")]
        return bool(own) or self.kg.can_move(thing) or normal(self.kg.name(thing)) in wanted

    def _rank(self, thing: Node, wanted: set[str]) -> tuple[object, ...]:
        kinds = [k for k in self.kg.domain.teachable if k.iri in self.kg.classes(thing)]
        order = kinds[0].order if kinds else 99
        name = self.kg.name(thing)
        return (normal(name) not in wanted, order, self.events[thing][0].step, name)

    def _line(self, thing: Node, wanted: set[str]) -> ProgressLine:
        name, start = self.kg.name(thing), self.starts.get(thing)
        place = self.kg.name(start) if start is not None else ""
        kind = self.kg.kind_label(thing)
        return ProgressLine(name, kind, normal(name) in wanted, place, tuple(self.events[thing]))
