"""What is wrong with a graph's facts, in plain words: file, entry, problem, what to do.

`faults` judges a whole graph; `new_faults` what one change of it would break, by looking only at
the things that the change touches, so that its time does not grow with the graph.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from rdflib import RDF, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.datatypes import DATATYPES, is_value
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.domain import Domain, Property
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.misnamed import misnamed
from adaptbot_cli.core.names import a, nearest
from adaptbot_cli.core.terms import AB, ATTRIBUTES, FACT_TERMS, STATES, Triple, local

Facts = Sequence[Triple]


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that the domain does not allow.

    `plain` tells it in a sentence that begins with the name of the thing; as text it begins with
    file and entry, and ends with the `remedy`. `facts` are those that it is made of, none if the
    pack itself is wrong; `about` is the thing, None likewise.
    """

    name: str
    problem: str
    remedy: str = ""
    file: str = "attributes.ttl"
    about: Node | None = None
    facts: frozenset[Triple] = frozenset()

    def __str__(self) -> str:
        if self.about is None:
            return self.problem
        end = f"; {self.remedy}" if self.remedy else ""
        return f"{self.file}, entry {self.name}: {self.problem}{end}"

    @property
    def plain(self) -> str:
        """The sentence for somebody who sees no files."""
        return self.problem if self.about is None else f"{self.name}: {self.problem}"

    @property
    def key(self) -> object:
        """What makes it the same fault even if its things are called otherwise now."""
        return (self.about, self.facts) if self.about is not None else self.problem


def faults(kg: Kg) -> list[Fault]:
    """Return what the domain does not allow in the whole graph and pack; none if all is well.

    A home may lack what a task needs: that is `lacking`.
    """
    return list(dict.fromkeys([*fact_faults(kg), *_of_pack(kg)]))


def fact_faults(kg: Kg) -> list[Fault]:
    """Return what the domain does not allow in the facts, whatever the pack names."""
    found = [fault for about, known in _by_subject(kg) for fault in _of(kg, about, known)]
    return list(dict.fromkeys(found))


def new_faults(kg: Kg, delta: Delta, domain: Domain | None = None) -> list[Fault]:
    """Return the faults that a change would bring: there with it and not without it.

    `domain` is the domain that holds after the change, if that changes too. The graph is as it was
    when this returns.
    """
    other = domain is not None and domain != kg.domain
    change = _effective(kg, delta)
    pack = other or _takes_names(kg, change)
    touched = _touched(kg, change)
    before = _some_faults(kg.under(kg.domain), touched, pack)
    changed = kg.under(domain or kg.domain)
    changed.learn(change)
    try:
        after = _some_faults(changed, touched | _touched(changed, change), pack)
    finally:
        changed.learn(change.inverse)
    known = {fault.key for fault in before}
    return [fault for fault in after if fault.key not in known]


def _of_pack(kg: Kg) -> Iterator[Fault]:
    """What the pack names that is not there; a home may lack a task's things."""
    yield from (Fault("", said) for said in misnamed(kg))


def _effective(kg: Kg, delta: Delta) -> Delta:
    """What a change really changes: what is there is not added, what is not there not removed."""
    removed, added = (
        frozenset(triple for triple in triples if (triple in kg.facts) == there)
        for triples, there in ((delta.removed - delta.added, True), (delta.added, False))
    )
    return Delta(removed, added)


def _some_faults(kg: Kg, touched: Iterable[Node], pack: bool) -> list[Fault]:
    found = [
        fault for about in sorted(touched, key=str) for fault in _of(kg, about, _known(kg, about))
    ]
    return list(dict.fromkeys([*found, *(_of_pack(kg) if pack else ())]))


def _takes_names(kg: Kg, delta: Delta) -> bool:
    """Tell whether a change takes away what the pack's tasks and conditions may rest on."""
    telling = {RDF.type, AB.alias, *kg.named_by}
    return any(predicate in telling for _, predicate, _ in delta.removed)


def _touched(kg: Kg, delta: Delta) -> set[Node]:
    """The things that a change is about, and those that point at one whose class it changes."""
    changed = delta.removed | delta.added
    found = {subject for subject, _, _ in changed}
    retyped = {subject for subject, predicate, _ in changed if predicate == RDF.type}
    return found | {s for thing in retyped for s in kg.facts.subjects(None, thing)}


def _by_subject(kg: Kg) -> Iterator[tuple[Node, Facts]]:
    grouped: dict[Node, list[Triple]] = defaultdict(list)
    for name in (ATTRIBUTES, STATES):
        for triple in kg.graph(name):
            grouped[triple[0]].append(triple)
    for subject in sorted(grouped, key=str):
        yield subject, sorted(grouped[subject])


