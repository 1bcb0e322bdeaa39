"""Cuts in a statement that must not be rewritten, because it holds blank nodes or collections."""

from collections.abc import Iterable, Mapping

from adaptbot_cli.adapters.store.turtle.statement import Fact, Group, Statement

Cut = tuple[int, int]


def operate(
    text: str, statement: Statement, removed: set[Fact], replaced: Mapping[Fact, str]
) -> str:
    """Give the statement's text without the removed facts, with new text for replaced objects.

    All other tokens, comments and lines stay as they are. At least one fact must remain.
    """
    edits: list[tuple[int, int, str]] = []
    for group in statement.groups:
        edits += [(a, b, "") for a, b in _joined(text, _cuts(group, removed))]
        for fact, item in group.facts():
            if fact in replaced:
                edits.append((item.start, item.end, replaced[fact]))
    position, end = statement.place.start, statement.place.end
    pieces = []
    for start, stop, new in sorted(edits):
        if not new:
            start, stop = _widened(text, max(start, position), stop)
        pieces += [text[position:start], new]
        position = max(stop, position)
    return "".join(pieces) + text[position:end]


def _cuts(group: Group, removed: set[Fact]) -> list[Cut]:
    gone = [
        item.term is not None and (group.predicate, item.term) in removed for item in group.objects
    ]
    cuts = [(item.start, item.end) for item, out in zip(group.objects, gone, strict=True) if out]
    for at, item in enumerate(group.objects):
        # A comma stays between two objects that stay.
        if item.comma and (gone[at] or all(gone[:at])):
            cuts.append((item.comma.start, item.comma.end))
    if all(gone):
        cuts.append((group.verb.start, group.verb.end))
        cuts += [(token.start, token.end) for token in group.closers]
    return sorted(cuts)


def _joined(text: str, cuts: Iterable[Cut]) -> list[Cut]:
    """Join cuts with nothing but white space between them."""
    joined: list[Cut] = []
    for start, end in cuts:
        if joined and not text[joined[-1][1] : start].strip(" \t\r\n"):
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((start, end))
    return joined


def _widened(text: str, start: int, end: int) -> Cut:
    """Take in the line if nothing is left on it, else the white space that is left over."""
    before, after = start, end
    while text[before - 1] in " \t":
        before -= 1
    while text[after : after + 1] and text[after] in " \t":
        after += 1
    line_ends = text[after : after + 1] in ("", "\n", "\r")
    if line_ends and text[before - 1] == "\n":
        newline = text.find("\n", after)
        return before, len(text) if newline < 0 else newline + 1
    if line_ends:
        return before, end
    return (start, after) if before < start or text[start - 1] == "\n" else (start, end)
