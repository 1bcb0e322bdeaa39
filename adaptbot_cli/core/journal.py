"""A run is determined by its replies: to correct an answer, it is run again with the others.

The method is a pure generator, so the replies make the run. Going back to a question takes the
run's learning back and starts over: every prompt gets the proposal it got, every question the
answer it got, up to the one that is to be corrected; later answers whose questions come up again
are given again. So any way through answers and corrections leads where the final answers lead.
"""

from collections.abc import Generator, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from adaptbot_cli.core.ask.questions import (
    AS_BEFORE,
    EDIT,
    LATER,
    STOP,
    Answer,
    Follows,
    Key,
    Question,
    Reviewed,
    Suggestion,
    fits,
)
from adaptbot_cli.core.turns import (
    Ask,
    Begin,
    Checked,
    Executed,
    Given,
    Learned,
    LookUp,
    Offer,
    Proposal,
    Propose,
    Review,
    Trace,
    Turn,
)

R = TypeVar("R")
Turns = Generator[Turn, Any, R]


class GoBack(Exception):
    """The person wants to change the answer to the question with the key `to`."""

    def __init__(self, to: Key) -> None:
        super().__init__(to)
        self.to = to


@dataclass(slots=True)
class Journal:
    """The replies of a run so far.

    `reopened` are the answers that the person went back from: likely ones, when asked again;
    `follows` has for each answered question the answers from which its own follows;
    `quiet` is set while nothing new happens, so that nothing is shown twice; `sealed` once
    the robot has begun to act: what is done cannot be gone back on.
    """

    answers: dict[Key, Answer] = field(default_factory=dict)
    reopened: dict[Key, Answer] = field(default_factory=dict)
    proposals: dict[Propose, Proposal] = field(default_factory=dict)
    looked_up: dict[LookUp | Trace, Any] = field(default_factory=dict)
    quiet: bool = False
    follows: dict[Key, tuple[Follows, ...]] = field(default_factory=dict)
    sealed: bool = False

    def play(self, turns: Turns[R]) -> Turns[R]:
        """Run turns, supplying the known replies and yielding the other turns.

        Raises:
            GoBack: the person goes back; `reopen` the question and start again.
        """
        reply: Any = None
        try:
            while True:
                try:
                    turn = turns.send(reply)
                except StopIteration as stop:
                    return stop.value  # type: ignore[no-any-return]
                reply = yield from self._reply(turn)
        finally:
            turns.close()

    def reopen(self, key: Key) -> None:
        """Forget an answer and those that followed from it, so that they are asked for again."""
        self.quiet = True
        if key in self.answers:
            self.reopened[key] = self.answers.pop(key)
            self._drop_following(key, self.reopened[key])

    def _drop_following(self, key: Key, answer: Answer) -> None:
        """Forget the answers that followed from one that no longer holds."""
        rule = (key[2], answer.value)
        for other, rules in self.follows.items():
            values = {f.value for f in rules if (f.prop, f.equals) == rule}
            known = self.answers.get(other, LATER)
            if other[1] == key[1] and known.value in values:
                self._drop_following(other, self.answers.pop(other))

    def _reply(self, turn: Turn) -> Generator[Turn, Any, Any]:
        self.sealed = self.sealed or isinstance(turn, Begin)
        match turn:
            case _ if self.sealed:
                return (yield turn)
            case Propose():
                return (yield from self._propose(turn))
            case LookUp() | Trace():
                if turn not in self.looked_up:
                    self.looked_up[turn] = yield turn
                return self.looked_up[turn]
            case Checked() | Executed() | Learned() if self.quiet:
                return None
            case Ask():
                return (yield from self._ask(turn.question))
            case Offer():
                return (yield from self._offer(turn.questions))
            case Review():
                reply = yield turn
                if isinstance(reply, Reviewed) and reply.back is not None:
                    raise GoBack(reply.back)
                return reply
        return (yield turn)

    def _propose(self, turn: Propose) -> Generator[Turn, Any, Proposal]:
        """Reuse the plan that the same prompt got: it has been paid for."""
        if turn in self.proposals:
            known = self.proposals[turn]
            return replace(known, calls=0, prompt_tokens=0, completion_tokens=0, cost_usd=None)
        self.quiet = False
        proposal: Proposal = yield turn
        if not proposal.failure:
            self.proposals[turn] = proposal
        return proposal

    def _ask(self, question: Question) -> Generator[Turn, Any, Answer]:
        known = self.answers.get(question.key)
        if known is not None and fits(question, known):
            if not self.quiet:
                yield Given(question, known)
            return known
        self.quiet = False
        answer: Answer = yield Ask(self._prepared(question))
        return self._note(question, answer)

    def _offer(self, questions: tuple[Question, ...]) -> Generator[Turn, Any, tuple[Answer, ...]]:
        """Offer what was not offered before or is to be corrected."""
        left = tuple(self._prepared(q) for q in questions if q.key not in self.answers)
        stops = False
        if left:
            self.quiet = False
            if any(question.key in self.reopened for question in left):
                known = tuple(self._shown(q) for q in questions if q.key in self.answers)
                left = (replace(left[0], offered=known), *left[1:])
            reply = yield Offer(left)
            stops = any(answer.last for answer in reply or ())
            for question, answer in zip(left, reply or (), strict=False):
                self._note(question, answer)
            for question in left:
                self.answers.setdefault(question.key, LATER)
        answers = [self.answers[question.key] for question in questions]
        return (*answers[:-1], replace(answers[-1], last=stops))

    def _note(self, question: Question, answer: Answer) -> Answer:
        if answer.to is not None:
            raise GoBack(answer.to)
        if answer.value not in (STOP.value, EDIT):
            self.answers[question.key] = replace(answer, last=False)
            self.follows[question.key] = question.follows
        return answer

    def _prepared(self, question: Question) -> Question:
        """A question with its earlier answer as the suggestion.

        What is known stands on its form only where the person has gone back to it.
        """
        before = self.reopened.get(question.key)
        if before is not None and before.value != LATER.value and fits(question, before):
            suggestion = Suggestion(before.value, AS_BEFORE)
            question = replace(question, suggested=suggestion)
        if before is not None:
            together, offered = (
                tuple(map(self._shown, each)) for each in (question.together, question.offered)
            )
            return replace(question, together=together, offered=offered)
        together = self._unanswered(question.together)
        return replace(question, together=together, offered=self._unanswered(question.offered))

    def _shown(self, question: Question) -> Question:
        """A question as a form shows it again."""
        known = self.answers.get(question.key)
        if known is None:
            return self._prepared(question)
        return replace(question, given=known.value, suggested=None)

    def _unanswered(self, questions: Iterable[Question]) -> tuple[Question, ...]:
        return tuple(self._prepared(q) for q in questions if q.key not in self.answers)
