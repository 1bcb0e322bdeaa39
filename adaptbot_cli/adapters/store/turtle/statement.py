"""One statement of a document: its facts, and its text after a change of them."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

from rdflib import RDF, RDFS, URIRef

from adaptbot_cli.adapters.store.turtle.lexer import Place, Token, tokens
from adaptbot_cli.adapters.store.turtle.terms import Scope, Term, Writer, normal
from adaptbot_cli.errors import KnowledgeError

Fact: TypeAlias = tuple[URIRef, Term]
INDENT: Final = "    "

_CLOSE: Final = {"[": "]", "(": ")"}
# Between two facts of a canonical block: the rest of the line, comment lines, the indent.
_BETWEEN: Final = re.compile(r" ;([ \t]*(?:#[^\r\n]*)?)\r?\n((?:[ \t]*#[^\r\n]*\r?\n)*) {4}")
_AFTER: Final = re.compile(r" ;([ \t]*(?:#[^\r\n]*)?)\r?\n((?:[ \t]*#[^\r\n]*\r?\n)*)\.")


@dataclass(frozen=True, slots=True)
class Object:
    """An object as it stands: `term` is None for a blank node or a collection."""

    start: int
    end: int
    term: Term | None
    comma: Token | None


@dataclass(frozen=True, slots=True)
class Group:
    """A predicate with its objects and the semicolons after them."""

    predicate: URIRef
    verb: Token
    objects: tuple[Object, ...]
    closers: tuple[Token, ...]

    def facts(self) -> Iterator[tuple[Fact, Object]]:
        """Give the facts that are said with plain terms."""
        for item in self.objects:
            if item.term is not None:
                yield (self.predicate, item.term), item


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement about an IRI, read."""

    place: Place
    groups: tuple[Group, ...]

    @property
    def is_opaque(self) -> bool:
        """Tell whether it holds blank nodes or collections."""
        return any(item.term is None for group in self.groups for item in group.objects)

    def facts(self) -> dict[Fact, Object]:
        """Give its facts with plain terms."""
        return {fact: item for group in self.groups for fact, item in group.facts()}


@dataclass(frozen=True, slots=True)
class Row:
    """A fact's line in a canonical block; `above` are comment lines, `tail` ends its line."""

    predicate: URIRef
    object: Term
    verb: str
    value: str
    above: str = ""
    tail: str = ""

    @property
    def order(self) -> tuple[int, str, str]:
        """Give its place in a block: the type, the name, the rest as written."""
        return (_rank(self.predicate), self.verb, self.value)


def _rank(predicate: URIRef) -> int:
    if predicate == RDF.type:
        return 0
    return 1 if predicate == RDFS.label or predicate.endswith("_name") else 2


def read(text: str, place: Place, scope: Scope, path: str) -> Statement:
    """Read a statement whose subject is an IRI; raise KnowledgeError for RDF 1.2 notation."""
    parts = list(tokens(text, place.start, place.end))
    if any(part.kind == "mark" and part.text not in "^^;,.[]()" for part in parts):
        raise KnowledgeError(
            f"{path}: what is said about {place.head} uses a notation that cannot be edited "
            "(RDF 1.2); write it in plain Turtle."
        )
    groups: list[Group] = []
    at = 1
    while parts[at].text != ".":
        group, at = _group(parts, at, scope)
        groups.append(group)
    return Statement(place, tuple(groups))


def _group(parts: Sequence[Token], at: int, scope: Scope) -> tuple[Group, int]:
    verb = parts[at]
    predicate = RDF.type if verb.text == "a" else scope.iri(verb)
    if predicate is None:
        raise KnowledgeError(f"{verb.text} is not a predicate.")
    objects = []
    comma: Token | None = verb
    while comma:
        first, at = at + 1, _object_end(parts, at + 1)
        term = _term(tuple(parts[first:at]), scope)
        before = comma if comma is not verb else None
        objects.append(Object(parts[first].start, parts[at - 1].end, term, before))
        comma = parts[at] if parts[at].text == "," else None
    closers = []
    while parts[at].text == ";":
        closers.append(parts[at])
        at += 1
    return Group(predicate, verb, tuple(objects), tuple(closers)), at


