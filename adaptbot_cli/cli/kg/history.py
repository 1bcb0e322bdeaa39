"""`adaptbot kg log`, `diff`, `why`: what was taught, by whom, and what changed."""

from typing import Annotated

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ANYWHERE,
    JsonOption,
    Place,
    console,
    print_json,
)


def log(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME|RUN]",
            help="Only what concerns a thing, or what a run taught.",
            autocompletion=completion.taught,
        ),
    ] = None,
    number: Annotated[
        int, typer.Option("-n", min=1, metavar="N", help="Show the newest N commits.")
    ] = 20,
    facts: Annotated[bool, typer.Option("--facts", help="Show every fact.")] = False,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> None:
    """Tell what each commit taught, newest first: by whom, for which task, with which model."""
    from itertools import islice

    from rich.text import Text

    from adaptbot_cli.adapters.display.origins import log as table
    from adaptbot_cli.session.knowledge import chapters

    home = place.home()
    found = list(islice(chapters(home, name), number))
    if json:
        print_json([chapter.as_json(home.words) for chapter in found])
    elif found:
        console().print(table(found, home.words, facts))
    elif home.versions is None:
        hint = f"nothing was taught yet: this is the {home.domain} as it comes"
        console().print(Text(hint, "dim"))
    else:
        console().print(Text("no commit of this workspace concerns it", "dim"))


def diff(
    a: Annotated[
        str | None,
        typer.Argument(metavar="[A]", help="A revision.", autocompletion=completion.revisions),
    ] = None,
    b: Annotated[
        str | None,
        typer.Argument(metavar="[B]", help="A later one.", autocompletion=completion.revisions),
    ] = None,
    patch: Annotated[
        bool, typer.Option("--patch", help="Print a SPARQL update for `kg query --update`.")
    ] = False,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> None:
    """Tell what changed, fact by fact: from A to B, or from A to the files as they are.

    Without A and B: from the last commit to the files if they were edited, else what the last
    commit changed.
    """
    from rich.text import Text

    from adaptbot_cli.adapters.display.cells import cell
    from adaptbot_cli.adapters.display.origins import difference, patch_notes
    from adaptbot_cli.adapters.store.turtle import engine_term
    from adaptbot_cli.core.view.changes import as_json, as_update
    from adaptbot_cli.session.knowledge import differences

    home = place.home()
    changes, before, after, words = differences(home, a, b)
    if json:
        print_json({"from": before, "to": after, **as_json(changes, words)})
    elif patch:
        for note in patch_notes(changes):
            typer.echo(note)
        typer.echo(as_update(changes.delta, lambda node: str(engine_term(node))), nl=False)
    else:
        out = console()
        out.print(Text.assemble(cell(before, "yellow"), " → ", cell(after, "yellow")))
        out.print(difference(changes, words))


def why(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="A thing, an action, an absence.", autocompletion=completion.taught
        ),
    ],
    prop: Annotated[
        str, typer.Argument(metavar="[PROPERTY]", help="One property, with all its past.")
    ] = "",
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> None:
    """Tell where each fact comes from: question, answer, person, task, model, transcript, time."""
    from adaptbot_cli.adapters.display.origins import why as table
    from adaptbot_cli.core.graph.terms import local
    from adaptbot_cli.core.view import descriptions
    from adaptbot_cli.session import knowledge

    home = place.home()
    reply = knowledge.why(home, name, prop)
    known = descriptions.action_called(home.kg, reply.name)
    action = None if known is None else descriptions.action(home.kg, known)
    if not json:
        console().print(table(reply.name, reply.facts, reply.history, home.words, action))
        return
    facts = [
        {
            "name": home.words.name(s),
            "predicate": local(p),
            "label": home.words.label(p),
            "value": home.words.value(o),
            "origin": reply.facts[s, p, o].as_json(),
        }
        for s, p, o in sorted(reply.facts)
    ]
    past = [
        {"sign": turn.sign, "value": home.words.value(turn.triple[2]), **turn.origin.as_json()}
        for turn in reply.history
    ]
    record = {"name": reply.name, "facts": facts, "history": past}
    print_json(record | ({"action": action} if action else {}))
