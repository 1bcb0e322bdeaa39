"""A small full-width prompt: lines drawn again at every key, gone when it is answered."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any, TextIO, cast

from prompt_toolkit.application import Application
from prompt_toolkit.data_structures import Point
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.input.defaults import create_input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.key_binding.key_processor import KeyPress
from prompt_toolkit.keys import Keys
from prompt_toolkit.layout import FormattedTextControl, Layout, Window
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.output.defaults import create_output
from prompt_toolkit.styles import Style
from rich.console import Console
from rich.text import Text

STYLE = {
    "qmark": "fg:ansicyan",
    "question": "bold",
    "answer": "fg:ansicyan",
    "pointer": "fg:ansicyan bold",
    "highlighted": "bold",
    "instruction": "italic",
    "then": "fg:ansibrightblack",
    "good": "fg:ansigreen",
    "bad": "fg:ansired",
}

Line = Sequence[tuple[str, str]]
"""One line to draw: styles, each with its text."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """Draws a prompt at the terminal that `console` writes to."""

    console: Console

    def run(self, draw: Callable[[], Sequence[Line]], keys: KeyBindings) -> Any:
        """Draw until a key ends it; return what it ended with. Raises KeyboardInterrupt."""

        def text() -> StyleAndTextTuples:
            lines = [_cut(line, self.console.width - 1) for line in draw()]
            parts: StyleAndTextTuples = []
            for line in lines:
                parts += [*line, ("", "\n")]
            return parts[:-1]

        control = FormattedTextControl(
            text, show_cursor=False, focusable=True, get_cursor_position=lambda: Point(0, 0)
        )
        for key in (Keys.ControlC, Keys.SIGINT):
            keys.add(key, eager=True)(_interrupt)
        keys.add(Keys.ControlJ)(_enter)
        app: Application[Any] = Application(
            Layout(Window(control, dont_extend_height=True)),
            key_bindings=keys,
            style=Style.from_dict(STYLE),
            erase_when_done=True,
            **terminal(self.console),
        )
        app.ttimeoutlen = 0.05  # Esc alone is a key of its own
        app.timeoutlen = 0.05
        return app.run()


def heading(text: str, hint: str, width: int) -> list[Line]:
    """Return the lines of a question with a hint after it: all of it can be read."""
    parts = wrap(f"{text}", max(width - 3, 20)) or [""]
    lines: list[list[tuple[str, str]]] = [[("", "  "), ("question", part)] for part in parts]
    lines[0][0] = ("qmark", "? ")
    if len(parts[-1]) + len(hint) + 7 > width:  # two spaces before each, parentheses, one to spare
        lines.append([("", "  ")])
    else:
        lines[-1].append(("", "  "))
    lines[-1].append(("instruction", f"({hint})"))
    return list(lines)


def terminal(console: Console) -> dict[str, Any]:
    """Where prompts appear and in which colours: stdout may hold a result that a program reads."""
    return {
        "output": create_output(stdout=cast(TextIO, console.file)),
        "input": create_input(always_prefer_tty=True),
        "color_depth": ColorDepth.DEPTH_1_BIT if console.no_color else None,
    }


def _interrupt(event: KeyPressEvent) -> None:
    event.app.exit(exception=KeyboardInterrupt, style="class:aborting")


def _enter(event: KeyPressEvent) -> None:
    """Take a line feed as Enter: that is what the terminal makes of it between two prompts."""
    event.key_processor.feed(KeyPress(Keys.ControlM), first=True)


def _cut(line: Line, width: int) -> list[tuple[str, str]]:
    """A line that fits the width: a wrapped one would push others out of sight."""
    left, parts = width, []
    for style, text in line:
        fitting = Text(text)
        fitting.truncate(max(left, 0), overflow="ellipsis")
        left -= fitting.cell_len
        if fitting.plain:
            parts.append((style and f"class:{style}", fitting.plain))
    return parts
