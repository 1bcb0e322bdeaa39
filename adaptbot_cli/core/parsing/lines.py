"""Reading a text line by line: prose, Markdown and code around the calls."""

import re
from dataclasses import dataclass, field

from adaptbot_cli.core.parsing.control import Blocks, read_frame, read_header
from adaptbot_cli.core.parsing.jsonplan import read_json
from adaptbot_cli.core.parsing.known import Known, indent_of
from adaptbot_cli.core.parsing.loops import binds
from adaptbot_cli.core.parsing.markup import read_markup, read_react
from adaptbot_cli.core.parsing.negation import negation
from adaptbot_cli.core.parsing.recap import SEPARATED, heading_strength
from adaptbot_cli.core.parsing.remarks import (
    LONG,
    is_attempt,
    is_comment,
    is_heading,
    is_silent,
    is_unknown,
)
from adaptbot_cli.core.parsing.scan import (
    LEFT_OUT,
    NESTED,
    UNCLOSED_QUOTE,
    Item,
    Reading,
    conditional,
    negated,
    read_args,
    shown,
    swallow,
)
from adaptbot_cli.core.parsing.shapes import (
    MARK,
    alternative,
    call_name,
    is_call,
    trailing_condition,
)
from adaptbot_cli.core.plan import keyworded

# A plan takes a few hundred units: one for a line, one for a parenthesis, some for a fault.
_EFFORT = 20_000
_FAULT = 9
_JSON_UNIT = 16
_BOUND = 60
_PLURAL = 3

