"""A language model as planner, through litellm."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.errors import ModelError

SECONDS = 120.0
"""How long one answer may take."""


class Prompts(Protocol):
    """What the model is told."""

    def messages(self, turn: Propose) -> list[dict[str, str]]:
        """Return the chat messages that ask for a plan. Raises ModelError."""
        ...


@dataclass(frozen=True, slots=True)
class Model:
    """Plans with any model that litellm can reach. `streamed` sees the text as it comes."""

    name: str
    prompts: Prompts
    streamed: Callable[[str], None] = lambda text: None

    def propose(self, turn: Propose) -> Proposal:
        """Return the model's text.

        Raises:
            ModelError: no key, no such model, no network, or a refusal; never with a key in it.
        """
        litellm = _litellm()
        messages = self.prompts.messages(turn)
        needed = litellm.validate_environment(self.name)["missing_keys"]
        missing = [name for name in needed if "KEY" in name or "TOKEN" in name]
        if missing:
            told = " and ".join(missing)
            raise ModelError(f"The model {self.name} needs a key: set {told}. {_WITHOUT_MODEL}")
        try:
            return self._answer(litellm, messages)
        except Exception as error:  # litellm raises each provider's own kinds of errors
            raise _ours(error) or ModelError(_sentence(self.name, error)) from None

    def _answer(self, litellm: Any, messages: list[dict[str, str]]) -> Proposal:
        parts = litellm.completion(
            model=self.name,
            messages=messages,
            temperature=0,
            seed=0,
            stream=True,
            timeout=SECONDS,
            drop_params=True,
            stream_options={"include_usage": True},
        )
        chunks = []
        for chunk in parts:
            chunks.append(chunk)
            text = chunk.choices[0].delta.content if chunk.choices else None
            if text:
                self.streamed(text)
        whole = litellm.stream_chunk_builder(chunks, messages=messages)
        usage = getattr(whole, "usage", None)
        return Proposal(
            whole.choices[0].message.content or "",
            1,
            getattr(usage, "prompt_tokens", 0) or 0,
            getattr(usage, "completion_tokens", 0) or 0,
            _cost(litellm, whole),
        )


def _litellm() -> Any:
    """Import litellm with its bundled price list, so that the import needs no network."""
    os.environ.setdefault("LITELLM_LOCAL_MODEL_COST_MAP", "True")
    import litellm

    litellm.suppress_debug_info = True
    litellm.telemetry = False
    return litellm


def _cost(litellm: Any, answer: Any) -> float | None:
    try:
        return float(litellm.completion_cost(answer))
    except Exception:  # a model without a known price
        return None


def _ours(error: BaseException | None) -> ModelError | None:
    """The model on board's own sentence, which litellm wraps in an error of its own."""
    while error is not None and not isinstance(error, ModelError):
        error = error.__cause__ or error.__context__
    return error


_WITHOUT_MODEL = "`--model library` plans without a model."

_CAUSES = {
    "AuthenticationError": "the provider refused the key, or none is set; set the provider's "
    "variable, such as OPENAI_API_KEY",
    "NotFoundError": "the provider knows no model of this name",
    "BadRequestError": "no provider takes it; a model is named with its provider, such as "
    "ollama/llama3.2, anthropic/claude-3-5-haiku-latest or gpt-4o",
    "RateLimitError": "the provider is limiting requests; try again later",
    "Timeout": f"it did not answer within {SECONDS:.0f} seconds",
    "APIConnectionError": "it cannot be reached; check the network, or that its server runs",
    "ContextWindowExceededError": "the prompt is too long for it",
    "ContentPolicyViolationError": "the provider refused the content",
    "InternalServerError": "the provider failed; try again later",
    "ServiceUnavailableError": "the provider is not available; try again later",
}


def _sentence(model: str, error: Exception) -> str:
    """Say what went wrong without repeating the provider's text, which may echo a key."""
    kind = type(error).__name__
    cause = _CAUSES.get(kind, f"the call failed ({kind})")
    return f"The model {model} gave no plan: {cause}. {_WITHOUT_MODEL}"
