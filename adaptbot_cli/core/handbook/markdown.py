"""Small pieces of Markdown, safe whatever the text in them is."""

import re
from collections.abc import Iterable, Iterator, Sequence
from inspect import cleandoc

from adaptbot_cli.core.visible import visible

_SPECIAL = re.compile(r"([\\`*\[\]<>|#~]|(?<!\w)_|_(?!\w))")


def said(text: str) -> str:
    """Return a text on one line, nothing in which Markdown reads as more than text."""
    return _SPECIAL.sub(r"\\\1", visible(text))


def code(text: str) -> str:
    """Return a name as code."""
    return f"`{visible(text).replace('`', chr(0x2BC))}`"


def listed(names: Iterable[str]) -> str:
    """Return names as code, with commas."""
    return ", ".join(map(code, names))


def count(number: int, one: str) -> str:
    """Say how many there are: "1 task", "2 tasks"."""
    return f"{number} {one}{'' if number == 1 else 's'}"


def must(query: str, message: str, more: str = "") -> Iterator[str]:
    """Give an item of a list: a query that must hold, and the sentence when it does not."""
    yield from (f"- must hold, or else “{said(message)}”{more}:", "")
    yield from (*sparql(query, "  "), "")


def sparql(text: str, indent: str = "") -> Iterator[str]:
    """Give the lines of a query as a block of code."""
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
    yield f"{indent}{fence}sparql"
    for line in cleandoc(text).splitlines():
        yield f"{indent}{visible(line)}".rstrip()
    yield f"{indent}{fence}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Give the lines of a table of Markdown cells."""
    yield f"| {' | '.join(head)} |"
    yield f"|{' --- |' * len(head)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"
