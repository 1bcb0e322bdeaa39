"""Everything learned in one list, to keep, to keep in part, or to correct."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from adaptbot_cli.adapters.terminal.menu import OPEN, Line, Menu, Row, plain
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Key, Reviewed
from adaptbot_cli.core.ask.teach import resting_on
from adaptbot_cli.core.names import sentence_list

TITLE = "Keep this?"


@dataclass
class ReviewList(Menu):
    """The lessons of a run, each ticked until the person unticks it.

    The answer is True to keep all, False to keep nothing, else what is made of it. `went` are, for
    each lesson that was left out, those that went with it: they come back with it.
    """

    KEYS = (
        ("Enter or y", "keep what is ticked"),
        ("Space", "leave a line out, or take it in again"),
        ("c", "correct it"),
        ("n", "keep nothing"),
    )

    text: str = TITLE
    back: str = "back"
    lessons: Sequence[Lesson] = ()
    left_out: set[Key] = field(default_factory=set)
    went: dict[Key, set[Key]] = field(default_factory=dict, init=False)
    note: str = field(default="", init=False)

    def ticked(self) -> bool | Reviewed:
        """Return what is kept as the list stands: True for all."""
        return Reviewed(frozenset(self.left_out)) if self.left_out else True

    def hint(self, numbered: bool) -> str:
        """Return how all is kept, a line left out, nothing kept."""
        one = "a number: leave that out" if numbered else "Space: leave out"
        return f"Enter: yes, {one}, n: nothing"

    def rows(self) -> Sequence[Row]:
        """Return the lessons, those left out crossed."""
        found = []
        for n, lesson in enumerate(self.lessons):
            out = lesson.question.key in self.left_out
            style = "then" if out else "highlighted" if n == self.at else ""
            likely = lesson.answer.suggestion and f"suggested, {plain(lesson.answer.suggestion)}"
            tick = ("then", "✗ ") if out else ("good", "✓ ")
            found.append(Row([tick, (style, plain(lesson.sentence))], likely))
        return found

    def below(self, numbered: bool) -> Sequence[Line]:
        """Say what went or came with the line that was changed last."""
        return [[("then", f"   {plain(self.note)}")]] if self.note else ()

    def read(self, line: str) -> Any:
        """Leave out or take in by number; `c N` corrects."""
        letter, _, number = line.partition(" ")
        wanted = number if letter == "c" else line
        if wanted.isdecimal() and 1 <= int(wanted) <= len(self.lessons):
            self.at = int(wanted) - 1
            return self.pressed("c" if letter == "c" else " ")
        return super().read(line)

    def pressed(self, key: str) -> Any:
        """Keep, refuse, tick or go back."""
        here = self.lessons[self.at].question.key
        if key == " ":
            self._turn(here)
        if key in ("enter", "y"):
            return self.ticked()
        if key == "n":
            return False
        if key in ("c", "escape"):
            return Reviewed(back=here if key == "c" else self.lessons[-1].question.key)
        return OPEN

    def _turn(self, key: Key) -> None:
        """Leave a lesson out with all that rests on it; or take it in, with what it rests on and
        what went with it."""
        before = set(self.left_out)
        if key not in self.left_out:
            self.left_out = resting_on({*self.left_out, key}, self.lessons)
            self.went[key] = self.left_out - before
        else:
            kept = {key, *self.went.pop(key, set())}
            kept |= {k for k in self.left_out if key in resting_on({k}, self.lessons)}
            self.left_out = resting_on(self.left_out - kept, self.lessons)
        changed = (before ^ self.left_out) - {key}
        others = [each.sentence for each in self.lessons if each.question.key in changed]
        how = "left out with it" if key in self.left_out else "taken in with it"
        self.note = f"{how}: {sentence_list(others)}" if others else ""
