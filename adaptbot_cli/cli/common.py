"""Options that several commands share, the consoles they write to, and a run's first lines."""

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.help import (
    home_option,
    model_option,
    output_option,
    person_option,
    task_option,
    world_option,
)
from adaptbot_cli.core.visible import visible

if TYPE_CHECKING:
    from rich.console import Console

    from adaptbot_cli.adapters.planner.choice import Chosen
    from adaptbot_cli.session.home import Home
    from adaptbot_cli.workspace import Workspace


WorkspaceOption = Annotated[
    Path | None,
    home_option("--workspace", metavar="DIR", help="The folder that holds this home's knowledge."),
]
AnswersOption = Annotated[
    Path | None, person_option(metavar="FILE", help="Answers in YAML, instead of a person.")
]
YesOption = Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before committing.")]
DryRunOption = Annotated[bool, typer.Option("--dry-run", help="Show the change; write nothing.")]
RobotOption = Annotated[
    str,
    home_option(
        "--robot",
        metavar="NAME",
        help="The robot of this home that acts (the domain's own).",
        autocompletion=completion.robots,
    ),
]
JsonOption = Annotated[bool, output_option("--json", help="Print one JSON object on stdout.")]
RequiresOption = Annotated[
    str | None,
    task_option(
        "--requires",
        metavar="A,B,C",
        help="Items that the result must use.",
        autocompletion=completion.things,
    ),
]
WithoutOption = Annotated[
    str | None,
    task_option(
        "--without",
        metavar="A,B,C",
        help="What must not be used, whatever the request.",
        autocompletion=completion.things,
    ),
]
TaskOption = Annotated[
    str,
    task_option(
        "--task",
        metavar="TEXT",
        help="The task, for its required items and goal.",
        autocompletion=completion.tasks,
    ),
]
OutputOption = Annotated[
    Path | None, output_option("-o", "--output", metavar="FILE", help="Write it here.")
]
KgOption = Annotated[
    list[Path] | None,
    home_option("--kg", metavar="FILE", help="A Turtle graph to use instead of the workspace's."),
]
AtOption = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="REV",
        help="As it was at a revision.",
        autocompletion=completion.revisions,
    ),
]
ApiBaseOption = Annotated[
    str | None,
    model_option(metavar="URL", help="An OpenAI-compatible server, for --model openai/NAME."),
]
TimeoutOption = Annotated[
    float | None,
    model_option(min=0.1, metavar="S", help="Seconds the model may take in this run (300)."),
]
ActTimeoutOption = Annotated[
    float | None,
    world_option(min=0.1, metavar="S", help="Seconds the world may take for one step (60)."),
]

FINDINGS = 3
"""The exit code of a command that has found what is not as it should be."""


@dataclass(frozen=True, slots=True)
class Place:
    """The options that say which home is meant: a domain in a workspace."""

    domain: Annotated[
        str | None,
        home_option(
            "--domain",
            metavar="NAME",
            help="The domain, such as kitchen.",
            autocompletion=completion.domains,
        ),
    ] = None
    workspace_dir: WorkspaceOption = None

    def home(self) -> "Home":
        """Find the home. Raises KnowledgeError: the settings cannot be read."""
        from adaptbot_cli.session.home import Home

        found = workspace(self.workspace_dir)
        return Home(found, domain_name(self.domain, found))


ANYWHERE = Place()


@dataclass(frozen=True, slots=True)
class Consent:
    """The options of what changes the knowledge: it is shown first, and agreed to."""

    yes: YesOption = False
    dry_run: DryRunOption = False
    json: JsonOption = False


ASKING = Consent()


@dataclass(frozen=True, slots=True)
class LimitOptions:
    """The options that limit what a run may take of a model."""

    timeout: TimeoutOption = None
    max_tokens: Annotated[
        int | None,
        model_option(min=1, metavar="N", help="Tokens, of prompts and answers, in this run."),
    ] = None
    max_cost: Annotated[
        float | None, model_option(min=0, metavar="USD", help="US dollars in this run.")
    ] = None


UNLIMITED = LimitOptions()


def workspace(option: Path | None) -> "Workspace":
    """Find the workspace that an option, the environment or the folder names."""
    from adaptbot_cli.workspace import find

    found = find(option)
    for path in found.passed_over:
        note(f"{path} belongs to another account: not used without --workspace {path.parent}")
    return found


