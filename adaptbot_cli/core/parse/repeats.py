"""Plans that are told twice: keeping one telling of a plan that the text repeats as a recap."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from adaptbot_cli.core.parse.calls import shown
from adaptbot_cli.core.plan import Call, Finding, Written

SEPARATED, LABELLED, WHOLE, RECAP, REVISED = 1, 2, 3, 4, 5
"""What stands before a call: any other text, or what hints at a repetition or a correction."""

# How much of the first telling a repetition under such a heading must cover to be one.
_COVERS = {LABELLED: 0.8, WHOLE: 0.5, RECAP: 0.0}
_SIMILAR = 0.8
_FEWEST = 5
_FEWEST_UNDER_RECAP = 3

# Comparing every pair of tellings is quadratic: texts beyond these sizes are no recaps.
_MOST_LABELS = 12
_MOST_CALLS = 3000

_HINTS = (
    (RECAP, r"recap\w*|summary|summari[sz]\w+|all together"),
    (WHOLE, r"(?:full|complete|whole|entire|overall|final|combined|consolidated)\s+(?:\w+\s+){0,2}"
            r"(?:sequence|plan|list|steps|actions|calls|code)"),
    (LABELLED, r"full|complete|final|overall|action sequence"),
)  # fmt: skip
_REVISION = re.compile(
    r"^\W*(?:wait|actually|hold on|correction|oops)[,.:!…]|\b(?:scratch that|my mistake"
    r"|let me (?:redo|correct|revise|rewrite|fix (?:that|this|it)|(?:start|try) (?:over|again))"
    r"|(?:corrected|revised|fixed)\s+(?:\w+\s+){0,2}"
    r"(?:plan|sequence|list|steps|actions|version))\b",
    re.IGNORECASE,
)
_HEADING_WORDS = 8

_Key = tuple[str, tuple[str, ...]]
"""What makes two calls the same."""


def heading_strength(line: str) -> int:
    """Tell what a line that holds no call says about the calls below it, see `SEPARATED` ff."""
    line = line.strip()[:200]
    if _REVISION.search(line):
        return REVISED
    plain = line.strip("*_ ")
    short = len(plain.split()) <= _HEADING_WORDS and not plain.endswith(".")
    if not (line.startswith(("#", "**")) or plain.endswith(":") or short):
        return SEPARATED
    found = (n for n, hint in _HINTS if re.search(rf"\b(?:{hint})\b", line, re.IGNORECASE))
    return next(found, SEPARATED)


def without_repeats(
    calls: Sequence[Written], gaps: Mapping[int, int]
) -> tuple[tuple[Written, ...], tuple[Finding, ...]]:
    """Keep one telling of a plan that is told several times, with a finding for every other.

    `gaps` says for the index of a call what stands between it and the call before. Calls that
    follow each other without anything between are never taken for a repetition.
    """
    total = len(calls)
    if total > _MOST_CALLS:
        return tuple(calls), ()
    orders: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    keys = [_key(written.call, orders) for written in calls]
    labels = sorted(i for i, gap in gaps.items() if gap >= LABELLED and 0 < i < total)
    bounds = [*labels[:_MOST_LABELS], total]
    kept, findings, at = [*range(bounds[0])], list[Finding](), 0
    while at < len(bounds) - 1:
        start = bounds[at]
        told = [keys[i] for i in kept]
        if gaps[start] == REVISED:
            kept, finding = _revise(calls, keys, kept, [*range(start, bounds[at + 1])])
            findings.append(finding)
            at += 1
            continue
        # The longest repetition wins: a recap may have headings of its own.
        upto = range(len(bounds) - 1, at, -1)
        again = next((n for n in upto if _repeats(told, keys[start : bounds[n]], gaps[start])), 0)
        more = [*range(start, bounds[again or at + 1])]
        if again:
            kept, finding = _choose(calls, keys, kept, more)
            findings.append(finding)
        else:
            kept += more
        at = again or at + 1
    # Exact copies of the whole plan, announced or not, that other text keeps apart.
    for size in range(_FEWEST, total // 2 + 1) if not findings else ():
        starts = range(size, total, size)
        if total % size == 0 and keys[size:] == keys[:-size] and all(i in gaps for i in starts):
            kept = [*range(size)]
            copies = ([*range(i, i + size)] for i in starts)
            findings = [_choose(calls, keys, kept, copy)[1] for copy in copies]
            break
    return tuple(calls[i] for i in kept), tuple(findings)


def _repeats(told: Sequence[_Key], more: Sequence[_Key], gap: int) -> bool:
    if len(more) < _FEWEST:
        return gap == RECAP and len(more) >= _FEWEST_UNDER_RECAP and told == more
    common = common_in_order(told, more)
    return common >= _SIMILAR * len(more) and common >= _COVERS[gap] * len(told)


def _revise(
    calls: Sequence[Written], keys: Sequence[_Key], first: list[int], again: list[int]
) -> tuple[list[int], Finding]:
    """Let a correction take the place of what it corrects, if it tells at least half of it anew."""
    place, start, end = calls[again[0]], calls[first[0]].line, calls[first[-1]].line
    message = f"The text corrects itself before line {place.line}"
    if 2 * common_in_order([keys[i] for i in first], [keys[i] for i in again]) >= len(first):
        message += f": what stands before it, from line {start} to {end}, is left out."
        return again, Finding("P104", message, line=place.line, column=place.column)
    message += ", but does not say which of the steps before it still hold."
    return first + again, Finding("P103", message, line=place.line, column=place.column)


def _choose(
    calls: Sequence[Written], keys: Sequence[_Key], first: list[int], again: list[int]
) -> tuple[list[int], Finding]:
    """Keep the fuller of two kept, the first unless the other says all of it and more."""
    told, more = [keys[i] for i in first], [keys[i] for i in again]
    lacks, extra = Counter(told) - Counter(more), Counter(more) - Counter(told)
    fuller = bool(extra) and common_in_order(told, more) == len(told)
    kept, dropped = (again, first) if fuller else (first, again)
    place, start, end = calls[again[0]], calls[dropped[0]].line, calls[dropped[-1]].line
    message = f"The plan is repeated from line {place.line}: run once"
    message += f", leaving out {f'line {start}' if start == end else f'lines {start} to {end}'}"
    if extra:
        added = [shown(calls[i].source) for i in again if keys[i] in extra]
        message += f"; the repetition adds {', '.join(added[:3])}"
    if lacks:
        message += f"; the repetition lacks {lacks.total()} of the calls told first"
    return kept, Finding("P104", message + ".", line=place.line, column=place.column)


def common_in_order(first: Sequence[_Key], again: Sequence[_Key]) -> int:
    """Count the calls that two tellings have in common in the same order.

    The longest common subsequence, a row of the table being the bits of one number (Hyyrö 2004).
    """
    places: dict[_Key, int] = {}
    for i, key in enumerate(first):
        places[key] = places.get(key, 0) | 1 << i
    every = (1 << len(first)) - 1
    row = every
    for key in again:
        met = row & places.get(key, 0)
        row = ((row + met) | (row - met)) & every
    return len(first) - row.bit_count()


def _key(call: Call, orders: dict[tuple[str, frozenset[str]], tuple[str, ...]]) -> _Key:
    """Tell calls apart by action and arguments, those with keywords in the order first written."""
    action = call.action.lower()
    args = {name: arg for name, arg in call.named() if name}
    order = orders.setdefault((action, frozenset(args)), tuple(args))
    lines = [args[name] for name in order] if len(args) == len(call.args) else call.args
    return action, tuple(arg.lower().replace("_", " ") for arg in lines)
