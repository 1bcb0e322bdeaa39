"""Where new blocks and new prefix declarations go in a document."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence

from adaptbot_cli.adapters.store.turtle.document import Document, Edit


def declaration_edit(document: Document, lines: Sequence[str]) -> Edit:
    """Put declarations after the leading ones, or else before the first statement."""
    text = "".join(line + document.newline for line in lines)
    if document.head_end is not None:
        return _on_fresh_line(document, document.head_end, text)
    if document.body_start is not None:
        return Edit(document.body_start, document.body_start, text + document.newline)
    return _at_end(document, text)


def block_edits(document: Document, blocks: Mapping[str, str], gone: set[int]) -> list[Edit]:
    """Put blocks (by their subjects as written, sorted) in their alphabetical places.

    `gone` are the starts of statements that are being removed.
    """
    if not blocks:
        return []
    if not document.in_order:
        return [_at_end(document, _spaced(document, list(blocks.values()), blank=True))]
    stays = [place for place in document.subjects if place.start not in gone]
    heads = [place.head for place in stays]
    slots: dict[int, list[str]] = {}
    for head, block in blocks.items():
        slots.setdefault(bisect_right(heads, head), []).append(block)
    return [
        _after(document, stays[slot - 1].end if slot else document.head_end, slots[slot])
        for slot in slots
    ]


def _after(document: Document, end: int | None, blocks: list[str]) -> Edit:
    if end is not None:
        line = document.line_end(end)
        blank = line is None or document.is_blank(line)
        return _on_fresh_line(document, end, _spaced(document, blocks, blank=blank))
    start = document.body_start
    if start is None:
        return _at_end(document, _spaced(document, blocks, blank=True))
    newline = document.newline
    return Edit(start, start, "".join(block + newline + newline for block in blocks))


def _spaced(document: Document, blocks: list[str], *, blank: bool) -> str:
    newline = document.newline
    return "".join((newline if blank else "") + block + newline for block in blocks)


def _on_fresh_line(document: Document, end: int, text: str) -> Edit:
    line = document.line_end(end)
    if line is None:
        return Edit(end, end, document.newline + text)
    return Edit(line, line, text)


def _at_end(document: Document, text: str) -> Edit:
    end = len(document.text)
    if not document.text:
        return Edit(end, end, text)
    ended = document.text.endswith("\n")
    return Edit(end, end, text if ended else document.newline + text)
