"""Changes of facts in a document that leave everything else in it as it stands."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import pyoxigraph
from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.adapters.store.turtle.canonical import declaration, new_block
from adaptbot_cli.adapters.store.turtle.document import Document, Edit, apply, found_in
from adaptbot_cli.adapters.store.turtle.lexer import comments
from adaptbot_cli.adapters.store.turtle.placing import block_edits, declaration_edit
from adaptbot_cli.adapters.store.turtle.statement import (
    Fact,
    Row,
    Statement,
    block,
    insert,
    loose_rows,
    new_row,
    read,
    rows,
    without,
)
from adaptbot_cli.adapters.store.turtle.surgery import operate
from adaptbot_cli.adapters.store.turtle.terms import KNOWN_PREFIXES, Scope, Triple, Writer, normal
from adaptbot_cli.core.terms import kept
from adaptbot_cli.errors import KnowledgeError


@dataclass(slots=True)
class Change:
    """What is to change about one subject; `added` in the order given."""

    removed: set[Fact] = field(default_factory=set)
    added: dict[Fact, None] = field(default_factory=dict)


def patch(text: str, removed: Iterable[Triple], added: Iterable[Triple], path: str) -> str:
    """Give a Turtle document's text after a change: (graph - removed) | added.

    Statements about other subjects keep their text to the byte. In the canonical style a changed
    fact is one changed line; a statement in another style is rewritten in it, its comments above
    it; one with blank nodes or collections is never rewritten, new facts follow it in a statement
    of their own. New subjects take their alphabetical place if the document's are in order, else
    the end. Line breaks are those of the document.

    Raises KnowledgeError, naming `path`, if the text is not valid Turtle, and for a term that
    Turtle cannot write.
    """
    _check(text, path)
    changes = _by_subject(removed, added)
    if not changes:
        return text
    document = found_in(text, set(changes))
    editor = _Editor(document, path)
    for subject, change in changes.items():
        editor.change(subject, change)
    return apply(document, editor.finished())


def _check(text: str, path: str) -> None:
    try:
        for _ in pyoxigraph.parse(text, format=pyoxigraph.RdfFormat.TURTLE):
            pass
    except (SyntaxError, ValueError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else error
        raise KnowledgeError(
            f"{path} is not valid Turtle: {reason}. Correct it, then try again."
        ) from error


def _by_subject(removed: Iterable[Triple], added: Iterable[Triple]) -> dict[URIRef, Change]:
    changes: dict[URIRef, Change] = {}
    for triple in added:
        subject, fact = _fact(triple)
        changes.setdefault(subject, Change()).added[fact] = None
    for triple in removed:
        subject, fact = _fact(triple)
        change = changes.setdefault(subject, Change())
        if fact not in change.added:
            change.removed.add(fact)
    return changes


def _fact(triple: Triple) -> tuple[URIRef, Fact]:
    subject, predicate, value = (normal(term) for term in triple)
    plain = isinstance(subject, URIRef) and isinstance(predicate, URIRef)
    if not plain or not isinstance(value, URIRef | Literal):
        raise KnowledgeError(
            f"{triple!r} cannot be changed: only facts of IRIs and literals can, no blank nodes."
        )
    return URIRef(subject), (URIRef(predicate), value)


def _key(fact: Fact) -> tuple[Node, Node]:
    """What facts are compared by: the engine gives back 1.50 as 1.5."""
    predicate, value = fact
    with suppress(ValueError):  # what is no term is told where it is written
        return predicate, kept(value)
    return fact


@dataclass(slots=True)
class _Editor:
    """Collects the edits of a document."""

    document: Document
    path: str
    edits: list[Edit] = field(default_factory=list)
    gone: set[int] = field(default_factory=set)
    new: dict[URIRef, list[Fact]] = field(default_factory=dict)
    used: set[str] = field(default_factory=set)

    def change(self, subject: URIRef, change: Change) -> None:
        """Edit the statements about a subject."""
        found = self.document.found.get(subject, [])
        read_ones = [read(self.document.text, place, scope, self.path) for place, scope in found]
        present = {_key(fact) for statement in read_ones for fact in statement.facts()}
        added = [fact for fact in change.added if _key(fact) not in present]
        removed = set(map(_key, change.removed))
        if not found:
            self.new[subject] = added
        for at, (statement, (_, scope)) in enumerate(zip(read_ones, found, strict=True)):
            writer = self._writer(scope)
            here = {fact for fact in statement.facts() if _key(fact) in removed}
            pairs = _pairs(here, added, statement)
            added = [fact for fact in added if fact not in pairs.values()]
            rest = added if at == len(found) - 1 else []
            if here or rest:
                self._edit(statement, here, pairs, rest, writer)

    def _writer(self, scope: Scope) -> Writer:
        declared = self.document.declared
        spare = {name: space for name, space in KNOWN_PREFIXES.items() if name not in declared}
        return Writer(scope.prefixes, spare, self.used)

    def _edit(
        self,
        statement: Statement,
        removed: set[Fact],
        pairs: Mapping[Fact, Fact],
        added: Sequence[Fact],
        writer: Writer,
    ) -> None:
        place, newline = statement.place, self.document.newline
        if statement.is_opaque:
            new = _operated(self.document, statement, removed, pairs, writer)
            if added:
                new += newline + new_block(place.head, added, writer, newline)
        else:
            new = _relined(self.document, statement, removed, pairs, added, writer)
        if new:
            self.edits.append(Edit(place.start, place.end, new))
        else:
            self.gone.add(place.start)
            self.edits.append(self.document.removal(place))

    def finished(self) -> list[Edit]:
        """Give all edits: of two at one place, declarations and new blocks come first."""
        writer = self._writer(self.document.scope)
        heads = {writer.write(subject): facts for subject, facts in self.new.items() if facts}
        blocks = {
            head: new_block(head, heads[head], writer, self.document.newline)
            for head in sorted(heads)
        }
        lines = [declaration(name, KNOWN_PREFIXES[name]) for name in sorted(self.used)]
        declared = [declaration_edit(self.document, lines)] if lines else []
        return [*declared, *block_edits(self.document, blocks, self.gone), *self.edits]


def _pairs(removed: set[Fact], added: Sequence[Fact], statement: Statement) -> dict[Fact, Fact]:
    """Match facts whose value changes: they keep their line.

    Of a predicate with several values none is matched, for its lines are in order.
    """
    pairs = {}
    for group in statement.groups:
        old = [fact for fact in statement.facts() if fact[0] == group.predicate]
        new = [fact for fact in added if fact[0] == group.predicate]
        if len(old) == len(new) == 1 and old[0] in removed:
            pairs[old[0]] = new[0]
    return pairs


def _operated(
    document: Document,
    statement: Statement,
    removed: set[Fact],
    pairs: Mapping[Fact, Fact],
    writer: Writer,
) -> str:
    replaced = {old: writer.write(new[1]) for old, new in pairs.items()}
    return operate(document.text, statement, removed - pairs.keys(), replaced)


def _relined(
    document: Document,
    statement: Statement,
    removed: set[Fact],
    pairs: Mapping[Fact, Fact],
    added: Sequence[Fact],
    writer: Writer,
) -> str:
    """Change a block's lines; first bring the statement into lines if it is in another style."""
    text, place, newline = document.text, statement.place, document.newline
    new = sorted((new_row(fact, writer) for fact in added), key=lambda row: row.order)
    canonical = rows(text, statement)
    lines, ending = canonical or (loose_rows(text, statement, writer), "")
    remarks = [] if canonical else comments(text, place.start, place.end)
    lines, ending = without(lines, ending, removed - pairs.keys(), newline)
    lines = [_with_value(row, pairs, writer) for row in lines]
    for row in new:
        insert(lines, row, first=not canonical)
    if lines:
        return "".join(line + newline for line in remarks) + block(
            place.head, lines, ending, newline
        )
    remarks += [line.strip() for line in ending.splitlines()]
    # A comment must not swallow what follows on the line.
    follows = remarks and document.line_end(place.end) is None
    return newline.join(remarks) + (newline if follows else "")


def _with_value(row: Row, pairs: Mapping[Fact, Fact], writer: Writer) -> Row:
    new = pairs.get((row.predicate, row.object))
    return replace(row, object=new[1], value=writer.write(new[1])) if new else row
