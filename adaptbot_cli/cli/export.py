"""`adaptbot export`: a checked plan for a robot's own executive."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.check import read_plan
from adaptbot_cli.cli.common import (
    ANYWHERE,
    FINDINGS,
    OutputOption,
    Place,
    RobotOption,
    TaskOption,
    console,
    write_out,
)
from adaptbot_cli.cli.help import output_option


def export(
    plan: Annotated[
        str,
        typer.Argument(
            metavar="RUN|PLAN",
            help="A run by the beginning of its name or task, a file, or - for stdin.",
            autocompletion=completion.runs,
        ),
    ] = "",
    form: Annotated[
        Literal["json", "script", "pddl", "bt"],
        output_option(
            "--as", help="JSON, a VirtualHome script, a PDDL plan, or a BehaviorTree.CPP 4 tree."
        ),
    ] = "json",
    task: TaskOption = "",
    place: Place = ANYWHERE,
    robot: RobotOption = "",
    output: OutputOption = None,
) -> int:
    """Write a checked plan for a robot's own executive; 3 if it is none to hand over."""
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.session import sources
    from adaptbot_cli.session.exports import export_run, export_text
    from adaptbot_cli.session.past_runs import find_run

    home = place.home()
    if plan == "-" or (Path(plan).is_file() and Path(plan).suffix != ".yaml"):
        graph = sources.load(home.workspace, home.domain, robot=robot)
        text, findings = export_text(read_plan(plan), task, home.workspace, graph, form)
    else:
        text, findings = export_run(find_run(home.workspace, plan or None), home.workspace, form)
    for finding in findings:
        where = f"step {finding.step}: " if finding.step else ""
        sentence = f"{finding.code} {where}{finding.message}"
        console(stderr=True).print(visible(sentence), markup=False, soft_wrap=True)
    if not text:
        return FINDINGS
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_out(output, text)
    return 0
