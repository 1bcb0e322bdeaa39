"""The tutorial's commands, run in their order, say what the tutorial shows."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

from tests.cli.command import Home

TUTORIAL = Path(__file__).parents[2] / "docs" / "tutorial.md"
BLOCK = re.compile(r"^```(sh|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
COMMAND = f'adaptbot() {{ {shlex.quote(sys.executable)} -m adaptbot_cli "$@"; }}\n'


def blocks() -> list[tuple[str, str]]:
    """The commands of the tutorial, each with what it shows of what they say."""
    found: list[tuple[str, str]] = []
    for kind, text in BLOCK.findall(TUTORIAL.read_text(encoding="utf-8")):
        if kind == "sh":
            found.append((text, ""))
        else:
            found[-1] = (found[-1][0], text)
    return found


def squeezed(text: str) -> str:
    return " ".join(text.split())


def test_its_commands_do_what_it_shows(home: Home) -> None:
    found = blocks()
    assert len(found) >= 10 and sum(bool(shown) for _, shown in found) >= 7
    who = {"GIT_AUTHOR_NAME": "newcomer", "GIT_AUTHOR_EMAIL": "newcomer@localhost"}
    who |= {key.replace("AUTHOR", "COMMITTER"): value for key, value in who.items()}
    env = home.environment(COLUMNS="80", **who)
    del env["ADAPTBOT_WORKSPACE"]  # the folder says which it is
    folder = home.folder
    for commands, shown in found:
        script = f"{COMMAND}set -e\n{commands}\npwd > {shlex.quote(str(home.folder / 'where'))}\n"
        ended = subprocess.run(
            ["bash", "-c", script],
            cwd=folder,
            env={**env, "PATH": os.environ["PATH"]},
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        said = ended.stdout + ended.stderr
        assert ended.returncode == 0, f"{commands}\n{said}"
        folder = Path((home.folder / "where").read_text(encoding="utf-8").strip())
        for line in shown.splitlines():
            assert squeezed(line) in squeezed(said), f"{line}\n{said}"
    assert (folder / "basil.svg").read_text(encoding="utf-8").startswith("<svg")
    assert "# greenhouse" in (folder / "greenhouse.md").read_text(encoding="utf-8")
