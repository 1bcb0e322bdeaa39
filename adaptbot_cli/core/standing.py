"""How a workspace stands: its revision, edits, faults, open runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from adaptbot_cli.core.changes import Changes


@dataclass(frozen=True, slots=True)
class Status:
    """How a workspace stands: its revision and its last change, edits, waiting transcripts.

    `changes` are what the edits come to; `problem` says why that cannot be told, `faults` what
    keeps them from being committed.
    """

    root: PurePath
    domain: str
    revision: str | None = None
    subject: str = ""
    edited: Sequence[str] = ()
    changes: Changes | None = None
    problem: str = ""
    faults: Sequence[str] = ()
    waiting: Sequence[PurePath] = ()


@dataclass(frozen=True, slots=True)
class Wrong:
    """Something wrong: the sentence, the file it stands in, what to do, what caused it.

    A `hint` is worth knowing and no fault.
    """

    message: str
    file: str = ""
    remedy: str = ""
    cause: str = ""
    hint: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return it as a plain object."""
        record = {"message": self.message, "file": self.file, "remedy": self.remedy}
        return {**record, "cause": self.cause or None, "hint": self.hint}
