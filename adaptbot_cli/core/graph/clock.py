"""A clock over the engine, which hears neither Ctrl-C nor a timeout while it evaluates a query."""

import os
import queue
import threading
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeVar

from adaptbot_cli.errors import KnowledgeError

SECONDS = 10.0
"""How long the engine may take for one query of a pack: more than a thousand times the usual."""

LONGEST = 50_000
"""Characters of a query. The engine recurses into one; `_STACK` bears the deepest of this length,
while the usual stack would overflow and take the process down."""

_STACK = 512 << 20

T = TypeVar("T")


class EndlessError(KnowledgeError):
    """A query did not end in its time."""


def within(work: Callable[[], T], what: str, seconds: float = SECONDS) -> T:
    """Return what `work` returns, done in the engine's thread while this one waits.

    So Ctrl-C is heard at once, and the clock too. Work that is left goes on in its thread to the
    end of the process; the next has a thread of its own. `what` names it for the message.

    Raises:
        EndlessError: it takes longer than `seconds`. Or what `work` raises.
    """
    done: queue.SimpleQueue[tuple[T | None, BaseException | None]] = queue.SimpleQueue()
    try:
        _engine(os.getpid()).put((work, done))
        result, error = done.get(timeout=seconds)
    except queue.Empty:
        _engine.cache_clear()
        text = f"{what} did not end in {seconds:g} s"
        raise EndlessError(f"{text}: its patterns may lack a variable in common") from None
    except BaseException:
        _engine.cache_clear()
        raise
    if error is not None:
        raise error
    return result  # type: ignore[return-value]


@lru_cache(maxsize=1)
def _engine(_process: int) -> "queue.SimpleQueue[Any]":
    """Start the engine's thread and return its jobs; a forked process has none of its parent's."""
    jobs: queue.SimpleQueue[Any] = queue.SimpleQueue()
    before = threading.stack_size(_STACK)
    try:
        threading.Thread(target=_serve, args=(jobs,), name="engine", daemon=True).start()
    finally:
        threading.stack_size(before)
    return jobs


def _serve(jobs: "queue.SimpleQueue[Any]") -> None:
    while True:
        work, done = jobs.get()
        try:
            done.put((work(), None))
        except BaseException as error:
            done.put((None, error))
        del work, done  # an answer is not kept until the next question
