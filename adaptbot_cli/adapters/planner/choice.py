"""Which model plans: what is said, what is configured, what is found, else the plan library."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.request import urlopen

from adaptbot_cli.adapters.planner.local import found

OLLAMA = "http://127.0.0.1:11434"
_KEYS = (
    ("OPENAI_API_KEY", "gpt-4o-mini"),
    ("ANTHROPIC_API_KEY", "anthropic/claude-3-5-haiku-latest"),
    ("GEMINI_API_KEY", "gemini/gemini-2.0-flash"),
    ("MISTRAL_API_KEY", "mistral/mistral-small-latest"),
    ("GROQ_API_KEY", "groq/llama-3.3-70b-versatile"),
    ("OPENROUTER_API_KEY", "openrouter/openai/gpt-4o-mini"),
)
LIBRARY = "library"


@dataclass(frozen=True, slots=True)
class Chosen:
    """The model to plan with, as litellm names it, or None for the plan library; and why."""

    model: str | None
    why: str


def choose(option: str | None, settings: Mapping[str, Any], environ: Mapping[str, str]) -> Chosen:
    """Choose a model: --model, adaptbot.toml, ADAPTBOT_MODEL, a key, Ollama, on board, library."""
    said = (
        (option, "--model"),
        (settings.get("model"), "adaptbot.toml"),
        (environ.get("ADAPTBOT_MODEL"), "ADAPTBOT_MODEL"),
    )
    for model, where in said:
        if model:
            return Chosen(None if model == LIBRARY else str(model), f"from {where}")
    for key, model in _KEYS:
        if environ.get(key):
            return Chosen(model, f"{key} is set")
    local = _ollama_model()
    if local:
        return Chosen(f"ollama/{local}", "an Ollama server runs on this machine")
    if found.installed():
        return Chosen(found.NAME, "the model on board is installed, and no other is configured")
    return Chosen(None, "no model is configured: see --model")


def _ollama_model() -> str | None:
    """The first model of an Ollama server on this machine, if one answers at once."""
    try:
        with urlopen(f"{OLLAMA}/api/tags", timeout=0.3) as answer:
            models = json.load(answer)["models"]
        return str(models[0]["name"])
    except (OSError, ValueError, KeyError, IndexError, TypeError):
        return None