def note(text: str, out: "Console | None" = None) -> None:
    """Print a line that the person should know of, on stderr unless `out` is given."""
    from adaptbot_cli.adapters.display.cells import warn

    warn(out or console(stderr=True), text)


def note_ignored(home: "Workspace") -> None:
    """Say which settings of the workspace are not obeyed, if there are any."""
    if home.ignored:
        text = ", ".join(home.ignored)
        note(f"{home.root / 'adaptbot.toml'}: {text} ignored until you say `adaptbot trust`")


def domain_name(option: str | None, home: "Workspace") -> str:
    """Return the domain that is meant: as said, as configured, or the kitchen that comes along."""
    return str(home.setting("domain", option or None))


def opened(
    screen: "Console",
    home: "Workspace",
    task: str,
    domain: str,
    model: str | None,
    api_base: str | None = None,
    named_by: str = "--model",
    robot: str = "",
) -> "Chosen":
    """Choose who plans and print what is pursued, who plans and why, before anything slow; a model
    is got ready meanwhile. Raises UsageError."""
    from adaptbot_cli.adapters.planner.choice import choose

    home.folder(domain)
    note_ignored(home)
    chosen = choose(model, home.settings, os.environ, api_base, named_by)
    where = f"{domain} as {robot}" if robot else domain
    show_opening(screen, task, where, chosen.name, chosen.why)
    if chosen.model is not None:
        from adaptbot_cli.adapters.planner.provider import load_early

        load_early()
    return chosen


def show_opening(console: "Console", task: str, domain: str, planner: str, why: str) -> None:
    """Print what is pursued, who plans, and why."""
    from rich.text import Text

    planned = Text(visible(f"{planner} ({why})"), "dim")
    parts = [Text(visible(task), "bold"), Text(visible(domain)), planned]
    for part in parts:
        part.truncate(300, overflow="ellipsis")
    console.print(Text(" · ").join(parts))


def items(option: str | None) -> tuple[str, ...]:
    """Split a list of items: "egg, salt"."""
    return tuple(part.strip() for part in (option or "").split(",") if part.strip())


def console(stderr: bool = False) -> "Console":
    """Return a console on stdout, or on stderr."""
    from rich.console import Console

    return Console(stderr=stderr, highlight=False)


def terminal() -> "Console | None":
    """Return the terminal that a person can be asked at, None if there is none.

    With ADAPTBOT_PLAIN numbered lines are asked and answered, through a pipe too.
    """
    plain = os.environ.get("ADAPTBOT_PLAIN", "") not in ("", "0")
    there = plain or (at_terminal(sys.stdin) and at_terminal(sys.stderr))
    return console(stderr=True) if there else None


def agreed(out: "Console", question: str) -> bool:
    """Ask the person at the terminal. Raises UsageError if there is none."""
    from adaptbot_cli.errors import UsageError

    if terminal() is None:
        raise UsageError("there is no terminal to ask at: say --yes, or --dry-run")
    from adaptbot_cli.adapters.terminal.canvas import ask
    from adaptbot_cli.adapters.terminal.menu import YesNo

    return bool(ask(YesNo(question), out).value == "yes")


def write_out(path: Path, content: str | bytes) -> None:
    """Write what a command has made to a file, and print where. Raises UsageError."""
    from adaptbot_cli.errors import UsageError

    try:
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise UsageError(f"cannot write {path}: {reason}") from error
    console(stderr=True).print(f"written to {path}", markup=False, soft_wrap=True)


def at_terminal(stream: IO[str] | None) -> bool:
    """Tell whether a stream is a terminal; Python has None for one that the shell closed."""
    return stream is not None and stream.isatty()


def print_json(value: Any) -> None:
    """Print a value as JSON on stdout, alone."""
    import json

    if sys.stdout is None:
        return
    utf8 = (sys.stdout.encoding or "utf-8").lower().replace("-", "") == "utf8"
    sys.stdout.write(escaped(json.dumps(value, ensure_ascii=not utf8, indent=2)) + "\n")
    sys.stdout.flush()


def escaped(json_text: str) -> str:
    """Return JSON with every character escaped that a terminal could act on or hide."""
    import json
    import re

    def escape(match: "re.Match[str]") -> str:
        char = match[0]
        return char if char.isprintable() else json.dumps(char)[1:-1]

    return re.sub(r"[^\n\x20-\x7e]", escape, json_text)
