"""The parser: normalise a text, cut off what is no answer, read each line, account for all."""

import re
from bisect import bisect_right
from collections.abc import Callable, Iterable

from adaptbot_cli.core.parse.calls import GAP, LEFT_OUT, PROSE, SAID, SHOWN, Item, shown
from adaptbot_cli.core.parse.phrases import Vocabulary
from adaptbot_cli.core.parse.reader import read_text
from adaptbot_cli.core.parse.repeats import without_repeats
from adaptbot_cli.core.parse.settle import settled
from adaptbot_cli.core.plan import Finding, Parsed, Written

_MOST_LINES = 5

_UNSEEN = {0x200B: None, 0x2060: None, 0xFEFF: None}
"""Zero-width space, word joiner, byte order mark: they stand in copied text and say nothing."""
# Only behind a name in ASCII: 拿起苹果（从冰箱） is a sentence with a remark.
_QUOTED_NAME = re.compile(r"(?<![\w(])'([A-Za-z]\w*(?:[ ]\w+)+)'\(")  # as in Prolog
_WIDE_CALL = re.compile(r"(?<=[A-Za-z0-9_])[(（][^()（）\n]*[)）]")
_WIDE = str.maketrans("（），：＝＂＇「」『』", '(),:="\'""""')

_TAG = (
    r"(?:\w+:)?(?:think\w*|thought\w*|reason\w*|scratch_?pad|reflection|analysis|inner_monologue)"
)
_CLOSE = rf"</{_TAG}>|<\|?(?:/|end_of_){_TAG}\|?>|\[/{_TAG}\]|◁/{_TAG}▷"
_MARK = re.compile(
    rf"(?P<fence>^(?:[^\S\n]|>)*(?:(?:[-*+]|\d+[.)])[^\S\n]+)?(?:`{{3}}|~{{3}})[^`(\"\n]*$)"
    rf"|(?P<string>[(,\[:=][^\S\n]*\"[^\"\\\n]*+(?:\\.[^\"\\\n]*+)*\")"
    rf"|(?P<open><\|?(?:begin_of_)?{_TAG}\|?>|\[{_TAG}\]|◁{_TAG}▷"
    r"|<\|channel\|>(?!final)\w+(?:<\|message\|>)?)"
    rf"|(?P<close>{_CLOSE})|(?P<comment><!--|/\*)"
    r"|(?P<end><\|(?:im_end|eot_id|endoftext|end_of_text|end_of_turn|return|eom_id)\|>|</s>"
    r"|<(?:end_of_turn|eos)>|^(?:user|human|<\|im_start\|>user)[ ]?:?[ ]*$|^(?:User|Human):(?=\s))"
    r"|(?P<frame><\|(?:start|channel|message|end|python_tag|tool_calls?)\|>(?:assistant|final)?)"
    r"|(?<!~)~~(?![~\s])[^~\n]*+(?:~(?!~)[^~\n]*+)*~~(?!~)"
    r"|<(?P<gone>del|strike)>[^\n]{0,300}?</(?P=gone)>",
    re.IGNORECASE | re.MULTILINE,
)
_ENDS = {
    "open": re.compile(rf"{_CLOSE}|<\|(?:end|channel|start)\|>", re.IGNORECASE),
    "comment": re.compile(r"-->|\*/"),
    "fence": re.compile(r"^(?:[^\S\n]|>)*(?:`{3}|~{3})[^\S\n]*$", re.MULTILINE),
}
_LETTER = re.compile(r"[^\n]")
_COMMAND = re.compile(r"^[ \t]*(?:>|act(?:ion)?[ ]?\d*:)[ \t]*(?=\w)", re.IGNORECASE | re.MULTILINE)
"""What leads a step in a transcript of a game in words."""
_SAYS = (
    r"(?:obs(?:ervation)?[ ]?\d*:|nothing happens\b"
    r"|(?:[^\n>]{0,80}\.[ ])?(?:in|on|at|looking)\b[^\n>.]{0,40},[ ]you see\b"
    r"|you[ ]\w+[ ][^\n]*\bthe[ ][a-z]+[ ]\d+\b(?![ ]times)[^\n]*\.)"
)
_ANSWER = re.compile(rf"^[ \t]*{_SAYS}[^\n]*$", re.IGNORECASE | re.MULTILINE)
"""What the world answers to a step: "You pick up the egg 1 from the table 2."."""
_BETWEEN = re.compile(
    rf"^[ \t]*(?:{_SAYS}|(?:you|the|your|ok)\b|(?:>[ ]*)?think:)[^\n]*$",
    re.IGNORECASE | re.MULTILINE,
)
"""What stands between the steps of such a transcript."""


