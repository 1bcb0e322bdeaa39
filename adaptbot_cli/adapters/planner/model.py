"""A language model as planner, through litellm."""

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import astuple, dataclass, field, replace
from typing import Any, Protocol

from adaptbot_cli.adapters.planner import local, provider
from adaptbot_cli.adapters.planner.budget import SILENCE, Asking, Budget
from adaptbot_cli.adapters.planner.failures import (
    WITHOUT_MODEL,
    BrokenOff,
    Called,
    Failure,
    failure,
)
from adaptbot_cli.adapters.planner.forms import MARK, PlanForm
from adaptbot_cli.adapters.planner.local import Board
from adaptbot_cli.adapters.planner.prompts import Message, Prompts
from adaptbot_cli.adapters.planner.provider import Provider
from adaptbot_cli.adapters.planner.scrub import Secrets, Sieve
from adaptbot_cli.adapters.planner.streamed import PartialAnswer, plan_text, read, split
from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.core.usage import Usage
from adaptbot_cli.errors import ModelError

TRIES = 4
"""How often an answer is asked for at most."""

FIRST_WAIT = 1.0
"""Seconds before the second try; each further one waits twice as long, or what is asked for."""


Show = Callable[[str, bool], None]
"""Takes a piece of an answer as it comes, and whether it is reasoning."""


class Watcher(Protocol):
    """Sees a model answer."""

    def answering(self) -> AbstractContextManager[Show]:
        """Show that the model is asked; what is given takes the text as it comes."""
        ...

    def tell(self, sentence: str) -> None:
        """Show a remark on the answer."""
        ...


class Unwatched:
    """Shows nothing."""

    def answering(self) -> AbstractContextManager[Show]:
        """Take the text to nowhere."""
        return nullcontext(lambda text, reasoning: None)

    def tell(self, sentence: str) -> None:
        """Show nothing."""


