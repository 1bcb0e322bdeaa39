"""`adaptbot eval FILE` and `eval published`: the paper's experiment on recordings, or live."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adaptbot_cli.cli.common import (
    ApiBaseOption,
    DomainOption,
    JsonOption,
    KgOption,
    TimeoutOption,
    WorkspaceOption,
    domain_name,
    note_ignored,
    workspace,
)
from adaptbot_cli.cli.eval import options
from adaptbot_cli.cli.eval.options import carry_out
from adaptbot_cli.cli.help import model_option, output_option, person_option
from adaptbot_cli.cli.run import PolicyName, PromptName, PromptOption

if TYPE_CHECKING:
    from adaptbot_cli.evaluation.experiment import Experiment
    from adaptbot_cli.workspace import Workspace


def run(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Recordings, or with --model a list of tasks.")
    ],
    domain: DomainOption = None,
    kg: KgOption = None,
    truth: Annotated[
        list[Path] | None,
        person_option(metavar="FILE", help="A Turtle graph that the simulated person knows."),
    ] = None,
    arms: options.ArmsOption = options.ALL_ARMS,
    policy: options.PolicyOption = PolicyName.tutor,
    replans: options.ReplansOption = 3,
    cumulative: options.CumulativeOption = False,
    keep_plans: Annotated[
        bool,
        typer.Option("--keep-plans", help="Keep plans that met their goal, with --cumulative."),
    ] = False,
    human_error: options.ErrorOption = 0.0,
    seed: options.SeedOption = 0,
    model: Annotated[
        str | None, model_option(metavar="NAME", help="Plan live: any litellm model, or `library`.")
    ] = None,
    api_base: ApiBaseOption = None,
    prompt: PromptOption = PromptName.auto,
    leave_out: Annotated[
        str,
        model_option(metavar="A,B", help="Parts that prompts lack: items, example, memory."),
    ] = "",
    unseen: Annotated[
        bool, model_option("--unseen", help="Show a model no library plan of the task itself.")
    ] = False,
    timeout: TimeoutOption = None,
    value: Annotated[
        Path | None,
        model_option("--answers", metavar="FILE", help="Keep a model's answers here, by prompt."),
    ] = None,
    select: options.SelectOption = None,
    limit: options.LimitOption = None,
    world: options.WorldOption = None,
    planted: options.PlantedOption = 0.0,
    jobs: options.JobsOption = None,
    cluster: options.ClusterOption = None,
    results: Annotated[
        Path | None,
        output_option(metavar="FILE", help="Keep the trials here, and go on from them."),
    ] = None,
    plot: options.PlotOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Run the paper's experiment: the same tasks in three arms, measured.

    A run that is interrupted goes on where it was when it is started again.
    """
    from adaptbot_cli.adapters.planner.budget import SECONDS
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.evaluation.experiment import Setup, prepare
    from adaptbot_cli.evaluation.figures import report
    from adaptbot_cli.evaluation.plots import check
    from adaptbot_cli.evaluation.recordings import read_recordings, read_tasks
    from adaptbot_cli.evaluation.trial import AnswersFile, Rules

    check(plot)
    if keep_plans and not (cumulative and options.in_truth(world)):
        raise UsageError(
            "--keep-plans keeps what met its goal in the world, for the next tasks: add "
            "--cumulative --world truth"
        )
    home = workspace(workspace_dir)
    model, address = (None, None) if model is None else _planner(model, home, api_base)
    rules = Rules(
        policy=policy.value,
        replans=replans,
        human_error=human_error,
        seed=seed,
        model=model,
        api_base=address,
        world=options.in_truth(world),
        prompt=prompt.value,
        leave_out=options.parts(leave_out),
        unseen=unseen,
        seconds=timeout or SECONDS,
        answers=AnswersFile(value) if value else None,
        keep=keep_plans,
    )
    setup = Setup(
        domain=domain_name(domain, home),
        rules=rules,
        kg=tuple(kg or ()),
        truth=tuple(truth or ()),
        arms=options.arms(arms),
        cumulative=cumulative,
        jobs=options.cores(jobs, cluster, rules),
        cluster=cluster,
        limit=limit,
        select=select,
        planted=planted,
    )
    rows = read_recordings(file) if model is None else read_tasks(file, setup.domain)
    experiment = prepare(setup, rows, home)
    _show_skipped(experiment)
    options.show_graphs(experiment.settings(), json)
    trials = carry_out([experiment], results)
    options.show(report(experiment.settings(), trials), json, plot)


def _planner(model: str, home: "Workspace", api_base: str | None) -> tuple[str, str | None]:
    """Return who plans, and the address of its server, as `adaptbot run` would choose them."""
    from adaptbot_cli.adapters.planner.choice import LIBRARY, choose

    note_ignored(home)
    chosen = choose(model, home.settings, os.environ, api_base)
    return chosen.model or LIBRARY, chosen.api_base


def _show_skipped(experiment: "Experiment") -> None:
    if experiment.skipped:
        text = ", ".join(f"{n} of {name}" for name, n in sorted(experiment.skipped.items()))
        typer.echo(f"left out, as they are of other domains: {text}", err=True)


def published(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="A checkout of the authors' repository at d65fe35."),
    ],
    write: Annotated[
        Path | None,
        output_option(metavar="FILE", help="Only write the recordings, one JSON object a line."),
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
    cluster: options.ClusterOption = None,
    plot: options.PlotOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Run the experiment on the authors' result folders, as they lie in their repository.

    Each model and domain starts from its own published graph; the simulated person knows the one
    that the authors' people left.
    """
    from adaptbot_cli.evaluation.experiment import Setup, of_published, together
    from adaptbot_cli.evaluation.figures import report
    from adaptbot_cli.evaluation.plots import check
    from adaptbot_cli.evaluation.published import read_published, write_recordings
    from adaptbot_cli.evaluation.trial import Rules

    check(plot)
    series = read_published(folder)
    if write is not None:
        n = write_recordings(series, write)
        typer.echo(f"{n} recordings written to {write}", err=True)
        return
    rules = Rules(policy.value, replans, human_error, seed, world=options.in_truth(world))
    setup = Setup(
        domain="",
        rules=rules,
        arms=options.arms(arms),
        cumulative=cumulative,
        jobs=options.cores(jobs, cluster, rules),
        cluster=cluster,
        limit=limit,
        select=select,
        planted=planted,
    )
    experiments = of_published(series, setup, workspace(workspace_dir))
    record = together(experiments)
    options.show_graphs(record, json)
    trials = carry_out(experiments, None)
    options.show(report(record, trials), json, plot)
