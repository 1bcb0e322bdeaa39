"""`adaptbot kg sync`, `pull`, `push`: one home's knowledge in several workspaces."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ANYWHERE,
    FINDINGS,
    AnswersOption,
    JsonOption,
    Place,
    WorkspaceOption,
    console,
    note,
    note_ignored,
    print_json,
    terminal,
    workspace,
)

if TYPE_CHECKING:
    from adaptbot_cli.session.exchange import Exchange, Served


def sync(
    remote: Annotated[
        str, typer.Argument(metavar="REMOTE", help="A git address, folder, or remote's name.")
    ],
    answers: AnswersOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Share this home's knowledge by git: fetch, merge fact by fact, send what was merged.

    Of answers that cannot both stand, a person says which does; where one stays open nothing is
    changed, and `adaptbot pending` lists it (exit 3).
    """
    from adaptbot_cli.errors import Interrupted
    from adaptbot_cli.session.build import human_of
    from adaptbot_cli.session.sync import sync as synced

    human = human_of(answers, terminal())
    try:
        came = synced(workspace(workspace_dir), remote, human)
    except KeyboardInterrupt:
        raise Interrupted("interrupted; nothing was changed here by it") from None
    unused: Any = getattr(human, "unused", list)
    for reply in (*came.notes, *unused()):
        note(reply)
    if json:
        print_json(
            {
                "before": came.before,
                "revision": came.revision,
                "sent": came.sent,
                "settled": [lesson.sentence for lesson in came.settled],
                "open": [plain_question(question) for question in came.open],
            }
        )
    else:
        _show(came, remote)
    return FINDINGS if came.open else 0


def pull(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[NAME…]", help="Only these; else everything.", autocompletion=completion.things
        ),
    ] = None,
    answers: AnswersOption = None,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> int:
    """Take in what the shared graph on a SPARQL server knows: everything, or what is named."""
    served = _served(place, answers)
    return _exchanged(served.pull(names or (), everything=not names), json)


def push(
    answers: AnswersOption = None,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> int:
    """Send what was learned here to the shared graph, if nothing that it rests on has changed."""
    return _exchanged(_served(place, answers).push(), json)


def _served(place: Place, answers: Path | None) -> "Served":
    from adaptbot_cli.session.build import human_of
    from adaptbot_cli.session.exchange import Served

    home = place.home()
    note_ignored(home.workspace)
    return Served.of(home, human_of(answers, terminal()))


def _exchanged(came: "Exchange", json: bool) -> int:
    from adaptbot_cli.adapters.display.cells import GOOD, count, noted

    for text in came.notes:
        note(f"left out: {text}")
    if json:
        plain = {
            name: {"added": len(delta.added), "removed": len(delta.removed)}
            for name, delta in (("came", came.came), ("sent", came.sent))
        }
        print_json({**plain, "open": [plain_question(question) for question in came.open]})
    elif came.open:
        show_conflicts(came.open, "adaptbot kg pull")
    else:
        sizes = [len(delta.added) + len(delta.removed) for delta in (came.came, came.sent)]
        text = f"{count(sizes[0], 'fact')} came, {sizes[1]} sent"
        console().print(noted(GOOD, text if any(sizes) else "nothing new"))
    return FINDINGS if came.open else 0


def plain_question(question: Any) -> dict[str, Any]:
    """Return a conflict as a plain object."""
    answers = [
        {"answer": choice.value, "says": choice.label, "by": choice.then}
        for choice in question.choices[:2]
    ]
    return {
        "about": question.about,
        "kind": question.kind,
        "prop": question.prop or None,
        "text": question.text,
        "answers": answers,
    }


def show_conflicts(conflicts: Any, command: str) -> None:
    """Show answers of which one can stand, with who gave each, and how to settle them."""
    from rich.text import Text

    from adaptbot_cli.adapters.display.cells import cell, count

    out = console()
    for question in conflicts:
        sides = " or ".join(f"{c.label} ({c.then})" for c in question.choices[:2])
        out.print(Text("? ", "cyan") + cell(f"{question.text} {sides}"), soft_wrap=True)
    text = f"{count(len(conflicts), 'conflict')} to settle, until then nothing is merged; say at a "
    out.print(cell(f"{text}terminal, or with --answers FILE: {command}", "dim"), soft_wrap=True)


def _show(came: Any, remote: str) -> None:
    from adaptbot_cli.adapters.display.cells import GOOD, noted

    out = console()
    for lesson in came.settled:
        out.print(noted(GOOD, lesson.sentence))
    if came.open:
        show_conflicts(came.open, f"adaptbot kg sync {remote}")
        return
    moved = came.before != came.revision
    text = f"now at {came.revision[:7]}" if came.revision else "nothing is there yet"
    text = text if moved else f"nothing new from {remote}"
    text += f", sent to {remote}" if came.sent else ""
    hint = f"; adaptbot kg diff {came.before[:7]} tells what came" if moved and came.before else ""
    out.print(noted(GOOD, f"{text}{hint}"))
