"""A recording as planner: the recorded answers in their order."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from adaptbot_cli.adapters.planner import tokens
from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.core.turns import Proposal, Propose


@dataclass(frozen=True, slots=True)
class Recorded:
    """Gives recorded answers: the first to the task, the n-th to the n-th re-prompt.

    A recording that has run out says its last answer again, as a model at temperature 0 that has
    nothing better to say; that is a model call like any other. Tokens are those of the prompts
    that this program would have sent, and of the recorded answers.
    """

    model: str
    answers: Sequence[str]
    prompts: Prompts
    name: str = field(default="recording")

    def propose(self, turn: Propose) -> Proposal:
        """Return the recorded answer."""
        text = self.answers[min(turn.attempt, len(self.answers) - 1)]
        prompt = tokens.of_messages(self.model, self.prompts.messages(turn))
        return Proposal(text, 1, prompt, tokens.of_text(self.model, text))
