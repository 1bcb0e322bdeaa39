"""The parser: normalise a text, cut off what is no answer, read each line, account for all."""

import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile

from adaptbot_cli.core.english import PRONOUNS, REPETITIONS, count_of
from adaptbot_cli.core.parse.calls import LEFT_OUT, SHOWN, Item, conditional, shown
from adaptbot_cli.core.parse.code import GAP, PROSE
from adaptbot_cli.core.parse.phrases import (
    ARROW,
    ASIDE,
    CLOSED,
    OPEN,
    OPTIONAL,
    Vocabulary,
    is_negated,
    label_end,
)
from adaptbot_cli.core.parse.reader import Prose, ReadText, read_text
from adaptbot_cli.core.parse.repeats import without_repeats
from adaptbot_cli.core.plan import Call, Finding, Parsed, Written, keyworded

_MOST_LINES = 5
_MOST_TIMES = 50
_LOOK_BACK = 3
"""How many steps a pronoun looks back."""

_UNSEEN = {0x200B: None, 0x2060: None, 0xFEFF: None}
"""Zero-width space, word joiner, byte order mark: they stand in copied text and say nothing."""
# Only behind a name in ASCII: 拿起苹果（从冰箱） is a sentence with a remark.
_QUOTED_NAME = re.compile(r"(?<![\w(])'([A-Za-z]\w*(?:[ ]\w+)+)'\(")  # as in Prolog
_WIDE_CALL = re.compile(r"(?<=[A-Za-z0-9_])[(（][^()（）\n]*[)）]")
_WIDE = str.maketrans("（），：＝＂＇「」『』", '(),:="\'""""')

_TAG = (
    r"(?:\w+:)?(?:think\w*|thought\w*|reason\w*|scratch_?pad|reflection|analysis|inner_monologue)"
)
_MARK = re.compile(
    rf"(?P<fence>^(?:[^\S\n]|>)*(?:(?:[-*+]|\d+[.)])[^\S\n]+)?(?:`{{3}}|~{{3}})[^`(\"\n]*$)"
    rf"|(?P<string>[(,\[:=][^\S\n]*\"[^\"\\\n]*+(?:\\.[^\"\\\n]*+)*\")"
    rf"|(?P<open><\|?(?:begin_of_)?{_TAG}\|?>|\[{_TAG}\]|◁{_TAG}▷"
    r"|<\|channel\|>(?!final)\w+(?:<\|message\|>)?)"
    rf"|(?P<close></{_TAG}>|<\|?(?:/|end_of_){_TAG}\|?>|\[/{_TAG}\]|◁/{_TAG}▷)|(?P<comment><!--|/\*)"
    r"|(?P<end><\|(?:im_end|eot_id|endoftext|end_of_text|end_of_turn|return|eom_id)\|>|</s>"
    r"|<(?:end_of_turn|eos)>|^(?:user|human|<\|im_start\|>user)[ ]?:?[ ]*$|^(?:User|Human):(?=\s))"
    r"|(?P<frame><\|(?:start|channel|message|end|python_tag|tool_calls?)\|>(?:assistant|final)?)"
    r"|(?<!~)~~(?![~\s])[^~\n]*+(?:~(?!~)[^~\n]*+)*~~(?!~)",
    re.IGNORECASE | re.MULTILINE,
)
_ENDS = {
    "open": re.compile(
        rf"</{_TAG}>|<\|?(?:/|end_of_){_TAG}\|?>|\[/{_TAG}\]|◁/{_TAG}▷|<\|(?:end|channel|start)\|>",
        re.IGNORECASE,
    ),
    "comment": re.compile(r"-->|\*/"),
    "fence": re.compile(r"^(?:[^\S\n]|>)*(?:`{3}|~{3})[^\S\n]*$", re.MULTILINE),
}
_LETTER = re.compile(r"[^\n]")
_INLINE = re.compile(r"(?:(?<=[\s,.;:])|\A)\(?(\d{1,3})[.)][ \t]+(?=\S)")
_BARE = re.compile(r"[^\W\d][\w-]*(?:[ ][^\s.,;:!?]+){1,7}\s*")
"""A row of a plan without marks: a few words, no sentence."""
_SENTENCE = re.compile(r"(?<=[.!])\s+(?=\(?[A-Z\"“`])|(?<=;)\s+|</\w+>\s*(?=<)")
_NO_STEPS = re.compile(
    r"\W*(?:(?:thoughts?|observations?|think|reflection|feedback|tasks?|goals?|question)\s*\d*\s*:.*"
    r"|(?:ingredients|tools?|utensils|equipment|materials|objects|items|notes?|tips?|assumptions?|"
    r"requirements?|you(?:\s+will|'ll)?\s+need|explanation|reason\w*|rationale|goals?|summary|result|"
    r"preconditions?|constraints?|safety|warnings?|expected|why|known|available|allowed)\b.{0,60})$",
    re.IGNORECASE,
)


