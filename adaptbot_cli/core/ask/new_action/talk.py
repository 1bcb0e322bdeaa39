"""The dialogue in which a person teaches an action (paper, III-C: the existence of an action).

It is written as straight talk that yields questions and is sent answers, and it is played again
from the answers given so far whenever the next question is wanted: so it holds no state, and an
answer that is taken back takes back what followed from it.
"""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace

from rdflib import Literal
from rdflib.term import Node

from adaptbot_cli.core.ask.new_action.draft import Draft, called, from_action, written
from adaptbot_cli.core.ask.new_action.parts import (
    CHANGES,
    DONE,
    PARTS,
    REQUIRES,
    TAKES,
    examples,
    put_together,
    taking,
    words_of,
)
from adaptbot_cli.core.ask.questions import (
    FIXED,
    LATER,
    MOST_SHOWN,
    YES,
    Answer,
    Choice,
    Key,
    Question,
)
from adaptbot_cli.core.domain import Action, CalledAs, Parameter
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import NUMBERS
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.plan import Call

NONE = "none"

Talk = Generator[Question, str, "TaughtAction | None"]


@dataclass(frozen=True, slots=True)
class Unknown:
    """An action that a plan writes and that is not known: a call of it, the names near it."""

    name: str
    call: Call
    near: tuple[str, ...] = ()
    context: str = ""


@dataclass(frozen=True, slots=True)
class TaughtAction:
    """What a dialogue has come to: the action as it is from now on, its facts, a sentence.

    `notes` say in words what was taught; `replaces` is the action as it was before.
    """

    action: Action
    delta: Delta
    sentence: str
    notes: tuple[str, ...] = ()
    replaces: Action | None = None


def played(
    unknown: Unknown, text: str, kg: Kg, asked: Mapping[Key, tuple[Question, Answer]]
) -> Question | TaughtAction | None:
    """Play the dialogue with the answers so far; `text` is that to whether there is such an action.

    Return the next question, or what was taught at the end; None if the dialogue was left. Raises
    PackError.
    """
    talk = _fixed(unknown, kg) if text == FIXED else _new(unknown, kg)
    try:
        question = next(talk)
        while question.key in asked:
            value = asked[question.key][1].value
            if value == LATER.value:
                return None
            question = talk.send(value)
    except StopIteration as end:
        result: TaughtAction | None = end.value
        return result
    return question


def _question(unknown: Unknown, prop: str, text: str, choices: Sequence[Choice]) -> Question:
    return Question("action", unknown.name, text, prop, "action", tuple(choices))


def _which(unknown: Unknown, kg: Kg, prop: str, text: str, none: str = "") -> Question:
    """Ask for one of the known actions, the nearest first."""
    near = [name for name in unknown.near if name in kg.domain.actions]
    rest = [name for name in kg.domain.actions if name not in near]
    found = [Choice(NONE, none)] if none else []
    choices = [*_actions(near, kg), *found, *_actions(rest, kg)]
    return replace(_question(unknown, prop, text, choices), context=unknown.context)


def _actions(names: Sequence[str], kg: Kg) -> list[Choice]:
    return [Choice(name, name, kg.domain.actions[name].explain) for name in names]


def _fixed(unknown: Unknown, kg: Kg) -> Talk:
    wording = unknown.name.replace("_", " ")
    name = yield _which(
        unknown, kg, "which", f'Which of these is "{wording}", with a fixed argument?'
    )
    action = kg.domain.actions.get(name)
    if action is None or not action.visible:
        return None
    fixed: list[CalledAs] = []
    while True:
        left = [p for p in action.visible if p.name not in {f.parameter for f in fixed}]
        if not left or (fixed and len(left) <= len(unknown.call.args)):
            break
        picked = yield _which_parameter(unknown, action, left, fixed)
        parameter = next((p for p in left if p.name == picked), None)
        if parameter is None:
            break
        value = yield from _value(unknown, parameter, kg)
        fixed.append(CalledAs((unknown.name,), parameter.name, value))
    if not fixed:
        return None
    values = sentence_list([f"{part.parameter} {_shown(part, action, kg)}" for part in fixed])
    text = f"{unknown.name} is {action.name} with {values}"
    known = replace(action, called_as=(*action.called_as, *fixed))
    delta = called(unknown.name, action, fixed, kg)
    notes = (f"{action.name}, always with {values}",)
    return TaughtAction(known, delta, text, notes, replaces=action)


