"""A model server on loopback that speaks the OpenAI chat protocol, and misbehaves on demand.

A real HTTP server in threads of this process. It gives its answers in order, the last one again and
again, and keeps what it was asked. `GET /v1/models` and Ollama's `GET /api/tags` list its models.
"""

import gzip
import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

USAGE = {"prompt_tokens": 500, "completion_tokens": 60, "total_tokens": 560}


@dataclass(frozen=True, slots=True)
class Asked:
    """One request: when it came (monotonic seconds), path, headers in lower case, body."""

    at: float
    path: str
    headers: Mapping[str, str]
    body: Mapping[str, Any]


class Handler(BaseHTTPRequestHandler):
    """Gives the server's next answer to each chat request."""

    protocol_version = "HTTP/1.1"
    server: "Loopback"

    def do_GET(self) -> None:
        names = self.server.models
        if self.path == "/api/tags":
            more = self.server.details
            self.give(200, {"models": [{"name": name, **more.get(name, {})} for name in names]})
        elif self.path.endswith("/models"):
            self.give(200, {"object": "list", "data": [{"id": name} for name in names]})
        else:
            self.give(404, {"error": {"message": "there is nothing here"}})

    def do_POST(self) -> None:
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        headers = {key.lower(): value for key, value in self.headers.items()}
        answer = self.server.next(Asked(time.monotonic(), self.path, headers, body))
        try:
            answer(self)
        except OSError:  # the client has gone
            self.server.left.set()
            self.close_connection = True

    def give(self, status: int, value: object, **headers: str) -> None:
        """Answer with JSON, or with text as it is."""
        data = value.encode() if isinstance(value, str) else json.dumps(value).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        for name, told in headers.items():
            self.send_header(name.replace("_", "-"), told)
        self.end_headers()
        self.wfile.write(data)

    def begin(self, **headers: str) -> None:
        """Begin a stream of events."""
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Transfer-Encoding", "chunked")
        for name, told in headers.items():
            self.send_header(name.replace("_", "-"), told)
        self.end_headers()

    def write(self, text: str) -> None:
        """Write a piece of the stream as it is."""
        data = text.encode()
        self.wfile.write(f"{len(data):x}\r\n".encode() + data + b"\r\n")
        self.wfile.flush()

    def event(self, delta: Mapping[str, Any], finish: str | None = None, **more: Any) -> None:
        """Write one event of the stream."""
        choice = {"index": 0, "delta": delta, "finish_reason": finish}
        told = {
            "id": "chatcmpl-1",
            "object": "chat.completion.chunk",
            "created": 1,
            "model": "planner",
            "choices": [choice],
            **more,
        }
        self.write(f"data: {json.dumps(told)}\n\n")

    def end(self) -> None:
        """End the stream as it should end."""
        self.write("data: [DONE]\n\n")
        self.wfile.write(b"0\r\n\r\n")

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


Answer = Callable[[Handler], None]


def says(
    text: str, finish: str = "stop", usage: Mapping[str, int] = USAGE, pause: float = 0
) -> Answer:
    """Stream a text word by word, with so many seconds between the words."""

    def answer(to: Handler) -> None:
        to.begin(x_echo=to.headers.get("Authorization", ""))
        to.event({"role": "assistant", "content": ""})
        for piece in text.splitlines(keepends=True) if len(text) > 10_000 else pieces(text):
            to.event({"content": piece})
            time.sleep(pause)
        to.event({}, finish)
        to.event({}, None, choices=[], usage=usage)
        to.end()

    return answer


def shows(*parts: tuple[str, threading.Event]) -> Answer:
    """Stream a text part by part, each of which waits until the test has seen the one before."""

    def answer(to: Handler) -> None:
        to.begin()
        for part, seen in parts:
            to.event({"content": part})
            seen.wait(60)
        to.event({}, "stop", usage=USAGE)
        to.end()

    return answer


def pieces(text: str) -> list[str]:
    """Cut a text into pieces of seven characters, so that words, calls and keys are split."""
    return [text[start : start + 7] for start in range(0, len(text), 7)]


def refuses(status: int, message: str, code: str = "", **headers: str) -> Answer:
    """Refuse with a status and the provider's words, in which it may echo anything."""

    def answer(to: Handler) -> None:
        error = {"message": message, "type": "error", "code": code or None}
        to.give(status, {"error": error}, **headers)

    return answer


def cut(text: str) -> Answer:
    """Begin to answer, then break the connection."""

    def answer(to: Handler) -> None:
        to.begin()
        for piece in pieces(text):
            to.event({"content": piece})
        to.close_connection = True

    return answer


def ends_early(text: str) -> Answer:
    """Begin to answer, then end as if that were all: no reason, no [DONE], yet a clean end."""

    def answer(to: Handler) -> None:
        to.begin()
        for piece in pieces(text):
            to.event({"content": piece})
        to.wfile.write(b"0\r\n\r\n")

    return answer


