"""The record of what is wrong with a pack, its plan library or a home's facts, and its sentences.

Whatever looks for such a thing gives these: `core/pack` reading a pack, `core/lint` the names in
it, `core/validate` the facts.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rdflib.term import Node

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import STATES, Triple
from adaptbot_cli.core.names import sentence_list

_MOST_NAMED = 3


@dataclass(frozen=True, slots=True)
class Fault:
    """A problem, what to do about it, the file, and the names of its entries that have it.

    Of facts, `about` is the thing and `facts` those that the fault is made of; of a pack it has
    neither. `unknown` is the name that stands for nothing, if that is the fault, and `cause` in
    words where the facts come from. A `hint` is worth knowing and no fault.
    """

    problem: str
    remedy: str = ""
    file: str = ""
    entries: tuple[str, ...] = ()
    about: Node | None = None
    facts: frozenset[Triple] = frozenset()
    unknown: str = ""
    cause: str = ""
    hint: bool = False

    def __str__(self) -> str:
        entry = "entries" if self.entries[1:] else "entry"
        where = f"{self.file}, {entry} {self._names}" if self.entries else self.file
        end = f"; {self.remedy}" if self.remedy else ""
        return ": ".join(filter(None, (where, self.problem))) + end

    @property
    def message(self) -> str:
        """The sentence for somebody who sees no files: the entries and the problem."""
        return ": ".join(filter(None, (self._names, self.problem)))

    @property
    def _names(self) -> str:
        return sentence_list(self.entries, _MOST_NAMED)

    @property
    def key(self) -> object:
        """What makes it the same fault even if its things are called otherwise now."""
        return (self.about, self.facts) if self.about is not None else self

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain object."""
        record = {"message": self.message, "file": self.file, "remedy": self.remedy}
        return {**record, "cause": self.cause or None, "hint": self.hint}


def fault_of(
    kg: Kg, about: Node, problem: str, remedy: str, facts: Iterable[Triple], unknown: str = ""
) -> Fault:
    """Return a fault of a thing; its file is that of the facts that it is made of."""
    known = frozenset(facts)
    states = bool(known) and all(kg.home_of(predicate) == STATES for _, predicate, _ in known)
    file = "state.ttl" if states else "attributes.ttl"
    return Fault(problem, remedy, file, (kg.name(about),), about, known, unknown)


def by_mistake(found: Iterable[Fault]) -> list[Fault]:
    """Return a fault for each mistake: of those that say the same of several entries, or that one
    name stands for nothing, the first, with the other entries named in it."""
    groups: dict[object, list[Fault]] = {}
    for fault in found:
        key = fault.unknown or (fault.file, fault.problem, fault.remedy)
        groups.setdefault(key, []).append(fault)
    return [_one_for(group) for group in groups.values()]


def _one_for(group: Sequence[Fault]) -> Fault:
    entries: dict[str, dict[str, None]] = {}
    for fault in group:
        entries.setdefault(fault.file, {}).update(dict.fromkeys(fault.entries))
    own = entries.pop(group[0].file)
    others = [f"{file}: {sentence_list([*n], _MOST_NAMED)}" for file, n in entries.items()]
    also = f" (also in {', '.join(others)})" if others else ""
    return replace(group[0], problem=group[0].problem + also, entries=tuple(own))
