"""`adaptbot eval FILE`: run the paper's experiment on recordings, or live."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli.common import (
    DomainOption,
    JsonOption,
    KgOption,
    WorkspaceOption,
    console,
    domain_name,
    items,
    print_json,
    workspace,
)
from adaptbot_cli.cli.run import PolicyName

if TYPE_CHECKING:
    from rich.progress import Progress

    from adaptbot_cli.evaluation.experiment import Experiment
    from adaptbot_cli.evaluation.results import Results


def run(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Recordings, or with --model a list of tasks.")
    ],
    domain: DomainOption = None,
    kg: KgOption = None,
    truth: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="A Turtle graph that the simulated person knows."),
    ] = None,
    arms: Annotated[
        str, typer.Option(metavar="A,B,C", help="Any of llm, llm+kg and llm+kg+human.")
    ] = "llm,llm+kg,llm+kg+human",
    policy: Annotated[
        PolicyName, typer.Option(help="Ask about required items first, or re-prompt first.")
    ] = PolicyName.tutor,
    replans: Annotated[
        int, typer.Option(min=0, max=20, metavar="N", help="Re-prompts at most (F_max).")
    ] = 3,
    cumulative: Annotated[
        bool, typer.Option("--cumulative", help="Carry knowledge over from task to task.")
    ] = False,
    human_error: Annotated[
        float, typer.Option(min=0, max=1, metavar="P", help="How often the person errs.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(metavar="N", help="Seed of the person's errors.")] = 0,
    model: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Plan live: any litellm model, or `library`."),
    ] = None,
    select: Annotated[
        str | None, typer.Option(metavar="PATTERN", help="Only these ids, such as 'gpt-4o/*'.")
    ] = None,
    limit: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="The first N tasks only.")
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Processes; all cores by default.")
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Keep the trials here, and go on from them."),
    ] = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Run the paper's experiment: the same tasks in three arms, measured.

    A run that is interrupted goes on where it was when it is started again.
    """
    from adaptbot_cli.evaluation.experiment import Setting, prepare, report
    from adaptbot_cli.evaluation.recordings import read_recordings

    home = workspace(workspace_dir)
    setting = Setting(
        domain=domain_name(domain, home),
        kg=tuple(kg or ()),
        truth=tuple(truth or ()),
        arms=_arms(arms),
        policy=policy.value,
        replans=replans,
        cumulative=cumulative,
        human_error=human_error,
        seed=seed,
        jobs=jobs or os.cpu_count() or 1,
        limit=limit,
        select=select,
        model=model,
    )
    experiment = prepare(setting, read_recordings(file), home)
    _tell_skipped(experiment)
    trials = _carry_out(experiment, results)
    told = report(setting.as_json(), trials)
    if json:
        print_json(told)
        return
    from adaptbot_cli.evaluation.tables import tables

    console().print(tables(told))


def _arms(option: str) -> tuple[str, ...]:
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.evaluation.recordings import ARMS

    wanted = items(option)
    unknown = [name for name in wanted if name not in ARMS]
    if unknown or not wanted:
        raise UsageError(f'--arms: "{", ".join(unknown)}" is no arm; there is {", ".join(ARMS)}')
    return tuple(arm for arm in ARMS if arm in wanted)


def _tell_skipped(experiment: "Experiment") -> None:
    if experiment.skipped:
        told = ", ".join(f"{n} of {name}" for name, n in sorted(experiment.skipped.items()))
        typer.echo(f"left out, as they are of other domains: {told}", err=True)


def _carry_out(experiment: "Experiment", path: Path | None) -> list[dict[str, Any]]:
    """Run the trials with a progress bar; say how to go on when they are interrupted."""
    from adaptbot_cli.errors import Interrupted

    results = _results(experiment, path)
    results.start()
    finished = False
    try:
        with experiment.workers(results) as pool, _progress(experiment, results) as ended:
            trials = experiment.run(results, ended, pool)
        finished = True
        return trials
    except KeyboardInterrupt:
        n = len(results.done)
        raise Interrupted(
            f"interrupted; {n} of {experiment.size} trials are kept: the same command goes on "
            "with the others"
        ) from None
    finally:
        results.close(keep=path is not None or not finished)


def _results(experiment: "Experiment", path: Path | None) -> "Results":
    from platformdirs import user_cache_path

    from adaptbot_cli.evaluation.results import Results

    key = experiment.key()
    cache = user_cache_path("adaptbot", appauthor=False) / "eval" / f"{key}.jsonl"
    return Results(path or cache, key)


@contextmanager
def _progress(experiment: "Experiment", results: "Results") -> Iterator[Any]:
    bar = _bar()
    left = experiment.left(results)
    with bar:
        task = bar.add_task("trials", total=experiment.size, completed=experiment.size - left)

        def ended(trial: dict[str, Any]) -> None:
            bar.update(task, advance=1, description=f"{trial['arm']} · {trial['task']}"[:40])

        yield ended


def _bar() -> "Progress":
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as Remaining

    shown = sys.stderr is not None and sys.stderr.isatty()
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        Remaining(),
    )
    return Progress(*columns, console=console(stderr=True), transient=True, disable=not shown)
