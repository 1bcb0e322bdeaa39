"""Conditions and loops around calls: finding a header such as `if is_full("sink"):` in a line."""

import re
from dataclasses import dataclass, field

_WORD = re.compile(
    r"(?:\}\s*)?(if|elif|else|unless|otherwise|for|while|repeat|try|except|finally|def)\b"
    r"(?=[\s:,({]|\Z)",
    re.IGNORECASE,
)
# A function without arguments, and what starts it, rule nothing: the body is the plan.
_FRAME = re.compile(
    r"(?:(?:async|export)\s+)?(?:def|function)\s+(\w+)\s*\(\s*(?:self)?\s*\)[^:{(]{0,60}[:{]"
    r"|if\s+__name__\s*==\s*[\"']__main__[\"']\s*:"
)
_LOOP = re.compile(r"\s*(?:\w+(?:\s*,\s*\w+)*\s+in\b|each\b|every\b|all\b|\()", re.IGNORECASE)
_THEN = re.compile(r"\bthen\b:?", re.IGNORECASE)
_MARKS = re.compile(r"\"[^\"]*+\"|(?<!\w)'[^']*+'|[()\[\]:,]")
_SENTENCE_END = re.compile(r"[.!?]\s+(?=[A-Z`])")
_ENGLISH = ("unless", "otherwise", "repeat")
_BRANCHES = ("if", "elif", "else", "unless", "otherwise")


@dataclass(frozen=True, slots=True)
class Header:
    """A condition at the start of a line. What it rules stands from `body` to `until`.

    `opens` tells that the following lines are ruled too: the line holds nothing but the condition.
    """

    condition: str
    body: int
    until: int
    opens: bool


@dataclass(slots=True)
class Blocks:
    """The conditions that are open at a line, told by indentation as in Python."""

    _open: list[tuple[int, str]] = field(default_factory=list)
    _fresh: bool = False
    _blank: bool = False

    def open(self, indent: int, condition: str) -> None:
        """Begin a block at a header that stands `indent` deep."""
        self._leave(indent)
        self._open.append((indent, condition))
        self._fresh, self._blank = True, False

    def blank(self) -> None:
        """Take note of a blank line: behind it, a body must be indented."""
        self._blank = True

    def clear(self) -> str:
        """End every block; returns the condition of a header that still waits for its body."""
        waiting = self._open[-1][1] if self._open and self._fresh else ""
        self._open.clear()
        return waiting

    def condition(self, indent: int) -> str:
        """Name the condition that a line `indent` deep stands under, or nothing."""
        if self._open and self._fresh and not self._blank and indent <= self._open[-1][0]:
            # Models forget to indent. Running the body anyway would be the worse mistake.
            self._fresh = False
            return self._open.pop()[1]
        self._leave(indent)
        self._fresh = False
        return self._open[-1][1] if self._open else ""

    def _leave(self, indent: int) -> None:
        while self._open and indent <= self._open[-1][0]:
            self._open.pop()


def read_frame(text: str, start: int, end: int) -> tuple[str, int] | None:
    """Read the head of a function around calls: its name and where its body begins.

    The name is empty at `if __name__ == "__main__":`, which starts one.
    """
    match = _FRAME.match(text, start, end)
    return None if match is None else (match[1] or "", match.end())


def read_header(text: str, start: int, end: int, fenced: bool) -> Header | None:
    """Read the condition that a line's content, from `start` to `end`, begins with, if any.

    "If the pan is dirty, clean it" is one as well; "For the salad:" and "While it boils:" are not.
    """
    match = _WORD.match(text, start, end)
    if match is None:
        return None
    word = match[1].lower()
    # In prose the condition ends with its sentence.
    sentence = None if fenced else _SENTENCE_END.search(text, match.end(), end)
    until = sentence.start() if sentence else end
    colon, comma = _separators(text, match.end(), until)
    if word == "for" and not _LOOP.match(text, match.end(), end):
        return None
    if word in _ENGLISH and text[match.end() : match.end() + 1] == "(":
        return None
    # "While it boils:" is prose, and "repeat this until it is clean" rules no line below.
    code = fenced or match[1].islower() or word == "for"
    if word not in _BRANCHES and (not code or (colon < 0 and not _braced(text, end))):
        return None
    comma = -1 if fenced else comma
    body = _body(text, match, until, colon, comma)
    # "If it is dirty, clean it first:" has said its piece; the lines below are the plan again.
    alone = until == end and not text[body:end].strip(" {*_`\t")
    opens = alone and not 0 <= comma < max(body, colon)
    condition = text[match.start(1) : body].rstrip(" :,{\t")
    return Header(condition or match[1], body, until, opens)


def _body(text: str, word: re.Match[str], end: int, colon: int, comma: int) -> int:
    """Find where the condition ends and what it rules begins."""
    call_before_colon = comma >= 0 and text.find("(", comma, colon) >= 0
    if colon >= 0 and not call_before_colon:
        return colon + 1
    then = _THEN.search(text, word.end(), end)
    if then and not 0 <= comma < then.start() - 1:
        return then.end()
    if word[1].lower() in ("else", "try", "finally"):
        return word.end()
    if text[word.end() : end].lstrip().startswith("("):
        return _closing(text, word.end(), end)
    if comma >= 0:
        return comma + 1
    return end if _is_bare(text, word.end(), end) else word.end()


def _is_bare(text: str, start: int, end: int) -> bool:
    """Tell whether nothing that could be a call stands there: `if the sink is full`."""
    return text.find("(", start, end) < 0


def _separators(text: str, start: int, end: int) -> tuple[int, int]:
    """Find the first colon and the first comma outside quotes and brackets, -1 if there is none."""
    depth = 0
    comma = -1
    for mark in _MARKS.finditer(text, start, end):
        char = mark[0]
        if char in "([":
            depth += 1
        elif char in ")]":
            depth -= 1
        elif depth == 0 and char == ",":
            comma = mark.start() if comma < 0 else comma
        elif depth == 0 and char == ":":
            return mark.start(), comma
    return -1, comma


def _closing(text: str, start: int, end: int) -> int:
    """Find the end of the parenthesis that opens first: the condition of `if (dirty) clean()`."""
    depth = 0
    for mark in _MARKS.finditer(text, start, end):
        if mark[0] in "()":
            depth += 1 if mark[0] == "(" else -1
            if depth == 0:
                return mark.end()
    return end


def _braced(text: str, end: int) -> bool:
    return text[max(0, end - 20) : end].rstrip().endswith("{")
