"""Turtle as this tool writes it: canonical blocks, one fact a line, sorted, stable.

    ex:onion rdf:type ex:object ;
        ex:obj_name "onion" ;
        ex:Boilable false ;
    .

The type comes first, then the name, then the rest as written. `serialize` writes a whole graph;
`rewrite` changes facts in a document: only the blocks of subjects that change are written anew,
without the comments inside them; all other text stays to the byte.
"""

import re
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from typing import Any, Final, NamedTuple
from urllib.parse import urljoin

import pyoxigraph
from pyoxigraph import BlankNode, Literal, NamedNode
from rdflib import RDF, RDFS, XSD, BNode, URIRef
from rdflib.term import Node

from adaptbot_cli import bounded
from adaptbot_cli.core.graph.terms import Triple, kept, node_of, term_of
from adaptbot_cli.errors import KnowledgeError

KNOWN_PREFIXES: Final[Mapping[str, str]] = {
    "ab": "urn:adaptbot:",
    "ex": "http://example.org/",
    "rdf": str(RDF),
    "rdfs": str(RDFS),
    "xsd": str(XSD),
}
"""What is declared when a document needs one of these and uses its name for nothing else."""

BOM: Final = "\ufeff"
TURTLE: Final = pyoxigraph.RdfFormat.TURTLE
_FIRST, _REST, _NIL = (NamedNode(f"{RDF}{name}") for name in ("first", "rest", "nil"))
_LETTER: Final = (
    r"A-Za-z\u00C0-\u00D6\u00D8-\u00F6\u00F8-\u02FF\u0370-\u037D\u037F-\u1FFF\u200C-\u200D"
    r"\u2070-\u218F\u2C00-\u2FEF\u3001-\uD7FF\uF900-\uFDCF\uFDF0-\uFFFD\U00010000-\U000EFFFF"
)


# Without full stops and escapes, which are legal but read badly.
@cache
def _local() -> re.Pattern[str]:
    return re.compile(rf"[{_LETTER}_0-9][{_LETTER}_0-9\-\u00b7\u0300-\u036F]*")


_PREFIX: Final = re.compile(r"(?:[A-Za-z](?:[A-Za-z0-9_.-]*[A-Za-z0-9_-])?)?")
_BARE: Final = {
    str(XSD.boolean): re.compile(r"true|false"),
    str(XSD.integer): re.compile(r"[+-]?[0-9]+"),
    str(XSD.decimal): re.compile(r"[+-]?[0-9]*\.[0-9]+"),
}
# What would break a line, or turn the reading direction of one, must be seen in a diff.
_HIDDEN: Final = re.compile(
    r"[\x00-\x1f\x7f-\x9f\u2028\u2029\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ufeff]"
)

# What a valid document consists of, as far as it may hold a full stop that ends nothing.
_SPACE: Final = r"(?:[ \t\r\n]++|\#[^\n\r]*+)*"
_STRING: Final = (
    r'"""[^"\\]*+(?:(?:\\.|"(?!""))[^"\\]*+)*"""' r"|'''[^'\\]*+(?:(?:\\.|'(?!''))[^'\\]*+)*'''"
    r'|"[^"\\\n\r]*+(?:\\.[^"\\\n\r]*+)*"' r"|'[^'\\\n\r]*+(?:\\.[^'\\\n\r]*+)*'"
)  # fmt: skip
_IRI: Final = r'<[^<>"{}|^`\x00-\x20]*+>'
_NUMBER: Final = r"[+-]?(?:[0-9]*+\.[0-9]+|[0-9]+(?:\.(?=[eE][+-]?[0-9]))?)(?:[eE][+-]?[0-9]+)?"
_CHAR: Final = r"[A-Za-z0-9_\-:%\u00b7\u00c0-\U0010ffff]"
_CHARS: Final = rf"{_CHAR}*+(?:\\.{_CHAR}*+)*"
_NAME: Final = (
    rf"(?:[A-Za-z_:%\u00b7\u00c0-\U0010ffff]|\\.){_CHARS}"
    rf"(?:\.++(?={_CHAR}|\\.){_CHARS})*"
)
_SKIP: Final = re.compile(_SPACE)


