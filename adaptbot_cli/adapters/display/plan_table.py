"""The plan as a table: what was written, what it became, the verdict; below it what is open."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.display.cells import (
    BAD,
    GAP,
    GOOD,
    WARNING,
    Mark,
    Wrapped,
    columns,
    count,
    plain_text,
)
from adaptbot_cli.core.findings import is_open
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.plan import Finding, Step
from adaptbot_cli.core.report import Report

_MARKS: Mapping[str, Mark] = {
    "ok": GOOD,
    "changed": Mark("~", "yellow"),
    "inserted": Mark("+", "cyan"),
    "dropped": Mark("−", "magenta"),
    "finding": BAD,
}
_VERDICT = len("+ inserted")
_SENTENCE = 300
"""How many columns a part of a finding's sentence may take: a remedy may be several steps."""
_WORDS = re.compile(r"\w+|\W")


def plan_table(report: Report, width: int, also: Sequence[Finding] = ()) -> RenderableType:
    """Return a plan's steps, its substitutions and its findings, at most `width` columns wide.

    `also` are findings that came after the check: what stopped the execution, a goal not met.
    """
    findings = (*report.findings, *also)
    none = Text("no step could be read from it", "dim")
    parts: list[RenderableType] = [
        Text("Plan", "bold"),
        _steps(report.steps, width) if report.steps else none,
    ]
    for title, table in (
        ("Substitutions", _substitutions(report.steps)),
        ("Findings", _findings(findings)),
    ):
        if table.rows:
            parts += [Text(), Text(title, "bold"), table]
    return Group(*parts)


def summary(report: Report) -> str:
    """Say in a line what became of a plan: "19 steps, 7 changed, 2 findings"."""
    tally = Counter(step.status for step in report.steps)
    changes = [f"{tally[s]} {s}" for s in ("changed", "inserted", "dropped") if tally[s]]
    open_ = len(_merged(report.findings))
    found = count(open_, "finding") if open_ else "nothing open"
    return ", ".join([count(len(report.steps), "step"), *changes, found])


def _steps(steps: Sequence[Step], width: int) -> Table:
    digits = len(str(len(steps)))
    texts = [_texts(step, before) for before, step in zip((None, *steps), steps, strict=False)]
    space = max(width - digits - _VERDICT - 2 * GAP, 2 * GAP)
    shares = _shares([pair for pair in texts if pair[1]], space - GAP)
    alone = max((left.cell_len for left, right in texts if not right), default=1)
    table = columns(digits, min(space, max(sum(shares) + GAP, alone)), _VERDICT)
    table.columns[0].justify = "right"
    for number, (step, pair) in enumerate(zip(steps, texts, strict=True), start=1):
        table.add_row(Text(str(number), "dim"), _side_by_side(pair, shares), _verdict(step))
    return table


def _side_by_side(pair: tuple[Text, Text], shares: tuple[int, int]) -> RenderableType:
    """Two texts beside each other; a text alone has all the room, so that it rarely wraps."""
    if not pair[1]:
        return Wrapped(pair[0])
    table = columns(*shares)
    table.add_row(*map(Wrapped, pair))
    return table


