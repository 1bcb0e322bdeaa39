"""What is known from the transcript of an interrupted run, for the run that resumes it."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from adaptbot_cli.adapters.transcript.documents import (
    Document,
    answer_of,
    edit_of,
    finding_text,
    key_of,
)
from adaptbot_cli.core.ask.edit import EDITS, Edit
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import (
    AS_BEFORE,
    KINDS,
    LATER,
    STOP,
    YES,
    Answer,
    Key,
    Question,
    Reviewed,
    Suggestion,
    fits,
)
from adaptbot_cli.core.turns import Amend, Editor, Human, Planner, Proposal, Propose, Volunteer

Prompt = tuple[str, int, tuple[str, ...]]


@dataclass(slots=True)
class Memory:
    """The plans, the answers and the edits of a run: by prompt, by question, by text of the plan.

    `plan` is the last one that was looked at: one that was `proposed` may have been refused;
    `reopened` are the answers that the person went back from. In a world outside, `done` are the
    calls that were executed for the last task, `over` the tasks that came to their end before, with
    what they came to, and `left` is the rest of the plan, by task, of the steps `checked`.
    """

    proposals: dict[Prompt, Proposal] = field(default_factory=dict)
    answers: dict[Key, Answer] = field(default_factory=dict)
    reopened: dict[Key, Answer] = field(default_factory=dict)
    offers: set[str] = field(default_factory=set)
    edits: dict[str, list[Edit]] = field(default_factory=dict)
    plans: dict[str, str] = field(default_factory=dict)
    done: list[str] = field(default_factory=list)
    over: list[tuple[str, str]] = field(default_factory=list)
    left: dict[str, str] = field(default_factory=dict)
    checked: list[str] = field(default_factory=list)
    task: str = ""
    proposed: str = ""
    plan: str = ""

    def take(self, documents: Iterable[Document]) -> None:
        """Add the documents of a run; later answers replace earlier ones."""
        ended = ""
        since: set[Key] | None = None
        for document in documents:
            match document["turn"]:
                case "begin":
                    since = set(self.answers)
                case "keep" if since is not None:
                    # What was answered while the robot acted is in the graph, and may have been
                    # seen to be otherwise since.
                    for key in self.answers.keys() - since:
                        del self.answers[key]
                case "stop":
                    since = None
                    ended = str(document.get("why", "")) or "stopped"
                case "propose" if isinstance(document.get("reply"), str):
                    if ended:
                        self.over.append((self.task, ended))
                        self.done, ended = [], ""
                    self.task = str(document.get("task", ""))
                    found = document.get("findings")
                    findings = tuple(map(str, found)) if isinstance(found, list) else ()
                    prompt = (self.task, int(document.get("attempt", 0)), findings)
                    self.proposed, source = document["reply"], str(document.get("source", ""))
                    self.proposals[prompt] = Proposal(self.proposed, calls=0, source=source)
                case "checked":
                    self.checked = list(map(str, document.get("steps") or ()))
                    self.plan = self.plans[self.task] = self.proposed
                case "edit" if document.get("edit") in EDITS:
                    self.edits.setdefault(self.plan, []).append(edit_of(document))
                    self.proposed = str(document.get("plan", self.plan))
                case "ask":
                    self._take_answer(document)
                case "offer":
                    self._take_offer(document)
                case "act" if not document.get("failed"):
                    self._take_step(str(document.get("does", "")))
                case "review":
                    self._reopen(key_of(document.get("back")))

    def _take_step(self, call: str) -> None:
        """What was done is not to be done again: what is left of the plan is the plan now."""
        self.done.append(call)
        steps = [step.partition(": ")[::2] for step in self.checked]
        at = next((n for n, step in enumerate(steps, 1) if step[1] == call), 0)
        self.checked = self.checked[at:]
        kept = (text for status, text in steps[at:] if status not in ("inserted", "dropped"))
        self.left[self.task] = "\n".join(kept)

    def _take_answer(self, document: Document) -> None:
        key, answer = key_of(document), answer_of(document)
        if answer.value == "back":
            self._reopen(key_of(document.get("to")))
        elif key is not None and answer.value not in (LATER.value, STOP.value):
            self.answers[key] = answer
            if key[0] == "mend" and answer.value == YES and key[2]:
                self.proposed = key[2]

    def _take_offer(self, document: Document) -> None:
        about, back = str(document.get("about", "")), key_of(document.get("back"))
        self._reopen(back)
        if back is None:
            self.offers.add(about)
            for prop in document.get("answers") or {}:
                for kind in (kind for kind, spec in KINDS.items() if spec.together):
                    self.answers[(kind, about, str(prop), "item")] = answer_of(document, prop)

    def _reopen(self, key: Key | None) -> None:
        if key is not None and key in self.answers:
            self.reopened[key] = self.answers.pop(key)
            self.offers.discard(key[1])

    def likely(self, question: Question) -> Question:
        """Return a question with its earlier answer as the likely one: from now on the person
        is the one to give it, as for all lines of a form that is shown."""
        if question.offered:
            self.offers.discard(question.about)
        together, offered = (
            tuple(map(self.likely, each)) for each in (question.together, question.offered)
        )
        question = replace(question, together=together, offered=offered)
        before = self.answers.pop(question.key, None) or self.reopened.pop(question.key, None)
        if question.given or before is None or not fits(question, before):
            return question
        return replace(question, suggested=Suggestion(before.value, AS_BEFORE))


@dataclass(frozen=True, slots=True)
class RememberingPlanner:
    """Returns the plans of the interrupted run, and asks for others."""

    memory: Memory
    planner: Planner

    @property
    def name(self) -> str:
        """The planner's own name."""
        return self.planner.name

    def propose(self, turn: Propose) -> Proposal:
        """Return the plan that the same prompt was answered with. Raises ModelError."""
        left = self.memory.left.pop(turn.task.name, "")
        if left and not turn.attempt:
            return Proposal(left, calls=0)
        entries = turn.attempt, tuple(finding_text(finding) for finding in turn.findings)
        prompts = ((turn.task.name, *entries), ("", *entries))  # a transcript may lack the task
        found = (self.memory.proposals.pop(prompt, None) for prompt in prompts)
        known = next(filter(None, found), None)
        return self.planner.propose(turn) if known is None else known


