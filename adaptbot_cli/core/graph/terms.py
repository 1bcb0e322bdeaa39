"""The vocabulary of domain packs, RDF terms as this program uses them, and its datatypes."""

from collections.abc import Hashable, Iterable, Mapping
from functools import lru_cache
from typing import Any

import pyoxigraph
from rdflib import XSD, BNode, Literal, Namespace, URIRef
from rdflib.term import Node

AB = Namespace("urn:adaptbot:")
"""The tool's own vocabulary; every term is explained in docs/domains.md."""

ATTRIBUTES: URIRef = AB.attribute
"""The named graph G_k: what things are and can do (paper, III-A)."""

STATES: URIRef = AB.state
"""The named graph G_s: where things are and how they are now (paper, III-A)."""

SCHEMA: URIRef = AB.schema
"""The named graph of the domain's classes, which path queries need beside the facts."""

TERMS: frozenset[str] = frozenset(
    """
    Action Constraint Domain Task TaskClass about absentAction absentItem advice advises agent
    alias allergyTo ask asks attribute before calledAs class datatype default diet effect equals
    explain fails falseWord family fetches filedBy filler functional goal graph hand hidden holds
    ifUnknown impliedBy instead insteadMeans irreversible kindOrder locationProperty message name
    nameProperty
    namespace needs of ofProduct optional order parameter parameters places preposition product
    partWord prompted property purpose quantifier question requires select servings starts state
    stateWord
    trueWord unit value verb verbField when with wordField
    """.split()  # noqa: SIM905 - a list would take a page
)
"""Every ab: term that means something in a pack's files; any other is a slip of the pen."""

FACT_TERMS: frozenset[URIRef] = frozenset({AB.alias, AB.absentItem, AB.absentAction})
"""The ab: terms that stand among the facts."""

Triple = tuple[Node, Node, Node]
TRUE, FALSE = Literal(True), Literal(False)


def local(node: Node) -> str:
    """Return the last part of an IRI, or a literal's text: the short name people read."""
    text = str(node)
    if not isinstance(node, URIRef):
        return text
    return text.rsplit("#", 1)[-1].rsplit("/", 1)[-1].rsplit(":", 1)[-1] or text


def ordered(triples: Iterable[Triple]) -> list[Triple]:
    """Return triples sorted by their texts: many times faster than by rdflib's own order."""

    def texts(triple: Triple) -> tuple[str, ...]:
        value = triple[2]
        kind = f"{value.datatype} {value.language}" if isinstance(value, Literal) else ""
        return str(triple[0]), str(triple[1]), str(value), kind

    return sorted(triples, key=texts)


@lru_cache(maxsize=65536)
def node_of(term: Hashable) -> Node:
    """Return a term of the engine's parser as rdflib's. Raises ValueError: there is none."""
    if isinstance(term, pyoxigraph.NamedNode):
        return URIRef(term.value)
    if isinstance(term, pyoxigraph.BlankNode):
        return BNode(term.value)
    if isinstance(term, pyoxigraph.Literal):
        if term.language:
            return Literal(term.value, lang=term.language)
        datatype = URIRef(term.datatype.value)
        # rdflib writes all digits of 1E999999999, and knows no limit to a duration.
        if datatype == XSD.decimal and "e" in term.value.lower():
            raise ValueError(f'"{term.value[:40]}" is no decimal number')
        try:
            return Literal(term.value, datatype=datatype)
        except (ArithmeticError, ValueError) as problem:
            text = f'"{term.value[:40]}" is no value of {local(datatype)}'
            raise ValueError(text) from problem
    raise ValueError(f"{term} is no IRI, blank node or literal")


@lru_cache(maxsize=65536)
def term_of(node: Node) -> Any:
    """Return an rdflib term as the engine's. Raises ValueError for what is no term."""
    if isinstance(node, URIRef):
        return pyoxigraph.NamedNode(node)
    if isinstance(node, BNode):
        return pyoxigraph.BlankNode(node)
    if isinstance(node, Literal):
        if node.language:
            return pyoxigraph.Literal(node, language=node.language)
        datatype = pyoxigraph.NamedNode(node.datatype) if node.datatype else None
        return pyoxigraph.Literal(node, datatype=datatype)
    raise ValueError(f"{node} is no IRI, blank node or literal")


@lru_cache(maxsize=4096)
def kept(node: Node) -> Node:
    """Return the store's canonical form of a term: 1.50 as 1.5.

    Raises:
        ValueError: it is no term.
    """
    if not isinstance(node, Literal) or node.datatype in (None, XSD.string):
        return node
    store, name = pyoxigraph.Store(), pyoxigraph.NamedNode(AB)
    store.add(pyoxigraph.Quad(name, name, term_of(node)))
    return node_of(next(iter(store)).object)


def triple_of(triple: pyoxigraph.Triple) -> Triple:
    """Return a triple of the engine as rdflib's."""
    return node_of(triple.subject), node_of(triple.predicate), node_of(triple.object)


ACTION_PARTS = frozenset({AB.parameter, AB.requires, AB.calledAs})
"""What leads from a taught action to its parts, which are nodes with names."""


DATATYPES: Mapping[URIRef, str] = {
    XSD.boolean: "true or false",
    XSD.string: 'a text in quotes, such as "egg"',
    XSD.integer: "a whole number, such as 3",
    XSD.decimal: "a number, such as 1.75",
    XSD.double: "a number, such as 1.75e0",
    XSD.float: 'a number, such as "1.75"^^xsd:float',
    XSD.date: 'a date, such as "2024-05-31"^^xsd:date',
    XSD.dateTime: 'a date and time, such as "2024-05-31T12:00:00"^^xsd:dateTime',
}
"""How a value of each is written in a file."""

NUMBERS: Mapping[URIRef, str] = {
    XSD.integer: "whole number",
    XSD.decimal: "number",
    XSD.double: "number",
    XSD.float: "number",
}
"""What a person is asked for."""

WRITTEN: tuple[URIRef, ...] = (XSD.boolean, *NUMBERS, XSD.string)
"""Those that an argument of a call in a plan can have."""


def is_value(value: Node, datatype: URIRef) -> bool:
    """Tell whether a term is a value of a datatype; a whole number is a decimal too, and a text in
    a language is a text."""
    if not isinstance(value, Literal) or value.ill_typed:
        return False
    if value.language:
        return datatype == XSD.string
    is_decimal = datatype == XSD.decimal and value.datatype == XSD.integer
    return is_decimal or (value.datatype or XSD.string) == datatype
