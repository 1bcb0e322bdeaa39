"""Reading a text line by line: which form each line has, and the blocks that lines form."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from adaptbot_cli.core.parse.calls import (
    LEFT_OUT,
    MARK,
    NESTED,
    UNCLOSED_QUOTE,
    WRAPPED,
    WRAPPERS,
    ArgumentList,
    Item,
    alternative,
    call_name,
    conditional,
    fault,
    how_often,
    is_call,
    line_end,
    negated,
    negation,
    read_args,
    swallow,
    trailing_condition,
)
from adaptbot_cli.core.parse.code import (
    GAP,
    PROSE,
    Block,
    Steps,
    binds,
    read_header,
    read_statement,
)
from adaptbot_cli.core.parse.phrases import Vocabulary
from adaptbot_cli.core.parse.repeats import heading_strength
from adaptbot_cli.core.parse.structured import Structures, read_literal
from adaptbot_cli.core.plan import keyworded

# A plan takes a few hundred units: one for a line, one for a parenthesis, some for a fault.
_EFFORT = 20_000
_FAULT = 9
_JSON_UNIT = 16
_BOUND = 60
_PLURAL = 3
_LONG = 300
_LONGEST = 5_000
_LOOK = 300

_FENCE = re.compile(r"[\s>]*(?:(?:[-*+]|\d+[.)])\s+)?(`{3,}|~{3,})([^`(\"]*)\Z")
_PREFIX = re.compile(rf"[\s>|]*(?:(?:[-*+•·–—]|\#{{1,6}})\s+|{MARK}(?<=\s))*[*`]*")
_MARKED = re.compile(
    rf"[\s>|]*(?:[-*+•·–—◦▪→✓✔✅☐]\s+)*(?:{MARK}|\**(?:(?:step|action)\s*#?\d*|task\s*#?\d+)\s*[.:)\-–]|[-*+•·–—◦▪→✓✔✅☐]\s)",
    re.IGNORECASE,
)
_COMMENT = re.compile(r"(?:\A|(?<=[\s);`.,]))(?:#(?!\d)|//)")
_JSON = re.compile(
    r"[^\[{\"'(]*+(?:(?<=\w)'(?=\w)[^\[{\"'(]*+)*(?:\[[A-Z_]+\]\s*(?=[\[{]))?([\[{]|(?<!\w)\()\s*(?:[\[{\"'\]}(]|\w+\s*:|\Z)"
)
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
_AND_SO_ON = re.compile(
    r"(?:\b(?:repeat|same)\b.*\b(?:for|with)\b|\b(?:and so on|etc)\b)|^\W*(?:\.\.\.|…)\W*$",
    re.IGNORECASE,
)
_GOES_ON = re.compile(
    r"[\s,;.`*]*(?=(?:and|then|next|finally)\b)|[\s`*]*[.;]\s+(?=[A-Za-z])", re.IGNORECASE
)
_RECEIVER = re.compile(r"(\w+)[^\S\n]*=[^\S\n]*\Z")


@dataclass(frozen=True, slots=True)
class Prose(Item):
    """A line without a call, which may be a step in words.

    `marked` tells that it is an item of a list, `heads` that it announces what comes below;
    `group` numbers the lists, `run` the lines that no blank line parts; `block` is where the head
    stands that it is under, `number` the item's own, -1 if it has none.
    """

    marked: bool = False
    heads: bool = False
    fenced: bool = False
    indent: int = 0
    group: int = 0
    run: int = 0
    block: int = 0
    number: int = -1


@dataclass(slots=True)
class ReadText:
    """What stands in a text, in the order in which it is done; `where` has the line of an item."""

    items: list[Item] = field(default_factory=list)
    where: dict[int, Prose] = field(default_factory=dict)


def read_text(text: str, words: Vocabulary) -> ReadText:
    """Read what stands in a text whose lines end in a line feed."""
    return _read(text, words, _Effort())


def _read(text: str, words: Vocabulary, effort: "_Effort") -> ReadText:
    reader = _Reader(text, words, effort)
    try:
        reader.read()
    except _ExhaustedError:
        message = "The text is not read on from here: it holds far too much for a plan."
        reader.root.body.append(Item(reader.at, "", code="P102", message=message))
    return ReadText(Steps(reader.root).out, reader.where)


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
    def __init__(self, text: str, words: Vocabulary, effort: _Effort) -> None:
        self.root = Block(-1)
        self.where: dict[int, Prose] = {}
        self.at = 0
        self._text = text
        self._words = words
        self._effort = effort
        self._structures = Structures(text, self._read_string, words)
        self._fenced = False
        self._no_json_before = 0
        self._open = [self.root]
        self._fresh = self._blank = False
        self._line = Prose(0, "")
        self._run = 0

    def read(self) -> None:
        """Read every line; each is at most read once by each form."""
        pos = 0
        while pos < len(self._text):
            end = line_end(self._text, pos)
            if end == pos or self._text[pos:end].isspace():
                self._blank = True
                self._run += 1
                pos = end + 1
                continue
            self.at = pos
            self._effort.spend(1)
            pos = self._read_line(pos, end)

    def _read_line(self, start: int, end: int) -> int:
        """Read the line, and those that its last call or its value runs on over.

        Returns where to go on: the start of a line.
        """
        if self._read_fence(start, end):
            return end + 1
        indent = _indent_of(self._text, start)
        self._place(start, end, indent)
        after = self._read_value(start, end)
        if after:
            while after < line_end(self._text, after) and (
                more := self._read_value(after, line_end(self._text, after))
            ):
                after = more
            return self._scan(after, line_end(self._text, after), "") + 1
        line = self._text[start : min(end, start + _LONG)].lstrip()
        if line.startswith(("#", "//", '"""', "%", ";")):
            fenced = self._fenced or line.startswith((";", "%"))
            if fenced or not (line.startswith("##") or "`" in line):
                self._separate(start, end)
                if _AND_SO_ON.search(line):
                    self._add(Prose(start, line.lstrip("#/%; "), code=PROSE, run=self._run))
                return end + 1
        return self._read_statement(start, end, indent) + 1

    def _place(self, start: int, end: int, indent: int) -> None:
        """Note what kind of line this is: an item of which list, in which run of lines."""
        before = self._line
        mark = _MARKED.match(self._text, start, end)
        marked, number = mark is not None, re.findall(r"\d+", mark[0]) if mark else []
        apart = not marked and indent <= before.indent
        self._line = Prose(start, "", marked=marked, indent=indent, group=before.group + apart,
                           run=self._run, fenced=self._fenced,
                           number=int(number[-1][:4]) if number else -1)  # fmt: skip

    def _read_fence(self, start: int, end: int) -> bool:
        """Note a line that opens or closes a code block."""
        if self._text.find("```", start, end) < 0 and self._text.find("~~~", start, end) < 0:
            return False
        fence = _FENCE.match(self._text, start, end)
        if fence is None:
            return False
        waiting = self._open[-1] if len(self._open) > 1 and self._fresh else None
        # A tag in an open block opens the next one: the closing fence was forgotten.
        self._fenced = not self._fenced or bool(fence[2].strip())
        self._open = [self.root]
        if waiting is not None and self._fenced and waiting.kind != "function":
            waiting.indent = -1
            self._open.append(waiting)
        self._fresh = False
        self._run += 1
        self._separate(start, end)
        return True

    def _read_value(self, start: int, end: int) -> int:
        """Read the structure that begins in the line; returns where it ends, 0 if none does."""
        match = _JSON.match(self._text, start, end) if start >= self._no_json_before else None
        if match is not None and not self._text[start : match.start(1)].rstrip().endswith("plan("):
            items, after = self._structures.json(match.start(1))
            self._effort.spend(2 + (after - match.start(1)) // _JSON_UNIT)
            if items:
                self._structures.listed |= self._line.marked
                return self._take_all(items, after)
            self._no_json_before = after
        found = self._structures.tag(start, end)
        if found is not None:
            return self._take_all([found[0]], found[1])
        fields = self._structures.fields(start, end, self._fenced) or (
            self._structures.table(start, end) if "|" in self._text[start:end] else None
        )
        if fields is not None:
            return self._take_all(*fields)
        prefix = _PREFIX.match(self._text, start, end)
        script = self._structures.script(
            start, prefix.end() if prefix else start, end, self._fenced
        )
        return self._take_all(script, end) if script else 0

    def _take_all(self, items: Iterable[Item], after: int) -> int:
        self._effort.spend(2 + (after - self.at) // _JSON_UNIT)
        lone = self._enter(self._line.indent)
        for item in items:
            self._add(item)
        if lone is not None:
            self._open.remove(lone)
        return after

    def _read_string(self, string: str) -> list[Item]:
        return [item for item in _read(string, self._words, self._effort).items if item.code != GAP]

    def _read_statement(self, start: int, end: int, indent: int) -> int:
        """Read the head, the constant or the calls of a line; returns a line's end."""
        prefix = _PREFIX.match(self._text, start, end)
        content = prefix.end() if prefix else start
        lone = self._enter(indent)
        header = read_header(self._text, content, end, indent, self._fenced)
        begun = header and header[0].often and self._words.begins(header[0].head)
        if header is not None and lone is None and not begun:
            block, body, until, opens = header
            self._open[-1].body.append(block)
            self._open.append(block)
            if opens:
                block.listed = not (self._fenced or self._line.marked)
                rest = self._text[body:end].strip(" {*_`\t")
                self._fresh, self._blank = not rest, False
                return self._scan(body, end, "") if rest else end
            after = self._read_calls(start, body, until)
            self._open.pop()
            return self._scan(after, end, "") if after < end else after
        value = binds(self._text, content, end)
        if value:
            self._effort.spend(_BOUND)
        after = (
            read_literal(self._text, value)[0].end
            if self._text[value : value + 1] in "[({" and value
            else end
        )
        statement = read_statement(self._text, content, end, max(after, value), self._fenced)
        if statement is not None:
            self._open[-1].body.append(statement)
            after = line_end(self._text, max(after, end))
        else:
            after = self._read_calls(start, content, end)
        if lone is not None:
            self._open.remove(lone)
        return after

    def _enter(self, indent: int) -> Block | None:
        """Leave the blocks that end before a line; returns one that the line alone belongs to."""
        last = self._open[-1]
        listed = self._line.marked and any(b.listed and b.indent == indent for b in self._open)
        floor = indent + 1 if listed else indent
        ruling = last.kind != "frame" and not last.often
        if self._fresh and not self._blank and floor <= last.indent and ruling:
            # Models forget to indent. Running the body anyway would be the worse mistake.
            self._fresh = False
            return last
        while floor <= self._open[-1].indent:
            self._open.pop()
        self._fresh = False
        return None

    def _read_calls(self, start: int, content: int, end: int) -> int:
        body = self._open[-1].body
        before = len(body)
        after = self._scan(content, end, "")
        if len(body) > before:
            return after
        line = self._text[content:end].rstrip()
        self._separate(start, end)
        if (
            self._fenced
            and not self._words.begins(line)
            and (len(line) > _LONG or not (_SILENT.fullmatch(line) or _SENTENCE.fullmatch(line)))
        ):
            self._fault(content, line, "it is not a call")
        elif not self._fenced and _ATTEMPT.match(line) and not self._words.begins(line):
            self._fault(content, line, "a call has its arguments in parentheses")
        elif not _SILENT.fullmatch(line[:_LONG]) or line.strip() in ("...", "…"):
            here = self._line
            heads = bool(_HEADING.match(self._text[start:content] + line[:_LONG]))
            self._add(replace(here, start=content, source=line[:_LONGEST], code=PROSE, heads=heads,
                              block=self._open[-1].start))  # fmt: skip
        return after

    def _scan(self, pos: int, end: int, condition: str) -> int:
        """Read the calls from `pos` to `end`, or to the end of the line where the last one ends."""
        anchor = floor = pos
        against = ""
        body = self._open[-1].body
        calls, passed = len(body), list[Item]()
        while True:
            paren = self._text.find("(", pos, end)
            if paren < 0 or _COMMENT.search(self._text, pos, paren):
                if len(body) > calls:
                    body += passed
                    self._read_tail(anchor, end)
                return end
            self.at = anchor
            self._effort.spend(1)
            wrapped = WRAPPED.match(self._text, anchor, end) if anchor < paren else None
            if wrapped and wrapped.end() > paren and self._unwraps(*wrapped.groups()):
                anchor = floor = wrapped.start(3)
                paren = self._text.find("(", anchor)
            named = call_name(self._text, anchor, floor, paren)
            reading = read_args(self._text, paren + 1) if named else None
            floor = paren + 1
            if named is None or reading is None:
                pos = paren + 1
            elif not is_call(self._text, anchor, *named, reading, self._fenced, self._words.knows):
                pos = min(reading.end, end)
                if any(len(arg) > _PLURAL for arg in reading.args):
                    source = self._text[named[0] : reading.end]
                    passed.append(Item(named[0], source, code=LEFT_OUT))
            else:
                against = negation(self._text, anchor, named[0], against)
                other = "" if against else alternative(self._text, anchor, named[0])
                condition = other or condition
                often, uncounted = how_often(self._text, reading)
                condition = uncounted or trailing_condition(self._text, reading) or condition
                taken = len(body)
                pos = self._take(*named, reading, condition, against)
                body += body[taken:] * (often - 1)
                end = end if pos <= end else line_end(self._text, pos)
                anchor = pos

    def _read_tail(self, start: int, end: int) -> None:
        """Read what a line goes on with behind its last call: "and put it on the plate"."""
        goes_on = None if self._fenced else _GOES_ON.match(self._text, start, end)
        if goes_on is not None:
            comment = _COMMENT.search(self._text, goes_on.end(), end)
            rest = self._text[goes_on.end() : comment.start() if comment else end].strip()
            if self._words.begins(rest) or self._words.ordered(rest):
                self._add(replace(self._line, start=goes_on.end(), source=rest, code=PROSE))

    def _unwraps(self, outer: str, who: str, inner: str) -> bool:
        """Tell whether a call only says that the one inside it is done: `do(move(fridge))`."""
        known, wraps = self._words.knows, outer.lower() in WRAPPERS and outer != inner
        return not known(outer) and (wraps or (known(inner) and not who))

    def _take(
        self, start: int, name: str, reading: ArgumentList, condition: str, against: str
    ) -> int:
        """Note a call or what is wrong with it; returns the offset behind it."""
        if reading.error and (name != "print" or reading.error == NESTED):
            unclosed = reading.error == UNCLOSED_QUOTE
            end = (line_end if unclosed else swallow)(self._text, reading.end)
            self._fault(start, self._text[start:end].rstrip(), reading.error)
            return end
        source = self._text[start : reading.end]
        shown = name == "print" or source.startswith(("console.", "logging.", "logger."))
        if shown or self._makes_receiver(start, reading):
            after = swallow(self._text, reading.end) if reading.error else reading.end
            self._add(Item(start, self._text[start:after], code=LEFT_OUT))
            return after
        time = _TIME.match(self._text, reading.end)
        if against:
            self._add(negated(start, source, against))
        elif condition:
            self._add(conditional(start, source, condition))
        else:
            named, written = reading.named(), reading.written
            at = int(time[1]) if time and time[1] else -1
            if len(named) > 1 and self._words.knows(named[0][1]) and self._unwraps(name, "", ""):
                timed = name.lower().startswith(("o", "h")) and named[-1][1].isdigit()
                at = int(named[-1][1][:6]) if timed else at
                name, end = named[0][1], len(named) - timed  # occurs(move, fridge, 1)
                named, written = named[1:end], written[1:end]
            self._add(Item(start, source, keyworded(name, named), written=written, time=at))
        return time.end() if time else reading.end

    def _makes_receiver(self, start: int, reading: ArgumentList) -> bool:
        """Tell whether this is `robot = Robot()`, and `robot` is what calls are made on."""
        made = _RECEIVER.search(self._text[max(0, start - _LOOK) : start])
        return made is not None and not reading.args and f"{made[1]}." in self._text

    def _fault(self, start: int, source: str, why: str) -> None:
        self._effort.spend(_FAULT)
        self._add(fault(start, source, why))

    def _add(self, item: Item) -> None:
        self._open[-1].body.append(item)
        self.where[item.start] = self._line

    def _separate(self, start: int, end: int) -> None:
        """Note that text stands before the next call, and whether it announces a recap."""
        strength = heading_strength(self._text[start : min(end, start + _LONG)])
        self._open[-1].body.append(Item(start, "", code=GAP, time=strength))


_TIME = re.compile(
    r"\s*\)?\s*,\s*(\d{1,6})\s*\)\.?|\s*(?:,[^()\n]{0,40})?\)(?=\s*[.,;]|\s*\Z|\s+\w+\()|(?=\])\]?\)\.?"
)


def _indent_of(text: str, start: int) -> int:
    """Return how many columns the line at `start` is indented."""
    line = text[start : start + _LOOK].expandtabs(4)
    return len(line) - len(line.lstrip())
