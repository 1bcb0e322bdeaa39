"""All that is to be known of one thing on one screen, the likely answers filled in."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.keys import Keys

from adaptbot_cli.adapters.terminal.canvas import Canvas, Line, heading
from adaptbot_cli.adapters.terminal.words import plain, title
from adaptbot_cli.core.questions import (
    AS_BEFORE,
    IN_FORMS,
    LATER,
    NO,
    UNKNOWN,
    YES,
    Key,
    Question,
    Suggestion,
)

_ANSWERS = {"y": YES, "n": NO, "d": UNKNOWN}
_SHOWN = {UNKNOWN: "don't know"}
_LABEL, _VALUE = 22, 16


@dataclass(slots=True)
class Row:
    """A question of the form: `value` as it is to be answered, why it is likely, and whether the
    person has told it."""

    question: Question
    needed: bool
    value: str = ""
    reason: str = ""
    told: bool = False

    @property
    def given(self) -> str:
        """What the line was answered before the person went back to another one, "" if nothing."""
        return "" if self.question.given == LATER.value else self.question.given

    @property
    def kept(self) -> bool:
        """Whether the line stands as it was answered before."""
        return bool(self.question.given) and self.value == self.given


@dataclass(frozen=True, slots=True)
class Edit:
    """The person wants to pick or write the value of a row, and has typed its beginning."""

    row: int
    typed: str = ""


BACK = "back"


@dataclass(slots=True)
class Form:
    """The questions about one thing. What is `needed` must be answered, the rest may be left."""

    rows: list[Row]
    at: int = 0
    note: str = field(default="", init=False)

    @classmethod
    def of(
        cls, needed: Sequence[Question], offered: Sequence[Question], cursor: Key | None = None
    ) -> "Form":
        """Return a form with the likely answers filled in, at the line of the key `cursor`."""
        rows = [Row(q, n < len(needed)) for n, q in enumerate((*needed, *offered))]
        for row in rows:
            suggested = row.question.suggested or Suggestion("", "")
            row.value = row.given or suggested.value
            row.reason = AS_BEFORE if row.given else suggested.reason
            row.told = suggested.reason == AS_BEFORE
        form = cls(rows)
        at = [n for n, row in enumerate(rows) if row.question.key == cursor]
        form.at = next(iter(at or form.lacking()), 0)
        return form

    def lacking(self) -> list[int]:
        """Return the rows that are needed and have no answer."""
        rows = enumerate(self.rows)
        return [n for n, row in rows if row.needed and not row.value and not self.follows(row)]

    def follows(self, row: Row) -> str:
        """Return the answer of a row that follows from another row's, "" if none does."""
        values = {other.question.prop: other.value for other in self.rows}
        found = (f.value for f in row.question.follows if values.get(f.prop) == f.equals)
        return next(found, "")

    def fill(self, row: int, value: str) -> None:
        """Answer a row and go on to the next."""
        self.rows[row].value, self.rows[row].reason, self.rows[row].told = value, "", True
        self.at = min(row + 1, len(self.rows) - 1)
        self.note = ""

    def answers(self, with_rest: bool) -> dict[Key, str]:
        """Return the values by question; of what is not needed only where one is given.

        What stands as it was answered before is not among them.
        """
        return {
            row.question.key: self.follows(row) or row.value
            for row in self.rows
            if (row.needed or with_rest or (row.given and row.told))
            and (self.follows(row) or row.value)
            and not row.kept
        }

    def told(self) -> dict[Key, str]:
        """Return what the person has told so far, by question: likely answers are not told."""
        rows = (row for row in self.rows if row.told and row.value and not row.kept)
        return {row.question.key: row.value for row in rows}

    def corrected(self, told: Iterable[Key]) -> list[Key]:
        """Return which of some questions have another answer already."""
        there = {row.question.key for row in self.rows if row.question.given}
        return [key for key in told if key in there]

    def ask(self, canvas: Canvas) -> "bool | Edit | str":
        """Return whether the rest is taken too, a row to edit, or that the person goes back."""
        said: bool | Edit | str = canvas.run(
            partial(self._draw, canvas.console.width), self._keys()
        )
        return said

    def _draw(self, width: int) -> list[Line]:
        about = title(self.rows[0].question.about)
        needed = [row for row in self.rows if row.needed]
        lines: list[Line] = [
            *heading(f"What do you know of {about}?", _hint(self), width),
        ]
        context = next((row.question.context for row in needed if row.question.context), "")
        if context:
            lines.append([("then", f"  needed for {plain(context)}")])
        for n, row in enumerate(self.rows):
            if not row.needed and (n == 0 or self.rows[n - 1].needed):
                lines.append([("then", "  not needed now, but good to know:")])
            lines.append(self._line(n, row))
        lines.append([("", "  "), ("highlighted", plain(self.rows[self.at].question.text))])
        lines.append([("bad" if self.note else "then", f"  {self.note or self._help()}")])
        return lines

    def _line(self, n: int, row: Row) -> Line:
        here = n == self.at
        follows = self.follows(row)
        value = follows or row.value
        shown = _SHOWN.get(value, title(value.removeprefix("new "))) or "?"
        reason = "follows" if follows else row.reason
        reason = "new" if value.startswith("new ") else reason
        return [
            ("pointer", " » ") if here else ("", "   "),
            ("highlighted" if here else "", f"{plain(row.question.label):<{_LABEL}} "),
            ("answer" if value else "bad" if row.needed else "then", f"{shown:<{_VALUE}} "),
            ("then", plain(reason)),
        ]

    def _help(self) -> str:
        question = self.rows[self.at].question
        if question.kind == "attribute":
            return "y: yes, n: no, d: I don't know, ↑↓: another line"
        if question.kind == "place":
            return "type where, Enter on an empty line: the list, ↑↓: another line"
        return f"type {f'a {question.number}' if question.number else 'it'}, ↑↓: another line"

    def _keys(self) -> KeyBindings:
        keys = KeyBindings()

        @keys.add("up")
        def up(event: KeyPressEvent) -> None:
            self.at = (self.at - 1) % len(self.rows)

        @keys.add("down")
        def down(event: KeyPressEvent) -> None:
            self.at = (self.at + 1) % len(self.rows)

        @keys.add("escape", eager=True)
        def leave(event: KeyPressEvent) -> None:
            if self.rows[0].question.answered:
                event.app.exit(result=BACK)

        @keys.add("enter")
        def take(event: KeyPressEvent) -> None:
            self._end(event, with_rest=True)

        @keys.add("tab")
        def skip(event: KeyPressEvent) -> None:
            self._end(event, with_rest=False)

        @keys.add("backspace")
        def clear(event: KeyPressEvent) -> None:
            row = self.rows[self.at]
            row.value, row.reason = UNKNOWN if row.given else "", ""
            row.told = row.told or bool(row.given)

        @keys.add(Keys.Any)
        def write(event: KeyPressEvent) -> None:
            self._type(event)

        return keys

    def _end(self, event: KeyPressEvent, with_rest: bool) -> None:
        lacking = self.lacking()
        if not lacking:
            event.app.exit(result=with_rest)
        elif self.at in lacking and self.rows[self.at].question.kind != "attribute":
            event.app.exit(result=Edit(self.at))
        else:
            self.at = lacking[0]
            self.note = "this is still to be answered; d: I don't know"

    def _type(self, event: KeyPressEvent) -> None:
        question = self.rows[self.at].question
        if not event.data.isprintable():
            return
        if question.kind != "attribute":
            event.app.exit(result=Edit(self.at, event.data))
        elif event.data.lower() in _ANSWERS:
            self.fill(self.at, _ANSWERS[event.data.lower()])


def _hint(form: Form) -> str:
    hints = ["Enter: take this"]
    if any(not row.needed for row in form.rows):
        needed = any(row.needed for row in form.rows)
        hints.append("Tab: only what is needed" if needed else "Tab: skip")
    if form.rows[0].question.answered:
        hints.append("Esc: back")
    return ", ".join(hints)


def answered_by_form(question: Question) -> bool:
    """Tell whether a question belongs on a form: others come with it, or a likely answer."""
    several = bool(question.together or question.offered)
    typed: Any = question.kind in IN_FORMS
    return bool(typed and (several or question.suggested))
