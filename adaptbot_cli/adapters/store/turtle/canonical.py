"""A whole graph as a Turtle document in the canonical style."""

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final, TypeAlias

import pyoxigraph
from rdflib import BNode, Literal, URIRef

from adaptbot_cli.adapters.store.turtle.statement import Fact, block, new_row
from adaptbot_cli.adapters.store.turtle.terms import (
    KNOWN_PREFIXES,
    Term,
    Triple,
    Writer,
    check_iri,
    check_text,
    normal,
)
from adaptbot_cli.errors import KnowledgeError

Checked: TypeAlias = tuple[Term, URIRef, Term]

_PREFIX_NAME: Final = re.compile(r"(?:[A-Za-z](?:[A-Za-z0-9_.-]*[A-Za-z0-9_-])?)?")


def serialize(triples: Iterable[Triple], prefixes: Mapping[str, str], header: str = "") -> str:
    """Write a graph as a document that depends on the graph alone.

    `prefixes` maps names to namespaces; all are declared. `header` becomes comment lines at the
    top. Blank nodes get canonical labels (RDFC-1.0). Raises KnowledgeError for a term or a prefix
    that Turtle cannot write.
    """
    spare = {name: space for name, space in KNOWN_PREFIXES.items() if name not in prefixes}
    writer = Writer(dict(prefixes), spare)
    blocks = _blocks(_labelled({_checked(triple) for triple in triples}), writer)
    declared = dict(prefixes) | {name: spare[name] for name in writer.used}
    lines = [declaration(name, declared[name]) for name in sorted(declared)]
    parts = ["\n".join(_comment(line) for line in header.splitlines()), "\n".join(lines), *blocks]
    return "\n\n".join(part for part in parts if part) + "\n"


def declaration(name: str, namespace: str) -> str:
    """Write a prefix declaration; raise KnowledgeError if it would not be valid."""
    if not _PREFIX_NAME.fullmatch(name):
        raise KnowledgeError(f"{name!r} is not a valid prefix; use letters and digits.")
    check_iri(namespace)
    return f"@prefix {name}: <{namespace}> ."


def _comment(line: str) -> str:
    return line if line.startswith("#") else f"# {line}".rstrip()


def _checked(triple: Triple) -> Checked:
    subject, predicate, value = (normal(term) for term in triple)
    if isinstance(subject, Literal) or not isinstance(predicate, URIRef):
        raise KnowledgeError(f"{triple!r} is not a fact: its predicate must be an IRI.")
    return subject, predicate, value


def _blocks(facts: Iterable[Checked], writer: Writer) -> list[str]:
    about: dict[Term, list[Fact]] = {}
    for subject, predicate, value in facts:
        about.setdefault(subject, []).append((predicate, value))
    written = {writer.write(subject): of_it for subject, of_it in about.items()}
    return [new_block(subject, written[subject], writer) for subject in sorted(written)]


def new_block(subject: str, facts: Iterable[Fact], writer: Writer, newline: str = "\n") -> str:
    """Write the block of a subject, its facts in their order."""
    lines = sorted((new_row(fact, writer) for fact in facts), key=lambda row: row.order)
    return block(subject, lines, newline=newline)


def _labelled(facts: set[Checked]) -> set[Checked]:
    """Give blank nodes labels that depend on the graph alone."""
    blank = {fact for fact in facts if any(isinstance(term, BNode) for term in fact)}
    if not blank:
        return facts
    dataset = pyoxigraph.Dataset(pyoxigraph.Quad(*map(_node, fact)) for fact in blank)
    dataset.canonicalize(pyoxigraph.CanonicalizationAlgorithm.RDFC_1_0)
    named = {
        (_term(quad.subject), URIRef(quad.predicate.value), _term(quad.object)) for quad in dataset
    }
    return facts - blank | named


def _node(term: Term) -> Any:
    if isinstance(term, BNode):
        # Any label will do here, as long as it is one: rdflib takes every string.
        return pyoxigraph.BlankNode("b" + str(term).encode("utf-8", "surrogatepass").hex())
    if isinstance(term, URIRef):
        return pyoxigraph.NamedNode(check_iri(term))
    datatype = pyoxigraph.NamedNode(check_iri(term.datatype)) if term.datatype else None
    return pyoxigraph.Literal(check_text(term), datatype=datatype, language=term.language)


def _term(node: Any) -> Term:
    if isinstance(node, pyoxigraph.BlankNode):
        return BNode(node.value)
    if isinstance(node, pyoxigraph.NamedNode):
        return URIRef(node.value)
    datatype = None if node.language else URIRef(node.datatype.value)
    return normal(Literal(node.value, lang=node.language, datatype=datatype))
