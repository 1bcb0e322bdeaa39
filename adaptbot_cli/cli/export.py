"""`adaptbot export`: a checked plan for a robot's own executive."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.check import read_plan
from adaptbot_cli.cli.common import (
    DomainOption,
    RobotOption,
    WorkspaceOption,
    console,
    domain_name,
    workspace,
)
from adaptbot_cli.cli.help import output_option, task_option
from adaptbot_cli.cli.run import FINDINGS


class ExportFormat(StrEnum):
    """What a plan can be written as."""

    json = "json"
    script = "script"
    pddl = "pddl"
    bt = "bt"


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
        ExportFormat,
        output_option(
            "--as", help="JSON, a VirtualHome script, a PDDL plan, or a BehaviorTree.CPP 4 tree."
        ),
    ] = ExportFormat.json,
    task: Annotated[
        str,
        task_option(
            metavar="TEXT",
            help="The task of a plan, for its items and goal.",
            autocompletion=completion.tasks,
        ),
    ] = "",
    domain: DomainOption = None,
    robot: RobotOption = "",
    output: Annotated[
        Path | None, output_option("-o", "--output", metavar="FILE", help="Write it here.")
    ] = None,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Write a checked plan for a robot's own executive; 3 if it is none to hand over."""
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import sources
    from adaptbot_cli.session.exporting import export_run, export_text
    from adaptbot_cli.session.past_runs import find_run

    home = workspace(workspace_dir)
    if plan == "-" or (Path(plan).is_file() and Path(plan).suffix != ".yaml"):
        graph = sources.load(home, domain_name(domain, home), robot=robot)
        found = export_text(read_plan(plan), task, home, graph, form)
    else:
        found = export_run(find_run(home, plan or None), home, form)
    for finding in found.findings:
        where = f"step {finding.step}: " if finding.step else ""
        text = f"{finding.code} {where}{finding.message}"
        console(stderr=True).print(visible(text), markup=False, soft_wrap=True)
    if not found.text:
        return FINDINGS
    if output is None:
        typer.echo(found.text, nl=False)
        return 0
    try:
        output.write_text(found.text, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"cannot write {output}: {error.strerror}") from error
    console(stderr=True).print(f"written to {output}", markup=False, soft_wrap=True)
    return 0