@dataclass(slots=True)
class Model:
    """Plans with any model that litellm can reach, within a budget, and without its secrets; one on
    `board` runs on this machine."""

    name: str
    prompts: Prompts
    asking: Asking = field(default_factory=Asking)
    budget: Budget = field(default_factory=Budget)
    secrets: Secrets = field(default_factory=Secrets)
    watcher: Watcher = field(default_factory=Unwatched)
    board: Board | None = None
    first_wait: float = FIRST_WAIT

    def __post_init__(self) -> None:
        """Find the file of a model on board. Raises ModelError: there is none."""
        if self.board is None and local.on_board(self.name):
            self.board = Board(local.model_file(self.name))
        if self.board is not None:
            self.name = self.board.name

    def propose(self, turn: Propose) -> Proposal:
        """Return the model's text (docs/models.md).

        Raises:
            ModelError: no key, no such model, no network, a refusal, nothing left of the budget;
                never with a secret in it, and with what was spent in vain.
        """
        with self.watcher.answering():  # litellm takes seconds to load
            litellm = provider.load()
        messages = self.prompts.messages(turn)
        model, called = self._reached(litellm, self.prompts.form(turn))
        before = len(self.budget.answers)
        try:
            with self.budget.waiting():
                reasoning, text = self._tried(model, called, messages)
        except ModelError as error:
            error.spent = astuple(sum(self.budget.answers[before:], start=Usage()))[:4]
            raise
        prompt = f"{self.prompts.style} {self.prompts.hash(turn)}"
        spent = astuple(sum(self.budget.answers[before:], start=Usage()))[:4]
        return replace(Proposal(text, *spent), reasoning=reasoning, prompt=prompt)

    def _tried(self, model: Provider, called: Called, messages: list[Message]) -> tuple[str, str]:
        """Ask until there is an answer, as often and long as it makes sense; return its reasoning
        and its plan. Raises ModelError."""
        unfinished = ""
        for number in range(1, TRIES + 1):
            room, answer = self._room(model, messages), PartialAnswer()
            try:
                return self._answered(model, messages, room, answer)
            except Exception as error:  # litellm raises each provider's own kinds of errors
                if self.board and not isinstance(error, Failure) and (why := self.board.death()):
                    raise ModelError(why) from None
                failed = failure(error, called, model.names, answer.begun)
            reasoning, written = self._text(answer)
            out_of_time = self.budget.seconds_left <= 0
            if written and (isinstance(failed, BrokenOff) or failed.slow):
                before, unfinished = unfinished, written
                # Some servers never mark an answer as whole: then it is the same once more.
                if unfinished == before or number == TRIES or out_of_time:
                    why = "the time is up (--timeout)" if out_of_time else failed.why
                    self.watcher.tell(f"{why}: the plan is used as far as it was written")
                    return reasoning, unfinished
            if out_of_time:
                limit = f"a run gives it {self.budget.limits.seconds:g} s (--timeout)"
                raise ModelError(called.sentence(f"{failed.why}; {limit}"))
            if failed.refused and model.form is not None:
                self.watcher.tell(f"{self.name} takes no schema; asking for JSON in words alone")
                model = replace(model, form=None)
                continue
            if not failed.again or number == TRIES:
                text = f"{failed.why}, {TRIES} times" if failed.again else failed.why
                raise ModelError(called.sentence(text))
            self._wait(called, failed, number)
        raise AssertionError("the last try returns or raises")

    def _reached(self, litellm: Any, form: PlanForm) -> tuple[Provider, Called]:
        """Return the model, and how it is spoken of. Raises ModelError: it lacks its key."""
        asking = self.asking if self.board is None else self.board.asking(self.asking)
        name = self.name if self.board is None else f"openai/{self.board.file.stem}"
        model = Provider(litellm, name, asking, form if form.json or asking.grammar else None)
        called = Called(self.name, self.asking.api_base, self.secrets)
        missing = model.missing_keys()
        if missing:
            text = " and ".join(missing)
            raise ModelError(f"The model {self.name} needs a key: set {text}. {WITHOUT_MODEL}")
        return model, called

    def _room(self, model: Provider, messages: list[Message]) -> int | None:
        """Return how many tokens the answer may have, None for any. Raises ModelError."""
        if not self.budget.limited:
            return None
        price = model.price() if self.budget.limits.cost_usd is not None else None
        return self.budget.room(model.tokens(messages), price)

    def _wait(self, called: Called, failed: Failure, number: int) -> None:
        """Wait before the next try, and report it. Raises ModelError if that is too long."""
        seconds = self.first_wait * 2 ** (number - 1) if failed.wait is None else failed.wait
        left = self.budget.seconds_left
        if seconds >= left:
            asks = f"{failed.why}; it would have to be waited {seconds:.0f} s for"
            raise ModelError(called.sentence(f"{asks}, and {left:.0f} s are left (--timeout)"))
        self.watcher.tell(
            f"{self.name}: {failed.why}; trying again in {seconds:g} s ({number + 1} of {TRIES})"
        )
        time.sleep(seconds)

    def _answered(
        self, model: Provider, messages: list[Message], room: int | None, answer: PartialAnswer
    ) -> tuple[str, str]:
        """Ask once; return the answer's reasoning and plan. Raises Failure, or what litellm does.

        The limits are on silence and on the run: a slow model may take its time.
        """
        sieve, left = Sieve(self.secrets), self.budget.seconds_left
        try:
            with self.watcher.answering() as show:

                def shown(piece: str, reasoning: bool) -> None:
                    thinks = self.prompts.style == "cot" and MARK not in "".join(answer.text)
                    show(sieve.let(piece), reasoning or thinks)

                def ask() -> Any:
                    return model.stream(messages, min(SILENCE, left), room)

                read(ask, SILENCE, left, shown, answer)
                show(sieve.rest(), False)
        except Exception:
            self._count(model, answer, messages)
            raise
        self._count(model, answer, messages)
        reasoning, text = self._text(answer)
        self._judge(answer, text, reasoning)
        return reasoning, text

    def _count(self, model: Provider, answer: PartialAnswer, messages: list[Message]) -> None:
        """Count what an answer, whole or not, has cost."""
        if answer.chunks:
            self.budget.answers.append(model.spent(answer, messages))

    def _text(self, answer: PartialAnswer) -> tuple[str, str]:
        """Return an answer's reasoning and its plan, without secrets."""
        thought, text = plan_text(answer)
        reasoning, plan = split(text, self.prompts.style)
        message = "\n".join(part for part in (thought, reasoning) if part)
        return self.secrets.cut(message), self.secrets.cut(plan)

    def _judge(self, answer: PartialAnswer, text: str, reasoning: str) -> None:
        """Raise Failure for an answer without a plan; report what is odd about one with a plan."""
        if answer.ended == "content_filter":
            raise Failure("the provider refused the content")
        if answer.ended == "length" and not text:
            raise Failure("its answer came to its length limit before it wrote any plan")
        if not text and reasoning:
            raise Failure("it only reasoned, and wrote no plan")
        if not text:
            hint = "; is the API base right? it mostly ends in /v1" if self.asking.api_base else ""
            raise Failure(f"its answer was empty{hint}", again=True)
        if answer.ended is None:
            raise BrokenOff
        if answer.ended == "length":
            self.watcher.tell("the answer was cut off at its length limit")
