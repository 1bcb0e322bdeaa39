"""Prompts in a terminal: one key for one of a few, a line, yes or no.

None leaves anything on the screen: who asks says in a line what was answered. Ctrl-C raises
KeyboardInterrupt; questionary's own `ask` would turn it into None.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import questionary
from prompt_toolkit.completion import Completer
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent, merge_key_bindings
from prompt_toolkit.keys import Keys
from rich.console import Console

from adaptbot_cli.adapters.terminal.canvas import STYLE, Canvas, Line, heading, terminal
from adaptbot_cli.adapters.terminal.words import plain, title
from adaptbot_cli.core.questions import Choice

BACK = Choice("back", "back")


@dataclass(frozen=True, slots=True)
class Prompts:
    """Prompts at the terminal that `console` writes to."""

    console: Console

    def by_key(
        self,
        text: str,
        choices: Sequence[Choice],
        keys: Sequence[str],
        likely: str = "",
        back: bool = False,
    ) -> Choice:
        """Ask for one of a few: the key of a choice is the answer, Enter takes the marked one.

        `likely` is the value marked at first; with `back`, b gives `BACK`.
        """
        values = [choice.value for choice in choices]
        at = [values.index(likely) if likely in values else 0]
        hint = "one key, b: back" if back else "one key"

        def draw() -> list[Line]:
            lines = heading(plain(text), hint, self.console.width)
            for n, (choice, key) in enumerate(zip(choices, keys, strict=True)):
                here = n == at[0]
                mark = ("pointer", " » ") if here else ("", "   ")
                style = "highlighted" if here else ""
                then = f"  {plain(choice.then)}" if choice.then else ""
                lines.append([mark, (style, f"{key}) {title(choice.label)}"), ("then", then)])
            return lines

        bindings = KeyBindings()

        @bindings.add("up")
        def up(event: KeyPressEvent) -> None:
            at[0] = (at[0] - 1) % len(choices)

        @bindings.add("down")
        def down(event: KeyPressEvent) -> None:
            at[0] = (at[0] + 1) % len(choices)

        @bindings.add("enter")
        def take(event: KeyPressEvent) -> None:
            event.app.exit(result=choices[at[0]])

        for key, choice in (*zip(keys, choices, strict=True), *([("b", BACK)] if back else [])):
            bindings.add(key)(_giving(choice))
        if back:
            bindings.add("escape", eager=True)(_giving(BACK))
        return cast(Choice, Canvas(self.console).run(draw, bindings))

    def line(
        self,
        text: str,
        typed: str = "",
        check: Callable[[str], str] | None = None,
        completer: Completer | None = None,
    ) -> str:
        """Ask for a line of text; `check` says what is wrong with it, "" if nothing is.

        What does not pass stays to be mended.
        """

        def valid(value: str) -> bool | str:
            return (check(value) if check is not None else "") or True

        prompt = questionary.text(
            plain(text),
            default=typed,
            validate=valid,
            completer=completer,
            style=questionary.Style(list(STYLE.items())),
            **terminal(self.console),
        )
        return str(_ask(prompt)).strip()

    def yes(self, text: str) -> bool:
        """Ask for yes or no; Enter is yes."""
        style = questionary.Style(list(STYLE.items()))
        prompt = questionary.confirm(plain(text), style=style, **terminal(self.console))
        return bool(_ask(prompt))


def _giving(choice: Choice) -> Callable[[KeyPressEvent], None]:
    def give(event: KeyPressEvent) -> None:
        event.app.exit(result=choice)

    return give


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

    own = prompt.application.key_bindings
    prompt.application.key_bindings = merge_key_bindings([own, bindings] if own else [bindings])
