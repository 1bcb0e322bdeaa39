"""A model's answer on the screen while it comes."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.spinner import Spinner
from rich.text import Text

from adaptbot_cli.adapters.display.cells import WARNING, count, hanging, noted, plain_text

LINES = 8
"""How many lines of the answer are seen at once: the whole plan is shown when it is checked."""


@dataclass(slots=True)
class Stream:
    """Shows the end of the answer as it comes, at a terminal; what is odd about it, everywhere."""

    console: Console
    name: str

    @contextmanager
    def answering(self) -> Iterator[Callable[[str, bool], None]]:
        """Show that the model is asked; what is given takes the text as it comes."""
        if not self.console.is_terminal or self.console.is_dumb_terminal:
            yield lambda text, reasoning: None
            return
        view = _View(self.name, self.console)
        with Live(view, console=self.console, transient=True, refresh_per_second=10):
            yield view.add

    def tell(self, sentence: str) -> None:
        """Print a line."""
        self.console.print(hanging(noted(WARNING, sentence)))


@dataclass(slots=True)
class _View:
    """The last lines of an answer, and how long it takes; the text is kept in lines, each with
    whether it is reasoning, which is dimmed."""

    name: str
    console: Console
    lines: list[tuple[str, bool]] = field(default_factory=lambda: [("", False)])
    started: float = field(default_factory=time.monotonic)
    spinner: Spinner = field(default_factory=lambda: Spinner("dots", style="cyan"))

    def add(self, text: str, reasoning: bool) -> None:
        """Take text as it comes; a line without end is no reason to keep all of it."""
        first, *rest = text.replace("\r", "\n").split("\n")
        self.lines[-1] = (self.lines[-1][0] + first, reasoning)
        self.lines += ((line, reasoning) for line in rest)

    def __rich__(self) -> RenderableType:
        shown = [line for line in self.lines[-LINES - 20 :] if line[0].strip()][-LINES:]
        width = max(self.console.width - 4, 8)
        found = [
            Text("  ").append_text(plain_text(line, "dim" if reasoning else "", width))
            for line, reasoning in shown
        ]
        seconds = time.monotonic() - self.started
        words = f" {self.name}: {count(len(shown) and len(self.lines), 'line')} · {seconds:.0f} s"
        if not found:
            words = f" waiting for {self.name} · {seconds:.0f} s · Ctrl-C stops it"
        self.spinner.update(text=plain_text(words, "dim", width))
        return Group(*found, self.spinner)
