"""The human port: a person who answers at the terminal, or nobody."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from adaptbot_cli.adapters.terminal import canvas
from adaptbot_cli.adapters.terminal.menu import BACK, Keys, YesNo, shown, title
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.ask.edit import Edit as PlanEdit
from adaptbot_cli.core.ask.learning import Lesson, number_trouble
from adaptbot_cli.core.ask.questions import (
    AS_BEFORE,
    INSTEAD,
    LATER,
    SAME,
    STOP,
    UNKNOWN,
    Answer,
    Choice,
    Key,
    Question,
    Reviewed,
    back,
)
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.turns import Amend

if TYPE_CHECKING:
    from adaptbot_cli.adapters.terminal.form import Form

_WHICH = {
    SAME: 'Which one is "{}"?',
    INSTEAD: 'What is used instead of "{}", this time only?',
}
_MOST_BY_KEY = 9
_KEEP = "Keep what you have told so far?"


class AbsentHuman:
    """Nobody: every question is left for later, and what was learned may be kept."""

    def ask(self, question: Question) -> Answer:
        """Return `LATER`."""
        return LATER

    def review(self, lessons: tuple[Lesson, ...]) -> bool:
        """Return True: nothing is learned that would need somebody's consent."""
        return True


@dataclass(slots=True)
class TerminalHuman:
    """The person at the terminal that `console` writes to; the keyboard is the terminal's as well.

    Answers bear `by` and the time from `now`. Ctrl-C at a question or the review asks whether to
    keep what was answered; where nothing was, and at other prompts, it raises KeyboardInterrupt.
    A form answers several questions at once: `entered` are the answers to those still to come, also
    of a form that was left by Ctrl-C; `stopping` when they are all that is still to be had.
    `first` maps each line of a form to the question that the form was shown for: going back to the
    line leads there, with the `cursor` at it; `corrected` are other lines that were changed then.
    `left_out` is what the last review left out, where a correction leads back to it. With `edits` a
    plan is offered for editing before it is executed, whatever is open; with `rejects` it may be
    rejected for another. `accepted` tells of likely answers that were taken as they stood why they
    were likely. What was typed before a question was there to be read is thrown away.
    """

    console: Console
    by: str
    now: Callable[[], str]
    entered: dict[Key, str] = field(default_factory=dict)
    filled: set[str] = field(default_factory=set)
    edits: bool = False
    rejects: bool = True
    accepted: dict[Key, str] = field(default_factory=dict, init=False)
    stopping: bool = field(default=False, init=False)
    left_out: set[Key] = field(default_factory=set, init=False)
    first: dict[Key, Key] = field(default_factory=dict, init=False)
    cursor: Key | None = field(default=None, init=False)
    corrected: list[Key] = field(default_factory=list, init=False)

    def ask(self, question: Question) -> Answer:
        """Ask one question; `LATER` itself is returned for "ask me later"."""
        if self.corrected:
            return back(self.corrected.pop())
        if self.stopping:
            return self._left(question)
        if question.key in self.entered:
            return self._answer(question, _choice_of(question, self.entered.pop(question.key)))
        try:
            choice = self._choice(question)
        except KeyboardInterrupt:
            self._stop(question)
            return self.ask(question)
        if self.corrected:
            return back(self.corrected.pop())
        self.entered.pop(question.key, None)
        return self._answer(question, choice)

    def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
        """Ask for what nothing needs yet, unless a form has asked for it already."""
        about = questions[0].about
        if self.corrected:
            return (back(self.corrected.pop()),)
        if about not in self.filled and not self.stopping:
            try:
                marked = self._fill((), (*questions, *questions[0].offered))
            except KeyboardInterrupt:
                self._stop(questions[0])
                marked = True
            if marked is None:
                return (self._back(questions[0]),)
            if self.corrected:
                return (back(self.corrected.pop()),)
        self.filled.discard(about)
        found = [(question, self.entered.pop(question.key, "")) for question in questions]
        answers = [
            self._answer(question, _choice_of(question, value)) if value else LATER
            for question, value in found
        ]
        if self.stopping:
            self.stopping = False
            answers[-1] = replace(answers[-1], last=True)
        return tuple(answers)

    def review(self, lessons: tuple[Lesson, ...]) -> bool | Reviewed:
        """Show everything learned, and ask whether to keep it, which part, or what to correct."""
        if not lessons:
            return True
        from adaptbot_cli.adapters.terminal.review import TITLE, ReviewList

        there = {lesson.question.key for lesson in lessons}
        review = ReviewList(lessons=lessons, left_out=self.left_out & there)
        try:
            reply = canvas.ask(review, self.console)
        except KeyboardInterrupt:
            if not self._agrees():
                raise
            reply = review.ticked()
        self.left_out = review.left_out
        if isinstance(reply, Reviewed):
            out = len(reply.left_out)
            text = "a correction" if reply.back else f"all but {out}"
            self._echo(TITLE, text)
            return replace(reply, back=reply.back and self._target(reply.back))
        for lesson in lessons if reply else ():
            self.console.print(Text.assemble(("✓ ", "green"), shown(lesson.sentence)))
        self._echo(TITLE, "yes" if reply else "no")
        return bool(reply)

    def amend(self, turn: Amend) -> PlanEdit | None:
        """Ask for a change of the plan: one key, then what it takes."""
        if self.stopping or (turn.why == "ready" and not self.edits):
            return None
        from adaptbot_cli.adapters.terminal.plan_editor import ask_for_edit

        edit, text = ask_for_edit(turn, self.console, self.rejects)
        self._echo("Change the plan?", text)
        return edit and replace(edit, by=self.by, at=self.now())

    def _agrees(self) -> bool:
        return bool(canvas.ask(YesNo(_KEEP), self.console).value == "yes")

    def _answer(self, question: Question, value: Choice) -> Answer:
        if value.value == BACK.value:
            return self._back(question)
        likely = self.accepted.pop(question.key, "")
        self._echo(question.text, f"{value.label} (suggested, {likely})" if likely else value.label)
        if value.value == LATER.value:
            return LATER
        return Answer(value.value, self.by, self.now(), suggestion=likely)

    def _back(self, question: Question) -> Answer:
        """Go to the question before this one."""
        before = question.answered[-1][0]
        self._echo(question.text, f"back to: {before.text}")
        first = self._target(before.key)
        there = any(asked.key == first for asked, _ in question.answered)
        return back(first if there else before.key)

    def _target(self, key: Key) -> Key:
        """The question to go back to so that the whole form comes again, if it is a line of one."""
        self.entered.clear()
        self.filled.clear()
        self.cursor = key
        return self.first.get(key, key)

    def _stop(self, question: Question) -> None:
        """After Ctrl-C: keep the answers so far, and ask no more. Ctrl-C again gives up."""
        answered = any(a.value not in (LATER.value, UNKNOWN) for _, a in question.answered)
        if not (answered or self.entered) or not self._agrees():
            raise KeyboardInterrupt
        self._echo(_KEEP, "yes")
        self.stopping = True

    def _left(self, question: Question) -> Answer:
        """Return an answer from before Ctrl-C; nothing more is asked after the last one."""
        value = self.entered.pop(question.key, "")
        if question.spec.together:
            to_come = {other.key for other in (*question.together, *question.offered)}
            for key in self.entered.keys() - to_come:
                del self.entered[key]  # it is not asked any more, as another answer tells it
        self.stopping = bool(self.entered)
        if not value:
            return LATER if self.entered else STOP
        answer = self._answer(question, _choice_of(question, value))
        return replace(answer, last=not self.entered)

    def _above(self, question: Question) -> None:
        """What the person needs to know: the step, or the question whose answer named a new place,
        and the names like this one."""
        if question.context:
            raised = any(each.text == question.context for each, _ in question.answered)
            lead = "" if raised or question.kind == "contradiction" else "step: "
            self.console.print(shown(f"{lead}{question.context}", "dim"))
        for note in question.notes:
            self.console.print(shown(note))
        near = [name for name in question.near if name not in question.alike]
        for text, names in (("near it", near), ("only spelled alike", question.alike)):
            if names:
                self.console.print(shown(f"{text}: {sentence_list(names)}", "dim"))

    def _echo(self, text: str, label: str) -> None:
        line = Text.assemble(("? ", "cyan"), shown(text), "  ", shown(label, "cyan"))
        self.console.print(line)

    def _choice(self, question: Question) -> Choice:
        """Ask a question; return the answer with the words to show."""
        from adaptbot_cli.adapters.terminal.form import answered_by_form

        if answered_by_form(question):
            marked = self._fill((question, *question.together), question.offered)
            if marked is None:
                return BACK
            return _choice_of(question, self.entered[question.key])
        self._above(question)
        if question.spec.entry == "line" or not question.choices:
            return self._line(question, first=True)
        if question.spec.entry == "list" or len(question.choices) > _MOST_BY_KEY:
            return self._pick(question, "back" if question.answered else "", first=True) or BACK
        return self._few(question)

    def _few(self, question: Question) -> Choice:
        choices = [c for c in question.choices if c.value not in _WHICH or question.known]
        likely = question.suggested
        marked = likely.value if likely else question.spec.marked
        at = next((n for n, choice in enumerate(choices) if choice.value == marked), 0)
        if likely:
            why = f"suggested, {likely.reason}"
            choices = [replace(c, then=why) if c.value == marked else c for c in choices]
        again = False
        while True:
            back = "back" if question.answered else ""
            menu = Keys(question.text, back, at, choices=choices)
            value: Choice = canvas.ask(menu, self.console, follows=again)
            if menu.by_enter and likely and (value.value, likely.reason) != (marked, AS_BEFORE):
                self.accepted[question.key] = likely.reason if value.value == marked else ""
            if value.value not in _WHICH:
                return value
            again = True
            text = _WHICH[value.value].format(question.about)
            known = tuple(Choice(name, name) for name in question.known)
            which = Question("existence", "", text, choices=known, further=question.known)
            name = self._pick(which, "back")
            if name is not None:
                lead = "it is" if value.value == SAME else "this time only:"
                return Choice(f"{value.value} {name.value}", f"{lead} {name.label}")

    def _fill(self, needed: Sequence[Question], offered: Sequence[Question]) -> bool | None:
        """Have a form filled in; None if the person goes back."""
        from adaptbot_cli.adapters.terminal.form import BACK, Form, TypedValue

        form = Form.of(needed, offered, self.cursor)
        self.cursor = None
        keys = [row.question.key for row in form.entries]
        # Where each line is asked; a thing has one form at a time.
        self.first = {key: to for key, to in self.first.items() if key[1] != keys[0][1]}
        self.first.update(dict.fromkeys(keys, keys[0]))
        edited = False
        while True:
            try:
                reply = canvas.ask(form, self.console, follows=edited)
                if isinstance(reply, TypedValue):
                    self._edit(form, reply.row, reply.typed)
                    edited = True
                    continue
            except KeyboardInterrupt:
                self._take(form, form.entered())
                raise
            if reply == BACK:
                return None
            self._take(form, form.answers(bool(reply)))
            self.accepted.update(form.accepted())
            if offered:
                self.filled.add(form.entries[0].question.about)
            return True

    def _take(self, form: "Form", record: dict[Key, str]) -> None:
        self.entered.update(record)
        given = {row.question.key for row in form.entries if row.question.given}
        self.corrected = [key for key in record if key in given]

    def _edit(self, form: "Form", row: int, typed: str) -> None:
        question = form.entries[row].question
        is_line = question.kind == "value"
        found = self._line(question, typed) if is_line else self._pick(question, "back", typed)
        if found is not None:
            form.fill(row, found.value)

    def _pick(
        self, question: Question, back: str, typed: str = "", first: bool = False
    ) -> Choice | None:
        new = "a new place" if question.kind == "place" else ""
        menu = Picker(
            question.text,
            back,
            choices=question.choices,
            new=new,
            taken=question.known,
            others=question.further,
            typed=typed,
        )
        picked: Choice | None = canvas.ask(menu, self.console, follows=not first)
        return picked and _choice_of(question, picked.value)

    def _line(self, question: Question, typed: str = "", first: bool = False) -> Choice:
        def check(value: str) -> str:
            return number_trouble(question.number, value)

        value = canvas.line(question.text, self.console, typed, check, follows=not first)
        return Choice(value or UNKNOWN, value or "I don't know")


def _choice_of(question: Question, value: str) -> Choice:
    """The choice that a value stands for, with the words to show."""
    labels = {choice.value: title(choice.label) for choice in question.choices}
    if value.startswith("new "):
        return Choice(value, f"{title(value.removeprefix('new '))} (new)")
    return Choice(value, labels.get(value, "I don't know" if value == UNKNOWN else title(value)))
