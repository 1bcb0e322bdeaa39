"""A graph from outside, split by the domain into what can be accepted and what cannot, and why."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from rdflib import RDF, RDFS, BNode, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.domain import Domain, Kind, Property
from adaptbot_cli.core.names import a
from adaptbot_cli.core.terms import AB, DATATYPES, FACT_TERMS, Triple, is_value, local, ordered

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

    `base` are the facts that will stand beside them; `prefixes` are the names that the graph's
    own file has for its namespaces, in which its oddities are told. Nothing is invented: what is
    not in the triples is not in the result.
    """
    given = frozenset(triples)
    declared = {s for s, p, o in given if p == RDF.type and o in _DECLARES}
    declarations = frozenset(t for t in given if t[0] in declared)
    sorting = _Sorting(domain, base, given - declarations)
    sorting.sort()
    oddities = tuple(_oddities(given - declarations, declarations, domain, prefixes))
    return Parcel(frozenset(sorting.accepted), sorting.left_out, declarations, oddities)


def merged(parcel: Parcel, domain: Domain, base: frozenset[Triple]) -> Delta:
    """Return the change that adds accepted facts; a functional property takes the new value."""
    functional = {prop.iri for prop in domain.properties.values() if prop.functional}
    found = {(s, p) for s, p, _ in parcel.accepted if p in functional}
    old = {t for t in base if (t[0], t[1]) in found and t not in parcel.accepted}
    return Delta(frozenset(old), parcel.accepted - base)


def replaced(parcel: Parcel, base: frozenset[Triple]) -> Delta:
    """Return the change that leaves the accepted facts alone, of all that was known."""
    return Delta(base - parcel.accepted, parcel.accepted - base)


def _listed(values: Iterable[Node]) -> str:
    return ", ".join(map(local, values))


@dataclass(slots=True)
class _Sorting:
    """Facts on their way to one side or the other."""

    domain: Domain
    base: frozenset[Triple]
    facts: frozenset[Triple]
    accepted: set[Triple] = field(default_factory=set)
    left_out: dict[Triple, str] = field(default_factory=dict)
    kinds: dict[Node, set[Node]] = field(default_factory=dict)
    named: set[tuple[Node, Node]] = field(default_factory=set)

    def sort(self) -> None:
        """Decide on every fact: what a thing is comes first, for the rest rests on it."""
        known: dict[Node, set[Node]] = {}
        for subject, predicate, value in self.base:
            if predicate == RDF.type:
                known.setdefault(subject, set()).add(value)
        record: dict[Node, set[Node]] = {}
        for subject, predicate, value in self.facts:
            if predicate == RDF.type and value in self.domain.kinds:
                record.setdefault(subject, set()).add(value)
        names = self.domain.name_properties()
        self.named = {
            (s, p) for facts in (self.base, self.facts) for s, p, _ in facts if p in names
        }
        refused = {
            s: why for s in record if (why := self._misfit(s, record[s], known.get(s, set())))
        }
        kinds = {s: known.get(s) or record[s] for s in record if s not in refused}
        self.kinds = {**known, **kinds}
        several = self._several()
        for triple in ordered(self.facts):
            reason = refused.get(triple[0]) or several.get(triple[:2]) or self._reason(triple)
            if reason:
                self.left_out[triple] = reason
            else:
                self.accepted.add(triple)
        self._break_cycles()

    def _misfit(self, subject: Node, found: set[Node], known: set[Node]) -> str:
        """Why a thing as a whole cannot be taken in."""
        if isinstance(subject, BNode):
            return "it has no IRI of its own"
        label: Mapping[Node, Kind] = self.domain.kinds  # type: ignore[assignment]
        if known and not all(self._akin(one, other) for one in found for other in known):
            was = " and ".join(sorted(a(label[k].label) for k in known if k in label))
            now = " and ".join(sorted(a(label[k].label) for k in found if k in label))
            return f"{local(subject)} is {was} here and {now} there"
        named_by = {kind.name_property for k in found for kind in [label[k]] if kind.name_property}
        if named_by and not any((subject, p) in self.named for p in named_by):
            return f"{local(subject)} has no name"
        return ""

    def _akin(self, one: Node, other: Node) -> bool:
        """Whether one class is the other or above it."""
        kinds = self.domain.kinds
        supers = (kinds[k].supers for k in (one, other) if k in kinds)  # type: ignore[index]
        return any({one, other} <= set(classes) for classes in supers)

    def _several(self) -> dict[tuple[Node, Node], str]:
        """Functional properties with several values: which one holds is not ours to say."""
        values: dict[tuple[Node, Node], list[Node]] = {}
        for subject, predicate, value in ordered(self.facts):
            prop = self._prop(predicate)
            if prop is not None and prop.functional:
                values.setdefault((subject, predicate), []).append(value)
        return {
            key: f"{' '.join(map(local, key))} has {len(found)} values: {_listed(found)}"
            for key, found in values.items()
            if len(found) > 1
        }

    def _prop(self, predicate: Node) -> Property | None:
        found: Property | None = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return found

    def _reason(self, triple: Triple) -> str:
        """Why a fact cannot be taken in, empty if it can."""
        subject, predicate, value = triple
        if isinstance(subject, BNode) or isinstance(value, BNode):
            return "it is about something without an IRI of its own"
        if predicate == RDF.type:
            if value not in self.domain.kinds:
                return f"{local(value)} is no class here"
            mine = self.kinds[subject]
            return "" if value in mine else f"{local(subject)} is of class {_listed(mine)} here"
        if predicate in FACT_TERMS:
            return "" if isinstance(value, Literal) else "a name must be a text"
        prop = self._prop(predicate)
        if prop is None:
            return f"{local(predicate)} is not declared in domain.ttl"
        if subject not in self.kinds:
            return f"nothing says what {local(subject)} is"
        if not self._is_a(subject, prop.domain):
            return f"{local(predicate)} is for {a(self._label(prop.domain))}"
        return self._range(prop, value)

    def _range(self, prop: Property, value: Node) -> str:
        if prop.range in DATATYPES:
            fits = is_value(value, prop.range)
            return "" if fits else f"{local(prop.iri)} must be {a(local(prop.range))}"
        if value not in self.kinds:
            return f"nothing says what {local(value)} is"
        if not self._is_a(value, prop.range):
            return f"{local(prop.iri)} must be {a(self._label(prop.range))}, {local(value)} is not"
        return ""

    def _is_a(self, node: Node, wanted: Node) -> bool:
        kinds = self.domain.kinds
        return any(wanted in kinds[k].supers for k in self.kinds[node] if k in kinds)  # type: ignore[index]

    def _label(self, iri: Node) -> str:
        kind = self.domain.kinds.get(iri)  # type: ignore[call-overload]
        return kind.label if kind else local(iri)

    def _break_cycles(self) -> None:
        """Leave out places by which a thing would be in itself."""
        places = {k.location_property for k in self.domain.kinds.values() if k.location_property}
        new = {t[0]: t for t in self.accepted if t[1] in places}
        above = {s: o for s, p, o in self.base if p in places and s not in new}
        above |= {s: t[2] for s, t in new.items()}
        for start in sorted(new, key=str):
            seen, here = {start}, above.get(start)
            while here is not None and here not in seen:
                seen.add(here)
                here = above.get(here)
            if here == start:
                self.accepted.discard(new[start])
                self.left_out[new[start]] = f"{local(start)} would be in itself"
                del above[start]


