"""Questions to the person, and answers (paper, III-C)."""

from dataclasses import dataclass, field
from typing import Literal

QuestionKind = Literal[
    "existence",
    "kind",
    "place",
    "attribute",
    "value",
    "contradiction",
    "conflict",
    "mend",
    "action",
    "reading",
    "goal",
    "confirm",
    "failed",
]
Subject = Literal["item", "action"]
Key = tuple[str, str, str, str]
"""What makes two questions the same one: kind, about, prop, subject."""
IN_FORMS: tuple[QuestionKind, ...] = ("place", "attribute", "value")
"""The kinds of questions that several of one thing stand together on a form."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One possible answer: the `value` that is kept, the `label` people read, and what it leads to
    (`then`)."""

    value: str
    label: str
    then: str = ""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """An answer that is likely, and why: "as for onion and garlic". The person has the say."""

    value: str
    reason: str


@dataclass(frozen=True, slots=True)
class Follows:
    """The answer to a question is `value` where the one for `prop` has been answered `equals`."""

    prop: str
    equals: str
    value: str


@dataclass(frozen=True, slots=True)
class Question:
    """A question to the person.

    `about` is the name asked about; `prop` the predicate's short name where one is asked for, the
    plan's new text where a "mend" is offered;
    `choices` the answers offered; `known` the names to pick from if it is another name for one of
    them, nearest first, `near` those of them that are near enough to tell; `context` the step that
    raised it; `notes` lines to read before it; `label` the property in a word; `number` how a
    "value" is written: "number", "whole number" or "" for a text.

    What follows does not make it another question. `suggested` is the likely answer; `follows`
    says when the answer follows from another; `together` are the questions about the same thing
    that come next and `offered` those that nothing needs, so that one screen can hold them all;
    `answered` is what was answered before in this run, to go back to; `given` how this one is
    answered, where it only stands on a form for another that the person has gone back to.
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
    notes: tuple[str, ...] = ()
    label: str = ""
    number: str = ""
    suggested: Suggestion | None = field(default=None, compare=False)
    given: str = field(default="", compare=False)
    follows: tuple[Follows, ...] = field(default=(), compare=False)
    together: tuple["Question", ...] = field(default=(), compare=False)
    offered: tuple["Question", ...] = field(default=(), compare=False)
    answered: tuple[tuple["Question", "Answer"], ...] = field(default=(), compare=False, repr=False)

    @property
    def key(self) -> Key:
        """What makes two questions the same one."""
        return (self.kind, self.about, self.prop, self.subject)


@dataclass(frozen=True, slots=True)
class Answer:
    """What the person said.

    `value` is the value of a choice, or "is NAME" for another name of a known item or action, or
    "new NAME" for a place that is not known yet, or "later" when nobody is there to say; "back" if
    the person wants to answer the question with the key `to` again, "stop" if no more is to be
    asked. `by` names the person, `at` is an ISO time; both are the human port's to fill in. After
    the `last` answer no more is to be asked either.
    """

    value: str
    by: str = ""
    at: str = ""
    to: Key | None = None
    last: bool = False

    @property
    def same_as(self) -> str:
        """The known name that was meant, if the answer is that it was mistaken for another."""
        return self.value.removeprefix("is ") if self.value.startswith("is ") else ""

    @property
    def new(self) -> str:
        """The name of the new place that was told, if the answer is one."""
        return self.value.removeprefix("new ") if self.value.startswith("new ") else ""


@dataclass(frozen=True, slots=True)
class Reviewed:
    """What the person made of everything learned: the keys of the questions whose lessons are
    `left_out`, or the question to go `back` to."""

    left_out: frozenset[Key] = frozenset()
    back: Key | None = None


LATER = Answer("later")
"""The answer when nobody can be asked, or not now."""

STOP = Answer("stop")
"""The answer when no more is to be asked in this run, and what was answered is to be kept."""

EXISTS, ABSENT, YES, NO, UNKNOWN = "exists", "absent", "yes", "no", "unknown"
FIXED = "fixed"
"""The answer that an action is a known one with an argument that is always the same."""

AS_BEFORE = "as you said before"
"""Why an answer is likely that the person has gone back from."""

AGAIN, BY_HAND, SKIP, AT, IS_SO, IS_NOT = "again", "done", "skip", "at ", "is ", "not "
"""The answers to a step that failed: try it again, it is done now, leave it out; `at NAME` if a
thing is somewhere else, `is PROPERTY NAME` or `not PROPERTY NAME` if it is not as the step needs
it."""

EDIT = "edit"
"""The answer that the plan is to be changed instead."""

NEW, OLD = "new", "old"
"""The answers to which of two facts stands."""


def back(to: Key) -> Answer:
    """Return the answer that goes back to an earlier question."""
    return Answer("back", to=to)


def yes_no(prevents: str = "") -> tuple[Choice, ...]:
    """The answers to a question for a boolean attribute. Unknown is an answer of its own;
    `prevents` is what it prevents."""
    return (Choice(YES, "yes"), Choice(NO, "no"), Choice(UNKNOWN, "I don't know", prevents))


def fits(question: Question, answer: Answer) -> bool:
    """Tell whether an answer that was given to an earlier question can answer this one.

    Its choices may have changed meanwhile: what was picked may be gone.
    """
    value = answer.value
    if answer.same_as:
        return answer.same_as in question.known
    if value == UNKNOWN or not question.choices:
        return True
    if answer.new:
        return question.kind == "place"
    return value in {choice.value for choice in question.choices}
