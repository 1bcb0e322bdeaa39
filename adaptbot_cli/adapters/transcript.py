"""Transcripts: every turn of a run as one YAML document, to read, to replay and to resume.

A scripted transcript is the same format written by hand: it must tell every plan and every answer,
and may leave out what it does not want to pin down.
"""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

import yaml

from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.plan import Finding, Step
from adaptbot_cli.core.questions import Answer, Question
from adaptbot_cli.core.report import Outcome, Report, Result
from adaptbot_cli.core.terms import Triple, local
from adaptbot_cli.core.turns import (
    Ask,
    Checked,
    Execute,
    Keep,
    Kept,
    Learned,
    LookUp,
    Proposal,
    Propose,
    Review,
    Turn,
)
from adaptbot_cli.errors import ReplayError, UsageError

Document = dict[str, Any]
FORMAT = 1


def _count(value: Any) -> bool:
    return type(value) is int and value >= 0


def _names(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value)


def _counts(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_count, value.values()))


_FORMS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "policy": ('"tutor" or "paper"', lambda value: value in ("tutor", "paper")),
    "replans": ("a number", _count),
    "requires": ("a list of names", _names),
    "reply": ("a text", lambda value: isinstance(value, str)),
    "calls": ("a number", _count),
    "tokens": ("two numbers, `prompt:` and `completion:`", _counts),
    "cost_usd": ("an amount", lambda value: type(value) in (int, float)),
}
"""What some keys hold, wherever they stand."""


class _Dumper(yaml.SafeDumper):
    """Writes texts of several lines as blocks, so that a plan reads as a plan."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _text)


def dump(document: Document) -> str:
    """Write one document of a transcript."""
    return "---\n" + yaml.dump(
        document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100
    )


def read(path: Path) -> tuple[Document, list[Document]]:
    """Return a transcript's header and turns.

    Raises:
        UsageError: the file cannot be read, or is no transcript; the message says where.
    """
    try:
        text = path.read_text(encoding="utf-8")
        documents = [document for document in yaml.safe_load_all(text) if document is not None]
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} is no transcript: {error}") from error
    if not documents or not all(isinstance(document, dict) for document in documents):
        raise UsageError(f"{path} is no transcript: it holds no YAML documents with keys")
    header, *turns = documents
    if header.get("adaptbot") != FORMAT:
        raise UsageError(f"{path} is no transcript: its first document lacks `adaptbot: {FORMAT}`")
    for number, turn in enumerate(turns, start=1):
        if not isinstance(turn.get("turn"), str):
            raise UsageError(f"{path}: document {number + 1} lacks `turn:`")
    for number, document in enumerate(documents, start=1):
        for key in document.keys() & _FORMS:
            form, fits = _FORMS[key]
            if not fits(document[key]):
                raise UsageError(f"{path}: document {number}: `{key}:` must be {form}")
    return header, turns


def describe(turn: Turn, kg: Kg) -> Document | None:
    """Return a turn as a document, without its reply; None for what a transcript does not tell."""
    match turn:
        case Propose():
            findings = [_finding(f) for f in turn.findings]
            return {"turn": "propose", "attempt": turn.attempt, "findings": findings}
        case Checked():
            return {"turn": "checked", **_report(turn.report)}
        case Ask():
            return {"turn": "ask", **_question(turn.question)}
        case Learned():
            return {"turn": "learned", **_lesson(turn.lesson, kg)}
        case Execute():
            return {"turn": "execute", "steps": len(turn.report.live)}
        case Review():
            return {"turn": "review", "lessons": [lesson.sentence for lesson in turn.lessons]}
        case Keep():
            return {"turn": "keep", "lessons": [lesson.sentence for lesson in turn.lessons]}
        case LookUp():
            return None


def _question(question: Question) -> Document:
    told = {"kind": question.kind, "about": question.about, "prop": question.prop}
    subject = {} if question.subject == "item" else {"subject": question.subject}
    return {k: v for k, v in {**told, **subject, "text": question.text}.items() if v}


def _finding(finding: Finding) -> str:
    return f"{finding.code} {finding.message}"


def _report(report: Report) -> Document:
    return {
        "executable": report.executable,
        "steps": [_step(step) for step in report.steps],
        "findings": [_finding(finding) for finding in report.findings],
    }


def _step(step: Step) -> str:
    return f"{step.status}: {step.call.render()}"


def _lesson(lesson: Lesson, kg: Kg) -> Document:
    removed = [f"- {fact(triple, kg)}" for triple in sorted(lesson.delta.removed)]
    added = [f"+ {fact(triple, kg)}" for triple in sorted(lesson.delta.added)]
    return {"sentence": lesson.sentence, "facts": removed + added}


def fact(triple: Triple, kg: Kg) -> str:
    """Write a fact in short: `egg obj_location fridge`."""
    return " ".join(local(node) for node in triple)


def _reply(turn: Turn, reply: object) -> Document:
    match reply:
        case Proposal():
            tokens = {"prompt": reply.prompt_tokens, "completion": reply.completion_tokens}
            cost = {} if reply.cost_usd is None else {"cost_usd": reply.cost_usd}
            calls = {} if reply.calls == 1 else {"calls": reply.calls}
            spent = {"tokens": tokens} if any(tokens.values()) else {}
            failed = {"failure": reply.failure} if reply.failure else {}
            return {"reply": reply.text, **calls, **spent, **cost, **failed}
        case Answer():
            said = {"answer": reply.value, "by": reply.by, "at": reply.at}
            return {key: value for key, value in said.items() if value}
        case Outcome():
            error = _finding(reply.error) if reply.error else None
            return {"error": error, "unmet": [_finding(f) for f in reply.unmet]}
        case Kept():
            return {"revision": reply.revision}
        case bool():
            return {"kept": reply}
        case _:
            return {}


def finished(result: Result) -> Document:
    """Return the last document: what the run came to."""
    return {"turn": "finished", "outcome": result.verdict, "goal_met": result.goal_met}


@dataclass(slots=True)
class Recorder:
    """Writes a run's transcript, one turn at a time, each on disk before the next begins."""

    file: TextIO
    kg: Kg

    def header(self, header: Mapping[str, Any]) -> None:
        """Write the first document."""
        self._write({"adaptbot": FORMAT, **header})

    def asked(self, turn: Turn) -> None:
        """Nothing is written before the reply is there."""

    def replied(self, turn: Turn, reply: object) -> None:
        """Write a turn with its reply."""
        told = describe(turn, self.kg)
        if told is not None:
            self._write({**told, **_reply(turn, reply)})

    def finished(self, result: Result) -> None:
        """Write the last document."""
        self._write(finished(result))

    def _write(self, document: Document) -> None:
        self.file.write(dump(document))
        self.file.flush()
        os.fsync(self.file.fileno())


