"""Actions tried on the graph, and the one search for steps that are missing (DESIGN, M4)."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice, product
from typing import Any

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, Condition, Parameter
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.kg import Bindings, Kg
from adaptbot_cli.core.graph.robots import held_by_another
from adaptbot_cli.core.graph.sparql import mentions, ruled_out
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.refine.grounding import attribute_findings
from adaptbot_cli.core.report import GroundAction

LONGEST_REPAIR = 6
"""How many missing steps are inserted for one need at most."""

MOST_ROWS = 3
"""With how many of the things that a goal or condition is about a repair is tried at most."""

MOST_DEFAULTS = 5
"""With how many choices of defaults one step is tried at most."""

MOST_TRIES = 2_000
"""How many actions one search performs at most, so that a check always ends."""

MOST_IN_ALL = 2_000
"""How many actions are performed at most by the searches from all places of a plan for steps that
bring one goal about. One for more steps may find at once what one for fewer cannot."""

MOST_TO_KEEP = 100
"""How many actions are tried to find a way that undoes nothing, at most."""

MOST_OF_A_PLAN = 10_000
"""How many actions the repairs of one plan try at most; each one after that tries a hundred."""

Key = tuple[str, tuple[tuple[str, Node], ...]]


@dataclass(frozen=True, slots=True)
class Aim:
    """Something that should hold: a test on the graph, its predicates, the things it is about."""

    holds: Callable[[], bool]
    predicates: frozenset[URIRef]
    values: Bindings


def aim(kg: Kg, query: str, bindings: Bindings, about: Bindings | None = None) -> Aim:
    """Return the aim that an ASK holds with some variables bound.

    It is about `about`, else about what is bound, and about the things that the query names.
    """
    given = {"agent": kg.domain.agent, **bindings}
    named = mentions(query) - ruled_out(query)
    things = {str(iri): iri for iri in sorted(named) if kg.classes(iri)}
    values = {**(bindings if about is None else about), **things}
    return Aim(lambda: kg.ask(query, given), mentions(query), values)


def fact_aim(kg: Kg, fact: Triple) -> Aim:
    """Return the aim that a fact holds."""
    subject, predicate, value = fact
    about = {"subject": subject, "value": value}
    return Aim(
        lambda: value in kg.objects(subject, predicate), frozenset({URIRef(str(predicate))}), about
    )


def readings(ground: GroundAction, kg: Kg) -> Iterator[GroundAction]:
    """Give an action with the defaults of its missing parameters, those of the first rows first."""
    missing = [p for p in ground.action.parameters if p.default and p.name not in ground.values]

    def fill(values: dict[str, Node], left: list[Parameter]) -> Iterator[dict[str, Node]]:
        if not left:
            yield values
            return
        given = {"agent": kg.domain.agent, **values}
        found = kg.values(left[0].default, left[0].name, given)
        free = [value for value in found if not held_by_another(kg, value)]
        for value in free or found or (None,):
            yield from fill(values if value is None else {**values, left[0].name: value}, left[1:])

    for values in fill(dict(ground.values), missing):
        yield GroundAction(ground.action, values)


def complete(ground: GroundAction, kg: Kg) -> GroundAction:
    """Return an action with its defaults filled in from the state at this point."""
    return next(readings(ground, kg))


def holds(condition: Condition, ground: GroundAction, kg: Kg) -> bool:
    """Tell whether a condition of an action holds now."""
    return kg.ask(condition.query, {"agent": kg.domain.agent, **ground.values})


def all_hold(ground: GroundAction, kg: Kg) -> bool:
    """Tell whether every condition of an action holds now."""
    return all(holds(condition, ground, kg) for condition in ground.action.conditions)


def needs_of(ground: GroundAction, kg: Kg) -> list[Aim]:
    """Return the conditions of an action as aims."""
    return [
        Aim(lambda c=c: holds(c, ground, kg), c.predicates, ground.values)  # type: ignore[misc]
        for c in ground.action.conditions
    ]


def change_of(ground: GroundAction, kg: Kg) -> Delta:
    """Return what an action would change now."""
    return kg.delta(ground.action.effect, {"agent": kg.domain.agent, **ground.values})


def perform(ground: GroundAction, kg: Kg) -> None:
    """Apply an action's effect."""
    kg.apply(change_of(ground, kg))


