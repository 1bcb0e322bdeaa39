"""The model on board as this process sees it: a worker that is started, asked and stopped."""

import json
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Iterator, Mapping
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any

from adaptbot_cli.errors import ModelError

CONTEXT = 4096
"""How many tokens prompt and plan may have together; SmolLM2 takes 8192."""

_OVERHEAD = 300 << 20
"""Bytes that a small model needs beside its file, for its context and its libraries."""

_WORKER = "adaptbot_cli.adapters.planner.local.worker"
_OTHERWISE = "`--model library` plans without a model."


class Engine:
    """One GGUF model in a process of its own, which is started when it is first asked."""

    def __init__(self, file: Path, context: int = CONTEXT) -> None:
        self.file = file
        self.context = context
        self._process: subprocess.Popen[str] | None = None
        self._answers: Queue[str | None] = Queue()

    @property
    def pid(self) -> int | None:
        """The worker's process, None while there is none."""
        return self._process.pid if self._process else None

    def stream(self, request: Mapping[str, Any], seconds: float) -> Iterator[dict[str, Any]]:
        """Yield the worker's answers to a request; the last one has `finished`.

        Whoever stops reading early, by Ctrl-C too, stops the worker at once.

        Raises:
            ModelError: too little memory, no model in the file, a prompt that is too long, a
                worker that died, or one that has not finished after `seconds`.
        """
        until = time.monotonic() + seconds
        try:
            if self._process is None:
                self._start(until)
            self._send(request)
            while True:
                answer = self._receive(until)
                yield answer
                if "finished" in answer:
                    return
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop the worker, whatever it does."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.communicate()

    def _start(self, until: float) -> None:
        _check_memory(self.file)
        self._answers = Queue()
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", _WORKER, str(self.file), str(self.context)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            encoding="utf-8",
        )
        # Ctrl-C is heard in another thread: the worker ends with the engine, or with the program.
        weakref.finalize(self, self._process.kill)
        Thread(target=_read, args=(self._process, self._answers), daemon=True).start()
        self._receive(until)

    def _send(self, request: Mapping[str, Any]) -> None:
        assert self._process is not None and self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise self._dead() from None

    def _receive(self, until: float) -> dict[str, Any]:
        try:
            line = self._answers.get(timeout=max(0.0, until - time.monotonic()))
        except Empty:
            raise ModelError(
                f"The model on board, {self.file.name}, has not finished its plan in time. "
                f"{_OTHERWISE}"
            ) from None
        if line is None:
            raise self._dead()
        answer: dict[str, Any] = json.loads(line)
        if "failed" in answer:
            raise ModelError(self._failure(answer))
        return answer

    def _failure(self, answer: Mapping[str, Any]) -> str:
        if answer["failed"] == "context":
            return (
                f"The prompt is too long for the model on board: {answer['prompt']} tokens, and "
                f"{self.file.name} takes {answer['context']} with its plan. {_OTHERWISE}"
            )
        return (
            f"{self.file} cannot be loaded: the file is damaged, its kind of model is not known to "
            f"this llama-cpp-python, or there is too little memory. {_OTHERWISE}"
        )

    def _dead(self) -> ModelError:
        assert self._process is not None
        code = self._process.wait()
        return ModelError(
            f"The model on board, {self.file.name}, stopped by itself: {_cause(code)}. {_OTHERWISE}"
        )


def _read(process: "subprocess.Popen[str]", answers: "Queue[str | None]") -> None:
    """Hand each line on, and None at the end."""
    assert process.stdout is not None
    try:
        for line in process.stdout:
            answers.put(line)
    except ValueError:  # closed while reading
        pass
    answers.put(None)


def _cause(code: int) -> str:
    if -code == signal.SIGILL:
        return (
            "llama-cpp-python was built for another processor; build it again with "
            "CMAKE_ARGS=-DGGML_NATIVE=OFF pip install --force-reinstall --no-cache-dir "
            "--no-binary llama-cpp-python llama-cpp-python"
        )
    if code < 0:
        return f"{signal.Signals(-code).name}, most likely for lack of memory"
    return f"its process ended with code {code}"


def _check_memory(file: Path) -> None:
    """Refuse a model that this machine would only read again and again from its disk."""
    needed = file.stat().st_size + _OVERHEAD
    free = _available()
    if free is not None and needed > free:
        raise ModelError(
            f"There is too little memory for {file.name}: it needs {needed >> 20} MB, and "
            f"{free >> 20} MB are free. {_OTHERWISE}"
        )


def _available() -> int | None:
    """Bytes of memory that are free, None where the system does not tell it as Linux does."""
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    told = next((line.split()[1] for line in lines if line.startswith("MemAvailable:")), None)
    return int(told) * 1024 if told else None
