"""A recording as planner: the recorded answers in their order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from adaptbot_cli.adapters.planner import tokens
from adaptbot_cli.adapters.planner.model import PromptSource
from adaptbot_cli.core.turns import Planner, Proposal, Propose


@dataclass(frozen=True, slots=True)
class Recorded:
    """Gives recorded answers: the first to the task, the n-th to the n-th re-prompt.

    Past its end it asks `beyond`; where there is none it says its last answer again, as a model
    at temperature 0 that has nothing better to say: a model call like any other. Tokens are those
    of the prompts that this program sends, or would have sent, and of the answers.
    """

    model: str
    answers: Sequence[str]
    prompts: PromptSource
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
        prompt = tokens.of_messages(self.model, self.prompts.messages(turn))
        completion = tokens.of_text(self.model, proposal.text)
        return replace(proposal, prompt_tokens=prompt, completion_tokens=completion)
