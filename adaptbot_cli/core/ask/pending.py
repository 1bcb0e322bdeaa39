"""The questions that runs have left open, answered in one sitting (DESIGN, 6).

What is open is never kept in a list of its own: it is what the plans that wait need to know of the
graph as it is now. So an answer that has come some other way is not asked for again.
"""

from collections.abc import Generator, Iterable, Sequence, Set
from dataclasses import dataclass, field, replace
from typing import Any

from adaptbot_cli.core.ask import agenda
from adaptbot_cli.core.ask.amend import set_aside
from adaptbot_cli.core.ask.dialogue import ask_about, keep
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import EDIT, INSTEAD, LATER, UNKNOWN, Answer, Key, Question
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.journal import GoBack, Journal
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Step, Task
from adaptbot_cli.core.refine.goals import rehearsed
from adaptbot_cli.core.report import Outcome, Report, Result
from adaptbot_cli.core.run import Parse, Run, look_at, retract_all
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Executed, Turn


@dataclass(frozen=True, slots=True)
class Waiting:
    """A task whose last run has left questions open: its plan, and what nobody could answer."""

    task: Task
    plan: str
    unknown: Set[Key] = frozenset()


@dataclass(frozen=True, slots=True)
class Pending:
    """An open question, the tasks that wait for its answer, and how many of their steps do."""

    question: Question
    tasks: tuple[str, ...]
    steps: int


@dataclass(frozen=True, slots=True)
class Sitting:
    """What came of answering: what was learned, what is still open, what each task is worth now."""

    lessons: tuple[Lesson, ...]
    answered: int
    revision: str | None
    still: tuple[Pending, ...]
    results: tuple[Result, ...]


@dataclass(slots=True)
class _Plan:
    """A plan that waits, as it is looked at now."""

    run: Run
    report: Report
    unknown: Set[Key]

    @property
    def open(self) -> list[Question]:
        """What the plan needs an answer to, but for what nobody could say."""
        found = agenda.all_open(self.report, self.run.scene, self.run.asked)
        return [question for question in found if question.key not in self.unknown]


def listed(waiting: Sequence[Waiting], kg: Kg, parse: Parse) -> Generator[Turn, Any, list[Pending]]:
    """Return the questions that are open now, the most useful first."""
    plans = yield from _plans(waiting, _Shared(kg, parse))
    return _ranked(plans)


def sitting(waiting: Sequence[Waiting], kg: Kg, parse: Parse) -> Generator[Turn, Any, Sitting]:
    """Ask what is open, the most useful first; have it reviewed and kept; look at the tasks again.

    The person may go back to an earlier question, and may stop: what was answered by then counts.
    """
    journal = Journal()
    while True:
        shared = _Shared(kg, parse)
        try:
            return (yield from journal.play(_sitting(waiting, shared)))
        except GoBack as back:
            retract_all(shared.run(Task("")))
            journal.reopen(back.to)


@dataclass(slots=True)
class _Shared:
    """What the plans of one sitting have in common: what was asked and learned in it."""

    kg: Kg
    parse: Parse
    asked: dict[Key, tuple[Question, Answer]] = field(default_factory=dict)
    lessons: list[Lesson] = field(default_factory=list)
    offers: set[str] = field(default_factory=set)

    def run(self, task: Task) -> Run:
        run = Run(self.kg, task, self.parse, Scene(self.kg, task))
        run.asked, run.lessons, run.offers = self.asked, self.lessons, self.offers
        return run


def _plans(waiting: Iterable[Waiting], shared: _Shared) -> Generator[Turn, Any, list[_Plan]]:
    plans = []
    for each in waiting:
        run = shared.run(each.task)
        report = yield from look_at(run, each.plan, show=False)
        plans.append(_Plan(run, report, each.unknown))
    return plans


def _ranked(plans: Iterable[_Plan]) -> list[Pending]:
    """The open questions: those first that more tasks and then more steps wait for."""
    found: dict[Key, list[tuple[Question, _Plan]]] = {}
    for plan in plans:
        for question in plan.open:
            found.setdefault(question.key, []).append((question, plan))
    pending = [
        Pending(
            _ready(asked[0][0], tuple(plan.run.task.name for _, plan in asked)),
            tuple(plan.run.task.name for _, plan in asked),
            sum(_waits(step, question) for question, plan in asked for step in plan.report.steps),
        )
        for asked in found.values()
    ]
    return sorted(pending, key=lambda each: (-len(each.tasks), -each.steps))


def _waits(step: Step, question: Question) -> bool:
    """Whether a step waits for an answer about an action or thing that it names."""
    names = [step.call.action] if question.subject == "action" else step.call.args
    return step.status == "finding" and question.about in map(normal, names)


def _ready(question: Question, tasks: Sequence[str]) -> Question:
    """A question as it is asked where several tasks wait, and no plan is at hand to be changed."""
    choices = tuple(choice for choice in question.choices if choice.value not in (EDIT, INSTEAD))
    waiting = f"waiting for the answer: {'; '.join(tasks)}"
    return replace(question, choices=choices, notes=(waiting,))


def _sitting(waiting: Sequence[Waiting], shared: _Shared) -> Generator[Turn, Any, Sitting]:
    plans = yield from _plans(waiting, shared)
    stopped = False
    while not stopped and (ranked := _ranked(plans)):
        first = ranked[0].question
        asker = next(p for p in plans if first.key in {q.key for q in p.open})
        known = len(shared.lessons)
        yield from ask_about(asker.run, asker.report, first)
        stopped = asker.run.stopped
        for plan in plans if len(shared.lessons) > known else ():
            plan.report = yield from look_at(plan.run, plan.report.text, show=False)
    names = dict.fromkeys(plan.run.task.name for plan in plans)
    keeper = shared.run(Task(", ".join(names)))
    yield from keep(keeper)
    shared.lessons = keeper.kept
    answered = sum(answer.value != LATER.value for _, answer in shared.asked.values())
    unknown = {key for key, (_, answer) in shared.asked.items() if answer.value == UNKNOWN}
    shared.asked.clear()
    results = []
    for plan in plans:
        plan.unknown = plan.unknown | unknown
        plan.run.lessons = shared.lessons
        results.append((yield from _judged(plan)))
    lessons = tuple(shared.lessons)
    return Sitting(lessons, answered, keeper.revision, tuple(_ranked(plans)), tuple(results))


def _judged(plan: _Plan) -> Generator[Turn, Any, Result]:
    """What a plan is worth now, as a run would see it with nobody to ask."""
    plan.report = yield from look_at(plan.run, plan.report.text, show=False)
    report = yield from set_aside(plan.run, plan.report)
    outcome: Outcome | None = None
    if report.executable:
        outcome = rehearsed(report, plan.run.kg)
        yield Executed(report, outcome)
    return Result(report, outcome, plan.run.usage)
