"""The child process of `local.py`: llama.cpp's server for one GGUF file, on an open socket.

Run as `python -m …serving FILE FD`. It ends with its standard input, so with whoever started it;
with the code 3 if the file cannot be loaded.
"""

import os
import signal
import socket
import sys
import threading

import uvicorn
from llama_cpp.server.app import create_app
from llama_cpp.server.settings import ModelSettings, ServerSettings

from adaptbot_cli.adapters.planner.local import CONTEXT, KEY

_FEW = 4
"""Up to so many cores all are used; of more, half: they are mostly threads of the same core."""


def main(file: str, descriptor: int) -> None:
    """Load the model and answer until nobody needs it."""
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cores = os.cpu_count() or 1
    threads = cores if cores <= _FEW else cores // 2
    settings = ModelSettings(
        model=file,
        n_ctx=CONTEXT,
        n_threads=threads,
        n_threads_batch=threads,
        logits_all=False,
        seed=0,
        verbose=False,
    )
    server = ServerSettings(api_key=os.environ.pop(KEY))
    try:
        app = create_app(server_settings=server, model_settings=[settings])
    except (ValueError, OSError, MemoryError):
        sys.exit(3)
    config = uvicorn.Config(app, log_level="critical", access_log=False)
    uvicorn.Server(config).run(sockets=[socket.socket(fileno=descriptor)])


def _end_with_stdin() -> None:
    sys.stdin.buffer.read()
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
