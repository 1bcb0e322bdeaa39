"""The state of a run, and how a plan's text is checked in it."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from adaptbot_cli.core.ask import teach
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import LATER, STOP, Answer, Key, Question
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import Triple, local
from adaptbot_cli.core.plan import Call, Finding, Parsed, Step, Task
from adaptbot_cli.core.refine.check import examine, names_to_look_up, words_to_look_up
from adaptbot_cli.core.refine.mend import with_remedies
from adaptbot_cli.core.report import GroundAction, Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Checked, LookUp, Proposal, Propose, Turn
from adaptbot_cli.core.usage import Usage
from adaptbot_cli.core.world import Acted, sentences

Policy = Literal["tutor", "paper"]
Confirm = Literal["none", "irreversible", "each"]
"""Which steps the person must confirm before the world carries them out."""

Plans = Literal["none", "changed", "any"]
"""Which plans the person is offered to keep: those that they changed, or any that met its goal in
the world too."""

MOST_SEEN = 12
"""How many surprises a prompt describes at most: the latest."""

MOST_BEFORE = 6
"""How many findings of earlier plans a prompt describes at most: the latest."""

Parse = Callable[[str], Parsed]


@dataclass(slots=True)
class Acting:
    """The state of an execution in a world.

    `before` are the calls that were carried out before this run, which goes on with another; `acts`
    the steps tried so far, `helps` how many there were each time that the person helped. `passed`
    are all steps so far with what they changed, those that were dropped too, and `at` is how many
    of the plan at hand are among them; `left` are the steps still to be done, as a plan's text.
    `changes` is what was done and seen, `surprises` what was seen otherwise than expected, `claims`
    what the world says that things are like; `over` is why no more can be done.
    """

    confirm: Confirm = "none"
    begun: bool = False
    before: list[Call] = field(default_factory=list)
    acts: list[Acted] = field(default_factory=list)
    helps: list[int] = field(default_factory=list)
    changes: list[Delta] = field(default_factory=list)
    left: str = ""
    passed: list[tuple[Step, GroundAction | None, Delta]] = field(default_factory=list)
    at: int = 0
    surprises: list[Delta] = field(default_factory=list)
    claims: set[Triple] = field(default_factory=set)
    over: str = ""

    @property
    def done(self) -> list[Call]:
        """The calls of the plan that were executed."""
        done = (act.step for act in self.acts if not act.failed)
        return [*self.before, *(step.call for step in done if step.status != "inserted")]


@dataclass(slots=True)
class Run:
    """A run as far as it has come. `full` has every attribute of a new thing asked, `offers` are
    the new things for which further questions were offered; `to_edit` is set when the person
    wants to change the plan instead of answering, `edits` lead from a plan's text to what the
    person has made of it, `objections` are the texts that the person has rejected; `kept` are the
    lessons that were committed, with the last `revision`, `once` those that hold in this run only;
    `went_back` is set when the person went back from the last review;
    `acting` is what has come of it in a world outside, None if the plan is only rehearsed;
    `reprompted` are the findings of earlier prompts; `recalled` is the plan that was kept
    for the task, if there was one."""

    kg: Kg
    task: Task
    parse: Parse
    scene: Scene
    policy: Policy = "tutor"
    full: bool = False
    usage: Usage = field(default_factory=Usage)
    asked: dict[Key, tuple[Question, Answer]] = field(default_factory=dict)
    lessons: list[Lesson] = field(default_factory=list)
    offers: set[str] = field(default_factory=set)
    stopped: bool = False
    to_edit: bool = False
    edits: dict[str, str] = field(default_factory=dict)
    objections: dict[str, Finding] = field(default_factory=dict)
    kept: list[Lesson] = field(default_factory=list)
    once: list[Lesson] = field(default_factory=list)
    revision: str | None = None
    went_back: bool = False
    acting: Acting | None = None
    reprompted: list[Finding] = field(default_factory=list)
    recalled: str = ""

    @property
    def answered(self) -> tuple[tuple[Question, Answer], ...]:
        """The questions the person may go back to: none once the robot has begun to act."""
        return () if self.acting and self.acting.begun else tuple(self.asked.values())

    def take(self, question: Question, answer: Answer) -> Answer:
        """Record an answer and return it; one that ends all questions is recorded as `LATER`."""
        self.stopped = self.stopped or answer.last or answer.value == STOP.value
        answer = LATER if answer.value == STOP.value else answer
        self.asked[question.key] = (question, answer)
        if answer.value != LATER.value:
            self.usage = replace(self.usage, questions=self.usage.questions + 1)
        return answer

    def seen(self, most: int, about: str = "") -> tuple[str, ...]:
        """Return what was seen otherwise than expected, in words, the last of it; of one thing, if
        `about` names one."""
        things = set(self.kg.find(about)) if about else set()
        found = [
            sentence
            for surprise in (self.acting.surprises if self.acting else ())
            for sentence in sentences(surprise, self.kg, things)
        ]
        return tuple(dict.fromkeys(found))[-most:]


def refuted_last(run: Run, question: Question) -> Question:
    """Return a question for a place with those last in which the thing was seen not to be."""
    things = set(run.kg.find(question.about))
    gone = {
        run.kg.name(value)
        for surprise in (run.acting.surprises if run.acting else ())
        for subject, predicate, value in surprise.removed
        if subject in things and local(predicate) == question.prop
    }
    if question.kind != "place" or not gone:
        return question
    choices = [
        replace(choice, then="seen: not there") if choice.value in gone else choice
        for choice in question.choices
    ]
    return replace(question, choices=tuple(sorted(choices, key=lambda c: c.value in gone)))


def look_at(run: Run, text: str, show: bool = True) -> Generator[Turn, Any, Report]:
    """Parse, check, refine and repair a plan's text; look up words that the KG does not know."""
    parsed = run.parse(text)
    calls = [written.call for written in parsed.calls]
    items, actions = words_to_look_up(calls, run.scene)
    domain = run.kg.domain
    for words, fields in ((items, domain.noun_fields), (actions, domain.verb_fields)):
        if words:
            found = yield LookUp(tuple(sorted(words)), fields)
            run.scene.known.update({word: found.get(word, ()) for word in words})
    back = names_to_look_up(items, run.scene)
    if back:
        found = yield LookUp(tuple(sorted(back)), domain.noun_fields)
        run.scene.known.update({word: found.get(word, ()) for word in back})
    report = with_remedies(examine(parsed, text, run.scene), run.scene)
    if text in run.objections:
        report = replace(report, findings=(*report.findings, run.objections[text]))
    if show:
        yield Checked(report)
    return report


