"""litellm, imported late and kept quiet: one place for all that is asked of it."""

import json
import logging
import os
import re
import threading
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any
from urllib.request import getproxies

import httpx

from adaptbot_cli.adapters.planner.budget import Asking, Price
from adaptbot_cli.adapters.planner.forms import PlanForm
from adaptbot_cli.adapters.planner.servers import LOOPBACK, is_here, served
from adaptbot_cli.adapters.planner.streamed import PartialAnswer, TooLong
from adaptbot_cli.bounded import parse_json
from adaptbot_cli.core.usage import Usage
from adaptbot_cli.errors import ModelError

_LOGGERS = ("LiteLLM", "LiteLLM Router", "LiteLLM Proxy", "openai", "httpx", "httpcore")
_FREE = ("ollama/", "ollama_chat/")
_HANDLED = ("anthropic/", "gemini/", "ollama/", "ollama_chat/")
"""Whom litellm reaches with a client that is given to it. It has one for all that speak OpenAI's
protocol; what is left sends its key in a header that httpx takes away at a redirect."""

_MOST_BYTES = 16_000_000
"""An answer of `LONGEST` characters, each in an event of its own, has fewer."""

_REFUSAL = re.compile(rb'"refusal":(?=\s*"[^"])')

_NO_KEY = "none"
"""What is sent to a server of one's own where no key is set: the OpenAI client insists on one."""


def load() -> Any:
    """Import litellm: with its bundled price list, so that no network is needed, and its logging
    off, which could show a request with its key. Raises ModelError."""
    os.environ.setdefault("LITELLM_LOCAL_MODEL_COST_MAP", "True")
    os.environ.setdefault("LITELLM_MODE", "PRODUCTION")  # else some releases read a .env file
    os.environ.pop("LITELLM_LOG", None)
    os.environ.pop("OPENAI_LOG", None)
    _straight_to_this_machine()
    try:
        import litellm
    except ImportError as error:
        raise ModelError(f"litellm cannot be imported ({error}); see `adaptbot doctor`") from None

    litellm.suppress_debug_info = True
    litellm.telemetry = False
    litellm.turn_off_message_logging = True
    litellm.disable_hf_tokenizer_download = True
    for name in _LOGGERS:
        logging.getLogger(name).disabled = True
    litellm.client_session = _handler(tuple(sorted(getproxies().items()))).client
    return litellm


@lru_cache(maxsize=1)
def _handler(_proxies: tuple[tuple[str, str], ...]) -> Any:
    """litellm's own HTTP client, made to follow no redirect, which could carry a key elsewhere, and
    to read no endless answer."""
    from litellm.llms.custom_httpx.http_handler import HTTPHandler

    handler = HTTPHandler()
    handler.client.follow_redirects = False
    handler.client.event_hooks["response"] = [_bound]
    return handler


def _bound(response: Any) -> None:
    headers, stream = response.headers, response.stream
    if headers.get("content-encoding", "").strip().lower() in ("gzip", "deflate"):
        del headers["content-encoding"]
        stream = _Stream(stream, _unpacked)
    streamed = re.search(rb'"stream":\s*true', getattr(response.request, "_content", b""))
    plain = headers.get("content-type", "").startswith("application/json")
    if streamed and plain and response.status_code == 200 and "content-encoding" not in headers:
        headers["content-type"] = "text/event-stream"
        response.stream = _Stream(stream, _as_event)
    else:
        response.stream = _Stream(stream, _by_line)


class _Stream(httpx.SyncByteStream):
    """The bytes of an answer as `read` makes them of what comes."""

    def __init__(self, stream: Any, read: Callable[[Any], Iterator[bytes]]) -> None:
        self._stream, self._read = stream, read

    def __iter__(self) -> Iterator[bytes]:
        return self._read(self._stream)

    def close(self) -> None:
        """Close the connection."""
        self._stream.close()


def _unpacked(stream: Iterable[bytes]) -> Iterator[bytes]:
    """Unpack an answer a little at a time: the limit is on the unpacked text."""
    packed = zlib.decompressobj(wbits=47)
    for piece in stream:
        left = piece
        while left:
            yield packed.decompress(left, 1 << 16)
            left = packed.unconsumed_tail
    yield packed.flush()


def _by_line(stream: Iterable[bytes]) -> Iterator[bytes]:
    """Read an answer line by line, up to a limit; a refusal becomes its content, for litellm passes
    it over in a stream."""
    left, begun = _MOST_BYTES, list[bytes]()
    for piece in stream:
        left -= len(piece)
        if left < 0:
            raise TooLong
        lines, end, rest = piece.rpartition(b"\n")
        if end:
            yield _REFUSAL.sub(b'"content":', b"".join((*begun, lines, end)))
            begun = []
        begun.append(rest)
    yield _REFUSAL.sub(b'"content":', b"".join(begun))


def _as_event(stream: Iterable[bytes]) -> Iterator[bytes]:
    """Make one event of an answer that came whole, although a stream was asked for."""
    whole = b"".join(_by_line(stream))
    try:
        reply = parse_json(whole, "an answer", ModelError)
        for choice in reply["choices"]:
            message = choice["delta"] = choice.pop("message")
            for index, call in enumerate(message.get("tool_calls") or ()):
                call["index"] = index
    except (ModelError, LookupError, TypeError, AttributeError):
        yield whole
        return
    reply["object"] = "chat.completion.chunk"
    yield b"data: " + json.dumps(reply).encode() + b"\n\ndata: [DONE]\n\n"


