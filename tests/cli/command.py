"""Runs the real command as its users do: a process of its own, a home of its own, no keys."""

import io
import json
import os
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import yaml

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.cli.main import main
from tests.cli import forking

ROOT = Path(__file__).parents[2]
TRANSCRIPTS = ROOT / "transcripts"

MOVED = (
    "DELETE {{ ex:{0} ex:obj_location ?x }} INSERT {{ ex:{0} ex:obj_location ex:{1} }}"
    " WHERE {{ ex:{0} ex:obj_location ?x }}"
)
NEW = "INSERT DATA {{ ex:{0} a ex:object ; ex:obj_name '{0}' ; ex:obj_location ex:fridge }}"
SECOND = (
    "INSERT DATA { ex:robot2 a ex:agent ; ex:has_hand ex:robot2_arm . "
    "ex:robot2_arm a ex:hand ; ex:rec_name 'robot2_arm' }"
)
"""Updates of the kitchen: a thing is moved, a thing is there, a second robot comes in."""


def many() -> None:
    """Run the commands that stdin lists, in this process; write how each of them ended."""
    ended = []
    for arguments in json.load(sys.stdin):
        sys.argv = ["adaptbot", *arguments]
        out, err, code = io.StringIO(), io.StringIO(), 0
        with redirect_stdout(out), redirect_stderr(err):
            try:
                main()
            except SystemExit as end:
                code = end.code or 0  # type: ignore[assignment]
            except BaseException:
                code = 1
                traceback.print_exc()
        ended.append([code, out.getvalue(), err.getvalue()])
    json.dump(ended, sys.stdout)


@dataclass(frozen=True, slots=True)
class Ended:
    """A command that has ended."""

    code: int
    out: str
    err: str

    @property
    def said(self) -> str:
        """Everything it said, in one line however it was wrapped."""
        return " ".join((self.out + self.err).split())

    def json(self) -> Any:
        """What stdout holds: one JSON value and nothing else."""
        return json.loads(self.out)


@dataclass(frozen=True, slots=True)
class Begun:
    """A command that runs, with what it writes."""

    process: forking.Process
    out: IO[bytes]
    err: IO[bytes]

    def ends(self) -> Ended:
        """Wait for its end."""
        code = self.process.wait()
        return Ended(code, *(file.seek(0) or file.read().decode() for file in (self.out, self.err)))


@dataclass(frozen=True, slots=True)
class Home:
    """A user's home folder. Its workspace begins to exist when a command makes it."""

    folder: Path

    @property
    def workspace(self) -> Path:
        return self.folder / "robot"

    def environment(self, **more: str) -> dict[str, str]:
        """Return an environment without keys, in which nothing of this machine's user counts."""
        kept = {key: os.environ[key] for key in ("PATH", "SYSTEMROOT") if key in os.environ}
        return {
            **kept,
            "HOME": str(self.folder),
            "XDG_CACHE_HOME": f"{self.folder}.cache",
            "ADAPTBOT_WORKSPACE": str(self.workspace),
            "ADAPTBOT_MODEL": "library",
            "PYTHONPATH": str(ROOT),
            "PYTHONIOENCODING": "utf-8",
            **more,
        }

    def adaptbot(self, *arguments: str, stdin: bytes = b"", **env: str) -> Ended:
        """Run one command."""
        if any(key.startswith(("PYTHON", "LANG", "LC_")) for key in env):
            return self.python("-m", "adaptbot_cli", *arguments, stdin=stdin, **env)
        with self.begun(*arguments, stdin=stdin, **env) as begun:
            return begun.ends()

    def adaptbots(self, commands: Sequence[Sequence[str]], **env: str) -> list[Ended]:
        """Run many commands in one process, for those that only read what they are told."""
        asked = json.dumps(commands).encode()
        with self.begun(stdin=asked, entry="tests.cli.command:many", **env) as begun:
            ended = begun.ends()
        assert ended.code == 0, ended.err
        return [Ended(*told) for told in ended.json()]

    @contextmanager
    def begun(
        self, *arguments: str, stdin: bytes = b"", entry: str = forking.ADAPTBOT, **env: str
    ) -> Iterator["Begun"]:
        """Begin a command that is gone afterwards, however the test went."""
        with ExitStack() as stack:
            given, out, err = (stack.enter_context(tempfile.TemporaryFile()) for _ in range(3))
            given.write(stdin)
            given.seek(0)
            streams = (given.fileno(), out.fileno(), err.fileno())
            process = forking.start(
                arguments, self.folder, self.environment(**env), streams, entry=entry
            )
            stack.callback(process.kill)
            yield Begun(process, out, err)

    def python(self, *arguments: str, stdin: bytes = b"", **env: str) -> Ended:
        """Run Python in this home."""
        process = subprocess.run(
            [sys.executable, *arguments],
            input=stdin,
            capture_output=True,
            cwd=self.folder,
            env=self.environment(**env),
            timeout=120,
            check=False,
        )
        return Ended(process.returncode, process.stdout.decode(), process.stderr.decode())

    def write(self, name: str, text: str) -> str:
        """Write a file into the home; return its path."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return str(path)

    def files(self) -> set[str]:
        """Return every file and folder there is."""
        return {path.relative_to(self.folder).as_posix() for path in self.folder.rglob("*")}

    @property
    def transcript(self) -> Path:
        """The transcript of the newest run."""
        return max((self.workspace / "transcripts").glob("*.yaml"))

    def documents(self) -> list[Any]:
        """Return the header and the turns of the newest run."""
        return list(yaml.safe_load_all(self.transcript.read_text(encoding="utf-8")))

    def replays(self) -> bool:
        """Tell whether every run can be played again."""
        runs = sorted(map(str, (self.workspace / "transcripts").glob("*.yaml")))
        return self.adaptbot("replay", *runs).code == 0

    def subjects(self) -> list[str]:
        """Return the subjects of the workspace's commits, oldest first."""
        return [commit.subject for commit in Repo.open_or_init(self.workspace).log()][::-1]

    def trailers(self) -> Mapping[str, list[str]]:
        """Return the trailers of the last commit."""
        found: dict[str, list[str]] = {}
        for key, value in next(iter(Repo.open_or_init(self.workspace).log())).trailers:
            found.setdefault(key, []).append(value)
        return found


def mapped(told: Any, *keys: str) -> list[tuple[Any, ...]]:
    """Return some keys of every object in a list."""
    return [tuple(entry[key] for key in keys) for entry in told]