def propose(run: Run, turn: Propose) -> Generator[Turn, Proposal, str]:
    """Have a plan proposed; return its text, or what the person has made of it before."""
    if run.acting is not None and run.acting.begun:
        done = tuple(call.render() for call in run.acting.done)
        turn = replace(turn, done=done, seen=run.seen(MOST_SEEN))
    before = dict.fromkeys(f for f in run.reprompted if f not in turn.findings)
    run.reprompted += turn.findings
    proposal = yield replace(turn, before=tuple(before)[-MOST_BEFORE:])
    run.recalled = proposal.text if proposal.source else run.recalled
    run.usage += proposal.usage
    return _unrepeated(run, as_edited(run, proposal.text))


def _unrepeated(run: Run, text: str) -> str:
    """Strip the executed steps from the head of a plan that repeats all of them, as models often
    do."""
    done = run.acting.done if run.acting else []
    parsed = run.parse(text)
    calls = [written.call for written in parsed.calls]
    if not done or parsed.findings or calls[: len(done)] != done:
        return text
    return "\n".join(call.render() for call in calls[len(done) :])


def as_edited(run: Run, text: str) -> str:
    """Return the text that the person's edits made of a plan."""
    while text in run.edits:
        text = run.edits[text]
    return text


def retract_all(run: Run) -> None:
    """Retract everything that a run has learned."""
    for lesson in reversed((*run.once, *run.lessons)):
        teach.retract(lesson, run.scene)
    run.lessons, run.once = [], []
