"""A graph from outside, split by the domain into what can be accepted and what cannot, and why."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from rdflib import RDF, RDFS, BNode, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, FACT_TERMS, Triple, local, ordered
from adaptbot_cli.core.graph.validate import new_faults
from adaptbot_cli.core.names import a

_DECLARES = frozenset({RDFS.Class, RDF.Property})


@dataclass(frozen=True, slots=True)
class Parcel:
    """A graph from outside: what of it is accepted, what is left out and why, what is odd in it.

    `declarations` are its own statements about classes and properties, which domain.ttl makes for
    this home.
    """

    accepted: frozenset[Triple]
    left_out: Mapping[Triple, str]
    declarations: frozenset[Triple]
    oddities: tuple[str, ...]


def accept(
    triples: Iterable[Triple],
    domain: Domain,
    base: frozenset[Triple],
    prefixes: Mapping[str, str],
) -> Parcel:
    """Sort the triples of a graph into what this home can take in and what it cannot.

    Left out is what the domain does not allow (`faults`), or what would be a fault beside `base`,
    the facts that stay. `prefixes` are those of the graph's own file, for its oddities. Nothing is
    invented: what is not in the triples is not in the result.
    """
    given = frozenset(triples)
    declared = {s for s, p, o in given if p == RDF.type and o in _DECLARES}
    declarations = frozenset(t for t in given if t[0] in declared)
    facts = given - declarations
    kg = Kg.load(domain, base, ())
    reasons = ((triple, _reason(triple, kg)) for triple in ordered(facts))
    left_out = {triple: reason for triple, reason in reasons if reason}
    fitting = facts - left_out.keys()
    while found := [f for f in new_faults(kg, _merged(fitting, domain, base)) if f.facts & fitting]:
        for fault in found:
            left_out |= dict.fromkeys(ordered(fault.facts & fitting), fault.problem)
        fitting -= left_out.keys()
    oddities = tuple(_oddities(facts, declarations, domain, prefixes))
    return Parcel(fitting, left_out, declarations, oddities)


def _reason(triple: Triple, kg: Kg) -> str:
    """Why a fact can be taken in nowhere, or not beside what a thing is here; "" otherwise."""
    subject, predicate, value = triple
    if isinstance(subject, BNode) or isinstance(value, BNode):
        return "it is about something without an IRI of its own"
    if predicate in FACT_TERMS and not isinstance(value, Literal):
        return "a name must be a text"
    kind = kg.domain.classes.get(value) if predicate == RDF.type else None  # type: ignore[call-overload]
    if kind is None or not kg.classes(subject) or value in kg.classes(subject):
        return ""
    narrower = not set(kg.facts.objects(subject, RDF.type)).isdisjoint(kind.superclasses)
    here = f"{local(subject)} is {a(kg.kind_label(subject))} here"
    return "" if narrower else f"{here}, and {a(kind.label)} there"


def merged(parcel: Parcel, domain: Domain, base: frozenset[Triple]) -> Delta:
    """Return the change that adds accepted facts; a functional property takes the new value."""
    return _merged(parcel.accepted, domain, base)


def _merged(accepted: frozenset[Triple], domain: Domain, base: frozenset[Triple]) -> Delta:
    functional = {prop.iri for prop in domain.properties.values() if prop.functional}
    found = {(s, p) for s, p, _ in accepted if p in functional}
    old = {t for t in base if (t[0], t[1]) in found and t not in accepted}
    return Delta(frozenset(old), accepted - base)


def replaced(parcel: Parcel, base: frozenset[Triple]) -> Delta:
    """Return the change that leaves the accepted facts alone, of all that was known."""
    return Delta(base - parcel.accepted, parcel.accepted - base)


def _listed(values: Iterable[Node]) -> str:
    return ", ".join(map(local, values))


def _oddities(
    facts: frozenset[Triple],
    declarations: frozenset[Triple],
    domain: Domain,
    prefixes: Mapping[str, str],
) -> Iterator[str]:
    """What is odd in a graph by its own declarations, whatever this home makes of it."""

    def short(node: Node) -> str:
        """Write an IRI with a prefix of the file."""
        for name, space in sorted(prefixes.items(), key=lambda p: -len(p[1])):
            if isinstance(node, URIRef) and node.startswith(space):
                return f"{name}:{node.removeprefix(space)}"
        return str(node)

    if not declarations:
        yield "no class or property declarations"
    else:
        stated = {s for s, p, o in declarations if p == RDF.type and o == RDF.Property}
        used = {p for _, p, _ in facts if p != RDF.type and not str(p).startswith(str(AB))}
        for predicate in sorted(used - stated, key=str):
            yield f"{short(predicate)} is used but not declared"
        yield from _elsewhere(facts, declarations, short)
    functional = {prop.iri for prop in domain.properties.values() if prop.functional}
    values: dict[tuple[Node, Node], list[Node]] = {}
    for subject, predicate, value in ordered(facts):
        if predicate in functional:
            values.setdefault((subject, predicate), []).append(value)
        if subject == value:
            yield f"{short(subject)} {short(predicate)} names itself"
        own = URIRef(domain.namespace + local(value))
        if predicate == RDF.type and value != own and own in domain.classes:
            yield f"{short(subject)} is typed {short(value)}, not {short(own)}"
    for (subject, predicate), found in values.items():
        if len(found) > 1:
            text = _listed(found)
            yield f"{short(subject)} {short(predicate)} has {len(found)} values: {text}"


def _elsewhere(
    facts: frozenset[Triple], declarations: frozenset[Triple], short: Callable[[Node], str]
) -> Iterator[str]:
    """Properties on things of another class than the graph itself declares them for."""
    domains = {s: o for s, p, o in declarations if p == RDFS.domain}
    above: dict[Node, set[Node]] = {}
    for subject, predicate, value in declarations:
        if predicate == RDFS.subClassOf:
            above.setdefault(subject, set()).add(value)

    def up(kind: Node) -> set[Node]:
        """A class and all classes above it."""
        found, open_ = {kind}, [kind]
        while open_:
            new = above.get(open_.pop(), set()) - found
            found |= new
            open_ += new
        return found

    kinds: dict[Node, set[Node]] = {}
    for subject, predicate, value in facts:
        if predicate == RDF.type:
            kinds.setdefault(subject, set()).add(value)
    counts: dict[tuple[Node, Node, Node], int] = {}
    for subject, predicate, _ in facts:
        wanted = domains.get(predicate)
        for kind in kinds.get(subject, ()) if wanted is not None else ():
            if wanted is not None and wanted not in up(kind):
                key = (predicate, wanted, kind)
                counts[key] = counts.get(key, 0) + 1
    for (predicate, wanted, kind), count in sorted(counts.items()):
        text = f"stands {count} time(s) on a {short(kind)}"
        yield f"{short(predicate)} has domain {short(wanted)} but {text}"
