"""The model on board as a provider of litellm. Imports litellm: import it inside functions only."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import litellm

from adaptbot_cli.adapters.planner.budget import ONE_ANSWER
from adaptbot_cli.adapters.planner.local.engine import Engine

PROVIDER = "local"
_TOKENS = 1500
"""How long a plan may be."""
_ROOM = 256
"""How many tokens a prompt must leave for a plan."""
_IN_TIME = 0.95
"""The share of its time that it may use: it says itself that there was too little, before whoever
reads gives it up and asks again, which would take as long."""


class OnBoard(litellm.CustomLLM):  # type: ignore[misc]
    """Streams plans of one engine. `grammar` gives the form of the next one."""

    def __init__(self, engine: Engine, grammar: Callable[[], str]) -> None:
        super().__init__()
        self.engine = engine
        self.grammar = grammar

    def streaming(
        self,
        *,
        messages: Sequence[Mapping[str, str]],
        optional_params: Mapping[str, Any],
        timeout: float | None = None,
        **rest: object,
    ) -> Iterator[dict[str, Any]]:
        """Yield the plan token by token, as litellm's GenericStreamingChunk, usage last.

        Raises:
            ModelError: whatever keeps the model from writing a plan.
        """
        request = {
            "messages": list(messages),
            "grammar": self.grammar(),
            "temperature": optional_params.get("temperature") or 0.0,
            "tokens": min(_TOKENS, optional_params.get("max_tokens") or _TOKENS),
            "room": _ROOM,
        }
        for answer in self.engine.stream(request, _IN_TIME * (timeout or ONE_ANSWER)):
            yield _chunk(answer)


def _chunk(answer: Mapping[str, Any]) -> dict[str, Any]:
    finish = answer.get("finished")
    return {
        "text": answer.get("text", ""),
        "tool_use": None,
        "is_finished": finish is not None,
        "finish_reason": finish or "",
        "index": 0,
        "usage": _usage(answer) if finish is not None else None,
    }


def _usage(answer: Mapping[str, Any]) -> dict[str, int]:
    prompt, completion = answer["prompt"], answer["completion"]
    return {
        "prompt_tokens": prompt,
        "completion_tokens": completion,
        "total_tokens": prompt + completion,
    }


def register(name: str, engine: Engine, grammar: Callable[[], str]) -> None:
    """Make `local/NAME` a model of litellm, which costs nothing."""
    entry = {"provider": PROVIDER, "custom_handler": OnBoard(engine, grammar)}
    others = [e for e in litellm.custom_provider_map if e["provider"] != PROVIDER]
    litellm.custom_provider_map = [*others, entry]
    litellm.utils.custom_llm_setup()
    litellm.register_model(
        {
            f"{PROVIDER}/{name}": {
                "litellm_provider": PROVIDER,
                "mode": "chat",
                "max_input_tokens": engine.context,
                "max_output_tokens": _TOKENS,
                "input_cost_per_token": 0.0,
                "output_cost_per_token": 0.0,
                "cache_creation_input_token_cost": 0.0,
                "cache_read_input_token_cost": 0.0,
            }
        }
    )
