"""The model on board, without it: the grammar, the examples, and what is said where it is not."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from adaptbot_cli.adapters.planner.library import read_library
from adaptbot_cli.adapters.planner.local import found
from adaptbot_cli.adapters.planner.local.engine import Engine
from adaptbot_cli.adapters.planner.local.grammar import MOST_LINES, grammar
from adaptbot_cli.adapters.planner.local.prompts import for_model, nearest_plans, told
from adaptbot_cli.adapters.planner.model import Model
from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.adapters.store.reading import load_kg, read_files
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.errors import ModelError
from adaptbot_cli.resources import bundled
from tests.asking import task_for
from tests.board import on_board

LIBRARY = bundled("prompts") / "library"


def domain(name: str) -> Kg:
    return load_kg(read_files(bundled("kg") / name), name)


NAMES = ["dragon fruit", "egg", "pan", "stove", 'a "b"']


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


@pytest.mark.parametrize("name", ["kitchen", "household"])
def test_the_librarys_calls_of_known_actions_have_the_form_of_the_grammar(name: str) -> None:
    kg = domain(name)
    seen = set()
    for plan in read_library(LIBRARY / name):
        shown = plan.render(plan.names[0], plan.ingredients)
        form = pattern(grammar(kg.domain, re.findall(r'"([^"]+)"', shown)))
        for line in shown.splitlines():
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
        ('pick_up_obj("a \\"b\\"")', True),
        ('pick_up_obj("stove_basket_basket")', False),
        ('switch("stove", "on")\nwait(10)', True),
        ('put_down_obj("egg", "pan")', True),
        ("", False),
        ("Sure! Here is the plan:", False),
        ('sprinkle("salt")', False),
        ('pick_up_obj("egg"', False),
        ('pick_up_obj("egg") # first', False),
        ('switch("stove", "warm")', False),
        ("\n".join(['clean("pan")'] * MOST_LINES), True),
        ("\n".join(['clean("pan")'] * (MOST_LINES + 1)), False),
    ],
)
def test_only_calls_fit_the_grammar(text: str, fits: bool) -> None:
    assert bool(pattern(grammar(domain("kitchen").domain, NAMES)).fullmatch(text)) is fits


def test_the_grammar_is_made_of_the_domains_own_actions() -> None:
    kitchen = domain("kitchen").domain
    taught = replace(kitchen.actions["clean"], name='rub "dry"')
    text = grammar(replace(kitchen, actions={**kitchen.actions, taught.name: taught}), NAMES)
    assert pattern(text).fullmatch('rub "dry"("pan")')
    household = pattern(grammar(domain("household").domain, ["clothes"]))
    assert household.fullmatch('fold("clothes")') and household.fullmatch('iron("clothes")')


def test_a_task_may_name_what_the_graph_lacks() -> None:
    kg = domain("kitchen")
    task = task_for("dragon fruit smoothie", kg, ["yuzu"])
    assert {"dragon_fruit", "smoothie", "yuzu"} <= told(task)
    assert not kg.find("dragon_fruit") and not kg.find("yuzu")


def test_the_nearest_examples_come_last() -> None:
    library = read_library(LIBRARY / "kitchen")
    task = task_for("onion sandwich", domain("kitchen"))
    last = nearest_plans(task, library, 3)
    assert len(last) == 3 and last[-1].path.stem == "sandwich"
    without = [plan for plan in library if plan is not last[-1]]
    assert "sandwich" in nearest_plans(task, without, 2)[-1].path.stem


@pytest.mark.parametrize(
    ("name", "meant"),
    [("local", True), ("local:m.gguf", True), ("localai/llama", False), (None, False)],
)
def test_which_names_mean_a_model_on_board(name: str | None, meant: bool) -> None:
    assert found.on_board(name) is meant


def test_files_that_are_no_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_board(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    runtime = tmp_path / "llama_cpp.py"
    with pytest.raises(ModelError, match="no GGUF file"):
        found.model_file(f"local:{runtime}")
    with pytest.raises(ModelError, match="There is no file"):
        found.model_file("local:")
    with pytest.raises(ModelError, match="There is no file"):
        found.model_file(f"local:{tmp_path}")


def test_a_model_larger_than_the_memory_is_not_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    huge = tmp_path / "huge.gguf"
    with huge.open("wb") as file:
        file.write(b"GGUF")
        file.truncate(1 << 43)
    request = {"messages": [], "grammar": "", "temperature": 0.0, "tokens": 1, "room": 1}
    with pytest.raises(ModelError, match="too little memory for huge.gguf"):
        next(Engine(huge).stream(request, 10.0))
    on_board(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    kg = domain("kitchen")
    name, prompts = for_model(f"local:{huge}", Prompts(bundled("prompts"), kg))
    model = Model(name, prompts, first_wait=1000.0)  # its own sentence is told as it is, at once
    with pytest.raises(ModelError, match=r"\AThere is too little memory for huge\.gguf"):
        model.propose(Propose(task_for("onion sandwich", kg)))
