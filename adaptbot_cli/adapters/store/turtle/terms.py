"""Terms of a graph and how Turtle writes them."""

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Final, TypeAlias
from urllib.parse import urljoin

import pyoxigraph
from rdflib import RDF, RDFS, XSD, BNode, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.adapters.store.turtle.lexer import Token
from adaptbot_cli.errors import KnowledgeError

Term: TypeAlias = URIRef | Literal | BNode
Triple: TypeAlias = tuple[Node, Node, Node]
"""Subject, predicate and object: URIRef, URIRef, and URIRef or Literal."""

KNOWN_PREFIXES: Final[Mapping[str, str]] = {
    "ab": "urn:adaptbot:",
    "ex": "http://example.org/",
    "rdf": str(RDF),
    "rdfs": str(RDFS),
    "xsd": str(XSD),
}
"""What is declared when a document needs one of these and uses its name for nothing else."""

_LETTER: Final = (
    r"A-Za-z\u00C0-\u00D6\u00D8-\u00F6\u00F8-\u02FF\u0370-\u037D\u037F-\u1FFF\u200C-\u200D"
    r"\u2070-\u218F\u2C00-\u2FEF\u3001-\uD7FF\uF900-\uFDCF\uFDF0-\uFFFD\U00010000-\U000EFFFF"
)
# Without full stops and escapes, which are legal but read badly.
_SAFE_LOCAL: Final = re.compile(rf"[{_LETTER}_0-9][{_LETTER}_0-9\-\u00b7\u0300-\u036F]*")
_BARE: Final = {
    XSD.boolean: re.compile(r"true|false"),
    XSD.integer: re.compile(r"[+-]?[0-9]+"),
    XSD.decimal: re.compile(r"[+-]?[0-9]*\.[0-9]+"),
}
_ESCAPES: Final = {
    "\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t", "\b": "\\b", "\f": "\\f",
}  # fmt: skip
_UNESCAPES: Final = {
    "n": "\n", "r": "\r", "t": "\t", "b": "\b", "f": "\f",
}  # fmt: skip
_ESCAPED: Final = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))", re.DOTALL)
_HIDDEN: Final = re.compile(r"[\u202a-\u202e\u2066-\u2069\ufeff]")


def normal(term: Node) -> Term:
    """Bring a term into the form in which equal terms compare equal.

    rdflib holds `"x"` and `"x"^^xsd:string`, or `01` and `1`, to be different, depending on where
    they come from. Raises KnowledgeError for what is no term of a graph.
    """
    if isinstance(term, Literal):
        plain = term.datatype == XSD.string
        return Literal(str(term), lang=term.language, datatype=None if plain else term.datatype)
    if isinstance(term, URIRef | BNode):
        return term
    raise KnowledgeError(f"{term!r} is neither an IRI nor a literal; it cannot be in a graph.")


@dataclass(frozen=True, slots=True)
class Scope:
    """The prefixes and the base that hold at a place of a document."""

    prefixes: Mapping[str, str] = field(default_factory=dict)
    base: str = ""

    def declare(self, tokens: Iterable[Token]) -> "Scope":
        """Take in a directive."""
        words = {token.kind: token.text for token in tokens if token.text != "."}
        if "iri" not in words:
            return self
        target = self._absolute(words["iri"])
        name = words.get("name", "")
        if not name.endswith(":"):
            return Scope(self.prefixes, target)
        return Scope({**self.prefixes, name[:-1]: target}, self.base)

    def iri(self, token: Token) -> URIRef | None:
        """Give the IRI that a token stands for; None if it stands for something else."""
        if token.kind == "iri":
            return URIRef(self._absolute(token.text))
        prefix, colon, local = token.text.partition(":")
        if token.kind != "name" or not colon or prefix not in self.prefixes:
            return None
        return URIRef(self.prefixes[prefix] + re.sub(r"\\(.)", r"\1", local))

    def literal(self, tokens: tuple[Token, ...]) -> Literal | None:
        """Give the literal that tokens stand for (`"x"@en`, `1`, `true`); None if none."""
        first = tokens[0]
        if first.kind == "number" or first.text in ("true", "false"):
            return Literal(first.text, datatype=_number_type(first.text))
        if first.kind != "string":
            return None
        marked = tokens[-1]
        quotes = 3 if len(first.text) > 5 and first.text[:3] in ('"""', "'''") else 1
        value = _unescape(first.text[quotes:-quotes])
        if marked.kind == "word":
            return Literal(value, lang=marked.text[1:])
        datatype = self.iri(marked) if len(tokens) > 1 else None
        return Literal(value, datatype=datatype)

    def _absolute(self, written: str) -> str:
        iri = _unescape(written[1:-1])
        return urljoin(self.base, iri) if self.base else iri


