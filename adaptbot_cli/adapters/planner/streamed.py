"""One answer of a model, read piece by piece within a time limit that holds whatever happens; and
its text, whatever form the model gives it: prose, tool calls, reasoning aside."""

import contextlib
import json
import queue
import re
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.adapters.planner.forms import Style, from_json
from adaptbot_cli.errors import ModelError

LONGEST = 100_000
"""More characters than any plan has: an answer is read no further."""


class TooSlow(Exception):
    """The time was up before the answer was whole, or nothing more came."""


class TooLong(Exception):
    """The answer goes on and on."""


@dataclass(slots=True)
class PartialAnswer:
    """What came of an answer so far. `ended` is the reason for its end, None without one."""

    chunks: list[Any] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    thought: list[str] = field(default_factory=list)
    size: int = 0
    ended: str | None = None

    @property
    def begun(self) -> bool:
        """Whether anything but empty chunks has come."""
        return self.size > 0

    def take(self, chunk: Any) -> tuple[str, str]:
        """Keep a chunk; return the text and the reasoning in it. Raises TooLong."""
        self.chunks.append(chunk)
        if not chunk.choices:
            return "", ""
        self.ended = chunk.choices[0].finish_reason or self.ended
        delta = chunk.choices[0].delta
        calls = getattr(delta, "tool_calls", None) or ()
        self.size += sum(len(call.function.arguments or "") for call in calls if call.function)
        thought = str(getattr(delta, "reasoning_content", None) or "")
        piece = _text_of(delta.content)
        self.thought.append(thought)
        self.text.append(piece)
        self.size += len(thought) + len(piece)
        if self.size > LONGEST:
            raise TooLong
        return piece, thought


def _text_of(content: Any) -> str:
    """Return the text of a message's content, which some servers send in parts."""
    if not isinstance(content, list):
        return str(content or "")
    parts = (part if isinstance(part, dict) else vars(part) for part in content)
    return "".join(str(part.get("text") or "") for part in parts)


def read(
    ask: Callable[[], Iterable[Any]],
    silence: float,
    seconds: float,
    show: Callable[[str, bool], None],
    into: PartialAnswer,
) -> None:
    """Read an answer to its end into `into`, showing its text, and what is reasoning, as it comes.

    It may take so many `seconds`, and be silent for `silence` of them between two pieces.

    The reading has a thread of its own, because no timeout of a socket ends a name that is never
    resolved or a server that sends a byte now and then; and because Ctrl-C then stops it at once.
    A thread left behind closes its connection at the next piece, or when its socket times out.

    Raises:
        TooSlow: the seconds are over, or it is silent. TooLong: it is no plan. Or whatever `ask`
            raises.
    """
    pieces: queue.SimpleQueue[Any] = queue.SimpleQueue()
    stop = threading.Event()
    reader = threading.Thread(target=_read, args=(ask, pieces, stop), daemon=True)
    until = time.monotonic() + seconds
    reader.start()
    try:
        while True:
            try:
                left = min(until - time.monotonic(), silence)
                chunk = pieces.get(timeout=max(left, 0.001))
            except queue.Empty:
                raise TooSlow from None
            if isinstance(chunk, _End):
                if chunk.error is not None or chunk.unexplained:
                    into.ended = None
                if chunk.error is not None:
                    raise chunk.error
                return
            piece, thought = into.take(chunk)
            for text, is_reasoning in ((thought, True), (piece, False)):
                if text:
                    show(text, is_reasoning)
    finally:
        stop.set()


@dataclass(frozen=True, slots=True)
class _End:
    unexplained: bool = False
    error: BaseException | None = None


def _read(
    ask: Callable[[], Iterable[Any]], pieces: "queue.SimpleQueue[Any]", stop: threading.Event
) -> None:
    try:
        stream = ask()
        try:
            for chunk in stream:
                if stop.is_set():
                    break
                pieces.put(chunk)
        finally:
            _close(stream)
    except BaseException as error:
        pieces.put(_End(error=error))
    else:
        # Releases before 1.109 write "stop" themselves where a stream has just ended, and keep here
        # what really came. A release without this field is taken at its chunks' word.
        pieces.put(_End(unexplained=getattr(stream, "received_finish_reason", "") is None))


def _close(stream: Any) -> None:
    """Close the connection under litellm's wrapper, which has no way of its own to do it."""
    for owner in (getattr(stream, "completion_stream", None), stream):
        close = getattr(owner, "close", None)
        if callable(close):
            close()
            return


_REASONING = re.compile(
    r"<(think|thinking|reasoning|thought)>.*?(?:</\1>|\Z)", re.DOTALL | re.IGNORECASE
)
_MARK = re.compile(r"^[#*_\s]*(?:PLAN[*_]*:|[Pp]lan[*_]*:?(?=[*_\s]*$))[*_]*[ \t]*", re.MULTILINE)
"""The mark, with the ornaments that models put around it."""

_FENCE = re.compile(r"\A\s*```(?:json)?\n|\n```\s*\Z")
_END_ONLY = re.compile(r"\A.*</(?:think|thinking|reasoning|thought)>", re.DOTALL | re.IGNORECASE)


def plan_text(answer: PartialAnswer) -> tuple[str, str]:
    """Return an answer's reasoning, and the rest of it: its text, then its tool calls as JSON.

    Reasoning tries calls out that are no part of the plan, and it would be paid for again in each
    re-prompt. Some models open it in the prompt, so that only its end is seen.
    """
    content = "".join(answer.text)
    text = (
        _END_ONLY.sub("", _REASONING.sub("", content)).lstrip("\n") if "<" in content else content
    )
    thought = "".join(answer.thought)
    if text != content.lstrip("\n"):
        thought += content.removesuffix(text)
    message = "\n".join(part for part in (text, *_tool_calls(answer)) if part)
    return _encodable(thought.strip()), _encodable(message)


def _encodable(text: str) -> str:
    return text.encode("utf-8", "replace").decode("utf-8")


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


def _tool_calls(answer: PartialAnswer) -> list[str]:
    """Return the tool calls of an answer as JSON, which the parser reads; each id is one call.

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
    return [_as_json(call.name, call.arguments) for call in calls if call.name]


def _as_json(name: str, arguments: Any) -> str:
    with contextlib.suppress(ModelError):
        arguments = bounded.parse_json(arguments or "{}", "a tool call", ModelError)
    return json.dumps({"name": name, "arguments": arguments}, ensure_ascii=False)
