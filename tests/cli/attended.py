"""A command in a real terminal: what is on its screen, and keys for it."""

import os
import re
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pexpect
from pexpect.fdpexpect import fdspawn

from tests.cli import forking
from tests.cli.command import Home
from tests.cli.forking import Process

ENTER, ESC, CTRL_C, TAB, CTRL_U = "\r", "\x1b", "\x03", "\t", "\x15"
COLUMNS = 80


@dataclass
class Tty:
    """A command in a terminal; `screen` is everything that has appeared on it so far."""

    process: Any
    command: Process
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
        return self.command.wait()

    def kill(self) -> None:
        """Kill the command as nothing can be held back from."""
        self.command.kill()
        self.process.close()

    @property
    def said(self) -> str:
        """What has appeared, without colours, in one line however it was wrapped."""
        return " ".join(re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", self.screen).split())


class _Terminal(fdspawn):  # type: ignore[misc]
    """A terminal whose person takes a moment before the keys, as with `pexpect.spawn`."""

    def send(self, s: str) -> int:
        time.sleep(0.05)
        return int(super().send(s))


def begin(home: Home, *arguments: str, rows: int = 50, **env: str) -> tuple[Any, Process]:
    """Run a command in a terminal; return the terminal, as pexpect has it, and the process."""
    environment = home.environment(
        **{"TERM": "xterm-256color", "PROMPT_TOOLKIT_NO_CPR": "1", **env}
    )
    keys, screen = os.openpty()
    termios.tcsetwinsize(screen, (rows, COLUMNS))
    command = forking.start(arguments, home.folder, environment, (screen,) * 3, terminal=True)
    os.close(screen)
    return _Terminal(keys, encoding="utf-8", timeout=60), command


@contextmanager
def tty(home: Home, *arguments: str, **env: str) -> Iterator[Tty]:
    """Run a command in a terminal of 80 columns that is gone afterwards, however the test went."""
    opened = Tty(*begin(home, *arguments, **env))
    try:
        yield opened
    finally:
        opened.kill()
