"""What goes wrong is said in a sentence, with its exit code, and never as a traceback."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.command import TRANSCRIPTS, Ended, Home

TASKS = (
    "[red]boom[/red]",
    "\x1b[31mred\x1b[0m \x1b]0;title\x07",
    "x" * 300,
    "\U0001f373 \u202egge",
    "../../etc/passwd",
    "egg> . <x> <y",
    'egg" . } DROP ALL ; #',
    "\udcff\udcfe",
)
SETTINGS = {
    "no toml": ("domain = \n", "no valid TOML"),
    "no text": ("\ud8ff", "no valid TOML"),
    "replans in words": ('replans = "many"\n', "replans must be"),
    "replans below zero": ("replans = -1\n", "replans must be"),
    "replans as yes": ("replans = true\n", "replans must be"),
    "no such policy": ('policy = "fancy"\n', "policy must be"),
    "a list of domains": ('domain = ["kitchen"]\n', "domain must be"),
    "a number for a model": ("model = 3\n", "model must be"),
    "no address": ('api_base = "here"\nmodel = "openai/x"\n', "the API base must be an address"),
    "a slip": ("max_tokns = 5\n", "there is no setting 'max_tokns'; did you mean max_tokens?"),
    "no such setting": ("xyzzy = 5\n", "there are model, api_base"),
    "no tokens": ("max_tokens = 0\n", "max_tokens must be"),
    "no time": ("timeout = 0\n", "timeout must be"),
    "a cost below zero": ("max_cost = -1\n", "max_cost must be"),
    "too hot": ("temperature = 3\n", "temperature must be"),
    "a seed that is no whole number": ("seed = 1.5\n", "seed must be"),
}
BROKEN = {
    "syntax": ("state.ttl", r"\Z", "ex:egg ex:place\n", r"state\.ttl, line \d+.*Turtle"),
    "bytes": ("attributes.ttl", r"\A", "\x00\x01", r"attributes\.ttl, line 1.*Turtle"),
    "no update": ("actions.ttl", r"DELETE {", "DESTROY {", r"actions\.ttl, entry \w+: .*DELETE"),
    "no question": ("actions.ttl", r'ab:ask "ASK', 'ab:ask "TELL', r"actions\.ttl, entry \w+: "),
    "no goal": ("tasks.ttl", r'ab:ask "ASK', 'ab:ask "TELL', r"tasks\.ttl, entry \w+: "),
    "no class": ("domain.ttl", r"ab:Domain", "ab:Domian", r"domain\.ttl: .*ab:Domain"),
}
LEFT_OUT = ("actions.ttl", "domain.ttl", "state.ttl")


@pytest.fixture(scope="module")
def untouched(used: Home) -> Iterator[Home]:
    """Return a home whose user has made a workspace that no command may change."""
    used.write("plan", 'pick_up_obj("egg")\n')
    used.write("bad.yaml", "- just\n- a list\n")
    before = used.files()
    yield used
    assert used.files() == before


def commands(home: Home) -> dict[str, tuple[int, str, list[str]]]:
    """Return commands that cannot be meant: code, what is said, arguments."""
    record = str(home.folder / "plan" / "x.yaml")
    return {
        "no command": (2, "Usage", []),
        "unknown command": (2, "fry", ["fry"]),
        "unknown option": (2, "--fast", ["run", "make tea", "--fast"]),
        "no task": (2, "task", ["run"]),
        "empty task": (2, "make omelette", ["run", " "]),
        "a slip in a task": (3, "omlete (omelette?)", ["run", "make omlete", "--dry-run"]),
        "a task of another domain": (
            5,
            "adaptbot run 'mop it' --domain household",
            ["run", "mop it", "--dry-run"],
        ),
        "a task of no domain": (
            5,
            "adaptbot run sing --domain household",
            ["run", "sing", "--dry-run"],
        ),
        "too few replans": (2, "--replans", ["run", "make tea", "--replans", "-1"]),
        "replans in words": (2, "--replans", ["run", "make tea", "--replans", "two"]),
        "unknown policy": (2, "tutor", ["run", "make tea", "--policy", "fancy"]),
        "unknown domain": (2, "kitchen", ["run", "make tea", "--domain", "moon"]),
        "a path for a domain": (2, "there is no domain", ["kg", "show", "--domain", "../kitchen"]),
        "no plan": (2, "none.plan", ["check", "none.plan"]),
        "a folder for a plan": (2, "directory", ["check", str(TRANSCRIPTS)]),
        "no graph": (4, "none.ttl", ["check", "plan", "--kg", "none.ttl"]),
        "a graph that is none": (4, "plan, line 1", ["check", "plan", "--kg", "plan"]),
        "no answers": (4, "none.yaml", ["run", "make tea", "--answers", "none.yaml"]),
        "answers of another form": (2, "chives", ["run", "make tea", "--answers", "bad.yaml"]),
        "no place for a transcript": (
            4,
            "transcript",
            ["run", "make tea", "--dry-run", "--record", record],
        ),
        "no transcript": (2, "FILE", ["replay"]),
        "unknown domain to check": (2, "there is no domain", ["domain", "check", "moon"]),
    }


@pytest.fixture(scope="module")
def refused(untouched: Home) -> dict[str, Ended]:
    """Run all of them in one process."""
    told = untouched.adaptbots([arguments for _, _, arguments in commands(untouched).values()])
    return dict(zip(commands(untouched), told, strict=True))


@pytest.mark.parametrize("name", commands(Home(Path())))
def test_what_cannot_be_meant_is_refused(
    refused: dict[str, Ended], untouched: Home, name: str
) -> None:
    code, told, _ = commands(untouched)[name]
    ended = refused[name]
    assert (ended.code, "Traceback" in ended.said) == (code, False), ended.said
    assert told in ended.said


def test_hostile_tasks_are_words_like_any_other(home: Home) -> None:
    for ended in home.adaptbots([["run", task, "--dry-run"] for task in TASKS]):
        assert ended.code == 5, ended.err
        assert "Traceback" not in ended.err and "--model" in ended.said
        assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", ended.out + ended.err)
    assert home.files() == set()


def test_a_hostile_task_stays_in_its_workspace(home: Home) -> None:
    ended = home.adaptbot("run", "../../../toast> . <x>", "--requires", '../x,"; DROP ALL')
    assert ended.code == 3 and "Traceback" not in ended.err
    assert {name.split("/")[0] for name in home.files()} == {"robot"}
    assert home.replays()


def test_settings_that_cannot_be_meant(home: Home) -> None:
    folders = {name: home.folder / name for name in SETTINGS}
    for name, folder in folders.items():
        folder.mkdir()
        text = SETTINGS[name][0].encode("utf-8", "surrogatepass")
        (folder / "adaptbot.toml").write_bytes(text)
    run = ["run", "make tea", "--workspace"]
    told = home.adaptbots([[*run, str(folder)] for folder in folders.values()])
    for (name, folder), ended in zip(folders.items(), told, strict=True):
        assert ended.code == 4, ended.err
        assert SETTINGS[name][1] in ended.said
        assert str(Path(name, "adaptbot.toml")) in ended.err.replace("\n", "")
        assert [path.name for path in folder.iterdir()] == ["adaptbot.toml"]


def test_broken_knowledge_names_file_and_place(seeded: Home, home: Home) -> None:
    wanted: list[str] = []
    broken: list[list[str]] = []
    for name, (file, pattern, replacement, told) in BROKEN.items():
        folder = home.folder / name.replace(" ", "_")
        shutil.copytree(seeded.workspace, folder)
        path = folder / "kg" / "kitchen" / file
        text = path.read_text(encoding="utf-8")
        path.write_text(re.sub(pattern, replacement, text, count=1), encoding="utf-8")
        broken.append(["run", "make tea", "--workspace", str(folder)])
        wanted.append(told)
    for told, ended in zip(wanted, home.adaptbots(broken), strict=True):
        assert ended.code == 4, ended.said
        assert re.search(told, ended.said), ended.said
        assert "Traceback" not in ended.said


def test_a_workspace_that_lacks_a_file_is_not_filled_up(seeded: Home, home: Home) -> None:
    for file in LEFT_OUT:
        folder = home.folder / file.replace(".", "_")
        shutil.copytree(seeded.workspace, folder)
        (folder / "kg" / "kitchen" / file).unlink()
    folders = [home.folder / file.replace(".", "_") for file in LEFT_OUT]
    before = home.files()
    told = home.adaptbots([["run", "make tea", "--workspace", str(f)] for f in folders])
    for file, ended in zip(LEFT_OUT, told, strict=True):
        assert ended.code == 4 and f"lacks {file}" in ended.said
    assert home.files() == before


def test_a_file_where_the_workspace_should_be(home: Home) -> None:
    home.write("robot", "not a folder")
    ended = home.adaptbot("run", "make tea")
    assert (ended.code, ended.out) == (4, "")
    assert ended.err.startswith("error: ") and str(home.workspace) in ended.err.replace("\n", "")
    assert home.files() == {"robot"}


def as_a_user_without_rights() -> list[str]:
    """Return what makes a command keep to the rights of files, which root does not."""
    if not hasattr(os, "geteuid"):
        pytest.skip("rights of files are another matter here")
    if os.geteuid() != 0:
        return []
    without = ["setpriv", "--bounding-set=-dac_override,-dac_read_search", "--"]
    if shutil.which("setpriv") is None or subprocess.run([*without, "true"]).returncode != 0:
        pytest.skip("root may write anywhere, and setpriv cannot take that right away here")
    return without


@pytest.mark.parametrize("begun", [False, True], ids=["new", "with knowledge"])
def test_a_workspace_without_the_right_to_write(seeded: Home, home: Home, begun: bool) -> None:
    without = as_a_user_without_rights()
    if begun:
        shutil.copytree(seeded.workspace, home.workspace)
    else:
        home.workspace.mkdir()
    before = home.files()
    folders = [home.workspace, *(path for path in home.workspace.rglob("*") if path.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    answers = home.write("a.yaml", "chives: {existence: absent}\n")
    try:
        ended = subprocess.run(
            [
                *without,
                sys.executable,
                "-m",
                "adaptbot_cli",
                "run",
                "omelette",
                "--answers",
                answers,
            ],
            env=home.environment(),
            cwd=home.folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
    finally:
        for folder in folders:
            folder.chmod(0o755)
    assert ended.returncode == 4, ended.stderr
    assert "permission" in ended.stderr.lower() and "Traceback" not in ended.stderr
    assert home.files() - before == {"a.yaml"}


def test_answers_that_cannot_be_meant_change_nothing(seeded: Home, home: Home) -> None:
    shutil.copytree(seeded.workspace, home.workspace)
    subjects = home.subjects()
    home.write("odd.yaml", "chives: {existence: perhaps}\n")
    home.write("half.yaml", "chives: {existence: yes}\n")
    odd = home.adaptbot("run", "make omelette", "--answers", "odd.yaml")
    half = home.adaptbot("run", "make omelette", "--answers", "half.yaml")
    assert (odd.code, half.code) == (2, 2)
    assert '"perhaps" is no answer for existence; there is absent, exists, later' in odd.said
    assert "half.yaml: chives: exists, but its kind is not told; it can be " in half.said
    assert home.subjects() == subjects


def test_debug_shows_the_traceback_wherever_it_stands(home: Home) -> None:
    before, after, without = home.adaptbots(
        [
            ["--debug", "run", "make tea", "--domain", "moon"],
            ["run", "make tea", "--domain", "moon", "--debug"],
            ["run", "make tea", "--domain", "moon"],
        ]
    )
    for ended in (before, after):
        assert "Traceback" in ended.err and "UsageError" in ended.err
    assert "Traceback" not in without.err


@pytest.mark.skipif(not shutil.which("sh"), reason="needs a shell")
@pytest.mark.parametrize(
    "command",
    [
        "adaptbot kg show | head -1; adaptbot kg show --json | head -1",
        'adaptbot run "make tea" --dry-run | head -1',
        "adaptbot check - --json <&-; adaptbot kg show egg >&-",
        'adaptbot run "make tea" --dry-run --json <&- >&-; echo "$?"',
    ],
)
def test_pipes_that_end_early_and_streams_that_are_closed(home: Home, command: str) -> None:
    script = f'adaptbot() {{ "{sys.executable}" -m adaptbot_cli "$@"; }}\n{command}'
    ended = subprocess.run(
        ["sh", "-c", script],
        env=home.environment(),
        cwd=home.folder,
        text=True,
        capture_output=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    assert "Traceback" not in ended.stderr and "Exception ignored" not in ended.stderr
    assert home.files() == set()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_cannot_be_written(home: Home) -> None:
    with Path("/dev/full").open("wb") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "adaptbot_cli", "kg", "show", "--json"],
            env=home.environment(),
            cwd=home.folder,
            text=True,
            stdout=full,
            stderr=subprocess.PIPE,
            check=False,
        )
    assert ended.returncode == 1
    assert "No space left" in ended.stderr and len(ended.stderr.splitlines()) == 1


def test_a_console_that_has_not_every_letter(home: Home) -> None:
    shown = home.adaptbot("run", "make tea", "--dry-run", PYTHONIOENCODING="ascii")
    assert shown.code == 0 and "executable, goal met" in shown.said
    told = home.adaptbot("check", "-", "--json", PYTHONIOENCODING="ascii", stdin=b'cut("\xc3\xb6")')
    assert told.code == 3 and told.out.isascii()
    assert told.json()["steps"][0]["call"] == ["cut", "ö"]
