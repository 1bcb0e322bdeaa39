"""Runs the trials of an experiment, in several processes if asked to."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.errors import AdaptbotError
from adaptbot_cli.evaluation.measures import Trial
from adaptbot_cli.evaluation.recordings import Row
from adaptbot_cli.evaluation.trials import Basis, Rules, perform

Key = tuple[str, str]
Lessons = tuple[Lesson, ...]


@dataclass(frozen=True, slots=True)
class Chain:
    """Trials that follow each other, as what one has learned is known in the next."""

    rows: tuple[Row, ...]
    arm: str

    @property
    def keys(self) -> list[Key]:
        """The task and arm of each trial."""
        return [(row.id, self.arm) for row in self.rows]


def chains(rows: Sequence[Row], arms: Sequence[str], cumulative: bool) -> list[Chain]:
    """Return the trials of an experiment: each on its own, or knowledge carried over."""
    if not cumulative:
        return [Chain((row,), arm) for row in rows for arm in arms]
    found: list[Chain] = []
    for series in dict.fromkeys(row.series for row in rows):
        those = sorted((r for r in rows if r.series == series), key=lambda row: row.index)
        for arm in arms:
            # Only the arm with a person learns: the trials of the others are on their own.
            split = [tuple(those)] if "human" in arm else [(row,) for row in those]
            found += [Chain(part, arm) for part in split]
    return found


def run(
    todo: Sequence[Chain], world: Basis, rules: Rules, pool: ProcessPoolExecutor | None = None
) -> Iterator[Trial]:
    """Run chains of trials, in a pool if there is one; yields each trial as it ends."""
    if pool is not None:
        yield from _in_pool(todo, pool)
        return
    for chain in todo:
        carried: Lessons = ()
        for row in chain.rows:
            trial, lessons = perform(row, chain.arm, world, rules, carried)
            carried = (*carried, *lessons)
            yield trial


@contextmanager
def workers(world: Basis, rules: Rules, jobs: int) -> Iterator[ProcessPoolExecutor | None]:
    """Start processes that run trials, none for one job; stop them at once at the end.

    They are forked where that is possible, from a process that has no threads yet: so start them
    before anything is drawn.
    """
    if jobs == 1:
        yield None
        return
    forks = "fork" in multiprocessing.get_all_start_methods()
    context = multiprocessing.get_context("fork" if forks else "spawn")
    pool = ProcessPoolExecutor(jobs, context, initializer=_start, initargs=(world, rules))
    try:
        pool.submit(_ready).result()
        yield pool
        pool.shutdown()
    except BrokenProcessPool as error:
        raise AdaptbotError("a process that ran trials has died; try --jobs 1") from error
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in multiprocessing.active_children():
            process.terminate()  # nobody waits for what still runs
            process.join(timeout=5)


def _in_pool(todo: Sequence[Chain], pool: ProcessPoolExecutor) -> Iterator[Trial]:
    at: dict[Future[tuple[Trial, Lessons]], tuple[Chain, int, Lessons]] = {}

    def submit(chain: Chain, place: int, carried: Lessons) -> None:
        at[pool.submit(_perform, chain.rows[place], chain.arm, carried)] = (chain, place, carried)

    for chain in sorted(todo, key=lambda chain: -len(chain.rows)):
        submit(chain, 0, ())
    while at:
        for future in wait(at, return_when=FIRST_COMPLETED).done:
            chain, place, carried = at.pop(future)
            trial, lessons = future.result()
            if place + 1 < len(chain.rows):
                submit(chain, place + 1, (*carried, *lessons))
            yield trial


_performer: Callable[[Row, str, Lessons], tuple[Trial, Lessons]] | None = None
"""What a process of the pool runs trials with: its graphs are loaded once."""


def _start(world: Basis, rules: Rules) -> None:
    global _performer
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle
    _performer = partial(_with, world, rules)


def _with(
    world: Basis, rules: Rules, row: Row, arm: str, carried: Lessons
) -> tuple[Trial, Lessons]:
    return perform(row, arm, world, rules, carried)


def _ready() -> None:
    """Nothing to do: a process that answers has started."""


def _perform(row: Row, arm: str, carried: Lessons) -> tuple[Trial, Lessons]:
    if _performer is None:
        raise RuntimeError("the process was not started with a world")
    return _performer(row, arm, carried)
