"""What goes wrong with a model, in sentences of ours, and whether it is worth another try.

A provider's own words may echo a key, so they are only quoted where they help (a wrong request),
and never without what looks like a secret cut out (`scrub`).
"""

import difflib
import email.utils
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from urllib.request import getproxies

from adaptbot_cli.adapters.planner.scrub import Secrets
from adaptbot_cli.adapters.planner.servers import is_here
from adaptbot_cli.adapters.planner.streamed import LONGEST, TooLong, TooSlow
from adaptbot_cli.core.names import sentence_list

WITHOUT_MODEL = "`--model library` plans without a model."
_NETWORK = ("ConnectError", "ConnectTimeout", "ReadError", "RemoteProtocolError", "WriteError",
            "ProxyError", "ReadTimeout", "ConnectionError")  # fmt: skip
_NO_HOST = ("name or service not known", "nodename nor servname", "getaddrinfo",
            "temporary failure in name resolution", "no address associated")  # fmt: skip
_USED_UP = ("insufficient_quota", "exceeded your current quota")
_NO_CREDIT = "the account has no credit"


@dataclass(eq=False)
class Failure(Exception):
    """Why an answer failed; `again`: another try may help, after `wait` seconds if they are known;
    `slow`: it took too long; `refused`: the request itself was wrong."""

    why: str
    again: bool = False
    wait: float | None = None
    slow: bool = False
    refused: bool = False


class BrokenOff(Failure):
    """The answer began and ended without saying that it was whole: by a clean end, a lost
    connection or an error in the stream. Which of these it was, litellm reports differently from
    release to release, and it makes no difference to what can be done."""

    def __init__(self) -> None:
        super().__init__("its answer broke off", again=True)


@dataclass(frozen=True, slots=True)
class Called:
    """Which model was called: its name, its address if known, and what must not be shown."""

    model: str
    address: str | None
    secrets: Secrets

    def sentence(self, why: str) -> str:
        """Say that there is no plan, and why."""
        return f"The model {self.model} gave no plan: {why}. {WITHOUT_MODEL}"

    @property
    def place(self) -> str:
        """Where the model is, as it may be shown."""
        return self.secrets.detail(self.address) if self.address else "its provider"


def failure(
    error: BaseException, called: Called, known: Callable[[], Iterable[str]], begun: bool = False
) -> Failure:
    """Return what an error of litellm's or of the reading means; `known` returns models' names,
    `begun` whether a part of the answer had arrived before it."""
    if isinstance(error, Failure):
        return error
    kind, causes = type(error).__name__, list(_causes(error))
    if isinstance(error, TooSlow):
        return Failure("it took too long", again=True, slow=True)
    if any(type(cause).__name__ == "JSONDecodeError" for cause in causes):
        return Failure(f"{called.place} does not speak the OpenAI protocol: it sent broken JSON")
    status = getattr(error, "status_code", None)
    if isinstance(status, int) and 300 <= status < 400:
        return Failure(f"{called.place} sends one elsewhere ({status}), which is not followed")
    if any(isinstance(cause, TooLong) for cause in causes):
        return Failure(f"its answer is longer than {LONGEST:,} characters, which no plan is")
    if kind == "NotFoundError" or _no_provider(error):
        return Failure(_wrong_name(error, called, known()))
    text = _REFUSALS.get(kind) or _STATUSES.get(status or 0)
    if text is not None:
        return Failure(text.format(detail=_quoted(error, called)), refused=kind in _ABOUT_THE_FORM)
    if kind == "RateLimitError":
        if any(text in str(error) for text in _USED_UP):
            return Failure(f"{_NO_CREDIT} or quota left; see the provider's billing page")
        return Failure("it is limiting requests (429)", True, _retry_after(error))
    failed = isinstance(status, int) and status >= 500
    if begun and (failed or _is_network(error, causes)):
        return BrokenOff()
    if _is_network(error, causes):
        return _unreachable(causes, called)
    if failed:
        shown = "" if kind == "APIConnectionError" else f" ({status})"
        return Failure(f"{called.place} failed{shown}", True, _retry_after(error))
    if kind == "Timeout":
        return Failure("it took too long", again=True, slow=True)
    return Failure(f"the call failed ({kind}){_quoted(error, called)}")


