"""`adaptbot kg`: look at what is known of this home."""

from typing import Annotated, Any

import typer

from adaptbot_cli.cli.common import (
    DomainOption,
    JsonOption,
    KgOption,
    WorkspaceOption,
    console,
    domain_name,
    print_json,
    workspace,
)

app = typer.Typer(help="The knowledge graph of this home.", no_args_is_help=True)


@app.command()
def show(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME|CLASS|PLACE]", help="A thing, class or place.")
    ] = None,
    at: Annotated[
        str | None, typer.Option("--at", metavar="REV", help="As it was at a revision.")
    ] = None,
    domain: DomainOption = None,
    kg: KgOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Show what is known: all of it, one thing, one class, or one place and what is there."""
    from adaptbot_cli import session
    from adaptbot_cli.adapters import tables
    from adaptbot_cli.core import view
    from adaptbot_cli.core.learning import is_absent
    from adaptbot_cli.errors import UsageError

    home = workspace(workspace_dir)
    graph = session.load(home, domain_name(domain, home), kg or (), at)
    if name is None:
        groups = view.everything(graph)
        if json:
            things = [thing.as_json() for _, members in groups for thing in members]
            print_json({**_size(graph), "things": things})
        else:
            console().print(tables.everything(graph, groups))
        return
    found = graph.find(name)
    if found:
        thing = view.thing(graph, found[0])
        print_json(thing.as_json()) if json else console().print(tables.one(graph, thing))
        return
    kind = view.kind_called(graph, name)
    if kind is None:
        if is_absent(graph, name, "item"):
            raise UsageError(
                f"{name} is not here, as a person has said: see git log -S in {home.root}"
            )
        near = view.near(graph, name)
        hint = f"; near it: {', '.join(near)}" if near else ""
        raise UsageError(f"neither a thing nor a class is called {name}{hint}")
    members = view.members(graph, kind)
    if json:
        print_json([thing.as_json() for thing in members])
    else:
        console().print(tables.members(graph, kind, members))


def _size(graph: Any) -> dict[str, Any]:
    nodes, edges = graph.size()
    return {"domain": graph.domain.name, "nodes": nodes, "edges": edges}


@app.command()
def stats(
    domain: DomainOption = None,
    kg: KgOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Count nodes and edges as the paper does, and what there is of each class."""
    from adaptbot_cli import session
    from adaptbot_cli.adapters import tables
    from adaptbot_cli.core import view
    from adaptbot_cli.core.terms import local

    home = workspace(workspace_dir)
    graph = session.load(home, domain_name(domain, home), kg or ())
    counts = {local(kind.iri): len(things) for kind, things in view.everything(graph)}
    told = {
        **_size(graph),
        "classes": counts,
        "actions": len(graph.domain.actions),
        "tasks": len(graph.domain.tasks),
    }
    if json:
        print_json(told)
    else:
        console().print(tables.stats(graph, told))
