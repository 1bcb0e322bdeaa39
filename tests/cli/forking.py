"""Commands as processes that are forked from one which has already imported what they need.

Importing takes most of a command's time. Each command is still a process of its own: with its
own environment, folder, streams or terminal, exit code and signals. What depends on how Python
starts (its encodings, its hash seed) needs a Python of its own: see `Home.python`.
"""

import fcntl
import gc
import io
import json
import os
import pkgutil
import random
import select
import signal
import socket
import subprocess
import sys
import tempfile
import termios
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

IMPORTED = (
    "adaptbot_cli.cli.main",
    "litellm",
    "litellm.integrations.generic_api",
    "litellm.proxy._types",
    "h2.connection",
    "httpcore",
    "nltk.corpus.reader.wordnet",
    "pytest",
    "prompt_toolkit.shortcuts",
    "rich.live",
)
DASK = ("distributed.cli.dask_scheduler", "distributed.cli.dask_worker")
"""The parts of a cluster, where Dask is installed."""
NOT_IMPORTED = ("adaptbot_cli.__main__", "adaptbot_cli.adapters.planner.local_server")


ADAPTBOT = "adaptbot_cli.cli.main:main"
"""What a forked process calls unless it is told something else: a module, and a function of it."""


@dataclass
class Process:
    """A command that runs; `pid` is its process."""

    pid: int
    _connection: socket.socket
    _code: int | None = None

    def wait(self, seconds: float = 120) -> int:
        """Wait for its end; return its exit code, or the negated signal that ended it."""
        if self._code is None:
            self._connection.settimeout(seconds)
            with self._connection:
                self._code = os.waitstatus_to_exitcode(int(self._connection.recv(64)))
        return self._code

    @property
    def runs(self) -> bool:
        """Whether it has not ended yet."""
        if self._code is None and select.select([self._connection], [], [], 0)[0]:
            self.wait()
        return self._code is None

    def kill(self, how: int = signal.SIGKILL) -> None:
        """Send it a signal, if it still runs; of SIGKILL, see the end."""
        if self._code is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, how)
            if how == signal.SIGKILL:
                self.wait()


def start(
    arguments: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    streams: tuple[int, int, int],
    terminal: bool = False,
    entry: str = ADAPTBOT,
) -> Process:
    """Start a command on three open files; with `terminal` the first is one, which it gets."""
    connection = socket.socket(socket.AF_UNIX)
    connection.connect(_server())
    request = [entry, list(arguments), str(folder), dict(environment), terminal]
    socket.send_fds(connection, [json.dumps(request).encode()], list(streams))
    connection.shutdown(socket.SHUT_WR)
    return Process(int(connection.recv(64)), connection)


@cache
def _server() -> str:
    """Start the process that the others are forked from; it ends when this one does."""
    address = str(Path(tempfile.mkdtemp()) / "commands")
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.cli.forking", address],
        cwd=Path(__file__).parents[2],
        env={"PATH": os.environ["PATH"], "PYTHONPATH": os.pathsep.join(sys.path),
             "LITELLM_LOCAL_MODEL_COST_MAP": "True", "LITELLM_MODE": "PRODUCTION"},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    _kept.append(process)
    return address


_kept: list[Any] = []
"""The server: it reads from this process, and ends when there is nothing more to read."""


def _serve(address: str) -> None:
    for name in (*IMPORTED, *(DASK if find_spec("distributed") else ())):
        import_module(name)
    _warm_up()
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(address)
        listening.listen(64)
        print("ready", flush=True)
        _until_the_tests_end(os.getpid())
        while True:
            connection, _ = listening.accept()
            if os.fork() == 0:
                listening.close()
                _handle(connection)
            connection.close()


def _warm_up() -> None:
    """Do once what each command would do again: import, open files that are large, read packs."""
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.planner.tokens import of_text
    from adaptbot_cli.session import sources
    from adaptbot_cli.workspace import Workspace

    package = import_module("adaptbot_cli").__path__
    for module in pkgutil.walk_packages(package, "adaptbot_cli."):
        if not module.name.startswith(NOT_IMPORTED):
            import_module(module.name)
    of_text("openai/planner", "pan")
    WordNet().senses("pan")
    WordNet().related("pan", frozenset({"noun.artifact"}))
    for domain in ("kitchen", "household"):
        sources.load(Workspace(Path("nowhere")), domain)
    gc.collect()
    gc.freeze()  # what is here is shared with every command, and never garbage


def _until_the_tests_end(server: int) -> None:
    """Watch, in a process of its own, for the end of the tests, which closes the server's stdin."""
    if os.fork() == 0:
        while os.read(0, 1024):
            pass
        os.kill(server, signal.SIGTERM)
        os._exit(0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)


def _handle(connection: socket.socket) -> None:
    """Run one command and tell how it ended."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    request, streams, _, _ = socket.recv_fds(connection, 1 << 16, 3)
    while more := connection.recv(1 << 16):
        request += more
    entry, arguments, folder, environment, terminal = json.loads(request)
    pid = os.fork()
    if pid == 0:
        connection.close()
        _become(streams, folder, environment, terminal)
        _ended(lambda: _main(entry, arguments))
    for stream in streams:
        os.close(stream)
    connection.send(str(pid).encode())
    _, status = os.waitpid(pid, 0)
    try:
        connection.send(str(status).encode())
    finally:
        os._exit(0)


def _become(
    streams: Sequence[int], folder: str, environment: Mapping[str, str], terminal: bool
) -> None:
    """Make this process what a newly started one would be."""
    if terminal:
        os.setsid()
        fcntl.ioctl(streams[0], termios.TIOCSCTTY, 0)
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    time.tzset()
    random.seed()
    if "dask.config" in sys.modules:
        sys.modules["dask.config"].refresh()  # it reads the environment when it is imported
    sys.stdin = io.TextIOWrapper(io.BufferedReader(io.FileIO(0, "r", closefd=False)), "utf-8")
    out, err = (io.FileIO(number, "w", closefd=False) for number in (1, 2))
    sys.stdout = io.TextIOWrapper(io.BufferedWriter(out), "utf-8", line_buffering=terminal)
    sys.stderr = io.TextIOWrapper(io.BufferedWriter(err), "utf-8", "replace", line_buffering=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)


def _main(entry: str, arguments: Sequence[str]) -> None:
    module, _, function = entry.partition(":")
    sys.argv = ["adaptbot", *arguments]
    getattr(import_module(module), function)()


def _ended(work: Callable[[], None]) -> None:
    """End this process as Python ends one that has done some work."""
    code = 0
    try:
        work()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        code = 1
        traceback.print_exc()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:
        code = 120  # as Python does
    os._exit(code)


if __name__ == "__main__":
    _serve(sys.argv[1])
