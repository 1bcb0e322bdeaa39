"""Where a Turtle document's statements and tokens begin and end.

Everything here expects valid Turtle (`patch` has a parser check it first) and only finds places.
"""

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

_COMMENT: Final = r"#[^\n\r]*+"
_SPACE: Final = rf"(?:[ \t\r\n]++|{_COMMENT})*"
_IRI: Final = r'<[^<>"{}|^`\x00-\x20]*+>'
_LONG: Final = r"{0}[^{1}\\]*+(?:(?:\\.|{1}(?!{1}{1}))[^{1}\\]*+)*{0}"
_STRING: Final = "|".join(
    (
        _LONG.format('"""', '"'),
        _LONG.format("'''", "'"),
        r'"[^"\\\n\r]*+(?:\\.[^"\\\n\r]*+)*"',
        r"'[^'\\\n\r]*+(?:\\.[^'\\\n\r]*+)*'",
    )
)
_EXPONENT: Final = r"[eE][+-]?[0-9]+"
_NUMBER: Final = (
    rf"[+-]?(?:[0-9]+\.[0-9]*{_EXPONENT}|[0-9]*\.[0-9]+(?:{_EXPONENT})?|[0-9]+(?:{_EXPONENT})?)"
)
# Wider than the standard's names, which does not matter in a valid document.
_NAME_PART: Final = r"(?:[A-Za-z0-9_\-:%\u00b7\u00c0-\U0010ffff]++|\\.)+"
_NAME: Final = rf"{_NAME_PART}(?:\.+{_NAME_PART})*"
_WORD: Final = r"@[A-Za-z]+(?:-+[A-Za-z0-9]+)*"

_SKIP: Final = re.compile(_SPACE)
_TOKEN: Final = re.compile(
    rf"(?P<space>[ \t\r\n]++)|(?P<comment>{_COMMENT})|(?P<string>{_STRING})|(?P<iri>{_IRI})"
    rf"|(?P<number>{_NUMBER})|(?P<name>{_NAME})|(?P<word>{_WORD})|(?P<mark>\^\^|.)",
    re.DOTALL,
)
# What may hide a full stop, and full stops. A name may hold one too: see `_end`.
_HAZARD: Final = re.compile(rf"{_STRING}|{_IRI}|{_COMMENT}|\\.|\.", re.DOTALL)
_SPARQL_DIRECTIVE: Final = re.compile(
    rf"(?i:prefix){_SPACE}[^\s:<#]*:{_SPACE}{_IRI}|(?i:base){_SPACE}{_IRI}"
    rf"|(?i:version){_SPACE}(?:{_STRING})"
)
_DIRECTIVES: Final = frozenset({"@prefix", "@base", "@version", "prefix", "base", "version"})


class Token(NamedTuple):
    """A token of a document; kind: string, iri, number, name, word (`@en`) or mark."""

    kind: str
    text: str
    start: int
    end: int


class Place(NamedTuple):
    """Where a statement stands, full stop included; `head` is its first token as written."""

    head: str
    start: int
    end: int

    @property
    def is_directive(self) -> bool:
        """Tell whether it declares a prefix or the base."""
        return self.head.lower() in _DIRECTIVES


def statements(text: str) -> Iterator[Place]:
    """Find the statements and directives of a valid document, in order."""
    position = 0
    while True:
        start = _after_space(text, position)
        head = _TOKEN.match(text, start)
        if head is None:
            return
        directive = _SPARQL_DIRECTIVE.match(text, start)
        position = directive.end() if directive else _end(text, start)
        yield Place(head[0], start, position)


def tokens(text: str, start: int, end: int) -> Iterator[Token]:
    """Find the tokens between two places, without white space and comments."""
    for match in _TOKEN.finditer(text, start, end):
        kind = match.lastgroup
        if kind is not None and kind not in ("space", "comment"):
            yield Token(kind, match[0], match.start(), match.end())


def comments(text: str, start: int, end: int) -> list[str]:
    """Find the comments between two places, each from its `#` to the end of its line."""
    found = _TOKEN.finditer(text, start, end)
    return [match[0].rstrip() for match in found if match.lastgroup == "comment"]


def _after_space(text: str, position: int) -> int:
    match = _SKIP.match(text, position)
    return match.end() if match else position


def _end(text: str, start: int) -> int:
    """Find a statement's end by jumping from full stop to full stop."""
    position = start
    while match := _HAZARD.search(text, position):
        position = match.end()
        if text[match.start()] == ".":
            if text[position : position + 1] in " \t\r\n#<[(\"'":
                return position
            # Perhaps inside a name or a number: `ex:a.b`, `1.5`. Only tokens can tell.
            return _exact_end(text, start)
    return len(text)


def _exact_end(text: str, start: int) -> int:
    for match in _TOKEN.finditer(text, start):
        if match.lastgroup == "mark" and match[0] == ".":
            return match.end()
    return len(text)
