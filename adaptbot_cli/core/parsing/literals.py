"""Reading JSON as models write it: with positions, Python's quotes, trailing commas, cut off."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from adaptbot_cli.core.parsing.scan import unescape

Kind = Literal["string", "word", "list", "map"]

_DEPTH = 40
_TOKENS = 50_000
_TOKEN = re.compile(
    r"(?:\s++|//[^\n]*+|\#[^\n]*+)*(?:"
    r"([\[{])|([\]}])|([,:])"
    r"|\"([^\"\\\n]*+(?:\\.[^\"\\\n]*+)*)\"|'([^'\\\n]*+(?:\\.[^'\\\n]*+)*)'"
    r"|([-+\w.]++))"
)


@dataclass(slots=True)
class Node:
    """A value at the offsets `start` to `end`: a list's `items`, a map's under their `keys`.

    `end` is -1 while a list or map has not been closed; the items read so far are there.
    """

    kind: Kind
    start: int
    end: int = -1
    text: str = ""
    items: list["Node"] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)

    def entries(self) -> Iterator[tuple[str, "Node"]]:
        """Yield a map's keys, in lower case, and values in the order written."""
        return ((key.lower(), item) for key, item in zip(self.keys, self.items, strict=False))

    def get(self, *keys: str) -> "Node | None":
        """Find the value under the first of some keys that the map has."""
        found = dict(self.entries())
        return next((found[key] for key in keys if key in found), None)


@dataclass(slots=True)
class _Frame:
    node: Node
    wants: Literal["item", "colon", "comma"] = "item"


def read_literal(text: str, pos: int) -> tuple[Node, int]:
    """Read the list or map that opens at `pos`; returns it and where the reading ended.

    Where the text is no JSON the reading ends there, and the values not yet closed stay open.
    """
    root = Node("list" if text[pos] == "[" else "map", pos)
    stack = [_Frame(root)]
    pos += 1
    for _ in range(_TOKENS):
        match = _TOKEN.match(text, pos)
        if match is None or not _take(stack, match):
            break
        pos = match.end()
        if not stack:
            break
    return root, pos


def _take(stack: list[_Frame], match: re.Match[str]) -> bool:
    """Add a token to the innermost open value; tells whether it fits there."""
    frame = stack[-1]
    node = frame.node
    kind = match.lastindex or 0
    written = match[kind]
    wants_key = node.kind == "map" and len(node.keys) == len(node.items)
    if kind == 3:
        return _punctuate(frame, written)
    if kind == 2:
        return _close(stack, written, match.end(), wants_key)
    if frame.wants != "item" or (kind == 1 and (wants_key or len(stack) >= _DEPTH)):
        return False
    if kind == 1:
        inner = Node("list" if written == "[" else "map", match.start(kind))
        node.items.append(inner)
        frame.wants = "comma"
        stack.append(_Frame(inner))
        return True
    plain = written if kind == 6 else unescape(written)
    if wants_key:
        node.keys.append(plain)
        frame.wants = "colon"
        return True
    start = match.start(kind) - (kind != 6)
    node.items.append(Node("word" if kind == 6 else "string", start, match.end(), plain))
    frame.wants = "comma"
    return True


def _punctuate(frame: _Frame, mark: str) -> bool:
    if frame.wants != ("comma" if mark == "," else "colon"):
        return False
    frame.wants = "item"
    return True


def _close(stack: list[_Frame], mark: str, end: int, wants_key: bool) -> bool:
    node = stack[-1].node
    complete = node.kind == "list" or wants_key
    if not complete or mark != ("]" if node.kind == "list" else "}"):
        return False
    node.end = end
    stack.pop()
    return True
