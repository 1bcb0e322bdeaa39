"""The method of the paper (Algorithm 1), as one generator of turns.

T = propose → parse, check, refine, repair → re-prompt → ask the human → execute → goal check.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from adaptbot_cli.core.acts import (
    GOAL_MET,
    act,
    ask_what_now,
    begin,
    failure,
    is_hopeless,
    outside,
    stop,
    with_failure,
)
from adaptbot_cli.core.ask.amend import amended, guarded, set_aside, still_open, unsolved
from adaptbot_cli.core.ask.dialogue import ask, confirmed, judged, keep, keep_plan, mend
from adaptbot_cli.core.ask.questions import LATER
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.journal import GoBack, Journal
from adaptbot_cli.core.plan import Finding, Task
from adaptbot_cli.core.refine.check import lost_items
from adaptbot_cli.core.refine.goals import check_goal, rehearsed
from adaptbot_cli.core.report import Outcome, Report, Result
from adaptbot_cli.core.request.understand import Reading
from adaptbot_cli.core.run import (
    Acting,
    Confirm,
    Parse,
    Plans,
    Policy,
    Run,
    look_at,
    propose,
    retract_all,
)
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Executed, Propose, Turn, Understood
from adaptbot_cli.core.usage import Usage

Turns = Generator[Turn, Any, Result]

__all__ = ["Confirm", "Parse", "Policy", "Turns", "inspect", "pursue", "pursue_each"]


def pursue(
    task: Task,
    kg: Kg,
    parse: Parse,
    policy: Policy = "tutor",
    replans: int = 3,
    full: bool = False,
    world: Confirm | None = None,
    done: Sequence[str] = (),
    plans: Plans = "none",
) -> Turns:
    """Pursue a task: yield turns, receive replies, return the `Result` (paper, Algorithm 1).

    `replans` is the paper's F_max. Policy "paper" re-prompts before any question; "tutor" asks
    about required items that are unknown first, and guards them against being lost. `full` asks
    everything about a new thing, not only what this plan needs. `world` says which steps the person
    confirms in a world outside; without one the plan is only rehearsed. `done` are calls that were
    carried out there before, in a run that was cut off; `plans` says which plans the person is
    offered to keep for the task.

    When the person goes back to an earlier question, the run starts again with its journal; once
    the robot has begun to act, nothing is gone back on.
    """
    journal, usage, parse = Journal(), Usage(), cache(parse)
    edits: dict[str, str] = {}
    agreed: set[str] = set()
    algorithm = _paper if policy == "paper" else _tutor
    while True:
        scene = Scene(kg, task, agreed=agreed)
        acting = None if world is None else Acting(world)
        if acting is not None:
            acting.before = [written.call for text in done for written in parse(text).calls]
            args = (arg for call in acting.before for arg in call.args)
            scene.done |= {entity for arg in args for entity in kg.find(arg)}
        run = Run(kg, task, parse, scene, policy, full, usage, edits=edits, acting=acting)
        before = kg.size()
        try:
            report, outcome = yield from journal.play(algorithm(run, replans))
            break
        except GoBack as back:
            retract_all(run)
            journal.reopen(back.to)
            usage = replace(run.usage, questions=0)
    if plans != "none":
        yield from keep_plan(run, report, outcome, plans)
    run.lessons = []
    retract_all(run)  # what held this once
    return Result(
        report,
        outcome,
        run.usage,
        tuple(run.asked.values()),
        tuple(run.kept),
        run.revision,
        (before, kg.size()),
        outside=outside(acting) if acting and acting.begun else None,
    )


def pursue_each(
    text: str,
    read: Callable[[str], Reading],
    kg: Kg,
    parse: Parse,
    policy: Policy = "tutor",
    replans: int = 3,
    full: bool = False,
    world: Confirm | None = None,
    done: Sequence[str] = (),
    over: Sequence[tuple[str, str]] = (),
    plans: Plans = "none",
) -> Turns:
    """Pursue every task of a request, each on the state that the one before has left.

    `over` are the tasks that came to their end in a world in a run that was cut off in a later
    one, each with what it came to; `done` are the calls of that later one. Neither is repeated.

    `read` says what words mean; a reading that is in doubt is confirmed by the person first. The
    state of the graph in memory is that before the last task then.
    """
    reading, asked = yield from confirmed(text, read)
    yield Understood(reading)
    results: list[Result] = []
    ended = [name for name, _ in over]
    for task in reading.tasks:
        if task.name in ended:
            ended.remove(task.name)
            continue
        before = results[-1] if results else None
        if before is not None and before.outside is not None and before.outcome is not None:
            if before.outcome.error is not None and before.outcome.error.code in ("E602", "E604"):
                break
        elif before is not None and before.outcome is not None and before.verdict == "executable":
            for delta in before.outcome.deltas:
                kg.apply(delta)
        results.append(
            (yield from pursue(task, kg, parse, policy, replans, full, world, done, plans))
        )
        done = ()
    if not results:
        message = (
            f"nothing is to be done: the request says not to {reading.refused or 'do anything'}"
        )
        finding = Finding("W604", message, reading.refused)
        results = [Result(Report(Task(""), "", (), (finding,)), None, Usage())]
    usage = results[0].usage
    answered = [each for each in asked if each[1].value != LATER.value]
    usage = replace(usage, questions=usage.questions + len(answered))
    results[0] = replace(results[0], questions=(*asked, *results[0].questions), usage=usage)
    unmet = [f"{name}: {why}" for name, why in over if why != GOAL_MET]
    if unmet and results[-1].outcome is not None:
        earlier = tuple(Finding("E503", f"before it was interrupted: {each}") for each in unmet)
        outcome = replace(results[-1].outcome, unmet=(*results[-1].outcome.unmet, *earlier))
        results[-1] = replace(results[-1], outcome=outcome)
    return _together(results)


def _together(results: Sequence[Result]) -> Result:
    """Combine the results of several tasks; a single result is returned unchanged."""
    last = results[-1]
    if len(results) == 1:
        return last
    return replace(
        last,
        usage=sum((result.usage for result in results), start=Usage()),
        questions=tuple(q for result in results for q in result.questions),
        lessons=tuple(lesson for result in results for lesson in result.lessons),
        revision=next((r.revision for r in reversed(results) if r.revision), None),
        sizes=(results[0].sizes[0], last.sizes[1]),
        runs=tuple(results),
    )


Ended = Generator[Turn, Any, tuple[Report, Outcome | None]]


def _tutor(run: Run, limit: int) -> Ended:
    """Algorithm 1 with the tutor's policy: ask the person early, and before the robot acts."""
    yield from judged(run)
    text = yield from propose(run, Propose(run.task))
    report = yield from look_at(run, text)
    report = yield from ask(run, report, required_only=True)
    tries = 0
    while True:
        report, tries = yield from _replan(run, report, tries, limit)
        found = _keys(still_open(run, report))
        report = yield from ask(run, report)
        if tries >= limit or run.stopped or not _keys(still_open(run, report)) - found:
            break  # else the answers brought up what a new plan could mend
    report = yield from set_aside(run, report)
    report = yield from mend(run, report)
    report = yield from _amend(run, report)
    report, outcome = yield from _rehearsed_and_kept(run, report)
    if run.acting is None or not report.executable:
        return report, outcome
    return (yield from _act(run, run.acting, report, tries, limit))