_GIVEN_BACK = frozenset(
    {"reply", "calls", "tokens", "cost_usd", "failure", "answer", "by", "at", "kept", "revision"}
)
"""What a document tells of the reply: given back in a replay, not compared."""

_REPLIES = _GIVEN_BACK | {"error", "unmet"}


@dataclass(slots=True)
class Player:
    """Plays a transcript: planner, human and store of a replay, and the judge of it."""

    path: Path
    kg: Kg
    turns: list[Document]
    at: int = 0
    current: Document = field(default_factory=dict)
    name: str = "transcript"

    def asked(self, turn: Turn) -> None:
        """Find this turn in the transcript and compare. Raises ReplayError where it differs."""
        told = describe(turn, self.kg)
        self.current = {}
        if told is None:
            return
        if self._next_is(told["turn"]):
            self.current = self.turns[self.at]
            self.at += 1
            self._known_keys(told)
            self._compare(told)
        elif told["turn"] in ("propose", "ask"):
            raise self._differs(
                f"the run comes to {_short(told)}, the transcript to {self._next()}"
            )

    def replied(self, turn: Turn, reply: object) -> None:
        """Compare what came of an execution with what the transcript tells."""
        if isinstance(turn, Execute) and self.current:
            self._compare(_reply(turn, reply))

    def propose(self, turn: Propose) -> Proposal:
        """Give the recorded plan."""
        tokens = self.current.get("tokens") or {}
        return Proposal(
            str(self._given("reply")),
            int(self.current.get("calls", 1)),
            int(tokens.get("prompt", 0)),
            int(tokens.get("completion", 0)),
            self.current.get("cost_usd"),
            str(self.current.get("failure", "")),
        )

    def ask(self, question: Question) -> Answer:
        """Give the recorded answer."""
        value = self._given("answer")
        shown = (
            {True: "yes", False: "no"}.get(value, str(value)) if isinstance(value, bool) else value
        )
        return Answer(str(shown), self.current.get("by", ""), str(self.current.get("at", "")))

    def review(self, lessons: tuple[Lesson, ...]) -> bool:
        """Accept, unless the transcript tells otherwise."""
        return bool(self.current.get("kept", True))

    def keep(self, turn: Keep) -> Kept:
        """Keep nothing: a replay changes no workspace."""
        return Kept(self.current.get("revision"))

    def end(self, result: Result) -> None:
        """Check the result and that no turn is left over. Raises ReplayError."""
        if self._next_is("finished"):
            self.current = self.turns[self.at]
            self.at += 1
            self._compare(finished(result))
        if self.at < len(self.turns):
            self.current = {}
            raise self._differs(f"the run has ended, the transcript goes on with {self._next()}")

    def _next_is(self, kind: str) -> bool:
        return self.at < len(self.turns) and self.turns[self.at]["turn"] == kind

    def _next(self) -> str:
        return _short(self.turns[self.at]) if self.at < len(self.turns) else "its end"

    def _given(self, key: str) -> object:
        if key not in self.current:
            raise self._differs(f"this {self.current.get('turn', 'turn')} lacks `{key}:`")
        return self.current[key]

    def _known_keys(self, told: Document) -> None:
        unknown = self.current.keys() - told.keys() - _REPLIES
        if unknown:
            kind = told["turn"]
            raise self._differs(f"`{min(unknown)}:` is nothing that a {kind} turn tells")

    def _compare(self, told: Document) -> None:
        for key in told.keys() & self.current.keys() - _GIVEN_BACK:
            if told[key] != self.current[key]:
                raise self._differs(f"{key}: {_difference(self.current[key], told[key])}")

    def _differs(self, how: str) -> ReplayError:
        number = self.at if self.current else self.at + 1
        kind = f" ({self.current['turn']})" if self.current else ""
        return ReplayError(f"{self.path}, turn {number}{kind}: {how}")


def _short(document: Document) -> str:
    about = document.get("about") or document.get("attempt")
    return str(document["turn"]) + (f" {about}" if about not in (None, 0) else "")


def _difference(expected: object, actual: object) -> str:
    if isinstance(expected, list) and isinstance(actual, list):
        for number, (one, other) in enumerate(_padded(expected, actual), start=1):
            if one != other:
                return f"entry {number}: the transcript has {one!r}, the run {other!r}"
    return f"the transcript has {expected!r}, the run {actual!r}"


def _padded(one: list[Any], other: list[Any]) -> Iterable[tuple[Any, Any]]:
    size = max(len(one), len(other))
    fill = [None] * size
    return list(zip((one + fill)[:size], (other + fill)[:size], strict=True))
