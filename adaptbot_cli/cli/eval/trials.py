"""`adaptbot eval`: run the paper's experiment, compare two of them, read the published ones."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from adaptbot_cli.cli.common import (
    ANYWHERE,
    FINDINGS,
    ApiBaseOption,
    JsonOption,
    KgOption,
    Place,
    TimeoutOption,
    WorkspaceOption,
    console,
    items,
    note_ignored,
    print_json,
    workspace,
)
from adaptbot_cli.cli.eval.reports import report_on
from adaptbot_cli.cli.help import (
    Group,
    model_option,
    output_option,
    person_option,
    task_option,
    world_option,
)
from adaptbot_cli.cli.run import PromptOption

if TYPE_CHECKING:
    from adaptbot_cli.evaluation.experiment import Setup
    from adaptbot_cli.evaluation.trial import Rules
    from adaptbot_cli.workspace import Workspace


class _RunByDefault(Group):
    """Takes `eval FILE` for `eval run FILE`."""

    default = "run"


app = typer.Typer(
    cls=_RunByDefault,
    help="Evaluate as the paper does: three arms, linked trials. "
    "`adaptbot eval FILE` is `adaptbot eval run FILE`; see `adaptbot eval run --help`.",
)


@dataclass(frozen=True, slots=True)
class Conditions:
    """The options of every experiment."""

    arms: Annotated[
        str, task_option(metavar="A,B,C", help="Any of llm, llm+kg and llm+kg+human.")
    ] = "llm,llm+kg,llm+kg+human"
    policy: Annotated[
        Literal["tutor", "paper"],
        person_option(help="Ask about required items first, or re-prompt first."),
    ] = "tutor"
    replans: Annotated[
        int, model_option(min=0, max=20, metavar="N", help="Re-prompts at most (F_max).")
    ] = 3
    cumulative: Annotated[
        bool, task_option("--cumulative", help="Carry knowledge over from task to task.")
    ] = False
    human_error: Annotated[
        float, person_option(min=0, max=1, metavar="P", help="How often the simulated person errs.")
    ] = 0.0
    seed: Annotated[int, person_option(metavar="N", help="Seed of the person's errors.")] = 0
    select: Annotated[
        str | None, task_option(metavar="PATTERN", help="Only these ids, such as 'gpt-4o/*'.")
    ] = None
    limit: Annotated[
        int | None, task_option(min=1, metavar="N", help="The first N tasks only.")
    ] = None
    world: Annotated[
        str | None,
        world_option(
            metavar="WORLD", help="`truth`: carry plans out in the truth, and judge there."
        ),
    ] = None
    planted: Annotated[
        float, world_option(min=0, max=1, metavar="P", help="Share of errors planted in the base.")
    ] = 0.0
    jobs: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Processes; all cores by default.")
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Run the trials on a Dask cluster: its scheduler, such as "
            "tcp://192.168.0.10:8786.",
        ),
    ] = None
    plot: Annotated[
        Path | None,
        output_option(metavar="FILE", help="Draw the figures: .svg, .pdf or .png, by its ending."),
    ] = None

    def rules(self, **asked: Any) -> "Rules":
        """Return the rules of each trial; `asked` are those of a live model. Raises UsageError."""
        from adaptbot_cli.errors import UsageError
        from adaptbot_cli.evaluation.trial import Rules

        if self.world not in (None, "truth", "rehearsal"):
            raise UsageError(f'--world: there is truth, and rehearsal, not "{self.world}"')
        truth = self.world == "truth"
        return Rules(self.policy, self.replans, self.human_error, self.seed, world=truth, **asked)

    def setup(
        self,
        rules: "Rules",
        domain: str = "",
        kg: list[Path] | None = None,
        truth: list[Path] | None = None,
    ) -> "Setup":
        """Return the experiment that is asked for. Raises UsageError."""
        from adaptbot_cli.adapters.planner.local import on_board
        from adaptbot_cli.errors import UsageError
        from adaptbot_cli.evaluation.cluster import check
        from adaptbot_cli.evaluation.experiment import Setup
        from adaptbot_cli.evaluation.recordings import ARMS

        arms = _known("arms", self.arms, ARMS, "arm")
        if not arms:
            raise UsageError(f'--arms: "{self.arms}" is no arm; there is {", ".join(ARMS)}')
        check(self.cluster, rules)
        if self.jobs and self.cluster:
            raise UsageError(
                "--jobs are processes of this machine; a --cluster has its own workers"
            )
        return Setup(
            domain,
            rules,
            tuple(kg or ()),
            tuple(truth or ()),
            arms,
            self.cumulative,
            1 if on_board(rules.model) else self.jobs or os.cpu_count() or 1,
            self.cluster,
            self.limit,
            self.select,
            self.planted,
        )


USUAL = Conditions()


def _known(option: str, given: str, known: tuple[str, ...], what: str) -> tuple[str, ...]:
    """Return those of the known names that an option lists. Raises UsageError of another one."""
    from adaptbot_cli.errors import UsageError

    unknown = ", ".join(name for name in items(given) if name not in known)
    if unknown:
        raise UsageError(f'--{option}: "{unknown}" is no {what}; there is {", ".join(known)}')
    return tuple(name for name in known if name in items(given))


@app.command()
def run(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="Recordings, or with --model a list of tasks.")
    ],
    place: Place = ANYWHERE,
    kg: KgOption = None,
    truth: Annotated[
        list[Path] | None,
        person_option(metavar="FILE", help="A Turtle graph that the simulated person knows."),
    ] = None,
    conditions: Conditions = USUAL,
    keep_plans: Annotated[
        bool,
        typer.Option("--keep-plans", help="Keep plans that met their goal, with --cumulative."),
    ] = False,
    model: Annotated[
        str | None, model_option(metavar="NAME", help="Plan live: any litellm model, or `library`.")
    ] = None,
    api_base: ApiBaseOption = None,
    prompt: PromptOption = "auto",
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
    results: Annotated[
        Path | None,
        output_option(metavar="FILE", help="Keep the trials here, and go on from them."),
    ] = None,
    json: JsonOption = False,
) -> None:
    """Run the paper's experiment: the same tasks in three arms, measured.

    A run that is interrupted goes on where it was when it is started again.
    """
    from adaptbot_cli.adapters.planner.budget import SECONDS
    from adaptbot_cli.adapters.planner.prompts import PARTS
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.evaluation.experiment import prepare
    from adaptbot_cli.evaluation.plots import check
    from adaptbot_cli.evaluation.recordings import read_recordings, read_tasks
    from adaptbot_cli.evaluation.trial import AnswersFile

    check(conditions.plot)
    home = place.home()
    model, address = (None, None) if model is None else _planner(model, home.workspace, api_base)
    rules = conditions.rules(
        model=model,
        api_base=address,
        prompt=prompt,
        leave_out=frozenset(_known("leave-out", leave_out, PARTS, "part of a prompt")),
        unseen=unseen,
        seconds=timeout or SECONDS,
        answers=AnswersFile(value) if value else None,
        keep=keep_plans,
    )
    if keep_plans and not (conditions.cumulative and rules.world):
        raise UsageError(
            "--keep-plans keeps what met its goal in the world, for the next tasks: add "
            "--cumulative --world truth"
        )
    setup = conditions.setup(rules, home.domain, kg, truth)
    rows = read_recordings(file) if model is None else read_tasks(file, setup.domain)
    experiment = prepare(setup, rows, home.workspace)
    if experiment.skipped:
        text = ", ".join(f"{n} of {name}" for name, n in sorted(experiment.skipped.items()))
        typer.echo(f"left out, as they are of other domains: {text}", err=True)
    report_on([experiment], experiment.settings(), results, conditions.plot, json)


def _planner(model: str, home: "Workspace", api_base: str | None) -> tuple[str, str | None]:
    """Return who plans, and the address of its server, as `adaptbot run` would choose them."""
    from adaptbot_cli.adapters.planner.choice import LIBRARY, choose

    note_ignored(home)
    chosen = choose(model, home.settings, os.environ, api_base)
    return chosen.model or LIBRARY, chosen.api_base


@app.command()
def published(
    folder: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="A checkout of the authors' repository at d65fe35."),
    ],
    write: Annotated[
        Path | None,
        output_option(metavar="FILE", help="Only write the recordings, one JSON object a line."),
    ] = None,
    conditions: Conditions = USUAL,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Run the experiment on the authors' result folders, as they lie in their repository.

    Each model and domain starts from its own published graph; the simulated person knows the one
    that the authors' people left.
    """
    from adaptbot_cli.evaluation.experiment import of_published, together
    from adaptbot_cli.evaluation.plots import check
    from adaptbot_cli.evaluation.published import read_published, write_recordings

    check(conditions.plot)
    series = read_published(folder)
    if write is not None:
        n = write_recordings(series, write)
        typer.echo(f"{n} recordings written to {write}", err=True)
        return
    setup = conditions.setup(conditions.rules())
    experiments = of_published(series, setup, workspace(workspace_dir))
    report_on(experiments, together(experiments), None, conditions.plot, json)


