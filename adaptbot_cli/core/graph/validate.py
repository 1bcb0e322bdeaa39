"""What is wrong with a graph's facts.

`faults` judges a whole graph; `new_faults` what one change of it would break, by looking only at
the things that the change touches, so that its time does not grow with the graph.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import pyoxigraph
from rdflib import RDF, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Domain, Property
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.faults import Fault, fault_of
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.lint import misnamed
from adaptbot_cli.core.graph.robots import hand_faults
from adaptbot_cli.core.graph.terms import (
    AB,
    ATTRIBUTES,
    DATATYPES,
    FACT_TERMS,
    STATES,
    Triple,
    is_value,
    local,
    node_of,
    term_of,
)
from adaptbot_cli.core.names import a, nearest_remedy

Facts = Sequence[Triple]

_MANY = 500
"""From so many things on, those that may have a fault are sought in the engine first."""


def faults(kg: Kg) -> list[Fault]:
    """Return what the domain does not allow in the whole graph and pack; none if all is well.

    A home may lack what a task needs: that is `lacking`.
    """
    return _some_faults(kg, None, pack=True)


def new_faults(kg: Kg, delta: Delta, domain: Domain | None = None) -> list[Fault]:
    """Return the faults that a change would bring: there with it and not without it.

    `domain` is the domain that holds after the change, if that changes too. The graph is as it was
    when this returns.
    """
    other = domain is not None and domain != kg.domain
    change = _effective(kg, delta)
    named_by = {RDF.type, AB.alias, *kg.named_by}  # what the pack refers to things by
    pack = other or any(predicate in named_by for _, predicate, _ in change.removed)
    touched, changed = _touched(kg, change), kg.under(domain or kg.domain)
    changed.learn(change)
    try:
        after = _some_faults(changed, touched | _touched(changed, change), pack)
    finally:
        changed.learn(change.inverse)
    before = _some_faults(kg.under(kg.domain), touched, pack) if after else []
    known = {fault.key for fault in before}
    return [fault for fault in after if fault.key not in known]


def _effective(kg: Kg, delta: Delta) -> Delta:
    """The effective delta: additions not yet present, removals that are."""
    removed, added = (
        frozenset(triple for triple in triples if (triple in kg.facts) == there)
        for triples, there in ((delta.removed - delta.added, True), (delta.added, False))
    )
    return Delta(removed, added)


def _some_faults(kg: Kg, touched: set[Node] | None, pack: bool) -> list[Fault]:
    """The faults of some things, or of all."""
    if touched is None or len(touched) > _MANY:
        likely = _suspects(kg)
        touched = likely if touched is None else likely & touched
    found = [fault for about in sorted(touched, key=str) for fault in _of(kg, about)]
    found += misnamed(kg) if pack else ()
    return list(dict.fromkeys(found))


def _touched(kg: Kg, delta: Delta) -> set[Node]:
    """The things that a change is about, and those that point at one whose class it changes."""
    changed = delta.removed | delta.added
    found = {subject for subject, _, _ in changed}
    retyped = {subject for subject, predicate, _ in changed if predicate == RDF.type}
    return found | {s for thing in retyped for s in kg.facts.subjects(None, thing)}


def _suspects(kg: Kg) -> set[Node]:
    """The things that may have a fault: all that have one, and few others.

    The engine finds them; `_of` judges them. Time is in proportion to the facts.
    """
    properties, kinds = kg.domain.properties.values(), kg.domain.classes.values()
    single = [RDF.type, *(prop.iri for prop in properties if prop.functional)]
    named = [(kind.iri, kind.name_property) for kind in kinds if kind.name_property]
    found = {
        thing
        for query in (
            f"VALUES ?p {{ {_n3(single)} }} ?s ?p ?o, ?b FILTER(!sameTerm(?o, ?b))",
            f"VALUES ?p {{ {_n3([AB.alias, *kg.named_by])} }} ?s ?p ?o . ?b ?p ?o "
            "FILTER(!sameTerm(?s, ?b))",
            f"VALUES (?k ?p) {{ {' '.join(f'({_n3(pair)})' for pair in named)} }} "
            "?s a ?k FILTER NOT EXISTS { ?s ?p ?o }",
        )
        for (thing,) in _asked(kg, f"SELECT DISTINCT ?s WHERE {{ {query} }}")
    }
    typed = [p.iri for p in properties if p.range not in (XSD.string, *kg.domain.classes)]
    values = f"SELECT DISTINCT ?p ?o WHERE {{ VALUES ?p {{ {_n3(typed)} }} ?s ?p ?o }}"
    rows: Any = kg.facts.engine.query(values, use_default_graph_as_union=True)
    for prop, value in rows:
        # In the engine's terms: rdflib makes something else of what is ill-typed.
        if getattr(node_of(value), "ill_typed", False):
            quads = kg.engine.quads_for_pattern(None, prop, value, None)
            found |= {node_of(quad.subject) for quad in quads}
    return found | _misfitting(kg) | _in_rings(kg) | set(kg.robots)


_SHAPES = f"""
    SELECT ?k ?p ?c ?d (SAMPLE(?o) AS ?value) WHERE {{
      VALUES ?g {{ <{ATTRIBUTES}> <{STATES}> }}
      GRAPH ?g {{ ?s ?p ?o }}
      OPTIONAL {{ ?s a ?k }}
      OPTIONAL {{ ?o a ?c }}
      BIND(DATATYPE(?o) AS ?d)
    }} GROUP BY ?k ?p ?c ?d"""


def _misfitting(kg: Kg) -> set[Node]:
    """The things with a fact that does not fit.

    There are few combinations of the class of a thing, a predicate, and the class or the datatype
    of a value: each is judged once, in a home that has one thing of each class.
    """

    def one(kind: Node) -> URIRef:
        """The thing of a class."""
        return URIRef(f"{AB}one/{kind}")

    shapes = list(_asked(kg, _SHAPES))
    kinds = {kind for k, _, c, *_ in shapes for kind in (k, c) if kind is not None}
    model = Kg.load(kg.domain, [(one(kind), RDF.type, kind) for kind in kinds], ())
    found: set[Node] = set()
    for k, p, c, d, sample in shapes:
        value = k if p == RDF.type else one(c) if c else sample
        if k is None or next(_misfit(model, one(k), p, value), None):
            given = {n: node for n, node in zip("kpcd", (k, p, c, d), strict=True) if node}
            names = " ".join(f"?{name}" for name in given)
            of = "?s a ?k" if k else "FILTER NOT EXISTS { ?s a ?k }"
            end = "FILTER(DATATYPE(?o) = ?d)" if d else "FILTER NOT EXISTS { ?o a ?c }"
            query = f"SELECT ?s {names} WHERE {{ ?s ?p ?o . {of} . {'?o a ?c' if c else end} }}"
            found |= {thing for thing, *_ in _asked(kg, query, **given)}
    return found


def _asked(kg: Kg, query: str, **given: Node) -> Iterator[tuple[Any, ...]]:
    """The rows of a query of this module, which needs no clock: its time is that of the facts."""
    bound = {pyoxigraph.Variable(name): term_of(node) for name, node in given.items()}
    rows: Any = kg.facts.engine.query(query, use_default_graph_as_union=True, substitutions=bound)
    return (tuple(term and node_of(term) for term in row) for row in rows)


def _n3(iris: Iterable[Node]) -> str:
    """Write IRIs of the domain as a query has them."""
    return " ".join(str(term_of(iri)) for iri in iris)


def _in_rings(kg: Kg) -> set[Node]:
    """The things that may be in themselves: what is in something and has something in it, without
    those from which a way leads out."""
    inside: dict[Node, set[Node]] = {}
    places = f"{{ {_n3(kg.domain.locations)} }}"
    held = f"FILTER EXISTS {{ VALUES ?into {places} ?x ?into ?s }}"
    for thing, place in _asked(kg, f"SELECT ?s ?o WHERE {{ VALUES ?p {places} ?s ?p ?o {held} }}"):
        inside.setdefault(thing, set()).add(place)
    while out := [node for node, places in inside.items() if not places & inside.keys()]:
        for node in out:
            del inside[node]
    return set(inside)


def _of(kg: Kg, about: Node) -> Iterator[Fault]:
    """The faults of one thing, from all its facts."""
    graphs = (kg.graph(name) for name in (ATTRIBUTES, STATES))
    known = sorted(triple for graph in graphs for triple in graph.triples((about, None, None)))
    types = [value for _, predicate, value in known if predicate == RDF.type]
    if types:
        for triple in known:
            for problem, remedy, *unknown in _misfit(kg, *triple):
                yield fault_of(kg, about, problem, remedy, [triple], *unknown)
        yield from _several_kinds(kg, about, types)
        yield from _unnamed(kg, about, known, types)
        yield from hand_faults(kg, about) if about in kg.robots else ()
    elif any(predicate not in FACT_TERMS for _, predicate, _ in known):
        remedy = "give it a class in attributes.ttl"
        yield fault_of(kg, about, "nothing says what it is", remedy, known)
    elif all(action.iri != about for action in kg.domain.actions.values()):
        for triple in known:
            if triple[1] == AB.alias:  # absence is stated of the domain
                text = f"has the other name {triple[2]}, but is nothing known"
                yield fault_of(kg, about, text, "take it away", [triple])
    yield from _several_values(kg, about, known)
    yield from _shared_name(kg, about, known)
    yield from _shared_alias(kg, known)
    yield from _inside_itself(kg, about)


def _misfit(kg: Kg, subject: Node, predicate: Node, value: Node) -> Iterator[tuple[str, ...]]:
    """The problem, the remedy and, if that is the problem, the name that stands for nothing."""
    if str(predicate).startswith(str(AB)):
        if predicate not in FACT_TERMS:
            terms = ", ".join(f"ab:{local(term)}" for term in sorted(FACT_TERMS))
            yield f"ab:{local(predicate)} means nothing among the facts", f"{terms} do"
        return
    if predicate == RDF.type:
        if value not in kg.domain.classes:
            remedy = nearest_remedy(local(value), map(local, kg.domain.classes), "declare it there")
            yield f"{local(value)} is no class of domain.ttl", remedy, local(value)
        return
    prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
    if prop is None:
        known = map(local, kg.domain.properties)
        remedy = nearest_remedy(local(predicate), known, "declare it there as an rdf:Property")
        yield f"{local(predicate)} is not declared in domain.ttl", remedy, local(predicate)
        return
    unclear = prop.domain not in kg.domain.classes or _of_no_class(kg, subject)
    if prop.domain and not unclear and not kg.is_a(subject, [prop.domain]):
        wanted, found = a(kg.domain.label(prop.domain)), a(kg.kind_label(subject))
        text = f"{_called(prop)} is for {wanted}, not {found}"
        yield text, "take it away, or correct the class"
    yield from _range(kg, prop, value)


def _of_no_class(kg: Kg, thing: Node) -> bool:
    """Whether a thing's class is unknown: that is one fault, not one more for each fact of it."""
    return any(kind not in kg.domain.classes for kind in kg.facts.objects(thing, RDF.type))


