"""The small vocabulary in which a domain pack tells the tool about its data."""

import pyoxigraph
from rdflib import BNode, Literal, Namespace, URIRef
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
    Action Domain Task about absentAction absentItem advice advises agent alias ask asks
    attribute before calledAs class datatype default effect equals explain falseWord family fetches
    filler functional goal graph hand hidden holds ifUnknown impliedBy instead insteadMeans
    kindOrder locationProperty message name nameProperty namespace needs of ofProduct optional order
    parameter parameters product prompted property purpose quantifier question requires select
    starts state stateWord trueWord unit value verb verbField when with wordField
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


def node_of(term: object) -> Node:
    """Return a term of the engine's parser as rdflib's."""
    if isinstance(term, pyoxigraph.NamedNode):
        return URIRef(term.value)
    if isinstance(term, pyoxigraph.BlankNode):
        return BNode(term.value)
    if isinstance(term, pyoxigraph.Literal):
        if term.language:
            return Literal(term.value, lang=term.language)
        return Literal(term.value, datatype=URIRef(term.datatype.value))
    raise ValueError(f"{term} is no IRI, blank node or literal")


ACTION_PARTS = frozenset({AB.parameter, AB.requires, AB.calledAs})
"""What leads from a taught action to its parts, which are nodes with names."""
