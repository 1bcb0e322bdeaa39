"""What a world reports about a step, and how it changes the belief."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from decimal import Decimal

from rdflib import Literal, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, Domain
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import STATES, Triple, local
from adaptbot_cli.core.graph.validate import new_faults
from adaptbot_cli.core.plan import Step
from adaptbot_cli.core.report import GroundAction

STOPPED, REFUSED, LOST = "stopped", "refused", "lost"
"""Why nothing more is done in a world: the person pressed Ctrl-C or did not agree to a step, or the
world does not answer."""

Named = tuple[str, str, str | bool | int | float]
"""A fact as local names: subject, property, and object or value."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What a world answers.

    `failed` is why a step was not done, "" if it was; `observed` are facts that hold now, `gone`
    facts that do not. `odd` has what was left out of the reply because it made no sense. `over` is
    `STOPPED` or `LOST` where nothing more can be done in this world, else "".
    `goal` is whether the world says that what was asked for is so, None if it does not say.
    """

    failed: str = ""
    observed: frozenset[Triple] = frozenset()
    gone: frozenset[Triple] = frozenset()
    odd: tuple[str, ...] = ()
    over: str = ""
    goal: bool | None = None


@dataclass(frozen=True, slots=True)
class Acted:
    """A step that was tried in the world.

    `delta` is what it changed in what is believed, `surprise` the part that was not expected;
    `failed` why it was not done; `standing` is what had changed since the robot began, so that the
    same step from the same standing has been tried before.
    """

    step: Step
    ground: GroundAction
    delta: Delta = field(default=Delta())
    surprise: Delta = field(default=Delta())
    failed: str = ""
    standing: Delta = field(default=Delta())


def named(fact: Triple, kg: Kg) -> Named:
    """Return a fact by the home's own names."""
    subject, predicate, value = fact
    return kg.name(subject), local(predicate), plain(value, kg)


def plain(node: Node, kg: Kg) -> str | bool | int | float:
    """Return a thing's name, or a value as JSON has it."""
    value = node.toPython() if isinstance(node, Literal) else kg.name(node)
    if isinstance(value, Decimal):
        return int(value) if value == int(value) else float(value)
    return value if isinstance(value, bool | int | float) else str(value)


def fact_of(reply: object, kg: Kg) -> Triple:
    """Return the fact that three names stand for.

    Raises:
        ValueError: it is none, or names what this home does not know; the message says what.
    """
    if not isinstance(reply, list | tuple) or len(reply) != 3:
        raise ValueError("a fact has three parts: thing, property and value")
    subject, predicate, value = reply
    found = [p for p in kg.domain.properties.values() if predicate in (local(p.iri), p.label)]
    prop = next((p for p in found if predicate == local(p.iri)), None) or next(iter(found), None)
    if prop is None:
        raise ValueError(f'there is no property "{str(predicate)[:60]}"')
    thing = _thing(subject, kg)
    if prop.range in kg.domain.classes:
        return thing, prop.iri, _thing(value, kg)
    term = Literal(value) if isinstance(value, bool) else Literal(str(value), datatype=prop.range)
    if term.ill_typed or term.datatype != prop.range:
        raise ValueError(f'"{str(value)[:60]}" is no value of {local(prop.iri)}')
    return thing, prop.iri, term


def _thing(name: object, kg: Kg) -> URIRef:
    robots = [robot for robot in kg.robots if kg.name(robot) == name]
    found = robots or (kg.find(name) if isinstance(name, str) else ())
    if not found:
        raise ValueError(f'there is no "{str(name)[:60]}" in this home')
    return found[0]


def believe(kg: Kg, expected: Delta, seen: Seen) -> tuple[Delta, Delta]:
    """Apply what was done and observed to the graph; return the delta, and its unexpected part.

    What is observed goes before what was expected. Only the state graph changes: what a thing is
    like is for a person to say.
    """
    whole, surprise = _change(kg, expected, seen)
    kg.apply(whole)
    return whole, surprise


def possible(kg: Kg, expected: Delta, seen: Seen) -> tuple[Seen, tuple[str, ...]]:
    """Return what is seen without the facts that the domain does not allow, and what is wrong
    with those, in sentences."""
    wrong: list[str] = []
    while True:
        found = new_faults(kg, _change(kg, expected, seen)[0])
        of_seen = [fault for fault in found if fault.facts & seen.observed]
        if not of_seen:
            return seen, tuple(wrong)
        wrong += [fault.message for fault in of_seen]
        bad = frozenset().union(*(fault.facts for fault in of_seen))
        seen = replace(seen, observed=seen.observed - bad)


def _change(kg: Kg, expected: Delta, seen: Seen) -> tuple[Delta, Delta]:
    """The delta that believing all this would make, and its unexpected part."""
    with kg.rehearsal():
        start = kg.mark
        kg.apply(expected)
        expected_only = kg.mark
        for fact in sorted(_states(kg, seen.gone)):
            if fact in kg.facts:
                kg.apply(Delta(removed=frozenset({fact})))
        for fact in sorted(_states(kg, seen.observed)):
            if fact not in kg.facts:
                kg.apply(kg.with_fact(fact, kg.facts.triples((fact[0], fact[1], None))))
        return net(kg.changes(start)), net(kg.changes(expected_only))


def _states(kg: Kg, facts: Iterable[Triple]) -> frozenset[Triple]:
    return frozenset(fact for fact in facts if kg.home_of(fact[1]) == STATES)


def is_irreversible(action: Action, domain: Domain) -> bool:
    """Tell whether no action of the domain restores what an action removes or changes.

    It follows from the effects: what is sliced stays sliced, what is switched on can be switched
    off. A domain says otherwise with `ab:irreversible`.
    """
    if action.irreversible is not None:
        return action.irreversible
    if action.effect is None:
        return False
    effects = [other.effect for other in domain.actions.values() if other.effect]
    brought = [triple for effect in effects for triple in effect.inserts]

    def replaced(made: Triple) -> bool:
        """Whether an action can replace or remove what this one adds."""
        goes = (e for e in effects if any(_may_be(made, t, made[2]) for t in e.deletes))
        return any(_may_be(made, t, None) for t in brought) or any(
            not any(_may_be(made, t, made[2]) for t in e.inserts) for e in goes
        )

    def restored(taken: Triple) -> bool:
        return any(_may_be(taken, triple, taken[2]) for triple in brought)

    return not (
        all(map(replaced, action.effect.inserts)) and all(map(restored, action.effect.deletes))
    )


def _may_be(one: Triple, other: Triple, value: Node | None) -> bool:
    """Whether a triple of a template may be of the same property, with a value, or, for None, with
    another one than it has itself. A variable may be anything."""
    if one[1] != other[1]:
        return False
    if isinstance(one[2], Variable) or isinstance(other[2], Variable):
        return True
    return other[2] != one[2] if value is None else other[2] == value


def sentences(surprise: Delta, kg: Kg, about: Collection[Node] = ()) -> list[str]:
    """Describe a surprise: one sentence for each property of a thing.

    With `about` only what concerns some things is described.
    """
    before = {(s, p): o for s, p, o in sorted(surprise.removed) if not about or s in about}
    found = []
    for subject, predicate, value in sorted(surprise.added):
        if about and subject not in about:
            continue
        old = before.pop((subject, predicate), None)
        instead = f", not {kg.name(old)}" if old is not None else ""
        found.append(f"{kg.name(subject)}: {kg.domain.label(predicate)} {kg.name(value)}{instead}")
    for (subject, predicate), value in before.items():
        found.append(f"{kg.name(subject)}: {kg.domain.label(predicate)} is not {kg.name(value)}")
    return found
