"""Small readings of trusted SPARQL text from a domain pack. Nothing a model wrote comes here."""

import itertools
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any

import pyoxigraph
from rdflib import BNode, Graph, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.graph.terms import Triple, triple_of

SKIP = r"<[^<>\s]*>|\"\"\".*?\"\"\"|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])*'|#[^\n]*"
"""What a query has in it that is neither keyword nor variable: IRIs, strings, comments."""

_PREFIX = re.compile(r"PREFIX\s+(\w*):\s*<([^>]*)>")
_VARIABLE = "urn:adaptbot:variable:"
_TOKEN = re.compile(rf"({SKIP})|(\w+):(\w+)|([{{}}])|(\w+)", re.DOTALL)

_GROUPS = ("DELETE", "INSERT", "WHERE")
_OUTSIDE = {
    "SERVICE": "ServiceGraphPattern",
    "LOAD": "Load",
    "FROM": "DatasetClause",
    "USING": "UsingClause",
}
"""The clauses that reach outside the graph, as rdflib's parser names them."""

_SHORT, _FLAT = 1_000, 12
"""Characters and nested brackets of a query that any thread's stack bears."""

_CODEPOINT = re.compile(r"\\u([0-9A-Fa-f]{4})|\\U([0-9A-Fa-f]{8})")


def reaches_out(text: str) -> str:
    """Return the word by which a query or update would reach outside the graph, "" if none does.

    Only a text with the letters of such a word, wherever they stand but right behind the mark of a
    variable or a prefix, can hold the clause; then it is parsed. A carriage return ends a comment
    for the engine and not for the parser: see `one_newline`.

    Raises:
        ValueError: it has the letters and cannot be parsed, so that nothing is known of it.
    """
    letters = _CODEPOINT.sub(_character, text).upper()
    words = [word for word in _OUTSIDE if re.search(rf"(?<![?$:]){word}", letters)]
    if not words:
        return ""
    from rdflib.plugins.sparql.parser import parseQuery, parseUpdate

    parse = parseUpdate if form_of(text) == "update" else parseQuery
    try:
        found = set(_clauses(parse(text)))
    except Exception as problem:  # its parser raises many kinds
        message = str(problem).partition("\n")[0]
        raise ValueError(f"this is no valid SPARQL: {message}") from None
    return next((word for word in words if _OUTSIDE[word] in found), "")


def _clauses(part: Any) -> Iterator[str]:
    """The names of all clauses of a parsed query."""
    from pyparsing import ParseResults  # slow, and most texts need no parsing

    if isinstance(part, dict):
        yield str(getattr(part, "name", ""))
        part = list(part.values())
    if isinstance(part, list | tuple | ParseResults):
        for below in part:
            yield from _clauses(below)


_MAKES_TEXT = re.compile(
    r"(?<![\w?$:-])(CONCAT|REPLACE|GROUP_CONCAT|ENCODE_FOR_URI)(?:\s|#[^\n]*\n)*\(", re.IGNORECASE
)


def makes_text(query: str) -> str:
    """Return the function by which a query makes longer texts, "" if none does.

    A few dozen of them, each in the next, fill the memory before any clock ends them.
    """
    found = _MAKES_TEXT.search(_CODEPOINT.sub(_character, query))
    return found[1].upper() if found else ""


