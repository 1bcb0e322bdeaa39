"""One answer of a model, read piece by piece within a time limit that holds whatever happens."""

import queue
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

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
        self.size += len(thought)
        piece = text_of(delta.content)
        self.text.append(piece)
        self.size += len(piece)
        if self.size > LONGEST:
            raise TooLong
        return piece, thought


def text_of(content: Any) -> str:
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
                if chunk.error is not None:
                    into.ended = None
                    raise chunk.error
                if chunk.unexplained:
                    into.ended = None
                return
            piece, thought = into.take(chunk)
            if thought:
                show(thought, True)
            if piece:
                show(piece, False)
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
