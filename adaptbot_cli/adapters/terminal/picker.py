"""One of many, found by typing; or a new one, where one may be told."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.keys import Keys

from adaptbot_cli.adapters.terminal.canvas import Canvas, Line, heading
from adaptbot_cli.adapters.terminal.words import plain, title
from adaptbot_cli.core.names import nearest, normal
from adaptbot_cli.core.questions import Choice

_ROWS = 12
_ALIKE, _SLIP = 3, 0.7
"""How many choices are shown that are written otherwise, and how alike they must be."""


@dataclass(slots=True)
class Picker:
    """A list that shows only what matches what is typed.

    `new` is what a new one is called ("a new place"), "" if there can be none; `taken` are the
    names that a new one cannot have. `back` is what Esc leads to, in a word, "" if to nothing.
    With `numbered` the values are numbers, found by how they begin, and labels are shown verbatim.
    """

    text: str
    choices: Sequence[Choice]
    new: str = ""
    taken: frozenset[str] = frozenset()
    back: str = ""
    typed: str = ""
    at: int = 0
    numbered: bool = False
    trouble: str = field(default="", init=False)

    def ask(self, canvas: Canvas) -> Choice | None:
        """Return what was picked, None if the person goes back."""
        draw = partial(self._draw, canvas.console.width)
        picked: Choice | None = canvas.run(draw, self._keys())
        return picked

    def matching(self) -> list[Choice]:
        """Return the choices whose labels hold what is typed: first the one that is called so, then
        those that begin so; a new one comes last."""
        wanted = self.typed.strip().lower()
        if self.numbered and wanted.isdigit():
            found = [choice for choice in self.choices if choice.value.startswith(wanted)]
            return sorted(found, key=lambda choice: choice.value != wanted)
        wanted = wanted.replace("_", " ")
        labels = [(title(choice.label).lower(), choice) for choice in self.choices]
        held = [(label, choice) for label, choice in labels if wanted in label]
        held.sort(key=lambda each: (each[0] != wanted, not each[0].startswith(wanted)))
        found = [choice for _, choice in held]
        name = normal(self.typed)
        known = {normal(choice.label) for choice in self.choices}
        alike = [] if found else self._alike(wanted)
        if self.new and name and name not in known:
            found.append(Choice(f"new {name}", f"{self.new}: {name}"))
        return [*found, *alike]

    def _alike(self, wanted: str) -> list[Choice]:
        """The choices that may be meant though they are written otherwise."""
        labels = {title(choice.label).lower(): choice for choice in self.choices}
        return [labels[label] for label in nearest(wanted, labels, _ALIKE, _SLIP)]

    def _draw(self, width: int) -> list[Line]:
        hints = [f"type to filter {len(self.choices)}"]
        hints += [f"or {self.new}"] if self.new else []
        hints += [f"Esc: {self.back}"] if self.back else []
        found = self.matching()
        lines: list[Line] = [
            *heading(plain(self.text), ", ".join(hints), width),
            [("", "  > "), ("answer", plain(self.typed)), ("", "▏")],
        ]
        top = max(0, min(self.at - _ROWS + 1, len(found) - _ROWS)) if found else 0
        top = max(top, 0)
        for n, choice in enumerate(found[top : top + _ROWS], start=top):
            here = n == self.at
            mark = ("pointer", " » ") if here else ("", "   ")
            then = f"  {plain(choice.then)}" if choice.then else ""
            told = plain(choice.label) if self.numbered else title(choice.label)
            label = ("highlighted" if here else "", told)
            lines.append([mark, label, ("then", then)])
        if not found:
            lines.append([("bad", f"   nothing matches “{plain(self.typed)}”")])
        elif len(found) > _ROWS:
            lines.append([("then", f"   {len(found) - _ROWS} more")])
        if self.trouble:
            lines.append([("bad", f"   {self.trouble}")])
        return lines

    def _keys(self) -> KeyBindings:
        keys = KeyBindings()

        @keys.add("up")
        def up(event: KeyPressEvent) -> None:
            self._move(-1)

        @keys.add("down")
        def down(event: KeyPressEvent) -> None:
            self._move(1)

        @keys.add("backspace")
        def shorten(event: KeyPressEvent) -> None:
            self._type(self.typed[:-1])

        @keys.add("c-u")
        def clear(event: KeyPressEvent) -> None:
            self._type("")

        @keys.add(Keys.BracketedPaste)
        @keys.add(Keys.Any)
        def write(event: KeyPressEvent) -> None:
            # names stand in the list in words
            text = event.data if self.numbered else event.data.replace("_", " ")
            if text.isprintable():
                self._type(self.typed + text)

        @keys.add("enter")
        def take(event: KeyPressEvent) -> None:
            self._take(event.app)

        if self.back:

            @keys.add("escape", eager=True)
            def leave(event: KeyPressEvent) -> None:
                event.app.exit(result=None)

        return keys

    def _move(self, by: int) -> None:
        self.at = (self.at + by) % max(len(self.matching()), 1)

    def _type(self, text: str) -> None:
        self.typed, self.at, self.trouble = text, 0, ""

    def _take(self, app: Any) -> None:
        found = self.matching()
        if not found:
            app.output.bell()
            return
        choice = found[self.at]
        typed = self.typed.strip()
        if self.numbered and typed.isdigit() and self.at == 0 and choice.value != typed:
            self.trouble = f"{typed} is not among them: type on"
            return
        name = choice.value.removeprefix("new ")
        if choice.value != name and name in self.taken:
            self.trouble = f"“{plain(name)}” is known already, as something else"
            return
        app.exit(result=choice)
