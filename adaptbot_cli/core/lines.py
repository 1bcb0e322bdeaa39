"""Reading a text line by line: prose, Markdown and code around the calls."""

import keyword
import re
from dataclasses import dataclass, field

from adaptbot_cli.core.control import Blocks, read_header
from adaptbot_cli.core.jsonplan import read_json
from adaptbot_cli.core.plan import Call
from adaptbot_cli.core.recap import SEPARATED, heading_strength
from adaptbot_cli.core.scan import (
    UNCLOSED_QUOTE,
    Item,
    Reading,
    conditional,
    name_before,
    read_args,
    shown,
    swallow,
)

# A plan takes a few hundred units: one for a line, one for a parenthesis, some for a fault.
_EFFORT = 30_000
_FAULT = 9
_JSON_UNIT = 16
_LOOK = 60
_LONG = 300

_FENCE = re.compile(r"[\s>]*(?:(?:[-*+]|\d+[.)])\s+)?(`{3,}|~{3,})([^`(\"]*)\Z")
_PREFIX = re.compile(r"[\s>|]*(?:(?:[-*+•·–—]|\(?\d{1,4}[.):]\)?|\#{1,6})\s+)*[*`]*")
_COMMENT = re.compile(r"(?:\A|(?<=[\s);`.,]))(?:#(?!\d)|//)")
_JSON = re.compile(r"(?:[^\[{\"'(]|(?<=\w)'(?=\w))*+([\[{])\s*(?:[\[{\"'\]}]|\w+\s*:|\Z)")
_TRAILING_IF = re.compile(r"[ \t`*]*(?=(?:if|unless)\b)")
_QUOTED = re.compile(r"[ \t]*[\"'“‘]")
_PLURAL = {"s", "es", "ies"}

# What may stand before and behind a call that is no part of a sentence.
_LABEL = (
    r"(?:<\w+>\s*)?(?:\**(?:step|action|call)\s*\d*\s*[.:)\-]+\**\s*)?"
    r"(?:(?:then|and|next|first|finally|lastly|now)\b[,:]?)?"
)
_BEFORE = re.compile(
    rf"[\s>|*+\-•·–—`_;,.&#\"']*+(?:\(?\d{{1,4}}\s?[.:)|]+\s*+)?[*_`]*+{_LABEL}"
    r"[\s`*_]*+(?:\w+\s*=\s*)?",
    re.IGNORECASE,
)
_BEHIND = re.compile(
    r"[ \t`*_\"']*(?:\Z|\n|[;,.|#:\-–—→<&\])]|//|(?:then|and|s|sec\w*|min\w*|hours?)\b)"
)
_SIMPLE = re.compile(r"[-+]?[\d.]+|[^\W\d]\w*")

_SILENT = re.compile(r"[\s\[\](){};,.`*_=\-|>~]*|\w+\s*=\s*[\[({]|pass|end\s*\w*|<[/?]?\w[^<>]*>")
_SENTENCE = re.compile(
    r"(?:[A-Z\d]|[-*•]\s)[^=(\"]*\s[^=(\"]*[.:!?]|[A-Z\d\s&.,:-]+|\w[\w ]*:|\*\*.*\*\*:?"
)
_ATTEMPT = re.compile(r"[a-z]+_\w+(?:\[|\s+[\"“'‘])")
_BROKEN = re.compile(r"\s*(?:\w+(?:\s*,\s*\w+)*\s*(?:\n|\Z)|[\[{])")


@dataclass(slots=True)
class ReadText:
    """What stands in a text, in order; `gaps` tells what stands before the call of an index."""

    items: list[Item] = field(default_factory=list)
    gaps: dict[int, int] = field(default_factory=dict)


def read_text(text: str) -> ReadText:
    """Read the calls of a text whose lines end in a line feed."""
    return _read(text, _Effort())


def _read(text: str, effort: "_Effort") -> ReadText:
    reader = _Reader(text, effort)
    reader.read()
    return reader.found


class _ExhaustedError(Exception):
    """The effort is used up; never leaves this module."""


@dataclass(slots=True)
class _Effort:
    """Bounds the time that a text takes which no model writes, strings inside it included."""

    left: int = _EFFORT

    def spend(self, units: int) -> None:
        self.left -= units
        if self.left < 0:
            raise _ExhaustedError


