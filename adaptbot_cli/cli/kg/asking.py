"""What the commands that change something share: seen first, agreed to, then committed."""

from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli.common import console, print_json, terminal

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

    from adaptbot_cli.session.change import ProposedChange
    from adaptbot_cli.session.knowledge import Home

YesOption = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before committing.")]
DryRunOption = Annotated[bool, typer.Option("--dry-run", help="Show the change; write nothing.")]


def carry_out(
    home: "Home",
    proposal: "ProposedChange",
    *,
    yes: bool,
    dry_run: bool = False,
    json: bool = False,
    more: "RenderableType | None" = None,
    told: dict[str, Any] | None = None,
) -> int:
    """Show a change, have it agreed to, commit it; return the exit code.

    `more` is shown below the change, `told` is what `--json` tells besides it.

    Raises:
        UsageError: there is nobody to ask, and --yes was not said.
        KnowledgeError: the change cannot be made.
    """
    from rich.text import Text

    from adaptbot_cli.adapters.display.cells import cell
    from adaptbot_cli.adapters.display.origins import preview
    from adaptbot_cli.core.changes import as_json
    from adaptbot_cli.session import change

    out = console(stderr=json)
    words = change.preview_words(home, proposal.delta)
    if proposal.delta:
        out.print(preview(proposal.changes, words))
    else:
        out.print(Text("nothing would change: it is so already", "dim"))
    for note in proposal.notes:
        out.print(Text("! ", "yellow") + cell(note))
    if more is not None:
        out.print(more)
    revision = None
    if proposal.delta and dry_run:
        change.judge(home, proposal.delta)
    if proposal.delta and not dry_run:
        if not (yes or agreed(out, "Commit this?")):
            out.print(Text("nothing was changed", "dim"))
            return 0
        revision = change.commit(home, proposal)
        out.print(Text("✓ ", "green") + Text(f"committed as {(revision or '')[:7]}"))
    if json:
        print_json({"revision": revision, **as_json(proposal.changes, words), **(told or {})})
    return 0


def agreed(out: "Console", question: str) -> bool:
    """Ask the person at the terminal. Raises UsageError if there is none."""
    from adaptbot_cli.errors import UsageError

    if terminal() is None:
        raise UsageError("there is no terminal to ask at: say --yes, or --dry-run")
    from adaptbot_cli.adapters.terminal.canvas import ask
    from adaptbot_cli.adapters.terminal.menu import YesNo

    return bool(ask(YesNo(question), out).value == "yes")