def parse(text: str, words: Vocabulary | None = None) -> Parsed:
    """Read the steps in a text, in order, with a finding for whatever was not understood.

    Reads prose with Markdown, code, JSON and other structures; and phrases, with the words of a
    domain. Pure; raises on no text; runs nothing; takes time in proportion to the text's length.
    Every finding and every call has its line and column.
    """
    words = words or Vocabulary()
    text = whole = _plain(text)
    text, discarded, why = _without_discarded(whole)
    read = read_text(text, words)
    read.items = list(_settled(read, words))
    places = _Places(text)
    calls: list[Written] = []
    findings: list[Finding] = []
    left_out: dict[int, tuple[int, int, Item]] = {}
    gaps: dict[int, int] = {}
    for item in _in_time(read.items):
        line, column = places.of(item.start)
        if item.code == GAP:
            if calls:
                gaps[len(calls)] = max(item.time, gaps.get(len(calls), 1))
        elif item.code == LEFT_OUT and not item.message:
            left_out[item.start] = (line, column, item)
        elif item.call is None:
            blocks = item.code == LEFT_OUT and item.time > 0
            findings.append(
                Finding(item.code, item.message, line=line, column=column, blocking=blocks)
            )
        else:
            calls.append(Written(item.call, item.source, line, column))
    if not calls:
        findings.insert(0, Finding("P101", _no_plan(whole, read, findings), line=1, column=1))
    if left_out:
        findings.append(_left_out([*left_out.values()], "is no call and is left out"))
    if discarded:
        findings += _discarded(discarded, why, words)
    kept, repeated = without_repeats(calls, gaps)
    findings = sorted([*findings, *repeated], key=lambda f: (f.line or 0, f.column or 0))
    return Parsed(kept, tuple(findings))


def _plain(text: str) -> str:
    """Return a text with line feeds only, nothing unseen, and calls in ASCII's punctuation."""
    text = text.replace("\r\n", "\n").replace("\r", "\n").translate(_UNSEEN)
    text = _QUOTED_NAME.sub(lambda name: f"  {name[1].replace(' ', '_')}(", text)
    return _WIDE_CALL.sub(lambda call: call[0].translate(_WIDE), text)


def _without_discarded(text: str) -> tuple[str, str, str]:
    """Return a text without what it discards, what it discards without the rest, and why.

    Spaces take the place of either, so that offsets stay; the second is empty if nothing is
    discarded. What is opened and never closed goes on to the end; reasoning that is only closed
    began with the text.
    """
    spans: list[tuple[int, int]] = []
    at, reasoned, why = 0, False, "the text takes it back (reasoning, a comment or struck out)"
    while mark := _MARK.search(text, at):
        kind, at = mark.lastgroup, mark.end()
        if kind in _ENDS:
            closing = _ENDS[kind].search(text, at)
            at = closing.end() if closing else len(text)
        if kind == "end":
            if text[: mark.start()].strip():
                why = "it stands behind the end of the answer" if not spans else why
                spans.append((mark.start(), len(text)))
                break
            spans.append((mark.start(), at))
        elif kind == "close" and not reasoned:
            spans = [(0, at)]
        elif kind not in ("fence", "string", "close"):
            spans.append((mark.start(), at))
        reasoned = reasoned or kind in ("open", "close")
    quoted = [m.span() for m in re.finditer(r"^[^\S\n]*>[^\n]*", text, re.MULTILINE)]
    if quoted and re.search(r"^(?![^\S\n]*>)[^\n]*\w\(", text, re.MULTILINE):
        spans = sorted([*spans, *quoted])
        why = why if len(spans) > len(quoted) else "it is quoted"
    if not spans:
        return text, "", ""
    kept, discarded, at = [], [], 0
    for start, end in [*spans, (len(text), len(text))]:
        if end <= at < len(text):
            continue
        start = max(start, at)
        kept += [text[at:start], _LETTER.sub(" ", text[start:end])]
        discarded += [_LETTER.sub(" ", text[at:start]), text[start:end]]
        at = end
    return "".join(kept), "".join(discarded), why


