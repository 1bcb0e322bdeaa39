"""The report on a plan, the outcome of its execution, and the result of a run."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from rdflib.term import Node

from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Answer, Question
from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.findings import blocks, is_open
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.plan import Finding, Step, Task, Written
from adaptbot_cli.core.usage import Usage


@dataclass(frozen=True, slots=True)
class GroundAction:
    """A ground action: an action with a term for every parameter."""

    action: Action
    values: Mapping[str, Node]


@dataclass(frozen=True, slots=True)
class Report:
    """A plan after parse, check, refine and repair.

    `grounded` and `deltas` go with `steps` one to one: each step's ground action (None if it is
    dropped or cannot be understood) and what it changed in the rehearsal. `written` are the calls
    that the text writes.
    """

    task: Task
    text: str
    steps: tuple[Step, ...]
    findings: tuple[Finding, ...]
    grounded: tuple[GroundAction | None, ...] = ()
    deltas: tuple[Delta, ...] = ()
    missing: tuple[str, ...] = ()
    written: tuple[Written, ...] = ()

    @property
    def blocking(self) -> tuple[Finding, ...]:
        """The findings that make the plan not executable."""
        return tuple(f for f in self.findings if blocks(f))

    @property
    def open(self) -> tuple[Finding, ...]:
        """The findings that a better plan or more knowledge would resolve."""
        return tuple(f for f in self.findings if is_open(f))

    @property
    def executable(self) -> bool:
        """Whether no finding blocks the plan."""
        return bool(self.live) and not self.blocking

    @property
    def live(self) -> tuple[Step, ...]:
        """The steps that are to be executed."""
        return tuple(step for step in self.steps if step.status not in ("dropped", "finding"))


@dataclass(frozen=True, slots=True)
class Outcome:
    """How far an execution got: each executed step's delta, and what stopped it, if anything."""

    deltas: tuple[Delta, ...]
    error: Finding | None = None
    unmet: tuple[Finding, ...] = ()
    missing: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Outside:
    """What a world outside did to a plan: how many steps `failed`, how many of those the tutor
    `recovered` from without the person, and the facts that were `observed` against expectation;
    `delta` is all that changed in what is believed, `surprise` the part that was not expected."""

    failed: int = 0
    recovered: int = 0
    observed: tuple[Triple, ...] = ()
    delta: Delta = field(default=Delta())
    surprise: Delta = field(default=Delta())


@dataclass(frozen=True, slots=True)
class Result:
    """The result of a run; for a request of several tasks, `runs` has one result each."""

    report: Report
    outcome: Outcome | None
    usage: Usage
    questions: tuple[tuple[Question, Answer], ...] = ()
    lessons: tuple[Lesson, ...] = ()
    revision: str | None = None
    sizes: tuple[tuple[int, int], tuple[int, int]] = field(default=((0, 0), (0, 0)))
    runs: tuple["Result", ...] = ()
    outside: Outside | None = None

    @property
    def verdict(self) -> str:
        """One of "executable", "findings" and "no_plan"; the worst of several tasks."""
        if self.runs:
            order = ("no_plan", "findings", "executable")
            return min((run.verdict for run in self.runs), key=order.index)
        if not self.report.steps:
            return "no_plan"
        done = self.outcome is not None and self.outcome.error is None
        return "executable" if done and self.report.executable else "findings"

    @property
    def goal_met(self) -> bool:
        """Whether the plan was executed to its end and what the task needs then holds."""
        if self.runs:
            return all(run.goal_met for run in self.runs)
        outcome = self.outcome
        return (
            self.verdict == "executable"
            and not self.report.open
            and (outcome is None or not outcome.unmet)
        )
