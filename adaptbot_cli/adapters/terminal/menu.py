"""A question with rows below it: what every prompt of this program is made of.

A menu does no input or output: it returns the lines to draw, and the answer to a key or, in the
plain face, to a line.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Any, ClassVar

from rich.text import Text

from adaptbot_cli.core.ask.questions import Choice
from adaptbot_cli.core.visible import visible

Line = Sequence[tuple[str, str]]
"""One line to draw: styles, each with its text."""

Check = Callable[[str], str]

BACK = Choice("back", "back")

OPEN: Any = object()
"""What a key or a line leads to that has not answered the question yet."""

_LONGEST, _LONGEST_NAME = 300, 70


def shown(text: str, style: str = "", longest: int = _LONGEST) -> Text:
    """Return text that is never markup nor an escape code, cut to a bearable length."""
    cut = Text(visible(text), style)
    cut.truncate(longest, overflow="ellipsis")
    return cut


def plain(text: str) -> str:
    """Return the same as a string, for prompts: they take no markup in strings."""
    return shown(text).plain


def title(name: str) -> str:
    """Return a name as it stands in a list: in words."""
    return shown(name.replace("_", " "), longest=_LONGEST_NAME).plain


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


@dataclass(frozen=True, slots=True)
class Row:
    """Something that can be pointed at: its `parts`, what follows from it (`then`), and a line that
    stands `above` it."""

    parts: Line
    then: str = ""
    above: str = ""


@dataclass
class Menu(ABC):
    """A question (`text`), rows of which one is pointed at, and keys.

    `back` is what Esc leads to, in a word, "" if to nothing. Subclasses define the rows and what
    becomes of a key; moving about, showing the keys and the numbered lines are the same for all.
    """

    KEYS: ClassVar[Sequence[tuple[str, str]]] = ()
    MOST: ClassVar[int] = 20
    """How many rows are shown at once."""
    ESCAPE: ClassVar[str] = "Esc"
    """The key that leads back, as the hint has it."""

    text: str
    back: str = ""
    at: int = 0
    note: str = field(default="", init=False)
    helping: bool = field(default=False, init=False)

    @abstractmethod
    def rows(self) -> Sequence[Row]:
        """Return what can be pointed at."""

    @abstractmethod
    def pressed(self, key: str) -> Any:
        """Return the answer that a key gives, `OPEN` if none yet."""

    @abstractmethod
    def hint(self, numbered: bool) -> str:
        """Return what stands beside the question: keys, or what a line may be."""

    def keys(self) -> Sequence[tuple[str, str]]:
        """Return the keys that ? shows, with what each does, besides moving about."""
        return self.KEYS

    def above(self) -> Sequence[Line]:
        """Return the lines between the question and the rows."""
        return ()

    def below(self, numbered: bool) -> Sequence[Line]:
        """Return the lines after the rows."""
        return ()

    def press(self, key: str) -> Any:
        """Return the answer that a key gives, `OPEN` if none yet."""
        if key == "?":
            self.helping = not self.helping
            return OPEN
        if key in ("up", "down"):
            self.at = (self.at + (1 if key == "down" else -1)) % max(len(self.rows()), 1)
            return OPEN
        if key == "escape" and not self.back:
            return OPEN
        return self.pressed(key)

    def read(self, line: str) -> Any:
        """Return the answer that a line gives: a row's number, or a key by its name."""
        if line.isdecimal() and 1 <= int(line) <= len(self.rows()):
            self.at = int(line) - 1
            return self.pressed("enter")
        return self.press(_NAMED.get(line, line))

    def draw(self, width: int, numbered: bool) -> list[Line]:
        """Return the lines to show; `numbered` is for the plain face."""
        key = "b" if numbered else self.ESCAPE
        back = f"{key}: {self.back}" if self.back else ""
        hint = ", ".join(part for part in (self.hint(numbered), back, "?: keys") if part)
        lines = [*heading(plain(self.text), hint, width), *self.above()]
        rows = self.rows()
        most = len(rows) if numbered else self.MOST
        top = max(0, min(self.at - most + 1, len(rows) - most))
        for n, row in enumerate(rows[top : top + most], start=top):
            if row.above:
                lines.append([("then", f"  {row.above}")])
            mark = ("pointer", " » ") if n == self.at else ("", "   ")
            number = "    " if row.parts[0][1].startswith(f"{n + 1})") else f" {n + 1:>2}. "
            lines += _drawn(row, ("", number) if numbered else mark, width)
        if len(rows) > top + most or top:
            lines.append([("then", f"   {len(rows) - most} more")])
        lines += [*self.below(numbered)]
        if self.note:
            lines.append([("bad", f"   {self.note}")])
        if self.helping:
            lines += self._help(numbered, width)
        return lines

    def _help(self, numbered: bool, width: int) -> list[Line]:
        if numbered:
            found = [("a line", self.hint(numbered)), ("b", self.back)]
        else:
            found = [("↑ ↓", "move"), *self.keys(), ("Esc", self.back)]
        found += [("Ctrl-C", "stop"), ("?", "hide this")]
        text = ", ".join(f"{key}: {what}" for key, what in found if what)
        return [[("then", f"   {part}")] for part in wrap(text, max(width - 5, 20))]