def _number_type(text: str) -> URIRef:
    if text in ("true", "false"):
        return XSD.boolean
    if "e" in text.lower():
        return XSD.double
    return XSD.decimal if "." in text else XSD.integer


def _unescape(text: str) -> str:
    return _ESCAPED.sub(_unescaped, text) if "\\" in text else text


def _unescaped(match: re.Match[str]) -> str:
    code = match[1] or match[2]
    return chr(int(code, 16)) if code else _UNESCAPES.get(match[3], match[3])


@dataclass(slots=True)
class Writer:
    """Writes terms with the prefixes of a place.

    `spare` are prefixes that the document may yet declare; `used` collects those it must.
    """

    prefixes: Mapping[str, str]
    spare: Mapping[str, str]
    used: set[str] = field(default_factory=set)

    def write(self, term: Node) -> str:
        """Write a term on one line; raise KnowledgeError if Turtle has no way to."""
        if isinstance(term, Literal):
            return self._literal(term)
        if isinstance(term, URIRef):
            return self._iri(term)
        if isinstance(term, BNode):
            return f"_:{term}"
        raise KnowledgeError(f"{term!r} is not a term of a graph; nothing was written.")

    def _iri(self, iri: URIRef) -> str:
        check_iri(iri)
        short = _shorten(iri, self.prefixes)
        if short:
            return short
        short = _shorten(iri, self.spare)
        if short:
            self.used.add(short.partition(":")[0])
        return short or f"<{iri}>"

    def _literal(self, literal: Literal) -> str:
        text, datatype = check_text(literal), literal.datatype
        bare = _BARE.get(datatype) if datatype else None
        if bare and bare.fullmatch(text):
            return text
        quoted = '"' + "".join(_escape(char) for char in text) + '"'
        if literal.language:
            return f"{quoted}@{literal.language}"
        if datatype is None or datatype == XSD.string:
            return quoted
        return f"{quoted}^^{self._iri(datatype)}"


def _shorten(iri: str, prefixes: Mapping[str, str]) -> str:
    """Write an IRI with the prefix that leaves least; empty if none leaves a plain name."""
    fitting = [(-len(space), name) for name, space in prefixes.items() if iri.startswith(space)]
    for length, name in sorted(fitting):
        if _SAFE_LOCAL.fullmatch(iri[-length:]):
            return f"{name}:{iri[-length:]}"
    return ""


@cache
def _escape(char: str) -> str:
    if char in _ESCAPES:
        return _ESCAPES[char]
    # What would break a line or turn the reading direction of one must be seen in a diff.
    if unicodedata.category(char) in ("Cc", "Zl", "Zp") or _HIDDEN.match(char):
        return f"\\u{ord(char):04X}"
    return char


def check_iri(iri: str) -> str:
    """Give the IRI back; raise KnowledgeError if it is not an absolute, valid one."""
    try:
        return pyoxigraph.NamedNode(iri).value
    except ValueError as error:
        raise KnowledgeError(
            f"{iri!r} is not a valid IRI ({error}); nothing was written."
        ) from error


def check_text(literal: Literal) -> str:
    """Give the literal's text back; raise KnowledgeError if it or its language is not valid."""
    try:
        return pyoxigraph.Literal(str(literal), language=literal.language).value
    except ValueError as error:
        raise KnowledgeError(
            f"{str(literal)!r} cannot be written as a literal ({error}); nothing was written."
        ) from error
