"""Help pages with lines to paste, wrong words with the right ones, errors as objects."""

import shlex
from collections.abc import Iterator
from typing import Any

import pytest
import typer

from adaptbot_cli.cli.help import examples
from adaptbot_cli.cli.main import app
from tests.cli.command import Home, mapped

ROOT = typer.main.get_command(app)


def commands(command: Any = ROOT, path: str = "") -> Iterator[tuple[str, Any]]:
    """Give every command with its path, groups too if they do something themselves."""
    if getattr(command, "commands", None) is None or getattr(
        command, "invoke_without_command", False
    ):
        yield path, command
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, f"{path} {name}".strip())


COMMANDS = dict(commands())
LINES = [(path, line) for path in ("", *COMMANDS) for line in examples(path)]
FIRST = (
    *("run", "check", "runs list", "runs show", "progress", "pending", "config", "kg show"),
    *("kg stats", "kg why", "kg query", "kg export", "kg status", "kg validate", "kg log"),
    *("kg diff", "kg retract", "domain list", "domain check", "domain docs"),
)
"""Commands whose first example needs no model, no file and no person."""


def parsed(args: list[str], command: Any = ROOT, parent: Any = None) -> str:
    """Parse arguments down the tree of commands, and return the path of the command they name.

    Raises what typer raises of arguments that it cannot read.
    """
    name = "adaptbot" if parent is None else command.name
    context = command.make_context(name, list(args), parent=parent)
    rest = [*getattr(context, "_protected_args", ()), *context.args]
    if not rest or getattr(command, "commands", None) is None:
        return str(context.command_path.removeprefix("adaptbot").strip())
    _, below, left = command.resolve_command(context, rest)
    return parsed(left, below, context)


def arguments(line: str) -> list[str]:
    """The arguments of an example, without what is piped into it."""
    return shlex.split(line[line.index("adaptbot ") :])[1:]


def test_every_command_has_examples() -> None:
    assert [path for path in COMMANDS if len(examples(path)) == 0] == []


@pytest.mark.parametrize(("path", "line"), LINES)
def test_an_example_is_of_its_command_and_can_be_read(path: str, line: str) -> None:
    found = parsed(arguments(line)) if not line.endswith("--help") else path
    assert path in (found, "")


def test_examples_stand_whole_on_the_pages_at_80_columns(used: Home) -> None:
    pages = used.adaptbots([[*path.split(), "--help"] for path in ("", *COMMANDS)])
    for path, page in zip(("", *COMMANDS), pages, strict=True):
        shown = [line.strip() for line in page.out.splitlines()]
        assert all(line in shown for line in examples(path)), page.out
        assert max(map(len, page.out.splitlines())) <= 80 and "bool" not in page.out


def test_the_first_examples_can_be_carried_out(used: Home) -> None:
    assert used.adaptbot("run", "make tea", "--no-human").code == 0
    for path in FIRST:
        line = examples(path)[0]
        ended = used.adaptbot(*arguments(line), stdin=b'pick_up_obj("egg")\n')
        assert "Traceback" not in ended.err and "see adaptbot" not in ended.err, line
        assert ended.code in (0, 3), ended.said


WRONG_WORDS = (
    (["make", "omelette"], 'to ask for a task: adaptbot run "make omelette"'),
    (["cook", "it's"], "to ask for a task: adaptbot run 'cook it'\"'\"'s'"),
    (["rnu"], "did you mean adaptbot run?"),
    (["rnu", "make tea"], "did you mean adaptbot run 'make tea'?"),
    (["kg", "shwo", "egg"], "did you mean adaptbot kg show egg?"),
    (["kg", "zzz"], "see adaptbot kg --help"),
    (["pending", "anser"], "did you mean adaptbot pending answer?"),
    (["domain", "chekc"], "did you mean adaptbot domain check?"),
    (["eval", "compaer", "a", "b"], "did you mean adaptbot eval compare a b?"),
)


def test_a_wrong_word_is_told_the_right_one(used: Home) -> None:
    asked = [[*words, "--json"] for words, _ in WRONG_WORDS]
    for (_, said), ended in zip(WRONG_WORDS, used.adaptbots(asked), strict=True):
        assert ended.code == 2 and said.replace("?", "") in ended.said
        error = ended.json()["error"]
        assert error["code"] == "usage" and "has no command" in error["message"]


def test_every_error_is_an_object_where_one_is_waited_for(used: Home) -> None:
    reading = [p for p, c in COMMANDS.items() if any("--json" in q.opts for q in c.params)]
    assert len(reading) > 20
    used.write("broken/adaptbot.toml", "no toml")
    needed = {path: [q for q in COMMANDS[path].params if q.required] for path in reading}
    for more in (["--nope"], ["--workspace", "broken"]):
        asked = [
            [*path.split(), *(["exec:true"] * len(needed[path])), *more, "--json"]
            for path in reading
            if more[0] == "--nope" or any("--workspace" in q.opts for q in COMMANDS[path].params)
        ]
        for line, ended in zip(asked, used.adaptbots(asked), strict=True):
            if line[0] == "doctor" and more[0] != "--nope":
                continue  # it is what it is there to tell
            assert ended.code in (2, 4), (line, ended.said)
            assert mapped([ended.json()["error"]], "code")[0][0] in ("usage", "knowledge"), line
            assert "Traceback" not in ended.err
