"""Plans that are told twice: keeping one telling of a plan that the text repeats as a recap."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from adaptbot_cli.core.parse.calls import shown
from adaptbot_cli.core.plan import Call, Finding, Written

SEPARATED, LABELLED, WHOLE, RECAP = 1, 2, 3, 4
"""What stands before a call: any other text, or a heading that hints at a repetition."""

# How much of the first telling a repetition under such a heading must cover to be one.
_COVERS = {LABELLED: 0.8, WHOLE: 0.5, RECAP: 0.0}
_SIMILAR = 0.8
_FEWEST = 5
_FEWEST_UNDER_RECAP = 3

# Comparing every pair of tellings is quadratic: texts beyond these sizes are no recaps.
_MOST_LABELS = 12
_MOST_CALLS = 3000

_RECAP = re.compile(r"\b(?:recap\w*|summary|summari[sz]\w+|all together)\b", re.IGNORECASE)
_WHOLE = re.compile(
    r"\b(?:full|complete|whole|entire|overall|final|combined|consolidated)\s+(?:\w+\s+){0,2}"
    r"(?:sequence|plan|list|steps|actions|calls|code)\b",
    re.IGNORECASE,
)
_LABEL = re.compile(r"\b(?:full|complete|final|overall|action sequence)\b", re.IGNORECASE)
_HEADING_WORDS = 8

_Key = tuple[str, tuple[str, ...]]
_Telling = Sequence[tuple[Written, _Key]]
"""Calls, each with what makes two of them the same."""


def heading_strength(line: str) -> int:
    """Tell what a line that holds no call says about the calls below it, see `SEPARATED` ff."""
    line = line.strip()[:200]
    plain = line.strip("*_ ")
    short = len(plain.split()) <= _HEADING_WORDS and not plain.endswith(".")
    if not (line.startswith(("#", "**")) or plain.endswith(":") or short):
        return SEPARATED
    if _RECAP.search(line):
        return RECAP
    if _WHOLE.search(line):
        return WHOLE
    return LABELLED if _LABEL.search(line) else SEPARATED


def without_repeats(
    calls: Sequence[Written], gaps: Mapping[int, int]
) -> tuple[tuple[Written, ...], tuple[Finding, ...]]:
    """Keep one telling of a plan that is told several times, with a finding for every other.

    `gaps` says for the index of a call what stands between it and the call before. Calls that
    follow each other without anything between are never taken for a repetition.
    """
    if len(calls) > _MOST_CALLS:
        return tuple(calls), ()
    orders: dict[tuple[str, frozenset[str]], tuple[str, ...]] = {}
    whole = [(written, _key(written.call, orders)) for written in calls]
    kept, findings = _without_labelled(whole, gaps)
    if not findings:
        kept, findings = _without_copies(whole, gaps)
    return tuple(written for written, _ in kept), tuple(findings)


def _without_labelled(whole: _Telling, gaps: Mapping[int, int]) -> tuple[_Telling, list[Finding]]:
    total = len(whole)
    labels = sorted(i for i, gap in gaps.items() if gap >= LABELLED and 0 < i < total)
    bounds = [*labels[:_MOST_LABELS], total]
    kept = whole[: bounds[0]]
    findings: list[Finding] = []
    at = 0
    while at < len(bounds) - 1:
        start = bounds[at]
        # The longest repetition wins: a recap may have headings of its own.
        for upto in range(len(bounds) - 1, at, -1):
            again = whole[start : bounds[upto]]
            if _repeats(kept, again, gaps[start]):
                kept, finding = _choose(kept, again)
                findings.append(finding)
                at = upto
                break
        else:
            at += 1
            kept = [*kept, *whole[start : bounds[at]]]
    return kept, findings


def _without_copies(whole: _Telling, gaps: Mapping[int, int]) -> tuple[_Telling, list[Finding]]:
    """Drop exact copies of the whole plan, announced or not, that other text keeps apart."""
    total, keys = len(whole), _keys(whole)
    for size in range(_FEWEST, total // 2 + 1):
        apart = total % size == 0 and all(i in gaps for i in range(size, total, size))
        if apart and keys[size:] == keys[:-size]:
            copies = (whole[i : i + size] for i in range(size, total, size))
            return whole[:size], [_choose(whole[:size], copy)[1] for copy in copies]
    return whole, []


def _keys(telling: _Telling) -> list[_Key]:
    return [key for _, key in telling]


def _repeats(first: _Telling, again: _Telling, gap: int) -> bool:
    found, more = _keys(first), _keys(again)
    if len(more) < _FEWEST:
        return gap == RECAP and len(more) >= _FEWEST_UNDER_RECAP and found == more
    common = common_in_order(found, more)
    return common >= _SIMILAR * len(more) and common >= _COVERS[gap] * len(found)


def _choose(first: _Telling, again: _Telling) -> tuple[_Telling, Finding]:
    """Keep the fuller of two tellings, the first unless the other says all of it and more."""
    found, more = _keys(first), _keys(again)
    lacks = list((Counter(found) - Counter(more)).elements())
    extra = Counter(more) - Counter(found)
    fuller = bool(extra) and common_in_order(found, more) == len(found)
    kept, dropped = (again, first) if fuller else (first, again)
    place, start, end = again[0][0], dropped[0][0].line, dropped[-1][0].line
    message = f"The plan is repeated from line {place.line}: run once"
    message += f", leaving out {f'line {start}' if start == end else f'lines {start} to {end}'}"
    if extra:
        added = [written.source for written, key in again if key in extra]
        message += f"; the repetition adds {', '.join(map(shown, added[:3]))}"
    if lacks:
        message += f"; the repetition lacks {len(lacks)} of the calls told first"
    finding = Finding("P104", message + ".", line=place.line, column=place.column)
    return kept, finding


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
