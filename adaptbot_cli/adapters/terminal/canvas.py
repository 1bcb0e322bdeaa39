"""Where prompts appear: one loop with one set of key handlers, or numbered lines where that is all.

A `Menu` has what is drawn and what a key does. `ask` shows it at a terminal, drawn again at every
key and gone when it is answered; or, where the terminal can do no more than lines (`TERM=dumb`), or
the person wants that (`ADAPTBOT_PLAIN=1`: a screen reader, a pipe), as numbered lines that are
answered by a line.
"""

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TextIO, cast

from rich.console import Console
from rich.text import Text

from adaptbot_cli.adapters.terminal.menu import OPEN, Check, Line, Menu, plain

if TYPE_CHECKING:
    from prompt_toolkit.completion import Completer
    from prompt_toolkit.formatted_text import StyleAndTextTuples

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


def is_plain(console: Console) -> bool:
    """Tell whether prompts are numbered lines, answered by lines."""
    wanted = os.environ.get("ADAPTBOT_PLAIN", "") not in ("", "0")
    return wanted or os.environ.get("TERM") == "dumb" or not console.is_terminal


def ask(menu: Menu, console: Console, follows: bool = False) -> Any:
    """Show a menu until a key or a line answers it; return the answer. Raises KeyboardInterrupt.

    What was typed before it was there to be read is thrown away, unless it `follows` from a key of
    the menu before.
    """
    return _by_lines(menu, console) if is_plain(console) else _by_keys(menu, console, follows)


def _forget_typed(keys: Any) -> None:
    from prompt_toolkit.input import typeahead

    typeahead.clear_typeahead(keys)
    with suppress(ImportError, OSError, AttributeError):  # no terminal of this kind
        import termios

        termios.tcflush(keys.fileno(), termios.TCIFLUSH)


def line(
    text: str,
    console: Console,
    typed: str,
    check: Check,
    completer: "Completer | None" = None,
    follows: bool = True,
) -> str:
    """Ask for a line of text; `check` says what is wrong with it, "" if nothing is.

    What does not pass stays to be mended; `follows` as in `ask`. Raises KeyboardInterrupt.
    """
    if is_plain(console):
        return _plain_line(text, console, check)
    import questionary

    def valid(value: str) -> bool | str:
        return (_KEYS_OF_A_LINE if value.strip() == "?" else check(value)) or True

    prompt = questionary.text(
        plain(text),
        default=typed,
        validate=valid,
        validate_while_typing=False,
        completer=completer,
        style=questionary.Style(list(STYLE.items())),
        erase_when_done=True,
        **terminal(console),
    )
    app = prompt.application
    _stop_on_signal(app)
    return str(app.run(pre_run=_unread(app, follows))).strip()


def _stop_on_signal(application: Any) -> None:
    """Let SIGINT do what the key does: prompt_toolkit takes the signal, questionary drops it."""
    from prompt_toolkit.key_binding import KeyBindings, merge_key_bindings
    from prompt_toolkit.keys import Keys

    bindings = KeyBindings()

    @bindings.add(Keys.SIGINT, eager=True)
    def stop(event: Any) -> None:
        event.app.exit(exception=KeyboardInterrupt, style="class:aborting")

    own = application.key_bindings
    application.key_bindings = merge_key_bindings([own, bindings] if own else [bindings])


_KEYS_OF_A_LINE = "Enter: take it, Ctrl-U: clear, Tab: complete, Ctrl-C: stop"


def _plain_line(text: str, console: Console, check: Check) -> str:
    while True:
        console.print(Text(f"? {plain(text)}"), soft_wrap=True)
        value = _read(console).strip()
        wrong = "type it, then Enter; an empty line leaves it open" if value == "?" else ""
        wrong = wrong or check(value)
        if not wrong:
            return value
        console.print(Text(f"  {plain(wrong)}"), soft_wrap=True)


