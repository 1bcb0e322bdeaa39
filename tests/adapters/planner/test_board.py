"""The model on board, at work: skipped where the extra `local` is not installed."""

import contextlib
import os
import signal
import sys
import time
from pathlib import Path

import pexpect
import pytest

from adaptbot_cli.adapters.planner.local import found
from adaptbot_cli.adapters.planner.local.engine import Engine
from adaptbot_cli.adapters.planner.local.prompts import for_model
from adaptbot_cli.adapters.planner.model import Model
from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.adapters.store.reading import load_kg, read_files
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.errors import ModelError
from adaptbot_cli.resources import bundled
from tests.asking import task_for

FORM = r"""root ::= call ("\n" call){0,3}
call ::= "clean(" name ")"
name ::= "\"pan\"" | "\"pot\""
"""
WHOLE = found.installed()
board = pytest.mark.skipif(WHOLE is None, reason="the extra `local` is not installed")
runs = pytest.mark.skipif(not found.runs(), reason="llama-cpp-python is not installed")


def request(text: str, tokens: int = 60) -> dict[str, object]:
    messages = [{"role": "user", "content": text}]
    return {"messages": messages, "grammar": FORM, "temperature": 0.0, "tokens": tokens, "room": 64}


@board
def test_every_line_is_a_call_and_the_same_each_time() -> None:
    assert WHOLE is not None
    plans = []
    engine = Engine(WHOLE, 512)
    try:
        for _ in range(2):
            answers = list(engine.stream(request("Clean the pan and the pot."), 300.0))
            plans.append("".join(answer.get("text", "") for answer in answers))
            assert answers[-1]["prompt"] > 5 and answers[-1]["completion"] > 3
    finally:
        engine.close()
    assert plans[0] == plans[1]
    assert set(plans[0].splitlines()[:-1]) <= {'clean("pan")', 'clean("pot")'}


@board
def test_one_worker_plans_for_a_whole_run_and_what_it_takes_is_counted() -> None:
    kg = load_kg(read_files(bundled("kg") / "household"), "household")
    model = Model(*for_model("local", Prompts(bundled("prompts"), kg)))
    assert model.name.startswith("local/SmolLM2")
    turn = Propose(task_for("clean the table", kg))
    first, workers = model.propose(turn), set(processes(os.getsid(0)))
    again = model.propose(turn)
    assert first == again and set(processes(os.getsid(0))) == workers
    parsed = parse(first.text)
    assert parsed.calls and not parsed.findings
    assert first.calls == 1 and first.prompt_tokens > 100 and first.completion_tokens > 5
    assert first.cost_usd == 0.0


def processes(session: int) -> list[int]:
    """The workers of a session."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            command = (folder / "cmdline").read_bytes()
            if b"local.worker" in command and os.getsid(int(folder.name)) == session:
                found.append(int(folder.name))
    return found


@board
def test_a_prompt_that_is_too_long_is_told_with_its_length() -> None:
    assert WHOLE is not None
    with pytest.raises(ModelError, match=r"too long for the model on board: \d+ tokens"):
        list(Engine(WHOLE, 256).stream(request("pan " * 400), 300.0))


@runs
def test_a_damaged_file_is_told(tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.gguf"
    damaged.write_bytes(b"GGUF" + bytes(100))
    with pytest.raises(ModelError, match=r"damaged\.gguf cannot be loaded"):
        list(Engine(damaged).stream(request("x"), 300.0))


@board
def test_a_worker_that_is_killed_is_told() -> None:
    assert WHOLE is not None
    engine = Engine(WHOLE, 512)
    answers = engine.stream(request("Clean the pan."), 300.0)
    next(answers)
    assert engine.pid is not None
    os.kill(engine.pid, signal.SIGKILL)
    with pytest.raises(ModelError, match="stopped by itself: SIGKILL"):
        list(answers)


@board
def test_ctrl_c_stops_it_at_once(tmp_path: Path) -> None:
    env = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "TERM": "xterm"}
    arguments = ["-m", "adaptbot_cli", "run", "make tomato soup", "--model", "local", "--dry-run"]
    terminal = pexpect.spawn(sys.executable, arguments, env=env, timeout=60, encoding="utf-8")
    terminal.expect("local/SmolLM2")
    while not processes(terminal.pid):
        time.sleep(0.1)
    time.sleep(2)
    terminal.sendintr()
    terminal.expect(pexpect.EOF)
    terminal.close()
    assert terminal.exitstatus == 130
    assert not processes(terminal.pid)
