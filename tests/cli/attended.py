"""A command in a real terminal: what is on its screen, and keys for it."""

import os
import re
import termios
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pexpect
from pexpect.fdpexpect import fdspawn

from tests.cli import forking
from tests.cli.command import Home
from tests.cli.forking import Process

UP, DOWN = "\x1b[A", "\x1b[B"
ENTER, ESC, CTRL_C, TAB, CTRL_U = "\r", "\x1b", "\x03", "\t", "\x15"
COLUMNS = 80
HINT = r"[^»]{0,160}?\((one key|type to|Y/n|Enter|Tab|Esc|a number|y or n|letters|2 no)"
"""What stands after a question that can be answered: which keys do it."""


@dataclass
class Tty:
    """A command in a terminal; `screen` is everything that has appeared on it so far."""

    process: Any
    command: Process
    screen: str = field(default="", init=False)

    def waits(self, question: str) -> "Tty":
        """Wait until a question can be answered."""
        self.process.expect(re.escape(question) + HINT)
        return self._seen(self.process.before + self.process.after)

    def answers(self, *dialogue: tuple[str, str]) -> "Tty":
        """Answer each question when it appears."""
        for question, keys in dialogue:
            self.waits(question)
            self.process.send(keys)
        return self

    def sees(self, *texts: str) -> "Tty":
        """Wait for texts, one after the other."""
        for text in texts:
            self.process.expect_exact(text)
            self._seen(self.process.before + self.process.after)
        return self

    def types(self, *keys: str) -> "Tty":
        """Send keys."""
        for each in keys:
            self.process.send(each)
        return self

    def ends(self) -> int:
        """Wait for the end; return the exit code."""
        self.process.expect(pexpect.EOF)
        self._seen(self.process.before)
        return self.command.wait()

    def kill(self) -> None:
        """Kill the command as nothing can be held back from."""
        self.command.kill()
        self.process.close()

    def _seen(self, text: str) -> "Tty":
        self.screen += text
        return self

    @property
    def plain(self) -> str:
        """What has appeared, without colours."""
        return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", self.screen)

    @property
    def said(self) -> str:
        """What has appeared, without colours, in one line however it was wrapped."""
        return " ".join(self.plain.split())


class _Terminal(fdspawn):  # type: ignore[misc]
    """A terminal whose person takes a moment before the keys, as with `pexpect.spawn`."""

    def send(self, s: str) -> int:
        time.sleep(0.05)
        return int(super().send(s))


@contextmanager
def tty(
    home: Home,
    *arguments: str,
    entry: str = forking.ADAPTBOT,
    out: Path | None = None,
    **env: str,
) -> Iterator[Tty]:
    """Run a command in a terminal of 80 columns that is gone afterwards, however the test went.

    With `out` its standard output is that file.
    """
    environment = home.environment(
        **{"TERM": "xterm-256color", "PROMPT_TOOLKIT_NO_CPR": "1", **env}
    )
    with ExitStack() as stack:
        keys, screen = os.openpty()
        termios.tcsetwinsize(screen, (50, COLUMNS))
        written = stack.enter_context(out.open("wb")).fileno() if out else screen
        streams = (screen, written, screen)
        command = forking.start(arguments, home.folder, environment, streams, True, entry)
        os.close(screen)
        opened = Tty(_Terminal(keys, encoding="utf-8", timeout=60), command)
        stack.callback(opened.kill)
        yield opened