def one_newline(text: str) -> str:
    """Return a query in which every line ends with the newline alone."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _character(match: re.Match[str]) -> str:
    code = int(match[1] or match[2], 16)
    return chr(code) if code < 0x110000 else " "


def prefixed(graph: Graph, text: str) -> str:
    """Return the PREFIX lines for those prefixes of `graph` that `text` uses."""
    used = {match[2] for match in _TOKEN.finditer(text) if match[2]}
    spaces = {prefix: str(iri) for prefix, iri in graph.namespaces() if prefix in used}
    return "".join(f"PREFIX {prefix}: <{spaces[prefix]}> " for prefix in sorted(spaces))


@lru_cache(maxsize=4096)
def mentions(query: str) -> frozenset[URIRef]:
    """Return every IRI that a query with PREFIX lines names by a prefix."""
    spaces = prefixes_of(query)
    found = {
        URIRef(spaces[match[2]] + match[3])
        for match in _TOKEN.finditer(query)
        if match[2] in spaces
    }
    return frozenset(found)


@lru_cache(maxsize=1024)
def ruled_out(query: str) -> frozenset[URIRef]:
    """Return the IRIs that a query only compares with: what something is not to be."""
    spaces = prefixes_of(query)
    found = re.findall(r"!=\s*(\w+):(\w+)", query)
    return frozenset(URIRef(spaces[prefix] + name) for prefix, name in found if prefix in spaces)


_UPDATES = frozenset(
    ("INSERT", "DELETE", "WITH", "LOAD", "CLEAR", "DROP", "CREATE", "ADD", "MOVE", "COPY")
)
_QUERIES = frozenset(("SELECT", "ASK", "CONSTRUCT", "DESCRIBE"))
_PROLOGUE = re.compile(r"\s*(?:PREFIX\s+[^\s:]*:|BASE)\s*<[^<>\s]*>", re.IGNORECASE)


def form_of(text: str) -> str:
    """Return what a text begins as, "query" or "update"; "" if as neither."""
    body = re.sub(SKIP, _blanked, text, flags=re.DOTALL)
    while prologue := _PROLOGUE.match(body):
        body = body[prologue.end() :]
    word = re.match(r"\s*(\w*)", body)
    first = word[1].upper() if word else ""
    return "update" if first in _UPDATES else "query" if first in _QUERIES else ""


def unknown_prefixes(text: str, known: Iterable[str]) -> list[str]:
    """Return the prefixes that a query uses, and neither declares nor finds among those known."""
    plain = re.sub(SKIP, lambda m: m[0] if m[0].startswith("<") else " ", text, flags=re.DOTALL)
    declared = {*known, *re.findall(r"PREFIX\s+([\w.-]*):", plain, re.IGNORECASE)}
    bare = re.sub(SKIP, " ", plain, flags=re.DOTALL)
    used = re.findall(r"(?<![\w:?$.-])([A-Za-z][\w.-]*)?:(?=[\w%\\])", bare)
    return [prefix for prefix in dict.fromkeys(used) if prefix not in declared]


def in_order(query: str, names: Iterable[str]) -> str:
    """Return a `SELECT *` with its variables named, in the order in which they first stand.

    Any other query is returned as it is.
    """
    plain = re.sub(SKIP, lambda m: " " * len(m[0]), query, flags=re.DOTALL)
    star = re.match(r"[^{]*?\bSELECT\s+(?:DISTINCT\s+|REDUCED\s+)?(\*)", plain, re.IGNORECASE)
    wanted = frozenset(names)
    if star is None or not wanted:
        return query
    shown = dict.fromkeys(name for name in used_variables(query) if name in wanted)
    listed = " ".join(f"?{name}" for name in shown)
    return f"{query[: star.start(1)]} {listed} {query[star.end(1) :]}"


def prefixes_of(query: str) -> dict[str, str]:
    """Return the prefixes that a query declares."""
    return dict(_PREFIX.findall(query))


def split_update(text: str) -> tuple[str, str, str]:
    """Split `DELETE {…} INSERT {…} WHERE {…}` into the insides of its three groups.

    DELETE or INSERT may be missing.

    Raises:
        ValueError: the text has another form; the message completes "ab:effect …".
    """
    plain = re.sub(SKIP, _blanked, text, flags=re.DOTALL)
    heads: list[str] = []
    groups: list[str] = []
    depth = start = end = 0
    for match in (match for match in _TOKEN.finditer(plain) if match[4]):
        if match[4] == "{" and depth == 0:
            heads.append(plain[end : match.start()].strip())
            start = match.end()
        depth += 1 if match[4] == "{" else -1
        if depth == 0:
            groups.append(text[start : match.start()].strip())
            end = match.end()
    stray = [head for head in (*heads, plain[end:].strip()) if head and head.upper() not in _GROUPS]
    if stray and "{" not in stray[0] and heads:
        found = " ".join(stray[0].split())
        raise ValueError(f'has "{found}" where only DELETE, INSERT or WHERE may stand')
    parts = dict(zip([head.upper() for head in heads], groups, strict=False))
    ordered = [word for word in _GROUPS if word in parts]
    if depth or len(ordered) < 2 or "WHERE" not in parts or list(parts) != ordered or stray:
        raise ValueError("must be a SPARQL update of the form DELETE {…} INSERT {…} WHERE {…}")
    if len(heads) > len(parts):
        raise ValueError("may have each of DELETE, INSERT and WHERE once only")
    return parts.get("DELETE", ""), parts.get("INSERT", ""), parts["WHERE"]


def _blanked(match: re.Match[str]) -> str:
    """A comment as blanks; anything else as it is."""
    return " " * len(match[0]) if match[0].startswith("#") else match[0]


def template(prefixes: str, text: str) -> tuple[Triple, ...]:
    """Read the triples of a DELETE or INSERT group, with a `Variable` wherever it has one.

    Such a group is Turtle but for its variables, so it is read as Turtle.

    Raises:
        ValueError: the text is no such group; the message says what is wrong.
    """

    def named(match: re.Match[str]) -> str:
        return match[1] or f"<{_VARIABLE}{match[2]}>"

    turtle = re.sub(rf"({SKIP})|\?(\w+)", named, text.strip(), flags=re.DOTALL)
    stop = "" if turtle.endswith(".") or not turtle else " ."
    try:
        quads = list(pyoxigraph.parse(f"{prefixes}{turtle}{stop}", pyoxigraph.RdfFormat.TURTLE))
    except SyntaxError as problem:
        raise ValueError(" ".join(str(problem).split())) from None
    nodes = (triple_of(quad.triple) for quad in quads)
    found = sorted((_variable(s), _variable(p), _variable(o)) for s, p, o in nodes)
    if any(isinstance(node, BNode) for triple in found for node in triple):
        raise ValueError("a group of triples may hold no blank node")
    return tuple(found)


def _variable(node: Node) -> Node:
    if isinstance(node, URIRef) and node.startswith(_VARIABLE):
        return Variable(node.removeprefix(_VARIABLE))
    return node


def bindable(query: str) -> str:
    """Return an equal query in which every variable can be bound from outside.

    The engine binds only variables that a query projects; one that stands in a FILTER alone, such
    as the robot in "nothing is in the robot's hand", would be refused.
    """
    if re.search(r"\bGROUP\s+BY\b", query, re.IGNORECASE):
        return query  # what is grouped away cannot be projected; such a query binds what it shows
    body = query.index("{")
    names = " ".join(f"?{name}" for name in sorted(variables(query[body:])))
    if re.search(r"\bSELECT\b", query[:body]):
        head = query[:body]
        missing = [name for name in names.split() if not re.search(rf"\{name}\b", head)]
        where = re.search(r"(?<!\?)\bWHERE\s*$", head, re.IGNORECASE)
        cut = where.start() if where else len(head)
        return f"{head[:cut]} {' '.join(missing)} {head[cut:]}{query[body:]}"
    if not names:
        return query
    return f"{query[:body]}{{ SELECT {names} WHERE {query[body:]}\n}}"


def dollars(query: str) -> list[str]:
    """Return the variables that a query writes as `$name`, as SPARQL allows and this tool not."""
    return [m[2] for m in re.finditer(rf"({SKIP})|(\$\w+)", query, re.DOTALL) if m[2]]


@lru_cache(maxsize=4096)
def is_plain(query: str, bound: frozenset[str]) -> bool:
    """Tell whether a query cannot take long: all its variables but one at most are bound.

    It takes time in proportion to the facts then; and it is short and flat, so that the engine
    needs no more stack for it than any thread has.
    """
    text = re.sub(SKIP, "", query, flags=re.DOTALL)
    open_ = len({name for name in used_variables(query) if name not in bound})
    depth = itertools.accumulate((c in "({") - (c in ")}") for c in text)
    flat = len(text) <= _SHORT and max(depth, default=0) <= _FLAT and "!!" not in text
    return open_ <= 1 and flat and "[" not in text and "_:" not in text


def used_variables(query: str) -> list[str]:
    """Return the name of each variable of a query each time it stands there, in order."""
    found = re.finditer(rf"({SKIP})|[?$](\w+)", query, re.DOTALL)
    return [match[2] for match in found if match[2]]


@lru_cache(maxsize=1024)
def variables(query: str) -> frozenset[str]:
    """Return the names of the variables in a query, so that only those are bound."""
    return frozenset(re.findall(r"\?(\w+)", query))
