"""Reads a domain pack's Turtle files into a domain and a knowledge graph."""

import io
from pathlib import Path

import pyoxigraph
from oxrdflib._converter import from_ox
from rdflib import Graph

from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.pack import Sources, read_domain
from adaptbot_cli.core.terms import Triple
from adaptbot_cli.errors import KnowledgeError

DOMAIN_FILES = ("domain.ttl", "actions.ttl", "tasks.ttl")
FACT_FILES = ("attributes.ttl", "state.ttl")


def load_kg(files: dict[str, bytes], where: str) -> Kg:
    """Build the graph of a domain from the bytes of its five files.

    Raises:
        KnowledgeError: a file is missing or is no valid Turtle; the message names file and line.
        PackError: an entry of the domain does not make sense.
    """
    for name in (*DOMAIN_FILES, *FACT_FILES):
        if name not in files:
            raise KnowledgeError(f"{where} lacks {name}; a domain has five .ttl files")
    graphs = {name: parse(files[name], f"{where}/{name}") for name in DOMAIN_FILES}
    domain = read_domain(
        Sources(graphs["domain.ttl"], graphs["actions.ttl"], graphs["tasks.ttl"])
    )
    facts = [triples(files[name], f"{where}/{name}") for name in FACT_FILES]
    return Kg.load(domain, facts[0], facts[1])


def read_files(folder: Path) -> dict[str, bytes]:
    """Return the contents of a pack's files, those that are there.

    Raises:
        KnowledgeError: the folder cannot be read.
    """
    try:
        return {path.name: path.read_bytes() for path in sorted(folder.glob("*.ttl"))}
    except OSError as error:
        raise KnowledgeError(f"cannot read {folder}: {error.strerror}") from error


def parse(data: bytes, path: str) -> Graph:
    """Parse a Turtle file into a graph that remembers its prefixes. Raises KnowledgeError."""
    parser = _parser(data)
    graph = Graph(bind_namespaces="none")
    for triple in _all(parser, path):
        graph.add(triple)
    for prefix, iri in parser.prefixes.items():
        graph.bind(prefix, iri)
    return graph


def triples(data: bytes, path: str) -> list[Triple]:
    """Parse a Turtle file into its triples. Raises KnowledgeError."""
    return _all(_parser(data), path)


def _parser(data: bytes) -> "pyoxigraph.QuadParser":
    return pyoxigraph.parse(io.BytesIO(data), format=pyoxigraph.RdfFormat.TURTLE)


def _all(parser: "pyoxigraph.QuadParser", path: str) -> list[Triple]:
    try:
        return [from_ox(quad.triple) for quad in parser]
    except SyntaxError as error:
        line = f", line {error.lineno}" if error.lineno else ""
        raise KnowledgeError(f"{path}{line}: this is no valid Turtle: {error.msg}") from error
    except (ValueError, UnicodeDecodeError) as error:
        raise KnowledgeError(f"{path}: this is no valid Turtle: {error}") from error
