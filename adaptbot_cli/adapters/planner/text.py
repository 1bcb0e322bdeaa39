"""The text of an answer, whatever form a model gives it: prose, tool calls, reasoning aside."""

import json
import re
from types import SimpleNamespace
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
    calls = streamed_calls(answer) or tool_calls(whole)
    said = "\n".join(part for part in (text, *calls) if part)
    return said.encode("utf-8", "replace").decode("utf-8")


def without_reasoning(text: str) -> str:
    """Return a text without its <think> blocks."""
    if "<" not in text:
        return text
    return _END_ONLY.sub("", _REASONING.sub("", text)).lstrip("\n")


def why_empty(answer: Answer) -> str:
    """Return what an answer without text or calls has been, as far as its pieces tell."""
    deltas = (chunk.choices[0].delta for chunk in answer.chunks if chunk.choices)
    reasoned = any(getattr(delta, "reasoning_content", None) for delta in deltas)
    return "it only reasoned, and wrote no plan" if reasoned else ""


def streamed_calls(answer: Answer) -> list[str]:
    """Return the tool calls of an answer's pieces as JSON, each id being a call of its own.

    Some servers give all calls of an answer the same index, which litellm puts together as one.
    """
    calls: list[SimpleNamespace] = []
    open_: dict[int, SimpleNamespace] = {}
    for chunk in answer.chunks:
        delta = chunk.choices[0].delta if chunk.choices else None
        for piece in getattr(delta, "tool_calls", None) or ():
            at = open_.get(piece.index)
            if at is None or (piece.id and piece.id != at.id):
                at = SimpleNamespace(id=piece.id, name="", arguments="")
                calls.append(at)
                open_[piece.index] = at
            at.name += (piece.function and piece.function.name) or ""
            at.arguments += (piece.function and piece.function.arguments) or ""
    return [_as_json(call) for call in calls if call.name]


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
