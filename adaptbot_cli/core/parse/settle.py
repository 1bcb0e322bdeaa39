"""Settling what the lines of a text say: a step in words, what describes a call, or nothing."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

from adaptbot_cli.core.english import PRONOUNS, REPETITIONS, count_of
from adaptbot_cli.core.parse import phrases
from adaptbot_cli.core.parse.calls import GAP, LEFT_OUT, PROSE, SAID, Item, shown, worded
from adaptbot_cli.core.parse.phrases import CLOSED, OPEN, Vocabulary
from adaptbot_cli.core.plan import Call, keyworded

_MOST_TIMES = 50
_LOOK_BACK = 20
"""How many steps a pronoun for several things looks back."""

_INLINE = re.compile(r"(?:(?<=[\s,.;:])|\A)\(?(\d{1,3})[.)][ \t]+(?=\S)")
_BARE = re.compile(r"[^\W\d][\w-]*(?:[ ][^\s.,;:!?]+){1,7}\s*")
"""A row of a plan without marks: a few words, no sentence."""
_SENTENCE = re.compile(r"(?<=[.!])\s+(?=\(?[A-Z\"“`])|(?<=;)\s+|</\w+>\s*(?=<)")
_BY_NUMBER = worded(
    r"\b(?:skip|omit|ignore|disregard|remove|delete|drop|leave out|swap|reverse)\b.{0,30}"
    r"\bsteps? \d|\bsteps? \d+\b.{0,40}\b(?:not|optional|unnecessary|skipped|left out|instead)\b"
)
"""What is said of a step by its number: "skip step 3", "step 3 is not needed"."""
_THE = worded(r"\w+ (?:the|a|an) \w")
_NO_STEPS = worded(
    r"\W*(?:(?:thoughts?|observations?|think|reflection|feedback|tasks?|goals?|question)\s*\d*\s*:.*"
    r"|(?:ingredients|tools?|utensils|equipment|materials|objects|items|notes?|tips?|assumptions?"
    r"|requirements?|you(?: will|'ll)? need|explanation|reason\w*|rationale|goals?|summary|result"
    r"|preconditions?|constraints?|safety|warnings?|expected|why|known|available|allowed)\b.{0,60})$"
)


def settled(items: Sequence[Item], words: Vocabulary) -> Iterator[Item]:
    """Yield what was read with each line of prose as a step in words, a finding, or nothing."""
    settling = _Settling([item for item in items if item.code != GAP], words)
    n = -1
    for item in items:
        n += item.code != GAP
        if item.code == PROSE:
            yield from (settling.beside_calls if settling.calls else settling.alone)(n, item)
        elif item.code == SAID and settling.announces(n, item):
            yield item.told(LEFT_OUT)
        elif item.code == SAID:
            yield from settling.steps(item, marked=True)
        elif item.call is not None:
            yield from settling.call(item, item.call)
        else:
            yield item


def _sentences(source: str) -> list[tuple[int, str]]:
    """Return the sentences of a line, and the items of a list that stands in one line."""
    lead = phrases.label_end(source)
    marks = list(_INLINE.finditer(source, lead))
    first = int(marks[0][1]) if marks else 0
    if first in (1, 2) and [int(m[1]) for m in marks] == [*range(first, len(marks) + first)]:
        # What leads the first number is an announcement; the line's own mark has been read.
        bounds = [lead] * (first == 2) + [m.end() for m in marks]
        ends = [*(m.start() for m in marks[first == 1 :]), len(source)]
    else:
        bounds = [lead, *(m.end() for m in _SENTENCE.finditer(source, lead))]
        ends = [*bounds[1:], len(source)]
    found = [(at, source[at:end].strip(" ,;")) for at, end in zip(bounds, ends, strict=True)]
    return [
        (at, part)
        for at, part in found
        if OPEN.fullmatch(part) or (re.search(r"\w", part) and not CLOSED.fullmatch(part))
    ]


class _Settling:
    """Settles lines: as steps of the list that is the plan, or by the `calls` beside them.

    A pronoun is what the steps before were about.
    """

    def __init__(self, items: Sequence[Item], words: Vocabulary) -> None:
        self._items = items
        self._words = words
        self._before: list[tuple[str, Sequence[str]]] = []
        called = [(item.line, item.call) for item in items if item.call]
        self.calls = [call for _, call in called]
        self._called = {(line.group, line.indent) for line, _ in called if line.marked}
        lines = [(n, item) for n, item in enumerate(items) if item.code == PROSE]
        self._sizes = Counter(item.line.group for _, item in lines if item.line.marked)
        rows = [i.source for _, i in lines if not i.line.marked and not CLOSED.fullmatch(i.source)]
        begun = sum(map(words.begins, rows))
        self._bare = 3 * begun >= len(rows) > 1 and all(map(_BARE.fullmatch, rows))
        self._aside: set[int] = set()
        lists: dict[int | None, list[Item]] = {}
        parts: list[str] = []
        aside = False
        for n, item in lines:
            no_steps, sentences = bool(_NO_STEPS.match(item.source)), _sentences(item.source)
            inline = len(sentences) > 1 and _INLINE.search(item.source)
            if item.line.heads or (item.source.rstrip().endswith(":") and not item.line.marked):
                aside = no_steps
            if aside or (no_steps and not (item.line.heads or item.line.marked or inline)):
                self._aside.add(n)
                continue
            parts += [] if item.line.heads else [part for _, part in sentences]
            if not self._heads(n, item):
                lists.setdefault(self._list(item), []).append(item)
        self._plans = {
            group
            for group, found in lists.items()
            if any(map(self._begins, found))
            or (words.names and all(_THE.match(item.source) for item in found))
        } - {None}
        shaped = sum(words.begins(part) or words.shaped(part) for part in parts)
        most = any(map(words.begins, parts)) and 2 * shaped >= len(parts)
        self._prose = not self._plans and (most or shaped == len(parts))

    def call(self, item: Item, call: Call) -> Iterator[Item]:
        """Yield a call with what its pronouns stand for, as often as it is done."""
        action, own, often = call.action, [], 1
        if CLOSED.fullmatch(action) and not self._words.knows(action) and not call.args:
            yield item.told(LEFT_OUT)
            return
        for name, arg in call.named():
            if name.lower() in REPETITIONS and not self._words.takes(action, name):
                often = count_of(arg)
            else:
                pronoun = self._before and arg.lower() in PRONOUNS
                own.append((name, self._before[0][1][0] if pronoun else arg))
        self._remember(action, [arg for _, arg in own[:1] if not arg[:1].isdigit()])
        if not often:
            yield item.conditional("how often it is done")
        yield from [replace(item, call=keyworded(action, own))] * min(often, _MOST_TIMES)

    def announces(self, n: int, item: Item) -> bool:
        """Tell whether a text in a structure only says what the call behind it does."""
        behind = self._items[n + 1 : n + 2]
        return self._describes(item, [i.call for i in behind if i.call])

    def steps(self, item: Item, marked: bool, unknown: bool = True) -> Iterator[Item]:
        """Yield the steps of a phrase; where it cannot be read, a finding that names it."""
        for number, (at, sentence) in enumerate(_sentences(item.source)):
            part = replace(item, start=item.start + at, source=sentence)
            if _BY_NUMBER.search(sentence):
                why = f"{shown(sentence)} changes a step that is written out: change it there."
                yield part.told("P103", why)
                continue
            if OPEN.fullmatch(sentence):
                why = f"{shown(sentence)} stands for steps that are not written out: write each."
                yield part.told("P103", why)
                continue
            if phrases.is_negated(sentence):
                yield part.told("P106", f"{shown(sentence)} is not to be done, so it is no step.")
                continue
            aside = phrases.ASIDE.search(sentence)
            optional = phrases.OPTIONAL.match(sentence)
            optional = optional or (aside and phrases.OPTIONAL.match(aside[1]))
            known = self._words.begins(sentence)
            fits = known or (unknown and ((marked and not number) or self._words.shaped(sentence)))
            clauses = self._words.read(sentence, unknown, self._before) if fits else []
            if not clauses:
                yield self._unread(part, known)
            for clause in clauses:
                condition = item.message or clause.condition or (optional[1] if optional else "")
                if condition:
                    yield part.conditional(condition)
                    continue
                self._remember(*clause.done)
                for call in clause.calls:
                    yield replace(part, call=call, code="")
                left_out = ", ".join(filter(None, [clause.left_out, aside[1] if aside else ""]))
                if left_out:
                    message = f"`{left_out}` in {shown(sentence)} is left out: no action takes it."
                    yield part.told(LEFT_OUT, message)

    def alone(self, n: int, item: Item) -> Iterator[Item]:
        """Yield what a line says in a text that holds no call."""
        if not self._words.names:
            return
        if _BY_NUMBER.search(item.source):
            yield from self.steps(item, False)
            return
        if n in self._aside:
            return
        if self._heads(n, item):
            # What it stands for is below; what is done besides is told of.
            if item.line.marked and self._done_besides(n, item):
                yield item.told(LEFT_OUT)
            return
        begins = self._begins(item)
        steps = self._list(item) in self._plans
        if steps or self._prose or (self._plans and OPEN.fullmatch(item.source)):
            yield from self.steps(item, steps)
        elif (begins or phrases.is_negated(item.source)) and self._plans and not item.line.heads:
            yield from self.steps(item, False, unknown=False)
        elif item.message and begins:
            yield from self.steps(item, False)
        elif self._plans and self._ordered(item):
            yield item.told(LEFT_OUT)

    def beside_calls(self, n: int, item: Item) -> Iterator[Item]:
        """Yield what a line says in a text that holds calls: a step, or what describes them."""
        of = item.line
        near = [call for call in (self._nearest(n, -1), self._nearest(n, 1)) if call]
        sibling = of.marked and (of.group, of.indent) in self._called
        begins = any(
            self._words.begins(s)
            or ((sibling or phrases.ARROW.search(s)) and self._words.shaped(s))
            for _, s in _sentences(item.source)
        )  # fmt: skip
        headed = of.heads or self._heads(n, item)
        among = not headed and (sibling or (near and begins and not of.fenced))
        is_open = OPEN.fullmatch(item.source)
        if (near and is_open) or _BY_NUMBER.search(item.source):
            yield from self.steps(item, False)
        elif among and begins and self._describes(item, near):
            yield from [item.told(LEFT_OUT)] * (len(near) > 1)
        elif among and (begins or is_open or phrases.is_negated(item.source)):
            yield from self.steps(item, begins)
        elif headed or CLOSED.fullmatch(item.source):
            return
        elif not among and of.marked and begins and len(near) < 2:
            yield from self._outlined(item)
        elif among or (len(near) > 1 and not of.fenced) or self._ordered(item):
            yield item.told(LEFT_OUT)

    def _list(self, item: Item) -> int | None:
        """Return the list that a line is an item of, if any; rows without marks are one."""
        if item.line.marked or (item.line.fenced and not self._bare):
            return item.line.group
        return -1 if self._bare else None

    def _heads(self, n: int, item: Item) -> bool:
        """Tell whether a line announces what stands below it: its items, or its calls."""
        at, below = item.line, self._items[n + 1] if n + 1 < len(self._items) else item
        of, deeper = below.line, below.line.indent > at.indent
        if item.source.rstrip(" *_").endswith(":"):
            return True
        if below.code != PROSE:
            body = deeper or (at.marked and not of.marked)
            return bool(self.calls) and body and (at.marked or of.run == at.run)
        goes_on = not of.marked or of.number == at.number + 1
        items = (deeper and at.marked and of.block == at.block) or (at.heads and not of.heads)
        return items and not goes_on

    def _nearest(self, n: int, step: int) -> Call | None:
        """Return the call before or behind a line that no blank line parts from it, if any."""
        run = self._items[n].line.run
        while 0 <= n < len(self._items) and self._items[n].line.run == run:
            if self._items[n].code != PROSE:
                return self._items[n].call
            n += step
        return None

    def _remember(self, action: str, objects: Sequence[str]) -> None:
        if objects:
            self._before = [(action, objects), *self._before][:_LOOK_BACK]

    def _said(self, item: Item) -> list[Call]:
        clauses = self._words.read(item.source, False, self._before)
        return [call for clause in clauses for call in clause.calls]

    def _done(self, calls: Iterable[Call]) -> set[str]:
        return {self._words.meaning(call.action) for call in calls}

    def _begins(self, item: Item) -> bool:
        return any(self._words.begins(sentence) for _, sentence in _sentences(item.source))

    def _ordered(self, item: Item) -> bool:
        """Tell whether a line that is left out has an order in it, which then is told of."""
        heads = item.line.heads or _NO_STEPS.match(item.source)
        found = [] if heads else _sentences(item.source)
        return any(self._words.ordered(sentence) for _, sentence in found)

    def _done_besides(self, n: int, item: Item) -> bool:
        """Tell whether a head says an action of the domain that no item below it does."""
        below = takewhile(
            lambda i: i.code == PROSE and i.line.indent > item.line.indent, self._items[n + 1 :]
        )
        done = self._done(call for i in below for call in self._said(i))
        found = [c for c in self._said(item) if c.args and self._words.knows(c.action)]
        return bool(found) and done.isdisjoint(self._done(found))

    def _describes(self, item: Item, near: Sequence[Call]) -> bool:
        """Tell whether a line only says in words what a call beside it does."""
        return any(
            self._done([call]) == self._done([beside])
            and (not call.args or _name(call.args[0]) in map(_name, beside.args))
            for beside in near
            for call in self._said(item)
        )

    def _outlined(self, item: Item) -> Iterator[Item]:
        """Tell of an item of a list apart from the calls, unless a call does what it says.

        It blocks unless the calls are the fuller account, of all the things that it names.
        """
        found = self._said(item)
        if not found or not self._done(found) <= self._done(self.calls):
            named = {_name(arg) for call in found for arg in call.args} - {"it", "them"}
            known = {_name(arg) for call in self.calls for arg in call.args}
            fuller = self._sizes[item.line.group] < len(self.calls) and named <= known
            yield self._unread(item, blocks=not fuller)

    def _unread(self, item: Item, blocks: bool) -> Item:
        """Tell of a line that no form fits; it blocks if it begins as a step of this robot does."""
        message = f"{shown(item.source)} looks like a step, but is none that can be read."
        return replace(item, code=LEFT_OUT, message=message * blocks, time=1 if blocks else -1)


def _name(arg: str) -> str:
    return arg.lower().replace(" ", "_")