def _by_lines(menu: Menu, console: Console) -> Any:
    before: list[Line] | None = None
    while True:
        drawn = menu.draw(console.width, numbered=True)
        for parts in drawn if drawn != before else ():
            console.print(Text("".join(text for _, text in parts).rstrip()), soft_wrap=True)
        if drawn == before:  # the line has changed nothing
            console.print(
                f"  that is none of these; {menu.hint(numbered=True)}, ?: keys", markup=False
            )
        before = drawn
        answer = menu.read(_read(console).strip())
        if answer is not OPEN:
            return answer


def _read(console: Console) -> str:
    """Read a line of the person's; the end of all input is as Ctrl-C."""
    console.print("> ", end="")
    typed = sys.stdin.readline()
    if not typed:
        raise KeyboardInterrupt
    return typed


def _by_keys(menu: Menu, console: Console, follows: bool) -> Any:
    from prompt_toolkit.application import Application
    from prompt_toolkit.data_structures import Point
    from prompt_toolkit.layout import FormattedTextControl, Layout, Window
    from prompt_toolkit.styles import Style

    def text() -> "StyleAndTextTuples":
        parts: StyleAndTextTuples = []
        for each in menu.draw(console.width, numbered=False):
            parts += [*_cut(each, console.width - 1), ("", "\n")]
        return parts[:-1]

    control = FormattedTextControl(
        text, show_cursor=False, focusable=True, get_cursor_position=lambda: Point(0, 0)
    )
    app: Application[Any] = Application(
        Layout(Window(control, dont_extend_height=True)),
        key_bindings=_keys(menu),
        style=Style.from_dict(STYLE),
        erase_when_done=True,
        **terminal(console),
    )
    app.ttimeoutlen = 0.05  # Esc alone is a key of its own
    app.timeoutlen = 0.05
    return app.run(pre_run=_unread(app, follows))


def _unread(app: Any, follows: bool) -> "Callable[[], None] | None":
    """What throws away what was typed before a prompt was there. It is done before the terminal is
    asked where its cursor is: else the answer to that goes with it."""
    return None if follows else lambda: _forget_typed(app.input)


def _keys(menu: Menu) -> Any:
    """The only key handlers: each gives the menu the name of its key."""
    from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
    from prompt_toolkit.key_binding.key_processor import KeyPress
    from prompt_toolkit.keys import Keys

    keys = KeyBindings()

    def press(event: KeyPressEvent, key: str) -> None:
        answer = menu.press(key)
        if answer is not OPEN:
            event.app.exit(result=answer)

    for name in ("up", "down", "enter", "tab", "backspace", "c-u"):
        keys.add(name)(lambda event, name=name: press(event, name))
    keys.add("escape", eager=True)(lambda event: press(event, "escape"))

    @keys.add(Keys.BracketedPaste)
    @keys.add(Keys.Any)
    def write(event: KeyPressEvent) -> None:
        if event.data.isprintable():
            press(event, event.data)

    @keys.add(Keys.ControlC, eager=True)
    @keys.add(Keys.SIGINT, eager=True)
    def interrupt(event: KeyPressEvent) -> None:
        event.app.exit(exception=KeyboardInterrupt, style="class:aborting")

    @keys.add(Keys.ControlJ)
    def line_feed(event: KeyPressEvent) -> None:
        """Take a line feed as Enter: the terminal makes it of that between two prompts."""
        event.key_processor.feed(KeyPress(Keys.ControlM), first=True)

    return keys


def terminal(console: Console) -> dict[str, Any]:
    """Where prompts appear and in which colours: stdout may hold a result that a program reads."""
    from prompt_toolkit.input.defaults import create_input
    from prompt_toolkit.output import ColorDepth
    from prompt_toolkit.output.defaults import create_output

    return {
        "output": create_output(stdout=cast(TextIO, console.file)),
        "input": create_input(always_prefer_tty=True),
        "color_depth": ColorDepth.DEPTH_1_BIT if console.no_color else None,
    }


def _cut(parts: Line, width: int) -> list[tuple[str, str]]:
    """A line that fits the width: a wrapped one would push others out of sight."""
    left, fitted = width, []
    for style, text in parts:
        fitting = Text(text)
        fitting.truncate(max(left, 0), overflow="ellipsis")
        left -= fitting.cell_len
        if fitting.plain:
            fitted.append((style and f"class:{style}", fitting.plain))
    return fitted
