"""Questions to the person, and answers (paper, III-C)."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from adaptbot_cli.core.names import normal

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
    "plan",
]
Subject = Literal["item", "action"]
Key = tuple[str, str, str, str]
"""What makes two questions the same one: kind, about, prop, subject."""
KNOWN = "the graph says"
"""The beginning of a note on what is already known of the question."""


@dataclass(frozen=True, slots=True)
class Choice:
    """One possible answer: the `value` that is kept, the `label` people read, what it leads to
    (`then`), and the key that gives it at a terminal, "" for its number."""

    value: str
    label: str
    then: str = ""
    key: str = ""


MOST_SHOWN = 1_000
"""How many things of a home are shown to pick from; in a larger one the others are searched for."""


class Names(tuple[str, ...]):
    """Names to pick from, those to show: in a large home, `others` finds more by what is typed."""

    others: Callable[[str], Iterable[str]] = staticmethod(lambda typed: ())

    @classmethod
    def of(cls, shown: Iterable[str], others: Callable[[str], Iterable[str]]) -> "Names":
        """Return names, of which some are shown and others found."""
        names = cls(shown)
        names.others = others
        return names

    @property
    def more(self) -> bool:
        """Whether there are names that are only found by what is typed."""
        return "others" in vars(self)

    def __reduce__(self) -> tuple[type["Names"], tuple[tuple[str, ...]]]:
        return Names, (tuple(self),)  # what finds others has a graph, which stays in its process

    def meant(self, text: str) -> str:
        """Return the name that a text is, whatever its case and separators; "" if it is none."""
        wanted = normal(text)
        found = (name for names in (self, self.others(text)) for name in names)
        return next((name for name in found if normal(name) == wanted), "")


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
    plan's new text where a "mend" is offered, why it is to be kept where a "plan" is; `choices` the
    answers offered, and `further` the values that may be given beside them; `known` the names to
    pick from if it is another name for one of them, nearest first, or that a new one cannot have;
    `near` those of them that are
    near enough to tell, `alike` those of these that are only spelled alike; `context` the step that
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
    known: Names = Names()  # noqa: RUF009 - it cannot be changed
    near: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    context: str = ""
    notes: tuple[str, ...] = ()
    label: str = ""
    number: str = ""
    suggested: Suggestion | None = field(default=None, compare=False)
    given: str = field(default="", compare=False)
    follows: tuple[Follows, ...] = field(default=(), compare=False)
    together: tuple["Question", ...] = field(default=(), compare=False)
    offered: tuple["Question", ...] = field(default=(), compare=False)
    further: Names = field(default=Names(), compare=False, repr=False)
    answered: tuple[tuple["Question", "Answer"], ...] = field(default=(), compare=False, repr=False)

    def __post_init__(self) -> None:
        """Take any tuple of names as `known`."""
        if not isinstance(self.known, Names):
            object.__setattr__(self, "known", Names(self.known))

    @property
    def key(self) -> Key:
        """What makes two questions the same one."""
        return (self.kind, self.about, self.prop, self.subject)

    @property
    def spec(self) -> "Spec":
        """What all questions of its kind have in common."""
        return KINDS[self.kind]


@dataclass(frozen=True, slots=True)
class Answer:
    """The person's answer.

    `value` is the value of a choice, or "is NAME" for another name of a known item or action, or
    "instead NAME" for a known one that is used in its place in this run only, or "new NAME" for a
    place that is not known yet, or "later" when nobody is there to say; "back" if the person wants
    to answer the question with the key `to` again, "stop" if no more is to be asked. `by` names the
    person, `at` is an ISO time; both are the human port's to fill in. After the `last` answer no
    more is to be asked either. `suggestion` is why the answer was likely, where a likely answer was
    taken as it stood and not given by the person in their own words.
    """

    value: str
    by: str = ""
    at: str = ""
    to: Key | None = None
    last: bool = False
    suggestion: str = ""

    @property
    def same_as(self) -> str:
        """The known name that was meant, if the answer is that it was mistaken for another."""
        return self.value.removeprefix("is ") if self.value.startswith("is ") else ""

    @property
    def instead(self) -> str:
        """The known name that stands for the unknown one in this run only, if one was given."""
        return self.value.removeprefix("instead ") if self.value.startswith("instead ") else ""

    @property
    def new(self) -> str:
        """The name of a new place, if the answer is one."""
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
SAME, INSTEAD = "is", "instead"
"""The choices after which one of the known names is picked: the answer is then "is NAME" (another
name for it, kept) or "instead NAME" (used in its place in this run, not kept)."""

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
    return (
        Choice(YES, "yes", key="y"),
        Choice(NO, "no", key="n"),
        Choice(UNKNOWN, "I don't know", prevents, "d"),
    )


def fits(question: Question, answer: Answer) -> bool:
    """Tell whether an answer that was given to an earlier question can answer this one.

    Its choices may have changed meanwhile: what was picked may be gone.
    """
    value = answer.value
    if answer.same_as or answer.instead:
        return bool(question.known.meant(answer.same_as or answer.instead))
    if value == UNKNOWN or not question.choices:
        return True
    if answer.new:
        return question.kind == "place"
    values = {choice.value for choice in question.choices}
    return value in values or bool(question.further.meant(value))


@dataclass(frozen=True, slots=True)
class Spec:
    """What all questions of a kind have in common.

    `raised` says when one comes up, `teaches` what its answer leads to; `codes` are the findings
    that raise it. `entry` is how the answer is given: by one key, from a list that is searched, or
    as a line of text. `marked` is the choice that Enter takes at first; several questions about one
    thing stand together on one screen where `together`. A file of answers has the answer under the
    question's property, or under its kind where `by_kind`; "I don't know" is an answer wherever
    `unknown`.
    """

    raised: str
    teaches: str
    codes: tuple[str, ...] = ()
    entry: Literal["key", "list", "line"] = "key"
    marked: str = ""
    together: bool = False
    by_kind: bool = False
    unknown: bool = True


KINDS: Mapping[QuestionKind, Spec] = {
    "reading": Spec(
        "a word of the request is in doubt",
        "nothing: the request is read so, or as another task, or nothing is done",
    ),
    "goal": Spec(
        "no goal is known for the task, and one of the same sort has one",
        "the task's name is another name of that sort of task",
    ),
    "existence": Spec(
        "a step names an item or an action that is not known",
        "that it is there, or not, or another name for a known one; or nothing, this time only",
        codes=("E101", "E201"),
        marked=LATER.value,  # a key pressed without reading teaches nothing
        unknown=False,
    ),
    "kind": Spec("a new thing or place may be of several classes", "its class"),
    "place": Spec(
        "a new thing's place, or one that a step needs, is not known; or another robot holds it",
        "where it is kept; a new place too",
        codes=("E402",),
        entry="list",
        together=True,
    ),
    "attribute": Spec(
        "a step needs an attribute that is not known, or that is in the way",
        "that it is so, or not",
        codes=("E301", "E302"),
        together=True,
    ),
    "value": Spec(
        "a number or text is asked of the class",
        "the value",
        codes=("E301", "E302"),
        entry="line",
        together=True,
    ),
    "action": Spec(
        "a person says that an unknown action is possible",
        "the action: what it takes, requires and changes",
    ),
    "contradiction": Spec(
        "an answer cannot be true beside what is known", "which of the two stands", by_kind=True
    ),
    "conflict": Spec(
        "answers of two homes that are shared cannot both stand", "which of the two stands"
    ),
    "mend": Spec(
        "changes would bring the plan to its goal, or nearer",
        "nothing: the plan is changed",
        by_kind=True,
    ),
    "confirm": Spec(
        "a step is to be agreed to before the robot does it", "nothing: it is done, or not"
    ),
    "failed": Spec(
        "a step failed in the world and nothing mends it",
        "where a thing is or what is true of it; or what becomes of the step",
    ),
    "plan": Spec(
        "a plan that the person changed runs and meets its goal, or a model's did so in the world",
        "the plan: it is the first for this task from now on",
        by_kind=True,
    ),
}
"""Every kind of question. A kind more is a row here, and the words it is asked in."""
