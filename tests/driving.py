"""Drives the method with scripted replies: what a session does, without ports or patches."""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from adaptbot_cli.core.ask.edit import Edit
from adaptbot_cli.core.ask.questions import NO, Answer, Question
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import (
    Amend,
    Ask,
    Believe,
    Executed,
    Keep,
    Kept,
    LookUp,
    Proposal,
    Propose,
    Review,
    Turn,
)
from adaptbot_cli.core.tutor import Parse, Policy, pursue
from adaptbot_cli.core.words import Related
from tests.worlds import parsed

Answers = Answer | Mapping[str, str]
R = TypeVar("R")


def played(turns: Generator[Turn, Any, R], reply: Callable[[Turn], Any]) -> R:
    """Reply to each turn, to the end; return what comes of it."""
    given: Any = None
    while True:
        try:
            turn = turns.send(given)
        except StopIteration as stop:
            result: R = stop.value
            return result
        given = reply(turn)


@dataclass
class Script:
    """The replies of one run: texts in order (the last one again and again), answers by question.

    An answer's key is `kind about` or `kind about prop`. The turns seen are kept in `seen`.
    """

    texts: Sequence[str]
    answers: Answers = field(default_factory=dict)
    accept: Any = True
    words: Mapping[str, tuple[Related, ...]] = field(default_factory=dict)
    edits: list[Edit] = field(default_factory=list)
    seen: list[Turn] = field(default_factory=list)
    proposed: int = 0

    def reply(self, turn: Turn, kg: Kg) -> Any:
        """Return the reply to a turn."""
        self.seen.append(turn)
        if isinstance(turn, Propose):
            self.proposed += 1
            text = self.texts[min(self.proposed, len(self.texts)) - 1]
            return Proposal(text, prompt_tokens=10, completion_tokens=5)
        if isinstance(turn, LookUp):
            return {word: self.words.get(word, ()) for word in turn.words}
        if isinstance(turn, Ask):
            return self.answer(turn.question)
        if isinstance(turn, Amend):
            return self.edits.pop(0) if self.edits else None
        if isinstance(turn, Review):
            return self.accept.pop(0) if isinstance(self.accept, list) else self.accept
        return Kept("r1") if isinstance(turn, Keep | Believe) else None

    def answer(self, question: Question) -> Answer:
        """Return the scripted answer to a question; one that is not scripted fails the test."""
        if isinstance(self.answers, Answer):
            return self.answers
        key = " ".join(part for part in (question.kind, question.about, question.prop) if part)
        short = f"{question.kind} {question.about}"
        unless_told = NO if question.kind == "mend" else None  # the plan stays as it is
        value = self.answers.get(key, self.answers.get(short, unless_told))
        assert value is not None, f"no answer is scripted for {key!r}"
        return Answer(value, by="tester")

    @property
    def story(self) -> list[str]:
        """The proposals and questions in order, in words."""
        told = []
        for turn in self.seen:
            if isinstance(turn, Propose):
                told.append(f"propose {turn.attempt}")
            elif isinstance(turn, Ask):
                told.append(f"ask {turn.question.kind} {turn.question.about}")
            elif isinstance(turn, Executed | Review | Keep):
                told.append(type(turn).__name__.lower().replace("executed", "execute"))
        return told


def drive(
    task: Task,
    kg: Kg,
    script: Script,
    policy: Policy = "tutor",
    replans: int = 3,
    parse: Parse = parsed,
) -> Result:
    """Run the method to its end."""
    turns = pursue(task, kg, parse, policy, replans)
    return played(turns, lambda turn: script.reply(turn, kg))