@cache
def _token() -> re.Pattern[str]:
    """What a document consists of; compiled when something is written, for that takes 20 ms."""
    return re.compile(rf"{_STRING}|{_IRI}|{_NUMBER}|{_NAME}|@[A-Za-z0-9-]+|.", re.DOTALL)


_SPARQL_DIRECTIVE: Final = re.compile(
    rf"(?i:prefix){_SPACE}[^\s:<#]*+:{_SPACE}{_IRI}|(?i:base){_SPACE}{_IRI}"
    rf"|(?i:version){_SPACE}(?:{_STRING})",
    re.DOTALL,
)


class Statement(NamedTuple):
    """Where a statement stands in a document, full stop included; `head` is its first token."""

    head: str
    start: int
    end: int

    @property
    def directive(self) -> bool:
        """Tell whether it declares a prefix, the base or the version."""
        return self.head.lower() in ("@prefix", "@base", "@version", "prefix", "base", "version")


# A block as the writer has it, or a prefix: no line of it but the last can end a statement.
_LINE: Final = r"(?:[^\n.]++|\.(?![ \t\n]))*+\n"
_BLOCK: Final = re.compile(
    rf"(?:#[^\n]*\n|\n)*+(?P<all>(?P<head>@prefix) [^\n]* \.(?=\n)"
    rf"|(?P<subject>[^\s#.@_(\['\"]\S*+) {_LINE}(?:    {_LINE})*+\.(?=\n))"
)
_BETWEEN: Final = re.compile(r"(?:#[^\n]*\n|\n)*+")


def statements(text: str) -> Iterable[Statement]:
    """Find the statements and directives of a valid document, in order."""
    found, end = [], 0
    if '"""' not in text and "'''" not in text:
        while block := _BLOCK.match(text, end):
            end = block.end()
            found.append(Statement(block["head"] or block["subject"], block.start("all"), end))
        end = _BETWEEN.match(text, end).end()  # type: ignore[union-attr]
    return found if found and end == len(text) else _read_statements(text)


def _read_statements(text: str) -> Iterator[Statement]:
    """The same for a document that is written in another way."""
    position = _SKIP.match(text).end()  # type: ignore[union-attr]
    while head := _token().match(text, position):
        directive = _SPARQL_DIRECTIVE.match(text, position)
        end = directive.end() if directive else len(text)
        if not directive:
            rest = tokens(text, Statement(head[0], position, end))
            end = next((token.end() for token in rest if token[0] == "."), end)
        yield Statement(head[0], position, end)
        position = _SKIP.match(text, end).end()  # type: ignore[union-attr]


def tokens(text: str, place: Statement) -> Iterator[re.Match[str]]:
    """Give the tokens of a statement, without white space and comments."""
    position = place.start
    while position < place.end and (token := _token().match(text, position)):
        yield token
        position = _SKIP.match(text, token.end()).end()  # type: ignore[union-attr]


def parse(data: bytes | str, path: str) -> "pyoxigraph.QuadParser":
    """Parse Turtle; a byte order mark at its begin is no part of it."""
    encoded = data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data
    bounded.check_graph(encoded, path)
    return pyoxigraph.parse(encoded.removeprefix(BOM.encode()), format=TURTLE)


def parsed(data: bytes | str, path: str) -> list[Any]:
    """Return the engine's triples of a Turtle file. Raises KnowledgeError: it is not valid."""
    with blaming(path):
        return [quad.triple for quad in parse(data, path)]


@contextmanager
def blaming(path: object, what: str = "Turtle") -> Iterator[None]:
    """Turn what the engine says of a file into a KnowledgeError that names file and line."""
    try:
        yield
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        where = f"{path}, line {line}" if line else path
        problem = error.msg if isinstance(error, SyntaxError) else error
        raise KnowledgeError(f"{where}: this is no valid {what}: {problem}") from error


