"""Everything learned in one list, to keep, to keep in part, or to correct."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent

from adaptbot_cli.adapters.terminal.canvas import Canvas, Line
from adaptbot_cli.adapters.terminal.words import plain
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.questions import Key, Reviewed
from adaptbot_cli.core.teach import resting_on

TITLE = "Keep this?"
_HINT = "Enter: yes, Space: leave out, c: correct, n: nothing, Esc: back"
_ROWS = 20


@dataclass(slots=True)
class Review:
    """The lessons of a run, each ticked until the person unticks it."""

    lessons: Sequence[Lesson]
    at: int = 0
    left_out: set[Key] = field(default_factory=set)

    def ask(self, canvas: Canvas) -> bool | Reviewed:
        """Return True to keep all, False to keep nothing, else what is made of it."""
        said: bool | Reviewed = canvas.run(self._draw, self._keys())
        return said

    def ticked(self) -> bool | Reviewed:
        """Return what is kept as the list stands: True for all."""
        return Reviewed(frozenset(self.left_out)) if self.left_out else True

    def _draw(self) -> list[Line]:
        lines: list[Line] = [
            [
                ("qmark", "? "),
                ("question", TITLE),
                ("instruction", f"  ({_HINT})"),
            ]
        ]
        top = max(0, min(self.at - _ROWS // 2, len(self.lessons) - _ROWS))
        for n, lesson in enumerate(self.lessons[top : top + _ROWS], start=top):
            here, out = n == self.at, lesson.question.key in self.left_out
            mark = ("pointer", " » ") if here else ("", "   ")
            tick = ("then", "✗ ") if out else ("good", "✓ ")
            style = "then" if out else "highlighted" if here else ""
            lines.append([mark, tick, (style, plain(lesson.sentence))])
        left = len(self.lessons) - _ROWS
        return [*lines, *([[("then", f"   {left} more")]] if left > 0 else [])]

    def _keys(self) -> KeyBindings:
        keys = KeyBindings()

        @keys.add("up")
        def up(event: KeyPressEvent) -> None:
            self.at = (self.at - 1) % len(self.lessons)

        @keys.add("down")
        def down(event: KeyPressEvent) -> None:
            self.at = (self.at + 1) % len(self.lessons)

        @keys.add("space")
        def tick(event: KeyPressEvent) -> None:
            self._turn(self.lessons[self.at].question.key)

        @keys.add("enter")
        @keys.add("y")
        def keep(event: KeyPressEvent) -> None:
            event.app.exit(result=self.ticked())

        @keys.add("n")
        def refuse(event: KeyPressEvent) -> None:
            event.app.exit(result=False)

        @keys.add("c")
        def correct(event: KeyPressEvent) -> None:
            event.app.exit(result=Reviewed(back=self.lessons[self.at].question.key))

        @keys.add("escape", eager=True)
        def back(event: KeyPressEvent) -> None:
            event.app.exit(result=Reviewed(back=self.lessons[-1].question.key))

        return keys

    def _turn(self, key: Key) -> None:
        """Leave a lesson out with all that rests on it, or take it in with what it rests on."""
        if key not in self.left_out:
            self.left_out = resting_on({*self.left_out, key}, self.lessons)
            return
        others = {k for k in self.left_out if key not in resting_on({k}, self.lessons)}
        self.left_out = others - {key}
