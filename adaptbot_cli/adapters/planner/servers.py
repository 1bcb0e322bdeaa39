"""Model servers that are asked which models they have: Ollama, and OpenAI-compatible ones."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from http.client import HTTPException
from typing import Any
from urllib.parse import urlsplit
from urllib.request import HTTPRedirectHandler, ProxyHandler, Request, build_opener

from adaptbot_cli import bounded
from adaptbot_cli.core.graph.clock import EndlessError, within
from adaptbot_cli.errors import ModelError

OLLAMA = "http://127.0.0.1:11434"
LOOPBACK = ("localhost", "127.0.0.1", "::1")
_SECONDS = 0.3
"""How long a server on this machine may take to answer."""

_MOST_BYTES = 4_000_000
_NO_PLANNERS = ("embed", "minilm", "bge-", "e5-", "rerank", "whisper", "clip", "ocr", "guard")
_FAMILIES_WITHOUT_CHAT = frozenset({"bert", "nomic-bert", "clip"})
_BIGGEST = 16_000_000_000
"""Bytes: what is bigger hardly answers in time on the machine of one person."""


@dataclass(frozen=True, slots=True)
class Ollama:
    """An Ollama server: where it is, its models, biggest first, and those that seem to plan."""

    address: str
    models: tuple[str, ...]
    plans: tuple[str, ...]

    @property
    def best(self) -> str | None:
        """The model to plan with."""
        return self.plans[0] if self.plans else None


def ollama(environ: Mapping[str, str]) -> Ollama | None:
    """Return the Ollama server of this machine, or the one that OLLAMA_API_BASE names, if it
    answers at once."""
    address = (environ.get("OLLAMA_API_BASE") or OLLAMA).rstrip("/")
    found = _get(f"{address}/api/tags")
    models = found.get("models") if isinstance(found, dict) else None
    if not isinstance(models, list):
        return None
    known = [model for model in models if isinstance(model, dict) and model.get("name")]
    known.sort(key=_rank)
    names = tuple(str(model["name"]) for model in known)
    return Ollama(address, names, tuple(str(m["name"]) for m in known if _can_plan(m)))


def _rank(model: Mapping[str, Any]) -> tuple[bool, int, str]:
    """Biggest first, but those last that are too big."""
    size = model.get("size")
    size = size if isinstance(size, int) else 0
    return size > _BIGGEST, size if size > _BIGGEST else -size, str(model["name"])


def _can_plan(model: Mapping[str, Any]) -> bool:
    name, details = str(model["name"]).lower(), model.get("details")
    details = details if isinstance(details, dict) else {}
    reply = details.get("families")
    families = set(map(str, reply if isinstance(reply, list) else [details.get("family")]))
    chats = not families or bool(families - _FAMILIES_WITHOUT_CHAT)
    return chats and not any(part in name for part in _NO_PLANNERS)


def served(api_base: str, key: str | None = None) -> list[str]:
    """Return the models of an OpenAI-compatible server, none if it does not list them."""
    found = _get(f"{api_base.rstrip('/')}/models", key or os.environ.get("OPENAI_API_KEY"), 2.0)
    data = found.get("data") if isinstance(found, dict) else None
    entries = data if isinstance(data, list) else []
    return [str(entry["id"]) for entry in entries if isinstance(entry, dict) and "id" in entry]


def _get(address: str, key: str | None = None, seconds: float = _SECONDS) -> Any:
    headers = {"Authorization": f"Bearer {key}"} if key else {}

    def answered() -> Any:
        request = Request(address, headers=headers)
        straight = [ProxyHandler({})] if is_here(address) else []  # no proxy to this machine
        with build_opener(_NoRedirect, *straight).open(request, timeout=seconds) as answer:
            return bounded.parse_json(answer.read(_MOST_BYTES), "its answer", ModelError)

    try:
        return within(answered, address, 2 * seconds)  # a timeout of the socket ends no drip
    except (OSError, ValueError, HTTPException, ModelError, EndlessError):
        return None


class _NoRedirect(HTTPRedirectHandler):
    """Follows no redirect: the key would go along."""

    def redirect_request(self, *_: Any) -> None:
        """Return no further request."""


def is_here(address: str) -> bool:
    """Whether an address is this machine's own."""
    try:
        return (urlsplit(address).hostname or "") in LOOPBACK
    except ValueError:
        return False