def _which_parameter(
    unknown: Unknown, action: Action, left: Sequence[Parameter], fixed: Sequence[CalledAs]
) -> Question:
    text = f'Which part of "{action.name}" is always the same?'
    choices = [
        Choice(p.name, f"{p.name} ({' or '.join(p.words)})" if p.words else p.name) for p in left
    ]
    if fixed:
        text = f'Is another part of "{action.name}" always the same?'
        choices.insert(0, Choice(DONE, "no, the plan says the rest"))
    question = _question(unknown, f"part_{len(fixed) + 1}", text, choices)
    return replace(question, notes=(f"the plan says {unknown.call.render()}",))


def _value(unknown: Unknown, parameter: Parameter, kg: Kg) -> Generator[Question, str, Node]:
    """Ask for the value that an argument always has."""
    text = f'Which "{parameter.name}" is it always?'
    if parameter.words:
        choices = [Choice(word, word) for word in parameter.words]
    else:
        names = map(kg.name, kg.likest(parameter.name, parameter.classes, MOST_SHOWN))
        choices = [Choice(name, name) for name in dict.fromkeys(names)]
    tries = 0
    while True:
        prop = parameter.name if not tries else f"{parameter.name}_{tries + 1}"
        message = yield _question(unknown, prop, text, choices)
        value = _meant(message, parameter, kg)
        if value is not None:
            return value
        tries += 1
        text = f'"{message}" will not do. Which "{parameter.name}" is it always?'


def _meant(text: str, parameter: Parameter, kg: Kg) -> Node | None:
    if parameter.words:
        return parameter.words.get(text)
    if parameter.datatype is None:
        return next((e for e in kg.find(text) if kg.is_a(e, parameter.classes)), None)
    numeric = parameter.datatype in NUMBERS
    fits = text.replace(".", "", 1).isdecimal() and text.isascii()
    return Literal(text, datatype=parameter.datatype) if fits or not numeric else None


def _shown(part: CalledAs, action: Action, kg: Kg) -> str:
    parameter = next(p for p in action.parameters if p.name == part.parameter)
    words = [word for word, value in parameter.words.items() if value == part.value]
    return words[0] if words else kg.name(part.value)


def _new(unknown: Unknown, kg: Kg) -> Talk:
    message = unknown.name.replace("_", " ")
    text = f'Which of these is "{message}" most like? It may then differ.'
    name = yield _which(unknown, kg, "like", text, "none of them: it is new in every way")
    action = kg.domain.actions.get(name)
    known = Draft(unknown.name) if action is None else from_action(unknown.name, action, kg.domain)
    draft = taking(known, unknown.call, kg)
    counts = dict.fromkeys(PARTS, 0)
    if action is None:
        for part in (CHANGES, REQUIRES):
            draft = yield from put_together(part, draft, unknown.call, kg, counts)
    tries = 0
    while True:
        tries += 1
        hub = _hub(unknown, draft, tries)
        message = yield hub
        if message not in PARTS:
            break
        draft = yield from put_together(message, draft, unknown.call, kg, counts)
    if message != YES:
        return None
    new, delta = written(draft, kg)
    changes = ", ".join(change.words for change in draft.changes)
    effect = f": then {changes}" if changes else "; its effect is not known"
    return TaughtAction(new, delta, f"{unknown.name} is possible{effect}", words_of(draft, {}))


def _hub(unknown: Unknown, draft: Draft, tries: int) -> Question:
    text = f'Is this what "{unknown.name.replace("_", " ")}" means?'
    choices = (
        Choice(YES, "yes", key="y"),
        Choice(TAKES, "no, it takes other things", key="t"),
        Choice(REQUIRES, "no, it requires something else", key="r"),
        Choice(CHANGES, "no, it changes something else", key="c"),
        Choice(LATER.value, "ask me later", key="l"),
    )
    question = _question(unknown, "means" if tries == 1 else f"means_{tries}", text, choices)
    return replace(question, notes=words_of(draft, examples(draft, unknown.call)))
