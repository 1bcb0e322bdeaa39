"""A simulated home: a truth that the knowledge graph may not have right, in Turtle."""

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

from rdflib import RDF, RDFS, BNode, URIRef
from rdflib.term import Node

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, ATTRIBUTES, STATES, Triple, local
from adaptbot_cli.core.graph.validate import new_faults
from adaptbot_cli.core.refine.goals import check_goal
from adaptbot_cli.core.refine.grounding import attribute_findings, sentence
from adaptbot_cli.core.refine.repair import holds, perform
from adaptbot_cli.core.report import GroundAction
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Act, Begin, Stop
from adaptbot_cli.core.world import Seen
from adaptbot_cli.errors import WorldError

MOST_TOLD = 5
"""How many mistakes of a file are reported."""

WHOLE = 0.5
"""The share of the home's things from which on a file with their places, or with their classes, is
taken for the whole home: what it does not name is not there."""


def truth_of(kg: Kg, facts: list[Triple]) -> tuple[Kg, str]:
    """Return the home as it really is, and in words how a file's facts were taken.

    Each of the two graphs is taken whole where the file covers it; else its facts are laid over
    what is believed.
    """
    inside: dict[URIRef, set[Triple]] = {ATTRIBUTES: set(), STATES: set()}
    for fact in facts:
        if fact[1] in kg.domain.properties or fact[1] == RDF.type:
            inside[kg.home_of(fact[1])].add(fact)
    lines: list[str] = []
    graphs: dict[URIRef, set[Triple]] = {}
    for name, predicates, label in (
        (ATTRIBUTES, {RDF.type}, "what things are"),
        (STATES, {*kg.domain.locations}, "where things are"),
    ):
        known = set(kg.graph(name))
        subjects = {s for s, p, _ in known if p in predicates}
        given = {s for s, p, _ in inside[name] if p in predicates}
        whole = bool(subjects) and len(given & subjects) >= WHOLE * len(subjects)
        graphs[name] = inside[name] if whole else _laid_over(kg, known, inside[name])
        lines += [f"{label} is all from this file"] if whole else []
    absent = {str(o) for _, p, o in facts if p == AB.absentItem}
    gone = {entity for name in absent for entity in kg.find(name)}
    for name, known in graphs.items():
        graphs[name] = {fact for fact in known if not gone & {fact[0], fact[2]}}
    how = "; ".join(lines) or f"{sum(map(len, inside.values()))} facts laid over what is believed"
    return Kg.load(kg.domain, graphs[ATTRIBUTES], graphs[STATES]), how


def _laid_over(kg: Kg, known: set[Triple], given: set[Triple]) -> set[Triple]:
    """Facts with others laid over them: a property that has one value is replaced."""
    single = {iri for iri, prop in kg.domain.properties.items() if prop.functional}
    replaced = {(s, p) for s, p, _ in given if p in single}
    return {fact for fact in known if fact[:2] not in replaced} | given


