"""The human port: a person who answers at the terminal, or nobody."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.terminal.words import shown, title
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.questions import (
    ABSENT,
    EXISTS,
    LATER,
    NO,
    UNKNOWN,
    YES,
    Answer,
    Choice,
    Question,
)
from adaptbot_cli.core.terms import local

if TYPE_CHECKING:
    from adaptbot_cli.adapters.terminal.prompts import Prompts

_SAME, _WHICH = "is", 'Which one is "{}"?'
_KEYS = {YES: "y", NO: "n", UNKNOWN: "d", EXISTS: "y", ABSENT: "n", _SAME: "a", LATER.value: "l"}
_MOST_BY_KEY = 9


class AbsentHuman:
    """Nobody: every question is left for later, and what was learned may be kept."""

    def ask(self, question: Question) -> Answer:
        """Return `LATER`."""
        return LATER

    def review(self, lessons: tuple[Lesson, ...]) -> bool:
        """Return True: nothing is learned that would need somebody's consent."""
        return True


@dataclass(frozen=True, slots=True)
class TerminalHuman:
    """The person at the terminal that `console` writes to; the keyboard is the terminal's as well.

    Answers bear `by` and the time `now` says. Ctrl-C at any prompt raises KeyboardInterrupt.
    """

    console: Console
    by: str
    now: Callable[[], str]

    def ask(self, question: Question) -> Answer:
        """Ask one question; `LATER` itself is returned for "ask me later"."""
        self._above(question)
        said = self._said(question)
        self._answered(question.text, said.label)
        return LATER if said.value == LATER.value else Answer(said.value, self.by, self.now())

    def review(self, lessons: tuple[Lesson, ...]) -> bool:
        """Show what was learned, fact by fact, and ask whether to keep it."""
        if not lessons:
            return True
        self.console.print(_lesson_table(lessons))
        kept = self._prompts().yes("Keep this?")
        self._answered("Keep this?", "yes" if kept else "no")
        return kept

    def _prompts(self) -> "Prompts":
        from adaptbot_cli.adapters.terminal.prompts import Prompts

        return Prompts(self.console)

    def _above(self, question: Question) -> None:
        """What the person needs to know for the answer: the step, and the names like this one."""
        if question.context:
            self.console.print(shown(f"step: {question.context}", "dim"))
        if question.near:
            self.console.print(shown(f"near it: {sentence_list(question.near)}", "dim"))

    def _answered(self, text: str, label: str) -> None:
        line = Text.assemble(("? ", "cyan"), shown(text), "  ", shown(label, "cyan"))
        self.console.print(line)

    def _said(self, question: Question) -> Choice:
        """What was said, as the value to keep and the words to show."""
        if not question.choices:
            value = self._prompts().line(question.text)
            return Choice(value or UNKNOWN, value or "I don't know")
        choices = [c for c in question.choices if c.value != _SAME or question.known]
        while True:
            said = self._choose(question.text, choices)
            if said.value != _SAME:
                return said
            which = _WHICH.format(title(question.about))
            known = [Choice(name, name) for name in question.known]
            name = self._prompts().by_typing(which, known, back=True)
            if name is not None:
                return Choice(f"{_SAME} {name.value}", f"it is {name.label}")

    def _choose(self, text: str, choices: Sequence[Choice]) -> Choice:
        if len(choices) <= _MOST_BY_KEY:
            return self._prompts().by_key(text, choices, _keys(choices))
        return self._prompts().by_typing(text, choices, back=False) or Choice(UNKNOWN, UNKNOWN)


def _keys(choices: Sequence[Choice]) -> list[str]:
    """A key for each choice: its letter if all have one of their own, else its number."""
    keys = [_KEYS.get(choice.value, "") for choice in choices]
    if all(keys) and len(set(keys)) == len(keys):
        return keys
    return [str(n) for n in range(1, len(choices) + 1)]


def _lesson_table(lessons: Sequence[Lesson]) -> Table:
    """Every lesson with the facts that would be kept, in the graph's own words."""
    table = Table.grid(padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column(width=1)
    table.add_column(overflow="fold")
    for lesson in lessons:
        table.add_row(Text("✓", "green"), shown(lesson.sentence, "bold"))
        for sign, style, fact in _facts(lesson):
            table.add_row("", Text.assemble((sign, style), " ", shown(fact, "dim")))
    return table


def _facts(lesson: Lesson) -> list[tuple[str, str, str]]:
    """The facts of a lesson with their signs; a new action as one, whatever describes it."""
    if lesson.action is not None:
        takes = ", ".join(parameter.name for parameter in lesson.action.parameters)
        return [("+", "green", f"action {lesson.action.name}({takes})")]
    removed = sorted(" ".join(map(local, triple)) for triple in lesson.delta.removed)
    added = sorted(" ".join(map(local, triple)) for triple in lesson.delta.added)
    return [*(("−", "red", fact) for fact in removed), *(("+", "green", fact) for fact in added)]
