"""A GBNF grammar of a domain's calls, so that a small model can write nothing but a plan.

GBNF is the notation of llama.cpp. The grammar fixes the form: the actions, how many arguments each
takes, one call a line, and the names that the arguments are taken from. With any word allowed, a
small model soon writes none that there is. The names are those that the model was shown and those
of the task, which the graph need not know: what is not there is for the person to tell.
"""

import json
from collections.abc import Iterable, Sequence

from adaptbot_cli.core.domain import Action, Domain, Parameter

MOST_LINES = 60
"""How many calls a plan has at most."""

_NUMBER = "number ::= [1-9] [0-9]{0,2}"


def grammar(domain: Domain, names: Iterable[str], lines: int = MOST_LINES) -> str:
    """Write the grammar of plans of 1 to `lines` calls, one a line, of the domain's actions on
    things of these names."""
    calls = " | ".join(_call(action) for action in domain.actions.values())
    root = f'root ::= call ("\\n" call){{0,{lines - 1}}}'
    told = " | ".join(_text(json.dumps(name)) for name in sorted(set(names)))
    return "\n".join((root, f"call ::= {calls}", f"name ::= {told}", _NUMBER, ""))


def _call(action: Action) -> str:
    """The calls of one action. Its optional parameters are left to the checks, except where only
    they say what is meant: the state of a switch."""
    needed = len(action.required)
    kept = [p for i, p in enumerate(action.visible) if i < needed or p.default or p.datatype]
    return " ".join((_text(f"{action.name}("), *_arguments(kept, needed), _text(")")))


def _arguments(parameters: Sequence[Parameter], needed: int) -> list[str]:
    rest: list[str] = []
    for index in reversed(range(len(parameters))):
        comma = [_text(", ")] if index else []
        rest = [*comma, _value(parameters[index]), *rest]
        if index >= needed:
            rest = [f"({' '.join(rest)})?"]
    return rest


def _value(parameter: Parameter) -> str:
    if parameter.words:
        return f"({' | '.join(_text(json.dumps(word)) for word in parameter.words)})"
    return "name" if parameter.datatype is None else "number"


def _text(text: str) -> str:
    """A literal; JSON's escapes are GBNF's."""
    return json.dumps(text)
