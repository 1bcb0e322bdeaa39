"""Finds misspelt terms and stray entries in a pack's files, which would be passed over."""

from collections.abc import Collection
from difflib import get_close_matches

from rdflib import RDF, RDFS, BNode, Graph, URIRef
from rdflib.term import Node

from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.terms import AB, TERMS, local
from adaptbot_cli.core.pack.entry import Notes

_SPACES: tuple[tuple[str, str, frozenset[str]], ...] = (
    ("ab", str(AB), TERMS),
    ("rdf", str(RDF), frozenset(["type", "first", "rest", "nil", "Property", "List", "value"])),
    (
        "rdfs",
        str(RDFS),
        frozenset(
            "Class label comment subClassOf domain range seeAlso isDefinedBy member".split()  # noqa: SIM905
        ),
    ),
)
"""The vocabularies of which a pack may use only these terms: any other is a slip of the pen."""


def check_terms(graph: Graph, file: str, notes: Notes) -> None:
    """Note every term of a file's vocabularies that is none; a subject of the file is a name."""
    subjects = set(graph.subjects())
    for subject, predicate, value in sorted(graph, key=lambda t: (str(t[1]), str(t[2]))):
        # What ab:graph may be is told by its reader.
        named = predicate == AB.graph or value in subjects
        for node in (predicate,) if named else (predicate, value):
            term = _unknown(node)
            if term is not None:
                entry = (local(_entry(graph, subject)),)
                remedy = f"the nearest is {term[1]}"
                notes.add(Fault(f"there is no {term[0]}", remedy, file, entry))


def check_types(graph: Graph, file: str, types: Collection[Node], notes: Notes) -> None:
    """Note every entry of a file without a type that no other entry refers to."""
    for subject in sorted({s for s in graph.subjects() if isinstance(s, URIRef)}):
        stated = set(graph.objects(subject, RDF.type))
        misspelt = any(_unknown(kind) for kind in stated)
        named = any(str(p).startswith(str(AB)) for p in graph.predicates(None, subject))
        if misspelt or stated & set(types) or named:
            continue
        meant = " or ".join(f'"a {_short(kind)}"' for kind in types)
        notes.add(Fault("says not what it is", f"write {meant}", file, (local(subject),)))


def _short(kind: Node) -> str:
    prefixes = (prefix for prefix, space, _ in _SPACES if str(kind).startswith(space))
    return ":".join([*prefixes, local(kind)])


def _unknown(node: Node) -> tuple[str, str] | None:
    """A term that is none and the nearest one; None for what is no such term."""
    if not isinstance(node, URIRef):
        return None
    for prefix, space, terms in _SPACES:
        if node.startswith(space) and node[len(space) :] not in terms:
            name = node[len(space) :]
            near = get_close_matches(name, sorted(terms), 1, cutoff=0.0)
            return f"{prefix}:{name}", f"{prefix}:{near[0]}"
    return None


def _entry(graph: Graph, node: Node) -> Node:
    """The entry that a blank node is a part of."""
    above = graph.transitive_subjects(None, node)
    return next((found for found in above if found and not isinstance(found, BNode)), node)
