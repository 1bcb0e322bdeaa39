"""What is wrong with a graph's facts, in plain words: file, entry, problem, what to do."""

from collections.abc import Iterable, Iterator

from rdflib import RDF, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Property
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.misnamed import misnamed
from adaptbot_cli.core.names import a, nearest
from adaptbot_cli.core.terms import AB, ATTRIBUTES, FACT_TERMS, STATES, local

_CHECKED_DATATYPES = {XSD.boolean: bool, XSD.string: str, XSD.integer: int}
_EXAMPLES = {XSD.boolean: "true or false", XSD.string: 'a text in quotes, such as "egg"'}


def faults(kg: Kg) -> list[str]:
    """Return a sentence for each fact that the domain does not allow; none if all is well."""
    found = [fault for triple in sorted(_facts(kg)) for fault in _fact(kg, *triple)]
    found += _several_values(kg)
    found += _several_kinds(kg)
    found += _cycles(kg)
    found += _unnamed(kg)
    found += _shared_names(kg)
    found += _unknown_needs(kg)
    found += misnamed(kg)
    return list(dict.fromkeys(found))


def _facts(kg: Kg) -> Iterator[tuple[Node, Node, Node]]:
    for name in (ATTRIBUTES, STATES):
        yield from kg.graph(name)


def _where(kg: Kg, subject: Node, predicate: Node) -> str:
    """Where a fact stands: "state.ttl, entry egg"."""
    file = "state.ttl" if kg.home_of(predicate) == STATES else "attributes.ttl"
    return f"{file}, entry {kg.name(subject)}"


def _fact(kg: Kg, subject: Node, predicate: Node, value: Node) -> Iterator[str]:
    where = _where(kg, subject, predicate)
    if str(predicate).startswith(str(AB)):
        if predicate not in FACT_TERMS:
            known = ", ".join(f"ab:{local(term)}" for term in sorted(FACT_TERMS))
            yield f"{where}: ab:{local(predicate)} means nothing among the facts; {known} do"
        return
    if predicate == RDF.type:
        if value not in kg.domain.kinds:
            remedy = _instead(local(value), map(local, kg.domain.kinds), "declare it there")
            yield f"{where}: {local(value)} is no class of domain.ttl; {remedy}"
        return
    prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
    if prop is None:
        known_ones = map(local, kg.domain.properties)
        remedy = _instead(local(predicate), known_ones, "declare it there as an rdf:Property")
        yield f"{where}: {local(predicate)} is not declared in domain.ttl; {remedy}"
        return
    if prop.domain and not kg.is_a(subject, [prop.domain]):
        wanted, is_ = a(_label(kg, prop.domain)), a(kg.kind_label(subject))
        remedy = "take it away, or correct the class"
        if not kg.classes(subject):
            is_, remedy = "something without a class", "give it one in attributes.ttl"
        yield f"{where}: {local(predicate)} is for {wanted}, not {is_}; {remedy}"
    yield from _range(kg, where, prop, value)


def _instead(name: str, known: Iterable[str], otherwise: str) -> str:
    near = nearest(name, sorted(set(known)), 1)
    return f"the nearest there is {near[0]}" if near else otherwise


def _label(kg: Kg, iri: URIRef) -> str:
    return kg.domain.kinds[iri].label if iri in kg.domain.kinds else local(iri)


def _range(kg: Kg, where: str, prop: Property, value: Node) -> Iterator[str]:
    short = local(prop.iri)
    if prop.range in _CHECKED_DATATYPES:
        wanted = _CHECKED_DATATYPES[prop.range]
        if not isinstance(value, Literal) or type(value.toPython()) is not wanted:
            remedy = f"write {_EXAMPLES.get(prop.range, 'a number')}"
            yield f"{where}: {short} must be {a(local(prop.range))}, not {local(value)}; {remedy}"
    elif str(prop.range).startswith(str(XSD)) or not prop.range:
        return
    elif not isinstance(value, URIRef) or not kg.classes(value):
        known = map(local, kg.instances([prop.range]))
        remedy = _instead(local(value), known, "declare it in attributes.ttl")
        yield f"{where}: {short} is {local(value)}, which is nothing known; {remedy}"
    elif not kg.is_a(value, [prop.range]):
        wanted_kind = a(_label(kg, prop.range))
        told = f"{short} must be {wanted_kind}, {kg.name(value)} is not"
        yield f"{where}: {told}; name {wanted_kind}"


def _several_values(kg: Kg) -> Iterator[str]:
    for prop in kg.domain.properties.values():
        if prop.functional:
            for subject in sorted(set(kg.facts.subjects(prop.iri, None)), key=str):
                values = sorted(local(v) for v in kg.facts.objects(subject, prop.iri))
                if len(values) > 1:
                    told = f"{local(prop.iri)} has {len(values)} values: {' and '.join(values)}"
                    yield f"{_where(kg, subject, prop.iri)}: {told}; keep one"


def _several_kinds(kg: Kg) -> Iterator[str]:
    """Things of two classes that a person teaches, neither of which is the other's superclass."""
    kinds = kg.domain.teachable
    for entity in kg.instances([kind.iri for kind in kinds]):
        stated = [kind for kind in kinds if (entity, RDF.type, kind.iri) in kg.facts]
        others = [k for k in stated if not any(k.iri in o.supers for o in stated if o != k)]
        if len(others) > 1:
            told = " and ".join(a(kind.label) for kind in others)
            yield f"{_where(kg, entity, RDF.type)}: is {told}; it can be only one of them"


def _cycles(kg: Kg) -> Iterator[str]:
    """Things that are in themselves, directly or through others."""
    places = {k.location_property for k in kg.domain.kinds.values() if k.location_property}
    above = {s: o for prop in sorted(places) for s, o in kg.facts.subject_objects(prop)}
    for start in sorted(above, key=str):
        seen, here = [start], above[start]
        while here in above and here not in seen:
            seen.append(here)
            here = above[here]
        if here == start:
            path = " in ".join(kg.name(node) for node in (*seen, start))
            told = f"is in itself: {path}"
            yield f"state.ttl, entry {kg.name(start)}: {told}; give one of them another place"


def _unnamed(kg: Kg) -> Iterator[str]:
    for kind in kg.domain.kinds.values():
        if kind.name_property is None:
            continue
        for subject in sorted(kg.facts.subjects(RDF.type, kind.iri), key=str):
            if (subject, kind.name_property, None) not in kg.facts:
                told = f"lacks its name, {local(kind.name_property)}"
                yield f"{_where(kg, subject, RDF.type)}: {told}; add it"


def _shared_names(kg: Kg) -> Iterator[str]:
    """Names that two things of one class bear: no plan could say which it means."""
    owners: dict[tuple[Node, str], Node] = {}
    for predicate in kg.named_by:
        for subject, name in sorted(kg.facts.subject_objects(predicate), key=str):
            for kind in sorted(kg.facts.objects(subject, RDF.type), key=str):
                other = owners.setdefault((kind, str(name)), subject)
                if other != subject:
                    told = f'its name "{name}" is that of {local(other)} too'
                    yield f"attributes.ttl, entry {local(subject)}: {told}; change one"


def _unknown_needs(kg: Kg) -> Iterator[str]:
    for task in kg.domain.tasks:
        for item in task.required:
            if not kg.find(item):
                names = (str(name) for p in kg.named_by for name in kg.facts.objects(None, p))
                remedy = _instead(item, names, "add it there")
                told = f"needs {item}, which attributes.ttl does not have"
                yield f'tasks.ttl, entry "{task.name}": {told}; {remedy}'