@dataclass(frozen=True, slots=True)
class RememberingHuman:
    """Returns the answers of the interrupted run, each once, and asks for others."""

    memory: Memory
    human: Human

    def ask(self, question: Question) -> Answer:
        """Return the answer that the question had, if it is still possible."""
        known = self.memory.answers.pop(question.key, None)
        if known is not None and fits(question, known):
            return known
        answer = self.human.ask(self.memory.likely(question))
        self._forget(answer.to)
        return answer

    def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
        """Return the earlier answers to an offer, if it was made before."""
        if questions and questions[0].about in self.memory.offers:
            self.memory.offers.discard(questions[0].about)
            return tuple(self.memory.answers.pop(question.key, LATER) for question in questions)
        if not isinstance(self.human, Volunteer):
            return (LATER,) * len(questions)
        found = self.human.offer(tuple(map(self.memory.likely, questions)))
        for answer in found:
            self._forget(answer.to)
        return found

    def amend(self, turn: Amend) -> Edit | None:
        """Return the edit that this plan had; ask for further ones."""
        known = self.memory.edits.get(turn.report.text)
        if known:
            return known.pop(0)
        return self.human.amend(turn) if isinstance(self.human, Editor) else None

    def review(self, lessons: tuple[Lesson, ...]) -> bool | Reviewed:
        """Ask: a review is only over with the run."""
        reply = self.human.review(lessons)
        if isinstance(reply, Reviewed):
            self._forget(reply.back)
        return reply

    def _forget(self, key: Key | None) -> None:
        """Leave a question that the person goes back to for the person to answer."""
        if key is not None:
            self.memory.answers.pop(key, None)