class _Reader:
    def __init__(self, text: str, effort: _Effort) -> None:
        self.found = ReadText()
        self._text = text
        self._effort = effort
        self._at = 0
        self._calls = 0
        self._fenced = False
        self._fence_condition = ""
        self._blocks = Blocks()
        self._no_json_before = 0

    def read(self) -> None:
        try:
            self._read_lines()
        except _ExhaustedError:
            message = "The text is not read on from here: it holds far too much for a plan."
            self._add(Item(self._at, "", code="P102", message=message))

    def _read_lines(self) -> None:
        pos = 0
        while pos < len(self._text):
            end = self._line_end(pos)
            if end == pos or self._text[pos:end].isspace():
                self._blocks.blank()
                pos = end + 1
                continue
            self._at = pos
            self._effort.spend(1)
            pos = self._read_line(pos, end)

    def _read_line(self, start: int, end: int) -> int:
        """Read the line, and the lines that its last call or its JSON runs on over.

        Returns where to go on: the start of a line.
        """
        if self._read_fence(start, end):
            return end + 1
        after = self._read_json(start, end)
        if after:
            return self._scan(after, self._line_end(after), "") + 1
        if self._is_comment(start, end):
            self._separate(start, end)
            return end + 1
        return self._read_statement(start, end) + 1

    def _read_fence(self, start: int, end: int) -> bool:
        """Note a line that opens or closes a code block."""
        if self._text.find("```", start, end) < 0 and self._text.find("~~~", start, end) < 0:
            return False
        fence = _FENCE.match(self._text, start, end)
        if fence is None:
            return False
        waiting = self._blocks.clear()
        # A tag in an open block opens the next one: the closing fence was forgotten.
        self._fenced = not self._fenced or bool(fence[2].strip())
        self._fence_condition = waiting if self._fenced else ""
        self._separate(start, end)
        return True

    def _read_json(self, start: int, end: int) -> int:
        """Read the JSON plan that begins in the line; returns where it ends, 0 if there is none."""
        match = _JSON.match(self._text, start, end) if start >= self._no_json_before else None
        if match is None:
            return 0
        items, after = read_json(self._text, match.start(1), self._read_string)
        self._effort.spend(2 + (after - match.start(1)) // _JSON_UNIT)
        if not items:
            self._no_json_before = after
            return 0
        for item in items:
            self._add(item)
        return after

    def _read_string(self, string: str) -> list[Item]:
        return _read(string, self._effort).items

    def _is_comment(self, start: int, end: int) -> bool:
        """Tell whether the line holds a remark only. A Markdown heading may hold a call."""
        line = self._text[start : min(end, start + _LONG)].lstrip()
        if not line.startswith(("#", "//", '"""')):
            return False
        return self._fenced or not (line.startswith("##") or "`" in line)

    def _read_statement(self, start: int, end: int) -> int:
        """Read the calls of a line and the condition they are under; returns a line's end."""
        prefix = _PREFIX.match(self._text, start, end)
        content = prefix.end() if prefix else start
        indent = self._indent(start)
        condition = self._blocks.condition(indent) or self._fence_condition
        header = read_header(self._text, content, end, self._fenced)
        if header is None:
            return self._read_calls(start, content, end, condition)
        if header.opens:
            self._blocks.open(indent, header.condition)
            return end
        after = self._scan(header.body, header.until, header.condition)
        return self._scan(after, end, condition) if after < end else after

    def _read_calls(self, start: int, content: int, end: int, condition: str) -> int:
        before = len(self.found.items)
        after = self._scan(content, end, condition)
        if len(self.found.items) > before:
            return after
        self._separate(start, end)
        line = self._text[content:end].rstrip()
        if self._fenced and self._is_unknown(line):
            self._fault(content, line, "it is not a call")
        elif not self._fenced and _ATTEMPT.match(line):
            self._fault(content, line, "a call has its arguments in parentheses")
        return after

    def _is_unknown(self, line: str) -> bool:
        """Tell whether a line of a code block says something that is neither call nor remark."""
        if len(line) > _LONG:
            return True
        return not (_SILENT.fullmatch(line) or _SENTENCE.fullmatch(line))

    def _scan(self, pos: int, end: int, condition: str) -> int:
        """Read the calls from `pos` to `end`, or to the end of the line where the last one ends."""
        anchor = pos
        while True:
            paren = self._text.find("(", pos, end)
            if paren < 0 or _COMMENT.search(self._text, pos, paren):
                return end
            self._at = anchor
            self._effort.spend(1)
            named = self._name(anchor, paren)
            reading = read_args(self._text, paren + 1) if named else None
            if named is None or reading is None:
                pos = paren + 1
            elif not self._counts(anchor, *named, reading):
                pos = min(reading.end, end)
            else:
                condition = self._alternative(anchor, named[0]) or condition
                pos = self._take(*named, reading, self._trailing_condition(reading) or condition)
                end = end if pos <= end else self._line_end(pos)
                condition = self._trailing_condition(reading) or condition
                anchor = pos

    def _name(self, anchor: int, paren: int) -> tuple[int, str] | None:
        """Find the name before a parenthesis; with a space between, only where a line begins."""
        named = name_before(self._text, paren, anchor)
        if named is None and self._text[paren - 1 : paren] == " " and paren > anchor:
            quoted = _QUOTED.match(self._text, paren + 1)
            spaced = name_before(self._text, paren - 1, anchor) if quoted else None
            named = spaced if spaced and self._leads(anchor, spaced[0]) else None
        return None if named is None or keyword.iskeyword(named[1]) else named

    def _counts(self, anchor: int, start: int, name: str, reading: Reading) -> bool:
        """Tell by its shape whether a name and a parenthesis are meant as a call.

        "the pan(s)" or "slice(s) of bread" in a sentence are not.
        """
        plural = not reading.quoted and len(reading.args) == 1 and reading.args[0] in _PLURAL
        if self._fenced:
            return not plural or self._stands_alone(anchor, start, reading)
        if plural:
            return False
        if reading.quoted or "_" in name or self._text[max(0, start - 1) : start] == "`":
            return True
        if reading.error:
            opened = self._text.find("(", start) + 1
            return self._leads(anchor, start) and bool(_BROKEN.match(self._text, opened))
        plain = all(_SIMPLE.fullmatch(arg) for arg in reading.args) or name.islower()
        return plain and self._stands_alone(anchor, start, reading)

    def _stands_alone(self, anchor: int, start: int, reading: Reading) -> bool:
        behind = _BEHIND.match(self._text, reading.end)
        return behind is not None and self._leads(anchor, start)

    def _leads(self, anchor: int, start: int) -> bool:
        """Tell whether nothing of a sentence stands between two offsets: "2. ", "; then "."""
        return start - anchor <= _LOOK and bool(_BEFORE.fullmatch(self._text, anchor, start))

    def _alternative(self, anchor: int, start: int) -> str:
        """Name the condition of the second call in `clean("pan") or clean("pot")`."""
        gap = self._text[anchor:start] if start - anchor <= _LOOK else ""
        return "or" if gap.strip(" `*,") == "or" else ""

    def _trailing_condition(self, reading: Reading) -> str:
        """Find the condition behind a call: `clean("pan") if it is dirty`."""
        match = None if reading.error else _TRAILING_IF.match(self._text, reading.end)
        if match is None:
            return ""
        line = self._text[match.end() : min(self._line_end(match.end()), match.end() + _LONG)]
        return line.partition("#")[0].strip()

    def _take(self, start: int, name: str, reading: Reading, condition: str) -> int:
        """Note a call or what is wrong with it; returns the offset behind it."""
        if reading.error:
            return self._take_broken(start, reading)
        source = self._text[start : reading.end]
        if name == "print":
            self._fault(start, source, "printing is not a step")
        elif condition:
            self._add(conditional(start, source, condition))
        else:
            self._add(Item(start, source, Call(name, reading.args)))
        return reading.end

    def _take_broken(self, start: int, reading: Reading) -> int:
        if reading.error == UNCLOSED_QUOTE:
            end = self._line_end(reading.end)
        else:
            end = swallow(self._text, reading.end)
        self._fault(start, self._text[start:end].rstrip(), reading.error)
        return end

    def _fault(self, start: int, source: str, why: str) -> None:
        self._effort.spend(_FAULT)
        message = f"{shown(source)} cannot be read: {why}."
        self._add(Item(start, source, code="P102", message=message))

    def _add(self, item: Item) -> None:
        self.found.items.append(item)
        self._calls += item.call is not None

    def _separate(self, start: int, end: int) -> None:
        """Note that text stands before the next call, and whether it announces a recap."""
        if self._calls:
            strength = heading_strength(self._text[start : min(end, start + _LONG)])
            gaps = self.found.gaps
            gaps[self._calls] = max(strength, gaps.get(self._calls, SEPARATED))

    def _indent(self, start: int) -> int:
        line = self._text[start : start + _LONG]
        return len(line.expandtabs(4)) - len(line.expandtabs(4).lstrip())

    def _line_end(self, pos: int) -> int:
        end = self._text.find("\n", pos)
        return len(self._text) if end < 0 else end
