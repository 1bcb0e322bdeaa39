"""The model on board: its grammar, what is said where it is not, and itself where it is."""

import json
import os
import re
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from adaptbot_cli.adapters.planner import local
from adaptbot_cli.adapters.planner.budget import Asking
from adaptbot_cli.adapters.planner.forms import MOST_STEPS, PlanForm
from adaptbot_cli.adapters.planner.local import Board
from adaptbot_cli.adapters.planner.model import Model
from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.errors import ModelError
from adaptbot_cli.resources import bundled
from tests.asking import task_for
from tests.board import on_board
from tests.packs import HOUSEHOLD, KITCHEN, PACKS, Pack

FILE = os.environ.get("ADAPTBOT_GGUF")
"""A GGUF file to try a model with, where llama-cpp-python is installed."""

runs = pytest.mark.skipif(not local.runs(), reason="llama-cpp-python is not installed")
board = pytest.mark.skipif(
    not local.runs() or not FILE, reason="no llama-cpp-python, or ADAPTBOT_GGUF names no model"
)


def grammar(kg: Kg, reasoning: bool = False) -> str:
    return PlanForm(tuple(kg.domain.actions.values()), reasoning).grammar


def pattern(gbnf: str) -> re.Pattern[str]:
    """Read the part of GBNF that we write as a regular expression: both say the same."""
    rules = dict(line.split(" ::= ", 1) for line in gbnf.splitlines() if line)
    token = re.compile(r'"(?:[^"\\]|\\.)*"|\[[^]]*\]|\{[^}]*\}|[()|?]|\w+')

    def expression(rule: str) -> str:
        parts = []
        for part in token.findall(rules[rule]):
            if part.startswith('"'):
                parts.append(re.escape(json.loads(part)))
            elif part == "(":
                parts.append("(?:")
            else:
                parts.append(f"(?:{expression(part)})" if part in rules else part)
        return "".join(parts)

    return re.compile(expression("root"))


@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.name)
def test_the_librarys_calls_of_known_actions_have_the_form_of_the_grammar(pack: Pack) -> None:
    kg = pack.kg()
    form, seen = pattern(grammar(kg)), set()
    for plan in pack.library().values():
        for line in plan.render(plan.names[0], plan.ingredients).splitlines():
            call = line.partition("#")[0].strip()
            action = call.partition("(")[0]
            if action in kg.domain.actions:
                assert form.fullmatch(call), f"{plan.path}: {call}"
                seen.add(action)
    assert len(seen) > 8


@pytest.mark.parametrize(
    ("text", "fits"),
    [
        ('pick_up_obj("dragon fruit")', True),  # what nobody knows is the person's to judge
        ('switch("stove", "on")\nwait(10)', True),
        ('put_down_obj("egg", "pan")', True),
        ("", False),
        ("Sure! Here is the plan:", False),
        ('sprinkle("salt")', False),
        ('pick_up_obj("egg"', False),
        ('pick_up_obj("egg") # first', False),
        ('pick_up_obj("' + "egg_" * 20 + '")', False),
        ('switch("stove", "warm")', False),
        ("\n".join(['clean("pan")'] * MOST_STEPS), True),
        ("\n".join(['clean("pan")'] * (MOST_STEPS + 1)), False),
    ],
)
def test_only_calls_fit_the_grammar(text: str, fits: bool) -> None:
    kg = KITCHEN.kg()
    assert bool(pattern(grammar(kg)).fullmatch(text)) is fits
    thought = pattern(grammar(kg, reasoning=True))
    assert bool(thought.fullmatch(f"Items: egg\nPut it in.\nPLAN:\n{text}")) is fits
    assert not thought.fullmatch(text)


def test_the_grammar_is_made_of_the_domains_own_actions() -> None:
    taught = replace(KITCHEN.kg().domain.actions["clean"], name='rub "dry"')
    assert pattern(PlanForm((taught,), False).grammar).fullmatch('rub "dry"("pan")')
    household = pattern(grammar(HOUSEHOLD.kg()))
    assert household.fullmatch('fold("clothes")') and household.fullmatch('iron("clothes")')


@pytest.mark.parametrize(
    ("name", "meant"),
    [("local", True), ("local:m.gguf", True), ("localai/llama", False), (None, False)],
)
def test_which_names_mean_a_model_on_board(name: str | None, meant: bool) -> None:
    assert local.on_board(name) is meant


def test_files_that_are_no_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_board(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ModelError, match="no GGUF file"):
        local.model_file(f"local:{tmp_path / 'llama_cpp.py'}")
    with pytest.raises(ModelError, match="There is no file"):
        local.model_file("local:")
    with pytest.raises(ModelError, match="There is no file"):
        local.model_file(f"local:{tmp_path}")


def test_a_model_larger_than_the_memory_is_not_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    huge = tmp_path / "huge.gguf"
    with huge.open("wb") as file:
        file.write(b"GGUF")
        file.truncate(1 << 43)
    on_board(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    kg = KITCHEN.kg()
    model = Model(f"local:{huge}", Prompts(bundled("prompts"), kg), first_wait=1000.0)
    with pytest.raises(ModelError, match=r"\AThere is too little memory for huge\.gguf"):
        model.propose(Propose(task_for("onion sandwich", kg)))


def test_a_server_that_ends_by_itself_is_told_with_the_cure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A llama.cpp that is stopped as one is that was built for another processor."""
    on_board(tmp_path)
    (tmp_path / "m.gguf").write_bytes(b"GGUF")
    stopped = "import os, signal\nos.kill(os.getpid(), signal.SIGILL)\n"
    (tmp_path / "uvicorn.py").write_text(stopped, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    kg = KITCHEN.kg()
    model = Model(f"local:{tmp_path / 'm.gguf'}", Prompts(bundled("prompts"), kg), first_wait=1000)
    with pytest.raises(ModelError, match=r"m\.gguf, was stopped by SIGILL.*GGML_NATIVE=OFF"):
        model.propose(Propose(task_for("onion sandwich", kg)))


@runs
def test_a_damaged_file_is_told(tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.gguf"
    damaged.write_bytes(b"GGUF" + bytes(100))
    with pytest.raises(ModelError, match=r"damaged\.gguf, cannot be loaded"):
        Board(damaged).speed()


@board
def test_one_server_plans_for_a_whole_run_in_calls_alone() -> None:
    kg = HOUSEHOLD.kg()
    model = Model(f"local:{FILE}", Prompts(bundled("prompts"), kg))
    turn = Propose(task_for("clean the table", kg))
    first = model.propose(turn)
    assert model.board is not None and model.board.process is not None
    server = model.board.process.pid
    assert model.propose(turn).text == first.text and model.board.process.pid == server
    parsed = parse(first.text)
    assert parsed.calls and not parsed.findings
    assert first.calls == 1 and first.prompt_tokens > 100 and first.cost_usd == 0.0
    os.kill(server, signal.SIGKILL)
    assert "most likely for lack of memory" in model.board.death()
    assert "tokens a second" in model.board.speed()  # it is started again
    how = model.board.asking(Asking())
    assert how.api_key and how.api_base and how.api_base.startswith("http://127.0.0.1:")
    model.board.close()