def _called(prop: Property) -> str:
    """A property in words that people use, and by its name in the files."""
    short = local(prop.iri)
    return short if prop.label == short else f"{prop.label} ({short})"


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
    elif prop.range not in kg.domain.classes or _of_no_class(kg, value):
        return
    elif not isinstance(value, URIRef) or not kg.classes(value):
        known = kg.alike(local(value), [prop.range])
        remedy = nearest_remedy(local(value), known, "declare it in attributes.ttl")
        yield f"{short} is {local(value)}, which is nothing known", remedy
    elif not kg.is_a(value, [prop.range]):
        wanted = a(kg.domain.label(prop.range))
        yield f"{short} must be {wanted}, {kg.name(value)} is not", f"name {wanted}"


def _several_values(kg: Kg, about: Node, known: Facts) -> Iterator[Fault]:
    for predicate in dict.fromkeys(predicate for _, predicate, _ in known):
        prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
        these = [triple for triple in known if triple[1] == predicate]
        if prop is not None and prop.functional and len(these) > 1:
            values = " and ".join(sorted(kg.name(value) for _, _, value in these))
            text = f"{_called(prop)} has {len(these)} values: {values}"
            yield fault_of(kg, about, text, "keep one", these)


def _several_kinds(kg: Kg, about: Node, types: Sequence[Node]) -> Iterator[Fault]:
    """Things of two classes that a person teaches, neither of which is the other's superclass."""
    stated = [kind for kind in kg.domain.teachable if kind.iri in types]
    others = [k for k in stated if not any(k.iri in o.superclasses for o in stated if o != k)]
    if len(others) > 1:
        text = f"is {' and '.join(a(kind.label) for kind in others)}"
        facts = [(about, RDF.type, kind.iri) for kind in others]
        yield fault_of(kg, about, f"{text}; it can be only one of them", "", facts)


