"""What the method asks of the world, and what the world answers: turns and replies.

The method (`tutor.pursue`) is a generator: it yields a turn and is sent the reply. Whoever drives
it performs each turn through a port below, so that a terminal, a script, a simulation and a
replay are the same thing to the method.
"""

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from adaptbot_cli.core.ask.edit import Edit
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Answer, Question, Reviewed
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Finding, Step, Task
from adaptbot_cli.core.report import GroundAction, Outcome, Report
from adaptbot_cli.core.request.understand import Reading
from adaptbot_cli.core.usage import Usage
from adaptbot_cli.core.world import Seen


@dataclass(frozen=True, slots=True)
class Understood:
    """Show how the request was read."""

    reading: Reading


@dataclass(frozen=True, slots=True)
class Propose:
    """Ask the planner for a plan. `findings` and `previous` are those of the last try, if any;
    `before` are findings of the tries before that; `done` the calls that were carried out already,
    and `seen` what was seen then, in words."""

    task: Task
    attempt: int = 0
    previous: str = ""
    findings: tuple[Finding, ...] = ()
    done: tuple[str, ...] = ()
    seen: tuple[str, ...] = ()
    before: tuple[Finding, ...] = ()


@dataclass(frozen=True, slots=True)
class Proposal:
    """The planner's text, as it came, and what it cost; `calls` counts the model's answers.

    `failure` says why there is no new text: then it is that of the last plan again. `reasoning` is
    what the model thought before it wrote the plan; `prompt` the style and the digest of the
    prompt; `source` where a plan comes from that was kept for the task.
    """

    text: str
    calls: int = 1
    prompt_tokens: int = 0
    completion_tokens: int = 0
    cost_usd: float | None = None
    failure: str = ""
    reasoning: str = ""
    prompt: str = ""
    source: str = ""

    @property
    def usage(self) -> Usage:
        """What it cost."""
        return Usage(self.calls, self.prompt_tokens, self.completion_tokens, self.cost_usd)


@dataclass(frozen=True, slots=True)
class LookUp:
    """Ask the lexicon about words, within word fields; verbs and nouns apart."""

    words: tuple[str, ...]
    fields: frozenset[str]


@dataclass(frozen=True, slots=True)
class Checked:
    """Show the report on the plan."""

    report: Report


@dataclass(frozen=True, slots=True)
class Ask:
    """Ask the person one question."""

    question: Question


@dataclass(frozen=True, slots=True)
class Amend:
    """Let the person change the plan, or reject it; the reply is an `Edit`, None to leave it.

    `why` is "asked" where the person has asked to, "open" where findings remain that no question
    solves, "ready" where the plan is about to be executed. `kg` has the names to write it with.
    """

    report: Report
    why: Literal["asked", "open", "ready"]
    kg: Kg


@dataclass(frozen=True, slots=True)
class Offer:
    """Offer the person the remaining questions of a class, which nothing needs now."""

    questions: tuple[Question, ...]


@dataclass(frozen=True, slots=True)
class Given:
    """Show that a question keeps the answer from before the person went back."""

    question: Question
    answer: Answer


@dataclass(frozen=True, slots=True)
class Trace:
    """Ask where facts come from: subject, predicate and object of each, in short."""

    facts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Learned:
    """Show what an answer taught."""

    lesson: Lesson


@dataclass(frozen=True, slots=True)
class Executed:
    """Show how far the plan came: on a copy of G_s, or in a world outside."""

    report: Report
    outcome: Outcome


@dataclass(frozen=True, slots=True)
class Begin:
    """Have the world outside make ready for a task; the reply is what is `Seen` at first."""

    task: Task


@dataclass(frozen=True, slots=True)
class Act:
    """Have a step carried out in the world outside; the reply is what is `Seen` then, None if the
    person has stopped the run before it.

    `number` counts the steps tried, from 1; `expected` is what it should change.
    """

    number: int
    step: Step
    ground: GroundAction
    expected: Delta


@dataclass(frozen=True, slots=True)
class Surprised:
    """Show that an observation differs from the expectation."""

    surprise: Delta


@dataclass(frozen=True, slots=True)
class Believe:
    """Have what was done and seen committed: `delta` is what it changes, `step` the step in words,
    "" before the first."""

    task: Task
    delta: Delta
    step: str


@dataclass(frozen=True, slots=True)
class Stop:
    """Stop the world, with the reason; the reply is what is `Seen` last."""

    task: Task
    why: str


@dataclass(frozen=True, slots=True)
class Review:
    """Show the person everything learned, before any of it is kept."""

    lessons: tuple[Lesson, ...]


@dataclass(frozen=True, slots=True)
class Keep:
    """Have what was learned committed, with where it came from."""

    task: Task
    lessons: tuple[Lesson, ...]


@dataclass(frozen=True, slots=True)
class Kept:
    """The revision that holds what was learned, if the store has revisions."""

    revision: str | None


Turn = (
    Understood
    | Propose
    | LookUp
    | Checked
    | Ask
    | Amend
    | Offer
    | Given
    | Trace
    | Learned
    | Executed
    | Begin
    | Act
    | Surprised
    | Believe
    | Stop
    | Review
    | Keep
)


class Planner(Protocol):
    """Proposes generic plans: a model, the plan library or a transcript."""

    @property
    def name(self) -> str:
        """How the planner is called on the screen and in a commit."""
        ...

    def propose(self, turn: Propose) -> Proposal:
        """Return a plan's text. Raises ModelError."""
        ...


class Human(Protocol):
    """The person at the terminal, or what stands for one."""

    def ask(self, question: Question) -> Answer:
        """Return the answer, `LATER` if there is none."""
        ...

    def review(self, lessons: tuple[Lesson, ...]) -> bool | Reviewed:
        """Tell whether what was learned may be kept, which part of it, or what to correct."""
        ...


@runtime_checkable
class Volunteer(Protocol):
    """A human who may answer more than what is needed."""

    def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
        """Return an answer for each question, `LATER` where there is none."""
        ...


@runtime_checkable
class Editor(Protocol):
    """A human who may change a plan."""

    def amend(self, turn: Amend) -> Edit | None:
        """Return a change of the plan, None to leave it as it is."""
        ...


@runtime_checkable
class Source(Protocol):
    """A store that knows where its facts come from."""

    def trace(self, fact: str) -> str:
        """Return in words where a fact comes from, "" if that is not known."""
        ...


class World(Protocol):
    """What carries a plan out, and may disagree: a simulated home, a simulator, a robot."""

    def begin(self, turn: Begin) -> Seen:
        """Make ready; return what is seen at first. Raises WorldError."""
        ...

    def act(self, turn: Act) -> Seen:
        """Try one step; return what came of it. Whatever goes wrong is a failed step."""
        ...

    def stop(self, turn: Stop) -> Seen:
        """End; return what is seen last, and whether the goal is met if the world can tell."""
        ...


class Store(Protocol):
    """Keeps what was learned."""

    def keep(self, turn: Keep) -> Kept:
        """Commit lessons. Raises KnowledgeError, changing nothing."""
        ...

    def believe(self, turn: Believe) -> Kept:
        """Commit what was done and seen. Raises KnowledgeError, changing nothing."""
        ...


class Observer(Protocol):
    """Sees every turn with its reply: a screen, a transcript."""

    def asked(self, turn: Turn) -> None:
        """See a turn before it is performed."""
        ...

    def replied(self, turn: Turn, reply: object) -> None:
        """See a turn with the reply that it got."""
        ...
