"""`adaptbot domain`: the domains there are, and whether a pack makes sense."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    FINDINGS,
    JsonOption,
    OutputOption,
    WorkspaceOption,
    console,
    domain_name,
    print_json,
    workspace,
    write_out,
)
from adaptbot_cli.cli.help import Group

if TYPE_CHECKING:
    from adaptbot_cli.core.domain import Domain
    from adaptbot_cli.core.graph.kg import Kg
    from adaptbot_cli.workspace import Workspace

app = typer.Typer(
    cls=Group, help="Domains: what kinds of homes and tasks there are.", no_args_is_help=True
)


@app.command("list")
def list_domains(json: JsonOption = False, workspace_dir: WorkspaceOption = None) -> None:
    """List the domains: the bundled ones and those of the workspace."""
    from rich.table import Table
    from rich.text import Text

    from adaptbot_cli.errors import KnowledgeError
    from adaptbot_cli.session import sources

    home = workspace(workspace_dir)
    rows = []
    for name in home.domains():
        where = "workspace" if home.has(name) else "bundled"
        try:
            domain = sources.load(home, name).domain
        except KnowledgeError:
            about = f"cannot be read: see adaptbot domain check {name}"
            rows.append(_row(name, about, where, None, None))
            continue
        counts = len(domain.actions), len(domain.tasks)
        rows.append(_row(name, domain.comment, where, *counts))
    if json:
        print_json(rows)
        return
    table = Table("domain", "about", "where", "actions", "tasks", box=None, header_style="bold")
    for row in rows:
        table.add_row(*(Text("" if value is None else str(value)) for value in row.values()))
    console().print(table)


def _row(
    name: str, about: str, where: str, actions: int | None, tasks: int | None
) -> dict[str, str | int | None]:
    return {"name": name, "about": about, "where": where, "actions": actions, "tasks": tasks}


@app.command("new")
def new_domain(
    name: Annotated[str, typer.Argument(help="What to call it, such as post_room.")],
    like: Annotated[
        str | None,
        typer.Option(
            metavar="DOMAIN",
            help="Copy this domain, not the starting pack.",
            autocompletion=completion.domains,
        ),
    ] = None,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Start a domain of your own in the workspace: a small, commented pack that runs at once."""
    from adaptbot_cli.session import packs

    home = workspace(workspace_dir)
    _made(packs.start(home, name, like), home, name)


@app.command("import")
def import_domain(
    domain: Annotated[Path, typer.Argument(help="The domain, in PDDL.", metavar="DOMAIN.pddl")],
    problem: Annotated[
        Path | None,
        typer.Argument(help="A problem of it: its things, state, goal.", metavar="[PROBLEM.pddl]"),
    ] = None,
    name: Annotated[str | None, typer.Option(help="What to call it; else as the file.")] = None,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Make a pack of a PDDL domain (STRIPS and ADL), and of the things and goal of a problem."""
    from adaptbot_cli.session import packs

    home = workspace(workspace_dir)
    made = packs.take_over(home, domain, problem, name)
    _made(made, home, made[0].domain.name)


def _made(made: "tuple[Kg, str]", home: "Workspace", name: str) -> None:
    """Say what there is now, and what to do with it."""
    from rich.text import Text

    from adaptbot_cli.adapters.display.cells import GOOD, noted

    kg, revision = made
    domain = kg.domain
    folder = home.root / "kg" / name
    out = console()
    out.print(noted(GOOD, f"{name}: {_counts(domain)} in {folder}"), soft_wrap=True)
    out.print(Text(f"  committed as {revision[:7]}", "dim"))
    task = domain.tasks[0].name.replace("_", " ") if domain.tasks else "…"
    for what, command in (
        ("run a task", f'run "{task}" --domain {name}'),
        ("after a change", f"domain check {name}"),
        ("read it", f"domain docs {name}"),
    ):
        out.print(Text(f"  {what:<15}", "dim") + Text(f"adaptbot {command}"), soft_wrap=True)


@app.command("check")
def check_domain(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME]",
            help="The domain; else the configured one.",
            autocompletion=completion.domains,
        ),
    ] = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Check a domain's files: whether they can be read and make sense together; 3 if not.

    What tasks need and this home lacks is no fault, and told with "!", as are goals that say too
    little.
    """
    from adaptbot_cli.adapters.display.cells import BAD, GOOD, WARNING, noted
    from adaptbot_cli.session import validation

    home = workspace(workspace_dir)
    name = domain_name(name, home)
    kg, *both = validation.check_pack(home, name)
    found, hints = ([*map(str, faults)] for faults in both)
    if json:
        print_json({"domain": name, "faults": found, "hints": hints})
        return FINDINGS if found else 0
    out = console()
    for mark, text in (*((BAD, fault) for fault in found), *((WARNING, hint) for hint in hints)):
        out.print(noted(mark, text, longest=len(text)), soft_wrap=not out.is_terminal)
    if found or kg is None:
        return FINDINGS
    nodes, edges = kg.size()
    out.print(noted(GOOD, f"{name}: {_counts(kg.domain)}, {nodes} nodes, {edges} edges"))
    return 0


@app.command("docs")
def domain_docs(
    name: Annotated[
        str, typer.Argument(help="The domain to describe.", autocompletion=completion.domains)
    ],
    output: OutputOption = None,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Describe a domain on a page: classes, questions, actions, tasks. Markdown when piped."""
    from adaptbot_cli.adapters.handbook import handbook
    from adaptbot_cli.session import sources

    page = handbook(sources.load(workspace(workspace_dir), name))
    out = console()
    if output is not None:
        write_out(output, page)
    elif out.is_terminal:
        from rich.markdown import Markdown

        out.print(Markdown(page, code_theme="ansi_dark"))
    else:
        typer.echo(page, nl=False)


def _counts(domain: "Domain") -> str:
    from adaptbot_cli.adapters.display.cells import count

    return f"{count(len(domain.actions), 'action')}, {count(len(domain.tasks), 'task')}"