class Writer:
    """Writes terms with prefixes; `used` collects those of `spare` that have to be declared."""

    def __init__(
        self, prefixes: Mapping[str, str], newline: str = "\n", used: set[str] | None = None
    ) -> None:
        """Write with these prefixes, and with the known ones whose names are free."""
        self.prefixes = dict(prefixes)
        self.spare = {n: space for n, space in KNOWN_PREFIXES.items() if n not in prefixes}
        self.used = set() if used is None else used
        self.newline = newline

    def term(self, term: Any) -> str:
        """Write a term on one line."""
        if isinstance(term, NamedNode):
            return self._iri(term.value)
        if not isinstance(term, Literal):
            return str(term)
        datatype = term.datatype.value
        if (bare := _BARE.get(datatype)) and bare.fullmatch(term.value):
            return term.value
        quoted = _HIDDEN.sub(lambda m: f"\\u{ord(m[0]):04X}", str(Literal(term.value)))
        if term.language:
            return f"{quoted}@{term.language}"
        return quoted if datatype == str(XSD.string) else f"{quoted}^^{self._iri(datatype)}"

    def _iri(self, iri: str) -> str:
        for prefixes in (self.prefixes, self.spare):
            fitting = [(-len(space), n) for n, space in prefixes.items() if iri.startswith(space)]
            for length, name in sorted(fitting):
                if _local().fullmatch(iri[-length:]):
                    if prefixes is self.spare:
                        self.used.add(name)
                    return f"{name}:{iri[-length:]}"
        return _HIDDEN.sub(lambda m: f"\\u{ord(m[0]):04X}", f"<{iri}>")

    def block(self, subject: Any, triples: Iterable[Any]) -> str:
        """Write what is said of a subject, its blank nodes (those in `triples`) within it."""
        about: dict[Any, list[Any]] = {}
        for triple in triples:
            about.setdefault(triple.subject, []).append(triple)
        lines = f" ;{self.newline}".join(self._lines(about, subject, 1))
        return f"{self.term(subject)} {lines} ;{self.newline}."

    def _lines(self, about: Mapping[Any, list[Any]], subject: Any, depth: int) -> list[str]:
        ordered = sorted(
            (self._rank(t.predicate), self.term(t.predicate), self._object(t.object, about, depth))
            for t in about[subject]
        )
        lines = [f"{predicate} {value}" for _, predicate, value in ordered]
        return [lines[0], *("    " * depth + line for line in lines[1:])]

    def _object(self, term: Any, about: Mapping[Any, list[Any]], depth: int) -> str:
        # In a document of CRLF a break within a text would be another text.
        several = isinstance(term, Literal) and "\n" in term.value and self.newline == "\n"
        if several and len(about) > 1:
            return self._long(term)
        if term not in about or isinstance(term, NamedNode):
            return self.term(term)
        items = []
        while term != _NIL and {t.predicate for t in about.get(term, ())} == {_FIRST, _REST}:
            parts = {t.predicate: t.object for t in about[term]}
            items.append(self._object(parts[_FIRST], about, depth + 1))
            term = parts[_REST]
        if items:
            return f"( {' '.join(items)} )"
        return f"[ {f' ;{self.newline}'.join(self._lines(about, term, depth + 1))} ]"

    def _long(self, term: Any) -> str:
        """A text of several lines in a block with blank nodes: the queries of an action."""
        text = term.value.replace("\\", "\\\\").replace('"', '\\"').replace("\r", "\\r")
        hidden = _HIDDEN.sub(lambda m: m[0] if m[0] in "\n\t" else f"\\u{ord(m[0]):04X}", text)
        return f'"""{hidden}"""'

    @staticmethod
    def _rank(predicate: Any) -> int:
        if predicate.value == str(RDF.type):
            return 0
        return 1 if predicate.value == str(RDFS.label) or predicate.value.endswith("_name") else 2


def declaration(name: str, namespace: str) -> str:
    """Write a prefix declaration; raise KnowledgeError if it would not be valid."""
    if not _PREFIX.fullmatch(name):
        raise KnowledgeError(f"{name!r} is not a valid prefix; use letters and digits.")
    return f"@prefix {name}: <{engine_term(URIRef(namespace)).value}> ."


def serialize(triples: Iterable[Triple], prefixes: Mapping[str, str]) -> str:
    """Write a graph as a document that depends on the graph alone.

    All prefixes are declared. Blank nodes get canonical labels (RDFC-1.0).

    Raises:
        KnowledgeError: a term or a prefix that Turtle cannot write.
    """
    dataset = pyoxigraph.Dataset(pyoxigraph.Quad(*engine(triple)) for triple in set(triples))
    dataset.canonicalize(pyoxigraph.CanonicalizationAlgorithm.RDFC_1_0)
    about: dict[Any, list[Any]] = {}
    for quad in dataset:
        about.setdefault(quad.subject, []).append(quad.triple)
    writer = Writer(prefixes)
    blocks = sorted(
        (writer.term(subject), writer.block(subject, about[subject])) for subject in about
    )
    declared = {**prefixes, **{name: KNOWN_PREFIXES[name] for name in writer.used}}
    lines = [declaration(name, declared[name]) for name in sorted(declared)]
    parts = ["\n".join(lines), *(block for _, block in blocks)]
    return "\n\n".join(part for part in parts if part) + "\n"


