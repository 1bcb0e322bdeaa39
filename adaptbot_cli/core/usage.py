"""What a run has used of a model and of the person. Light, so that a budget is soon ready."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Usage:
    """What a run, or a part of it, used. `model_calls` are the answers of a model, whole or cut;
    tokens are as the planner counted them; cost is in US dollars, None if unknown."""

    model_calls: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    cost_usd: float | None = None
    questions: int = 0

    def __add__(self, other: "Usage") -> "Usage":
        costs = [cost for cost in (self.cost_usd, other.cost_usd) if cost is not None]
        return Usage(
            self.model_calls + other.model_calls,
            self.prompt_tokens + other.prompt_tokens,
            self.completion_tokens + other.completion_tokens,
            sum(costs) if costs else None,
            self.questions + other.questions,
        )

    @property
    def tokens(self) -> int:
        """Prompt and completion tokens together."""
        return self.prompt_tokens + self.completion_tokens
