"""One entry of a pack's file, with readers that note what is wrong with it."""

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from string import Formatter

from rdflib import RDF, BNode, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.terms import AB, local
from adaptbot_cli.errors import PackError

NOTHING = URIRef("")
"""Stands for an IRI that is missing; its lack has been noted, so it is not noted again."""


@dataclass(slots=True)
class Notes:
    """The faults found so far, in the order found, each once.

    A doubt is a likely fault: a check reports it, and it keeps nothing from being loaded.
    """

    _found: dict[Fault, None] = field(default_factory=dict)
    _doubts: dict[Fault, None] = field(default_factory=dict)

    def add(self, fault: Fault, likely: bool = False) -> None:
        """Note a fault, or one that is only likely."""
        (self._doubts if likely else self._found)[fault] = None

    @property
    def faults(self) -> list[Fault]:
        """The faults, then the likely ones."""
        return [*self._found, *self._doubts]

    def refuse(self) -> None:
        """Raise PackError if there is a fault."""
        if not self._found:
            return
        first, *others = self._found
        more = f" (and {len(others)} more: see `adaptbot domain check`)" if others else ""
        raise PackError(f"{first}{more}")


@dataclass(frozen=True, slots=True)
class EntryReader:
    """One node of a pack's file. Its readers note a fault in `notes` and give a stand-in."""

    graph: Graph
    file: str
    entry: str
    node: URIRef
    notes: Notes

    @classmethod
    def of(
        cls, graph: Graph, file: str, node: Node, notes: Notes, entry: str = ""
    ) -> "EntryReader":
        """Return the entry at a node; `entry` is its name in faults."""
        return cls(graph, file, entry or local(node), node, notes)  # type: ignore[arg-type]

    def note(self, problem: str, remedy: str, unknown: str = "", likely: bool = False) -> None:
        """Note a fault of this entry; `unknown` is a name in it that stands for nothing."""
        fault = Fault(problem, remedy, self.file, (self.entry,), unknown=unknown)
        self.notes.add(fault, likely)

    def value(self, predicate: URIRef) -> Node | None:
        """Return the one value, if there is one; of several the first."""
        values = sorted(self.graph.objects(self.node, predicate), key=str)
        if len(values) > 1:
            text = " and ".join(local(value) for value in values)
            self.note(f"has {len(values)} values for {_term(predicate)}, {text}", "keep one")
        return values[0] if values else None

    def text(self, predicate: URIRef, default: str | None = None) -> str:
        """Return the value as text; missing is a fault unless it has a default."""
        value = self.value(predicate)
        if value is None and default is None:
            self.note(f"lacks {_term(predicate)}", "add it")
        return str(value) if value is not None else default or ""

    def texts(self, predicate: URIRef) -> tuple[str, ...]:
        """Return every value as text, sorted."""
        return tuple(sorted(str(value) for value in self.graph.objects(self.node, predicate)))

    def iri(self, predicate: URIRef) -> URIRef:
        """Return the value, which must be an IRI; `NOTHING` if it is none."""
        value = self.value(predicate)
        if isinstance(value, URIRef):
            return value
        got = "" if value is None else f', not "{value}"'
        remedy = "write a prefixed name such as ex:thing, without quotes"
        self.note(f"needs an IRI as {_term(predicate)}{got}", remedy)
        return NOTHING

    def iris(self, predicate: URIRef) -> tuple[URIRef, ...]:
        """Return every value, all of which must be IRIs, sorted."""
        values = list(self.graph.objects(self.node, predicate))
        for value in values:
            if not isinstance(value, URIRef):
                remedy = "write a prefixed name such as ex:thing, without quotes"
                self.note(f'needs IRIs as {_term(predicate)}, not "{local(value)}"', remedy)
        return tuple(sorted(value for value in values if isinstance(value, URIRef)))

    def maybe_iri(self, predicate: URIRef) -> URIRef | None:
        """Return the value, an IRI, if there is one."""
        return (self.iri(predicate) or None) if self.value(predicate) is not None else None

    def flag(self, predicate: URIRef) -> bool:
        """Tell whether the value is true; missing is false."""
        value = self.value(predicate)
        plain = value.toPython() if isinstance(value, Literal) else value
        if plain is not None and not isinstance(plain, bool):
            problem = f"needs true or false as {_term(predicate)}, not {local(value or NOTHING)}"
            self.note(problem, "write true or false, without quotes")
        return plain is True

    def number(self, predicate: URIRef) -> int | None:
        """Return the value as a whole number, if there is one."""
        value = self.value(predicate)
        if value is None:
            return None
        plain = value.toPython() if isinstance(value, Literal) else value
        if type(plain) is int:
            return plain
        self.note(f"needs a whole number as {_term(predicate)}", "write one, without quotes")
        return None

    def parts(self, predicate: URIRef) -> tuple["EntryReader", ...]:
        """Return the nodes below `predicate`, in the order of `order_of`."""
        nodes = [self._part(node) for node in self.graph.objects(self.node, predicate)]
        return tuple(sorted(nodes, key=order_of))

    def listed(self, predicate: URIRef) -> tuple["EntryReader", ...]:
        """Return the nodes of the RDF list below `predicate`, in order."""
        head = self.value(predicate)
        if head is None:
            return ()
        if head != RDF.nil and (head, RDF.first, None) not in self.graph:
            self.note(f"needs a list as {_term(predicate)}", "put it in parentheses: ( … )")
            return ()
        try:
            return tuple(self._part(node) for node in Collection(self.graph, head))
        except ValueError:
            self.note(f"has a list that never ends as {_term(predicate)}", "write ( … )")
            return ()

    def _part(self, node: Node) -> "EntryReader":
        return EntryReader.of(self.graph, self.file, node, self.notes, self.entry)


def order_of(entry: EntryReader) -> tuple[int, str]:
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


def entries(graph: Graph, file: str, kind: URIRef, notes: Notes) -> Iterator[EntryReader]:
    """Give the entries of a class, sorted by IRI."""
    for node in sorted(graph.subjects(RDF.type, kind), key=str):
        if isinstance(node, URIRef):
            yield EntryReader.of(graph, file, node, notes)


def check_message(entry: EntryReader, message: str, names: Iterable[str]) -> None:
    """Make sure that a message of the domain can be filled in."""
    text = f'the message "{message}"'
    try:
        parsed = [part for part in Formatter().parse(message) if part[1] is not None]
        # {item:>1000000000} would be filled up with blanks
        fields = [f"{field}{spec and ':'}{spec or ''}" for _, field, spec, _ in parsed]
    except ValueError as problem:
        entry.note(f"{text} has a brace too many: {problem}", "write {name}, or no brace at all")
        return
    only = " or ".join(f"{{{known}}}" for known in names)
    for name in fields:
        if name not in names:
            remedy = f"it may name {only or 'no parameter'}"
            entry.note(f"{text} names {{{name}}}", remedy)
