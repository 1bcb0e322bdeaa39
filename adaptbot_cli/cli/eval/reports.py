"""How the commands that run experiments carry them out, and show what they come to."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from adaptbot_cli.cli.common import at_terminal, console, print_json

if TYPE_CHECKING:
    from adaptbot_cli.evaluation.experiment import Experiment, Results


def report_on(
    experiments: "Sequence[Experiment]",
    settings: dict[str, Any],
    results: Path | None,
    plot: Path | None,
    json: bool,
) -> None:
    """Run experiments, and report on them as JSON or as tables and charts; draw them at `plot`.

    On which graphs it all runs is printed on stderr before the first trial.
    """
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.evaluation.figures import graphs, report, tables

    for line in () if json else graphs(settings):
        typer.echo(visible(line), err=True)
    found = report(settings, carry_out(experiments, results))
    if plot is not None:
        from adaptbot_cli.evaluation.plots import draw

        draw(found, plot)
    if json:
        print_json(found)
        return
    from adaptbot_cli.evaluation.plots import over_tasks

    out = console()
    out.print(tables(found))
    out.print(over_tasks(found))
    if plot is not None:
        typer.echo(f"drawn: {plot}", err=True)


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
        done = sum(each.kept() for each in results)
        raise Interrupted(
            f"interrupted; {done} of {total} trials are kept: the same command goes on from there"
        ) from None
    finally:
        for each in results:
            each.close(keep=path is not None or not finished)


def _run(experiment: "Experiment", results: "Results") -> list[dict[str, Any]]:
    if experiment.setup.cluster and at_terminal(sys.stderr):
        typer.echo(f"trials are run on the cluster at {experiment.setup.cluster}", err=True)
    # The processes start before the bar does: it has a thread of its own.
    with experiment.workers(results) as pool, _progress(experiment, results) as ended:
        return experiment.run(results, ended, pool)


def _results(experiment: "Experiment", path: Path | None) -> "Results":
    from platformdirs import user_cache_path

    from adaptbot_cli.evaluation.experiment import Results
    from adaptbot_cli.evaluation.trial import AnswersFile

    key = experiment.key()
    cache = user_cache_path("adaptbot", appauthor=False) / "eval" / f"{key}.jsonl"
    found = Results(path or cache, key)
    rules = experiment.setup.rules
    if rules.model is not None and rules.answers is None:
        rules = replace(rules, answers=AnswersFile(found.answers))
        experiment.setup = replace(experiment.setup, rules=rules)
    return found


@contextmanager
def _progress(
    experiment: "Experiment", results: "Results"
) -> Iterator[Callable[[dict[str, Any]], None]]:
    from rich import progress as bars

    done = experiment.size - experiment.left(results)
    columns = (
        bars.TextColumn("{task.description:40}", markup=False),
        bars.BarColumn(),
        bars.MofNCompleteColumn(),
        bars.TimeRemainingColumn(),
    )
    hidden = not at_terminal(sys.stderr)
    out = console(stderr=True)
    with bars.Progress(*columns, console=out, transient=True, disable=hidden) as bar:
        task = bar.add_task("trials", total=experiment.size, completed=done)

        def ended(trial: dict[str, Any]) -> None:
            text = f"{trial['model']} · {trial['arm']} · {trial['task']}"
            bar.update(task, advance=1, description=text[:40])

        yield ended
