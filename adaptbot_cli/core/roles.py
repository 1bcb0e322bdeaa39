"""What the IRIs of a query stand for in it: properties and classes, or things."""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from rdflib import RDF, URIRef

from adaptbot_cli.core.sparql import mentions


@lru_cache(maxsize=1024)
def things_in(query: str) -> frozenset[URIRef]:
    """Return the IRIs of a query that stand for things: neither as a predicate nor as a class.

    A query that cannot be taken apart has none.
    """
    from rdflib.plugins.sparql.algebra import translateQuery
    from rdflib.plugins.sparql.parser import parseQuery

    try:
        algebra = translateQuery(parseQuery(query)).algebra
    except Exception:  # its parser raises many kinds; the engine tells what is no valid query
        return frozenset()
    return mentions(query) - set(_terms(algebra))


def _terms(part: Any) -> Iterator[URIRef]:
    """The predicates and classes of the triples below a node of the algebra."""
    if isinstance(part, dict):
        # get of rdflib's nodes gives the key itself where there is none
        for _, predicate, value in dict.get(part, "triples") or ():
            yield from _path(predicate)
            if predicate == RDF.type and isinstance(value, URIRef):
                yield value
        for below in part.values():
            yield from _terms(below)
    elif isinstance(part, list | tuple | set):
        for below in part:
            yield from _terms(below)


def _path(predicate: Any) -> Iterator[URIRef]:
    """The predicates that a property path is made of."""
    if isinstance(predicate, URIRef):
        yield predicate
    parts = getattr(predicate, "args", None) or [
        getattr(predicate, name) for name in ("arg", "path") if hasattr(predicate, name)
    ]
    for part in parts:
        yield from _path(part)
