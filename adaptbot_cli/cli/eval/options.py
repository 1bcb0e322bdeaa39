"""What the commands that run experiments share: options, and carrying an experiment out."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli.common import at_terminal, console, items
from adaptbot_cli.cli.help import (
    model_option,
    output_option,
    person_option,
    task_option,
    world_option,
)
from adaptbot_cli.cli.run import PolicyName

if TYPE_CHECKING:
    from rich.progress import Progress

    from adaptbot_cli.adapters.planner.prompts import Part
    from adaptbot_cli.evaluation.experiment import Experiment, Results
    from adaptbot_cli.evaluation.trial import Rules


ArmsOption = Annotated[
    str, task_option(metavar="A,B,C", help="Any of llm, llm+kg and llm+kg+human.")
]
PolicyOption = Annotated[
    PolicyName, person_option(help="Ask about required items first, or re-prompt first.")
]
ReplansOption = Annotated[
    int, model_option(min=0, max=20, metavar="N", help="Re-prompts at most (F_max).")
]
CumulativeOption = Annotated[
    bool, task_option("--cumulative", help="Carry knowledge over from task to task.")
]
ErrorOption = Annotated[
    float, person_option(min=0, max=1, metavar="P", help="How often the simulated person errs.")
]
SeedOption = Annotated[int, person_option(metavar="N", help="Seed of the person's errors.")]
SelectOption = Annotated[
    str | None, task_option(metavar="PATTERN", help="Only these ids, such as 'gpt-4o/*'.")
]
LimitOption = Annotated[int | None, task_option(min=1, metavar="N", help="The first N tasks only.")]
JobsOption = Annotated[
    int | None, typer.Option(min=1, metavar="N", help="Processes; all cores by default.")
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run the trials on a Dask cluster: its scheduler, such as tcp://192.168.0.10:8786.",
    ),
]
PlotOption = Annotated[
    Path | None,
    output_option(metavar="FILE", help="Draw the figures: .svg, .pdf or .png, by its ending."),
]
WorldOption = Annotated[
    str | None,
    world_option(metavar="WORLD", help="`truth`: carry plans out in the truth, and judge there."),
]
PlantedOption = Annotated[
    float, world_option(min=0, max=1, metavar="P", help="Share of errors planted in the base.")
]
ALL_ARMS = "llm,llm+kg,llm+kg+human"


def arms(option: str) -> tuple[str, ...]:
    """Return the arms that an option names, in the paper's order. Raises UsageError."""
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.evaluation.recordings import ARMS

    wanted = items(option)
    unknown = [name for name in wanted if name not in ARMS]
    if unknown or not wanted:
        text = ", ".join(unknown) or option
        raise UsageError(f'--arms: "{text}" is no arm; there is {", ".join(ARMS)}')
    return tuple(arm for arm in ARMS if arm in wanted)


def parts(option: str) -> "frozenset[Part]":
    """Return the parts of a prompt that an option names. Raises UsageError."""
    from adaptbot_cli.adapters.planner.prompts import PARTS
    from adaptbot_cli.errors import UsageError

    unknown = [name for name in items(option) if name not in PARTS]
    if unknown:
        text = ", ".join(unknown)
        raise UsageError(
            f'--leave-out: "{text}" is no part of a prompt; there is {", ".join(PARTS)}'
        )
    return frozenset(part for part in PARTS if part in items(option))


def in_truth(option: str | None) -> bool:
    """Return whether plans are carried out in the truth. Raises UsageError."""
    from adaptbot_cli.errors import UsageError

    if option not in (None, "truth", "rehearsal"):
        raise UsageError(f'--world: there is truth, and rehearsal, not "{option}"')
    return option == "truth"


def cores(jobs: int | None, cluster: str | None, rules: "Rules") -> int:
    """Return how many processes are meant. Raises UsageError, of what cannot be on a cluster."""
    from adaptbot_cli.adapters.planner.local import on_board
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.evaluation.cluster import check

    check(cluster, rules)
    if jobs and cluster:
        raise UsageError("--jobs are processes of this machine; a --cluster has its own workers")
    return 1 if on_board(rules.model) else jobs or os.cpu_count() or 1


def show_graphs(settings: dict[str, Any], json: bool) -> None:
    """Say on stderr, before the first trial, on which graphs it all runs."""
    if json:
        return  # the report says it
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.evaluation.figures import graphs

    for line in graphs(settings):
        typer.echo(visible(line), err=True)


def show(report: dict[str, Any], json: bool, plot: Path | None) -> None:
    """Draw a report if that is asked for, and print it as JSON or as tables and charts."""
    from adaptbot_cli.cli.common import console, print_json

    if plot is not None:
        from adaptbot_cli.evaluation.plots import draw

        draw(report, plot)
    if json:
        print_json(report)
        return
    from adaptbot_cli.evaluation.figures import tables
    from adaptbot_cli.evaluation.plots import over_tasks

    out = console()
    out.print(tables(report))
    out.print(over_tasks(report))
    if plot is not None:
        typer.echo(f"drawn: {plot}", err=True)


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
