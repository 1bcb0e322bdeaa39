"""Prompts in a terminal: one key for one of a few, typing for one of many, a line, yes or no.

None leaves anything on the screen: who asks says in a line what was answered. Ctrl-C raises
KeyboardInterrupt; questionary's own `ask` would turn it into None.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TextIO, cast

import questionary
from prompt_toolkit.filters import Always, Condition
from prompt_toolkit.input.defaults import create_input
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent, merge_key_bindings
from prompt_toolkit.keys import Keys
from prompt_toolkit.layout.dimension import Dimension
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.output.defaults import create_output
from questionary.prompts.common import InquirerControl
from rich.console import Console

from adaptbot_cli.adapters.terminal.words import plain, title
from adaptbot_cli.core.questions import Choice

_ROWS = 12
_STYLE = questionary.Style(
    [
        ("qmark", "fg:ansicyan"),
        ("question", "bold"),
        ("answer", "fg:ansicyan"),
        ("pointer", "fg:ansicyan bold"),
        ("highlighted", "bold"),
        ("instruction", "italic"),
        ("search_success", "noinherit fg:ansigreen"),
        ("search_none", "noinherit fg:ansired"),
    ]
)


@dataclass(frozen=True, slots=True)
class Prompts:
    """Prompts at the terminal that `console` writes to."""

    console: Console

    def by_key(self, text: str, choices: Sequence[Choice], keys: Sequence[str]) -> Choice:
        """Ask for one of a few: the key of a choice is the answer."""
        keyed = zip(choices, keys, strict=True)
        prompt = questionary.select(
            plain(text),
            [questionary.Choice(title(c.label), c, shortcut_key=key) for c, key in keyed],
            use_shortcuts=True,
            use_jk_keys=False,
            instruction="(one key)",
            **self._terminal(),
        )
        _answer_by_key(prompt, keys)
        return cast(Choice, _ask(prompt))

    def by_typing(self, text: str, choices: Sequence[Choice], back: bool) -> Choice | None:
        """Ask for one of many, narrowed by typing; None if the person goes back, where one can."""
        prompt = questionary.select(
            plain(text),
            [questionary.Choice(title(choice.label), choice) for choice in choices],
            use_search_filter=True,
            use_jk_keys=False,
            instruction=f"(type to filter {len(choices)}{', Esc: back' if back else ''})",
            **self._terminal(),
        )
        _narrow_by_typing(prompt, back)
        return cast("Choice | None", _ask(prompt))

    def line(self, text: str) -> str:
        """Ask for a line of text."""
        return str(_ask(questionary.text(plain(text), **self._terminal()))).strip()

    def yes(self, text: str) -> bool:
        """Ask for yes or no; Enter is yes."""
        return bool(_ask(questionary.confirm(plain(text), **self._terminal())))

    def _terminal(self) -> dict[str, Any]:
        """How prompts look, and where: stdout may hold a result that a program reads."""
        return {
            "style": _STYLE,
            "output": create_output(stdout=cast(TextIO, self.console.file)),
            "input": create_input(always_prefer_tty=True),
            "color_depth": ColorDepth.DEPTH_1_BIT if self.console.no_color else None,
        }


def _ask(prompt: questionary.Question) -> Any:
    _stop_on_signal(prompt)
    prompt.application.erase_when_done = True
    return prompt.unsafe_ask()


def _stop_on_signal(prompt: questionary.Question) -> None:
    """Let SIGINT do what the key does: prompt_toolkit takes the signal, questionary drops it."""
    bindings = KeyBindings()

    @bindings.add(Keys.SIGINT, eager=True)
    def stop(event: KeyPressEvent) -> None:
        event.app.exit(exception=KeyboardInterrupt, style="class:aborting")

    _bind(prompt, bindings)


def _control(prompt: questionary.Question) -> InquirerControl:
    """The list of a select prompt, cut to a height that leaves what stands above in sight."""
    for window in prompt.application.layout.find_all_windows():
        if isinstance(window.content, InquirerControl):
            window.height = Dimension(max=_ROWS)
            window.dont_extend_height = Always()
            return window.content
    raise AssertionError("a select prompt has a list")


def _bind(prompt: questionary.Question, keys: KeyBindings) -> None:
    """Add keys to a prompt; they go before its own."""
    own = prompt.application.key_bindings
    prompt.application.key_bindings = merge_key_bindings([own, keys] if own else [keys])


def _answer_by_key(prompt: questionary.Question, keys: Sequence[str]) -> None:
    """Let the key of a choice give the answer at once: questionary only moves the pointer to it."""
    control, bindings = _control(prompt), KeyBindings()

    def bind(index: int, key: str) -> None:
        @bindings.add(key, eager=True)
        def answer(event: KeyPressEvent) -> None:
            event.app.exit(result=control.choices[index].value)

    for index, key in enumerate(keys):
        bind(index, key)
    _bind(prompt, bindings)


def _narrow_by_typing(prompt: questionary.Question, back: bool) -> None:
    """Mend what is missing in questionary's filter.

    It takes only ASCII, and shows everything where nothing matches, so that Enter would take the
    first name of all.
    """
    control, bindings = _control(prompt), KeyBindings()

    @Condition
    def nothing_matches() -> bool:
        wanted = (control.search_filter or "").lower()
        return not any(wanted in str(choice.title).lower() for choice in control.choices)

    def narrow(event: KeyPressEvent) -> None:
        typed = event.data.replace("_", " ")  # names stand in the list in words
        if typed.isprintable():
            control.search_filter = (control.search_filter or "") + typed
            control.pointed_at = 0

    bindings.add(Keys.Any)(narrow)
    bindings.add("_", eager=True)(narrow)

    @bindings.add(Keys.ControlM, eager=True, filter=nothing_matches)
    def stay(event: KeyPressEvent) -> None:
        event.app.output.bell()

    if back:

        @bindings.add(Keys.Escape, eager=True)
        def leave(event: KeyPressEvent) -> None:
            event.app.exit(result=None)

    _bind(prompt, bindings)