def _discarded(text: str, why: str, words: Vocabulary) -> list[Finding]:
    """Tell of the calls in what the text takes back in one finding."""
    places = _Places(text)
    items = [i for i in read_text(text, words).items if i.code not in (LEFT_OUT, PROSE, GAP)]
    items.sort(key=lambda item: item.start)
    message = f"is left out: {why}"
    return [_left_out([(*places.of(item.start), item) for item in items], message)] if items else []


def _settled(read: ReadText, words: Vocabulary) -> Iterator[Item]:
    """Yield what was read with each line of prose as a step in words, a finding, or nothing."""
    items = [item for item in read.items if item.code != GAP]
    calls = [n for n, item in enumerate(items) if item.call is not None]
    settle = _Mixed(items, read.where, words, calls) if calls else _Phrased(items, words)
    n = -1
    for item in read.items:
        n += item.code != GAP
        if isinstance(item, Prose):
            yield from settle.line(n, item)
        elif item.code == PROSE:
            yield from settle.steps(item.start, item.source, marked=True)
        else:
            yield from settle.call(item)


class _Settling:
    """Settles lines of prose; a pronoun is what the step before was about."""

    def __init__(self, words: Vocabulary) -> None:
        self.words = words
        self.objects: list[Sequence[str]] = []

    def _remember(self, objects: Sequence[str]) -> None:
        self.objects = [objects, *self.objects][:_LOOK_BACK] if objects else self.objects

    def call(self, item: Item) -> Iterator[Item]:
        """Yield an item that was read, a call with what its pronouns stand for, as often as it is
        done."""
        if item.call is None:
            yield item
            return
        action = item.call.action
        if CLOSED.fullmatch(action) and not self.words.knows(action) and not item.call.args:
            yield Item(item.start, item.source, code=LEFT_OUT)
            return
        own, often = [], 1
        for name, arg in item.call.named():
            if name.lower() in REPETITIONS and not self.words.takes(action, name):
                often = count_of(arg)
            else:
                pronoun = self.objects and arg.lower() in PRONOUNS
                own.append((name, self.objects[0][0] if pronoun else arg))
        self._remember([arg for _, arg in own[:1] if not arg[:1].isdigit()])
        if not often:
            yield conditional(item.start, item.source, "how often it is done")
        yield from [replace(item, call=keyworded(action, own))] * min(often, _MOST_TIMES)

    def steps(
        self, start: int, source: str, marked: bool, condition: str = "", unknown: bool = True
    ) -> Iterator[Item]:
        """Yield the steps of a phrase; where it cannot be read, a finding that names it."""
        for number, (at, sentence) in enumerate(_sentences(source)):
            if OPEN.fullmatch(sentence):
                message = (
                    f"{shown(sentence)} stands for steps that are not written out: write each."
                )
                yield Item(start + at, sentence, code="P103", message=message)
                continue
            if is_negated(sentence):
                message = f"{shown(sentence)} is not to be done, so it is no step."
                yield Item(start + at, sentence, code="P106", message=message)
                continue
            optional = OPTIONAL.match(sentence)
            known = self.words.begins(sentence)
            fits = known or (marked and number == 0) or self.words.shaped(sentence)
            clauses = self.words.read(sentence, unknown, self.objects) if known or fits else []
            if not clauses or not (known or unknown):
                yield self._unread(start + at, sentence, known)
            for clause in clauses if known or unknown else ():
                where = start + at
                ruled = condition or clause.condition or (optional[1] if optional else "")
                if ruled:
                    yield conditional(where, sentence, ruled)
                    continue
                self._remember(clause.objects)
                for call in clause.calls:
                    yield Item(where, sentence, call)
                aside = ASIDE.search(sentence)
                left_out = ", ".join(filter(None, [clause.left_out, aside[1] if aside else ""]))
                if left_out:
                    message = f"`{left_out}` in {shown(sentence)} is left out: no action takes it."
                    yield Item(where, sentence, code=LEFT_OUT, message=message)

    def _said(self, source: str) -> list[Call]:
        clauses = self.words.read(source, False, self.objects)
        return [call for clause in clauses for call in clause.calls]

    def ordered(self, item: Prose) -> bool:
        """Tell whether a line that is left out has an order in it, which then is told of."""
        found = [] if item.heads or _NO_STEPS.match(item.source) else _sentences(item.source)
        return any(self.words.ordered(sentence) for _, sentence in found)

    def _unread(self, start: int, source: str, blocks: bool) -> Item:
        """Tell of a line that no form fits; it blocks if it begins as a step of this robot does."""
        if not blocks:
            return Item(start, source, code=LEFT_OUT)
        message = f"{shown(source)} looks like a step, but is none that can be read."
        return Item(start, source, code=LEFT_OUT, message=message, time=1)