_FENCE = re.compile(r"[\s>]*(?:(?:[-*+]|\d+[.)])\s+)?(`{3,}|~{3,})([^`(\"]*)\Z")
_PREFIX = re.compile(rf"[\s>|]*(?:(?:[-*+•·–—]|\#{{1,6}})\s+|{MARK}(?<=\s))*[*`]*")
_COMMENT = re.compile(r"(?:\A|(?<=[\s);`.,]))(?:#(?!\d)|//)")
_JSON = re.compile(
    r"[^\[{\"'(]*+(?:(?<=\w)'(?=\w)[^\[{\"'(]*+)*([\[{])\s*(?:[\[{\"'\]}]|\w+\s*:|\Z)"
)


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
        self._after_call = False
        self._asides: list[tuple[int, Item]] = []
        self._functions: set[str] = set()
        self._starts = 0
        self._known = Known(text)

    def read(self) -> None:
        try:
            self._read_lines()
            for start, line in self._known.unused.values():
                self._fault(start, line, "nothing makes use of it")
        except _ExhaustedError:
            message = "The text is not read on from here: it holds far too much for a plan."
            self._add(Item(self._at, "", code="P102", message=message))

    def _read_lines(self) -> None:
        pos = 0
        while pos < len(self._text):
            end = self._line_end(pos)
            if end == pos or self._text[pos:end].isspace():
                self._blocks.blank()
                self._end_run()
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
            self._end_run()
            return end + 1
        after = self._read_json(start, end) or self._read_markup(start, end)
        if after:
            self._end_run()
            return self._scan(after, self._line_end(after), "") + 1
        if is_comment(self._text[start : min(end, start + LONG)], self._fenced):
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

    def _read_markup(self, start: int, end: int) -> int:
        """Read the tool call, in tags or as in ReAct, that opens here; returns its end, or 0."""
        found = read_markup(self._text, start, end) or read_react(self._text, start, end)
        if found is None:
            return 0
        item, after = found
        self._effort.spend(2 + (after - start) // _JSON_UNIT)
        self._add(item)
        return after

    def _read_string(self, string: str) -> list[Item]:
        return _read(string, self._effort).items

    def _read_statement(self, start: int, end: int) -> int:
        """Read the calls of a line and the condition they are under; returns a line's end."""
        prefix = _PREFIX.match(self._text, start, end)
        content = prefix.end() if prefix else start
        indent = indent_of(self._text, start)
        condition = self._blocks.condition(indent) or self._fence_condition
        frame = read_frame(self._text, content, end)
        if frame is not None:
            self._functions.add(frame[0])
            return self._scan(frame[1], end, condition)
        if not condition:
            known = self._read_known(start, content, end)
            if known:
                return known
        header = read_header(self._text, content, end, self._fenced)
        if header is None:
            return self._read_calls(start, content, end, condition)
        if header.opens:
            self._blocks.open(indent, header.condition)
            return end
        after = self._scan(header.body, header.until, header.condition)
        return self._scan(after, end, condition) if after < end else after

    def _read_known(self, start: int, content: int, end: int) -> int:
        """Read a constant, or a loop over constants; returns a line's end, 0 if there is none."""
        if binds(self._text, content, end):
            self._effort.spend(_BOUND)
            bound = self._known.bind(content, end, self._fenced)
            if bound:
                return self._line_end(bound)
        items, after = self._known.loop(start, content, end)
        self._effort.spend((after - start) // _JSON_UNIT + len(items))
        for item in items:
            self._add(item)
        return after if items else 0

    def _read_calls(self, start: int, content: int, end: int, condition: str) -> int:
        before, starts = len(self.found.items), self._starts
        after = self._scan(content, end, condition)
        if len(self.found.items) > before or self._starts > starts:
            indent = indent_of(self._text, start)
            # What stands out further than the call below it is its heading.
            self.found.items[before:before] = [a for deep, a in self._asides if deep >= indent]
            self._after_call, self._asides = True, []
            return after
        self._separate(start, end)
        line = self._text[content:end].rstrip()
        if self._fenced and is_unknown(line):
            self._fault(content, line, "it is not a call")
        elif not self._fenced and is_attempt(line):
            self._fault(content, line, "a call has its arguments in parentheses")
        elif self._after_call and not is_silent(line[:LONG]):
            self._note_aside(start, content, line[:LONG])
        return after

    def _note_aside(self, start: int, content: int, line: str) -> None:
        """Note a line of prose right behind a call: it counts if a call comes right after it."""
        if not is_heading(self._text[start:content] + line):
            aside = Item(content, line, code=LEFT_OUT)
            self._asides.append((indent_of(self._text, start), aside))

    def _end_run(self) -> None:
        """Note that what comes next does not stand right behind a call."""
        self._after_call, self._asides = False, []

    def _scan(self, pos: int, end: int, condition: str) -> int:
        """Read the calls from `pos` to `end`, or to the end of the line where the last one ends."""
        anchor = floor = pos
        against = ""
        calls, passed = self._calls, list[Item]()
        while True:
            paren = self._text.find("(", pos, end)
            if paren < 0 or _COMMENT.search(self._text, pos, paren):
                if self._calls > calls:
                    self.found.items += passed
                return end
            self._at = anchor
            self._effort.spend(1)
            named = call_name(self._text, anchor, floor, paren)
            reading = read_args(self._text, paren + 1) if named else None
            floor = paren + 1
            if named is None or reading is None:
                pos = paren + 1
            elif not is_call(self._text, anchor, *named, reading, self._fenced):
                pos = min(reading.end, end)
                if any(len(arg) > _PLURAL for arg in reading.args):
                    source = self._text[named[0] : reading.end]
                    passed.append(Item(named[0], source, code=LEFT_OUT))
            else:
                against = negation(self._text, anchor, named[0], against)
                other = "" if against else alternative(self._text, anchor, named[0])
                condition = other or condition
                condition = trailing_condition(self._text, reading) or condition
                pos = self._take(*named, reading, condition, against)
                end = end if pos <= end else self._line_end(pos)
                anchor = pos

    def _take(self, start: int, name: str, reading: Reading, condition: str, against: str) -> int:
        """Note a call or what is wrong with it; returns the offset behind it."""
        if reading.error and (name != "print" or reading.error == NESTED):
            return self._take_broken(start, reading)
        source = self._text[start : reading.end]
        if name in self._functions and not (reading.args or condition or against):
            self._starts += 1  # what it does has been read where it is defined
            return reading.end
        if name == "print" or self._known.makes_receiver(start, reading):
            after = swallow(self._text, reading.end) if reading.error else reading.end
            self._add(Item(start, self._text[start:after], code=LEFT_OUT))
            return after
        if against:
            self._add(negated(start, source, against))
        elif condition:
            self._add(conditional(start, source, condition))
        else:
            self._add(Item(start, source, keyworded(name, self._known.meant(reading, source))))
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
            strength = heading_strength(self._text[start : min(end, start + LONG)])
            gaps = self.found.gaps
            gaps[self._calls] = max(strength, gaps.get(self._calls, SEPARATED))

    def _line_end(self, pos: int) -> int:
        end = self._text.find("\n", pos)
        return len(self._text) if end < 0 else end