def _rehearsed_and_kept(run: Run, report: Report) -> Ended:
    """Rehearse and review; rehearse again if the person left a lesson out."""
    outcome = yield from _rehearse(run, report)
    changed = yield from _kept(run, report)
    return (
        (report, outcome) if changed is report else (changed, (yield from _rehearse(run, changed)))
    )


def _kept(run: Run, report: Report) -> Generator[Turn, Any, Report]:
    """Review and commit what was learned; check the plan again if a lesson was left out."""
    if not (yield from keep(run)):
        return report
    report = yield from look_at(run, report.text)
    return (yield from set_aside(run, report))


def _rehearse(run: Run, report: Report) -> Generator[Turn, Any, Outcome | None]:
    if not report.executable:
        return None
    outcome = rehearsed(report, run.kg)
    yield Executed(report, outcome)
    return outcome


def _act(run: Run, acting: Acting, report: Report, tries: int, limit: int) -> Ended:
    """Execute a plan in the world. A failure or surprise is repaired from the observed state, else
    re-prompted, else asked about; the robot goes on from where it stands."""
    if (yield from begin(run, acting)):
        report = yield from look_at(run, report.text)
    stuck = False
    while not acting.over:
        if report.executable or stuck:
            tried, stuck = len(acting.acts), False
            ended = yield from act(run, acting, report)
            unmet = check_goal(run.scene)[0] if ended else ()
            if acting.over or (ended and not (unmet and tries < limit)):
                break
            if ended:
                done = replace(report, text="", findings=unmet)
                new, tries = yield from _replan(run, done, tries, limit)
                if not new.text:
                    break
                report = new
            else:
                report = yield from look_at(run, acting.left)
                if len(acting.acts) == tried:
                    acting.at = 0
                    break  # as far as it can come
            acting.at = 0
            if report.executable and not is_hopeless(run, acting):
                continue
            report = with_failure(acting, report)
        report, tries = yield from _replan(run, report, tries, limit)
        report = yield from _helped(run, acting, report)
        while run.went_back:  # from the review: what was answered is asked again
            report = yield from _helped(run, acting, with_failure(acting, report))
        # Nobody knows better: as far as it comes, something may be seen on the way that helps.
        stuck = not report.executable
        if stuck and failure(acting) is not None:
            break
    report, outcome = yield from stop(run, acting, report)
    yield Executed(report, outcome)
    return report, outcome


