"""How a plan is asked for, and what its answer may be, as a JSON schema or as a grammar.

The actions are given, the names open: what is missing here must still be nameable, as it is for the
checks and the person to judge.
"""

import json
from dataclasses import dataclass
from typing import Any, Literal, get_args

from adaptbot_cli import bounded
from adaptbot_cli.core.domain import Action, Parameter
from adaptbot_cli.core.plan import Call
from adaptbot_cli.errors import ModelError

Style = Literal["cot", "plain", "schema"]
"""How the plan is asked for: after a chain of thought, alone, or as JSON of a given schema."""

STYLES: tuple[Style, ...] = get_args(Style)

MARK = "PLAN:"
"""The line between a chain of thought and the calls."""

MOST_STEPS = 60
"""How many calls a plan has at most."""

_NAME = r'name ::= "\"" [^"\\\n]{1,40} "\""'
_NUMBER = "number ::= [1-9] [0-9]{0,2}"
_THOUGHT = r'thought ::= ([^P\n] | "P" [^L\n]) [^\n]{0,240} "\n"'
"""A line of reasoning: any but the mark, PLAN:, under which only calls stand."""


@dataclass(frozen=True, slots=True)
class PlanForm:
    """Plans of some actions, as `json` or as calls; of these with room for `reasoning` before."""

    actions: tuple[Action, ...]
    reasoning: bool = True
    json: bool = False

    @property
    def schema(self) -> dict[str, Any]:
        """The JSON schema of an answer: reasoning, then the steps."""
        step = {
            "type": "object",
            "properties": {
                "action": {"type": "string", "enum": [action.name for action in self.actions]},
                "args": {"type": "array", "items": {"type": "string"}},
            },
            "required": ["action", "args"],
            "additionalProperties": False,
        }
        plan = {"type": "array", "items": step}
        return {
            "type": "object",
            "properties": {"reasoning": {"type": "string"}, "plan": plan},
            "required": ["reasoning", "plan"],
            "additionalProperties": False,
        }

    @property
    def grammar(self) -> str:
        """The grammar of an answer in GBNF, the notation of llama.cpp: one call a line."""
        calls = " | ".join(_call(action) for action in self.actions)
        plan = f'call ("\\n" call){{0,{MOST_STEPS - 1}}}'
        root = f'thought{{1,8}} "{MARK}\\n" {plan}' if self.reasoning else plan
        rules = (f"root ::= {root}", f"call ::= {calls}", _NAME, _NUMBER)
        return "\n".join((*rules, *([_THOUGHT] if self.reasoning else ()), ""))


def _call(action: Action) -> str:
    """The calls of one action. Its optional parameters are left to the checks, except where only
    they carry the meaning: the state of a switch."""
    needed = len(action.required)
    shown = [p for i, p in enumerate(action.visible) if i < needed or p.default or p.datatype]
    rest: list[str] = []
    for index in reversed(range(len(shown))):
        comma = [json.dumps(", ")] if index else []
        rest = [*comma, _value(shown[index]), *rest]
        if index >= needed:
            rest = [f"({' '.join(rest)})?"]
    return " ".join((json.dumps(f"{action.name}("), *rest, json.dumps(")")))


def _value(parameter: Parameter) -> str:
    """A value; the escapes of JSON's strings are those of GBNF's literals."""
    if parameter.words:
        return f"({' | '.join(json.dumps(json.dumps(word)) for word in parameter.words)})"
    return "name" if parameter.datatype is None else "number"


def from_json(text: str) -> tuple[str, str]:
    """Return the reasoning and the calls of an answer in the form of the schema.

    Raises:
        ModelError: it is not of that form.
    """
    reply = bounded.parse_json(text.strip(), "the answer", ModelError)
    try:
        steps = [Call(str(step["action"]), tuple(map(str, step["args"]))) for step in reply["plan"]]
        return str(reply.get("reasoning", "")), "\n".join(call.render() for call in steps)
    except (TypeError, KeyError, AttributeError) as error:
        raise ModelError("the answer has another form than was asked for") from error