_REFUSALS = {
    "AuthenticationError": "the provider refused the key; set the right one in its variable",
    "PermissionDeniedError": "this key may not use the model",
    "ContextWindowExceededError": "the prompt is too long for its context{detail}",
    "ContentPolicyViolationError": "the provider refused the content",
    "BadRequestError": "the request was refused{detail}",
    "UnprocessableEntityError": "the request was refused{detail}",
    "UnsupportedParamsError": "it does not take a parameter{detail}",
}

_ABOUT_THE_FORM = ("BadRequestError", "UnprocessableEntityError", "UnsupportedParamsError")
"""Errors that a schema or a grammar may be the cause of, where one was sent."""

_STATUSES = {
    401: _REFUSALS["AuthenticationError"],
    402: f"{_NO_CREDIT} left; see the provider's billing page",
    403: _REFUSALS["PermissionDeniedError"],
}


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """The error and what it came from."""
    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = getattr(error, "original_exception", None) or error.__cause__ or error.__context__


def _no_provider(error: BaseException) -> bool:
    return "LLM Provider NOT provided" in str(error)


def _wrong_name(error: BaseException, called: Called, known: Iterable[str]) -> str:
    names = list(known)
    bare = called.model.rpartition("/")[2]
    near = difflib.get_close_matches(called.model, names, 3, 0.6)
    near += [name for name in difflib.get_close_matches(bare, names, 3, 0.6) if name not in near]
    meant = f"; did you mean {sentence_list(near[:3], 3)}?" if near else ""
    if _no_provider(error):
        form = "a model is named with its provider, such as ollama/llama3.2 or gpt-4o"
        return f"no provider is known for this name{meant or ': ' + form}".rstrip("?")
    served = f"; it has {sentence_list(names, 4)}" if not near and 0 < len(names) < 30 else ""
    return f"{called.place} has no model of this name{meant or served}".rstrip("?")


def _quoted(error: BaseException, called: Called) -> str:
    """The provider's own words, scrubbed, in brackets."""
    body = getattr(error, "body", None)
    reply = body.get("message") if isinstance(body, dict) else None
    words = str(reply or getattr(error, "message", "") or "")
    words = words.rpartition("Exception - ")[2]
    return f' ("{called.secrets.detail(words)}")' if words else ""


def _retry_after(error: BaseException) -> float | None:
    """How many seconds the provider asks to wait: given as such, or as a date."""
    response = getattr(error, "response", None)
    for headers in (getattr(error, "litellm_response_headers", None),
                    getattr(response, "headers", None)):  # fmt: skip
        text = str((headers or {}).get("retry-after") or "").strip()
        when = email.utils.parsedate_tz(text) if text else None
        if when is not None:
            return max(email.utils.mktime_tz(when) - time.time(), 0.0)
        if text.replace(".", "", 1).isdecimal():
            return float(text)
    return None


def _is_network(error: BaseException, causes: list[BaseException]) -> bool:
    found = any(type(cause).__name__ in _NETWORK for cause in causes)
    return found or "Connection error" in str(error)


def _unreachable(causes: Iterable[BaseException], called: Called) -> Failure:
    """What a lost connection means; another try is in vain where nobody is there."""
    wording = " ".join(str(cause).lower() for cause in causes)
    if "connection refused" in wording and is_here(called.address or ""):
        return Failure(
            f"nothing listens at {called.place}; start the server, or correct --api-base"
        )
    if "connection refused" in wording:
        or_proxy = ", or the proxy that HTTP_PROXY or HTTPS_PROXY names" if getproxies() else ""
        return Failure(f"{called.place}{or_proxy} refused the connection")
    if any(text in wording for text in _NO_HOST):
        return Failure(f"no network, or no such host: {called.place} cannot be found")
    return Failure(f"the connection to {called.place} was lost", again=True)