def load_early() -> None:
    """Begin to import litellm, which takes seconds, beside whatever comes next."""

    def quietly() -> None:
        with suppress(Exception):  # raised again where the model is called, which imports it anew
            load()

    threading.Thread(target=quietly, daemon=True).start()


def _straight_to_this_machine() -> None:
    """Keep requests to this machine from any proxy that the environment names."""
    text = os.environ.get("no_proxy") or os.environ.get("NO_PROXY") or ""
    names = [name.strip() for name in text.split(",") if name.strip()]
    names += [host for host in LOOPBACK if host not in names]
    os.environ["no_proxy"] = os.environ["NO_PROXY"] = ",".join(names)


def _reported(usage: Any, name: str) -> int:
    """Return a count of tokens that a server reports, 0 for none and for what is no count."""
    count = getattr(usage, name, None)
    return max(count, 0) if isinstance(count, int) else 0


def _plausible(reported: int, counted: int) -> int:
    """Return what a server reports, unless it is so much less than is counted here that no
    tokenizer explains it."""
    return reported if 4 * reported >= counted else counted


@dataclass(frozen=True, slots=True)
class Provider:
    """A model as litellm reaches it; with a `form` its answers are held to that, if it can."""

    litellm: Any
    model: str
    asking: Asking
    form: PlanForm | None = None

    def missing_keys(self) -> list[str]:
        """The environment variables with a key that the model needs and that are not set."""
        if self.asking.api_base:
            return []
        needed = self.litellm.validate_environment(self.model)["missing_keys"]
        return [name for name in needed if "KEY" in name or "TOKEN" in name]

    def stream(self, messages: list[dict[str, str]], seconds: float, room: int | None) -> Any:
        """Ask, and return litellm's stream. Its own retries are off: they would be neither
        reported nor counted, and cover no stream that breaks."""
        most = min(filter(None, (room, self.asking.most_tokens)), default=None)
        own: dict[str, Any] = {"api_base": self.asking.api_base} if self.asking.api_base else {}
        keyless = self.model.startswith("openai/") and not os.environ.get("OPENAI_API_KEY")
        if self.asking.api_key or (own and keyless):
            own["api_key"] = self.asking.api_key or _NO_KEY
        if self.model.startswith(_HANDLED):
            own["client"] = _handler(tuple(sorted(getproxies().items())))
        return self.litellm.completion(
            model=self.model,
            messages=messages,
            temperature=self.asking.temperature,
            seed=self.asking.seed,
            stream=True,
            stream_options={"include_usage": True},
            timeout=seconds,
            max_retries=0,
            num_retries=0,
            drop_params=True,
            **({} if most is None else {"max_tokens": most}),
            **self._held(),
            **own,
        )

    def _held(self) -> Mapping[str, Any]:
        """What holds an answer to its form: a grammar for llama.cpp, else a JSON schema."""
        if self.form is None:
            return {}
        if self.asking.grammar and self.form.json:
            return {"response_format": {"type": "json_object", "schema": self.form.schema}}
        if self.asking.grammar:
            return {"extra_body": {"grammar": self.form.grammar}}
        schema = {"name": "plan", "schema": self.form.schema, "strict": True}
        return {"response_format": {"type": "json_schema", "json_schema": schema}}

    def spent(self, answer: PartialAnswer, messages: list[dict[str, str]]) -> Usage:
        """Return what an answer has cost: as reported in its chunks, and counted here where the
        report is missing or impossible."""
        try:
            whole = self.litellm.stream_chunk_builder(answer.chunks, messages=messages)
        except Exception:  # chunks of a form that litellm streams but cannot put together
            whole = None
        usage = getattr(whole, "usage", None)
        prompt = _plausible(_reported(usage, "prompt_tokens"), self.tokens(messages))
        text = "".join(answer.text)
        written = int(self.litellm.token_counter(model=self.model, text=text))
        completion = _plausible(_reported(usage, "completion_tokens"), written)
        return Usage(1, prompt, completion, self._cost(whole, prompt, completion))

    def _cost(self, whole: Any, prompt: int, completion: int) -> float | None:
        """What an answer cost in US dollars, as litellm has it, which knows of cached prompts; not
        less than a tenth of the price of its tokens, whatever the server reports."""
        price = self.price()
        if self._is_free or price is None:
            return 0.0 if self._is_free else None
        full = price.of(prompt, completion)
        try:
            amount = float(self.litellm.completion_cost(whole, model=self.model))
        except Exception:  # litellm raises a bare one for what it cannot work out
            amount = full
        return round(amount if amount >= full / 10 else full, 8)

    @property
    def _is_free(self) -> bool:
        return self.model.startswith(_FREE) or is_here(self.asking.api_base or "")

    def tokens(self, messages: list[dict[str, str]]) -> int:
        """Count the tokens of a prompt."""
        return int(self.litellm.token_counter(model=self.model, messages=messages))

    def price(self) -> Price | None:
        """What a token costs: nothing on this machine; None if nobody knows."""
        if self._is_free:
            return Price()
        try:
            reply = self.litellm.get_model_info(self.model)
            return Price(
                float(reply["input_cost_per_token"]), float(reply["output_cost_per_token"])
            )
        except Exception:  # litellm raises a bare one for a model that it does not know
            return None

    def names(self) -> Iterable[str]:
        """The names of the models that could be meant: the server's, or those litellm knows."""
        if self.asking.api_base:
            return [f"openai/{name}" for name in served(self.asking.api_base)]
        known: Mapping[str, Mapping[str, Any]] = self.litellm.model_cost
        return [name for name, record in known.items() if record.get("mode") == "chat"]
