"""All that is to be known of one thing on one screen, the likely answers filled in."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from adaptbot_cli.adapters.terminal.menu import OPEN, Line, Menu, Row, plain, title
from adaptbot_cli.core.ask.questions import (
    AS_BEFORE,
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
class Entry:
    """A question of the form: the `value` of its answer, the `reason` why it is likely, and whether
    the person has `entered` it."""

    question: Question
    needed: bool
    value: str = ""
    reason: str = ""
    entered: bool = False

    @property
    def given(self) -> str:
        """What the line was answered before the person went back to another one, "" if nothing."""
        return "" if self.question.given == LATER.value else self.question.given

    @property
    def kept(self) -> bool:
        """Whether the line stands as it was answered before."""
        return bool(self.question.given) and self.value == self.given

    @property
    def accepted(self) -> str:
        """Why the answer is likely, where it stands as it was suggested, "" if it does not."""
        likely = self.question.suggested
        if likely is None or self.entered or self.value != likely.value:
            return ""
        return likely.reason


@dataclass(frozen=True, slots=True)
class TypedValue:
    """The person wants to pick or write the value of an entry, and has typed its beginning."""

    row: int
    typed: str = ""


BACK = "back"


@dataclass
class Form(Menu):
    """The questions about one thing. What is `needed` must be answered, the rest may be left.

    The answer is whether the rest is taken too, an `Edit`, or `BACK`.
    """

    KEYS = (
        ("Enter", "take all of it"),
        ("Tab", "take only what is needed"),
        ("y/n/d", "yes, no, I don't know"),
        ("Backspace", "take the answer out"),
        ("letters", "another answer"),
    )

    entries: Sequence[Entry] = ()

    @classmethod
    def of(
        cls, needed: Sequence[Question], offered: Sequence[Question], cursor: Key | None = None
    ) -> "Form":
        """Return a form with the likely answers filled in, at the line of the key `cursor`."""
        entries = [Entry(q, n < len(needed)) for n, q in enumerate((*needed, *offered))]
        for row in entries:
            suggested = row.question.suggested or Suggestion("", "")
            row.value = row.given or suggested.value
            row.reason = AS_BEFORE if row.given else suggested.reason
            row.entered = suggested.reason == AS_BEFORE
        first = entries[0].question
        text = f'What do you know of "{title(first.about)}"?'
        form = cls(text, "back" if first.answered else "", entries=entries)
        at = [n for n, row in enumerate(entries) if row.question.key == cursor]
        form.at = next(iter(at or form.lacking()), 0)
        return form

    def lacking(self) -> list[int]:
        """Return the rows that are needed and have no answer."""
        entries = enumerate(self.entries)
        return [n for n, row in entries if row.needed and not row.value and not self.follows(row)]

    def follows(self, row: Entry) -> str:
        """Return the answer of a row that follows from another row's, "" if none does."""
        values = {other.question.prop: other.value for other in self.entries}
        found = (f.value for f in row.question.follows if values.get(f.prop) == f.equals)
        return next(found, "")

    def fill(self, row: int, value: str) -> None:
        """Answer a row and go on to the next."""
        self.entries[row].value, self.entries[row].reason, self.entries[row].entered = (
            value,
            "",
            True,
        )
        self.at = min(row + 1, len(self.entries) - 1)
        self.note = ""

    def answers(self, with_rest: bool) -> dict[Key, str]:
        """Return the values by question; of what is not needed only where one is given.

        What stands as it was answered before is not among them.
        """
        return {
            row.question.key: self.follows(row) or row.value
            for row in self.entries
            if (row.needed or with_rest or (row.given and row.entered))
            and (self.follows(row) or row.value)
            and not row.kept
        }

    def accepted(self) -> dict[Key, str]:
        """Return why, of the answers that stand as they were suggested."""
        return {row.question.key: row.accepted for row in self.entries if row.accepted}

    def entered(self) -> dict[Key, str]:
        """Return the answers that the person has given, by question; likely ones are left out."""
        rows = (row for row in self.entries if row.entered and row.value and not row.kept)
        return {row.question.key: row.value for row in rows}

    def hint(self, numbered: bool) -> str:
        """Return how the form is taken; and, of lines, how one of it is changed."""
        needed = {row.needed for row in self.entries}
        rest = "only what is needed" if True in needed else "skip"
        key = "-" if numbered else "Tab"
        change = "2 no: line 2 is no, " if numbered else ""
        return f"{change}Enter: take this" + (f", {key}: {rest}" if False in needed else "")

    def above(self) -> Sequence[Line]:
        """Return what the form is needed for."""
        needed = (row.question.context for row in self.entries if row.needed)
        context = next(filter(None, needed), "")
        return [[("then", f"  needed for {plain(context)}")]] if context else ()

    def rows(self) -> Sequence[Row]:
        """Return a line for each question, with its answer and where that is from."""
        return [self._row(n, entry) for n, entry in enumerate(self.entries)]

    def below(self, numbered: bool) -> Sequence[Line]:
        """Return the question that is pointed at, and how it is answered by keys."""
        if numbered:
            return ()
        return [
            [("", "  "), ("highlighted", plain(self.entries[self.at].question.text))],
            *([] if self.note else [[("then", f"  {self._help_of_line()}")]]),
        ]

    def _row(self, n: int, entry: Entry) -> Row:
        follows = self.follows(entry)
        value = follows or entry.value
        shown = _SHOWN.get(value, title(value.removeprefix("new "))) or "?"
        reason = "follows" if follows else entry.reason
        reason = "new" if value.startswith("new ") else reason
        first = not entry.needed and (n == 0 or self.entries[n - 1].needed)
        parts = (
            ("highlighted" if n == self.at else "", f"{plain(entry.question.label):<{_LABEL}} "),
            ("answer" if value else "bad" if entry.needed else "then", f"{shown:<{_VALUE}} "),
            ("then", plain(reason)),
        )
        return Row(parts, above="not needed now, but good to know:" if first else "")

    def _help_of_line(self) -> str:
        question = self.entries[self.at].question
        if question.kind == "attribute":
            return "y: yes, n: no, d: I don't know, ↑↓: another line"
        if question.kind == "place":
            return "type where, Enter on an empty line: the list, ↑↓: another line"
        return f"type {f'a {question.number}' if question.number else 'it'}, ↑↓: another line"

    def read(self, line: str) -> Any:
        """Answer a line by its number and the answer: `2 yes`, `1 fridge`; a number alone asks."""
        number, _, value = line.partition(" ")
        if not number.isdecimal() or not 1 <= int(number) <= len(self.entries):
            return OPEN if len(line) > 1 and line != "esc" else super().read(line)
        self.at = int(number) - 1
        question = self.entries[self.at].question
        if question.kind != "attribute":
            return TypedValue(self.at, value.strip())
        return self.pressed(value.strip()[:1]) if value.strip() else OPEN

    def pressed(self, key: str) -> Any:
        """Take the form, leave it, or change the line that is pointed at."""
        entry = self.entries[self.at]
        if key == "escape":
            return BACK
        if key in ("enter", "tab"):
            return self._end(with_rest=key == "enter")
        if key == "backspace":
            entry.value, entry.reason = UNKNOWN if entry.given else "", ""
            entry.entered = entry.entered or bool(entry.given)
        elif key != "c-u" and entry.question.kind != "attribute":
            return TypedValue(self.at, key)
        elif key.lower() in _ANSWERS:
            self.fill(self.at, _ANSWERS[key.lower()])
        return OPEN

    def _end(self, with_rest: bool) -> Any:
        lacking = self.lacking()
        if not lacking:
            return with_rest
        if self.at in lacking and self.entries[self.at].question.kind != "attribute":
            return TypedValue(self.at)
        self.at = lacking[0]
        self.note = "this is still to be answered; d: I don't know"
        return OPEN


def answered_by_form(question: Question) -> bool:
    """Tell whether a question belongs on a form: others come with it, or a likely answer."""
    several = bool(question.together or question.offered)
    return question.spec.together and (several or question.suggested is not None)
