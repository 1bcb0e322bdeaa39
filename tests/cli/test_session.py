"""A session: what is said line by line, in one process."""

import pytest

from adaptbot_cli.cli.session import arguments_of
from tests.cli.attended import ENTER, tty
from tests.cli.command import Home


@pytest.mark.parametrize(
    ("line", "robot", "arguments"),
    [
        ("make omelette", "", ["run", "--domain", "kitchen", "--", "make omelette"]),
        ("cook the chef's soup", "", ["run", "--domain", "kitchen", "--", "cook the chef's soup"]),
        ("show 'cutting board'", "", ["kg", "show", "cutting board", "--domain", "kitchen"]),
        ("runs --last 3", "", ["runs", "--last", "3"]),
        ("--help me", "", ["run", "--domain", "kitchen", "--", "--help me"]),
        ("make tea", "r2", ["run", "--domain", "kitchen", "--robot", "r2", "--", "make tea"]),
        ("plan tea", "r2", ["run", "--dry-run", "tea", "--domain", "kitchen", "--robot", "r2"]),
        ("Where's the chef's knife?", "", ["kg", "show", "chef's knife", "--domain", "kitchen"]),
        ("what are eggs", "", ["kg", "show", "eggs", "--domain", "kitchen"]),
        ("show egg", "r2", ["kg", "show", "egg", "--domain", "kitchen"]),
    ],
)
def test_a_line_is_a_command_or_else_a_task(line: str, robot: str, arguments: list[str]) -> None:
    assert arguments_of(line, "kitchen", frozenset({"runs", "kg"}), robot) == arguments


def test_one_thing_after_the_other_and_an_error_ends_only_its_line(home: Home) -> None:
    lines = (
        b"show gerlic\nshwo egg\nplan make tea\ndomain household\nshow mop\nwhat can you do?\n"
        b"quit\nshow egg\n"
    )
    ended = home.adaptbot(stdin=lines, ADAPTBOT_PLAIN="1")
    assert ended.code == 0, ended.err
    assert "no command shwo; did you mean show?" in ended.said
    assert "called gerlic" in ended.said and "executable, goal met" in ended.said
    assert "household>" in ended.said and "mop" in ended.out and "teach THING" in ended.said
    assert "egg" not in ended.out.rpartition("mop")[2]


def test_at_a_terminal_it_asks_and_quits(home: Home) -> None:
    with tty(home) as opened:
        opened.sees("help shows what to say", "kitchen>").types(f"show egg{ENTER}")
        opened.sees("fridge", "kitchen>").types("\x04")
        assert opened.ends() == 0


def test_without_a_terminal_it_is_the_help(home: Home) -> None:
    ended = home.adaptbot()
    assert ended.code == 2 and "Usage: " in ended.said


def test_a_task_without_run_is_told_how_to_say_it(home: Home) -> None:
    ended = home.adaptbot("make", "omelette")
    assert ended.code == 2 and 'adaptbot run "make omelette"' in ended.said
    assert "did you mean adaptbot doctor?" in home.adaptbot("docter").said