def _oddities(
    facts: frozenset[Triple],
    declarations: frozenset[Triple],
    domain: Domain,
    prefixes: Mapping[str, str],
) -> Iterator[str]:
    """What is odd in a graph by its own declarations, whatever this home makes of it."""
    short = _Short(prefixes)
    if not declarations:
        yield "no class or property declarations"
    else:
        yield from _undeclared(facts, declarations, short)
        yield from _elsewhere(facts, declarations, short)
    functional = {prop.iri for prop in domain.properties.values() if prop.functional}
    values: dict[tuple[Node, Node], list[Node]] = {}
    for subject, predicate, value in ordered(facts):
        if predicate in functional:
            values.setdefault((subject, predicate), []).append(value)
        if subject == value:
            yield f"{short(subject)} {short(predicate)} names itself"
        own = URIRef(domain.namespace + local(value))
        if predicate == RDF.type and value != own and own in domain.kinds:
            yield f"{short(subject)} is typed {short(value)}, not {short(own)}"
    for (subject, predicate), found in values.items():
        if len(found) > 1:
            text = _listed(found)
            yield f"{short(subject)} {short(predicate)} has {len(found)} values: {text}"


@dataclass(frozen=True, slots=True)
class _Short:
    """Writes IRIs with the prefixes of a file."""

    prefixes: Mapping[str, str]

    def __call__(self, node: Node) -> str:
        for name, space in sorted(self.prefixes.items(), key=lambda p: -len(p[1])):
            if isinstance(node, URIRef) and node.startswith(space):
                return f"{name}:{node.removeprefix(space)}"
        return str(node)


def _undeclared(
    facts: frozenset[Triple], declarations: frozenset[Triple], short: _Short
) -> Iterator[str]:
    declared = {s for s, p, o in declarations if p == RDF.type and o == RDF.Property}
    used = {p for _, p, _ in facts if p != RDF.type and not str(p).startswith(str(AB))}
    for predicate in sorted(used - declared, key=str):
        yield f"{short(predicate)} is used but not declared"


def _elsewhere(
    facts: frozenset[Triple], declarations: frozenset[Triple], short: _Short
) -> Iterator[str]:
    """Properties on things of another class than the graph itself declares them for."""
    domains = {s: o for s, p, o in declarations if p == RDFS.domain}
    above: dict[Node, set[Node]] = {}
    for subject, predicate, value in declarations:
        if predicate == RDFS.subClassOf:
            above.setdefault(subject, set()).add(value)
    kinds: dict[Node, set[Node]] = {}
    for subject, predicate, value in facts:
        if predicate == RDF.type:
            kinds.setdefault(subject, set()).add(value)
    counts: dict[tuple[Node, Node, Node], int] = {}
    for subject, predicate, _ in facts:
        wanted = domains.get(predicate)
        for kind in kinds.get(subject, ()) if wanted is not None else ():
            if wanted is not None and wanted not in _up(kind, above):
                key = (predicate, wanted, kind)
                counts[key] = counts.get(key, 0) + 1
    for (predicate, wanted, kind), count in sorted(counts.items()):
        text = f"stands {count} time(s) on a {short(kind)}"
        yield f"{short(predicate)} has domain {short(wanted)} but {text}"


def _up(kind: Node, above: Mapping[Node, set[Node]]) -> set[Node]:
    """A class and all classes above it."""
    found, open_ = {kind}, [kind]
    while open_:
        new = above.get(open_.pop(), set()) - found
        found |= new
        open_ += new
    return found
