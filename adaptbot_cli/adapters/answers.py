"""Answers from a file, for a run without a terminal: by subject, then by question."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.core.ask.learning import Lesson, number_trouble
from adaptbot_cli.core.ask.questions import (
    ABSENT,
    EDIT,
    EXISTS,
    INSTEAD,
    LATER,
    NO,
    SAME,
    UNKNOWN,
    YES,
    Answer,
    Question,
    Reviewed,
)
from adaptbot_cli.core.names import nearest, normal
from adaptbot_cli.errors import UsageError


def read_answers(path: Path) -> dict[str, dict[str, Any]]:
    """Read a file of answers: `chives: {existence: exists, obj_location: fridge}`.

    Raises:
        KnowledgeError: the file cannot be read.
        UsageError: it has another form.
    """
    data = bounded.read_bytes(path, bounded.YAML, piped=True)
    reply, *more = bounded.parse_yaml(bounded.decode(data, path, UsageError), path) or [{}]
    if more or not isinstance(reply, dict) or not all(isinstance(v, dict) for v in reply.values()):
        raise UsageError(f"{path} must hold answers by subject: `chives: {{existence: absent}}`")
    return {normal(str(subject)): answers for subject, answers in reply.items()}


@dataclass(frozen=True, slots=True)
class AnswersHuman:
    """Answers from a file, `path` in messages; what the file lacks stays open.

    `asked` are the keys that were asked for, by subject; `reviewer` looks at what was learned
    before it is kept, if that is not agreed to by giving the file.
    """

    answers: dict[str, dict[str, Any]]
    by: str
    path: str = "the answers"
    asked: dict[str, set[str]] = field(default_factory=dict)
    reviewer: Callable[[tuple[Lesson, ...]], bool | Reviewed] | None = None

    def ask(self, question: Question) -> Answer:
        """Return the file's answer to a question, by its kind or by the property it asks for.

        Raises:
            UsageError: the answer is none that the question has, or the kind of something that
                exists is missing.
        """
        record = self.answers.get(normal(question.about), {})
        keys = {question.kind, _prop(question), _listed(question)} - {""}
        self.asked.setdefault(normal(question.about), set()).update(keys)
        value = _answer_for(question, record)
        if value is None and record and question.kind == "kind":
            raise self._unfit(question, "exists, but its kind is not told", "it can be")
        if value is None:
            return LATER
        given = _meant(question, value)
        if given is None:
            problem = f'"{value}" is no answer for {_prop(question)}'
            raise self._unfit(question, problem, "there is")
        return Answer(given, self.by)

    def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
        """Return the file's answers to what is not needed. Raises UsageError as `ask` does."""
        return tuple(self.ask(question) for question in questions)

    def unused(self) -> list[str]:
        """Return a sentence for each entry of the file that no question asked for.

        A misspelt subject or key comes with the nearest one that was asked for.
        """
        found = []
        for subject, record in self.answers.items():
            keys = self.asked.get(subject)
            if keys is None:
                found.append(_never(f"{subject}", subject, self.asked))
                continue
            found += [_never(f"{subject}, {k}", str(k), keys) for k in record if str(k) not in keys]
        return [f"{self.path}: {sentence}" for sentence in found]

    def _unfit(self, question: Question, problem: str, there_is: str) -> UsageError:
        choices = ", ".join(_choices(question).values())
        near = ", ".join(question.known[:3])
        once = "; instead NAME holds this time only"
        known = f", or is NAME with a known name, such as {near}{once}" if near else ""
        return UsageError(f"{self.path}: {question.about}: {problem}; {there_is} {choices}{known}")

    def review(self, lessons: tuple[Lesson, ...]) -> bool | Reviewed:
        """Accept, unless there is a reviewer: whoever wrote the file agrees to it."""
        return self.reviewer(lessons) if self.reviewer else True


def _answer_for(question: Question, record: dict[str, Any]) -> object:
    """The file's answer to a question; to one that comes again and again, the next of a list.

    A new action is what the file makes of it.
    """
    value = record.get(_prop(question), record.get(question.kind))
    name, nth = _listed(question), question.prop.rpartition("_")[2]
    if question.kind != "action":
        return value
    if value is not None:
        return value[0] if isinstance(value, list) and value else value
    if name in record:
        listed = record[name] if isinstance(record[name], list) else [record[name]]
        return listed[int(nth) - 1] if int(nth) <= len(listed) else "done"
    return YES if question.prop.startswith("means") and len(record) > 1 else None


def _prop(question: Question) -> str:
    """The key of a question: its property, else its kind."""
    return question.kind if question.spec.by_kind else question.prop or question.kind


def _listed(question: Question) -> str:
    """The name of the list that a question about an action picks from, "" if it has none."""
    name, _, nth = question.prop.rpartition("_")
    return name if question.kind == "action" and nth.isdigit() else ""


def _never(what: str, name: str, asked: Iterable[str]) -> str:
    near = nearest(name, asked, 1)
    meant = f"; asked for was {near[0]}" if near else ""
    return f"{what} was not asked for{meant}"


def _choices(question: Question) -> dict[str, str]:
    """The values to choose from, by their normal form; "is" alone names nothing, nor does a file
    edit a plan."""
    offered = [c.value for c in question.choices if c.value not in (SAME, INSTEAD, EDIT)]
    always = [UNKNOWN] if question.spec.unknown else []
    return {normal(value): value for value in (*offered, *always, LATER.value)}


def _meant(question: Question, value: object) -> str | None:
    """The value of the choice that a person has written, None if it is none."""
    text = {True: YES, False: NO}[value] if isinstance(value, bool) else str(value).strip()
    if question.kind == "value":
        return None if number_trouble(question.number, text) else text
    if question.kind == "place" and text.startswith("new "):
        new = normal(text.removeprefix("new "))
        return f"new {new}" if new and not question.known.meant(new) else None
    verb, _, named = text.partition(" ")
    if named and verb in (SAME, INSTEAD):
        name = question.known.meant(named)
        return f"{verb} {name}" if name else None
    if not question.choices:
        return text
    words = {"true": YES, "false": NO}
    if question.kind == "existence":
        words = {YES: EXISTS, "true": EXISTS, NO: ABSENT, "false": ABSENT}
    listed = _choices(question).get(words.get(text.lower(), normal(text)))
    return listed or question.further.meant(text) or None