def parse(text: str, words: Vocabulary | None = None) -> Parsed:
    """Read the steps in a text, in order, with a finding for whatever was not understood.

    Reads prose with Markdown, code, JSON and other structures; and phrases, with the words of a
    domain. Pure; raises on no text; runs nothing; takes time in proportion to the text's length.
    Every finding and every call has its line and column.
    """
    words = words or Vocabulary()
    whole = _plain(text)
    text, answers = _without_answers(whole)
    text, discarded, why = _without_discarded(text)
    place = _places(text)
    calls: list[Written] = []
    findings: list[Finding] = []
    left_out: dict[int, Item] = {}
    gaps: dict[int, int] = {}
    for item in _in_time(settled(read_text(text, words), words)):
        line, column = place(item)
        if item.call is not None:
            calls.append(Written(item.call, item.source, line, column))
        elif item.code == GAP:
            if calls:
                gaps[len(calls)] = max(item.time, gaps.get(len(calls), 1))
        elif item.code == LEFT_OUT and not item.message:
            left_out[item.start] = item
        else:
            blocks = item.code == LEFT_OUT and item.time > 0
            findings.append(
                Finding(item.code, item.message, line=line, column=column, blocking=blocks)
            )
    if not calls:
        findings.insert(0, Finding("P101", _no_plan(whole, bool(findings)), line=1, column=1))
    back = [
        item
        for item in read_text(discarded, words)
        if item.code not in (LEFT_OUT, PROSE, SAID, GAP)
        or item.source.startswith(("~~", "<del>", "<strike>"))
    ]
    for items, reason in (
        ([*left_out.values()], "is no call and is left out"),
        (answers, "is left out: it is what the world answers, which is no step"),
        (sorted(back, key=lambda item: item.start), f"is left out: {why}"),
    ):
        findings += [_left_out(items, reason, place)] if items else []
    kept, repeated = without_repeats(calls, gaps)
    findings = sorted([*findings, *repeated], key=lambda f: (f.line or 0, f.column or 0))
    return Parsed(kept, tuple(findings))


def _plain(text: str) -> str:
    """Return a text with line feeds only, nothing unseen, and calls in ASCII's punctuation."""
    text = text.replace("\r\n", "\n").replace("\r", "\n").translate(_UNSEEN)
    text = _QUOTED_NAME.sub(lambda name: f"  {name[1].replace(' ', '_')}(", text)
    return _WIDE_CALL.sub(lambda call: call[0].translate(_WIDE), text)


def _without_answers(text: str) -> tuple[str, list[Item]]:
    """Return a text without the world's answers to steps, spaces in their place, and these."""
    form = _BETWEEN if _COMMAND.search(text) and _ANSWER.search(text) else _ANSWER
    items = [Item(m.end() - len(m[0].lstrip()), m[0].strip()) for m in form.finditer(text)]
    return form.sub(lambda answer: " " * len(answer[0]), text), items


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
        if kind == "end" and text[: mark.start()].strip():
            why = "it stands behind the end of the answer" if not spans else why
            at = len(text)
        if kind == "close" and not reasoned:
            spans = [(0, at)]
        elif kind not in ("fence", "string", "close"):
            spans.append((mark.start(), at))
        reasoned = reasoned or kind in ("open", "close")
    quoted = [m.span() for m in re.finditer(r"^[^\S\n]*>[^\n]*", text, re.MULTILINE)]
    if quoted and re.search(r"^(?![^\S\n]*>)[^\n]*\w\(", text, re.MULTILINE):
        why = why if spans else "it is quoted"
        spans = sorted([*spans, *quoted])
    if not spans:
        return text, "", ""
    kept, discarded, at = [], [], 0
    for start, end in [*spans, (len(text), len(text))]:
        start, end = max(start, at), max(end, at)
        kept += [text[at:start], _LETTER.sub(" ", text[start:end])]
        discarded += [_LETTER.sub(" ", text[at:start]), text[start:end]]
        at = end
    return "".join(kept), "".join(discarded), why


def _in_time(items: Iterable[Item]) -> list[Item]:
    """Return items with the atoms of a logic program in the order of their times."""
    items = list(items)
    timed = sorted((item for item in items if item.call and item.time >= 0), key=lambda i: i.time)
    later = iter(timed)
    return [next(later) if item.call and item.time >= 0 else item for item in items]


def _places(text: str) -> Callable[[Item], tuple[int, int]]:
    """Return what tells the line and column of an item."""
    starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def place(item: Item) -> tuple[int, int]:
        offset = min(item.start, len(text))
        line = bisect_right(starts, offset)
        return line, offset - starts[line - 1] + 1

    return place


def _left_out(items: list[Item], why: str, place: Callable[[Item], tuple[int, int]]) -> Finding:
    """Tell of all lines that are left out for one reason in one finding."""
    line, column = place(items[0])
    message = f"{shown(items[0].source)} {why}"
    if len(items) > 1:
        lines = ", ".join(str(place(item)[0]) for item in items[1 : _MOST_LINES + 1])
        more = " and on" if len(items) > _MOST_LINES + 1 else ""
        message += f", and so is what stands in line {lines}{more}"
    return Finding(LEFT_OUT, f"{message}.", line=line, column=column)


def _no_plan(text: str, found: bool) -> str:
    if not text.strip():
        return "The text is empty: there is no plan in it."
    if found:
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