@app.command()
def compare(
    before: Annotated[Path, typer.Argument(metavar="A", help="What `eval --json` printed.")],
    after: Annotated[Path, typer.Argument(metavar="B", help="The same, later.")],
    tolerance: Annotated[
        float, typer.Option(min=0, help="How much worse a quality may get, as a share.")
    ] = 0.0,
    cost: Annotated[
        float, typer.Option("--cost-tolerance", min=0, help="How much a cost may rise, as a share.")
    ] = 0.05,
    json: JsonOption = False,
) -> int:
    """Compare two experiments, task by task; exit 3 if the second is worse."""
    from adaptbot_cli.evaluation import comparison

    old, new = comparison.read_report(before), comparison.read_report(after)
    found = comparison.compare(old, new, tolerance, cost)
    worse = [difference for difference in found if difference.regression]
    for text in comparison.only_in_one(old, new):
        typer.echo(f"{text}: left out", err=True)
    settings = comparison.other_settings(old, new)
    if json:
        printed = {
            "regression": bool(worse),
            "settings": {name: list(values) for name, values in settings.items()},
            "differences": [change.as_json() for change in found],
        }
        print_json(printed)
    else:
        from adaptbot_cli.evaluation.comparison import contrast

        console().print(contrast(found, settings))
    return FINDINGS if worse else 0
