"""A command in a real terminal: what is on its screen, and keys for it."""

import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pexpect

from tests.cli.command import Home

ENTER, ESC, CTRL_C, TAB, CTRL_U = "\r", "\x1b", "\x03", "\t", "\x15"
COLUMNS = 80


@dataclass
class Tty:
    """A command in a terminal; `screen` is everything that has appeared on it so far."""

    process: Any
    screen: str = field(default="", init=False)

    def waits(self, question: str) -> "Tty":
        """Wait until a question can be answered: a hint in parentheses stands on its line."""
        self.process.expect(re.escape(question) + r"[^(]*\([^\r\n]*")
        self.screen += self.process.before + self.process.after
        return self

    def answers(self, *dialogue: tuple[str, str]) -> "Tty":
        """Answer each question when it appears."""
        for question, keys in dialogue:
            self.waits(question)
            self.process.send(keys)
        return self

    def ends(self) -> int:
        """Wait for the end; return the exit code."""
        self.process.expect(pexpect.EOF)
        self.screen += self.process.before
        self.process.close()
        return int(self.process.exitstatus)

    def kill(self) -> None:
        """Kill the command as nothing can be held back from."""
        self.process.kill(signal.SIGKILL)
        self.process.close()

    @property
    def said(self) -> str:
        """What has appeared, without colours, in one line however it was wrapped."""
        return " ".join(re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", self.screen).split())


@contextmanager
def tty(home: Home, *arguments: str, **env: str) -> Iterator[Tty]:
    """Run a command in a terminal of 80 columns that is gone afterwards, however the test went."""
    process = pexpect.spawn(
        sys.executable,
        ["-m", "adaptbot_cli", *arguments],
        cwd=str(home.folder),
        dimensions=(50, COLUMNS),
        encoding="utf-8",
        timeout=60,
        env=home.environment(**{"TERM": "xterm-256color", "PROMPT_TOOLKIT_NO_CPR": "1", **env}),
    )
    opened = Tty(process)
    try:
        yield opened
    finally:
        process.close(force=True)