def _sentences(source: str) -> list[tuple[int, str]]:
    """Return the sentences of a line, and the items of a list that stands in one line."""
    lead = label_end(source)
    marks = list(_INLINE.finditer(source, lead))
    numbers = [int(mark[1]) for mark in marks]
    if (
        numbers
        and numbers[0] in (1, 2)
        and numbers == list(range(numbers[0], len(marks) + numbers[0]))
    ):
        # What leads the first number is an announcement; the line's own mark has been read.
        bounds = [lead] * (numbers[0] == 2) + [m.end() for m in marks]
        ends = [*(m.start() for m in marks[numbers[0] == 1 :]), len(source)]
        parts = list(zip(bounds, ends, strict=True))
    else:
        starts = [lead, *(m.end() for m in _SENTENCE.finditer(source, lead))]
        parts = list(zip(starts, [*starts[1:], len(source)], strict=True))
    found = [(at, source[at:end].strip(" ,;")) for at, end in parts]
    return [
        (at, part)
        for at, part in found
        if OPEN.fullmatch(part) or (re.search(r"\w", part) and not CLOSED.fullmatch(part))
    ]


class _Phrased(_Settling):
    """Settles the lines of a text that holds no call: the list of steps, or sentences that are."""

    def __init__(self, items: Sequence[Item], words: Vocabulary) -> None:
        super().__init__(words)
        self._items = items
        lines = [(n, item) for n, item in enumerate(items) if isinstance(item, Prose)]
        rows = [i.source for _, i in lines if not i.marked and not CLOSED.fullmatch(i.source)]
        begun = sum(map(words.begins, rows))
        self._bare = 3 * begun >= len(rows) > 1 and all(map(_BARE.fullmatch, rows))
        self._aside: set[int] = set()
        aside = False
        for n, item in lines:
            inline = len(_sentences(item.source)) > 1 and _INLINE.search(item.source)
            if item.heads or (not item.marked and item.source.rstrip().endswith(":")):
                aside = bool(_NO_STEPS.match(item.source))
            elif not item.marked and _NO_STEPS.match(item.source) and not inline:
                self._aside.add(n)
            if aside:
                self._aside.add(n)
        self._lists: dict[int, list[str]] = {}
        for n, item in lines:
            if n not in self._aside and not self._heads(n, item) and self._listed(item):
                self._lists.setdefault(self._group(item), []).append(item.source)
        self._plans = {group for group, lines in self._lists.items() if self._is_plan(lines)}
        parts = [
            s
            for n, i in lines
            if n not in self._aside and not i.heads
            for _, s in _sentences(i.source)
        ]
        begun = sum(words.begins(sentence) for sentence in parts)
        shaped = sum(words.begins(s) or words.shaped(s) for s in parts)
        most = 2 * begun >= len(parts) or (begun and 2 * shaped >= len(parts))
        self._prose = not self._plans and bool(most or shaped == len(parts))

    def _listed(self, item: Prose) -> bool:
        """Tell whether a line is an item of a list: marked, in a code block, or of few words."""
        return item.marked or item.fenced or self._bare

    def _group(self, item: Prose) -> int:
        """Return the list that an item is of: rows without marks are one."""
        return item.group if item.marked or not self._bare else -1

    def _is_plan(self, lines: Sequence[str]) -> bool:
        """Tell whether the items of a list are steps: they begin with verbs."""
        parts = [sentence for line in lines for _, sentence in _sentences(line)]
        return any(map(self.words.begins, parts)) or (
            bool(self.words.names)
            and all(re.match(r"\w+\s+(?:the|a|an)\s+\w", line, re.IGNORECASE) for line in lines)
        )

    def _heads(self, n: int, item: Prose) -> bool:
        """Tell whether an item of a list has items of its own, or announces something."""
        below = self._items[n + 1] if n + 1 < len(self._items) else None
        deeper = (
            isinstance(below, Prose)
            and below.marked
            and below.indent > item.indent
            and below.block == item.block
            and not 0 <= item.number == below.number - 1  # it only goes on with the numbers
        )
        heading = (
            item.heads and isinstance(below, Prose) and below.marked and not below.heads
            and below.number != item.number + 1
        )  # fmt: skip
        return heading or bool(deeper and item.marked) or item.source.rstrip(" *_").endswith(":")

    def line(self, n: int, item: Prose) -> Iterator[Item]:
        inline = _INLINE.findall(item.source)
        steps = self._group(item) in self._plans and self._listed(item)
        if not self.words.names or n in self._aside:
            return
        if self._heads(n, item) and len(inline) < 2:
            # What it stands for is below; what is done besides is told of.
            if item.marked and self._done_besides(n, item):
                yield Item(item.start, item.source, code=LEFT_OUT)
            return
        begins = any(self.words.begins(s) for _, s in _sentences(item.source))
        steps = steps or (len(inline) > 1 and begins)
        if steps or self._prose or (self._plans and OPEN.fullmatch(item.source)):
            yield from self.steps(item.start, item.source, steps, item.message)
        elif (begins or is_negated(item.source)) and self._plans and not item.heads:
            yield from self.steps(item.start, item.source, False, item.message, unknown=False)
        elif item.message and begins:
            yield from self.steps(item.start, item.source, False, item.message)
        elif self._plans and self.ordered(item):
            yield Item(item.start, item.source, code=LEFT_OUT)

    def _done_besides(self, n: int, item: Prose) -> bool:
        """Tell whether a head says an action of the domain that no item below it does."""
        below = takewhile(
            lambda i: isinstance(i, Prose) and i.indent > item.indent, self._items[n + 1 :]
        )
        done = {self.words.meaning(call.action) for i in below for call in self._said(i.source)}
        found = [c for c in self._said(item.source) if c.args and self.words.knows(c.action)]
        return bool(found) and done.isdisjoint(self.words.meaning(call.action) for call in found)


