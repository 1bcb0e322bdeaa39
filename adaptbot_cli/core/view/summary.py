"""A result as one plain object: what `run --json` and `check --json` print."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from adaptbot_cli.core.ask.questions import ABSENT, LATER, NO, UNKNOWN, YES, Answer
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import STATES, local
from adaptbot_cli.core.plan import Change, Finding, Step, Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.world import named

Json = dict[str, Any]


def summary(
    result: Result,
    kg: Kg,
    planner: str,
    revisions: tuple[str | None, str | None],
    world: str = "",
) -> Json:
    """Return a result as an object of lists, strings and numbers; findings: docs/findings.md.

    `revisions` are the workspace's before and after the run, `world` names the world outside. The
    tasks of a request stand one after the other in it, the worst outcome for all, and each by
    itself in `runs`.
    """
    if result.runs:
        return _several(result, kg, planner, revisions, world)
    task, outside, outcome = result.report.task, result.outside, result.outcome
    missing = (*result.report.missing, *(outcome.missing if outcome else ()))
    return {
        "task": task.said or task.name or None,
        "domain": kg.domain.name,
        **({"robot": kg.domain.robot} if kg.domain.robot else {}),
        "planner": planner,
        "request": asked([task]),
        "outcome": result.verdict,
        "goal": {"met": result.goal_met, "missing": list(dict.fromkeys(missing))},
        "steps": [_step(n, step) for n, step in enumerate(result.report.steps, start=1)],
        "findings": [_finding(finding) for finding in findings(result)],
        "questions": [
            {"about": question.about, "kind": question.kind, "answer": _answer(answer)}
            for question, answer in result.questions
        ],
        "learned": learned(result, kg),
        "observed": [list(named(fact, kg)) for fact in (outside.observed if outside else ())],
        "world": None
        if outside is None
        else {"kind": world, "failed": outside.failed, "recovered": outside.recovered},
        "kg": {
            "before": revisions[0],
            "after": revisions[1],
            "nodes": [size[0] for size in result.sizes],
            "edges": [size[1] for size in result.sizes],
        },
        "usage": asdict(result.usage),
    }


def _several(
    result: Result, kg: Kg, planner: str, revisions: tuple[str | None, str | None], world: str
) -> Json:
    runs = [
        {**summary(run, kg, planner, revisions, world), "task": run.report.task.name}
        for run in result.runs
    ]
    tasks = [run.report.task for run in result.runs]
    whole = summary(replace(result, runs=()), kg, planner, revisions, world)
    missing = list(dict.fromkeys(name for run in runs for name in run["goal"]["missing"]))
    return {
        **whole,
        "task": tasks[0].said or "; then ".join(task.name for task in tasks),
        "request": asked(tasks),
        "outcome": result.verdict,
        "goal": {"met": result.goal_met, "missing": missing},
        "steps": _in_order("steps", runs),
        "findings": _in_order("findings", runs),
        "observed": [fact for run in runs for fact in run["observed"]],
        "world": _worlds(runs),
        "runs": runs,
    }


def _worlds(runs: Sequence[Json]) -> Json | None:
    """What the world did to all of several runs."""
    found = [run["world"] for run in runs if run["world"]]
    if not found:
        return None
    counts = {key: sum(world[key] for world in found) for key in ("failed", "recovered")}
    return {"kind": found[0]["kind"], **counts}


def _in_order(key: str, runs: Sequence[Json]) -> list[Json]:
    """The steps or findings of all runs, numbered through."""
    found, before = [], 0
    for run in runs:
        for each in run[key]:
            moved = dict(each)
            for number in ("n", "step"):
                if moved.get(number) is not None:
                    moved[number] += before
            if "steps" in moved:
                moved["steps"] = [number + before for number in moved["steps"]]
            found.append(moved)
        before += len(run["steps"])
    return found


def asked(tasks: Sequence[Task]) -> Json:
    """Return what was asked for: what was understood of the request, and what was not."""
    excluded = (n for t in tasks for n in (*t.excluded, *(rule.name for rule in t.rules)))
    amounts = [task.amount for task in tasks if task.amount > 1]
    return {
        "tasks": [task.name for task in tasks if task.name],
        "required": list(dict.fromkeys(name for task in tasks for name in task.required)),
        "excluded": list(dict.fromkeys(excluded)),
        "amount": amounts[0] if amounts else None,
        "unread": list(dict.fromkeys(phrase for task in tasks for phrase in task.unread)),
    }


def findings(result: Result) -> tuple[Finding, ...]:
    """Return every finding of a result: the plan's, and what the execution came to."""
    outcome = result.outcome
    if outcome is None:
        return result.report.findings
    last = (outcome.error,) if outcome.error else ()
    return tuple(dict.fromkeys((*result.report.findings, *last, *outcome.unmet)))


def _step(number: int, step: Step) -> Json:
    return {
        "n": number,
        "source": step.source,
        "call": [step.call.action, *step.call.args],
        "status": step.status,
        "codes": list(step.codes),
        "message": step.reason,
        "changes": [_change(change) for change in step.changes],
        "done": step.done,
    }


def _change(change: Change) -> Json:
    return {
        "from": change.source,
        "to": change.target,
        "by": change.by,
        "evidence": change.evidence,
        "approved": change.approved,
    }


def _finding(finding: Finding) -> Json:
    place = {"line": finding.line, "column": finding.column} if finding.line else {}
    return {
        "code": finding.code,
        "step": finding.step,
        "steps": list(finding.places),
        "subject": finding.subject,
        "message": finding.message,
        "candidates": list(finding.candidates),
        **({"remedy": finding.remedy} if finding.remedy else {}),
        **place,
    }


def _answer(answer: Answer) -> str | bool | None:
    plain: dict[str, str | bool | None] = {YES: True, NO: False, UNKNOWN: None}
    plain[LATER.value] = None
    return plain.get(answer.value, answer.value) if answer.value != ABSENT else ABSENT


def learned(result: Result, kg: Kg) -> list[list[str]]:
    """Return the facts of every lesson: subject, predicate, object, graph."""
    facts = [fact for lesson in result.lessons for fact in sorted(lesson.delta.added)]
    graphs = {True: "state", False: "attribute"}
    return [[local(s), local(p), local(o), graphs[kg.home_of(p) == STATES]] for s, p, o in facts]
