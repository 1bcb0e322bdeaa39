"""The plan tried on the graph, step by step: conditions, missing steps, effects (DESIGN, 5)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, Condition, Parameter
from adaptbot_cli.core.kg import Bindings, Kg
from adaptbot_cli.core.report import Bound
from adaptbot_cli.core.static import attribute_findings

LONGEST_REPAIR = 6
"""How many missing steps are inserted for one condition at most."""

MOST_ROWS = 3
"""With how many of the things that a goal or condition is about a repair is tried at most."""

MOST_TRIES = 600
"""How many actions are tried for one repair at most, so that a check always ends soon."""


@dataclass(frozen=True, slots=True)
class Aim:
    """Something that should hold: a test on the graph, and what it speaks about."""

    holds: Callable[[], bool]
    predicates: frozenset[URIRef]
    values: Bindings


def values_of(bound: Bound, kg: Kg) -> dict[str, Node]:
    """Return what the variables of an action's queries stand for, the robot included.

    Parameters that the plan leaves out get their defaults from the state at this point.
    """
    values: dict[str, Node] = {"agent": kg.domain.agent, **bound.values}
    for parameter in bound.action.parameters:
        if parameter.default and parameter.name not in values:
            value = kg.first(parameter.default, parameter.name, values)
            if value is not None:
                values[parameter.name] = value
    return values


def complete(bound: Bound, kg: Kg) -> Bound:
    """Return the action with its defaults filled in."""
    values = values_of(bound, kg)
    names = {p.name for p in bound.action.parameters}
    return Bound(bound.action, {n: v for n, v in values.items() if n in names})


def holds(condition: Condition, bound: Bound, kg: Kg) -> bool:
    """Tell whether a condition of an action holds now."""
    return kg.ask(condition.query, {"agent": kg.domain.agent, **bound.values})


def all_hold(bound: Bound, kg: Kg) -> bool:
    """Tell whether every condition of an action holds now."""
    return all(holds(condition, bound, kg) for condition in bound.action.conditions)


def aim_of(condition: Condition, bound: Bound, kg: Kg) -> Aim:
    """Return a condition as something to aim for."""
    return Aim(lambda: holds(condition, bound, kg), condition.predicates, bound.values)


def perform(bound: Bound, kg: Kg) -> None:
    """Apply an action's effect."""
    values = {"agent": kg.domain.agent, **bound.values}
    kg.apply(kg.delta(bound.action.effect, values))


@dataclass(slots=True)
class Repair:
    """A bounded backward search for missing steps: the actions whose effects achieve an aim.

    Shortest first; among equals the domain's order of actions decides. What a successful search
    finds is already applied to the graph. The action `without` is not made use of. With `together`
    several actions may bring the aim about that none does alone: something is put in, then heated.
    With `supposing` an attribute that is not known is taken to be as an action needs it. What is to
    be used `rather` than another thing is tried first, before what an action would use by itself;
    a thing that `bars` holds of is not used at all.
    """

    kg: Kg
    without: str = ""
    together: bool = False
    supposing: bool = False
    rather: frozenset[Node] = frozenset()
    bars: Callable[[Node], bool] | None = None
    tries: int = 0
    trail: list[tuple[str, tuple[tuple[str, Node], ...]]] = field(default_factory=list)

    def achieve(self, aim: Aim) -> list[Bound] | None:
        """Return the steps that make an aim hold, or None if few enough cannot."""
        for limit in range(1, LONGEST_REPAIR + 1):
            steps = self.within(aim, limit)
            if steps is not None:
                return steps
        return None

    def within(self, aim: Aim, limit: int) -> list[Bound] | None:
        """Return steps that make an aim hold, the first found of `limit` or fewer, or None."""
        for bound in self._candidates(aim) if limit > 0 else ():
            mark = self.kg.mark
            steps = self._step(bound, limit - 1, aim)
            if steps is not None and aim.holds():
                return steps
            if steps and self.together and self.kg.last_change():
                rest = self.within(aim, limit - len(steps))
                if rest is not None:
                    return [*steps, *rest]
            self.kg.undo_to(mark)
        return None

    def _step(self, bound: Bound, limit: int, aim: Aim) -> list[Bound] | None:
        """Do one action, with what it needs first, within `limit` more steps."""
        key = (bound.action.name, tuple(sorted(bound.values.items())))
        if key in self.trail or self.tries >= MOST_TRIES or self._ruled_out(bound):
            return None
        self.tries += 1
        self.trail.append(key)
        before = self.prepare(bound, limit)
        self.trail.pop()
        if before is None:
            return None
        perform(bound, self.kg)
        return [*before, bound] if self._changes_only(bound, aim) else None

    def _ruled_out(self, bound: Bound) -> bool:
        if self.bars is not None and any(map(self.bars, bound.values.values())):
            return True
        found = attribute_findings(bound, self.kg)
        return any(f.code != "E301" for f in found) if self.supposing else bool(found)

    def _changes_only(self, bound: Bound, aim: Aim) -> bool:
        """Whether the last action changed nothing but what it was done to, and what it was done
        for: a missing step must not pour out what else a vessel holds."""
        about = {*bound.values.values(), *aim.values.values(), self.kg.domain.agent}
        return all(subject in about for subject, _, _ in self.kg.last_change())

    def prepare(self, bound: Bound, limit: int) -> list[Bound] | None:
        """Make all conditions of an action hold, within `limit` steps; None if that fails."""
        steps: list[Bound] = []
        for condition in bound.action.conditions:
            if holds(condition, bound, self.kg):
                continue
            part = self.within(aim_of(condition, bound, self.kg), limit - len(steps))
            if part is None:
                return None
            steps += part
        return steps if all_hold(bound, self.kg) else None

    def _candidates(self, aim: Aim) -> Iterator[Bound]:
        pool = self._pool(aim)
        for action in self.kg.domain.actions.values():
            effect = action.effect if action.name != self.without else None
            if effect is not None and effect.predicates & aim.predicates:
                yield from self._grounded(action, pool)

    def _pool(self, aim: Aim) -> list[Node]:
        """The things that an aim is about: its own, and what they are now related to by it."""
        pool: list[Node] = [value for value in aim.values.values() if isinstance(value, URIRef)]
        about: list[Node] = [*pool, self.kg.domain.agent]
        for predicate in sorted(aim.predicates):
            for thing in about:
                pool += sorted(self.kg.facts.objects(thing, predicate), key=str)
        return list(dict.fromkeys(node for node in pool if isinstance(node, URIRef)))

    def _grounded(self, action: Action, pool: list[Node]) -> Iterator[Bound]:
        options = [self._options(parameter, pool) for parameter in action.parameters]
        for chosen in product(*options):
            given = zip(action.parameters, chosen, strict=True)
            values = {p.name: node for p, node in given if node is not None}
            bound = complete(Bound(action, values), self.kg)
            if all(p.optional or p.name in bound.values for p in action.parameters):
                yield bound

    def _options(self, parameter: Parameter, pool: list[Node]) -> list[Node | None]:
        """What a parameter may stand for; None leaves it to its default."""
        if parameter.datatype is not None:
            return [*dict.fromkeys(parameter.words.values())] or [Literal(0)]
        fitting: list[Node | None] = [n for n in pool if self.kg.is_a(n, parameter.classes)]
        left_out: list[Node | None] = [None] if parameter.default or parameter.optional else []
        first = [node for node in fitting if node in self.rather]
        return [*dict.fromkeys([*first, *left_out, *fitting])]
