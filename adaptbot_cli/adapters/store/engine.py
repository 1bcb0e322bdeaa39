"""Graphs from files and to files: Turtle, N-Triples, JSON-LD, RDF/XML; queries and updates."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyoxigraph
from rdflib.term import Node

from adaptbot_cli import bounded
from adaptbot_cli.adapters.store.turtle import BOM, blaming, engine_term, serialize
from adaptbot_cli.core.graph.sparql import in_order, unknown_prefixes
from adaptbot_cli.core.graph.terms import Triple, kept, local, node_of, triple_of
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.errors import KnowledgeError, UsageError

FORMATS: Mapping[str, Any] = {
    "turtle": None,
    "nt": pyoxigraph.RdfFormat.N_TRIPLES,
    "json-ld": pyoxigraph.RdfFormat.JSON_LD,
    "xml": pyoxigraph.RdfFormat.RDF_XML,
}
_BY_SUFFIX = {
    ".nt": pyoxigraph.RdfFormat.N_TRIPLES,
    ".jsonld": pyoxigraph.RdfFormat.JSON_LD,
    ".rdf": pyoxigraph.RdfFormat.RDF_XML,
    ".xml": pyoxigraph.RdfFormat.RDF_XML,
}


def read_graph(paths: Sequence[Path]) -> tuple[list[Triple], dict[str, str]]:
    """Read graphs from files: Turtle, or what the name's ending says; return their triples, and
    the prefixes that they declare.

    Raises:
        KnowledgeError: one cannot be read or is not valid; the message names it and the line.
    """
    triples: list[Triple] = []
    prefixes: dict[str, str] = {}
    for path in paths:
        data = bounded.read_bytes(path, bounded.GRAPH, piped=True)
        form = _BY_SUFFIX.get(path.suffix.lower(), pyoxigraph.RdfFormat.TURTLE)
        bounded.check_graph(data, path, xml=form == pyoxigraph.RdfFormat.RDF_XML)
        with blaming(path, "graph"):
            parser = pyoxigraph.parse(data.removeprefix(BOM.encode()), format=form)
            triples += [triple_of(quad.triple) for quad in parser]
            prefixes |= parser.prefixes
    return triples, prefixes


def write_graph(triples: Iterable[Triple], form: str, prefixes: Mapping[str, str]) -> bytes:
    """Write a graph in a format of `FORMATS`; the same graph gives the same bytes."""
    if form == "turtle":
        return serialize(triples, prefixes).encode("utf-8")
    triples = set(triples)
    if form == "xml":
        _refuse_controls(triples)
    dataset = pyoxigraph.Dataset(pyoxigraph.Quad(*map(engine_term, t)) for t in triples)
    dataset.canonicalize(pyoxigraph.CanonicalizationAlgorithm.RDFC_1_0)
    ordered = sorted((quad.triple for quad in dataset), key=str)
    known = {} if form == "nt" else dict(prefixes)
    data = pyoxigraph.serialize(ordered, format=FORMATS[form], prefixes=known) or b""
    if form == "json-ld":
        return (json.dumps(json.loads(data), ensure_ascii=False, indent=1) + "\n").encode("utf-8")
    return data if data.endswith(b"\n") else data + b"\n"


_CONTROLS = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")


def _refuse_controls(triples: Iterable[Triple]) -> None:
    """Raise KnowledgeError for a character that XML cannot hold, not even escaped."""
    for subject, predicate, value in sorted(triples):
        if found := _CONTROLS.search(str(value)):
            fact = " ".join(map(local, (subject, predicate)))
            text = f"the value of {fact} has the character U+{ord(found[0]):04X}"
            raise KnowledgeError(f"{text}, which XML cannot hold; export another format")


@dataclass(frozen=True, slots=True)
class Answered:
    """What a query gave: rows of terms under their variables, a yes or no, or a graph.

    `json` is the SPARQL 1.1 JSON form of rows and of a yes or no.
    """

    variables: tuple[str, ...] = ()
    rows: tuple[tuple[Node | None, ...], ...] = ()
    truth: bool | None = None
    graph: frozenset[Triple] | None = None
    json: str = ""


def ask(store: pyoxigraph.Store, query: str, prefixes: Mapping[str, str]) -> Answered:
    """Answer a SPARQL query over a store's named graphs, which the default graph is the union of.

    Raises:
        UsageError: it is no valid query.
    """
    try:
        found = _asked(store, query, prefixes)
        if isinstance(found, pyoxigraph.QuerySolutions):
            # The engine gives the columns of SELECT * by the alphabet; rows are made when read.
            ordered = in_order(query, (variable.value for variable in found.variables))
            if ordered != query:
                found = _asked(store, ordered, prefixes)
        if isinstance(found, pyoxigraph.QueryTriples):
            return Answered(graph=frozenset(triple_of(triple) for triple in found))
        form = pyoxigraph.QueryResultsFormat.JSON
        reply = (found.serialize(format=form) or b"").decode("utf-8")
        if isinstance(found, pyoxigraph.QueryBoolean):
            return Answered(truth=bool(found), json=reply)
        again: Any = pyoxigraph.parse_query_results(reply, form)
        names = tuple(variable.value for variable in again.variables)
        rows = tuple(tuple(v and node_of(v) for v in row) for row in again)
        return Answered(names, rows, json=reply)
    except (SyntaxError, ValueError, OSError) as error:
        raise _invalid(error, query, prefixes) from error


def update(
    facts: Iterable[Triple], classes: Iterable[Triple], text: str, prefixes: Mapping[str, str]
) -> frozenset[Triple]:
    """Return the facts as a SPARQL update would leave them; nothing is changed.

    Raises:
        UsageError: it is no valid update, names a graph, or would change the classes.
    """
    schema = set(classes)
    store = pyoxigraph.Store()
    given = {*facts, *schema}
    store.extend(pyoxigraph.Quad(*map(engine_term, triple)) for triple in given)
    try:
        store.update(text, prefixes=dict(prefixes))
    except (SyntaxError, ValueError, OSError) as error:
        raise _invalid(error, text, prefixes) from error
    quads = list(store)
    if any(not isinstance(quad.graph_name, pyoxigraph.DefaultGraph) for quad in quads):
        raise UsageError(
            "write facts without GRAPH: which graph each belongs to is said by its predicate"
        )
    written = {(s, p, kept(o)): (s, p, o) for s, p, o in given}
    left = (triple_of(quad.triple) for quad in quads)
    found = frozenset(written.get(triple, triple) for triple in left)
    if not schema <= found:
        raise UsageError("classes are declared in domain.ttl; edit that file to change them")
    return found - schema


def _asked(store: pyoxigraph.Store, query: str, prefixes: Mapping[str, str]) -> Any:
    return store.query(query, prefixes=dict(prefixes), use_default_graph_as_union=True)


def _invalid(error: Exception, text: str, prefixes: Mapping[str, str]) -> UsageError:
    """What is wrong with a query, in words; the engine's list of characters is for nobody."""
    unknown = unknown_prefixes(text, prefixes)
    if unknown:
        here = sentence_list([f"{name}:" for name in sorted(prefixes)], len(prefixes))
        message = f"the prefix {unknown[0]}: is not known; those known here are {here}"
        return UsageError(f"{message}. Declare others: PREFIX {unknown[0]}: <…>")
    message = " ".join(str(error).split()).partition(", [")[0].partition(" expected one of [")[0]
    return UsageError(f"this is no valid SPARQL: {message}")
