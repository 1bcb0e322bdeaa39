"""What a transcript remembers of a run that was cut off, for the run that goes on with it."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from adaptbot_cli.adapters.transcript.documents import Document, finding_text, key_of, said
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.questions import LATER, STOP, Answer, Key, Question, Reviewed, fits
from adaptbot_cli.core.turns import Human, Planner, Proposal, Propose, Volunteer

Prompt = tuple[int, tuple[str, ...]]


@dataclass(slots=True)
class Memory:
    """The plans and the answers of a run: by prompt, by question."""

    proposals: dict[Prompt, Proposal] = field(default_factory=dict)
    answers: dict[Key, Answer] = field(default_factory=dict)
    offers: set[str] = field(default_factory=set)

    def take(self, documents: Iterable[Document]) -> None:
        """Add what a run's documents tell; later answers go before earlier ones."""
        for document in documents:
            match document["turn"]:
                case "propose" if isinstance(document.get("reply"), str):
                    prompt = (int(document.get("attempt", 0)), _texts(document.get("findings")))
                    self.proposals[prompt] = Proposal(document["reply"], calls=0)
                case "ask":
                    self._take_answer(document)
                case "offer":
                    self._take_offer(document)
                case "review":
                    self._reopen(key_of(document.get("back")))

    def _take_answer(self, document: Document) -> None:
        key = key_of(document)
        value = said(document.get("answer", LATER.value))
        if value == "back":
            self._reopen(key_of(document.get("to")))
        elif key is not None and value not in (LATER.value, STOP.value):
            self.answers[key] = _answer(value, document)

    def _take_offer(self, document: Document) -> None:
        about = str(document.get("about", ""))
        back = key_of(document.get("back"))
        if back is not None:
            self._reopen(back)
            return
        self.offers.add(about)
        for prop, value in (document.get("answers") or {}).items():
            for kind in ("attribute", "place", "value"):
                self.answers[(kind, about, str(prop), "item")] = _answer(said(value), document)

    def _reopen(self, key: Key | None) -> None:
        if key is not None and self.answers.pop(key, None) is not None:
            self.offers.discard(key[1])


def _answer(value: str, document: Document) -> Answer:
    return Answer(value, str(document.get("by", "")), str(document.get("at", "")))


def _texts(findings: object) -> tuple[str, ...]:
    return tuple(map(str, findings)) if isinstance(findings, list) else ()


@dataclass(frozen=True, slots=True)
class RememberingPlanner:
    """Gives the plans that the run before was given, and asks for others."""

    memory: Memory
    planner: Planner

    @property
    def name(self) -> str:
        """The planner's own name."""
        return self.planner.name

    def propose(self, turn: Propose) -> Proposal:
        """Give the plan that the same prompt was answered with. Raises ModelError."""
        prompt = (turn.attempt, tuple(finding_text(finding) for finding in turn.findings))
        known = self.memory.proposals.pop(prompt, None)
        return self.planner.propose(turn) if known is None else known


@dataclass(frozen=True, slots=True)
class RememberingHuman:
    """Gives the answers that the run before was given, each once, and asks for others."""

    memory: Memory
    human: Human

    def ask(self, question: Question) -> Answer:
        """Give the answer that the question had, if it can still be meant."""
        known = self.memory.answers.pop(question.key, None)
        if known is not None and fits(question, known):
            return known
        return self.human.ask(question)

    def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
        """Give what was told besides, if it was offered before."""
        if questions and questions[0].about in self.memory.offers:
            known = (self.memory.answers.pop(question.key, LATER) for question in questions)
            return tuple(known)
        if isinstance(self.human, Volunteer):
            return self.human.offer(questions)
        return (LATER,) * len(questions)

    def review(self, lessons: tuple[Lesson, ...]) -> bool | Reviewed:
        """Ask: a review is only over with the run."""
        return self.human.review(lessons)
