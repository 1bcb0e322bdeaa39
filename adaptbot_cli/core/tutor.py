"""The method of the paper (Algorithm 1), as one generator of turns.

T = propose → parse, check, refine, repair → re-prompt → ask the human → execute → goal check.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from adaptbot_cli.core.amending import amended, guarded, set_aside, still_open, unsolved
from adaptbot_cli.core.confirming import confirmed, judged
from adaptbot_cli.core.dialogue import ask, keep
from adaptbot_cli.core.examine import lost_items
from adaptbot_cli.core.journal import GoBack, Journal
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.mending import mend
from adaptbot_cli.core.plan import Finding, Task
from adaptbot_cli.core.questions import LATER
from adaptbot_cli.core.report import Outcome, Report, Result, Usage
from adaptbot_cli.core.request import Reading
from adaptbot_cli.core.run import Parse, Policy, Run, forget_all, look_at, propose
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import (
    Execute,
    Propose,
    Turn,
    Understood,
)

Turns = Generator[Turn, Any, Result]

__all__ = ["Parse", "Policy", "Turns", "inspect", "pursue", "pursue_each"]


def pursue(
    task: Task,
    kg: Kg,
    parse: Parse,
    policy: Policy = "tutor",
    replans: int = 3,
    full: bool = False,
) -> Turns:
    """Pursue a task: yield turns, receive replies, return the `Result` (paper, Algorithm 1).

    `replans` is the paper's F_max. Policy "paper" re-prompts before any question; "tutor" asks
    about required items that are unknown first, and guards them against being lost. `full` asks
    everything about a new thing, not only what this plan needs.

    When the person goes back to an earlier question, the run starts again with its journal.
    """
    journal, usage, parse = Journal(), Usage(), cache(parse)
    edits: dict[str, str] = {}
    agreed: set[str] = set()
    while True:
        scene = Scene(kg, task, agreed=agreed)
        run = Run(kg, task, parse, scene, policy, full, usage, edits=edits)
        try:
            return (yield from journal.play(_pursue(run, replans)))
        except GoBack as back:
            forget_all(run)
            journal.reopen(back.to)
            usage = replace(run.usage, questions=0)


def pursue_each(
    text: str,
    read: Callable[[str], Reading],
    kg: Kg,
    parse: Parse,
    policy: Policy = "tutor",
    replans: int = 3,
    full: bool = False,
) -> Turns:
    """Pursue every task of a request, each on the state that the one before has left.

    `read` says what words mean; a reading that is in doubt is confirmed by the person first. The
    state of the graph in memory is that before the last task then.
    """
    reading, asked = yield from confirmed(text, read)
    yield Understood(reading)
    results: list[Result] = []
    for task in reading.tasks:
        before = results[-1] if results else None
        if before is not None and before.outcome is not None and before.verdict == "executable":
            for delta in before.outcome.deltas:
                kg.apply(delta)
        results.append((yield from pursue(task, kg, parse, policy, replans, full)))
    if not results:
        told = f"nothing is to be done: the request says not to {reading.refused or 'do anything'}"
        finding = Finding("W604", told, reading.refused)
        results = [Result(Report(Task(""), "", (), (finding,)), None, Usage())]
    usage = results[0].usage
    told_by = [each for each in asked if each[1].value != LATER.value]
    usage = replace(usage, questions=usage.questions + len(told_by))
    results[0] = replace(results[0], questions=(*asked, *results[0].questions), usage=usage)
    return _together(results)


def _together(results: Sequence[Result]) -> Result:
    """The results of several tasks as one; that of a single one as it is."""
    last = results[-1]
    if len(results) == 1:
        return last
    each = [result.usage for result in results]
    costs = [usage.cost_usd for usage in each if usage.cost_usd is not None]
    usage = Usage(
        sum(u.model_calls for u in each),
        sum(u.prompt_tokens for u in each),
        sum(u.completion_tokens for u in each),
        sum(costs) if costs else None,
        sum(u.questions for u in each),
    )
    return replace(
        last,
        usage=usage,
        questions=tuple(q for result in results for q in result.questions),
        lessons=tuple(lesson for result in results for lesson in result.lessons),
        revision=next((r.revision for r in reversed(results) if r.revision), None),
        sizes=(results[0].sizes[0], last.sizes[1]),
        runs=tuple(results),
    )


def _pursue(run: Run, replans: int) -> Turns:
    """Algorithm 1."""
    before = run.kg.size()
    yield from judged(run)
    text = yield from propose(run, Propose(run.task))
    report = yield from look_at(run, text)
    if run.policy == "tutor":
        report = yield from ask(run, report, required_only=True)
    tries = 0
    while True:
        report, tries = yield from _replan(run, report, tries, replans)
        told = _said(still_open(run, report))
        report = yield from ask(run, report)
        more = run.policy == "tutor" and tries < replans and not run.stopped
        if more and _said(still_open(run, report)) - told:
            continue  # the answers brought up what a new plan could mend
        report = yield from set_aside(run, report)
        report = yield from mend(run, report)
        report = yield from _amend(run, report)
        outcome = yield from _execute(report)
        if outcome is None or outcome.error is None or tries >= replans or run.stopped:
            break
        report = replace(report, findings=(*report.findings, outcome.error))
    revision, left_out = yield from keep(run)
    if left_out:
        report = yield from look_at(run, report.text)
        report = yield from set_aside(run, report)
        outcome = yield from _execute(report)
    sizes = (before, run.kg.size())
    questions = tuple(run.asked.values())
    lessons = tuple(run.lessons)
    return Result(report, outcome, run.usage, questions, lessons, revision, sizes)


def _execute(report: Report) -> Generator[Turn, Any, Outcome | None]:
    if not report.executable:
        return None
    outcome: Outcome = yield Execute(report)
    return outcome


def _replan(
    run: Run, report: Report, tries: int, limit: int
) -> Generator[Turn, Any, tuple[Report, int]]:
    """Re-prompt with the findings until nothing is open, nothing changes or tries are used up.

    Policy "tutor" goes on with the best plan that there was, the paper's with the last.
    """
    seen, best = {report.text}, report
    while still_open(run, report) and tries < limit and not run.stopped:
        tries += 1
        findings = still_open(run, report)
        text = yield from propose(run, Propose(run.task, tries, report.text, findings))
        if run.policy == "tutor" and text in seen:
            break
        seen.add(text)
        lost = lost_items(run.parse(report.text), run.parse(text), run.scene)
        if run.policy == "tutor" and lost:
            report = guarded(report, lost)
            continue
        new = yield from look_at(run, text)
        same = run.policy == "tutor" and _said(still_open(run, new)) == _said(findings)
        report = new
        best = min(best, report, key=_short_of_goal)
        if same:
            break
    if run.policy == "tutor" and best.text != report.text:
        report = yield from look_at(run, best.text)
    return report, tries


def _short_of_goal(report: Report) -> tuple[bool, int, int]:
    """How far a plan is from its goal: the less, the better."""
    return not report.live, len(report.blocking), len(report.open)


def _said(findings: tuple[Finding, ...]) -> set[tuple[str, str]]:
    return {(finding.code, finding.message) for finding in findings}


def _amend(run: Run, report: Report) -> Generator[Turn, Any, Report]:
    """Let the person edit the plan: where no question solves what is open, or before execution."""
    while not run.stopped:
        new = yield from amended(run, report, "open" if unsolved(run, report) else "ready")
        if new is report:
            break
        report = yield from ask(run, new)
        report = yield from set_aside(run, report)
    return report


def inspect(task: Task, kg: Kg, parse: Parse, text: str, repair: bool = True) -> Turns:
    """Check a plan's text without model or human, and return the `Result`.

    Nothing is dropped: what is not there is reported, whether the goal needs it or not. Without
    `repair` no step is inserted, left out or moved, and no word put in for another.
    """
    parse = cache(parse)
    scene = Scene(kg, task, drop=False, repair=repair)
    run = Run(kg, task, parse, scene)
    report = yield from look_at(run, text)
    outcome = (yield Execute(report)) if report.executable else None
    size = kg.size()
    return Result(report, outcome, run.usage, sizes=(size, size))