@dataclass(slots=True)
class SimulatedHome:
    """A world that is a graph of its own. With probability `noise` a step slips and does nothing.

    `kg` is what is believed, `truth` what is so: conditions and effects are the domain's, evaluated
    on the truth. `how` describes how its file was taken. What is where the robot looks is seen:
    the things that the step is about, and all that is at the place where it stands.
    """

    kg: Kg
    truth: Kg
    path: str
    noise: float = 0.0
    seed: int = 0
    slips: list[tuple[Node, str, int, str]] = field(default_factory=list)
    how: str = ""
    _same: dict[Node, Node] = field(default_factory=dict, init=False)
    _chance: random.Random = field(init=False)

    def __post_init__(self) -> None:
        self._chance = random.Random(f"{self.seed}")

    @classmethod
    def of(
        cls, kg: Kg, facts: list[Triple], path: str, noise: float = 0.0, seed: int = 0
    ) -> "SimulatedHome":
        """Return the home that a file of facts describes.

        Raises:
            WorldError: a fact makes no sense in this home.
        """
        truth, how = truth_of(kg, facts)
        wrong = [*_mistakes(kg, truth, facts), *_wrong_slips(kg, facts)]
        if wrong:
            more = f" (and {len(wrong) - MOST_TOLD} more)" if len(wrong) > MOST_TOLD else ""
            raise WorldError(f"{path} is no such home: {'; '.join(wrong[:MOST_TOLD])}{more}")
        return cls(kg, truth, path, noise, seed, list(_slips(facts)), how)

    @property
    def name(self) -> str:
        """How the world is called on the screen and in a transcript."""
        return self.path

    def begin(self, turn: Begin) -> Seen:
        """Look around where the robot stands."""
        return self._look(frozenset(), Delta())

    def act(self, turn: Act) -> Seen:
        """Try a step on the truth."""
        # What was taught has an IRI of its own.
        ground = replace(
            turn.ground, values={key: self._true(node) for key, node in turn.ground.values.items()}
        )
        why = self._why_not(ground)
        if not why:
            perform(ground, self.truth)
        about = frozenset(v for v in ground.values.values() if isinstance(v, URIRef))
        seen = self._look(about, Delta() if why else self._mapped(turn.expected, self._true))
        return Seen(why, seen.observed, seen.gone)

    def stop(self, turn: Stop) -> Seen:
        """Judge the goal on the truth."""
        unmet, _ = check_goal(Scene(self.truth, turn.task))
        return Seen("; ".join(finding.message for finding in unmet), goal=not unmet)

    def close(self) -> None:
        """Nothing is to be ended."""

    def _true(self, node: Node) -> Node:
        """The thing of the truth that something of the graph is, by its name."""
        if not isinstance(node, URIRef) or node in self._same or self.truth.classes(node):
            return self._same.get(node, node)
        found = self.truth.find(self.kg.name(node)) if self.kg.classes(node) else ()
        self._same[node] = found[0] if found else node
        return self._same[node]

    def _known(self, node: Node) -> Node:
        """The thing of the graph that something of the truth is."""
        return next((known for known, true in self._same.items() if true == node), node)

    def _mapped(self, delta: Delta, to: Callable[[Node], Node]) -> Delta:
        sides = (delta.removed, delta.added)
        return Delta(*(frozenset((to(s), p, to(o)) for s, p, o in facts) for facts in sides))

    def _why_not(self, ground: GroundAction) -> str:
        """Why a step fails in truth, "" if it does not."""
        for number, (thing, action, times, reason) in enumerate(self.slips):
            if times and action == ground.action.name and thing in ground.values.values():
                self.slips[number] = (thing, action, times - 1, reason)
                return reason
        things = [node for node in ground.values.values() if isinstance(node, URIRef)]
        for node in things:
            if not self.truth.classes(node):
                return f"there is no {self.kg.name(node)} here"
        for finding in attribute_findings(ground, self.truth):
            if finding.code != "E301":  # what is not known in the truth may be so
                return finding.message
        for node in things:
            known = self._known(node)
            kept, true = self._places(self.kg, known), self._places(self.truth, node)
            if (kept or true) and [self._true(place) for place in kept] != true:
                place = f"at {self.kg.name(kept[0])}" if kept else "there"
                return f"{self.kg.name(known)} is not {place}"
        for condition in ground.action.conditions:
            if not holds(condition, ground, self.truth):
                return sentence(condition.message, ground, self.truth)
        if self.noise and self._chance.random() < self.noise:
            return "it slipped"
        return ""

    def _places(self, kg: Kg, node: Node) -> list[Node]:
        return [place for p in kg.domain.locations for place in kg.objects(node, p)]

    def _look(self, about: frozenset[URIRef], expected: Delta) -> Seen:
        """What is seen of some things and of all that is where the robot stands, and is not as it
        is believed to be once what is `expected` has happened."""
        agent, locations = self.kg.domain.agent, self.kg.domain.locations
        true = frozenset(self.truth.graph(STATES))
        known = Delta(added=frozenset(self.kg.graph(STATES)))
        believed = self._mapped(known, self._true).added - expected.removed | expected.added
        stands = {o for s, _, o in true if s == agent and isinstance(o, URIRef)}
        kept = (self._places(self.kg, self._known(thing)) for thing in about)
        places = stands | about | {self._true(place) for each in kept for place in each}
        there = {s for s, p, o in true if p in locations and o in places}
        fixed = {place for place in places if not self._places(self.truth, place)}
        visible = there | fixed | {agent}
        # Where a thing is that is missed in its place is not known by that.
        gone = (
            f for f in believed - true if f[0] in visible or (f[1] in locations and f[2] in places)
        )
        observed = (
            (s, p, o)
            for s, p, o in true - believed
            if s in visible and (p not in locations or o in places) and self._is_known(s, o)
        )
        delta = self._mapped(Delta(frozenset(gone), frozenset(observed)), self._known)
        return Seen("", delta.added, delta.removed)

    def _is_known(self, *nodes: Node) -> bool:
        """Whether the graph has all of some things: others have no name in it."""
        things = (self._known(node) for node in nodes if isinstance(node, URIRef))
        return all(self.kg.classes(t) or t == self.kg.domain.agent for t in things)


def _mistakes(kg: Kg, truth: Kg, facts: list[Triple]) -> Iterator[str]:
    """The facts of a file that the domain does not know or allow, beside what is believed."""
    found = (RDF.type, *kg.domain.properties)
    for predicate in sorted({str(p) for s, p, _ in facts if not isinstance(s, BNode)}):
        if URIRef(predicate) not in found and not predicate.startswith((str(AB), str(RDFS))):
            yield f'there is no property "{local(URIRef(predicate))}"'
    known, true = (
        frozenset(fact for name in (ATTRIBUTES, STATES) for fact in graph.graph(name))
        for graph in (kg, truth)
    )
    for fault in new_faults(kg, Delta(known - true, true - known)):
        if fault.about is not None:  # a home may lack what the pack names
            yield fault.message


def _wrong_slips(kg: Kg, facts: list[Triple]) -> Iterator[str]:
    for thing, action, times, _ in _slips(facts):
        if action not in kg.domain.actions:
            yield f'{kg.name(thing)} cannot fail to "{action}": there is no such action'
        elif times < 1:
            yield f"how often {action} fails with {kg.name(thing)} must be a whole number from 1 on"


def _slips(facts: list[Triple]) -> Iterator[tuple[Node, str, int, str]]:
    """The steps that fail in this home: `ex:stove ab:fails [ab:action "switch"; ab:times 1]`."""
    record: dict[Node, dict[str, Node]] = {}
    for subject, predicate, value in facts:
        if isinstance(subject, BNode):
            record.setdefault(subject, {})[local(predicate)] = value
    for subject, predicate, value in sorted(facts):
        if predicate == AB.fails:
            parts = record.get(value, {})
            times = str(parts.get("times", "1"))
            reason = str(parts.get("reason", "it slipped"))
            action = str(parts.get("action", value))
            yield subject, action, int(times) if times.isdecimal() else 0, reason
