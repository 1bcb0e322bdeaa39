"""Runs experiments with a progress bar, so that an interrupted one can go on."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adaptbot_cli.cli.common import at_terminal, console

if TYPE_CHECKING:
    from rich.progress import Progress

    from adaptbot_cli.evaluation.experiment import Experiment, Results

Ended = Callable[[dict[str, Any]], None]


def carry_out(experiments: "Sequence[Experiment]", path: Path | None) -> list[dict[str, Any]]:
    """Run experiments one after the other; returns all trials.

    Trials are kept at `path` (of one experiment), else in the user's cache until all are done.

    Raises:
        Interrupted: Ctrl-C; says how to go on.
        ModelError: a live model failed; what was done is kept as well.
    """
    from adaptbot_cli.errors import Interrupted

    results = [_results(experiment, path) for experiment in experiments]
    total = sum(experiment.size for experiment in experiments)
    finished = False
    try:
        for each in results:
            each.start()
        trials = [
            trial
            for experiment, each in zip(experiments, results, strict=True)
            for trial in _run(experiment, each)
        ]
        finished = True
        return trials
    except KeyboardInterrupt:
        done = sum(len(each.done) for each in results)
        raise Interrupted(
            f"interrupted; {done} of {total} trials are kept: the same command goes on from there"
        ) from None
    finally:
        for each in results:
            each.close(keep=path is not None or not finished)


def _run(experiment: "Experiment", results: "Results") -> list[dict[str, Any]]:
    # The processes start before the bar does: it has a thread of its own.
    with experiment.workers(results) as pool, _progress(experiment, results) as ended:
        return experiment.run(results, ended, pool)


def _results(experiment: "Experiment", path: Path | None) -> "Results":
    from platformdirs import user_cache_path

    from adaptbot_cli.evaluation.experiment import Results

    key = experiment.key()
    cache = user_cache_path("adaptbot", appauthor=False) / "eval" / f"{key}.jsonl"
    found = Results(path or cache, key)
    if experiment.rules.model is not None and experiment.rules.answers is None:
        experiment.rules = replace(experiment.rules, answers=found.answers)
    return found


@contextmanager
def _progress(experiment: "Experiment", results: "Results") -> Iterator[Ended]:
    done = experiment.size - experiment.left(results)
    with _bar() as bar:
        task = bar.add_task("trials", total=experiment.size, completed=done)

        def ended(trial: dict[str, Any]) -> None:
            text = f"{trial['model']} · {trial['arm']} · {trial['task']}"
            bar.update(task, advance=1, description=text[:40])

        yield ended


def _bar() -> "Progress":
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description:40}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    shown = at_terminal(sys.stderr)
    return Progress(*columns, console=console(stderr=True), transient=True, disable=not shown)