def _shares(texts: Iterable[tuple[Text, Text]], space: int) -> tuple[int, int]:
    """The widths of the two middle columns: what they need, or what there is, shared fairly."""
    wrote = became = 1
    for left, right in texts:
        wrote, became = max(wrote, left.cell_len), max(became, right.cell_len)
    half = max(space // 2, 1)
    if wrote + became <= space:
        return wrote, became
    if wrote <= half:
        return wrote, max(space - wrote, 1)
    return (max(space - became, 1), became) if became <= half else (half, max(space - half, 1))


def _texts(step: Step, before: Step | None) -> tuple[Text, Text]:
    """What stands in the two middle columns: the model's words, and what the step is now."""
    call = step.call.render()
    again = before is not None and (before.status, before.reason) == (step.status, step.reason)
    why = Text() if again else plain_text(step.reason, "dim italic")
    if step.done == "failed":
        return plain_text(call), why
    if step.status == "inserted":
        because = Text("because ", "dim italic").append_text(why) if why else why
        return because, plain_text(call, "cyan")
    written = plain_text(step.source or call)
    if step.status == "dropped":
        written.stylize("dim strike")
        return written, why
    if _squashed(call) == _squashed(step.source or call):
        return written, Text()
    return written, _marked(call, {change.target for change in step.changes})


def _squashed(call: str) -> str:
    return re.sub(r"""[\s"'`]""", "", call).lower()


def _marked(call: str, targets: set[str]) -> Text:
    """A call with the names in it that were put there."""
    text = Text()
    for word in _WORDS.findall(call):
        text.append_text(plain_text(word, "yellow" if word in targets else "dim"))
    text.truncate(plain_text(call).cell_len, overflow="ellipsis")
    return text


def _verdict(step: Step) -> Text:
    mark = _MARKS[step.status]
    if step.done == "failed":
        return Text(f"{BAD.sign} failed", BAD.style)
    if step.done == "not tried":
        return Text("· not done", "dim")
    if step.codes:
        mark = mark if step.status == "finding" else WARNING
        more = f" +{len(step.codes) - 1}" if len(step.codes) > 1 else ""
        return Text(f"{mark.sign} {step.codes[0]}{more}", mark.style)
    return Text.assemble((f"{mark.sign} ", mark.style), (step.status, mark.style))


def _substitutions(steps: Iterable[Step]) -> Table:
    """Every substitution once, with its evidence and how many steps it changed."""
    counts = Counter(
        (change.source, change.target, change.evidence, change.approved == "human")
        for step in steps
        if step.status == "changed"
        for change in dict.fromkeys(step.changes)
    )
    table = columns(None, None)
    for (source, target, evidence, human), steps_changed in counts.items():
        names = plain_text(source, longest=40), plain_text(target, "yellow", 40)
        why = plain_text(f"{evidence}, approved by a person" if human else evidence)
        why.append(f" ({count(steps_changed, 'step')})", "dim")
        table.add_row(Text(" → ").join(names), why)
    return table


def _findings(findings: Iterable[Finding]) -> Table:
    table = columns(None, None, None)
    for column in table.columns[:2]:
        column.no_wrap = True
    for finding, places in _merged(findings):
        mark = BAD if is_open(finding) else WARNING
        code = Text(f"{mark.sign} {finding.code}", mark.style)
        table.add_row(code, Text(_where(places, finding), "dim"), _sentence(finding))
    return table


def _merged(findings: Iterable[Finding]) -> list[tuple[Finding, list[int]]]:
    """Findings of several steps with one message as one, with the numbers of the steps."""
    merged: dict[tuple[str, str], tuple[Finding, list[int]]] = {}
    for finding in findings:
        _, places = merged.setdefault((finding.code, finding.message), (finding, []))
        places += [place for place in finding.places if place not in places]
    return list(merged.values())


def _where(places: Sequence[int], finding: Finding) -> str:
    if places:
        shown = 3 if len(places) == 3 else 2  # "3 more" never stands for what would fit as well
        text = sentence_list([*map(str, sorted(places))], shown)
        return f"{'step' if len(places) == 1 else 'steps'} {text}"
    return f"line {finding.line}" if finding.line is not None else "plan"


def _sentence(finding: Finding) -> Text:
    text = plain_text(finding.message, longest=_SENTENCE)
    options = list(finding.candidates)
    if options and not {*options} & {*re.findall(r"\w+", finding.message)}:
        text.append_text(plain_text(f"; could be {sentence_list(options)}", "dim", _SENTENCE))
    if finding.remedy:
        text.append_text(plain_text(f"; {finding.remedy} would mend that", "dim", _SENTENCE))
    return text
