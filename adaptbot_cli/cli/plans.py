"""`adaptbot plans`: the plans that are kept for tasks of this home."""

from typing import TYPE_CHECKING, Annotated

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    DomainOption,
    JsonOption,
    WorkspaceOption,
    console,
    home_of,
    print_json,
)
from adaptbot_cli.cli.help import Group
from adaptbot_cli.cli.kg.asking import YesOption, agreed

if TYPE_CHECKING:
    from adaptbot_cli.adapters.planner.library import LibraryPlan
    from adaptbot_cli.session.knowledge import Home

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
    domain: DomainOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """List the plans that are kept: each comes first for its task, and is checked anew each time.

    A plan is kept where a person agrees to it, after a run: one that they changed, or a model's
    that met its goal in the world.
    """
    if context.invoked_subcommand is not None:
        return
    from adaptbot_cli.adapters.display.words import columns, count, plain_text
    from adaptbot_cli.adapters.planner.kept import kept_plans, origin, request_of

    home = home_of(workspace_dir, domain)
    found = kept_plans(home.workspace.kept_plans(home.domain))
    if json:
        print_json({"plans": [_as_json(plan) for plan in found]})
    elif not found:
        typer.echo(f"no plan is kept for a task of the {home.domain}", err=True)
    else:
        table = columns(None, None, None, None)
        for plan in found:
            steps = count(len(plan.body.split("\n")) - 1, "step")
            cells = (plan.path.stem, request_of(plan), steps, origin(plan))
            table.add_row(*map(plain_text, cells))
        console().print(table)


@app.command()
def show(
    name: NameArgument,
    domain: DomainOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Show a kept plan, where it comes from, and what it comes to in this home today."""
    from rich.text import Text

    from adaptbot_cli import session
    from adaptbot_cli.adapters.display import Screen
    from adaptbot_cli.adapters.display.words import plain_text
    from adaptbot_cli.adapters.planner.kept import origin, request_of
    from adaptbot_cli.cli.run import exit_code
    from adaptbot_cli.core.summary import summary

    home = home_of(workspace_dir, domain)
    plan = _named(home, name)
    graph = session.load(home.workspace, home.domain)
    text, asked = str(plan.asked.get("amount", "")), plan.asked
    requires, without = ([*map(str, asked.get(key) or ())] for key in ("requires", "without"))
    text = f"{text} {plan.names[0]}".strip()
    result = session.check_request(plan.body, text, home.workspace, graph, requires, without)
    if json:
        today = summary(result, graph, "kept plan", (None, None))
        print_json({**_as_json(plan), "today": today})
        return exit_code(result)
    out = console()
    out.print(plain_text(request_of(plan), "bold"))
    for text in (origin(plan), f"run {plan.kept['run']}" if plan.kept.get("run") else ""):
        if text:
            out.print(plain_text(text, "dim", 300))
    out.print(Text(str(plan.path), "dim"), soft_wrap=True)
    Screen(out, graph).finish(result, None)
    return exit_code(result)


@app.command()
def drop(
    name: NameArgument,
    yes: YesOption = False,
    domain: DomainOption = None,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Drop a kept plan: the planner is asked again. The versions still have it."""
    from adaptbot_cli.adapters.planner.kept import request_of
    from adaptbot_cli.session.change import KeptFile, keep_file

    home = home_of(workspace_dir, domain)
    plan = _named(home, name)
    text = f'drop the plan for "{request_of(plan)}"'
    if not (yes or agreed(console(), f"{text[0].upper()}{text[1:]}?")):
        typer.echo("nothing was changed", err=True)
        return
    path = plan.path.relative_to(home.workspace.root).as_posix()
    revision = keep_file(home, KeptFile(path), text)
    typer.echo(f"dropped; committed as {(revision or '')[:7]}", err=True)


def _named(home: "Home", name: str) -> "LibraryPlan":
    """The kept plan that a name means. Raises UsageError: there is none, or there are several."""
    from adaptbot_cli.adapters.planner.kept import kept_plans, request_of
    from adaptbot_cli.core.learning import safe_name
    from adaptbot_cli.errors import UsageError

    found = kept_plans(home.workspace.kept_plans(home.domain))
    begin = safe_name(name)
    fitting = [p for p in found if name in (p.path.stem, request_of(p))]
    fitting = fitting or [p for p in found if p.path.stem.startswith((name, begin))]
    if len(fitting) == 1:
        return fitting[0]
    names = ", ".join(p.path.stem for p in fitting or found) or "none"
    if fitting:
        raise UsageError(f'"{name}" may mean {len(fitting)} plans: {names}; write more of the name')
    raise UsageError(f'no plan "{name}" is kept for the {home.domain}; kept are: {names}')


def _as_json(plan: "LibraryPlan") -> dict[str, object]:
    from adaptbot_cli.adapters.planner.kept import request_of

    steps = plan.body.strip().split("\n")
    record = {"name": plan.path.stem, "task": plan.names[0], "request": request_of(plan)}
    return {**record, "asked": plan.asked, "kept": plan.kept, "steps": steps}
