"""The command `adaptbot`: its subcommands, and how errors reach the person."""

import io
import logging
import os
import sys
from collections.abc import Callable, Iterable
from functools import partial
from typing import Annotated, Any, NoReturn

import typer

from adaptbot_cli import __version__
from adaptbot_cli.cli import (
    check,
    config,
    doctor,
    domain,
    export,
    kg,
    pending,
    plans,
    run,
    runs,
    trust,
    world,
)
from adaptbot_cli.cli.eval import trials
from adaptbot_cli.cli.help import PROGRAM, Group, complete
from adaptbot_cli.cli.kg.edits import undo
from adaptbot_cli.errors import AdaptbotError, Interrupted, KnowledgeError, UsageError


class _Commands(Group):
    """Turns Ctrl-C into an error of ours, before typer makes an exit code of it."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise Interrupted("interrupted; nothing was committed") from None


app = typer.Typer(
    cls=_Commands,
    name=PROGRAM,
    help="Turn a generic plan into one that this home can execute, and learn what is missing.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
_DO, _LOOK, _KNOW, _SET = "Do", "Look back", "Know and measure", "Set up"
app.command("run", rich_help_panel=_DO)(run.run)
app.command("check", rich_help_panel=_DO)(check.check)
app.command("resume", rich_help_panel=_DO)(runs.resume)
app.command("export", rich_help_panel=_DO)(export.export)
app.add_typer(pending.app, name="pending", rich_help_panel=_DO)
app.add_typer(plans.app, name="plans", rich_help_panel=_KNOW)
app.add_typer(runs.app, name="runs", rich_help_panel=_LOOK)
app.command("progress", rich_help_panel=_LOOK)(runs.progress)
app.command("replay", rich_help_panel=_LOOK)(runs.replay)
app.command("undo", rich_help_panel=_LOOK)(undo)
app.add_typer(kg.app, name="kg", rich_help_panel=_KNOW)
app.add_typer(domain.app, name="domain", rich_help_panel=_KNOW)
app.add_typer(world.app, name="world", rich_help_panel=_KNOW)
app.add_typer(trials.app, name="eval", rich_help_panel=_KNOW)
app.command("doctor", rich_help_panel=_SET)(doctor.doctor)
app.command("config", rich_help_panel=_SET)(config.config)
app.command("trust", rich_help_panel=_SET)(trust.trust)
complete(app)

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
        code = instead() if instead else app(arguments, PROGRAM, standalone_mode=False)
        if code:
            raise SystemExit(code)
    except BrokenPipeError:
        _no_more_output()  # whoever read it has gone; there is nobody to tell
    except typer.Abort:
        _end(Interrupted("interrupted; nothing was committed"), arguments, debug)
    except _NOT_MEANT as error:
        _end(_usage(error), arguments, debug)
    except AdaptbotError as error:
        _end(error, arguments, debug)
    except (RecursionError, MemoryError):
        # The readers are bounded; what is within their limits and still too much ends here.
        text = "what was read is too large or nested too deep to be worked out"
        _end(KnowledgeError(text), arguments, debug)
    except OSError as error:
        # What a command reads or writes for itself says so; what is left is the output.
        if debug:
            raise
        _say(f"error: {error}")
        _no_more_output()
        raise SystemExit(1) from None


_NOT_MEANT: type[Any] = next(
    each for each in typer.BadParameter.__mro__ if each.__name__ == "ClickException"
)
"""What typer raises of all that it cannot read; it has no public name in every version."""


def _usage(error: Any) -> UsageError:
    """Return an error of typer's as one of ours. Who says nothing at all gets the help page."""
    text = error.format_message().rstrip(".")
    if type(error).__name__ == "NoArgsIsHelpError" or not text:
        raise SystemExit(error.exit_code)
    context = getattr(error, "ctx", None)
    path = context.command_path if context else PROGRAM
    return UsageError(f"{text[0].lower()}{text[1:]}; see {path} --help")


def _end(error: AdaptbotError, arguments: list[str], debug: bool) -> NoReturn:
    """End with an error: a sentence for the person, an object for a program that waits for one."""
    if debug:
        raise error
    _say(str(error) if isinstance(error, Interrupted) else f"error: {error}")
    if "--json" in arguments:
        from adaptbot_cli.cli.common import print_json

        code = type(error).__name__.removesuffix("Error").lower()
        text, _, remedy = str(error).rpartition("; ")
        message = text or remedy
        record = {"code": code, "message": message, "remedy": remedy if text else None}
        print_json({"error": record})
    raise SystemExit(error.exit_code) from None


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
        # A command is left to the terminal to wrap: a line break in it could not be pasted.
        width = shutil.get_terminal_size().columns
        text, _, remedy = message.rpartition("; ")
        parted = text and PROGRAM in remedy and len(message) > width
        lines = [text + ";", remedy] if parted else [message]
        lines[0] = textwrap.fill(lines[0], width, break_on_hyphens=False)
        message = "\n".join(lines)
    typer.echo(message, err=True)
