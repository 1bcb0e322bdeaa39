"""`adaptbot domain`: the domains there are, and whether a pack makes sense."""

from typing import Annotated

import typer

from adaptbot_cli.cli.common import (
    JsonOption,
    WorkspaceOption,
    console,
    print_json,
    workspace,
)

app = typer.Typer(help="Domains: what kinds of homes and tasks there are.", no_args_is_help=True)


@app.command("list")
def list_domains(json: JsonOption = False, workspace_dir: WorkspaceOption = None) -> None:
    """List the domains: the bundled ones and those of the workspace."""
    from rich.table import Table
    from rich.text import Text

    from adaptbot_cli import session

    home = workspace(workspace_dir)
    rows = []
    for name in home.domains():
        domain = session.load(home, name).domain
        where = "workspace" if home.has(name) else "bundled"
        rows.append(
            {
                "name": name,
                "about": domain.comment,
                "where": where,
                "actions": len(domain.actions),
                "tasks": len(domain.tasks),
            }
        )
    if json:
        print_json(rows)
        return
    table = Table("domain", "about", "where", "actions", "tasks", box=None, header_style="bold")
    for row in rows:
        table.add_row(*(Text(str(value)) for value in row.values()))
    console().print(table)


@app.command("check")
def check_domain(
    name: Annotated[str, typer.Argument(help="The domain to check.")],
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Check a domain's files: whether they can be read and make sense together."""
    from rich.text import Text

    from adaptbot_cli import session
    from adaptbot_cli.core.faults import faults

    kg = session.load(workspace(workspace_dir), name)
    found = faults(kg)
    out = console()
    for fault in found:
        out.print(Text("✗ ", "red") + Text(fault))
    if found:
        return 3
    nodes, edges = kg.size()
    told = f"{name}: {len(kg.domain.actions)} actions, {len(kg.domain.tasks)} tasks, "
    out.print(Text("✓ ", "green") + Text(f"{told}{nodes} nodes, {edges} edges"))
    return 0
