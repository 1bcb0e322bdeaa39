"""A model of the OpenAI kind on this machine: it says given texts, one after the other."""

import json
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass
class ScriptedModel:
    """What the model says, the last text again and again; and the messages that it was sent."""

    texts: Sequence[str]
    prompts: list[str] = field(default_factory=list)
    url: str = ""

    def environment(self) -> dict[str, str]:
        """How a command reaches it."""
        return {
            "ADAPTBOT_MODEL": "openai/scripted",
            "OPENAI_API_BASE": self.url,
            "OPENAI_API_KEY": "none",
        }


@contextmanager
def scripted_model(*texts: str) -> Iterator[ScriptedModel]:
    """Serve a scripted model on a free port of this machine."""
    model = ScriptedModel(texts)

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            length = int(self.headers["Content-Length"])
            asked: Any = json.loads(self.rfile.read(length))
            model.prompts.append(asked["messages"][-1]["content"])
            text = model.texts[min(len(model.prompts), len(model.texts)) - 1]
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream")
            self.end_headers()
            for choice in ({"delta": {"content": text}}, {"delta": {}, "finish_reason": "stop"}):
                chunk = {
                    "id": "1",
                    "object": "chat.completion.chunk",
                    "created": 1,
                    "model": "scripted",
                    "choices": [{"index": 0, **choice}],
                }
                self.wfile.write(f"data: {json.dumps(chunk)}\n\n".encode())
            self.wfile.write(b"data: [DONE]\n\n")

        def log_message(self, format: str, *args: Any) -> None:
            """Say nothing: the tests' output is their own."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    model.url = f"http://127.0.0.1:{server.server_port}/v1"
    try:
        yield model
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