_NAMED = {"": "enter", "b": "escape", "esc": "escape", "-": "tab"}
"""What stands for a key on a line of its own."""


def _drawn(row: Row, mark: tuple[str, str], width: int) -> list[Line]:
    """A row's lines: what follows from it stands behind it, or below it where it has no room."""
    taken = sum(len(text) for _, text in (mark, *row.parts))
    if not row.then:
        return [[mark, *row.parts]]
    if taken + 2 + len(row.then) < width:
        return [[mark, *row.parts, ("then", f"  {row.then}")]]
    lines = wrap(row.then, max(width - 9, 20))
    return [[mark, *row.parts], *([("then", f"       {part}")] for part in lines)]


@dataclass
class Keys(Menu):
    """One of a few: the key of a choice is the answer, Enter takes the one that is pointed at.

    `by_enter` is whether Enter gave the answer.
    """

    ESCAPE = "b"

    choices: Sequence[Choice] = ()
    by_enter: bool = field(default=False, init=False)
    letters: list[str] = field(init=False)

    def __post_init__(self) -> None:
        """Give every choice a key: its own if all have one, else its number."""
        found = [choice.key for choice in self.choices]
        if not all(found) or len(set(found)) < len(found):
            found = [str(n) for n in range(1, len(found) + 1)]
        self.letters = found

    def hint(self, numbered: bool) -> str:
        """Return that one key is enough; or, of lines, which row Enter takes."""
        return f"a number or its letter, Enter: {self.at + 1}" if numbered else "one key"

    def read(self, line: str) -> Any:
        """Return the choice that a line gives: its words will do, too."""
        named = [n for n, c in enumerate(self.choices) if title(c.label).lower().startswith(line)]
        if len(line) > 1 and len(named) == 1:
            self.at = named[0]
            return self.pressed("enter")
        return super().read(line)

    def rows(self) -> Sequence[Row]:
        """Return the choices with their keys."""
        return [
            Row(
                [("highlighted" if n == self.at else "", f"{key}) {title(choice.label)}")],
                plain(choice.then),
            )
            for n, (choice, key) in enumerate(zip(self.choices, self.letters, strict=True))
        ]

    def keys(self) -> Sequence[tuple[str, str]]:
        """Return the letters, and that Enter takes what is pointed at."""
        return [("Enter", "take what is marked"), ("/".join(self.letters), "answer at once")]

    def pressed(self, key: str) -> Any:
        """Return the choice of a key."""
        if key == "enter":
            self.by_enter = True
            return self.choices[self.at]
        if key in self.letters:
            return self.choices[self.letters.index(key)]
        return BACK if self.back and key in ("escape", "b") else OPEN


YES, NO = Choice("yes", "yes", key="y"), Choice("no", "no", key="n")


@dataclass
class YesNo(Keys):
    """Yes or no; Enter is yes."""

    choices: Sequence[Choice] = (YES, NO)

    def hint(self, numbered: bool) -> str:
        """Return both keys."""
        return "y or n" if numbered else "Y/n"