def key_of(ground: GroundAction) -> Key:
    """Return what makes two ground actions the same."""
    return ground.action.name, tuple(sorted(ground.values.items()))


def barred(ground: GroundAction, bars: Callable[[Node], bool] | None) -> bool:
    """Tell whether an action uses something that `bars` holds of."""
    return bars is not None and any(map(bars, ground.values.values()))


def is_done(ground: GroundAction, kg: Kg) -> bool:
    """Tell whether what an action brings about is so already."""
    effect = ground.action.effect
    return bool(effect and effect.inserts and not change_of(ground, kg))


@dataclass(slots=True)
class Search:
    """The search for the fewest steps that make aims hold, all of them at the end.

    It goes from an aim to the actions whose effects touch its predicates, grounds them in the
    things that the aim is about, and looks for what they need in the same way. Steps that fulfil an
    aim by themselves are tried first, else the domain's order decides. What it finds is applied to
    the graph. `without` is an action that is not made use of; what is to be used `rather` than
    another thing is tried first. With `supposing` an unknown attribute is taken to be as a step
    needs it. `kept` are facts that steps must not take away by the way: they are restored, or
    another way is taken. With `freely` steps may change more than what they are done to, and
    several may bring an aim about that none does alone.
    If it is `yielding`, they are given up where nothing else helps: those are `undone`.
    A thing that `bars` holds of is not used. No search performs more than `most` actions, and all
    searches of one object no more than are `left`.
    `supposes` tells whether unknown attributes made a difference, `gave_up` whether the last search
    ended at the limit of tries.
    """

    kg: Kg
    without: str = ""
    rather: frozenset[Node] = frozenset()
    bars: Callable[[Node], bool] | None = None
    supposing: bool = False
    freely: bool = False
    kept: frozenset[Triple] = frozenset()
    longest: int = LONGEST_REPAIR
    most: int = MOST_TRIES
    left: float = float("inf")
    yielding: bool = False
    undone: list[Triple] = field(default_factory=list)
    supposes: bool = False
    gave_up: bool = False
    tries: int = 0
    _cut: bool = False
    _start: int = 0
    _trail: list[Key] = field(default_factory=list)
    _ruled_out: dict[tuple[int, Key], bool] = field(default_factory=dict)

    def achieve(self, *aims: Aim) -> list[GroundAction] | None:
        """Return the steps that make all aims hold, or None if few enough cannot."""
        self.gave_up = False
        for freely in (False, True) if not self.freely else (True,):
            found = self._deepen(aims, freely)
            if found is not None:
                return found
        return None

    def _deepen(self, aims: tuple[Aim, ...], freely: bool) -> list[GroundAction] | None:
        free, self.freely = self.freely, freely
        self.tries, self._start = 0, self.kg.mark
        try:
            for limit in range(1, self.longest + 1):
                self._cut = False
                steps = self._within(aims, limit, top=True)
                if steps is not None or not self._cut:
                    return steps
                if self._is_spent():
                    self.gave_up = True
                    return None
            return None
        finally:
            self.freely = free

    def _within(
        self, aims: tuple[Aim, ...], limit: int, top: bool = False
    ) -> list[GroundAction] | None:
        """Return steps that make all aims hold, the first found of `limit` or fewer, or None."""
        open_ = [aim for aim in aims if not aim.holds()]
        if not open_ and top:
            self.undone = self._lost(aims) if self.kept else []
            open_ = [] if self.yielding else [fact_aim(self.kg, fact) for fact in self.undone]
        if not open_:
            return []
        if limit <= 0:
            self._cut = True
            return None
        for ground in self._candidates(open_):
            if self._is_spent():
                return None
            mark = self.kg.mark
            steps = self._step(ground, limit - 1, open_)
            brings = steps and any(aim.holds() for aim in open_)
            if steps and (brings or (self.freely and self.kg.last_change())):
                rest = self._within(aims, limit - len(steps), top)
                if rest is not None:
                    return [*steps, *rest]
            self.kg.undo_to(mark)
        return None

    def _is_spent(self) -> bool:
        return self.tries >= self.most or self.left <= 0

    def _lost(self, aims: Iterable[Aim]) -> list[Triple]:
        """What was to be kept and is gone, though the aims would hold with it as well."""
        changed = net(self.kg.changes(self._start))
        found = sorted(changed.removed & self.kept)
        lost = []
        for fact in found:
            mark = self.kg.mark
            self.kg.apply(self.kg.with_fact(fact, changed.added))
            if all(aim.holds() for aim in aims):
                lost.append(fact)
            self.kg.undo_to(mark)
        return lost

    def _step(self, ground: GroundAction, limit: int, aims: list[Aim]) -> list[GroundAction] | None:
        """Do one action, with what it needs first, within `limit` more steps."""
        key = key_of(ground)
        if key in self._trail or self._excluded(key, ground):
            return None
        self.tries += 1
        self.left -= 1
        self._trail.append(key)
        before = self._within(tuple(needs_of(ground, self.kg)), limit)
        self._trail.pop()
        if before is None:
            return None
        perform(ground, self.kg)
        return [*before, ground] if self.freely or self._changes_only(ground, aims) else None

    def _excluded(self, key: Key, ground: GroundAction) -> bool:
        """Whether a step is ruled out: a longer search asks that again of every shorter one."""
        asked = (self.kg.state, key)
        if asked not in self._ruled_out:
            self._ruled_out[asked] = barred(ground, self.bars) or self._unfit(ground)
        return self._ruled_out[asked]

    def _unfit(self, ground: GroundAction) -> bool:
        """Whether attributes rule a step out; an unknown one does not while it is supposed."""
        codes = {finding.code for finding in attribute_findings(ground, self.kg)}
        self.supposes |= "E301" in codes
        return bool(codes - {"E301"} if self.supposing else codes)

    def _changes_only(self, ground: GroundAction, aims: list[Aim]) -> bool:
        """Whether the last action changed nothing but what it was done to, and what it was done
        for: a missing step must not pour out what else a vessel holds."""
        about = {self.kg.domain.agent, *ground.values.values()}
        about |= {value for aim in aims for value in aim.values.values()}
        return all(subject in about for subject, _, _ in self.kg.last_change())

    def _candidates(self, aims: list[Aim]) -> Iterator[GroundAction]:
        """Give the actions that may bring one of the aims about, first those that would do so at
        once if they could be done."""
        later = []
        for aim in aims:
            pool = self._pool(aim)
            things = frozenset((*pool, self.kg.domain.agent))
            for action in self.kg.index.touching(aim.predicates, things):
                if action.name == self.without:
                    continue
                for ground in self._grounded(action, pool):
                    if self._would_bring(ground, aim):
                        yield ground
                    else:
                        later.append(ground)
        yield from later

    def _would_bring(self, ground: GroundAction, aim: Aim) -> bool:
        mark = self.kg.mark
        perform(ground, self.kg)
        try:
            return aim.holds()
        finally:
            self.kg.undo_to(mark)

    def _pool(self, aim: Aim) -> list[Node]:
        """The things that an aim is about: its own, and what they are now related to by it."""
        pool: list[Node] = [value for value in aim.values.values() if isinstance(value, URIRef)]
        about: list[Node] = [*pool, self.kg.domain.agent]
        for predicate in sorted(aim.predicates):
            for thing in about:
                pool += self.kg.objects(thing, predicate)
        return list(dict.fromkeys(node for node in pool if isinstance(node, URIRef)))

    def _grounded(self, action: Action, pool: list[Node]) -> Iterator[GroundAction]:
        options = [self._options(parameter, pool) for parameter in action.parameters]
        seen = set()
        for chosen in product(*options):
            given = zip(action.parameters, chosen, strict=True)
            values = {p.name: node for p, node in given if node is not None}
            for ground in islice(readings(GroundAction(action, values), self.kg), MOST_DEFAULTS):
                whole = all(p.optional or p.name in ground.values for p in action.parameters)
                if whole and key_of(ground) not in seen:
                    seen.add(key_of(ground))
                    yield ground

    def _options(self, parameter: Parameter, pool: list[Node]) -> list[Any]:
        """What a parameter may stand for; None leaves it to its default."""
        if parameter.datatype is not None:
            return [*dict.fromkeys(parameter.words.values())] or [Literal(0)]
        fitting = [node for node in pool if self.kg.is_a(node, parameter.classes)]
        left_out = [None] if parameter.default or parameter.optional else []
        first = [node for node in fitting if node in self.rather]
        return [*dict.fromkeys([*first, *left_out, *fitting])]
