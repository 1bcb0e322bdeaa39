"""The command `adaptbot`: its subcommands, and how errors reach the person."""

import difflib
import io
import logging
import os
import shlex
import sys
from collections.abc import Callable, Iterable
from functools import partial
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from adaptbot_cli import __version__
from adaptbot_cli.cli import check, doctor, domain, export, kg, pending, run, runs, trust, world
from adaptbot_cli.cli import eval as evaluate
from adaptbot_cli.cli.kg.changing import undo
from adaptbot_cli.errors import AdaptbotError, Interrupted, KnowledgeError, UsageError


class _Commands(TyperGroup):
    """Turns what a command returns into the exit code, and Ctrl-C into an error of ours."""

    def invoke(self, ctx: Any) -> Any:
        try:
            code = super().invoke(ctx)
        except KeyboardInterrupt:
            raise Interrupted("interrupted; nothing was committed") from None
        if code:
            raise typer.Exit(code)
        return code

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command; whoever has begun with the task itself is told how to say it."""
        if (
            args
            and not (ctx.resilient_parsing or args[0].startswith("-"))
            and self.get_command(ctx, args[0]) is None
        ):
            near = difflib.get_close_matches(args[0], self.list_commands(ctx), 1)
            meant = f"did you mean adaptbot {near[0]}?" if near else ""
            task = " ".join(arg for arg in args if not arg.startswith("-"))
            meant = meant or f"to pursue a task: adaptbot run {shlex.quote(task)}"
            raise UsageError(f'there is no command "{args[0]}"; {meant}')
        return super().resolve_command(ctx, args)


app = typer.Typer(
    cls=_Commands,
    name="adaptbot",
    help="Turn a generic plan into one that this home can execute, and learn what is missing.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run")(run.run)
app.command("check")(check.check)
app.command("replay")(runs.replay)
app.command("doctor")(doctor.doctor)
app.command("progress")(runs.progress)
app.command("export")(export.export)
app.command("resume")(runs.resume)
app.command("trust")(trust.trust)
app.command("runs")(runs.runs)
app.command("undo")(undo)
app.add_typer(pending.app, name="pending")
app.add_typer(kg.app, name="kg")
app.add_typer(domain.app, name="domain")
app.add_typer(world.app, name="world")
app.add_typer(evaluate.app, name="eval")


COMPLETING = "_ADAPTBOT_COMPLETE"
"""Set by a shell that asks, on a Tab, what could stand next."""


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"adaptbot {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
) -> None:
    """Hold the options of every command."""
    # `main` has read --debug, wherever it stands; it is declared here for the help.


def main() -> None:
    """Run the command line: errors as sentences, exit codes as documented."""
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a console that has no ✓ shows a ?
    logging.getLogger("rdflib.term").disabled = True  # it warns with a traceback of odd values
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    debug = len(arguments) < len(sys.argv) - 1
    from adaptbot_cli.cli.common import terminal

    if arguments or COMPLETING in os.environ or terminal() is None:
        carry_out(arguments, debug)
    else:
        from adaptbot_cli.cli.session import converse

        commands = [*_names(app.registered_commands), *_names(app.registered_groups)]
        carry_out([], debug, lambda: converse(partial(carry_out, debug=debug), commands))


def _names(registered: Iterable[Any]) -> list[str]:
    return [str(each.name) for each in registered]


def carry_out(
    arguments: list[str], debug: bool = False, instead: Callable[[], None] | None = None
) -> None:
    """Carry out a command, or something `instead`: errors as sentences, exit codes as documented.

    Raises:
        SystemExit: it ended with a code other than 0.
    """
    try:
        instead() if instead else app(args=arguments, prog_name="adaptbot")
    except BrokenPipeError:
        _no_more_output()  # whoever read it has gone; there is nobody to tell
    except AdaptbotError as error:
        if debug:
            raise
        _say(str(error) if isinstance(error, Interrupted) else f"error: {error}")
        if "--json" in arguments:
            _print_error(error)
        raise SystemExit(error.exit_code) from None
    except (RecursionError, MemoryError):
        # The readers are bounded; what is within their limits and still too much ends here.
        if debug:
            raise
        _say("error: what was read is too large or nested too deep to be worked out")
        raise SystemExit(KnowledgeError.exit_code) from None
    except OSError as error:
        # What a command reads or writes for itself says so; what is left is the output.
        if debug:
            raise
        _say(f"error: {error}")
        _no_more_output()
        raise SystemExit(1) from None


def _print_error(error: AdaptbotError) -> None:
    """Print an error as the object that a program waits for on stdout."""
    from adaptbot_cli.cli.common import print_json

    code = type(error).__name__.removesuffix("Error").lower()
    text, _, remedy = str(error).rpartition("; ")
    message = text or remedy
    print_json({"error": {"code": code, "message": message, "remedy": remedy if text else None}})


def _no_more_output() -> None:
    """Keep Python from trying again, at its end, to write what is left."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _say(text: str) -> None:
    import shutil
    import textwrap

    from adaptbot_cli.cli.common import at_terminal
    from adaptbot_cli.core.visible import visible

    message = visible(text)
    if at_terminal(sys.stderr):
        message = textwrap.fill(message, shutil.get_terminal_size().columns, break_on_hyphens=False)
    typer.echo(message, err=True)
