"""How a model is asked, and what one run may spend on it: tokens, money, seconds of waiting."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from adaptbot_cli.core.usage import Usage
from adaptbot_cli.errors import ModelError

SECONDS = 300.0
"""How long the model of one run may take, all its answers together, by default."""

SILENCE = 120.0
"""How many seconds may pass between two pieces of an answer."""


@dataclass(frozen=True, slots=True)
class Asking:
    """How a model is asked: its sampling; the server, if it is one of the user's own, with its key
    if that is not in the environment; whether it takes a `grammar`, as llama.cpp's does; how many
    tokens an answer may have at most."""

    temperature: float = 0.0
    seed: int = 0
    api_base: str | None = None
    api_key: str | None = None
    grammar: bool = False
    most_tokens: int | None = None


@dataclass(frozen=True, slots=True)
class Limits:
    """The most that a run may spend: prompt and completion tokens, US dollars, seconds."""

    tokens: int | None = None
    cost_usd: float | None = None
    seconds: float = SECONDS


@dataclass(frozen=True, slots=True)
class Price:
    """US dollars for one token of a prompt, and of an answer."""

    prompt: float = 0.0
    completion: float = 0.0

    def of(self, prompt: int, completion: int) -> float:
        """Return what so many tokens cost."""
        return prompt * self.prompt + completion * self.completion


@dataclass(slots=True)
class Budget:
    """What a run has spent of its limits. Time counts only while the model is waited for."""

    limits: Limits = field(default_factory=Limits)
    answers: list[Usage] = field(default_factory=list)
    waited: float = 0.0
    _since: float | None = None

    @contextmanager
    def waiting(self) -> Iterator[None]:
        """Count the time in which the model is waited for."""
        self._since = time.monotonic()
        try:
            yield
        finally:
            self.waited, self._since = self.limits.seconds - self.seconds_left, None

    @property
    def seconds_left(self) -> float:
        """How long the model may still be waited for."""
        now = 0.0 if self._since is None else time.monotonic() - self._since
        return self.limits.seconds - self.waited - now

    @property
    def limited(self) -> bool:
        """Whether tokens must be counted before they are spent."""
        return self.limits.tokens is not None or self.limits.cost_usd is not None

    @property
    def spent(self) -> Usage:
        """What all answers have cost."""
        return sum(self.answers, start=Usage())

    def room(self, prompt: int, price: Price | None) -> int | None:
        """Return how many tokens an answer to a prompt of so many tokens may have; None: any.

        Raises:
            ModelError: nothing is left for it, or the price is not known that --max-cost needs.
        """
        rooms = []
        if self.limits.tokens is not None:
            rooms.append(self.limits.tokens - self.spent.tokens - prompt)
            if rooms[-1] < _LEAST:
                raise ModelError(
                    f"The token budget is used up: {self.spent.tokens} of {self.limits.tokens} are "
                    f"spent, and the next prompt has {prompt}. Give more with --max-tokens."
                )
        if self.limits.cost_usd is not None:
            rooms.append(self._affordable(self.limits.cost_usd, prompt, price))
        return min(rooms, default=None)

    def _affordable(self, limit: float, prompt: int, price: Price | None) -> int:
        if price is None:
            raise ModelError(
                "No price is known for this model, so --max-cost cannot be kept. "
                "Limit it with --max-tokens instead."
            )
        spent = self.spent.cost_usd or 0.0
        left = limit - spent - price.of(prompt, 0)
        if left < price.of(0, _LEAST):
            raise ModelError(
                f"The money is used up: ${spent:.5f} of ${limit:.5f} is spent, and the next prompt "
                f"costs ${price.of(prompt, 0):.5f}. Give more with --max-cost."
            )
        return int(left / price.completion) if price.completion else _MOST


_LEAST = 16
"""An answer of fewer tokens can be no plan: it is not asked for."""

_MOST = 1_000_000
"""More tokens than any answer has."""
