"""The plan in the person's hands: what stays open, is dropped, edited or rejected."""

from collections.abc import Generator
from dataclasses import replace
from typing import Any, Literal

from adaptbot_cli.core.ask.edit import Edit, edited, rejection
from adaptbot_cli.core.ask.learning import is_absent
from adaptbot_cli.core.ask.questions import LATER
from adaptbot_cli.core.findings import OF_THE_REQUEST
from adaptbot_cli.core.names import normal, sentence_list
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.check import lost_items
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.run import Run, look_at, propose
from adaptbot_cli.core.turns import Amend, Propose, Turn

Reported = Generator[Turn, Any, Report]


def amended(run: Run, report: Report, why: Literal["asked", "open", "ready"]) -> Reported:
    """Offer one edit; return the plan checked again after it, the same if there was none.

    A plan that is rejected goes back to the planner with the reason. What it makes of that is
    refused if it loses a required item, as after any other re-prompt. The rejected one is not
    carried out, if it comes to that.
    """
    edit: Edit | None = yield Amend(report, why, run.kg)
    if edit is None:
        return report
    if edit.kind != "reject":
        # The person has seen what words were put in for, and may write either name from now on.
        changes = (change for step in report.steps for change in step.changes)
        run.scene.agreed |= {normal(c.source) for c in changes if c.by in resolve.BY_WORDS}
        return (yield from _become(run, report, edited(edit, report, run.parse)))
    objection = run.objections[report.text] = rejection(edit)
    findings = (*still_open(run, report), objection)
    text = yield from propose(run, Propose(run.task, 1, report.text, findings))
    lost = lost_items(run.parse(report.text), run.parse(text), run.scene)
    if run.policy == "tutor" and lost:
        return guarded(replace(report, findings=(*report.findings, objection)), lost)
    return (yield from _become(run, report, text))


def _become(run: Run, report: Report, text: str) -> Reported:
    """Look at a new text, and remember it as what the person wants of the old one."""
    run.edits.pop(text, None)
    if text != report.text:
        run.edits[report.text] = text
    return (yield from look_at(run, text))


def unsolved(run: Run, report: Report) -> bool:
    """Tell whether findings are open about anything but what the person has put off."""
    later = {q.about for q, answer in run.asked.values() if answer.value == LATER.value}
    plan = (f for f in report.open if f.code not in OF_THE_REQUEST)
    return any(normal(f.subject) not in later | run.scene.aside for f in plan)


def still_open(run: Run, report: Report) -> tuple[Finding, ...]:
    """Return what a new plan could mend: not what nobody answers, nor a required item not there.

    That a required item is unknown is the person's to mend; the paper's policy re-prompts for it.
    """

    def lacks(f: Finding) -> bool:
        unknown = f.code == "E201" and run.policy == "tutor"
        if f.code in OF_THE_REQUEST or (f.code == "E505" and f.step is None):
            return True
        return run.scene.requires(f.subject) and (unknown or is_absent(run.kg, f.subject, "item"))

    return tuple(
        f for f in report.open if normal(f.subject) not in run.scene.aside and not lacks(f)
    )


def guarded(report: Report, lost: tuple[str, ...]) -> Report:
    """Return the old plan, with what a new one that lost required items did wrong."""
    message = f"a new plan left out {sentence_list(lost)}, which the task requires; it was refused"
    finding = Finding("E502", message, lost[0], candidates=lost)
    kept = tuple(f for f in report.findings if f.code != "E502")
    return replace(report, findings=(*kept, finding))


def set_aside(run: Run, report: Report) -> Reported:
    """Drop the steps that only a thing nobody needs for the goal holds up (III-C, not there)."""
    names = {
        normal(f.subject)
        for f in report.blocking
        if f.code in ("E101", "E201", "E203") and not run.scene.requires(f.subject)
    }
    if not names - run.scene.aside:
        return report
    run.scene.aside |= names
    return (yield from look_at(run, report.text))
