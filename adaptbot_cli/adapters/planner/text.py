"""The text of an answer, whatever form a model gives it: prose, tool calls, reasoning aside."""

import contextlib
import json
import re
from types import SimpleNamespace
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.adapters.planner.prompts import Style
from adaptbot_cli.adapters.planner.streaming import PartialAnswer
from adaptbot_cli.adapters.planner.structured import from_json
from adaptbot_cli.errors import ModelError

_REASONING = re.compile(
    r"<(think|thinking|reasoning|thought)>.*?(?:</\1>|\Z)", re.DOTALL | re.IGNORECASE
)
_MARK = re.compile(r"^[#*_\s]*(?:PLAN[*_]*:|[Pp]lan[*_]*:?(?=[*_\s]*$))[*_]*[ \t]*", re.MULTILINE)
"""The mark, with the ornaments that models put around it."""

_FENCE = re.compile(r"\A\s*```(?:json)?\n|\n```\s*\Z")
_END_ONLY = re.compile(r"\A.*</(?:think|thinking|reasoning|thought)>", re.DOTALL | re.IGNORECASE)


def plan_text(answer: PartialAnswer, whole: Any) -> tuple[str, str]:
    """Return an answer's reasoning, and what else it says: its text, then its tool calls as JSON.

    Reasoning tries calls out that are no part of the plan, and it would be paid for again in each
    re-prompt. Some models open it in the prompt, so that only its end is seen.
    """
    content = "".join(answer.text)
    text = without_reasoning(content)
    deltas = (chunk.choices[0].delta for chunk in answer.chunks if chunk.choices)
    thought = "".join(getattr(delta, "reasoning_content", None) or "" for delta in deltas)
    if text != content.lstrip("\n"):
        thought += content.removesuffix(text)
    calls = streamed_calls(answer) or tool_calls(whole)
    message = "\n".join(part for part in (text, *calls) if part)
    return _encodable(thought.strip()), _encodable(message)


def _encodable(text: str) -> str:
    return text.encode("utf-8", "replace").decode("utf-8")


def without_reasoning(text: str) -> str:
    """Return a text without its <think> blocks."""
    if "<" not in text:
        return text
    return _END_ONLY.sub("", _REASONING.sub("", text)).lstrip("\n")


def split(text: str, style: Style) -> tuple[str, str]:
    """Return the reasoning and the plan of an answer, as it was asked for.

    A text without the mark, or of another form than the schema's, is a plan as a whole.
    """
    if style == "schema":
        with contextlib.suppress(ModelError):
            return from_json(_FENCE.sub("", text))
    found = _MARK.search(text) if style == "cot" else None
    if found is None:
        return "", text
    return text[: found.start()].strip(), text[found.end() :].strip("\n")


def streamed_calls(answer: PartialAnswer) -> list[str]:
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
