"""`adaptbot progress`: the way of each thing through a run's plan."""

from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import JsonOption, WorkspaceOption, console, print_json, workspace


def progress(
    run: Annotated[
        str | None,
        typer.Argument(
            metavar="[RUN|TRANSCRIPT]",
            help="A run by the beginning of its name or task, or a file; else the latest run.",
        ),
    ] = None,
    svg: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the lines as a picture.")
    ] = None,
    mermaid: Annotated[
        bool, typer.Option("--mermaid", help="Print the lines as a Mermaid flowchart.")
    ] = False,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Show what became of each thing: its places, its states, what it was combined with."""
    from adaptbot_cli.adapters import progress as pictures
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session.retracing import find_run, retrace

    if json and mermaid:
        raise UsageError("--json and --mermaid both want stdout: give one of them")
    home = workspace(workspace_dir)
    lines = retrace(find_run(home, run), home)
    if svg is not None:
        try:
            svg.write_text(pictures.svg(lines), encoding="utf-8")
        except OSError as error:
            raise UsageError(f"cannot write {svg}: {error.strerror}") from error
        console(stderr=True).print(f"written to {svg}", markup=False, soft_wrap=True)
    if json:
        print_json(lines.as_json())
    elif mermaid:
        typer.echo(pictures.mermaid(lines), nl=False)
    elif svg is None:
        out = console()
        out.print(pictures.progress_lines(lines, out.width))
