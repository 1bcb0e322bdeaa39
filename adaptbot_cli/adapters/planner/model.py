"""A language model as planner, through litellm."""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import astuple, dataclass, field
from typing import Any, Protocol

from adaptbot_cli.adapters.planner import provider
from adaptbot_cli.adapters.planner.budget import ONE_ANSWER, Budget, Spent
from adaptbot_cli.adapters.planner.failures import (
    WITHOUT_MODEL,
    BrokenOff,
    Called,
    Failure,
    failure,
    our_own,
)
from adaptbot_cli.adapters.planner.provider import Asking, Provider
from adaptbot_cli.adapters.planner.scrub import Secrets, Sieve
from adaptbot_cli.adapters.planner.streaming import Answer, read
from adaptbot_cli.adapters.planner.text import plan_text, why_empty
from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.errors import ModelError

Message = dict[str, str]
TRIES = 4
"""How often an answer is asked for at most."""

FIRST_WAIT = 1.0
"""Seconds before the second try; each further one waits twice as long, or what is asked for."""


class Prompts(Protocol):
    """What the model is told."""

    def messages(self, turn: Propose) -> list[Message]:
        """Return the chat that asks for a plan, or a better one. Raises ModelError, PackError."""
        ...


class Watcher(Protocol):
    """Sees a model answer."""

    def answering(self) -> AbstractContextManager[Callable[[str], None]]:
        """Show that the model is asked; what is given takes the text as it comes."""
        ...

    def tell(self, sentence: str) -> None:
        """Show what is worth knowing about the answer."""
        ...


class Unwatched:
    """Shows nothing."""

    @contextmanager
    def answering(self) -> Iterator[Callable[[str], None]]:
        """Take the text to nowhere."""
        yield lambda text: None

    def tell(self, sentence: str) -> None:
        """Say nothing."""


@dataclass(slots=True)
class Model:
    """Plans with any model that litellm can reach, within a budget, and without its secrets."""

    name: str
    prompts: Prompts
    asking: Asking = field(default_factory=Asking)
    budget: Budget = field(default_factory=Budget)
    secrets: Secrets = field(default_factory=Secrets)
    watcher: Watcher = field(default_factory=Unwatched)
    first_wait: float = FIRST_WAIT

    def propose(self, turn: Propose) -> Proposal:
        """Return the model's text (docs/models.md).

        Raises:
            ModelError: no key, no such model, no network, a refusal, nothing left of the budget;
                never with a secret in it, and with what was spent in vain.
        """
        litellm = self._loaded()
        messages = self.prompts.messages(turn)
        model, called = self._reached(litellm)
        before = len(self.budget.answers)
        self.budget.start()
        try:
            text = self._tried(model, called, messages)
        except ModelError as error:
            error.spent = astuple(self._spent(before))
            raise
        finally:
            self.budget.stop()
        return Proposal(text, *astuple(self._spent(before)))

    def _spent(self, before: int) -> Spent:
        return sum(self.budget.answers[before:], start=Spent())

    def _tried(self, model: Provider, called: Called, messages: list[Message]) -> str:
        """Ask until there is an answer, as often and long as it makes sense. Raises ModelError."""
        unfinished = ""
        for number in range(1, TRIES + 1):
            room, answer = self._room(model, messages), Answer()
            try:
                return self._answered(model, messages, room, answer)
            except Exception as error:  # litellm raises each provider's own kinds of errors
                own = our_own(error)
                if own is not None:
                    raise own from None
                failed = failure(error, called, model.names, answer.begun)
            if isinstance(failed, BrokenOff):
                before, unfinished = unfinished, self._text(answer, None)
                # Some servers never say that an answer is whole: then it is the same once more.
                if unfinished and (unfinished == before or number == TRIES):
                    self.watcher.tell("the answer ended without saying that it was whole")
                    return unfinished
            if self.budget.seconds_left <= 0:
                limit = f"a run gives it {self.budget.limits.seconds:g} s (--timeout)"
                raise ModelError(called.sentence(f"{failed.why}; {limit}"))
            if not failed.again or number == TRIES:
                told = f"{failed.why}, {TRIES} times" if failed.again else failed.why
                raise ModelError(called.sentence(told))
            self._wait(called, failed, number)
        raise AssertionError("the last try returns or raises")

    def _loaded(self) -> Any:
        """Return litellm, which takes seconds to load. Raises ModelError."""
        with self.watcher.answering():
            return provider.load()

    def _reached(self, litellm: Any) -> tuple[Provider, Called]:
        """Return the model, and how it is spoken of. Raises ModelError: it lacks its key."""
        model = Provider(litellm, self.name, self.asking)
        called = Called(self.name, self.asking.api_base, self.secrets)
        missing = model.missing_keys()
        if missing:
            told = " and ".join(missing)
            raise ModelError(f"The model {self.name} needs a key: set {told}. {WITHOUT_MODEL}")
        return model, called

    def _room(self, model: Provider, messages: list[Message]) -> int | None:
        """Return how many tokens the answer may have, None for any. Raises ModelError."""
        if not self.budget.limited:
            return None
        price = model.price() if self.budget.limits.cost_usd is not None else None
        return self.budget.room(model.tokens(messages), price)

    def _wait(self, called: Called, failed: Failure, number: int) -> None:
        """Wait before the next try, and say so. Raises ModelError if that is too long."""
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
        self, model: Provider, messages: list[Message], room: int | None, answer: Answer
    ) -> str:
        """Ask once; return the answer's text. Raises Failure, or what litellm raises."""
        sieve = Sieve(self.secrets)
        seconds = min(ONE_ANSWER, self.budget.seconds_left)
        try:
            with self.watcher.answering() as show:
                read(
                    lambda: model.stream(messages, seconds, room),
                    seconds,
                    lambda piece: show(sieve.let(piece)),
                    answer,
                )
                show(sieve.rest())
        except Exception:
            self._count(model, answer, messages)
            raise
        text = self._text(answer, self._count(model, answer, messages))
        self._judge(answer, text)
        return text

    def _text(self, answer: Answer, whole: Any) -> str:
        """Return what an answer says, without secrets."""
        return self.secrets.cut(plan_text(answer, whole))

    def _count(self, model: Provider, answer: Answer, messages: list[Message]) -> Any:
        """Count what an answer, whole or not, has cost; return it as litellm puts it together."""
        if not answer.chunks:
            return None
        whole, spent = model.whole(answer.chunks, messages)
        self.budget.answers.append(spent)
        return whole

    def _judge(self, answer: Answer, text: str) -> None:
        """Raise Failure for an answer that is none; say what is odd about one that is."""
        if answer.ended == "content_filter":
            raise Failure("the provider refused the content")
        if answer.ended == "length" and not text:
            raise Failure("its answer came to its length limit before it wrote any plan")
        if not text and (why := why_empty(answer)):
            raise Failure(why)
        if not text:
            raise Failure(f"its answer was empty{self._wrong_address()}", again=True)
        if answer.ended is None:
            raise BrokenOff
        if answer.ended == "length":
            self.watcher.tell("the answer was cut off at its length limit")

    def _wrong_address(self) -> str:
        return "; is the API base right? it mostly ends in /v1" if self.asking.api_base else ""