def rewrite(text: str, removed: Iterable[Triple], added: Iterable[Triple], path: str) -> str:
    """Return a document's text after a change of facts: (graph - removed) | added.

    A subject's last block takes what is new of it; one without a block gets its alphabetical place
    if the document's are in order, else the end. Line breaks are those of the document.

    Raises:
        KnowledgeError: the text is no valid Turtle, or a term that Turtle cannot write.
    """
    parsed(text, path)
    body = text.removeprefix(BOM)
    newline = "\r\n" if "\r\n" in body else "\n"
    gone, new = _by_subject(removed), _by_subject(added)
    if not gone and not new:
        return text
    scope = _Scope()
    found: dict[Any, list[tuple[Statement, _Scope]]] = {}
    order: list[Statement] = []
    head_end, blocks = 0, False
    for place in statements(body):
        if place.directive:
            scope = scope.declare(body[place.start : place.end])
            head_end = head_end if blocks else place.end
            order.clear()  # what a name means depends on the place: new blocks at the end
            continue
        blocks = True
        order.append(place)
        subject = scope.iri(place.head)
        if subject in gone or subject in new:
            found.setdefault(subject, []).append((place, scope))
    edits: list[tuple[int, int, str]] = []
    used: set[str] = set()
    dropped: set[int] = set()
    for subject in dict.fromkeys([*gone, *new]):
        edits += _edits(
            body, found.get(subject, []), subject, gone, new, newline, used, dropped, path
        )
    fresh = Writer(scope.prefixes, newline, used)
    places = [place for place in order if place.start not in dropped]
    heads = [place.head for place in places]
    sorted_ = all(a <= b for a, b in pairwise(heads))
    for subject in sorted((s for s in new if s not in found), key=fresh.term):
        block, name = fresh.block(subject, new[subject]), fresh.term(subject)
        before = bisect_left(heads, name) if sorted_ else len(places)
        if before:
            end = places[before - 1].end
            edits.append((end, end, f"{newline * 2}{block}"))
        elif places:
            edits.append((places[0].start, places[0].start, f"{block}{newline * 2}"))
        else:
            gap = "" if not body else newline if body.endswith("\n") else newline * 2
            edits.append((len(body), len(body), f"{gap}{block}{newline}"))
    if used:
        lines = newline.join(declaration(name, KNOWN_PREFIXES[name]) for name in sorted(used))
        edits.insert(0, (head_end, head_end, f"{newline}{lines}" if head_end else
                         f"{lines}{newline * 2}"))  # fmt: skip
    # Of those at one place the first of the list comes first.
    parts, at = [text[: len(text) - len(body)]], 0
    for start, end, now in sorted(edits, key=lambda edit: edit[:2]):
        # Behind "5." a name would be read as an exponent.
        glued = now and start and not (body[start - 1].isspace() or now[0].isspace())
        parts += [body[at:start], newline if glued else "", now]
        at = end
    return "".join((*parts, body[at:]))


