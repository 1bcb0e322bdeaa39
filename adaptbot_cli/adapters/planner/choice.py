"""Which model plans: named, configured, or found on this machine; else the plan library."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from adaptbot_cli.adapters.planner import local
from adaptbot_cli.errors import UsageError

KEYS = (
    ("OPENAI_API_KEY", "gpt-4o-mini"),
    ("ANTHROPIC_API_KEY", "anthropic/claude-haiku-4-5"),
    ("GEMINI_API_KEY", "gemini/gemini-flash-latest"),
    ("MISTRAL_API_KEY", "mistral/mistral-small-latest"),
    ("GROQ_API_KEY", "groq/openai/gpt-oss-20b"),
    ("OPENROUTER_API_KEY", "openrouter/openai/gpt-4o-mini"),
)
"""Providers by the variable of their key, and a small model of each that can plan."""

LIBRARY = "library"


@dataclass(frozen=True, slots=True)
class Chosen:
    """The model to plan with, as litellm names it, or None for the plan library; and why.

    `api_base` is the address of the server that has it, if it is not the provider's own.
    """

    model: str | None
    why: str
    api_base: str | None = None

    @property
    def name(self) -> str:
        """How the planner is called."""
        return self.model or "plan library"


def choose(
    option: str | None,
    settings: Mapping[str, Any],
    environ: Mapping[str, str],
    api_base: str | None = None,
    named_by: str = "--model",
) -> Chosen:
    """Choose a model: `option`, which `named_by` gave, adaptbot.toml, ADAPTBOT_MODEL, a server that
    --api-base names, a provider's key, Ollama, the model on board, the plan library.

    Raises:
        UsageError: --api-base is no address of the web, or that of a server that lists no model.
    """
    for address in (api_base, settings.get("api_base")):
        if address and not str(address).startswith(("http://", "https://")):
            raise UsageError("the API base must be an address such as http://127.0.0.1:8000/v1")
    found = (
        (option, named_by),
        (settings.get("model"), "adaptbot.toml"),
        (environ.get("ADAPTBOT_MODEL"), "ADAPTBOT_MODEL"),
    )
    configured = settings.get("api_base")
    name, where = next(((str(name), where) for name, where in found if name), ("", ""))
    if not name:
        base = api_base or configured
        return _served(base) if base else _found(environ)
    if name == LIBRARY or local.on_board(name):
        return Chosen(None if name == LIBRARY else name, f"from {where}")
    # An address that is only configured is one of OpenAI's kind.
    if api_base is None and (name.startswith("openai/") or "/" not in name):
        api_base = configured or _openai_base(environ)
    if api_base and "/" not in name and ":" not in name:
        name = f"openai/{name}"
    return Chosen(name, f"from {where}", api_base)


def _openai_base(environ: Mapping[str, str]) -> str | None:
    return environ.get("OPENAI_BASE_URL") or environ.get("OPENAI_API_BASE") or None


def _served(base: str) -> Chosen:
    """The first model of an OpenAI-compatible server."""
    from adaptbot_cli.adapters.planner.servers import served

    for name in served(base):
        return Chosen(f"openai/{name}", "the first model of the server at the API base", base)
    cure = "start it, or name one with --model openai/NAME"
    raise UsageError(f"the server at the API base tells no model: {cure}")


def _found(environ: Mapping[str, str]) -> Chosen:
    for key, model in KEYS:
        if environ.get(key):
            base = _openai_base(environ) if key == "OPENAI_API_KEY" else None
            return Chosen(model, f"{key} is set", base)
    from adaptbot_cli.adapters.planner.servers import ollama

    server = ollama(environ)
    if server is not None and server.best is not None:
        more = len(server.plans) - 1
        why = f"Ollama runs at {server.address}" + (f"; {more} more there" if more else "")
        return Chosen(f"ollama_chat/{server.best}", why)
    if local.installed():
        return Chosen(local.NAME, "the model on board is installed, and no other is configured")
    return Chosen(None, "no model is configured: see --model")
