"""One of many, found by typing; or a new one, where that is allowed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from adaptbot_cli.adapters.terminal.menu import OPEN, Line, Menu, Row, plain, title
from adaptbot_cli.core.ask.questions import Choice, Names
from adaptbot_cli.core.names import nearest, normal

_ALIKE, _SLIP = 3, 0.7
"""How many choices are shown that are written otherwise, and how alike they must be."""


@dataclass
class Picker(Menu):
    """A list that shows only what matches what is typed; the answer is a `Choice`, None for back.

    `new` is what a new one is called ("a new place"), "" if there can be none; `taken` are the
    names that a new one cannot have; `others` finds more choices by what is typed. With `numbered`
    the values are numbers, found by how they begin, and labels are shown verbatim.
    """

    KEYS = (("letters", "filter"), ("Ctrl-U", "show all"), ("Enter", "take what is marked"))
    MOST = 12

    choices: Sequence[Choice] = ()
    new: str = ""
    taken: Names = Names()  # noqa: RUF009 - it cannot be changed
    others: Names = Names()  # noqa: RUF009
    typed: str = ""
    numbered: bool = False

    def matching(self) -> list[Choice]:
        """Return the choices whose labels hold what is typed: first the one that is called so, then
        those that begin so; a new one comes last."""
        wanted = self.typed.strip().lower()
        if self.numbered and wanted.isdigit():
            found = [choice for choice in self.choices if choice.value.startswith(wanted)]
            return sorted(found, key=lambda choice: choice.value != wanted)
        wanted = wanted.replace("_", " ")
        labels = {title(choice.label).lower(): choice for choice in self.choices}
        held = [label for label in labels if wanted in label]
        held.sort(key=lambda label: (label != wanted, not label.startswith(wanted)))
        found = [labels[label] for label in held]
        name, known = normal(self.typed), {normal(choice.label) for choice in self.choices}
        if name and self.others.more and len(found) < self.MOST:
            more = [other for other in self.others.others(name) if normal(other) not in known]
            found += [Choice(m, m) for m in more if wanted in title(m).lower()]
            known.update(map(normal, more))
        alike = [] if found else nearest(wanted, labels, _ALIKE, _SLIP)
        is_new = self.new and name and name not in known
        new = [Choice(f"new {name}", f"{self.new}: {name}")] if is_new else []
        return [*found, *new, *map(labels.__getitem__, alike)]

    def hint(self, numbered: bool) -> str:
        """Return how many there are to filter, and what else can be given."""
        size, new = str(len(self.choices)), f", or {self.new}" if self.new else ""
        size += " and find others" if self.others.more else ""
        if numbered:
            return f"letters: filter {size}{new}; a number: take it"
        return f"type to filter {size}{new}"

    def above(self) -> Sequence[Line]:
        """Return what is typed."""
        return [[("", "  > "), ("answer", plain(self.typed)), ("", "▏")]]

    def rows(self) -> Sequence[Row]:
        """Return what matches."""
        written = plain if self.numbered else title
        return [
            Row([("highlighted" if n == self.at else "", written(c.label))], plain(c.then))
            for n, c in enumerate(self.matching())
        ]

    def below(self, numbered: bool) -> Sequence[Line]:
        """Say what to do where nothing matches."""
        if self.matching():
            return ()
        out = f", Esc: {self.back}" if self.back else ""
        keys = f"   Backspace: a letter less, Ctrl-U: all of them{out}"
        return [
            [("bad", f"   nothing matches “{plain(self.typed)}”")],
            [("then", "" if numbered else keys)],
        ]

    def read(self, line: str) -> Any:
        """Filter by a line, or pick by its number; steps are picked by their own."""
        if line == "b" and self.back:
            return None
        if line and line != "?" and (self.numbered or not line.isdecimal()):
            self._type(line)
            return self._take() if len(self.matching()) == 1 else OPEN
        return super().read(line)

    def pressed(self, key: str) -> Any:
        """Filter, or take what is pointed at."""
        if key == "escape":
            return None
        if key == "enter":
            return self._take()
        if key == "backspace":
            self._type(self.typed[:-1])
        elif key == "c-u":
            self._type("")
        elif key != "tab":
            # names stand in the list in words
            self._type(self.typed + (key if self.numbered else key.replace("_", " ")))
        return OPEN

    def _type(self, text: str) -> None:
        self.typed, self.at, self.note = text, 0, ""

    def _take(self) -> Any:
        found = self.matching()
        if not found:
            return OPEN
        choice = found[self.at]
        typed = self.typed.strip()
        if self.numbered and typed.isdigit() and self.at == 0 and choice.value != typed:
            self.note = f"{typed} is not among them: type on"
            return OPEN
        name = choice.value.removeprefix("new ")
        if choice.value != name and self.taken.meant(name):
            self.note = f"“{plain(name)}” is known already, as something else"
            return OPEN
        return choice
