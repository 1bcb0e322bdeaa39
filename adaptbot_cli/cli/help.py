"""How the command line helps: examples on every page, panels, and what a wrong word was to be."""

import difflib
import inspect
import re
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import is_dataclass
from functools import partial, wraps
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from adaptbot_cli.errors import UsageError

(task_option, person_option, model_option, world_option, home_option, output_option) = (
    partial(typer.Option, rich_help_panel=panel)
    for panel in ("Task", "Person", "Model", "World", "Home", "Output")
)
"""Options by the panel of the help page that they stand in; one command's own stand in none."""

_EXAMPLES = {
    "": (
        'adaptbot run "make omelette"',
        "adaptbot kg show",
        "adaptbot kg --help",
    ),
    "run": (
        'adaptbot run "make omelette"',
        'adaptbot run "make tomato soup" --without garlic --dry-run',
        'adaptbot run "make tea" --model ollama_chat/llama3.2 --max-cost 0.10',
        'adaptbot run "make tea" --robot robot2',
    ),
    "check": (
        """echo 'pick_up_obj("egg")' | adaptbot check -""",
        'adaptbot check plan.txt --task "make omelette"',
        "adaptbot check plan.txt --no-repair --json",
    ),
    "resume": ("adaptbot resume", "adaptbot resume --timeout 600"),
    "runs list": ("adaptbot runs", "adaptbot runs omelette --last 5", "adaptbot runs --json"),
    "runs show": ("adaptbot runs show make_tea", "adaptbot runs show 20261130T1058 --json"),
    "runs compare": (
        "adaptbot runs compare 20261130T1058 20261130T1102",
        "adaptbot runs compare make_tea make_omelette --json",
    ),
    "replay": (
        "adaptbot replay transcripts/*.yaml",
        "adaptbot replay 20261130T1058",
    ),
    "progress": (
        "adaptbot progress",
        "adaptbot progress make_omelette --svg omelette.svg",
    ),
    "export": (
        "adaptbot export make_omelette --as bt -o omelette.xml",
        'adaptbot export plan.txt --task "make omelette" --as pddl',
    ),
    "undo": ("adaptbot undo", "adaptbot undo --suggestions --dry-run"),
    "trust": ("adaptbot trust", "adaptbot trust --revoke"),
    "config": ("adaptbot config", "adaptbot config model", "adaptbot config --json"),
    "doctor": ("adaptbot doctor", "adaptbot doctor --json"),
    "pending": ("adaptbot pending", "adaptbot pending --domain household --json"),
    "pending answer": (
        "adaptbot pending answer",
        "adaptbot pending answer --answers answers.yaml",
    ),
    "plans": ("adaptbot plans", "adaptbot plans --domain household --json"),
    "plans show": ("adaptbot plans show make_omelette",),
    "plans drop": ("adaptbot plans drop make_omelette --yes",),
    "kg show": (
        "adaptbot kg show egg",
        "adaptbot kg show fridge --json",
        "adaptbot kg show --tasks --domain household",
    ),
    "kg stats": ("adaptbot kg stats", "adaptbot kg stats --domain household --json"),
    "kg why": ("adaptbot kg why egg", "adaptbot kg why egg obj_location"),
    "kg query": (
        "adaptbot kg query 'SELECT ?egg { ?egg ex:obj_location ex:fridge }'",
        "adaptbot kg query 'ASK { ex:egg ex:obj_location ex:fridge }' --json",
    ),
    "kg export": (
        "adaptbot kg export -o home.ttl",
        "adaptbot kg export --format json-ld --graph state",
    ),
    "kg import": (
        "adaptbot kg import home.ttl --dry-run",
        "adaptbot kg import home.ttl --yes",
    ),
    "kg status": ("adaptbot kg status", "adaptbot kg status --json"),
    "kg validate": ("adaptbot kg validate", "adaptbot kg validate --kg home.ttl"),
    "kg log": ("adaptbot kg log", "adaptbot kg log egg -n 5 --facts"),
    "kg diff": ("adaptbot kg diff", "adaptbot kg diff HEAD~3 HEAD", "adaptbot kg diff --patch"),
    "kg commit": ('adaptbot kg commit -m "the kettle has moved"',),
    "kg split": ("adaptbot kg split", "adaptbot kg split --domain household"),
    "kg add": ("adaptbot kg add leek", "adaptbot kg add leek --answers leek.yaml --yes"),
    "kg set": (
        "adaptbot kg set egg place cabinet --yes",
        "adaptbot kg set egg sliceable no --dry-run",
    ),
    "kg retract": (
        "adaptbot kg retract egg --dry-run",
        "adaptbot kg retract egg obj_location fridge",
    ),
    "kg revert": ("adaptbot kg revert HEAD --dry-run", "adaptbot kg revert --answer a1b2c3"),
    "kg sync": (
        "adaptbot kg sync /media/stick/robot.git",
        "adaptbot kg sync git@example.org:home/robot.git",
    ),
    "kg pull": ("adaptbot kg pull", "adaptbot kg pull egg pan"),
    "kg push": ("adaptbot kg push", "adaptbot kg push --json"),
    "domain list": ("adaptbot domain list", "adaptbot domain list --json"),
    "domain new": ("adaptbot domain new garden", "adaptbot domain new my_kitchen --like kitchen"),
    "domain import": ("adaptbot domain import domain.pddl problem.pddl --name blocks",),
    "domain check": ("adaptbot domain check kitchen", "adaptbot domain check kitchen --json"),
    "domain docs": (
        "adaptbot domain docs kitchen",
        "adaptbot domain docs household -o household.md",
    ),
    "world check": (
        "adaptbot world check 'exec:python robot.py'",
        "adaptbot world check 'exec:python robot.py' --domain household",
    ),
    "eval run": (
        "adaptbot eval recordings.jsonl",
        "adaptbot eval tasks.yaml --model library --world truth",
        "adaptbot eval recordings.jsonl --json --plot report.svg",
        "adaptbot eval recordings.jsonl --cluster tcp://192.168.0.10:8786",
    ),
    "eval published": ("adaptbot eval published AdaptBot --limit 5",),
    "eval compare": ("adaptbot eval compare before.json after.json",),
}
"""Lines to paste, by command."""


