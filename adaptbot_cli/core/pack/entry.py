"""One entry of a pack's file, with readers that say in a sentence what is wrong with it."""

import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from string import Formatter

import pyoxigraph
from rdflib import RDF, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from adaptbot_cli.core.sparql import bindable, dollars, prefixed
from adaptbot_cli.core.terms import AB, local
from adaptbot_cli.errors import PackError


@dataclass(frozen=True, slots=True)
class Entry:
    """One node of a pack's file, with readers that complain in sentences."""

    graph: Graph
    file: str
    entry: str
    node: URIRef

    @classmethod
    def of(cls, graph: Graph, file: str, node: Node, entry: str = "") -> "Entry":
        """Return the entry at a node; `entry` is the name under which faults are told."""
        return cls(graph, file, entry or local(node), node)  # type: ignore[arg-type]

    def fail(self, problem: str) -> PackError:
        """Return the error that tells a problem of this entry."""
        return PackError(f"{self.file}, entry {self.entry}: {problem}")

    def value(self, predicate: URIRef) -> Node | None:
        """Return the one value, if there is one. Raises PackError if there are several."""
        values = sorted(self.graph.objects(self.node, predicate), key=str)
        if len(values) > 1:
            raise self.fail(f"has {len(values)} values for ab:{local(predicate)}; keep one")
        return values[0] if values else None

    def text(self, predicate: URIRef, default: str | None = None) -> str:
        """Return the value as text. Raises PackError if it is missing and has no default."""
        value = self.value(predicate)
        if value is None:
            if default is not None:
                return default
            raise self.fail(f"lacks {_term(predicate)}; add it")
        return str(value)

    def texts(self, predicate: URIRef) -> tuple[str, ...]:
        """Return every value as text, sorted."""
        return tuple(sorted(str(value) for value in self.graph.objects(self.node, predicate)))

    def iri(self, predicate: URIRef) -> URIRef:
        """Return the value, which must be an IRI. Raises PackError."""
        value = self.value(predicate)
        if not isinstance(value, URIRef):
            raise self.fail(f"needs an IRI as {_term(predicate)}")
        return value

    def iris(self, predicate: URIRef) -> tuple[URIRef, ...]:
        """Return every value that is an IRI, sorted."""
        values = self.graph.objects(self.node, predicate)
        return tuple(sorted(value for value in values if isinstance(value, URIRef)))

    def maybe_iri(self, predicate: URIRef) -> URIRef | None:
        """Return the value, an IRI, if there is one. Raises PackError if it is something else."""
        return None if self.value(predicate) is None else self.iri(predicate)

    def flag(self, predicate: URIRef) -> bool:
        """Tell whether the value is true; missing is false."""
        value = self.value(predicate)
        return isinstance(value, Literal) and value.toPython() is True

    def number(self, predicate: URIRef) -> int | None:
        """Return the value as a whole number, if there is one. Raises PackError."""
        value = self.value(predicate)
        if value is None:
            return None
        if not isinstance(value, Literal) or not isinstance(value.toPython(), int):
            raise self.fail(f"needs a whole number as {_term(predicate)}")
        return int(value.toPython())

    def parts(self, predicate: URIRef) -> tuple["Entry", ...]:
        """The nodes below `predicate`, in the order of `order_of`."""
        nodes = [self._part(node) for node in self.graph.objects(self.node, predicate)]
        return tuple(sorted(nodes, key=order_of))

    def listed(self, predicate: URIRef) -> tuple["Entry", ...]:
        """Return the nodes of the RDF list below `predicate`, in order."""
        head = self.value(predicate)
        if head is None:
            return ()
        return tuple(self._part(node) for node in Collection(self.graph, head))

    def _part(self, node: Node) -> "Entry":
        return Entry.of(self.graph, self.file, node, self.entry)


def order_of(entry: Entry) -> tuple[int, str]:
    """Return what entries are sorted by: ab:order, those without last; then their name or text.

    The labels of blank nodes differ from one reading of a file to the next, so none is part of it.
    """
    number = entry.number(AB.order)
    order = sys.maxsize if number is None else number
    if not isinstance(entry.node, BNode):
        return order, local(entry.node)
    values = entry.graph.objects(entry.node)
    return order, " ".join(sorted(str(value) for value in values if not isinstance(value, BNode)))


def _term(predicate: URIRef) -> str:
    prefix = "ab" if predicate.startswith(str(AB)) else "rdfs"
    return f"{prefix}:{local(predicate)}"


def entries(graph: Graph, file: str, kind: URIRef) -> Iterator[tuple[URIRef, Entry]]:
    """Return the entries of a class, sorted by IRI."""
    for node in sorted(graph.subjects(RDF.type, kind), key=str):
        if isinstance(node, URIRef):
            yield node, Entry.of(graph, file, node)


def query_of(entry: Entry, text: str, what: str, form: str, gives: str = "") -> str:
    """Return an entry's query, ready to be asked with bindings.

    `gives` is a variable that a SELECT must give values for.

    Raises:
        PackError: the text is no such query.
    """
    if not text:
        return ""
    text = text.strip()
    if not re.match(rf"{form}\b", text, re.IGNORECASE):
        raise entry.fail(f"{what} must be a SPARQL {form}")
    if re.match(r"SELECT\s+(DISTINCT\s+|REDUCED\s+)?\*", text, re.IGNORECASE):
        raise entry.fail(f"{what} must name the variables that it gives, not *")
    query = prefixed(entry.graph, text) + form + text[len(form) :]
    given = valid(entry, query, what)
    if gives and gives not in given:
        told = " and ".join(f"?{name}" for name in given)
        raise entry.fail(f"{what} must give ?{gives}, but gives {told}")
    valid(entry, bindable(query), what)
    return bindable(query)


def valid(entry: Entry, query: str, what: str) -> tuple[str, ...]:
    """Make sure that a query is valid SPARQL; return the variables that a SELECT gives.

    Raises:
        PackError: it is not, or a variable is written with a dollar, which could not be bound.
    """
    refuse_dollars(entry, query, what)
    try:
        found = pyoxigraph.Store().query(query)
    except SyntaxError as error:
        problem = " ".join(str(error).split())
        raise entry.fail(f"{what} is no valid SPARQL: {problem}") from None
    if isinstance(found, pyoxigraph.QuerySolutions):
        return tuple(variable.value for variable in found.variables)
    return ()


def refuse_dollars(entry: Entry, query: str, what: str) -> None:
    """Make sure that no variable is written with a dollar. Raises PackError."""
    for name in dollars(query):
        raise entry.fail(f"{what} writes {name}; write ?{name[1:]}")


def check_message(entry: Entry, message: str, names: Iterable[str]) -> None:
    """Make sure that a message of the domain can be filled in."""
    try:
        fields = [field for _, field, _, _ in Formatter().parse(message) if field is not None]
    except ValueError as problem:
        raise entry.fail(f'the message "{message}" has a brace too many: {problem}') from None
    for name in fields:
        if name not in names:
            only = " or ".join(f"{{{known}}}" for known in names) or "no parameter"
            raise entry.fail(f'the message "{message}" names {{{name}}}; it may name {only}')
