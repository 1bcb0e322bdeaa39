"""`adaptbot plans`: the plans that are kept for tasks of this home."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ANYWHERE,
    JsonOption,
    Place,
    YesOption,
    agreed,
    console,
    note,
    print_json,
)
from adaptbot_cli.cli.help import Group

if TYPE_CHECKING:
    from adaptbot_cli.adapters.planner.library import LibraryPlan
    from adaptbot_cli.session.home import Home

app = typer.Typer(cls=Group, help="The plans that are kept for tasks: list, show, drop.")
NameArgument = Annotated[
    str,
    typer.Argument(
        metavar="NAME",
        help="The beginning of a plan's name, or of its task.",
        autocompletion=completion.plans,
    ),
]


@app.callback(invoke_without_command=True)
def plans(
    context: typer.Context,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> None:
    """List the plans that are kept: each comes first for its task, and is checked anew each time.

    A plan is kept where a person agrees to it, after a run: one that they changed, or a model's
    that met its goal in the world.
    """
    if context.invoked_subcommand is not None:
        return
    from adaptbot_cli.adapters.display.cells import columns, count, plain_text
    from adaptbot_cli.adapters.planner.kept import kept_plans, origin

    home = place.home()
    found, faults = kept_plans(home.workspace.kept_plans(home.domain))
    if json:
        broken = [{"name": path.stem, "fault": fault} for path, fault in faults.items()]
        print_json({"plans": [_as_json(plan) for plan in found], "broken": broken})
        return
    table = columns(None, None, None, None)
    for plan in found:
        steps = count(len(plan.body.strip().split("\n")), "step")
        cells = (plan.path.stem, plan.kept.get("request", plan.names[0]), steps, origin(plan))
        table.add_row(*map(plain_text, cells))
    if found:
        console().print(table)
    for path, fault in faults.items():
        note(f"{fault}; or adaptbot plans drop {path.stem}")
    if not found and not faults:
        typer.echo(f"no plan is kept for a task of the {home.domain}", err=True)


@app.command()
def show(
    name: NameArgument,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> int:
    """Show a kept plan, where it comes from, and what it comes to in this home today."""
    from adaptbot_cli.adapters.display.cells import plain_text
    from adaptbot_cli.adapters.display.screen import Screen
    from adaptbot_cli.adapters.planner.kept import asked_of, origin
    from adaptbot_cli.cli.run import exit_code
    from adaptbot_cli.core.view.summary import summary
    from adaptbot_cli.errors import KnowledgeError
    from adaptbot_cli.session import replay, sources
    from adaptbot_cli.session.sources import reader

    home = place.home()
    path, plan = _named(home, name)
    if isinstance(plan, str):
        raise KnowledgeError(plan)
    graph = sources.load(home.workspace, home.domain)
    asked = plan.kept.get("request", plan.names[0])
    tasks = reader(graph, home.workspace)(asked).tasks
    task = next((task for task in tasks if asked_of(task) == plan.asked), None)
    if task is None:
        raise KnowledgeError(
            f'"{asked}" is not read as it was when {path} was kept, so the plan serves nothing '
            f"now; adaptbot plans drop {path.stem}"
        )
    result = replay.check(plan.body, task, graph)
    if json:
        today = summary(result, graph, "kept plan", (None, None))
        print_json({**_as_json(plan), "today": today})
        return exit_code(result)
    out = console()
    out.print(plain_text(asked, "bold"))
    run = f"run {plan.kept['run']}" if plan.kept.get("run") else ""
    for text in filter(None, (origin(plan), run, str(path))):
        out.print(plain_text(text, "dim", 1_000), soft_wrap=True)
    Screen(out, graph).finish(result, None)
    return exit_code(result)


@app.command()
def drop(
    name: NameArgument,
    yes: YesOption = False,
    place: Place = ANYWHERE,
) -> None:
    """Drop a kept plan: the planner is asked again. The versions still have it."""
    from adaptbot_cli.core.graph.delta import Delta
    from adaptbot_cli.session.change import ProposedChange, commit

    home = place.home()
    path, _ = _named(home, name)
    if not (yes or agreed(console(), f'Drop the plan "{path.stem}"?')):
        typer.echo("nothing was changed", err=True)
        return
    plans = {path.relative_to(home.workspace.root).as_posix(): None}
    subject, trailers = f'drop the plan "{path.stem}"', (("Source", "drop"),)
    revision = commit(home, ProposedChange(Delta(), subject, trailers, plans=plans))
    typer.echo(
        f"dropped; committed as {(revision or '')[:7]}; adaptbot undo brings it back", err=True
    )


def _named(home: "Home", name: str) -> "tuple[Path, LibraryPlan | str]":
    """The file of a kept plan that a name means, with the plan or what is wrong with it.

    Raises:
        UsageError: there is none, or there are several.
    """
    from adaptbot_cli.adapters.planner.kept import kept_plans
    from adaptbot_cli.core.ask.learning import safe_name
    from adaptbot_cli.errors import UsageError

    plans, faults = kept_plans(home.workspace.kept_plans(home.domain))
    there: dict[Path, LibraryPlan | str] = {**{plan.path: plan for plan in plans}, **faults}
    asked = {plan.path: plan.kept.get("request") for plan in plans}
    fitting = [p for p in there if name in (p.stem, asked.get(p))]
    fitting = fitting or [p for p in there if p.stem.startswith((name, safe_name(name)))]
    if len(fitting) == 1:
        return fitting[0], there[fitting[0]]
    names = ", ".join(path.stem for path in fitting or there) or "none"
    if fitting:
        raise UsageError(f'"{name}" may mean {len(fitting)} plans: {names}; write more of the name')
    raise UsageError(f'no plan "{name}" is kept for the {home.domain}; kept are: {names}')


def _as_json(plan: "LibraryPlan") -> dict[str, object]:
    steps = plan.body.strip().split("\n")
    record = {"name": plan.path.stem, "task": plan.names[0], "request": plan.kept.get("request")}
    return {**record, "asked": plan.asked, "kept": plan.kept, "steps": steps}
