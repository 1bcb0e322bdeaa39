"""`adaptbot runs`: what was run here, the newest first."""

from typing import Annotated, Any

import typer

from adaptbot_cli.cli.common import JsonOption, WorkspaceOption, console, print_json, workspace


def runs(
    task: Annotated[
        str, typer.Argument(metavar="[TASK]", help="Only runs whose task has these words.")
    ] = "",
    last: Annotated[
        int, typer.Option("--last", min=1, metavar="N", help="So many, the newest (20).")
    ] = 20,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """List the runs of this home: when, what, by whom planned, and what it came to.

    The id is what `resume`, `progress`, `export` and `replay` take, or the beginning of it.
    """
    from adaptbot_cli.session.runs import found_runs

    home = workspace(workspace_dir)
    found = found_runs(home, task, last)
    if json:
        print_json({"runs": [run.as_json() for run in found]})
        return
    if not found:
        text = f"no run of {task}" if task else "no run"
        typer.echo(f"{text} is recorded in {home.root}", err=True)
        return
    console().print(_table(found))


def _table(found: Any) -> Any:
    from adaptbot_cli.adapters.display.words import columns, plain_text

    table = columns(None, None, None, None)
    table.columns[0].no_wrap = True
    for run in found:
        style = "green" if run.goal_met else "" if run.outcome else "yellow"
        table.add_row(
            plain_text(run.id.partition("-")[0], "dim"),
            plain_text(run.task),
            plain_text(run.planner, "dim"),
            plain_text(run.told, style),
        )
    return table