class _Mixed(_Settling):
    """Settles the lines of a text that holds calls: a step beside them, or what describes them."""

    def __init__(
        self,
        items: Sequence[Item],
        where: Mapping[int, Prose],
        words: Vocabulary,
        calls: Sequence[int],
    ) -> None:
        super().__init__(words)
        self._items, self._where = items, where
        self._lists = {(w.group, w.indent) for n in calls if (w := self._of(n)) and w.marked}
        self._calls = [call for n in calls if (call := items[n].call)]
        self._done = {self.words.meaning(call.action) for call in self._calls}
        self._named = {_name(arg) for call in self._calls for arg in call.args}
        self._sizes = Counter(i.group for i in items if isinstance(i, Prose) and i.marked)

    def _of(self, n: int) -> Prose | None:
        """Return the line of an item, None if there is no such item."""
        item = self._items[n] if 0 <= n < len(self._items) else None
        return item if item is None or isinstance(item, Prose) else self._where.get(item.start)

    def line(self, n: int, item: Prose) -> Iterator[Item]:
        before, behind = self._nearest(n, item, -1), self._nearest(n, item, 1)
        sibling = item.marked and (item.group, item.indent) in self._lists
        begins = any(
            self.words.begins(s)
            or (self.words.shaped(s) if sibling else ARROW.search(s) and self.words.shaped(s))
            for _, s in _sentences(item.source)
        )
        near = [call for call in (before, behind) if call]
        headed = item.heads or self._has_body(n, item)
        among = not headed and (sibling or (near and begins and not item.fenced))
        left_out = Item(item.start, item.source, code=LEFT_OUT)
        if near and OPEN.fullmatch(item.source):
            yield from self.steps(item.start, item.source, False, item.message)
        elif among and begins and self._describes(item, near):
            yield from [left_out] * (len(near) > 1)
        elif among and (begins or is_negated(item.source) or OPEN.fullmatch(item.source)):
            yield from self.steps(item.start, item.source, begins, item.message)
        elif headed or CLOSED.fullmatch(item.source):
            return
        elif among or (len(near) > 1 and not item.fenced):
            yield left_out
        elif item.marked and begins:
            yield from self._outlined(item)
        elif self.ordered(item):
            yield left_out

    def _nearest(self, n: int, item: Prose, step: int) -> Call | None:
        """Return the call before or behind a line that no blank line parts from it, if any."""
        n += step
        while (where := self._of(n)) is not None and where.run == item.run:
            if not isinstance(self._items[n], Prose):
                return self._items[n].call
            n += step
        return None

    def _has_body(self, n: int, item: Prose) -> bool:
        """Tell whether what stands right below a line belongs to it: deeper, or its calls."""
        where = self._of(n + 1)
        if where is None or not item.marked:
            return where is not None and where.indent > item.indent and where.run == item.run
        deeper = where.indent > item.indent
        return deeper or (not where.marked and not isinstance(self._items[n + 1], Prose))

    def _describes(self, item: Prose, near: Sequence[Call]) -> bool:
        """Tell whether a line only says in words what a call beside it does."""
        meaning = self.words.meaning
        return any(
            meaning(call.action) == meaning(beside.action)
            and (not call.args or _name(call.args[0]) in map(_name, beside.args))
            for beside in near
            for call in self._said(item.source)
        )

    def _outlined(self, item: Prose) -> Iterator[Item]:
        """Tell of an item of a list apart from the calls, unless a call does what it says.

        It blocks unless the calls are the fuller account, of all the things that it names.
        """
        found = self._said(item.source)
        if found and all(self.words.meaning(call.action) in self._done for call in found):
            return
        named = {_name(arg) for call in found for arg in call.args} - {"it", "them"}
        fuller = self._sizes[item.group] < len(self._calls) and named <= self._named
        yield self._unread(item.start, item.source, blocks=not fuller)


