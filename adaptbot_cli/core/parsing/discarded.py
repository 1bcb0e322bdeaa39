"""What a text itself takes back: reasoning in tags, HTML comments, struck out text."""

import re

_TAG = "(?:think|thinking|thought|reasoning)"
_MARK = re.compile(
    rf"(?P<fence>^(?:[^\S\n]|>)*(?:(?:[-*+]|\d+[.)])[^\S\n]+)?(?:`{{3}}|~{{3}})[^`(\"\n]*$)"
    rf"|(?P<string>[(,\[:=][^\S\n]*\"[^\"\\\n]*+(?:\\.[^\"\\\n]*+)*\")"
    rf"|(?P<open><{_TAG}>)|(?P<close></{_TAG}>)|(?P<comment><!--)"
    r"|(?<!~)~~(?![~\s])[^~\n]*+(?:~(?!~)[^~\n]*+)*~~(?!~)",
    re.IGNORECASE | re.MULTILINE,
)
_ENDS = {
    "open": re.compile(rf"</{_TAG}>", re.IGNORECASE),
    "comment": re.compile("-->"),
    "fence": re.compile(r"^(?:[^\S\n]|>)*(?:`{3}|~{3})[^\S\n]*$", re.MULTILINE),
}
_LETTER = re.compile(r"[^\n]")


def without_discarded(text: str) -> tuple[str, str]:
    """Return a text with what it discards as spaces, and the discarded with the rest as spaces.

    So every offset stays. The second is empty if nothing is discarded. What is opened and never
    closed goes on to the end; reasoning that is only closed began with the text.
    """
    spans = _spans(text)
    if not spans:
        return text, ""
    kept, discarded, at = [], [], 0
    for start, end in [*spans, (len(text), len(text))]:
        kept += [text[at:start], _LETTER.sub(" ", text[start:end])]
        discarded += [_LETTER.sub(" ", text[at:start]), text[start:end]]
        at = end
    return "".join(kept), "".join(discarded)


def _spans(text: str) -> list[tuple[int, int]]:
    spans: list[tuple[int, int]] = []
    at, reasoned = 0, False
    while mark := _MARK.search(text, at):
        kind, at = mark.lastgroup, mark.end()
        if kind in _ENDS:
            end = _ENDS[kind].search(text, at)
            at = end.end() if end else len(text)
        if kind == "close" and not reasoned:
            spans = [(0, at)]
        elif kind not in ("fence", "string", "close"):
            spans.append((mark.start(), at))
        reasoned = reasoned or kind in ("open", "close")
    return spans