def _object_end(parts: Sequence[Token], at: int) -> int:
    if parts[at].text in _CLOSE:
        return _bracket_end(parts, at)
    if parts[at].kind == "string":
        if parts[at + 1].text == "^^":
            return at + 3
        if parts[at + 1].kind == "word":
            return at + 2
    return at + 1


def _bracket_end(parts: Sequence[Token], at: int) -> int:
    depth = 0
    while True:
        depth += (parts[at].text in ("[", "(")) - (parts[at].text in ("]", ")"))
        at += 1
        if depth == 0:
            return at


def _term(parts: tuple[Token, ...], scope: Scope) -> Term | None:
    literal = scope.literal(parts)
    return scope.iri(parts[0]) if literal is None else normal(literal)


def rows(text: str, statement: Statement) -> tuple[list[Row], str] | None:
    """Read a block in the canonical style: its lines and the comment lines above its full stop.

    None if the statement is written in any other way.
    """
    found: list[Row] = []
    above, position = "", statement.place.start
    lead = statement.place.head + " "
    for number, group in enumerate(statement.groups, start=1):
        item, verb = group.objects[0], group.verb
        value = text[item.start : item.end]
        plain = len(group.objects) == 1 and not _breaks(value)
        pattern = _AFTER if number == len(statement.groups) else _BETWEEN
        gap = pattern.match(text, item.end)
        if not plain or item.term is None or gap is None:
            return None
        if text[position : item.end] != f"{lead}{verb.text} {value}":
            return None
        found.append(Row(group.predicate, item.term, verb.text, value, above, gap[1]))
        above, position, lead = gap[2], gap.end(), ""
    return found, above


def _breaks(text: str) -> bool:
    return "\n" in text or "\r" in text


def loose_rows(text: str, statement: Statement, writer: Writer) -> list[Row]:
    """Read a statement in any style as canonical lines, sorted, each fact once."""
    made: dict[Fact, Row] = {}
    for group in statement.groups:
        verb = writer.write(RDF.type) if group.verb.text == "a" else group.verb.text
        for fact, item in group.facts():
            value = text[item.start : item.end]
            if _breaks(value):
                value = writer.write(fact[1])
            made.setdefault(fact, Row(*fact, verb, value))
    return sorted(made.values(), key=lambda row: row.order)


def new_row(fact: Fact, writer: Writer) -> Row:
    """Make the line of a fact."""
    return Row(*fact, writer.write(fact[0]), writer.write(fact[1]))


def insert(lines: list[Row], row: Row, *, first: bool) -> None:
    """Put a line where it belongs, but in the first place only if `first` allows it.

    The first line also holds the subject: to put another one there changes two lines.
    """
    later = (at for at in range(not first, len(lines)) if lines[at].order > row.order)
    lines.insert(next(later, len(lines)), row)


def without(
    lines: Iterable[Row], ending: str, removed: set[Fact], newline: str
) -> tuple[list[Row], str]:
    """Take facts out of a block; their comments stay, above what follows."""
    kept: list[Row] = []
    above = ""
    for row in lines:
        if (row.predicate, row.object) in removed:
            above += row.above + (
                f"{INDENT}{row.tail.strip()}{newline}" if row.tail.strip() else ""
            )
        else:
            kept.append(replace(row, above=above + row.above))
            above = ""
    return kept, above + ending


def block(subject: str, lines: Sequence[Row], ending: str = "", newline: str = "\n") -> str:
    """Write a block in the canonical style, without a line break at its end.

    Comments above the first line come first: there is no line between it and the subject.
    """
    written = [
        ("" if at == 0 else row.above + INDENT) + f"{row.verb} {row.value} ;{row.tail}{newline}"
        for at, row in enumerate(lines)
    ]
    top = newline.join(line.strip() for line in lines[0].above.splitlines())
    return (top + newline if top else "") + f"{subject} {''.join(written)}{ending}."
