"""Which model plans, in the order of the design, and why."""

from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.adapters.planner import local as found
from adaptbot_cli.adapters.planner.choice import Chosen, choose
from adaptbot_cli.adapters.planner.servers import ollama
from adaptbot_cli.errors import UsageError
from tests.board import on_board
from tests.loopback import serving

NOBODY = {"OLLAMA_API_BASE": "http://127.0.0.1:9"}
KEY = {"OPENAI_API_KEY": "x", **NOBODY}
TOML = {"model": "gpt-4o"}
ON_BOARD = Chosen("local", "the model on board is installed, and no other is configured")
LAST = ON_BOARD if found.installed() else Chosen(None, "no model is configured: see --model")


@pytest.mark.parametrize(
    ("option", "settings", "environ", "expected"),
    [
        ("m", TOML, {**KEY, "ADAPTBOT_MODEL": "e"}, Chosen("m", "from --model")),
        (None, TOML, {**KEY, "ADAPTBOT_MODEL": "e"}, Chosen("gpt-4o", "from adaptbot.toml")),
        (None, {}, {**KEY, "ADAPTBOT_MODEL": "e"}, Chosen("e", "from ADAPTBOT_MODEL")),
        (None, {}, KEY, Chosen("gpt-4o-mini", "OPENAI_API_KEY is set")),
        ("library", TOML, KEY, Chosen(None, "from --model")),
        (None, {}, NOBODY, LAST),
    ],
)
def test_what_is_said_comes_before_what_is_found(
    option: str | None, settings: dict[str, Any], environ: dict[str, str], expected: Chosen
) -> None:
    assert choose(option, settings, environ) == expected


HERE, THERE = "http://127.0.0.1:1/v1", "http://127.0.0.1:2/v1"


@pytest.mark.parametrize(
    ("option", "base", "settings", "environ", "model", "expected"),
    [
        ("openai/x", HERE, {"api_base": THERE}, {}, "openai/x", HERE),
        ("openai/x", None, {"api_base": THERE}, {"OPENAI_API_BASE": HERE}, "openai/x", THERE),
        ("openai/x", None, {}, {"OPENAI_API_BASE": HERE}, "openai/x", HERE),
        ("x", HERE, {}, {}, "openai/x", HERE),
        ("anthropic/x", None, {"api_base": THERE}, {}, "anthropic/x", None),
        ("anthropic/x", HERE, {}, {}, "anthropic/x", HERE),
        ("local", None, {"api_base": THERE}, {"OPENAI_API_BASE": HERE}, "local", None),
        ("local:m.gguf", HERE, {"api_base": THERE}, {}, "local:m.gguf", None),
    ],
)
def test_an_address_belongs_to_a_server_of_ones_own(
    option: str,
    base: str | None,
    settings: dict[str, Any],
    environ: dict[str, str],
    model: str,
    expected: str | None,
) -> None:
    chosen = choose(option, settings, environ, base)
    assert (chosen.model, chosen.api_base) == (model, expected)


def test_a_server_without_a_named_model_tells_its_first() -> None:
    with serving(models=("qwen", "other")) as at:
        assert choose(None, {}, KEY, at.url).model == "openai/qwen"
    with pytest.raises(UsageError, match="tells no model"):
        choose(None, {}, {}, HERE)


@pytest.mark.parametrize("base", ["file:///etc/passwd", "127.0.0.1:8000", "ftp://x"])
def test_an_address_is_one_of_the_web(base: str) -> None:
    with pytest.raises(UsageError, match="must be an address"):
        choose("openai/x", {}, {}, base)


DETAILS = {
    "all-minilm:latest": {"size": 9_000_000_000, "details": {"family": "bert"}},
    "mxbai-embed-large": {"size": 8_000_000_000},
    "llama3.2:1b": {"size": 1_300_000_000, "details": {"family": "llama"}},
    "qwen3:8b": {"size": 5_200_000_000, "details": {"family": "qwen3", "families": ["qwen3"]}},
    "llava:13b": {"size": 4_000_000_000, "details": {"families": ["llama", "clip"]}},
    "llama3:70b": {"size": 40_000_000_000, "details": {"family": "llama"}},
}


def test_ollama_plans_with_its_biggest_model_that_this_machine_bears(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")  # nothing goes there
    monkeypatch.setenv("HTTP_PROXY", "http://127.0.0.1:9")
    with serving(models=tuple(DETAILS), details=DETAILS) as at:
        server = ollama({"OLLAMA_API_BASE": at.root})
        assert server is not None
        assert server.plans == ("qwen3:8b", "llava:13b", "llama3.2:1b", "llama3:70b")
        chosen = choose(None, {}, {"OLLAMA_API_BASE": at.root})
        assert chosen.model == "ollama_chat/qwen3:8b"
        assert chosen.why == f"Ollama runs at {at.root}; 3 more there"


def test_ollama_without_a_model_that_plans_is_passed_over() -> None:
    with serving(models=("nomic-embed-text",)) as at:
        assert choose(None, {}, {"OLLAMA_API_BASE": at.root}) == LAST
    with serving(models=()) as at:
        assert choose(None, {}, {"OLLAMA_API_BASE": at.root}) == LAST


def test_the_model_on_board_comes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    on_board(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    assert choose(None, {}, NOBODY) == ON_BOARD
    assert choose(None, {}, KEY).model == "gpt-4o-mini"
    with serving(models=("qwen",)) as at:
        assert choose(None, {}, {"OLLAMA_API_BASE": at.root}).model == "ollama_chat/qwen"


@pytest.mark.parametrize("families", [5, [["x"], 5], {"a": 1}, "clip"])
def test_a_server_that_tells_nonsense_of_its_models_is_no_fault(families: object) -> None:
    details = {"odd:1b": {"size": 1_000_000, "details": {"family": ["x"], "families": families}}}
    with serving(models=tuple(details), details=details) as at:
        server = ollama({"OLLAMA_API_BASE": at.root})
        assert server is not None and server.plans == ("odd:1b",)
