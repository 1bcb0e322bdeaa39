"""The screen of a run: one observer of its turns."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from rich.console import Console, Group, RenderableType
from rich.measure import Measurement
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.display.cells import (
    BAD,
    GOOD,
    PASSING,
    WARNING,
    Mark,
    cell,
    count,
    hanging,
    joined,
    noted,
)
from adaptbot_cli.adapters.display.diff import diff_table
from adaptbot_cli.adapters.display.plan_table import plan_table, summary
from adaptbot_cli.core.ask.edit import Edit
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.report import Outcome, Report, Result
from adaptbot_cli.core.turns import (
    Act,
    Amend,
    Ask,
    Begin,
    Checked,
    Executed,
    Learned,
    Proposal,
    Propose,
    Review,
    Stop,
    Surprised,
    Turn,
    Understood,
)
from adaptbot_cli.core.usage import Usage
from adaptbot_cli.core.world import Seen, sentences

WIDE = 110
"""From how many columns on the plan and the changes stand side by side, if no value must wrap."""

_BETWEEN = 4
_MOST_FOR_CHANGES = 0.48


@dataclass(slots=True)
class Screen:
    """Shows a run as it goes: a line for each event, the plan before questions and at the end.

    With `asks` False no question appears on this terminal, and the plan is shown at the end only.
    With `edits` it is shown before it is executed, to be edited. `world` names the world outside,
    `how` what must be known of it.
    """

    console: Console
    kg: Kg
    asks: bool = True
    edits: bool = False
    world: str = ""
    how: str = ""
    _report: Report | None = field(default=None, init=False)
    _shown: Report | None = field(default=None, init=False)
    _last: Text | None = field(default=None, init=False)
    _kept: bool = field(default=False, init=False)

    def asked(self, turn: Turn) -> None:
        """Show what must be seen before a turn is performed."""
        if isinstance(turn, Propose) and turn.attempt:
            open_ = count(len({(f.code, f.message) for f in turn.findings}), "finding")
            if self._kept and turn.findings:
                why = turn.findings[0].message
                self._note(WARNING, f"the kept plan does not fit as it is: {why}")
                self._kept = False
            self._note(PASSING, f"asking for another plan: {open_} still open")
        edits = isinstance(turn, Amend) and (turn.why != "ready" or self.edits)
        if (isinstance(turn, Ask) or edits) and self.asks:
            self._plan_once(isinstance(turn, Ask) and turn.question.kind == "plan")
        if (isinstance(turn, Ask | Review) or edits) and self.asks:
            self._gap()

    def replied(self, turn: Turn, reply: object) -> None:
        """Show what came of a turn."""
        if isinstance(turn, Understood):
            doubtful = turn.reading.doubts or not turn.reading.tasks
            self._note(WARNING if doubtful else PASSING, f"understood: {turn.reading.line}")
        elif isinstance(turn, Checked):
            self._report = turn.report
            mark = PASSING if turn.report.executable else WARNING
            self._note(mark, f"checked: {summary(turn.report)}")
        elif isinstance(reply, Proposal) and reply.failure:
            self._note(WARNING, reply.failure)
        elif isinstance(reply, Proposal) and reply.source:
            self._kept = True
            self._note(PASSING, f"the plan that is kept for this task ({reply.source})")
        elif isinstance(turn, Learned):
            self._note(GOOD, f"noted: {turn.lesson.sentence}")
        elif isinstance(turn, Executed):
            self._note(*_execution(turn))
        elif isinstance(turn, Begin):
            self._gap()
            how = cell(f" ({self.how})" if self.how else "", "dim")
            self.console.print(cell(f"acting in {self.world}", "bold") + how)
            self._last = None
            self._odd(reply)
        elif isinstance(turn, Act) and isinstance(reply, Seen):
            call = f"{turn.number:>2} {turn.step.call.render()}"
            text = f"{call}: {reply.failed}" if reply.failed else call
            self._note(BAD if reply.failed else GOOD, text)
            self._odd(reply)
        elif isinstance(turn, Stop):
            self._odd(reply)
        elif isinstance(turn, Surprised):
            for sentence in sentences(turn.surprise, self.kg):
                self._note(WARNING, f"seen: {sentence}")
        elif isinstance(turn, Review) and reply is False:
            self._note(WARNING, "not kept: the plan is looked at again without what was taught")
        elif self.asks and (isinstance(turn, Ask | Review) or isinstance(reply, Edit)):
            self._last = None  # the question and its answer stand there now

    def finish(self, result: Result, committed: str | None) -> None:
        """Show the final plan, what the run changes, and what it came to.

        `committed` is the revision that holds what was learned, if it was committed.
        """
        for run in result.runs or (result,):
            self._gap()
            if result.runs:
                self.console.print(cell(run.report.task.name, "bold"))
            self.console.print(_both(run, self.kg, self.console))
            self.console.print()
            self.console.print(noted(*verdict(run), "bold"))
            self._last = None
        self.console.print(_sizes(result, committed))
        if result.usage != Usage():
            self.console.print(_cost(result.usage))

    def _plan_once(self, whole: bool) -> None:
        """Show the plan, unless its text has been shown before: each answer changes it a little.
        Where it is asked about as a `whole` it is shown if any of it has changed."""
        report, shown = self._report, self._shown
        if report is None:
            return
        if shown and (report.steps == shown.steps if whole else report.text == shown.text):
            return
        self._shown = report
        self._gap()
        self.console.print(plan_table(report, self.console.width))
        self._last = None

    def _gap(self) -> None:
        """Leave a line blank, one only however many parts of the screen ask for it."""
        if self._last != Text():
            self.console.print()
        self._last = Text()

    def _odd(self, seen: object) -> None:
        for sentence in seen.odd if isinstance(seen, Seen) else ():
            self._note(WARNING, f"left out of the world's answer: {sentence}")

    def _note(self, mark: Mark, text: str) -> None:
        """Print a line, unless it repeats the line before."""
        line = noted(mark, text, "dim" if mark is PASSING else "")
        if line != self._last:
            self.console.print(hanging(line))
        self._last = line


def _execution(turn: Executed) -> tuple[Mark, str]:
    """Return how far a plan came, in words, with its mark."""
    outcome, where = turn.outcome, "rehearsed on a copy of the state"
    if any(step.done for step in turn.report.steps):
        where = "carried out"
    if outcome.error is not None:
        step = f" at step {outcome.error.step}" if outcome.error.step is not None else ""
        return BAD, f"execution stopped{step}: {outcome.error.message}"
    if outcome.unmet:
        unmet = count(len(outcome.unmet), "condition")
        return WARNING, f"{where}: the goal is not met ({unmet})"
    return GOOD, f"{where}: goal met"


def _both(result: Result, kg: Kg, console: Console) -> RenderableType:
    """The plan and the changes: side by side where both have room, else stacked."""
    width = console.width
    report, outcome = result.report, result.outcome
    also = _after(outcome)
    deltas = outcome.deltas if outcome is not None else None
    seen: frozenset[Triple] = frozenset()
    if result.outside is not None:
        whole, learned = result.outside.delta, net(lesson.delta for lesson in result.lessons)
        deltas = (Delta(whole.removed - learned.added, whole.added - learned.removed),)
        seen = result.outside.surprise.removed | result.outside.surprise.added

    def changes(columns: int) -> RenderableType:
        return diff_table(result.lessons, deltas, kg, columns, result.report.task.required, seen)

    right_width = Measurement.get(console, console.options, changes(width)).maximum
    if width < WIDE or right_width > width * _MOST_FOR_CHANGES:
        return Group(plan_table(report, width, also), Text(), changes(width))
    right = changes(right_width)
    left_width = width - right_width - _BETWEEN
    table = Table.grid(padding=(0, _BETWEEN, 0, 0), pad_edge=False)
    for width in (left_width, right_width):
        table.add_column(width=width)
    table.add_row(plan_table(report, left_width, also), right)
    return table


def _after(outcome: Outcome | None) -> tuple[Finding, ...]:
    """The findings that came with the execution."""
    if outcome is None:
        return ()
    return (*((outcome.error,) if outcome.error else ()), *outcome.unmet)


def verdict(result: Result) -> tuple[Mark, str]:
    """Return what a run came to, in words, with its mark."""
    outcome = result.outcome
    if result.verdict == "no_plan":
        return BAD, "no plan: no step could be read from the text"
    if result.goal_met:
        task = result.report.task
        how = f" (that of {task.judged_by})" if task.judged_by and not task.known else ""
        return GOOD, f"executable, goal met{how}"
    if result.verdict != "executable":
        return BAD, f"not executable: {_lacking(result)}"
    if {f.code for f in (*result.report.open, *_after(outcome))} == {"W606"}:
        return BAD, "executable; no goal is known for this task"
    return BAD, f"executable, but the goal is not met: {_lacking(result)}"


def _lacking(result: Result) -> str:
    """What stands against a plan: the sentence if there is one, else how many; what is missing."""
    outcome = result.outcome
    open_ = dict.fromkeys(f.message for f in (*result.report.open, *_after(outcome)))
    text = next(iter(open_)) if len(open_) == 1 else f"{count(len(open_), 'finding')} open"
    missing = dict.fromkeys((*result.report.missing, *(outcome.missing if outcome else ())))
    return f"{text}; missing: {sentence_list([*missing])}" if missing else text


def kept(lessons: Sequence[Lesson], revision: str | None) -> str:
    """Return how many lessons were learned, and which revision holds them."""
    where = f"committed as {revision[:7]}" if revision else "not committed"
    return f"{count(len(lessons), 'lesson')} {where}" if lessons else "nothing learned"


def _sizes(result: Result, committed: str | None) -> RenderableType:
    before, after = result.sizes
    parts = [f"graph: {after[0]} nodes, {after[1]} edges"]
    if before != after:
        parts = [f"graph: {before[0]} → {after[0]} nodes, {before[1]} → {after[1]} edges"]
    parts.append(kept(result.lessons, committed))
    if result.outside is not None and result.outside.delta:
        changed = len(result.outside.delta.removed) + len(result.outside.delta.added)
        parts.append(f"{count(changed, 'fact')} of the state kept as the world left them")
    return Padding(joined(parts), (0, 0, 0, 2))


def _cost(usage: Usage) -> RenderableType:
    parts = []
    if usage.model_calls:
        price = "price not known" if usage.cost_usd is None else f"${usage.cost_usd:.4f}"
        parts.append(count(usage.model_calls, "answer"))
        parts.append(f"{usage.prompt_tokens} prompt + {usage.completion_tokens} completion tokens")
        parts.append("no cost" if usage.cost_usd == 0 else price)
    if usage.questions:
        parts.append(f"{count(usage.questions, 'question')} answered")
    return Padding(joined(parts), (0, 0, 0, 2))