def _known(kg: Kg, about: Node) -> Facts:
    graphs = (kg.graph(name) for name in (ATTRIBUTES, STATES))
    return sorted(triple for graph in graphs for triple in graph.triples((about, None, None)))


def _fault(kg: Kg, about: Node, problem: str, remedy: str, facts: Iterable[Triple]) -> Fault:
    known = frozenset(facts)
    states = bool(known) and all(kg.home_of(predicate) == STATES for _, predicate, _ in known)
    file = "state.ttl" if states else "attributes.ttl"
    return Fault(kg.name(about), problem, remedy, file, about, known)


def _of(kg: Kg, about: Node, known: Facts) -> Iterator[Fault]:
    """The faults of one thing, from all its facts."""
    if all(predicate in FACT_TERMS for _, predicate, _ in known):
        yield from _of_what_people_said(kg, known)
        return
    types = [value for _, predicate, value in known if predicate == RDF.type]
    if types:
        yield from _misfits(kg, known)
        yield from _several_kinds(kg, about, types)
        yield from _unnamed(kg, about, known, types)
    else:
        remedy = "give it a class in attributes.ttl"
        yield _fault(kg, about, "nothing says what it is", remedy, known)
    yield from _several_values(kg, about, known)
    yield from _shared_name(kg, about, known)
    yield from _shared_alias(kg, known)
    yield from _inside_itself(kg, about)


def _of_what_people_said(kg: Kg, known: Facts) -> Iterator[Fault]:
    """Other names of what is not there; what is absent is said of the domain."""
    actions = {action.iri for action in kg.domain.actions.values()}
    for triple in known:
        subject, predicate, value = triple
        if predicate == AB.alias and subject not in actions:
            told = f"has the other name {value}, but is nothing known"
            yield _fault(kg, subject, told, "take it away", [triple])
    yield from _shared_alias(kg, known)


def _misfits(kg: Kg, known: Facts) -> Iterator[Fault]:
    """Facts whose predicate or value does not fit the thing."""
    for triple in known:
        for problem, remedy in _misfit(kg, *triple):
            yield _fault(kg, triple[0], problem, remedy, [triple])


def _misfit(kg: Kg, subject: Node, predicate: Node, value: Node) -> Iterator[tuple[str, str]]:
    if str(predicate).startswith(str(AB)):
        if predicate not in FACT_TERMS:
            terms = ", ".join(f"ab:{local(term)}" for term in sorted(FACT_TERMS))
            yield f"ab:{local(predicate)} means nothing among the facts", f"{terms} do"
        return
    if predicate == RDF.type:
        if value not in kg.domain.kinds:
            remedy = _instead(local(value), map(local, kg.domain.kinds), "declare it there")
            yield f"{local(value)} is no class of domain.ttl", remedy
        return
    prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
    if prop is None:
        known = map(local, kg.domain.properties)
        remedy = _instead(local(predicate), known, "declare it there as an rdf:Property")
        yield f"{local(predicate)} is not declared in domain.ttl", remedy
        return
    if prop.domain and not kg.is_a(subject, [prop.domain]):
        wanted, found = a(_label(kg, prop.domain)), a(kg.kind_label(subject))
        told = f"{_called(prop)} is for {wanted}, not {found}"
        yield told, "take it away, or correct the class"
    yield from _range(kg, prop, value)


def _instead(name: str, known: Iterable[str], otherwise: str) -> str:
    near = nearest(name, sorted(set(known)), 1)
    return f"the nearest there is {near[0]}" if near else otherwise


def _called(prop: Property) -> str:
    """A property in words that people use, and by its name in the files."""
    short = local(prop.iri)
    return short if prop.label == short else f"{prop.label} ({short})"


def _label(kg: Kg, iri: URIRef) -> str:
    return kg.domain.kinds[iri].label if iri in kg.domain.kinds else local(iri)


def _range(kg: Kg, prop: Property, value: Node) -> Iterator[tuple[str, str]]:
    short = _called(prop)
    if str(prop.range).startswith(str(XSD)):
        wanted = a(local(prop.range))
        remedy = f"write {DATATYPES.get(prop.range, wanted)}"
        if isinstance(value, Literal) and value.ill_typed:
            # What it was is lost: rdflib has made something else of it.
            yield f"{short} is not written as {wanted} is", remedy
        elif not is_value(value, prop.range):
            yield f"{short} must be {wanted}, not {local(value)}", remedy
    elif not prop.range:
        return
    elif not isinstance(value, URIRef) or not kg.classes(value):
        known = map(local, kg.instances([prop.range]))
        remedy = _instead(local(value), known, "declare it in attributes.ttl")
        yield f"{short} is {local(value)}, which is nothing known", remedy
    elif not kg.is_a(value, [prop.range]):
        wanted = a(_label(kg, prop.range))
        yield f"{short} must be {wanted}, {kg.name(value)} is not", f"name {wanted}"


