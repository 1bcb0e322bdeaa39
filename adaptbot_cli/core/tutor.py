"""The method of the paper (Algorithm 1), as one generator of turns.

T = propose → parse, check, refine, repair → re-prompt → ask the human → execute → goal check.
"""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal

from adaptbot_cli.core import teach
from adaptbot_cli.core.examine import examine, lost_items, words_to_look_up
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson, is_absent
from adaptbot_cli.core.names import normal, sentence_list
from adaptbot_cli.core.plan import Finding, Parsed, Task
from adaptbot_cli.core.questions import LATER, Answer, Question
from adaptbot_cli.core.report import Outcome, Report, Result, Usage
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.tasks import with_told
from adaptbot_cli.core.turns import (
    Ask,
    Checked,
    Execute,
    Keep,
    Kept,
    Learned,
    LookUp,
    Proposal,
    Propose,
    Review,
    Turn,
)

Policy = Literal["tutor", "paper"]
Parse = Callable[[str], Parsed]
Turns = Generator[Turn, Any, Any]


@dataclass(slots=True)
class Run:
    """A run as far as it has come."""

    kg: Kg
    task: Task
    parse: Parse
    scene: Scene
    policy: Policy = "tutor"
    usage: Usage = field(default_factory=Usage)
    asked: dict[teach.Key, tuple[Question, Answer]] = field(default_factory=dict)
    lessons: list[Lesson] = field(default_factory=list)


def pursue(task: Task, kg: Kg, parse: Parse, policy: Policy = "tutor", replans: int = 3) -> Turns:
    """Pursue a task: yield turns, receive replies, return the `Result` (paper, Algorithm 1).

    `replans` is the paper's F_max. Policy "paper" re-prompts before any question; "tutor" asks
    about required items that are unknown first, and guards them against being lost.
    """
    before = kg.size()
    run = Run(kg, task, cache(parse), Scene(kg, task), policy)
    text = yield from _propose(run, Propose(task))
    run.task = run.scene.task = with_told(task, run.parse(text), kg)
    report = yield from _examine(run, text)
    if policy == "tutor":
        report = yield from _ask(run, report, required_only=True)
    tries = 0
    while True:
        report, tries = yield from _replan(run, report, tries, replans)
        told = _said(_open(run, report))
        report = yield from _ask(run, report)
        if policy == "tutor" and tries < replans and _said(_open(run, report)) - told:
            continue  # the answers brought up what a new plan could mend
        report = yield from _set_aside(run, report)
        outcome = yield from _execute(report)
        if outcome is None or outcome.error is None or tries >= replans:
            break
        report = replace(report, findings=(*report.findings, outcome.error))
    revision, refused = yield from _keep(run)
    if refused:
        report = yield from _without_lessons(run, report)
        outcome = yield from _execute(report)
    sizes = (before, kg.size())
    questions = tuple(run.asked.values())
    lessons = tuple(run.lessons)
    return Result(report, outcome, run.usage, questions, lessons, revision, sizes)


def _execute(report: Report) -> Generator[Turn, Any, Outcome | None]:
    if not report.executable:
        return None
    outcome: Outcome = yield Execute(report)
    return outcome


def _propose(run: Run, turn: Propose) -> Generator[Turn, Proposal, str]:
    proposal = yield turn
    used = run.usage
    cost = proposal.cost_usd
    run.usage = replace(
        used,
        model_calls=used.model_calls + proposal.calls,
        prompt_tokens=used.prompt_tokens + proposal.prompt_tokens,
        completion_tokens=used.completion_tokens + proposal.completion_tokens,
        cost_usd=used.cost_usd if cost is None else (used.cost_usd or 0.0) + cost,
    )
    return proposal.text


def _examine(run: Run, text: str) -> Generator[Turn, Any, Report]:
    """Parse, check, refine and repair a text, looking up the words that the KG does not know."""
    parsed = run.parse(text)
    calls = [written.call for written in parsed.calls]
    items, actions = words_to_look_up(calls, run.scene)
    domain = run.kg.domain
    for words, fields in ((items, domain.noun_fields), (actions, domain.verb_fields)):
        if words:
            found = yield LookUp(tuple(sorted(words)), fields)
            run.scene.known.update({word: found.get(word, ()) for word in words})
    report = examine(parsed, text, run.scene)
    yield Checked(report)
    return report


