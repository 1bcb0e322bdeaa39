"""Reading a text line by line: which form each line has, and the blocks that lines form."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from adaptbot_cli.core.parse import calls
from adaptbot_cli.core.parse.calls import GAP, LEFT_OUT, PROSE, Item, Line, line_end
from adaptbot_cli.core.parse.code import Block, read_head, read_statement, steps_of
from adaptbot_cli.core.parse.phrases import Vocabulary
from adaptbot_cli.core.parse.repeats import heading_strength
from adaptbot_cli.core.parse.structured import Structures
from adaptbot_cli.core.plan import keyworded

# A plan takes a few hundred units: one for a line, one for a parenthesis, some for a fault.
_EFFORT = 20_000
_FAULT = 9
_BINDING = 60
_PLURAL = 3
_LONG = 300
_LONGEST = 5_000
_LOOK = 300

_FENCE = re.compile(r"[\s>]*(?:(?:[-*+]|\d+[.)])\s+)?(`{3,}|~{3,})([^`(\"]*)\Z")
_PREFIX = re.compile(rf"[\s>|]*(?:(?:[-*+•·–—]|\#{{1,6}})\s+|{calls.MARK}(?<=\s))*[*`]*")
_MARKED = calls.worded(
    rf"[\s>|]*(?:[-*+•·–—◦▪→✓✔✅☐]\s+)*(?:{calls.MARK}|\**(?:(?:step|action)\s*#?\d*|task\s*#?\d+)\s*[.:)\-–]|[-*+•·–—◦▪→✓✔✅☐]\s)"
)
_COMMENT = re.compile(r"(?:\A|(?<=[\s);`.,]))(?:#(?!\d)|//)")
_SILENT = re.compile(
    r"(?:[\s\[\](){};,.`*_=\-|>~:]*|\w+\s*=\s*[\[({]|pass|return(?:\s+\w+)?|end\s*\w*"
    r"|<[/?]?\w[^<>]*>|assert\s+\w+|self\.\w+\s*=\s*\w+|(?:[-*]\s+)?(?:step|id|index|number|order):\s*\d*"
    r"|(?:from\s+[\w.]+\s+)?import\s+[\w.*, ]+)(?:\s+#.*)?"
)
_SENTENCE = re.compile(
    r"(?:[A-Z\d]|[-*•]\s)[^=(\"]*\s[^=(\"]*[.:!?]|[A-Z\d\s&.,:-]+|\w[\w ]*:|\*\*.*\*\*:?"
)
_HEADING = re.compile(r"[\s>]*#|.*:[\s*_]*\Z|[\W\d]*(?:\*\*|__).*(?:\*\*|__)\s*\Z")
_ATTEMPT = re.compile(r"[a-z]+_\w+(?:\[|\s+[\"“'‘])")
_AND_SO_ON = calls.worded(
    r"\b(?:repeat|same)\b.*\b(?:for|with)\b|\b(?:and so on|etc)\b|^\W*(?:\.\.\.|…)\W*$"
)
_GOES_ON = calls.worded(r"[\s,;.`*]*(?=(?:and|then|next|finally)\b)|[\s`*]*[.;] (?=[a-z])")
_RECEIVER = re.compile(r"(\w+)[^\S\n]*=[^\S\n]*\Z")
_TIME = re.compile(
    r"\s*\)?\s*,\s*(\d{1,6})\s*\)\.?|\s*(?:,[^()\n]{0,40})?\)(?=\s*[.,;]|\s*\Z|\s+\w+\()|(?=\])\]?\)\.?"
)


class _ExhaustedError(Exception):
    """The effort is used up; never leaves this module."""


def read_text(text: str, words: Vocabulary) -> list[Item]:
    """Read what stands in a text whose lines end in a line feed, in the order it is done."""
    left = _EFFORT

    def spend(units: int) -> None:
        nonlocal left
        left -= units
        if left < 0:
            raise _ExhaustedError

    def read(text: str) -> list[Item]:
        strings = Structures(
            text, lambda part: [i for i in read(part) if i.code != GAP], words, spend
        )
        reader = _Reader(text, words, spend, strings)
        try:
            reader.read()
        except _ExhaustedError:
            message = "The text is not read on from here: it holds far too much for a plan."
            reader.root.body.append(Item(reader.at, "", code="P102", message=message))
        return steps_of(reader.root)

    return read(text)


@dataclass
class _Reader:
    """Reads the lines of a text into the blocks below `root`; `at` is how far it has come."""

    _text: str
    _words: Vocabulary
    _spend: Callable[[int], None]
    _structures: Structures
    root: Block = field(default_factory=lambda: Block(-1))
    at: int = 0
    _line: Line = field(default_factory=Line)
    _run: int = 0
    _fresh: bool = False
    _blank: bool = False
    _resumes: bool = False

    def __post_init__(self) -> None:
        self._open = [self.root]

    def read(self) -> None:
        """Read every line; each is at most read once by each form."""
        pos = 0
        while pos < len(self._text):
            end = line_end(self._text, pos)
            if end == pos or self._text[pos:end].isspace():
                self._blank = True
                self._run += 1
            else:
                self.at = pos
                self._spend(1)
                end = self._read_line(pos, end)
            pos = end + 1

    def _read_line(self, start: int, end: int) -> int:
        """Read a line by the first form that fits; returns the end of the last line it took."""
        text = self._text
        if self._read_fence(start, end):
            return end
        columns = text[start : start + _LOOK].expandtabs(4)
        indent = len(columns) - len(columns.lstrip())
        mark = _MARKED.match(text, start, end)
        number = re.findall(r"\d+", mark[0]) if mark else []
        before = self._line.number
        apart = mark is None and indent <= self._line.indent
        self._line = replace(self._line, marked=mark is not None, indent=indent, run=self._run,
                             group=self._line.group + apart,
                             number=int(number[-1][:4]) if number else -1)  # fmt: skip
        # "3." behind a dash goes on with the list that the head stands in.
        self._resumes = self._line.number > 1 and self._line.number != before + 1
        prefix = _PREFIX.match(text, start, end)
        content = prefix.end() if prefix else start
        after = self._read_values(start, content, end)
        if after:
            return self._scan(after, line_end(text, after))
        line = text[start : min(end, start + _LONG)].lstrip()
        if line.startswith(("#", "//", '"""', "%", ";")):
            fenced = self._line.fenced or line.startswith((";", "%"))
            if fenced or not (line.startswith("##") or "`" in line):
                self._separate(start, end)
                if _AND_SO_ON.search(line):
                    rest = Item(start, line.lstrip("#/%; "), code=PROSE, line=Line(run=self._run))
                    self._open[-1].body.append(rest)
                return end
        return self._read_statement(start, content, end)

    def _read_fence(self, start: int, end: int) -> bool:
        """Note a line that opens or closes a code block."""
        fence = _FENCE.match(self._text, start, end)
        if fence is None:
            return False
        waiting = self._open[-1] if len(self._open) > 1 and self._fresh else None
        # A tag in an open block opens the next one: the closing fence was forgotten.
        fenced = not self._line.fenced or bool(fence[2].strip())
        self._line = replace(self._line, fenced=fenced)
        self._open = [self.root]
        if waiting is not None and fenced and waiting.kind != "function":
            waiting.indent = -1
            self._open.append(waiting)
        self._fresh = False
        self._run += 1
        self._separate(start, end)
        return True

    def _read_values(self, start: int, content: int, end: int) -> int:
        """Read the structures that a line begins with; returns where they end, 0 if none does."""
        after = 0
        while start < end:
            found = self._structures.read(start, content, end, self._line)
            if found is None:
                break
            items, after = found
            self._spend(2 + (after - self.at) // 16)
            self._enter(self._line.indent)
            for item in items:
                self._add(item)
            start = content = after
            end = line_end(self._text, after)
        return after

    def _read_statement(self, start: int, content: int, end: int) -> int:
        """Read the head, the constant or the calls of a line; returns a line's end."""
        text, fenced = self._text, self._line.fenced
        ends = self._blank or self._resumes or text[start:end].rstrip(" *_").endswith(":")
        if self._open[-1].brief and self._open[-1].body and ends:
            self._open.pop()
        lone = self._enter(self._line.indent)
        self._blank = False
        head = None if lone else read_head(text, content, end, self._line.indent, fenced)
        begun = head and head[0].often and self._words.begins(head[0].head)
        if head is not None and not begun:
            block, body, until, opens = head
            block.line = self._line
            self._open[-1].body.append(block)
            self._open.append(block)
            if opens:
                block.listed = not (fenced or self._line.marked)
                rest = text[body:end].strip(" {*_`\t")
                self._fresh, self._blank = not rest, False
                return self._scan(body, end) if rest else end
            after = self._read_calls(start, body, until)
            self._open.pop()
            return self._scan(after, end) if after < end else after
        statement, after = read_statement(text, content, end, fenced)
        self._spend(_BINDING * bool(after))
        if statement is not None:
            self._open[-1].body.append(statement)
            return line_end(text, max(after, end))
        return self._read_calls(start, content, end)

    def _enter(self, indent: int) -> bool:
        """Leave the blocks that end before a line; tells whether one has the line alone."""
        last = self._open[-1]
        inside = self._line.marked and not self._resumes
        listed = inside and any(b.listed and b.indent == indent for b in self._open)
        floor = indent + 1 if listed else indent
        fresh, self._fresh = self._fresh, False
        ruling = last.kind != "frame" and not last.often
        if fresh and not self._blank and floor <= last.indent and ruling:
            # Models forget to indent. Running the body anyway would be the worse mistake.
            return True
        while floor <= self._open[-1].indent:
            self._open.pop()
        return False

    def _read_calls(self, start: int, content: int, end: int) -> int:
        """Read the calls of a line, or the line as prose; returns a line's end."""
        body, before = self._open[-1].body, len(self._open[-1].body)
        after = self._scan(content, end)
        if len(body) > before:
            return after
        line = self._text[content:end].rstrip()
        fenced, begins = self._line.fenced, self._words.begins(line[:_LONGEST])
        silent = len(line) <= _LONG and _SILENT.fullmatch(line)
        self._separate(start, end)
        if fenced and not (begins or silent or (len(line) <= _LONG and _SENTENCE.fullmatch(line))):
            self._fault(content, line, "it is not a call")
        elif not fenced and _ATTEMPT.match(line) and not begins:
            self._fault(content, line, "a call has its arguments in parentheses")
        elif not _SILENT.fullmatch(line[:_LONG]) or line.strip() in ("...", "…"):
            heads = bool(_HEADING.match(self._text[start:content] + line[:_LONG]))
            here, block = self._line, self._open[-1].start
            self._line = replace(here, heads=heads, block=block)
            self._add(Item(content, line[:_LONGEST], code=PROSE))
            self._line = here
        return after

    def _scan(self, pos: int, end: int) -> int:
        """Read the calls from `pos` to `end`, or to the end of the line where the last one ends."""
        text, body = self._text, self._open[-1].body
        anchor = floor = pos
        condition = against = ""
        before, passed = len(body), list[Item]()
        while True:
            paren = text.find("(", pos, end)
            if paren < 0 or _COMMENT.search(text, pos, paren):
                break
            self.at = anchor
            self._spend(1)
            wrapped = calls.WRAPPED.match(text, anchor, end) if anchor < paren else None
            if wrapped and wrapped.end() > paren and self._unwraps(*wrapped.groups()):
                anchor = floor = wrapped.start(3)
                paren = text.find("(", anchor)
            named = calls.call_name(text, anchor, floor, paren)
            floor = pos = paren + 1
            if named is None:
                continue
            start, name = named
            reading = calls.read_args(text, pos)
            if not calls.is_call(
                text, anchor, start, name, reading, self._line.fenced, self._words.knows
            ):
                pos = min(reading.end, end)
                if any(len(arg) > _PLURAL for arg in reading.args):
                    passed.append(Item(start, text[start : reading.end], code=LEFT_OUT))
                continue
            against = calls.negation(text, anchor, start, against)
            other = "" if against else calls.alternative(text, anchor, start)
            often, ruled = calls.ruled(text, reading)
            condition = ruled or other or condition
            taken = len(body)
            anchor = pos = self._take(start, name, reading, condition, against)
            body += body[taken:] * (often - 1)
            end = end if pos <= end else line_end(text, pos)
        if len(body) == before:
            return end
        body += passed
        goes_on = None if self._line.fenced else _GOES_ON.match(text, anchor, end)
        if goes_on is not None:  # "and put it on the plate"
            comment = _COMMENT.search(text, goes_on.end(), end)
            rest = text[goes_on.end() : comment.start() if comment else end].strip()
            if self._words.begins(rest) or self._words.ordered(rest):
                self._add(Item(goes_on.end(), rest, code=PROSE))
        return end

    def _unwraps(self, outer: str, who: str, inner: str) -> bool:
        """Tell whether a call only says that the one inside it is done: `do(move(fridge))`."""
        known, wraps = self._words.knows, outer.lower() in calls.WRAPPERS and outer != inner
        return not known(outer) and (wraps or (known(inner) and not who))

    def _take(
        self, start: int, name: str, reading: calls.Arguments, condition: str, against: str
    ) -> int:
        """Note a call or what is wrong with it; returns the offset behind it."""
        text, end = self._text, reading.end
        if reading.error and (name != "print" or reading.error == calls.NESTED):
            unclosed = reading.error == calls.UNCLOSED_QUOTE
            end = (line_end if unclosed else calls.swallow)(text, end)
            self._fault(start, text[start:end].rstrip(), reading.error)
            return end
        item = Item(start, text[start:end])
        made = _RECEIVER.search(text[max(0, start - _LOOK) : start])  # robot = Robot()
        made_on = made is not None and not reading.found and f"{made[1]}." in text
        logs = item.source.startswith(("console.", "logging.", "logger."))
        if name == "print" or logs or made_on:
            end = calls.swallow(text, end) if reading.error else end
            self._add(Item(start, text[start:end], code=LEFT_OUT))
            return end
        time = _TIME.match(text, end)
        if against:
            why = f"{calls.shown(item.source)} is behind {calls.shown(against)}"
            self._add(item.told("P106", f"{why}: it is not to be run, so it is no step."))
        elif condition:
            self._add(item.conditional(condition))
        else:
            found = reading.found
            at = int(time[1]) if time and time[1] else -1
            if len(found) > 1 and self._words.knows(found[0][1]) and self._unwraps(name, "", ""):
                timed = name.lower().startswith(("o", "h")) and found[-1][1].isdigit()
                at = int(found[-1][1][:6]) if timed else at
                name, found = found[0][1], found[1 : len(found) - timed]  # occurs(move, fridge, 1)
            call = keyworded(name, [arg[:2] for arg in found])
            self._add(replace(item, call=call, written=tuple(how for _, _, how in found), time=at))
        return time.end() if time else end

    def _fault(self, start: int, source: str, why: str) -> None:
        self._spend(_FAULT)
        self._add(Item(start, source).fault(why))

    def _add(self, item: Item) -> None:
        self._open[-1].body.append(replace(item, line=self._line))

    def _separate(self, start: int, end: int) -> None:
        """Note that text stands before the next call, and whether it announces a recap."""
        strength = heading_strength(self._text[start : min(end, start + _LONG)])
        self._open[-1].body.append(Item(start, "", code=GAP, time=strength))
