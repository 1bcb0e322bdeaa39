"""Questions to the person, and answers (paper, III-C)."""

from dataclasses import dataclass
from typing import Literal

QuestionKind = Literal["existence", "kind", "place", "attribute", "value"]
Subject = Literal["item", "action"]


@dataclass(frozen=True, slots=True)
class Choice:
    """One possible answer: the `value` that is kept and the `label` people read."""

    value: str
    label: str


@dataclass(frozen=True, slots=True)
class Question:
    """A question to the person.

    `about` is the name asked about; `prop` the predicate's short name where one is asked for;
    `choices` the answers offered; `known` the names to pick from if it is another name for one of
    them, nearest first, `near` those of them that
    are near enough to tell; `context` the step that raised it.
    """

    kind: QuestionKind
    about: str
    text: str
    prop: str = ""
    subject: Subject = "item"
    choices: tuple[Choice, ...] = ()
    known: tuple[str, ...] = ()
    near: tuple[str, ...] = ()
    context: str = ""

    @property
    def key(self) -> tuple[str, str, str, str]:
        """What makes two questions the same one."""
        return (self.kind, self.about, self.prop, self.subject)


@dataclass(frozen=True, slots=True)
class Answer:
    """What the person said.

    `value` is the value of a choice, or "is NAME" for another name of a known item or action, or
    "later" when nobody is there to say. `by` names the person, `at` is an ISO time; both are the
    human port's to fill in.
    """

    value: str
    by: str = ""
    at: str = ""

    @property
    def same_as(self) -> str:
        """The known name that was meant, if the answer is that it was mistaken for another."""
        return self.value.removeprefix("is ") if self.value.startswith("is ") else ""


LATER = Answer("later")
"""The answer when nobody can be asked, or not now."""

EXISTS, ABSENT, YES, NO, UNKNOWN = "exists", "absent", "yes", "no", "unknown"


def yes_no() -> tuple[Choice, ...]:
    """The answers to a question for a boolean attribute. Unknown is an answer of its own."""
    return (Choice(YES, "yes"), Choice(NO, "no"), Choice(UNKNOWN, "I don't know"))
