"""Finds misspelt ab: terms in a pack's files: without this they would be passed over."""

from difflib import get_close_matches

from rdflib import BNode, Graph, URIRef
from rdflib.term import Node

from adaptbot_cli.core.terms import AB, TERMS, local
from adaptbot_cli.errors import PackError


def check_terms(graph: Graph, file: str) -> None:
    """Make sure that every ab: term of a file is one, or a subject of the file.

    Raises:
        PackError: one is not; the message names the entry and the nearest term.
    """
    subjects = set(graph.subjects())
    for subject, predicate, value in sorted(graph, key=lambda t: (str(t[1]), str(t[2]))):
        # What ab:graph may be is told by its reader; a subject of the file is a name, no term.
        named = predicate == AB.graph or value in subjects
        for node in (predicate,) if named else (predicate, value):
            if _unknown(node):
                name = local(node)
                near = get_close_matches(name, sorted(TERMS), 1, cutoff=0.0)
                entry = local(_entry(graph, subject))
                raise PackError(
                    f"{file}, entry {entry}: there is no ab:{name}; the nearest is ab:{near[0]}"
                )


def _unknown(node: Node) -> bool:
    return isinstance(node, URIRef) and node.startswith(str(AB)) and local(node) not in TERMS


def _entry(graph: Graph, node: Node) -> Node:
    """The entry that a blank node is a part of."""
    above = graph.transitive_subjects(None, node)
    return next((found for found in above if found and not isinstance(found, BNode)), node)
