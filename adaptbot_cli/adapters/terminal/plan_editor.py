"""The menu in which a person changes a plan: one key, then the step and what it becomes."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from rich.console import Console

from adaptbot_cli.adapters.terminal import canvas
from adaptbot_cli.adapters.terminal.menu import BACK, Keys, shown
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.ask.edit import Edit, EditableCall, EditKind, called, edited, lines
from adaptbot_cli.core.ask.learning import finder
from adaptbot_cli.core.ask.new_action.draft import signature
from adaptbot_cli.core.ask.questions import MOST_SHOWN, Choice, Names
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.turns import Amend
from adaptbot_cli.errors import UsageError

_LEAVE = "leave"
_MOST = 5
"""How many open findings are listed above the menu."""
_MENU = (
    Choice(_LEAVE, "leave it as it is", key="l"),
    Choice("replace", "replace a step", key="r"),
    Choice("drop", "drop a step", key="d"),
    Choice("insert", "insert a step", key="i"),
    Choice("move", "move a step", key="m"),
    Choice(
        "reject", "reject the whole plan", "the model is asked for another, with your reason", "x"
    ),
)
_NO_CALL = "this is no call: an action's name, then what it acts on in parentheses"
_TEXT = {
    "asked": "How shall the plan change?",
    "open": "No question solves what is open. How shall the plan change?",
    "ready": "The plan is ready. Shall it change?",
}


def ask_for_edit(turn: Amend, console: Console, rejects: bool) -> tuple[Edit | None, str]:
    """Ask for one edit; return it with its description, None if the plan is left as it is.

    That the plan is rejected is only offered where somebody `rejects` it for another.
    """
    there = lines(turn.report)
    without = {*(() if there else _OF_A_STEP), *(() if rejects else ("reject",))}
    choices = [choice for choice in _MENU if choice.value not in without]
    for finding in turn.report.open[:_MOST] if turn.why == "open" else ():
        where = f"step {finding.step}: " if finding.step else ""
        console.print(shown(f"✗ {where}{finding.message}", "red"))
    while True:
        picked = canvas.ask(Keys(_TEXT[turn.why], "leave it", choices=choices), console).value
        if picked in (_LEAVE, BACK.value):
            return None, "no"
        edit = _edit(picked, turn, there, console)
        if edit is not None:
            return edit, _describe(edit, there)


def _edit(kind: EditKind, turn: Amend, there: Sequence[EditableCall], out: Console) -> Edit | None:
    """Ask what an edit takes; None for back."""
    if kind == "reject":
        reason = canvas.line("What is wrong with it? (Enter alone: back)", out, "", lambda _: "")
        return Edit(kind, text=reason) if reason else None
    before = "Insert it before which step?" if kind == "insert" else ""
    step = _step(before or f"{kind.capitalize()} which step?", there, out, turn if before else None)
    if step is None or kind == "drop":
        return None if step is None else Edit(kind, step)
    if kind == "move":
        return _moved(step, turn, there, out)
    old = next((line.call.render() for line in there if line.number == step), "")
    asked = f"Step {step} becomes" if kind == "replace" else "The new step is"
    text = _call(asked, old if kind == "replace" else "", turn.kg, out)
    return Edit(kind, step, text=text) if text else None


def _moved(step: int, turn: Amend, there: Sequence[EditableCall], out: Console) -> Edit | None:
    to = _step("To before which step?", there, out, turn)
    if to is None:
        return None
    edit, stay = Edit("move", step, to), Edit("move", step, step)
    if edited(edit, turn.report, parse) != edited(stay, turn.report, parse):
        return edit
    out.print(shown("  that is where it stands", "dim"))
    return None


_OF_A_STEP = frozenset({"replace", "drop", "move"})


def _step(
    text: str, there: Sequence[EditableCall], out: Console, whole: Amend | None
) -> int | None:
    """Ask for one of the steps that the plan writes; of a `whole` plan its end will do, too, which
    is one more than the last. None for back."""
    choices = [Choice(str(line.number), f"{line.number}  {line.call.render()}") for line in there]
    if whole is not None:
        choices.append(Choice(str(len(whole.report.steps) + 1), "at the end"))
    picked = canvas.ask(Picker(text, "back", choices=choices, numbered=True), out, follows=True)
    return None if picked is None else int(picked.value)


def _call(text: str, typed: str, kg: Kg, out: Console) -> str:
    """Ask for a call until it is one; nothing for back."""

    def check(message: str) -> str:
        try:
            return "" if not message.strip() or called(message, parse) else _NO_CALL
        except UsageError:
            return _NO_CALL

    asked = f"{text} (Tab completes, empty: back)"
    message = canvas.line(asked, out, typed, check, Completions.of(kg))
    return "\n".join(call.render() for call in called(message, parse)) if message else ""


@dataclass(frozen=True, slots=True)
class Completions(Completer):
    """Completes the names of actions before the parenthesis and those of things inside it."""

    actions: Sequence[tuple[str, str]]
    things: Names

    @classmethod
    def of(cls, kg: Kg) -> "Completions":
        """Return the names of a graph: actions with what they take, things."""
        actions = [(a.name, signature(a.name, a.parameters)) for a in kg.domain.actions.values()]
        kinds = [kind.iri for kind in kg.domain.teachable]
        few = sorted(map(kg.name, kg.few(kinds, MOST_SHOWN) or ()))
        return cls(actions, Names.of(few, finder(kg, kinds)))

    def get_completions(self, document: Document, event: CompleteEvent) -> Iterable[Completion]:
        """Return what can stand where the cursor is."""
        before = document.text_before_cursor
        typed = re.search(r"[\w-]*$", before)
        start = typed[0] if typed else ""
        things = [(name, name) for name in self.things or self.things.others(start)]
        for name, text in things if "(" in before else self.actions:
            if name.startswith(start):
                yield Completion(name, -len(start), display=text)


def _describe(edit: Edit, there: Sequence[EditableCall]) -> str:
    calls = {line.number: line.call.render() for line in there}
    step = f"{edit.step}  {calls.get(edit.step, '')}".strip()
    match edit.kind:
        case "replace":
            return f"step {step} becomes {edit.text}"
        case "drop":
            return f"without step {step}"
        case "insert":
            return f"{edit.text} before step {edit.step}"
        case "move":
            return f"step {step} to before step {edit.to}"
        case _:
            return f"another plan: {edit.text}"
