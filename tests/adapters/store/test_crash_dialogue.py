"""A run killed at any moment of its dialogue keeps every answer that it has taken."""

import io
import os
import random
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from rich.console import Console

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.core.ask.questions import Answer
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.turns import Ask, Turn
from adaptbot_cli.session.build import Request, build
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import begun, item, keeper
from tests.adapters.store.kills import SEED

PATHS = ["kg/kitchen/attributes.ttl", "kg/kitchen/state.ttl"]
pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs fork and SIGKILL")
STONES = ["moonstone", "sunstone", "bloodstone", "rhinestone"]
ANSWERS = "".join(
    f"{stone}: {{existence: exists, kind: object, obj_location: fridge}}\n" for stone in STONES
)


class Teller:
    """An observer after the recorder: it tells each answer that the run has taken."""

    def __init__(self, pipe: int) -> None:
        self.pipe = pipe

    def asked(self, turn: Turn) -> None:
        """Nothing is taken before the reply."""

    def replied(self, turn: Turn, reply: object) -> None:
        if isinstance(turn, Ask) and isinstance(reply, Answer) and reply.value:
            told = [turn.question.about, turn.question.prop or turn.question.kind, reply.value]
            os.write(self.pipe, ("\t".join(told) + "\n").encode())


def run(root: Path, answers: Path, record: Path, pipe: int) -> float:
    """Make a dish of stones that nobody knows, answering from a file; return how long it took."""
    stones = tuple(STONES)
    request = Request("make tea", "kitchen", "library", requires=stones, answers=answers)
    request = replace(request, record=record)
    console = Console(file=io.StringIO(), width=100)
    with build(request, Workspace(root), {}, console, None) as session:
        session.ports.observers.append(Teller(pipe))  # type: ignore[attr-defined]
        os.write(pipe, b"begun\n")
        started = time.perf_counter()
        session.run()
        os.write(pipe, b"done\n")
        return time.perf_counter() - started


def killed(after: int, seconds: float, *arguments: Any) -> list[str]:
    """Kill a run some time after so many answers; return what it told of them.

    Answers are counted, not seconds from its begin: so kills come everywhere in a dialogue,
    however slow this machine is just now.
    """
    listen, tell = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            run(*arguments, tell)
        finally:
            os._exit(0)
    os.close(tell)
    with os.fdopen(listen, "rb", buffering=0) as pipe:
        told = [pipe.readline() for _ in range(after + 1)]
        assert told[0] == b"begun\n"
        time.sleep(seconds)
        os.kill(pid, signal.SIGKILL)
        told += pipe.readlines()
    os.waitpid(pid, 0)
    return b"".join(told).decode().splitlines()


def documents(text: str) -> list[dict[str, Any]]:
    """The whole documents of a transcript: a cut off one at its end is left out."""
    parts = text.split("---\n")[1:]
    found = [yaml.safe_load(part) for part in parts[:-1]]
    try:
        last = yaml.safe_load(parts[-1]) if parts and parts[-1].endswith("\n") else None
    except yaml.YAMLError:
        last = None
    return [*found, *([last] if isinstance(last, dict) else [])]


@pytest.mark.parametrize("kills", [20, pytest.param(100, marks=pytest.mark.slow)])
def test_a_kill_in_a_dialogue_loses_no_answer(tmp_path: Path, kills: int) -> None:
    """What a run has taken is in its transcript, and the graph is the old or the new."""
    print(f"ADAPTBOT_CRASH_SEED={SEED}")
    rng = random.Random(SEED)
    root, answers = tmp_path / "home", tmp_path / "answers.yaml"
    answers.write_text(ANSWERS)
    keeper(root).keep(item("leek", "fridge"))
    trial = tmp_path / "trial"
    keeper(trial)
    out, answered = os.pipe()
    usual = run(trial, answers, tmp_path / "trial.yaml", answered)
    os.close(answered)
    with os.fdopen(out, "rb") as pipe:
        number_of_answers = pipe.read().count(b"\t") // 2
    assert begun(trial).kg.find("moonstone"), "the dialogue teaches something"
    assert number_of_answers >= len(STONES)
    taken = cut = 0
    for number in range(kills):
        record, after = tmp_path / f"{number}.yaml", number % (number_of_answers + 1)
        told = killed(after, rng.uniform(0, usual / number_of_answers), root, answers, record)
        found = documents(record.read_text(encoding="utf-8"))
        assert found[0]["adaptbot"] == 1
        known = {
            (str(d.get("about")), str(d.get("prop") or d.get("kind")), str(d.get("answer")))
            for d in found
            if d.get("turn") == "ask"
        }
        said = [tuple(line.split("\t")) for line in told if "\t" in line]
        assert [answer for answer in said if answer not in known] == []
        taken += len(said)
        cut += "done" not in told
        kg = begun(root).kg
        assert {bool(kg.find(stone)) for stone in STONES} in ({True}, {False}), "half was kept"
        assert Repo.open_or_init(root).dirty(PATHS) == []
        if kg.find(STONES[0]):
            _forget_the_stones(root)
    assert taken > kills and cut > kills / 4


def _forget_the_stones(root: Path) -> None:
    kg = begun(root).kg
    stones = [entity for stone in STONES for entity in kg.find(stone)]
    facts = frozenset(t for entity in stones for t in kg.facts.triples((entity, None, None)))
    keeper(root).change(Delta(removed=facts), "forget the stones")
