"""A Turtle document as text with places, and edits of it."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from rdflib import URIRef

from adaptbot_cli.adapters.store.turtle.lexer import Place, Token, statements, tokens
from adaptbot_cli.adapters.store.turtle.terms import Scope


class Edit(NamedTuple):
    """New text for a stretch of a document."""

    start: int
    end: int
    text: str


@dataclass(slots=True)
class Document:
    """A document, and where in it stands what is to be changed.

    `found` are the statements about the subjects looked for, `subjects` those about any IRI, by
    their ends; `scope` is what holds at the end; `head_end` is where the leading directives end.
    """

    text: str
    found: dict[URIRef, list[tuple[Place, Scope]]] = field(default_factory=dict)
    subjects: list[Place] = field(default_factory=list)
    scope: Scope = field(default_factory=Scope)
    declared: set[str] = field(default_factory=set)
    head_end: int | None = None
    body_start: int | None = None
    in_order: bool = True

    @property
    def newline(self) -> str:
        """Give the document's line break."""
        return "\r\n" if "\r\n" in self.text else "\n"

    def line_end(self, position: int) -> int | None:
        """Find where the line after a place begins; None if there is more than a comment on it."""
        newline = self.text.find("\n", position)
        rest = self.text[position : len(self.text) if newline < 0 else newline].strip()
        if newline < 0 or (rest and not rest.startswith("#")):
            return None
        return newline + 1

    def is_blank(self, line: int) -> bool:
        """Tell whether the line that begins at a place is blank, or the document ends there."""
        newline = self.text.find("\n", line)
        return not self.text[line : len(self.text) if newline < 0 else newline].strip()

    def removal(self, place: Place) -> Edit:
        """Make the edit that removes a statement, with its line and one blank line beside it."""
        line = self.text.rfind("\n", 0, place.start) + 1
        after = self.line_end(place.end)
        if self.text[line : place.start].strip() or after is None:
            return Edit(place.start, place.end, "")
        if self.text[place.end : after].strip():
            return Edit(place.start, place.end, "")
        before = self.text.rfind("\n", 0, max(line - 1, 0)) + 1
        if not self.is_blank(after) or not self.is_blank(before):
            return Edit(line, after, "")
        if after < len(self.text):
            return Edit(line, self.text.find("\n", after) + 1 or len(self.text), "")
        return Edit(before, after, "")


def found_in(text: str, wanted: set[URIRef]) -> Document:
    """Find the statements about some subjects in a valid document, in one pass over it."""
    document = Document(text)
    known: dict[str, URIRef | None] = {}
    last = ""
    for place in statements(text):
        if place.is_directive:
            _direct(document, list(tokens(text, place.start, place.end)), place.end)
            known.clear()
            continue
        if document.body_start is None:
            document.body_start = place.start
        if place.head not in known:
            head = next(tokens(text, place.start, place.end))
            known[place.head] = document.scope.iri(head)
        subject = known[place.head]
        if subject is None:
            continue
        if subject in wanted:
            document.found.setdefault(subject, []).append((place, document.scope))
        document.in_order = document.in_order and last <= place.head
        document.subjects.append(place)
        last = place.head
    return document


def _direct(document: Document, parts: list[Token], end: int) -> None:
    document.scope = document.scope.declare(parts)
    document.declared.update(part.text[:-1] for part in parts if part.text.endswith(":"))
    if document.body_start is None:
        document.head_end = end
    else:
        # What a name means depends on the place: a new block is safe only at the end.
        document.in_order = False


def apply(document: Document, edits: Iterable[Edit]) -> str:
    """Give the text after edits; of two at one place the earlier in the list comes first."""
    return "".join(_pieces(document.text, sorted(edits, key=lambda edit: edit.start)))


def _pieces(text: str, edits: Iterable[Edit]) -> Iterator[str]:
    position = 0
    for edit in edits:
        yield text[position : edit.start]
        yield edit.text
        position = max(position, edit.end)
    yield text[position:]
