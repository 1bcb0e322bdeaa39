"""A result as one plain object: what `run --json` and `check --json` print."""

from typing import Any

from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.plan import Change, Finding, Step
from adaptbot_cli.core.questions import ABSENT, LATER, NO, UNKNOWN, YES, Answer
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.terms import STATES, local

Json = dict[str, Any]


def summary(result: Result, kg: Kg, planner: str, revisions: tuple[str | None, str | None]) -> Json:
    """Return a result as an object of lists, strings and numbers; findings: docs/findings.md.

    `revisions` are the workspace's before and after the run.
    """
    task = result.report.task
    return {
        "task": task.name or None,
        "domain": kg.domain.name,
        "planner": planner,
        "outcome": result.verdict,
        "goal": {"met": result.goal_met, "missing": list(_missing(result))},
        "steps": [_step(n, step) for n, step in enumerate(result.report.steps, start=1)],
        "findings": [_finding(finding) for finding in findings(result)],
        "questions": [
            {"about": question.about, "kind": question.kind, "answer": _answer(answer)}
            for question, answer in result.questions
        ],
        "learned": learned(result, kg),
        "kg": {
            "before": revisions[0],
            "after": revisions[1],
            "nodes": [size[0] for size in result.sizes],
            "edges": [size[1] for size in result.sizes],
        },
        "usage": {
            "model_calls": result.usage.model_calls,
            "prompt_tokens": result.usage.prompt_tokens,
            "completion_tokens": result.usage.completion_tokens,
            "cost_usd": result.usage.cost_usd,
            "questions": result.usage.questions,
        },
    }


def findings(result: Result) -> tuple[Finding, ...]:
    """Return every finding of a result: the plan's, and what the execution came to."""
    outcome = result.outcome
    if outcome is None:
        return result.report.findings
    last = (outcome.error,) if outcome.error else ()
    return tuple(dict.fromkeys((*result.report.findings, *last, *outcome.unmet)))


def _missing(result: Result) -> tuple[str, ...]:
    outcome = result.outcome
    return tuple(dict.fromkeys((*result.report.missing, *(outcome.missing if outcome else ()))))


def _step(number: int, step: Step) -> Json:
    return {
        "n": number,
        "source": step.source,
        "call": [step.call.action, *step.call.args],
        "status": step.status,
        "codes": list(step.codes),
        "message": step.reason,
        "changes": [_change(change) for change in step.changes],
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