def _replan(
    run: Run, report: Report, tries: int, limit: int
) -> Generator[Turn, Any, tuple[Report, int]]:
    """Re-prompt with the findings until nothing is open, nothing changes or tries are used up."""
    seen = {report.text}
    while _open(run, report) and tries < limit:
        tries += 1
        findings = _open(run, report)
        text = yield from _propose(run, Propose(run.task, tries, report.text, findings))
        if run.policy == "tutor" and text in seen:
            break
        seen.add(text)
        lost = lost_items(run.parse(report.text), run.parse(text), run.scene)
        if run.policy == "tutor" and lost:
            report = _guarded(report, lost)
            continue
        new = yield from _examine(run, text)
        same = run.policy == "tutor" and _said(_open(run, new)) == _said(findings)
        report = new
        if same:
            break
    return report, tries


def _guarded(report: Report, lost: tuple[str, ...]) -> Report:
    """The old plan, with what a new one that lost required items did wrong."""
    message = f"a new plan left out {sentence_list(lost)}, which the task requires; it was refused"
    finding = Finding("E502", message, lost[0], candidates=lost)
    kept = tuple(f for f in report.findings if f.code != "E502")
    return replace(report, findings=(*kept, finding))


def _open(run: Run, report: Report) -> tuple[Finding, ...]:
    """What a new plan could mend: not what nobody will answer, nor a required item not there."""
    return tuple(
        f
        for f in report.open
        if normal(f.subject) not in run.scene.aside
        and not (run.scene.requires(f.subject) and is_absent(run.kg, f.subject, "item"))
    )


def _said(findings: tuple[Finding, ...]) -> set[tuple[str, str]]:
    return {(finding.code, finding.message) for finding in findings}


def _ask(run: Run, report: Report, required_only: bool = False) -> Generator[Turn, Any, Report]:
    """Ask the person about what is open, learn from each answer, and check again (III-C)."""
    learned = False
    while True:
        question = teach.next_question(report, run.scene, run.asked, required_only)
        if question is None:
            return report
        answer: Answer = yield Ask(question)
        run.asked[question.key] = (question, answer)
        if answer.value != LATER.value:
            run.usage = replace(run.usage, questions=run.usage.questions + 1)
        lesson = teach.learn(question, answer, report, run.scene)
        if lesson is not None:
            teach.take(lesson, run.scene)
            run.lessons.append(lesson)
            yield Learned(lesson)
            learned = True
        if learned and not teach.unfinished(run.scene, run.asked):
            report = yield from _examine(run, report.text)
            learned = False


def _set_aside(run: Run, report: Report) -> Generator[Turn, Any, Report]:
    """Drop the steps that only a thing nobody needs for the goal holds up (III-C, not there)."""
    names = {
        normal(f.subject)
        for f in report.blocking
        if f.code in ("E101", "E201", "E203") and not run.scene.requires(f.subject)
    }
    if not names - run.scene.aside:
        return report
    run.scene.aside |= names
    return (yield from _examine(run, report.text))


def _keep(run: Run) -> Generator[Turn, Any, tuple[str | None, bool]]:
    """Have the person review what was learned, then have it committed; tell if it was refused."""
    if not run.lessons:
        return None, False
    lessons = tuple(run.lessons)
    if not (yield Review(lessons)):
        return None, True
    kept: Kept = yield Keep(run.task, lessons)
    return kept.revision, False


def _without_lessons(run: Run, report: Report) -> Generator[Turn, Any, Report]:
    """What the plan is worth without the lessons that the person has refused."""
    for lesson in reversed(run.lessons):
        teach.forget(lesson, run.scene)
    run.lessons.clear()
    report = yield from _examine(run, report.text)
    return (yield from _set_aside(run, report))


def inspect(task: Task, kg: Kg, parse: Parse, text: str) -> Turns:
    """Check a plan's text without model or human, and return the `Result`.

    Nothing is dropped: what is not there is reported, whether the goal needs it or not.
    """
    parse = cache(parse)
    task = with_told(task, parse(text), kg)
    scene = Scene(kg, task, drop=False)
    run = Run(kg, task, parse, scene)
    report = yield from _examine(run, text)
    outcome = (yield Execute(report)) if report.executable else None
    size = kg.size()
    return Result(report, outcome, run.usage, sizes=(size, size))