def _edits(
    body: str,
    places: "list[tuple[Statement, _Scope]]",
    subject: Any,
    gone: Mapping[Any, list[Any]],
    new: Mapping[Any, list[Any]],
    newline: str,
    used: set[str],
    dropped: set[int],
    path: str,
) -> Iterator[tuple[int, int, str]]:
    """The edits of the blocks of one subject."""
    record = {
        place: parsed(f"{scope.text}\n{body[place.start : place.end]}", path)
        for place, scope in places
    }
    known = {_key(triple) for triples in record.values() for triple in triples}
    wanted = {_key(triple): triple for triple in new.get(subject, ())}
    fresh = [triple for key, triple in wanted.items() if key not in known]
    drop = {_key(triple) for triple in gone.get(subject, ())} - wanted.keys()
    for number, (place, scope) in enumerate(places, start=1):
        triples = record[place]
        left = [t for t in triples if _key(t) not in drop]
        nested = any(isinstance(t.subject, BlankNode) for t in triples)
        more = fresh if number == len(places) else []
        if len(left) == len(triples) and not more:
            continue
        writer = Writer(scope.prefixes, newline, used)
        if nested and len(left) == len(triples):
            # What is said with blank nodes stays as it was written; what is new follows it.
            yield place.end, place.end, newline + writer.block(subject, more)
        elif nested and "_:" in body[place.start : place.end]:
            raise KnowledgeError(
                f"{path}: what is said of {place.head} has labelled blank nodes; edit it by hand."
            )
        elif left or more:
            yield place.start, place.end, writer.block(subject, dict.fromkeys([*left, *more]))
        else:
            dropped.add(place.start)
            yield (*_whole_lines(body, place), "")


def _whole_lines(body: str, place: Statement) -> tuple[int, int]:
    """Where a block goes: with its line and one blank line beside it, if it has them to itself."""
    start = body.rfind("\n", 0, place.start) + 1
    newline = body.find("\n", place.end)
    end = len(body) if newline < 0 else newline + 1
    if body[start : place.start].strip() or body[place.end : end].strip():
        return place.start, place.end
    above = body.rfind("\n", 0, max(start - 1, 0)) + 1
    if start and not body[above:start].strip():
        start = above
    return start, end


def _by_subject(triples: Iterable[Triple]) -> dict[Any, list[Any]]:
    found: dict[Any, list[Any]] = {}
    for triple in triples:
        if any(isinstance(node, BNode) for node in triple):
            raise KnowledgeError(
                f"{triple!r} cannot be changed: only facts of IRIs and literals can, no blank "
                "nodes."
            )
        made = pyoxigraph.Triple(*engine(triple))
        found.setdefault(made.subject, []).append(made)
    return found


def engine(triple: Triple) -> tuple[Any, Any, Any]:
    """Return the terms of a triple as the engine's. Raises KnowledgeError for what is none."""
    subject, predicate, value = (engine_term(node) for node in triple)
    if isinstance(subject, Literal) or not isinstance(predicate, NamedNode):
        raise KnowledgeError(f"{triple!r} is not a fact: its predicate must be an IRI.")
    return subject, predicate, value


def engine_term(node: Node) -> Any:
    """Return a term as the engine's. Raises KnowledgeError for what is none."""
    if isinstance(node, BNode):  # whose names may be anything in rdflib
        return BlankNode("b" + str(node).encode("utf-8", "surrogatepass").hex())
    try:
        return term_of(node)
    except (ValueError, UnicodeEncodeError) as error:
        what = "IRI" if not isinstance(node, BNode) and hasattr(node, "n3") else "term"
        raise KnowledgeError(
            f"{str(node)!r} is not a valid {what} ({error}); nothing was written."
        ) from error


def _key(triple: Any) -> tuple[Any, Any]:
    """What the facts of a subject are compared by: 1.50 is 1.5."""
    return triple.predicate, kept(node_of(triple.object)) if isinstance(
        triple.object, Literal
    ) else triple.object


class _Scope:
    """The prefixes and the base that hold at a place of a document, and the text that says so."""

    def __init__(self, text: str = "", prefixes: Mapping[str, str] | None = None, base: str = ""):
        self.text, self.prefixes, self.base = text, dict(prefixes or {}), base

    def declare(self, directive: str) -> "_Scope":
        """Take in a directive."""
        parser = parse(f"{self.text}\n{directive}", "")
        for _ in parser:
            pass
        base = str(parser.base_iri or self.base)
        return _Scope(f"{self.text}\n{directive}", parser.prefixes, base)

    def iri(self, written: str) -> Any:
        """Return the IRI that a token stands for; None if it stands for something else."""
        if written.startswith("<"):
            iri = re.sub(
                r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})",
                lambda m: chr(int(m[1] or m[2], 16)), written[1:-1],
            )  # fmt: skip
            return NamedNode(urljoin(self.base, iri) if self.base else iri)
        prefix, colon, local = written.partition(":")
        if not colon or prefix == "_" or prefix not in self.prefixes:
            return None
        return NamedNode(self.prefixes[prefix] + re.sub(r"\\(.)", r"\1", local))