def _unnamed(kg: Kg, about: Node, known: Facts, types: Sequence[Node]) -> Iterator[Fault]:
    predicates = {predicate for _, predicate, _ in known}
    for kind in (kg.domain.classes[iri] for iri in types if iri in kg.domain.classes):  # type: ignore[index]
        if kind.name_property is not None and kind.name_property not in predicates:
            text = f"lacks its name, {local(kind.name_property)}"
            yield fault_of(kg, about, text, "add it", [(about, RDF.type, kind.iri)])


def _shared_name(kg: Kg, about: Node, known: Facts) -> Iterator[Fault]:
    """Names that two things of one class bear: no plan could say which it means."""
    types = {value for _, predicate, value in known if predicate == RDF.type}
    for _, predicate, name in (triple for triple in known if triple[1] in kg.named_by):
        for other in sorted(set(kg.facts.subjects(predicate, name)) - {about}, key=str):
            if types & set(kg.facts.objects(other, RDF.type)):
                first, second = sorted((about, other), key=str)
                text = f'its name "{name}" is that of {local(first)} too'
                facts = frozenset({(first, predicate, name), (second, predicate, name)})
                entry = (local(second),)
                yield Fault(text, "change one", "attributes.ttl", entry, second, facts)


def _shared_alias(kg: Kg, known: Facts) -> Iterator[Fault]:
    """Another name that two things share, so that it identifies neither."""
    for _, _, value in (triple for triple in known if triple[1] == AB.alias):
        bearers = sorted(kg.facts.subjects(AB.alias, value), key=str)
        if len(bearers) > 1:
            text = f'its other name "{value}" is that of '
            text += " and ".join(kg.name(bearer) for bearer in bearers[1:])
            facts = [(bearer, AB.alias, value) for bearer in bearers]
            yield fault_of(kg, bearers[0], f"{text} too", "keep one", facts)


def _inside_itself(kg: Kg, about: Node) -> Iterator[Fault]:
    """A thing that is in itself, directly or through others: one fault for the whole ring."""
    way = _way_back(kg, about)
    if way:
        start = way.index(min(way, key=str))
        way = [*way[start:], *way[:start]]
        path = " in ".join(kg.name(node) for node in (*way, way[0]))
        ring = list(zip(way, (*way[1:], way[0]), strict=True))
        links = [(one, place, other) for one, other in ring for place in kg.domain.locations]
        facts = [link for link in links if link in kg.facts]
        remedy = "give one of them another place"
        yield fault_of(kg, way[0], f"is in itself: {path}", remedy, facts)


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
