"""Where a fact comes from: the question, the answer, the person, the task, the model, the time."""

from dataclasses import asdict, dataclass
from typing import Any

from adaptbot_cli.core.graph.terms import Triple, local
from adaptbot_cli.core.view.changes import Changes, Words, as_json


@dataclass(frozen=True, slots=True)
class Told:
    """One answer of a commit: its number there, the question, the answer, by whom and when.

    `facts` are what it taught, each with its sign, in short; `suggestion` is why it was likely,
    where a likely answer was taken as it stood.
    """

    number: int
    question: str
    said: str
    by: str = ""
    at: str = ""
    facts: tuple[str, ...] = ()
    suggestion: str = ""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a fact comes from.

    `source` is "pack", "answer", "state", "hand edit", "import", "retract", "revert", "update",
    "git" (committed by other means), "start" (there when versions began) or "uncommitted".
    `answer` is the answer's id, to take it back by; `suggestion` as in `Told`; `robot` is which one
    acted, where it is not the domain's own.
    """

    source: str
    revision: str = ""
    author: str = ""
    when: str = ""
    subject: str = ""
    task: str = ""
    planner: str = ""
    transcript: str = ""
    answer: str = ""
    question: str = ""
    said: str = ""
    by: str = ""
    at: str = ""
    suggestion: str = ""
    robot: str = ""

    def as_json(self) -> dict[str, Any]:
        """Return what is known of it as a plain object."""
        return {key: value for key, value in asdict(self).items() if value}


def short(sign: str, triple: Triple) -> str:
    """Format a fact as commit messages do: `+ egg obj_location fridge`.

    What a commit message cannot hold is left out there, and so it is here.
    """
    return plain(f"{sign} {' '.join(local(node) for node in triple)}")


def plain(text: str) -> str:
    """Return a text on one line, without characters a commit message cannot hold."""
    return " ".join(text.replace("\0", "").encode("utf-8", "replace").decode("utf-8").split())


def answer_id(revision: str, number: int) -> str:
    """Return the id of an answer: its commit's short sha and its number there."""
    return f"{revision[:7]}.{number}"


@dataclass(frozen=True, slots=True)
class Turnover:
    """One event in a fact's history: a value was asserted ("+") or retracted ("-"), and why."""

    sign: str
    triple: Triple
    origin: Origin


@dataclass(frozen=True, slots=True)
class Chapter:
    """What one commit taught: where it comes from, its answers with their sentences, the change.

    `start` says that it holds what the versions begin with.
    """

    origin: Origin
    answers: tuple[Told, ...]
    sentences: tuple[str, ...]
    changes: Changes
    start: bool = False

    def by(self) -> str:
        """Return who taught it: the person who answered, else who committed it."""
        record = dict.fromkeys(answer.by for answer in self.answers if answer.by)
        return ", ".join(record) or self.origin.by or self.origin.author

    def as_json(self, words: Words) -> dict[str, Any]:
        """Return the chapter as a plain object; the facts are left out of the first one."""
        change = as_json(self.changes, words)
        if self.start:
            change["things"] = []
        answers_ = [
            {
                "id": answer_id(self.origin.revision, answer.number),
                "question": answer.question,
                "answer": answer.said,
                "by": answer.by,
                "at": answer.at,
                "taught": sentence,
                **({"suggestion": answer.suggestion} if answer.suggestion else {}),
            }
            for answer, sentence in zip(self.answers, self.sentences, strict=True)
        ]
        return {**self.origin.as_json(), "start": self.start, "answers": answers_, **change}
