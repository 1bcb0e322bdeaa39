"""`adaptbot eval published DIR`: the authors' own recordings, from their public repository."""

from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import JsonOption, WorkspaceOption, workspace
from adaptbot_cli.cli.eval import options
from adaptbot_cli.cli.eval.carrying import carry_out
from adaptbot_cli.cli.run import PolicyName


def published(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="A checkout of the authors' repository at d65fe35."),
    ],
    write: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Only write the recordings, one JSON object a line."),
    ] = None,
    arms: options.ArmsOption = options.ALL_ARMS,
    policy: options.PolicyOption = PolicyName.tutor,
    replans: options.ReplansOption = 3,
    cumulative: options.CumulativeOption = False,
    human_error: options.ErrorOption = 0.0,
    seed: options.SeedOption = 0,
    select: options.SelectOption = None,
    limit: options.LimitOption = None,
    world: options.WorldOption = None,
    planted: options.PlantedOption = 0.0,
    jobs: options.JobsOption = None,
    plot: options.PlotOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Run the experiment on the authors' result folders, as they lie in their repository.

    Each model and domain starts from its own published graph; the simulated person knows the one
    that the authors' people left.
    """
    from adaptbot_cli.evaluation.experiment import Setting, of_published, together
    from adaptbot_cli.evaluation.plots import check
    from adaptbot_cli.evaluation.published import read_published, write_recordings
    from adaptbot_cli.evaluation.report import report

    check(plot)
    series = read_published(folder)
    if write is not None:
        n = write_recordings(series, write)
        typer.echo(f"{n} recordings written to {write}", err=True)
        return
    setting = Setting(
        domain="",
        arms=options.arms(arms),
        policy=policy.value,
        replans=replans,
        cumulative=cumulative,
        human_error=human_error,
        seed=seed,
        jobs=options.cores(jobs),
        limit=limit,
        select=select,
        world=options.in_truth(world),
        planted=planted,
    )
    experiments = of_published(series, setting, workspace(workspace_dir))
    record = together(experiments)
    options.show_graphs(record, json)
    trials = carry_out(experiments, None)
    options.show(report(record, trials), json, plot)