def _name(arg: str) -> str:
    return arg.lower().replace(" ", "_")


def _in_time(items: Iterable[Item]) -> list[Item]:
    """Return items with the atoms of a logic program in the order of their times."""
    items = list(items)
    timed = [n for n, item in enumerate(items) if item.call is not None and item.time >= 0]
    for n, item in zip(timed, sorted((items[n] for n in timed), key=lambda i: i.time), strict=True):
        items[n] = item
    return items


def _left_out(prose: list[tuple[int, int, Item]], why: str) -> Finding:
    """Tell of all lines that are left out for one reason in one finding."""
    line, column, first = prose[0]
    message = f"{shown(first.source)} {why}"
    if len(prose) > 1:
        lines = [str(line) for line, _, _ in prose[1 : _MOST_LINES + 1]]
        more = " and on" if len(prose) > _MOST_LINES + 1 else ""
        message += f", and so is what stands in line {', '.join(lines)}{more}"
    return Finding(LEFT_OUT, f"{message}.", line=line, column=column)


def _no_plan(text: str, read: ReadText, findings: list[Finding]) -> str:
    if not text.strip():
        return "The text is empty: there is no plan in it."
    if findings:
        return "The text holds no step that can be run: see what else was found in it."
    if sum(not c.isprintable() and not c.isspace() for c in text[:1000]) > len(text[:1000]) / 10:
        return "The text is not readable: it consists of control characters and holds no call."
    rows = [line.strip() for line in text.split("\n") if line.strip()]
    items = [row for row in rows if re.match(r"(?:[-*•]|\d+[.)、])\s*\S", row)]
    quoted = ", ".join(shown(row[:SHOWN]) for row in (items or rows)[:2])
    if items:
        many = f"{len(items)} items" if len(items) > 1 else "one item"
        message = f"The text holds {many} of a list in words that could not be read as steps"
        return f'{message}: {quoted}. Write each as a call such as `action("item")`.'
    return f'The text holds no call such as `action("item")`: it is only prose: {quoted}.'


class _Places:
    """Turns offsets into lines and columns."""

    def __init__(self, text: str) -> None:
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self._last = len(text)

    def of(self, offset: int) -> tuple[int, int]:
        """Return the line and column of an offset."""
        line = bisect_right(self._starts, min(offset, self._last))
        return line, min(offset, self._last) - self._starts[line - 1] + 1
