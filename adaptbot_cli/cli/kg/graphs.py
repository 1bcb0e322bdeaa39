"""`adaptbot kg query`, `export`, `import`: the graph for other tools, and graphs of others."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from adaptbot_cli.cli.common import (
    ANYWHERE,
    ASKING,
    AtOption,
    Consent,
    KgOption,
    OutputOption,
    Place,
    console,
    escaped,
    print_json,
    write_out,
)
from adaptbot_cli.cli.help import output_option
from adaptbot_cli.cli.kg.edits import carry_out

if TYPE_CHECKING:
    from adaptbot_cli.adapters.store.engine import Answered
    from adaptbot_cli.session.home import Home


def query(
    sparql: Annotated[str, typer.Argument(metavar="SPARQL", help="A query, or - for stdin.")],
    update: Annotated[
        bool, typer.Option("--update", help="Change the graph; the change is shown first.")
    ] = False,
    place: Place = ANYWHERE,
    kg: KgOption = None,
    consent: Consent = ASKING,
) -> int:
    """Ask the graph in SPARQL: SELECT, ASK, CONSTRUCT, DESCRIBE. It is only read.

    The prefixes ex, ab, rdf, rdfs and xsd are known. Nothing is asked of the network.
    """
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import queries

    home = place.home()
    text = _text(sparql)
    if update:
        if kg:
            raise UsageError("--update changes the workspace, not the files of --kg")
        return carry_out(home, queries.update(home, text), consent)
    _show(queries.query(home, text, kg or ()), home, consent.json)
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
    form: Annotated[
        Literal["turtle", "nt", "json-ld", "xml"],
        output_option("--format", help="How it is written."),
    ] = "turtle",
    graph: Annotated[
        Literal["attribute", "state", "merged"],
        typer.Option("--graph", help="What things are, how they are now, or both."),
    ] = "merged",
    output: OutputOption = None,
    at: AtOption = None,
    place: Place = ANYWHERE,
) -> None:
    """Write the graph for other tools. The same knowledge gives the same bytes."""
    from adaptbot_cli.session.queries import exported

    data = exported(place.home(), form, graph, at)
    if output is None:
        typer.echo(data, nl=False)
    else:
        write_out(output, data)


def import_(
    files: Annotated[list[Path], typer.Argument(metavar="FILE…", help="Graphs, such as Turtle.")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Let the files be all that is known.")
    ] = False,
    place: Place = ANYWHERE,
    consent: Consent = ASKING,
) -> int:
    """Take in a graph in this domain's vocabulary: what fits is committed, the rest is told.

    Of a property with one value only, the file's is taken. --replace: the rest is let go.
    """
    from adaptbot_cli.adapters.display.standing import parcel as table
    from adaptbot_cli.errors import KnowledgeError
    from adaptbot_cli.session.queries import imported, plain_parcel

    home = place.home()
    parcel, proposal = imported(home, files, replace)
    console(stderr=consent.json).print(table(parcel))
    if not parcel.accepted:
        names = ", ".join(path.name for path in files)
        raise KnowledgeError(f"nothing of {names} was taken: see why above")
    return carry_out(home, proposal, consent, extra=plain_parcel(parcel))
