"""The parser: from a language model's raw text to plan calls."""

from adaptbot_cli.core.parsing.discarded import without_discarded
from adaptbot_cli.core.parsing.lines import read_text
from adaptbot_cli.core.parsing.plain import plain
from adaptbot_cli.core.parsing.recap import without_repeats
from adaptbot_cli.core.parsing.scan import LEFT_OUT, Item, shown
from adaptbot_cli.core.plan import Finding, Parsed, Written

_MOST_LINES = 5


def parse(text: str) -> Parsed:
    """Read the calls in a text, in order, with a finding for whatever was not understood.

    Reads prose with Markdown, code and JSON. Pure; raises on no text; runs nothing; takes time in
    proportion to the text's length. Every finding and every call has its line and column.
    """
    text = whole = plain(text)
    text, discarded = without_discarded(whole)
    read = read_text(text)
    places = _Places(text)
    calls: list[Written] = []
    findings: list[Finding] = []
    prose: list[tuple[int, int, Item]] = []
    for item in read.items:
        line, column = places.of(item.start)
        if item.code == LEFT_OUT:
            prose.append((line, column, item))
        elif item.call is None:
            findings.append(Finding(item.code, item.message, line=line, column=column))
        else:
            calls.append(Written(item.call, item.source, line, column))
    if not calls:
        findings.insert(0, Finding("P101", _no_plan(whole, findings), line=1, column=1))
    if prose:
        findings.append(_left_out(prose, "is no call and is left out"))
    if discarded:
        findings += _discarded(discarded)
    kept, repeated = without_repeats(calls, read.gaps)
    return Parsed(kept, tuple(sorted((*findings, *repeated), key=_place)))


def _discarded(text: str) -> list[Finding]:
    """Tell of the calls in what the text takes back in one finding."""
    places = _Places(text)
    items = [item for item in read_text(text).items if item.code != LEFT_OUT]
    told = "is left out: the text takes it back (reasoning, a comment or struck out)"
    return [_left_out([(*places.of(item.start), item) for item in items], told)] if items else []


def _left_out(prose: list[tuple[int, int, Item]], why: str) -> Finding:
    """Tell of all lines that are left out for one reason in one finding."""
    line, column, first = prose[0]
    message = f"{shown(first.source)} {why}"
    if len(prose) > 1:
        lines = [str(line) for line, _, _ in prose[1 : _MOST_LINES + 1]]
        more = " and on" if len(prose) > _MOST_LINES + 1 else ""
        message += f", and so is what stands in line {', '.join(lines)}{more}"
    return Finding(LEFT_OUT, f"{message}.", line=line, column=column)


def _no_plan(text: str, findings: list[Finding]) -> str:
    if not text.strip():
        return "The text is empty: there is no plan in it."
    if findings:
        return "The text holds no call that can be run: see what else was found in it."
    if sum(not c.isprintable() and not c.isspace() for c in text[:1000]) > len(text[:1000]) / 10:
        return "The text is not readable: it consists of control characters and holds no call."
    return 'The text holds no call such as `action("item")`: it is only prose.'


def _place(finding: Finding) -> tuple[int, int]:
    return finding.line or 0, finding.column or 0


class _Places:
    """Turns offsets into lines and columns. Going forwards, it looks at the text once."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._line = 1
        self._line_start = 0

    def of(self, offset: int) -> tuple[int, int]:
        offset = min(offset, len(self._text))
        if offset < self._at:
            self._at, self._line, self._line_start = 0, 1, 0
        self._line += self._text.count("\n", self._at, offset)
        self._line_start = self._text.rfind("\n", self._at, offset) + 1 or self._line_start
        self._at = offset
        return self._line, offset - self._line_start + 1
