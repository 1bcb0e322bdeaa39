"""The text of an answer, whatever form a model gives it: prose, tool calls, reasoning aside."""

import json
import re
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.adapters.planner.streaming import Answer
from adaptbot_cli.errors import ModelError

_REASONING = re.compile(
    r"<(think|thinking|reasoning|thought)>.*?(?:</\1>|\Z)", re.DOTALL | re.IGNORECASE
)
_END_ONLY = re.compile(r"\A.*</(?:think|thinking|reasoning|thought)>", re.DOTALL | re.IGNORECASE)


def plan_text(answer: Answer, whole: Any) -> str:
    """Return what an answer says: its text, then its tool calls as JSON, one a line.

    Reasoning is left out: it tries calls out that are no part of the plan, and it would be paid
    for again in each re-prompt. Some models open it in the prompt, so that only its end is seen.
    """
    text = without_reasoning("".join(answer.text))
    calls = tool_calls(whole)
    said = "\n".join(part for part in (text, *calls) if part)
    return said.encode("utf-8", "replace").decode("utf-8")


def without_reasoning(text: str) -> str:
    """Return a text without its <think> blocks."""
    if "<" not in text:
        return text
    return _END_ONLY.sub("", _REASONING.sub("", text)).lstrip("\n")


def tool_calls(whole: Any) -> list[str]:
    """Return the tool calls of an answer as JSON: the parser reads plans in JSON as well."""
    choices = getattr(whole, "choices", None)
    calls = getattr(choices[0].message, "tool_calls", None) if choices else None
    return [_as_json(call.function) for call in calls or ()]


def _as_json(function: Any) -> str:
    try:
        arguments = bounded.parse_json(function.arguments or "{}", "a tool call", ModelError)
    except ModelError:
        arguments = function.arguments
    return json.dumps({"name": function.name, "arguments": arguments}, ensure_ascii=False)