def _helped(run: Run, acting: Acting, report: Report) -> Generator[Turn, Any, Report]:
    """Ask the person about what blocks the rest of the plan; commit the answers."""
    asked, run.went_back = run.usage.questions, False
    if not report.executable:
        report = yield from ask(run, report)
    if not report.executable:
        report = yield from ask_what_now(run, acting, report)
    if run.usage.questions > asked:
        acting.helps.append(len(acting.acts))
        report = yield from _kept(run, report)
    return report


def _paper(run: Run, limit: int) -> Ended:
    """Algorithm 1, line by line; the numbers are the paper's."""
    tries, outcome = 0, None  # 2: F
    text = yield from propose(run, Propose(run.task))  # 3
    report = yield from look_at(run, text)  # 4
    if not still_open(run, report):  # 5
        outcome = yield from _execute(run, report)  # 6
    while (_failed(outcome) or still_open(run, report)) and tries < limit:  # 8
        while still_open(run, report) and tries < limit:  # 9
            report, tries = yield from _feedback(run, report, outcome, tries)  # 10 to 12
        if still_open(run, report):  # 14
            break  # 17
        if _failed(outcome) and tries < limit:  # 19
            report, tries = yield from _feedback(run, report, outcome, tries)  # 20 to 22
        if not still_open(run, report):  # 24
            outcome = yield from _execute(run, report)  # 25
    if _failed(outcome) or still_open(run, report) or outcome is None:
        # 14 to 16; an error that persists is asked about too, as the paper's text has it.
        report = yield from ask(run, report)
        if run.acting and _failed(outcome):
            report = yield from ask_what_now(run, run.acting, report)
        report = yield from set_aside(run, report)
        report = yield from _amend(run, report)
        if run.acting is None:
            return (yield from _rehearsed_and_kept(run, report))
        report = yield from _kept(run, report)
        outcome = (yield from _execute(run, report)) or outcome
    if run.acting is None or not run.acting.begun:
        return report, outcome
    report, outcome = yield from stop(run, run.acting, report)
    yield Executed(report, outcome)
    return report, outcome


def _feedback(
    run: Run, report: Report, outcome: Outcome | None, tries: int
) -> Generator[Turn, Any, tuple[Report, int]]:
    """Re-prompt with all findings of the last plan; check the new one."""
    error = outcome.error if outcome else None
    findings = (*still_open(run, report), *((error,) if error else ()))
    text = yield from propose(run, Propose(run.task, tries + 1, report.text, findings))
    return (yield from look_at(run, text)), tries + 1


def _execute(run: Run, report: Report) -> Generator[Turn, Any, Outcome | None]:
    """Execute a plan if it can be: on a copy of G_s, or in the world as far as it gets."""
    acting = run.acting
    if acting is None or not report.executable or acting.over:
        return (yield from _rehearse(run, report)) if acting is None else None
    if not acting.begun:
        yield from begin(run, acting)
    acting.at = 0
    yield from act(run, acting, report, heed=False)
    return Outcome((), failure(acting) if acting.left else None)


def _failed(outcome: Outcome | None) -> bool:
    return outcome is not None and outcome.error is not None


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
        same = run.policy == "tutor" and _keys(still_open(run, new)) == _keys(findings)
        report = new
        # the nearest to its goal
        best = min(best, report, key=lambda r: (not r.live, len(r.blocking), len(r.open)))
        if same:
            break
    if run.policy == "tutor" and best.text != report.text:
        report = yield from look_at(run, best.text)
    return report, tries


def _keys(findings: tuple[Finding, ...]) -> set[tuple[str, str]]:
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
    outcome = yield from _rehearse(run, report)
    size = kg.size()
    return Result(report, outcome, run.usage, sizes=(size, size))
