"""Counts tokens as a model's own tokenizer does, without a network; recorded answers, counted."""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.core.turns import Planner, Proposal, Propose

PER_MESSAGE, PER_ANSWER = 3, 3
"""What each message, and the answer's start, add in the chat format of OpenAI's models."""

BUNDLED, USUAL = ("o200k_base", "cl100k_base"), "cl100k_base"
"""The encodings that come along, and the one for models that have none of them."""


@cache
def _encoding(model: str) -> Any:
    # litellm carries the encodings; importing it to ask where they are would take seconds.
    litellm = find_spec("litellm")
    if litellm is not None and litellm.origin is not None:
        folder = Path(litellm.origin).parent / "litellm_core_utils" / "tokenizers"
        os.environ.setdefault("TIKTOKEN_CACHE_DIR", str(folder))
    import tiktoken

    try:
        name = tiktoken.encoding_name_for_model(model.rsplit("/", 1)[-1])
    except KeyError:
        name = USUAL
    return tiktoken.get_encoding(name if name in BUNDLED else USUAL)


def encoding_name(model: str) -> str:
    """Return the name of the encoding that a model's texts are counted with."""
    return str(_encoding(model).name)


def of_text(model: str, text: str) -> int:
    """Return the number of tokens of a text."""
    return len(_encoding(model).encode(text, disallowed_special=()))


def of_messages(model: str, messages: Iterable[dict[str, str]]) -> int:
    """Return the number of tokens of chat messages, as a provider counts a prompt."""
    return PER_ANSWER + sum(
        PER_MESSAGE + sum(of_text(model, part) for part in message.values()) for message in messages
    )


@dataclass(frozen=True, slots=True)
class Recorded:
    """Gives recorded answers: the first to the task, the n-th to the n-th re-prompt.

    Past its end it asks `beyond`; where there is none it repeats its last answer, as a model
    at temperature 0 does that has no better one: a model call like any other. Tokens are those
    of the prompts that this program sends, or would have sent, and of the answers.
    """

    model: str
    answers: Sequence[str]
    prompts: Prompts
    beyond: Planner | None = None
    name: str = "recording"

    def propose(self, turn: Propose) -> Proposal:
        """Return the recorded answer. Raises ModelError, if one asked beyond it does."""
        if turn.attempt >= len(self.answers) and self.beyond is not None:
            proposal = self.beyond.propose(turn)
        else:
            proposal = Proposal(self.answers[min(turn.attempt, len(self.answers) - 1)])
        if not proposal.calls:
            return proposal
        prompt = of_messages(self.model, self.prompts.messages(turn))
        completion = of_text(self.model, proposal.text)
        return replace(proposal, prompt_tokens=prompt, completion_tokens=completion)