def hangs(to: Handler) -> None:
    """Say nothing until the client or the test has gone."""
    to.server.over.wait(600)
    to.close_connection = True


def drips(to: Handler) -> None:
    """Send a byte now and then, never a whole event."""
    to.begin()
    while not to.server.over.wait(0.1):
        to.write(" ")


def drops(to: Handler) -> None:
    """Close the connection without a word."""
    to.close_connection = True


def garbles(to: Handler) -> None:
    """Stream what is no JSON."""
    to.begin()
    to.write('data: {"choices": [{"delta"\n\ndata: oops}\n\n')
    to.end()


def a_page(to: Handler) -> None:
    """Answer with a web page, as a wrong address does."""
    to.give(200, "<html><body>Welcome to nginx!</body></html>")


def streams(*deltas: Mapping[str, Any]) -> Answer:
    """Stream pieces of an answer as they are."""

    def answer(to: Handler) -> None:
        to.begin()
        for delta in deltas:
            to.event(delta)
        to.event({}, "stop")
        to.event({}, None, choices=[], usage=USAGE)
        to.end()

    return answer


def whole(**message: Any) -> Answer:
    """Answer with one completion, although a stream is asked for."""

    def answer(to: Handler) -> None:
        choice = {"index": 0, "message": {"role": "assistant", **message}, "finish_reason": "stop"}
        told = {"id": "1", "object": "chat.completion", "created": 1, "model": "m",
                "choices": [choice], "usage": USAGE}  # fmt: skip
        to.give(200, told)

    return answer


def sse(text: str) -> bytes:
    """The events of an answer, in one piece."""
    choice = {"index": 0, "delta": {"content": text}, "finish_reason": "stop"}
    chunk = {"id": "1", "object": "chat.completion.chunk", "created": 1, "model": "m",
             "choices": [choice]}  # fmt: skip
    return f"data: {json.dumps(chunk)}\n\ndata: [DONE]\n\n".encode()


def packed(data: bytes) -> Answer:
    """Answer with a stream that is packed."""
    body = gzip.compress(data, 1)

    def answer(to: Handler) -> None:
        to.send_response(200)
        for name, told in (("Content-Type", "text/event-stream"), ("Content-Encoding", "gzip"),
                           ("Content-Length", str(len(body)))):  # fmt: skip
            to.send_header(name, told)
        to.end_headers()
        to.wfile.write(body)

    return answer


def calls_tools(*calls: tuple[str, Mapping[str, Any]], index: int | None = None) -> Answer:
    """Answer with tool calls instead of text, their arguments in two pieces.

    With `index`, all calls have the same one, as some servers send them.
    """

    def answer(to: Handler) -> None:
        to.begin()
        for number, (name, arguments) in enumerate(calls):
            at = number if index is None else index
            told = json.dumps(arguments)
            first = {"name": name, "arguments": told[:5]}
            to.event({"tool_calls": [
                {"index": at, "id": f"call_{number}", "type": "function", "function": first}
            ]})  # fmt: skip
            rest = {"arguments": told[5:]}
            to.event({"tool_calls": [{"index": at, "function": rest}]})
        to.event({}, "tool_calls")
        to.event({}, None, choices=[], usage=USAGE)
        to.end()

    return answer


@dataclass(eq=False)
class Loopback(ThreadingHTTPServer):
    """The server. `asked` are its requests; `left` is set when a client has gone too early."""

    answers: Sequence[Answer]
    models: Sequence[str] = ("planner",)
    details: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    asked: list[Asked] = field(default_factory=list)
    left: threading.Event = field(default_factory=threading.Event)
    over: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        self.daemon_threads = True
        super().__init__(("127.0.0.1", 0), Handler)

    @property
    def root(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    @property
    def url(self) -> str:
        """What --api-base takes."""
        return f"{self.root}/v1"

    def environment(self) -> dict[str, str]:
        """How a command reaches it."""
        return {
            "ADAPTBOT_MODEL": "openai/planner",
            "OPENAI_API_BASE": self.url,
            "OPENAI_API_KEY": "none",
        }

    @property
    def prompts(self) -> list[str]:
        """The last message of each request."""
        return [asked.body["messages"][-1]["content"] for asked in self.asked]

    def next(self, asked: Asked) -> Answer:
        """Keep a request and return its answer."""
        self.asked.append(asked)
        return self.answers[min(len(self.asked), len(self.answers)) - 1]


def scripted(*texts: str) -> AbstractContextManager[Loopback]:
    """Serve a model that gives these texts."""
    return serving(*map(says, texts))


@contextmanager
def serving(*answers: Answer, **more: Any) -> Iterator[Loopback]:
    """Serve until the end of the block."""
    with Loopback(answers, **more) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        try:
            yield server
        finally:
            server.over.set()
            server.shutdown()
            thread.join()
