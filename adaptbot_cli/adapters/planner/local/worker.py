"""The process that runs the model on board: `python -m …local.worker FILE CONTEXT`.

It reads one JSON request a line and writes JSON answers, one a line, a token's text at a time. It
is a process of its own because llama.cpp ends the whole process where memory or an instruction of
the processor is lacking, and because Ctrl-C must stop it at once, also in the middle of a prompt.
"""

import contextlib
import json
import os
import signal
import sys
from collections.abc import Iterator
from typing import Any, TextIO

from llama_cpp import Llama, LlamaGrammar
from llama_cpp.llama_chat_format import Jinja2ChatFormatter

_SAME = 3
"""How often a plan may say the same."""
_TEMPLATE = "tokenizer.chat_template"


def main(path: str, context: str) -> None:
    """Load the model, say so, and answer until there are no more requests."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    answers = _own_stdout()
    try:
        model = Llama(
            path,
            n_ctx=int(context),
            n_threads=_threads(),
            n_threads_batch=_threads(),
            seed=0,
            verbose=False,
        )
    except (ValueError, OSError, MemoryError):
        _write(answers, {"failed": "load"})
        return
    _write(answers, {"ready": True})
    for line in sys.stdin:
        for answer in _answer(model, json.loads(line)):
            _write(answers, answer)


def _answer(model: Llama, request: dict[str, Any]) -> Iterator[dict[str, Any]]:
    prompt = _tokens(model, request["messages"])
    room = model.n_ctx() - len(prompt)
    if room < request["room"]:
        yield {"failed": "context", "prompt": len(prompt), "context": model.n_ctx()}
        return
    parts = model.create_completion(
        prompt,
        max_tokens=min(room, request["tokens"]),
        temperature=request["temperature"],
        grammar=LlamaGrammar.from_string(request["grammar"], verbose=False),
        stream=True,
    )
    written, finish, text = 0, None, ""
    for part in parts:
        choice = part["choices"][0]
        written, finish = written + 1, choice["finish_reason"]
        if choice["text"]:
            text += choice["text"]
            yield {"text": choice["text"]}
        if _circles(text):
            break
    yield {"finished": finish or "stop", "prompt": len(prompt), "completion": written}


def _circles(text: str) -> bool:
    """Tell whether a plan has ended in saying the same again and again, as small models do."""
    lines = text.splitlines()
    return text.endswith("\n") and lines.count(lines[-1]) > _SAME


def _tokens(model: Llama, messages: list[dict[str, str]]) -> list[int]:
    """The prompt in the model's own chat format; plain text for a model that has none."""
    template = model.metadata.get(_TEMPLATE)
    if not template:
        text = "\n\n".join(message["content"] for message in messages) + "\n\n"
        return list(model.tokenize(text.encode(), special=False))
    marks = [
        model.detokenize([token], special=True).decode(errors="replace") if token >= 0 else ""
        for token in (model.token_eos(), model.token_bos())
    ]
    formatter = Jinja2ChatFormatter(template, eos_token=marks[0], bos_token=marks[1])
    text = formatter(messages=messages).prompt
    return list(model.tokenize(text.encode(), add_bos=False, special=True))


def _threads() -> int:
    """Half of the cores: threads that wait for each other on a busy machine stand still."""
    return max(1, (os.cpu_count() or 1) // 2)


def _own_stdout() -> TextIO:
    """Keep the pipe to the parent; what llama.cpp prints goes nowhere."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    return answers


def _write(answers: TextIO, answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer) + "\n")
    answers.flush()


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):  # the parent is gone
        main(*sys.argv[1:])