def _several_values(kg: Kg, about: Node, known: Facts) -> Iterator[Fault]:
    for predicate in dict.fromkeys(predicate for _, predicate, _ in known):
        prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
        these = [triple for triple in known if triple[1] == predicate]
        if prop is not None and prop.functional and len(these) > 1:
            values = " and ".join(sorted(kg.name(value) for _, _, value in these))
            told = f"{_called(prop)} has {len(these)} values: {values}"
            yield _fault(kg, about, told, "keep one", these)


def _several_kinds(kg: Kg, about: Node, types: Sequence[Node]) -> Iterator[Fault]:
    """Things of two classes that a person teaches, neither of which is the other's superclass."""
    stated = [kind for kind in kg.domain.teachable if kind.iri in types]
    others = [k for k in stated if not any(k.iri in o.supers for o in stated if o != k)]
    if len(others) > 1:
        told = f"is {' and '.join(a(kind.label) for kind in others)}"
        facts = [(about, RDF.type, kind.iri) for kind in others]
        yield _fault(kg, about, f"{told}; it can be only one of them", "", facts)


def _unnamed(kg: Kg, about: Node, known: Facts, types: Sequence[Node]) -> Iterator[Fault]:
    predicates = {predicate for _, predicate, _ in known}
    for kind in (kg.domain.kinds[iri] for iri in types if iri in kg.domain.kinds):  # type: ignore[index]
        if kind.name_property is not None and kind.name_property not in predicates:
            told = f"lacks its name, {local(kind.name_property)}"
            yield _fault(kg, about, told, "add it", [(about, RDF.type, kind.iri)])


def _shared_name(kg: Kg, about: Node, known: Facts) -> Iterator[Fault]:
    """Names that two things of one class bear: no plan could say which it means."""
    types = {value for _, predicate, value in known if predicate == RDF.type}
    for _, predicate, name in (triple for triple in known if triple[1] in kg.named_by):
        for other in sorted(set(kg.facts.subjects(predicate, name)) - {about}, key=str):
            if types & set(kg.facts.objects(other, RDF.type)):
                first, second = sorted((about, other), key=str)
                told = f'its name "{name}" is that of {local(first)} too'
                facts = frozenset({(first, predicate, name), (second, predicate, name)})
                yield Fault(local(second), told, "change one", "attributes.ttl", second, facts)


def _shared_alias(kg: Kg, known: Facts) -> Iterator[Fault]:
    """Another name that was taught for two things, so that it tells neither."""
    for _, _, value in (triple for triple in known if triple[1] == AB.alias):
        bearers = sorted(kg.facts.subjects(AB.alias, value), key=str)
        if len(bearers) > 1:
            told = f'its other name "{value}" is that of '
            told += " and ".join(kg.name(bearer) for bearer in bearers[1:])
            facts = [(bearer, AB.alias, value) for bearer in bearers]
            yield _fault(kg, bearers[0], f"{told} too", "keep one", facts)


def _inside_itself(kg: Kg, about: Node) -> Iterator[Fault]:
    """A thing that is in itself, directly or through others; told once for all of them."""
    way = _way_back(kg, about)
    if way:
        start = way.index(min(way, key=str))
        way = [*way[start:], *way[:start]]
        path = " in ".join(kg.name(node) for node in (*way, way[0]))
        ring = list(zip(way, (*way[1:], way[0]), strict=True))
        links = [(one, place, other) for one, other in ring for place in kg.domain.locations]
        facts = [link for link in links if link in kg.facts]
        remedy = "give one of them another place"
        yield _fault(kg, way[0], f"is in itself: {path}", remedy, facts)


def _way_back(kg: Kg, about: Node) -> list[Node]:
    """The things from one to itself along what they are in, none if it is not in itself."""
    ways: list[list[Node]] = [[about]]
    seen: set[Node] = set()
    while ways:
        way = ways.pop()
        places = {
            place for prop in kg.domain.locations for place in kg.facts.objects(way[-1], prop)
        }
        if about in places:
            return way
        ways += [[*way, place] for place in sorted(places - seen, key=str)]
        seen |= places
    return []
