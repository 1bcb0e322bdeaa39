"""Values in structures as one kind of tree, whatever form they are written in."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from adaptbot_cli.core.parse.calls import read_args, unescape

Args = list[tuple[str, str]]
"""Arguments, each behind its keyword or behind ""."""

_DEPTH = 40
_TOKENS = 50_000
_PAIRS = {"[": "]", "{": "}", "(": ")"}
_TOKEN = re.compile(
    r"(?:\s++|//[^\n]*+|\#[^\n]*+)*(?:"
    r"([\[{(])|([\]})])|([,:])"
    r"|\"([^\"\\\n]*+(?:\\.[^\"\\\n]*+)*)\"|'([^'\\\n]*+(?:\\.[^'\\\n]*+)*)'"
    r"|([-+\w.]++))"
)
KEYWORD = re.compile(r"[^\W\d]\w{0,80}")


@dataclass(slots=True)
class Node:
    """A value at the offsets `start` to `end`: a list's `items`, a map's under their `keys`.

    `end` is -1 while a list or map has not been closed; the items read so far are there.
    """

    kind: Literal["string", "word", "list", "map"]
    start: int
    end: int = -1
    text: str = ""
    items: list["Node"] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)

    @property
    def plain(self) -> bool:
        """Whether it is a text or a word."""
        return self.kind in ("string", "word")

    def add(self, item: "Node", key: str = "") -> None:
        """Add an item to a list, or to a map under a key."""
        self.items.append(item)
        if self.kind == "map":
            self.keys.append(key)

    def entries(self) -> Iterator[tuple[str, "Node"]]:
        """Yield a map's keys, in lower case, and values in the order written."""
        return ((key.lower(), item) for key, item in zip(self.keys, self.items, strict=False))

    def get(self, *keys: str) -> "Node | None":
        """Find the value under the first of some keys that the map has."""
        found = dict(self.entries())
        return next((found[key] for key in keys if key in found), None)


def read_literal(text: str, pos: int) -> tuple[Node, int]:
    """Read the list, tuple or map that opens at `pos`: JSON as models write it, Python's too.

    Returns it and where the reading ended. Where the text is no such value the reading ends there,
    and the values not yet closed stay open.
    """
    root = Node("map" if text[pos] == "{" else "list", pos)
    stack, pos, wants = [root], pos + 1, ""
    for _ in range(_TOKENS):
        match = _TOKEN.match(text, pos)
        if match is None or not stack:
            break
        node, kind = stack[-1], match.lastindex or 0
        written = match[kind]
        keyed = node.kind == "map" and len(node.keys) == len(node.items)
        if kind == 3 and written == wants:
            wants = ""
        elif kind == 2 and written == _PAIRS[text[node.start]] and (keyed or node.kind == "list"):
            node.end, wants = match.end(), ","
            stack.pop()
        elif kind in (2, 3) or wants or (kind == 1 and (keyed or len(stack) >= _DEPTH)):
            break
        elif kind == 1:
            inner = Node("map" if written == "{" else "list", match.start(kind))
            node.items.append(inner)
            stack.append(inner)
        elif keyed:
            node.keys.append(written if kind == 6 else unescape(written))
            wants = ":"
        else:
            plain = written if kind == 6 else unescape(written)
            start = match.start(kind) - (kind != 6)
            node.items.append(Node("word" if kind == 6 else "string", start, match.end(), plain))
            wants = ","
        pos = match.end()
    return root, pos


def flattened(node: Node) -> Args | None:
    """Flatten a value to arguments; None if an object stands where an argument should."""
    if node.kind == "string" and node.text.strip()[:1] in ("{", "["):
        inner, _ = read_literal(node.text.strip(), 0)
        return flattened(inner) if inner.end >= 0 else None
    if node.kind == "string" and "," in node.text:
        reading = read_args(node.text + ")", 0)
        literal = any(how == "l" for _, _, how in reading.found)
        return None if reading.error or literal else [arg[:2] for arg in reading.found]
    if node.plain:
        null = node.kind == "word" and node.text.lower() in ("null", "none")
        return [] if null else [("", node.text.strip())]
    args: Args = []
    for key, item in zip(node.keys or [""] * len(node.items), node.items, strict=False):
        nested = [("", item.text.strip())] if item.kind == "string" else flattened(item)
        if nested is None or item.kind == "map":
            return None
        named = len(nested) == 1 and KEYWORD.fullmatch(key)
        args += [(key, nested[0][1])] if named else nested
    return args
