"""Writes a run's transcript."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TextIO

from adaptbot_cli.adapters.transcript.documents import (
    FORMAT,
    Document,
    describe,
    dump,
    finished,
    reply_fields,
)
from adaptbot_cli.core.ask.questions import LATER
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Amend, Turn
from adaptbot_cli.errors import KnowledgeError

_SIGNED = frozenset({"ask", "offer", "edit", "review"})
"""The turns whose replies are a person's."""


def is_signed(document: Document) -> bool:
    """Tell whether a person has replied, rather than nobody, who puts everything off."""
    put_off = document.get("answer") == LATER.value or document.get("answers") == {}
    return document["turn"] in _SIGNED and not put_off


@dataclass(slots=True)
class Recorder:
    """Writes a run's transcript, one turn at a time, each on disk before the next begins.

    `signed` is called once, before the first reply of a person is written. The methods raise
    KnowledgeError where writing fails.
    """

    file: TextIO
    kg: Kg
    signed: Callable[[], None] | None = None

    def header(self, header: Mapping[str, Any]) -> None:
        """Write the first document."""
        self._write({"adaptbot": FORMAT, **header})

    def asked(self, turn: Turn) -> None:
        """Write nothing before the reply is there."""

    def replied(self, turn: Turn, reply: object) -> None:
        """Write a turn with its reply."""
        record = describe(turn, self.kg)
        left_as_it_is = isinstance(turn, Amend) and reply is None
        if record is not None and not left_as_it_is:
            document = {**record, **reply_fields(turn, reply, self.kg)}
            if self.signed is not None and is_signed(document):
                self.signed()
                self.signed = None
            self._write(document)

    def finished(self, result: Result) -> None:
        """Write the last document."""
        self._write(finished(result))

    def planless(self, why: str) -> None:
        """Write the last document of a run whose planner had no plan at all."""
        self._write({"turn": "finished", "outcome": "no_plan", "goal_met": False, "why": why})

    def ended(self) -> None:
        """Write the last document of what was no run."""
        self._write({"turn": "finished"})

    def _write(self, document: Document) -> None:
        try:
            self.file.write(dump(document))
            self.file.flush()
            os.fsync(self.file.fileno())
        except OSError as error:
            text = f"cannot write the transcript {self.file.name}: {error.strerror}"
            raise KnowledgeError(text) from error
