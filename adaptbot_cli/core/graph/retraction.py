"""What retracting a fact takes with it, and what undoing an old change comes to now."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from rdflib import RDF
from rdflib.term import Node

from adaptbot_cli.core.domain import Domain, InitialState
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import AB, ACTION_PARTS, FACT_TERMS, TRUE, Triple


@dataclass(slots=True)
class Known:
    """The facts of a home, indexed by subject and by object."""

    domain: Domain
    facts: frozenset[Triple]
    _by_subject: dict[Node, set[Triple]] = field(default_factory=dict)
    _by_value: dict[Node, set[Triple]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for triple in self.facts:
            self._by_subject.setdefault(triple[0], set()).add(triple)
            self._by_value.setdefault(triple[2], set()).add(triple)

    def about(self, subject: Node, predicate: Node | None = None) -> set[Triple]:
        """Return the facts about a thing, of one predicate if given."""
        found = self._by_subject.get(subject, set())
        return {t for t in found if predicate is None or t[1] == predicate}

    def naming(self, value: Node) -> set[Triple]:
        """Return the facts that name a thing as their object."""
        return self._by_value.get(value, set())


def following(taken: Iterable[Triple], known: Known) -> frozenset[Triple]:
    """Return facts to retract together with all known facts that follow from them.

    From a thing's kind follows everything about it and whatever names it: attributes, other names,
    its place, and the places of what is in it. From an attribute follow the states that it brings
    (`ab:starts … ab:when`). From a part of an action follows what describes it.
    """
    gone: set[Triple] = set()
    open_ = [triple for triple in taken if triple in known.facts]
    while open_:
        triple = open_.pop()
        if triple in gone:
            continue
        gone.add(triple)
        open_ += [found for found in _following(triple, gone, known) if found not in gone]
    return frozenset(gone)


def _following(triple: Triple, gone: set[Triple], known: Known) -> set[Triple]:
    subject, predicate, value = triple
    if predicate == RDF.type:
        if known.about(subject, RDF.type) - gone:
            return set()  # it has another kind still
        return known.about(subject) | known.naming(subject)
    if predicate in ACTION_PARTS:
        return known.about(value)
    if predicate == AB.alias:  # the name of a part, which is nothing without it
        return {t for t in known.naming(subject) if t[1] == AB.calledAs}
    if value == TRUE:
        states = {start.prop for start in _brought(subject, predicate, known)}
        return {found for prop in states for found in known.about(subject, prop)}
    return set()


def _brought(subject: Node, predicate: Node, known: Known) -> Iterable[InitialState]:
    for _, _, kind in known.about(subject, RDF.type):
        declared = known.domain.classes.get(kind)  # type: ignore[call-overload]
        for start in declared.starts if declared else ():
            if start.when == predicate:
                yield start


def taken_back(taught: Delta, known: Known) -> Delta:
    """Return the change that undoes an old one, with what followed from it.

    What later work has changed since stays: an added fact that is gone already is passed over,
    and an old value returns only where its place has not been taken since.
    """
    gone = following(taught.added, known)
    restored: set[Triple] = set()
    for triple in sorted(taught.removed, key=lambda t: (t[1] != RDF.type, t)):
        if triple not in known.facts and _fits(triple, gone, restored, known):
            restored.add(triple)
    return Delta(gone - restored, frozenset(restored - known.facts))


def _fits(triple: Triple, gone: frozenset[Triple], restored: set[Triple], known: Known) -> bool:
    """Whether an old fact may be restored: its subject and object still exist."""
    subject, predicate, value = triple
    if predicate in FACT_TERMS and subject == known.domain.iri:
        return True
    if predicate != RDF.type and not _there(subject, gone, restored, known):
        return False
    prop = known.domain.properties.get(predicate)  # type: ignore[call-overload]
    if prop is None:
        return True
    if prop.range in known.domain.classes and not _there(value, gone, restored, known):
        return False
    taken = known.about(subject, predicate) - gone
    return not (prop.functional and taken)


def _there(node: Node, gone: frozenset[Triple], restored: set[Triple], known: Known) -> bool:
    """Whether a thing, an action or its parameter exists after the change."""
    if known.about(node, RDF.type) - gone or any(node in (t[0], t[2]) for t in restored):
        return True
    return any(action.iri == node for action in known.domain.actions.values())
