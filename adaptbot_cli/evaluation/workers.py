"""Who runs trials beside this process: processes of its own, as a pool that takes single trials."""

import hashlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from adaptbot_cli import __version__
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.errors import AdaptbotError
from adaptbot_cli.evaluation.measures import Trial
from adaptbot_cli.evaluation.recordings import Recording
from adaptbot_cli.evaluation.trial import Basis, Rules, perform
from adaptbot_cli.resources import bundled

Lessons = tuple[Lesson, ...]
Ended = tuple[Trial, Lessons]


@dataclass(frozen=True, slots=True)
class Pool:
    """`submit` starts a trial of a row in an arm, with lessons carried over; `check` is called
    while none ends, and raises an AdaptbotError if none can end any more."""

    submit: Callable[[Recording, str, Lessons], Future[Ended]]
    check: Callable[[], None] = lambda: None


@contextmanager
def processes(world: Basis, rules: Rules, jobs: int) -> Iterator[Pool]:
    """Start processes that run trials; stop them at once at the end.

    They are forked where that is possible, from a process that has no threads yet: so start them
    before anything is drawn.
    """
    forks = "fork" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("fork" if forks else "spawn")
    pool = ProcessPoolExecutor(jobs, context, initializer=_start, initargs=(world, rules))

    def submit(row: Recording, arm: str, carried: Lessons) -> Future[Ended]:
        return pool.submit(_here, row, arm, carried)

    try:
        pool.submit(_ready).result()
        yield Pool(submit)
        pool.shutdown()
    except BrokenProcessPool as error:
        raise AdaptbotError("a process that ran trials has died; try --jobs 1") from error
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()  # nobody waits for what still runs
            process.join(timeout=5)


_given: list[tuple[Basis, Rules]] = []
"""What a process of the pool runs trials with: its graphs are loaded once."""


def _start(world: Basis, rules: Rules) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    _given.append((world, rules))


def _ready() -> None:
    """Nothing to do: a process that answers has started."""


def _here(row: Recording, arm: str, carried: Lessons) -> Ended:
    [(world, rules)] = _given
    return perform(row, arm, world, rules, carried)


_CODE = Path(__file__).parents[1]


@cache
def program() -> str:
    """Return a digest of this state of the program: its code and its prompts."""
    found = hashlib.sha256(__version__.encode())
    for path in (*sorted(_CODE.rglob("*.py")), *sorted(bundled("prompts").glob("*.j2"))):
        found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()[:16]