def examples(path: str) -> tuple[str, ...]:
    """Return the examples on a command's page, such as that of "kg show"."""
    return _EXAMPLES.get(path, ())


def complete(app: typer.Typer, path: str = "") -> None:
    """Give the commands of an app the options that they share, and their examples below the help,
    one a line and none wrapped."""
    app.info.epilog = _epilog(path)
    if app.registered_callback and app.registered_callback.callback:
        app.registered_callback.callback = spread(app.registered_callback.callback)
    for command in app.registered_commands:
        command.callback = command.callback and spread(command.callback)
        name = command.name or getattr(command.callback, "__name__", "")
        command.epilog = _epilog(f"{path} {name}".strip())
    for group in app.registered_groups:
        if group.typer_instance is not None:
            complete(group.typer_instance, f"{path} {group.name}".strip())


def spread(command: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command with an option for each field of a dataclass among its parameters."""
    signature = inspect.signature(command, eval_str=True)
    groups: dict[str, tuple[Any, Mapping[str, Any]]] = {
        name: (kind, inspect.signature(kind, eval_str=True).parameters)
        for name, kind in command.__annotations__.items()
        if isinstance(kind, type) and is_dataclass(kind)
    }
    options = [
        option.replace(kind=option.KEYWORD_ONLY)
        for name, each in signature.parameters.items()
        for option in (groups[name][1].values() if name in groups else (each,))
    ]

    @wraps(command)
    def call(**given: Any) -> Any:
        for name, (kind, fields) in groups.items():
            given[name] = kind(**{field: given.pop(field) for field in fields})
        return command(**given)

    call.__annotations__ = {option.name: option.annotation for option in options}
    call.__signature__ = signature.replace(parameters=options)  # type: ignore[attr-defined]
    return call


def _epilog(path: str) -> str | None:
    """The examples as typer shows them, which reads marks of rich."""
    literal = (line.replace("[", "\\[") for line in examples(path))
    lines = [f"[cyan]{line}[/cyan]" for line in literal]
    return "\n".join(["[dim]For example:[/dim]", *lines]) if lines else None


PROGRAM = "adaptbot"
_SURE = 0.8


def nearest(word: str, known: Iterable[str], alike: float) -> str | None:
    """Return the known word that a word is a misspelling of, None if it is none's."""
    return next(iter(difflib.get_close_matches(word, list(known), 1, alike)), None)


class Group(TyperGroup):
    """Says of a word that is no command which one it was to be, or how to ask for a task.

    A group with a `default` takes any other word for an argument of that command, unless it is no
    file and nearly the name of one.
    """

    default = ""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments of the group."""
        first = args[0] if args else ""
        meant = first in (*self.commands, *ctx.help_option_names)
        misspelt = self.nearest(first, _SURE) and not Path(first).exists()
        if self.default and not (meant or misspelt or (ctx.resilient_parsing and not args)):
            args = [self.default, *args]
        return super().parse_args(ctx, args)

    def get_command(self, ctx: Any, name: str) -> Any:
        """Return a command by its name."""
        found = super().get_command(ctx, name)
        return found and _without_types(found, ctx)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        _without_types(self, ctx)
        super().format_help(ctx, formatter)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command. Raises UsageError."""
        word = args[0] if args else ""
        given = word and not (ctx.resilient_parsing or word.startswith("-"))
        if given and self.get_command(ctx, word) is None:
            raise UsageError(self._instead(ctx.command_path, args, self.nearest(word)))
        return super().resolve_command(ctx, args)

    def nearest(self, word: str, alike: float = 0.6) -> str | None:
        """Return the command that a word is a misspelling of, if it is one."""
        return nearest(word, self.commands, alike)

    @staticmethod
    def _instead(path: str, args: list[str], near: str | None) -> str:
        word, *rest = args
        hints = [f"did you mean {path} {shlex.join([near, *rest])}?"] if near else []
        if path == PROGRAM and (rest or not near):
            task = " ".join(arg for arg in args if not arg.startswith("-"))
            quoted = f'"{task}"' if re.fullmatch(r"[\w ,.-]+", task) else shlex.quote(task)
            hints.append(f"to ask for a task: adaptbot run {quoted}")
        return f'{path} has no command "{word}"; {" Or ".join(hints) or f"see {path} --help"}'


def _without_types(command: Any, ctx: Any) -> Any:
    """Take from a command's help what typer says of flags: that they are of type bool."""
    for param in (*command.params, command.get_help_option(ctx)):
        if getattr(param, "is_flag", False):
            param.metavar = ""
    return command
