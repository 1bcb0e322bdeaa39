"""Plays a transcript again: planner, human and store of a replay, and the judge of it."""

from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path

from adaptbot_cli.adapters.transcript.documents import (
    Document,
    answer_of,
    describe,
    edit_of,
    finished,
    key_of,
    seen_of,
)
from adaptbot_cli.core.ask.edit import EDITS, Edit
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import KNOWN, LATER, Answer, Question, Reviewed, back
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import (
    Act,
    Amend,
    Begin,
    Believe,
    Keep,
    Kept,
    Proposal,
    Propose,
    Stop,
    Turn,
)
from adaptbot_cli.core.world import Seen
from adaptbot_cli.errors import ReplayError

_GIVEN_BACK = frozenset(
    """prompt reasoning source reply calls tokens cost_usd failure answer to last by suggestion
    suggestions at answers kept left_out back revision edit step call reason plan failed observed
    gone odd over goal""".split()  # noqa: SIM905
)
"""The fields that record a reply: returned by a replay, not compared."""


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
        record = describe(turn, self.kg)
        self.current = {}
        if record is None:
            return
        if self._next_is(record["turn"]):
            self.current = self.turns[self.at]
            self.at += 1
            unknown = self.current.keys() - record.keys() - _GIVEN_BACK
            if unknown:
                text = f"`{min(unknown)}:` is no field of a {record['turn']} turn"
                raise self._differs(text)
            self._compare(record)
        elif record["turn"] in ("propose", "ask", "act") and record.get("kind") != "plan":
            raise self._differs(
                f"the run comes to {_short(record)}, the transcript to {self._next()}"
            )

    def replied(self, turn: Turn, reply: object) -> None:
        """Everything was compared when the turn came."""

    def act(self, turn: Begin | Act | Stop) -> Seen:
        """Return what the world answered."""
        try:
            return seen_of(self.current, self.kg)
        except ValueError as error:
            raise self._differs(str(error)) from error

    begin = stop = act

    def keep(self, turn: Keep | Believe) -> Kept:
        """Keep nothing: a replay changes no workspace."""
        return Kept(self.current.get("revision"))

    believe = keep

    def propose(self, turn: Propose) -> Proposal:
        """Return the recorded plan."""
        tokens = self.current.get("tokens") or {}
        more = ("failure", "reasoning", "prompt", "source")
        return Proposal(
            str(self._given("reply")),
            int(self.current.get("calls", 1)),
            int(tokens.get("prompt", 0)),
            int(tokens.get("completion", 0)),
            self.current.get("cost_usd"),
            *(str(self.current.get(key, "")) for key in more),
        )

    def ask(self, question: Question) -> Answer:
        """Return the recorded answer; old transcripts lack the question whether to keep a plan."""
        if not self.current and question.kind == "plan":
            return LATER
        self._given("answer")
        answer = answer_of(self.current)
        to = key_of(self._given("to")) if answer.value == "back" else None
        return replace(answer, to=to, last=self._is_last)

    def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
        """Return the recorded answers; without an `offer` in the transcript, none."""
        to = key_of(self.current.get("back"))
        if to is not None:
            return (back(to),)
        given = self.current.get("answers") or {}
        found = [answer_of(self.current, q.prop) if q.prop in given else LATER for q in questions]
        found[-1] = replace(found[-1], last=self._is_last)
        return tuple(found)

    @property
    def _is_last(self) -> bool:
        return self.current.get("last") is True

    def amend(self, turn: Amend) -> Edit | None:
        """Return the recorded edit, None if there is none here."""
        if not self.current:
            return None
        kind = self._given("edit")
        if kind not in EDITS:
            raise self._differs(f"`edit: {kind}` is none of {', '.join(EDITS)}")
        return edit_of(self.current)

    def review(self, lessons: tuple[Lesson, ...]) -> bool | Reviewed:
        """Accept, unless the transcript does not."""
        to = key_of(self.current.get("back"))
        left_out = frozenset(filter(None, map(key_of, self.current.get("left_out") or ())))
        if to is not None or left_out:
            return Reviewed(left_out, to)
        return bool(self.current.get("kept", True))

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

    def _compare(self, document: Document) -> None:
        for key in document.keys() & self.current.keys() - _GIVEN_BACK:
            if _plain(key, document[key]) != _plain(key, self.current[key]):
                raise self._differs(f"{key}: {_difference(self.current[key], document[key])}")

    def _differs(self, how: str) -> ReplayError:
        number = self.at if self.current else self.at + 1
        kind = f" ({self.current['turn']})" if self.current else ""
        return ReplayError(f"{self.path}, turn {number}{kind}: {how}")


def _plain(key: str, value: object) -> object:
    """A question's text without quotation marks: transcripts of 0.3 did not quote its name; its
    notes without where a fact is from, which only the workspace of the run can tell."""
    if key == "text" and isinstance(value, str):
        return value.replace('"', "")
    if key == "notes" and isinstance(value, list):
        return [str(n).partition(" (")[0] if str(n).startswith(KNOWN) else n for n in value]
    return value


def _short(document: Document) -> str:
    about = document.get("about") or document.get("attempt")
    return str(document["turn"]) + (f" {about}" if about not in (None, 0) else "")


def _difference(expected: object, actual: object) -> str:
    if isinstance(expected, list) and isinstance(actual, list):
        for number, (one, other) in enumerate(zip_longest(expected, actual), start=1):
            if one != other:
                return f"entry {number}: the transcript has {one!r}, the run {other!r}"
    return f"the transcript has {expected!r}, the run {actual!r}"
