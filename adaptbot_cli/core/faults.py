"""What is wrong with a graph's facts, in plain words."""

from collections.abc import Iterator

from rdflib import RDF, RDFS, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Condition, Property
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import a
from adaptbot_cli.core.terms import AB, ATTRIBUTES, FACT_TERMS, STATES, local

_CHECKED_DATATYPES = {XSD.boolean: bool, XSD.string: str, XSD.integer: int}


def faults(kg: Kg) -> list[str]:
    """Return a sentence for each fact that the domain does not allow; none if all is well."""
    found = [fault for triple in sorted(_facts(kg)) for fault in _fact(kg, *triple)]
    found += _several_values(kg)
    found += _several_kinds(kg)
    found += _cycles(kg)
    found += _unnamed(kg)
    found += _unknown_needs(kg)
    found += _unknown_classes(kg)
    found += _unknown_predicates(kg)
    return list(dict.fromkeys(found))


def _facts(kg: Kg) -> Iterator[tuple[Node, Node, Node]]:
    for name in (ATTRIBUTES, STATES):
        yield from kg.graph(name)


def _fact(kg: Kg, subject: Node, predicate: Node, value: Node) -> Iterator[str]:
    name = kg.name(subject)
    if str(predicate).startswith(str(AB)):
        if predicate not in FACT_TERMS:
            known = ", ".join(f"ab:{local(term)}" for term in sorted(FACT_TERMS))
            yield f"{name}: ab:{local(predicate)} means nothing among the facts; {known} do"
        return
    if predicate == RDF.type:
        if value not in kg.domain.kinds:
            yield f"{name}: {local(value)} is no class of this domain"
        return
    prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
    if prop is None:
        yield f"{name}: {local(predicate)} is not declared in domain.ttl"
        return
    if not kg.is_a(subject, [prop.domain]):
        wanted = _label(kg, prop.domain)
        yield f"{name}: {local(predicate)} is for {a(wanted)}, not {a(kg.kind_label(subject))}"
    yield from _range(kg, name, prop, value)


def _label(kg: Kg, iri: URIRef) -> str:
    return kg.domain.kinds[iri].label if iri in kg.domain.kinds else local(iri)


def _range(kg: Kg, name: str, prop: Property, value: Node) -> Iterator[str]:
    short = local(prop.iri)
    if prop.range in _CHECKED_DATATYPES:
        wanted = _CHECKED_DATATYPES[prop.range]
        if not isinstance(value, Literal) or type(value.toPython()) is not wanted:
            yield f"{name}: {short} must be {a(local(prop.range))}, not {local(value)}"
    elif not isinstance(value, URIRef) or not kg.classes(value):
        yield f"{name}: {short} is {local(value)}, which is nothing known"
    elif not kg.is_a(value, [prop.range]):
        wanted_kind = _label(kg, prop.range)
        yield f"{name}: {short} must be {a(wanted_kind)}, {kg.name(value)} is not"


def _several_values(kg: Kg) -> Iterator[str]:
    for prop in kg.domain.properties.values():
        if prop.functional:
            for subject in sorted(set(kg.facts.subjects(prop.iri, None)), key=str):
                values = sorted(local(v) for v in kg.facts.objects(subject, prop.iri))
                if len(values) > 1:
                    told = " and ".join(values)
                    yield f"{kg.name(subject)}: {local(prop.iri)} has {len(values)} values: {told}"


def _several_kinds(kg: Kg) -> Iterator[str]:
    """Things of two classes that a person teaches, neither of which is the other's superclass."""
    kinds = kg.domain.teachable
    for entity in kg.instances([kind.iri for kind in kinds]):
        stated = [kind for kind in kinds if (entity, RDF.type, kind.iri) in kg.facts]
        others = [k for k in stated if not any(k.iri in o.supers for o in stated if o != k)]
        if len(others) > 1:
            told = " and ".join(a(kind.label) for kind in others)
            yield f"{kg.name(entity)}: is {told}; it can be only one of them"


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
            yield f"{kg.name(start)}: is in itself: {path}"


def _unnamed(kg: Kg) -> Iterator[str]:
    for kind in kg.domain.kinds.values():
        if kind.name_property is None:
            continue
        for subject in sorted(kg.facts.subjects(RDF.type, kind.iri), key=str):
            if (subject, kind.name_property, None) not in kg.facts:
                yield f"{local(subject)}: lacks its name, {local(kind.name_property)}"


def _unknown_needs(kg: Kg) -> Iterator[str]:
    for task in kg.domain.tasks:
        for item in task.required:
            if not kg.find(item):
                yield f'tasks.ttl: "{task.name}" needs {item}, which attributes.ttl does not have'


def _unknown_classes(kg: Kg) -> Iterator[str]:
    """Classes that an action or a property names and domain.ttl does not declare."""
    kinds = kg.domain.kinds
    for action in kg.domain.actions.values():
        for parameter in action.parameters:
            for iri in parameter.classes:
                if iri not in kinds:
                    where = f"actions.ttl, entry {action.name}: parameter {parameter.name}"
                    yield f"{where}: {local(iri)} is no class of domain.ttl"
    for prop in kg.domain.properties.values():
        if prop.domain not in kinds:
            yield f"domain.ttl, entry {local(prop.iri)}: {local(prop.domain)} is no class of it"
    for kind in kinds.values():
        for iri in (*kind.asks, *(start.prop for start in kind.starts)):
            if iri not in kg.domain.properties:
                yield f"domain.ttl, entry {local(kind.iri)}: {local(iri)} is no property of it"


def _unknown_predicates(kg: Kg) -> Iterator[str]:
    """What a condition of an action names and neither domain.ttl nor any fact knows."""
    for action in kg.domain.actions.values():
        purposes = (action.purpose,) if action.purpose else ()
        for condition in (*action.conditions, *action.advises, *purposes):
            yield from _unknown_in(kg, f"actions.ttl, entry {action.name}", condition)


def _unknown_in(kg: Kg, where: str, condition: Condition) -> Iterator[str]:
    known = {*kg.domain.properties, *kg.domain.kinds, RDF.type, RDFS.subClassOf, kg.domain.agent}
    for iri in sorted(condition.predicates - known):
        if not iri.startswith(str(XSD)) and (iri, None, None) not in kg.facts:
            yield f'{where}: {local(iri)} in "{condition.message}" is not declared in domain.ttl'
