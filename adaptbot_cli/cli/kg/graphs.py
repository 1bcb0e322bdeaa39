"""`adaptbot kg query`, `export`, `import`: the graph for other tools, and graphs of others."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adaptbot_cli.cli.common import (
    AtOption,
    DomainOption,
    JsonOption,
    KgOption,
    WorkspaceOption,
    console,
    domain_name,
    escaped,
    home_of,
    print_json,
    workspace,
)
from adaptbot_cli.cli.help import output_option
from adaptbot_cli.cli.kg.asking import DryRunOption, YesOption, carry_out

if TYPE_CHECKING:
    from adaptbot_cli.adapters.store.engine import Answered
    from adaptbot_cli.session.knowledge import Home


class Format(StrEnum):
    """How a graph is written."""

    turtle = "turtle"
    nt = "nt"
    json_ld = "json-ld"
    xml = "xml"


class GraphName(StrEnum):
    """Which of the two graphs."""

    attribute = "attribute"
    state = "state"
    merged = "merged"


def query(
    sparql: Annotated[str, typer.Argument(metavar="SPARQL", help="A query, or - for stdin.")],
    update: Annotated[
        bool, typer.Option("--update", help="Change the graph; the change is shown first.")
    ] = False,
    yes: YesOption = False,
    dry_run: DryRunOption = False,
    domain: DomainOption = None,
    kg: KgOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Ask the graph in SPARQL: SELECT, ASK, CONSTRUCT, DESCRIBE. It is only read.

    The prefixes ex, ab, rdf, rdfs and xsd are known. Nothing is asked of the network.
    """
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import queries

    home = home_of(workspace_dir, domain)
    text = _text(sparql)
    if update:
        if kg:
            raise UsageError("--update changes the workspace, not the files of --kg")
        return carry_out(home, queries.update(home, text), yes=yes, dry_run=dry_run, json=json)
    _show(queries.query(home, text, kg or ()), home, json)
    return 0


def _text(sparql: str) -> str:
    from adaptbot_cli.errors import UsageError

    if sparql != "-":
        return sparql
    if sys.stdin is None:
        raise UsageError("cannot read the query from stdin: it is closed")
    return sys.stdin.buffer.read().decode("utf-8", errors="replace")


def _show(answer: "Answered", home: "Home", json: bool) -> None:
    from adaptbot_cli.adapters.display.standing import rows
    from adaptbot_cli.adapters.store.engine import write_graph
    from adaptbot_cli.session.queries import prefixes

    if answer.graph is not None:
        form = "json-ld" if json else "turtle"
        data = write_graph(answer.graph, form, prefixes(home))
        text = data.decode("utf-8")
        typer.echo(escaped(text) if json else text, nl=False)
    elif json:
        import json as parser

        print_json(parser.loads(answer.json))
    elif answer.truth is not None:
        console().print("yes" if answer.truth else "no")
    else:
        console().print(rows(answer.variables, answer.rows, prefixes(home)))


def export(
    form: Annotated[Format, output_option("--format", help="How it is written.")] = Format.turtle,
    graph: Annotated[
        GraphName, typer.Option("--graph", help="What things are, how they are now, or both.")
    ] = GraphName.merged,
    output: Annotated[
        Path | None, output_option("-o", "--output", metavar="FILE", help="Where to, not stdout.")
    ] = None,
    at: AtOption = None,
    domain: DomainOption = None,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Write the graph for other tools. The same knowledge gives the same bytes."""
    from adaptbot_cli.errors import KnowledgeError
    from adaptbot_cli.session.queries import exported

    found = workspace(workspace_dir)
    data = exported(found, domain_name(domain, found), str(form), str(graph), at)
    if output is None:
        typer.echo(data, nl=False)
        return
    try:
        output.write_bytes(data)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise KnowledgeError(f"cannot write {output}: {reason}") from error


def import_(
    files: Annotated[list[Path], typer.Argument(metavar="FILE…", help="Graphs, such as Turtle.")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Let the files be all that is known.")
    ] = False,
    yes: YesOption = False,
    dry_run: DryRunOption = False,
    domain: DomainOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Take in a graph in this domain's vocabulary: what fits is committed, the rest is told.

    Of a property with one value only, the file's is taken. --replace: the rest is let go.
    """
    from adaptbot_cli.adapters.display.standing import parcel as table
    from adaptbot_cli.errors import KnowledgeError
    from adaptbot_cli.session.queries import imported, plain_parcel

    home = home_of(workspace_dir, domain)
    parcel, proposal = imported(home, files, replace)
    console(stderr=json).print(table(parcel))
    if not parcel.accepted:
        names = ", ".join(path.name for path in files)
        raise KnowledgeError(f"nothing of {names} was taken: see why above")
    return carry_out(home, proposal, yes=yes, dry_run=dry_run, json=json, told=plain_parcel(parcel))
