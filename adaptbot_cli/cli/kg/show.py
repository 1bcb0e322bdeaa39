"""`adaptbot kg show` and `stats`: what is known of this home."""

import shlex
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ANYWHERE,
    AtOption,
    JsonOption,
    KgOption,
    Place,
    console,
    print_json,
)

if TYPE_CHECKING:
    from rich.console import RenderableType

    from adaptbot_cli.core.graph.kg import Kg

    Shown = tuple[Any, Callable[[], RenderableType]]


def show(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|CLASS|PLACE]",
            help="A thing, class, action or task.",
            autocompletion=completion.anything,
        ),
    ] = None,
    at: AtOption = None,
    tasks: Annotated[bool, typer.Option("--tasks", help="List the tasks that are known.")] = False,
    actions: Annotated[bool, typer.Option("--actions", help="List the actions.")] = False,
    place: Place = ANYWHERE,
    kg: KgOption = None,
    json: JsonOption = False,
) -> None:
    """Show what is known: all of it, one thing, place, class, action or task."""
    from adaptbot_cli.session import sources

    home = place.home()
    graph = sources.load(home.workspace, home.domain, kg or (), at)
    if tasks or actions:
        plain, table = _listed(graph, tasks, actions)
    elif name is None:
        plain, table = _everything(graph)
    else:
        plain, table = _called(graph, name)
    if json:
        print_json(plain)
    else:
        console().print(table())


def _listed(graph: "Kg", tasks: bool, actions: bool) -> "Shown":
    from adaptbot_cli.adapters.display import things
    from adaptbot_cli.core.view import descriptions

    domain = graph.domain
    task_entries = [descriptions.task(task, domain) for task in domain.tasks] if tasks else []
    found = domain.actions.values() if actions else ()
    action_entries = [descriptions.action(graph, action) for action in found]
    return [*task_entries, *action_entries], lambda: things.listing(task_entries, action_entries)


def _everything(graph: "Kg") -> "Shown":
    from adaptbot_cli.adapters.display import things
    from adaptbot_cli.core.view import facts as view

    groups = view.everything(graph)
    found = [thing.as_json() for _, members in groups for thing in members]
    return {**_size(graph), "things": found}, lambda: things.everything(graph, groups)


def _called(graph: "Kg", name: str) -> "Shown":
    """What bears a name: a thing goes before a class, an action and a task."""
    from adaptbot_cli.adapters.display import things
    from adaptbot_cli.core.view import descriptions
    from adaptbot_cli.core.view import facts as view

    found = view.called(graph, name)
    if found:
        thing = view.thing(graph, found[0])
        return thing.as_json(), lambda: things.one(graph, thing)
    kind = view.kind_called(graph, name)
    if kind is not None:
        members = view.members(graph, kind)
        about = descriptions.kind(graph.domain, kind)
        return (
            [thing.as_json() for thing in members],
            lambda: things.members(graph, kind, members, about),
        )
    action = descriptions.action_called(graph, name)
    if action is not None:
        record = descriptions.action(graph, action)
        return record, lambda: things.action(record)
    task = descriptions.task_called(graph, name)
    if task is not None:
        wanted = descriptions.task(task, graph.domain)
        missing = [item for item in wanted["needs"] if not graph.find(item)]
        return {**wanted, "missing": missing}, lambda: things.task(
            wanted, missing, graph.domain.name
        )
    raise _unknown(graph, name)


def _unknown(graph: "Kg", name: str) -> Exception:
    from adaptbot_cli.core.ask.learning import is_absent
    from adaptbot_cli.core.view import facts as view
    from adaptbot_cli.errors import UsageError

    for kind, what in (("item", "here"), ("action", "possible here")):
        if is_absent(graph, name, kind):
            word = shlex.quote(name)
            return UsageError(
                f"{name} is not {what}, as a person has said; `adaptbot kg why {word}` tells who, "
                f"`adaptbot kg retract {word}` takes it back"
            )
    near = view.near(graph, name, whatever=True)
    hint = f"; near it: {', '.join(near)}" if near else ""
    return UsageError(f"no thing, class, action or task is called {name}{hint}")


def _size(graph: "Kg") -> dict[str, Any]:
    nodes, edges = graph.size()
    return {"domain": graph.domain.name, "nodes": nodes, "edges": edges}


def stats(
    place: Place = ANYWHERE,
    kg: KgOption = None,
    json: JsonOption = False,
) -> None:
    """Count nodes and edges as the paper does, and what there is of each class."""
    from adaptbot_cli.adapters.display import things
    from adaptbot_cli.core.graph.terms import local
    from adaptbot_cli.core.view import facts as view
    from adaptbot_cli.session import sources

    home = place.home()
    graph = sources.load(home.workspace, home.domain, kg or ())
    record = {
        **_size(graph),
        "classes": {local(kind.iri): count for kind, count in view.counts(graph)},
        "actions": len(graph.domain.actions),
        "tasks": len(graph.domain.tasks),
    }
    if json:
        print_json(record)
    else:
        console().print(things.stats(graph, record))
