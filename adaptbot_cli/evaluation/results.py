"""The file that trials are written to as they end, so that an interrupted run can go on."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TextIO

from adaptbot_cli import bounded
from adaptbot_cli.errors import UsageError

FORMAT = 1
Json = dict[str, Any]


def digest(settings: Json, contents: Iterable[bytes]) -> str:
    """Return what makes two experiments the same one: settings and the contents of the inputs."""
    found = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for content in contents:
        found.update(hashlib.sha256(content).digest())
    return found.hexdigest()[:16]


@dataclass(slots=True)
class Results:
    """Trials on disk, one a line after a header; `done` are those there, by task and arm."""

    path: Path
    key: str
    done: dict[tuple[str, str], Json] = field(default_factory=dict)
    _file: TextIO | None = None

    @property
    def answers(self) -> Path:
        """Where the answers of a live model are kept, unless they have a file of their own."""
        return self.path.with_name(f"{self.path.name}.answers")

    def start(self) -> None:
        """Read what is there and open the file to go on.

        Raises:
            UsageError: the file belongs to another experiment, is damaged or cannot be written.
        """
        if self.path.exists() and not self.path.is_file():
            raise UsageError(f"cannot use {self.path} for results: it is no file")
        try:
            kept = self._read() if self.path.exists() else []
            self.path.parent.mkdir(parents=True, exist_ok=True)
            whole = self.path.with_name(f"{self.path.name}.new")
            lines = [{"adaptbot_eval": FORMAT, "key": self.key}, *kept]
            whole.write_text("".join(map(_line, lines)), encoding="utf-8")
            whole.replace(self.path)
            self._file = self.path.open("a", encoding="utf-8")
        except OSError as error:
            raise UsageError(f"cannot use {self.path} for results: {error.strerror}") from error

    def add(self, trial: Json) -> None:
        """Write a trial that has ended."""
        self.done[trial["id"], trial["arm"]] = trial
        self._write({"trial": trial})

    def close(self, keep: bool) -> None:
        """Close the file; remove it unless it is to be kept."""
        if self._file is not None:
            self._file.close()
            self._file = None
        if not keep:
            self.path.unlink(missing_ok=True)
            self.answers.unlink(missing_ok=True)

    def _write(self, line: Json) -> None:
        if self._file is not None:
            self._file.write(_line(line))
            self._file.flush()

    def _read(self) -> list[Json]:
        lines = bounded.read_text(self.path, bounded.GRAPH, UsageError).splitlines()
        found: list[Json] = []
        for number, line in enumerate(lines, start=1):
            try:
                name = f"{self.path}, line {number}: this"
                found.append(bounded.parse_json(line, name, UsageError))
            except UsageError:
                if number == len(lines):
                    break  # it was being written when the run ended: that trial is run again
                raise
        header = found[0] if found and isinstance(found[0], dict) else {}
        if lines and header.get("adaptbot_eval") != FORMAT:
            raise UsageError(f"{self.path} holds no results of `adaptbot eval`; name another file")
        if lines and header.get("key") != self.key:
            raise UsageError(
                f"{self.path} holds the results of another experiment (other settings, inputs or "
                "version); name another file, or delete it"
            )
        for told in found[1:]:
            if "trial" in told:
                self.done[told["trial"]["id"], told["trial"]["arm"]] = told["trial"]
        return found[1:]


def _line(told: Json) -> str:
    return json.dumps(told, ensure_ascii=False) + "\n"
