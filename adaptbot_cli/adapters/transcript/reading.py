"""Reads transcripts, whole ones and those of runs that were cut off."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import yaml

from adaptbot_cli.adapters.transcript.documents import FORMAT, Document
from adaptbot_cli.errors import UsageError


def _count(value: Any) -> bool:
    return type(value) is int and value >= 0


def _amount(value: Any) -> bool:
    return type(value) in (int, float)


def _names(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(name, str) for name in value)


def _counts(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_count, value.values()))


_FORMS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "policy": ('"tutor" or "paper"', lambda value: value in ("tutor", "paper")),
    "replans": ("a number", _count),
    "requires": ("a list of names", _names),
    "reply": ("a text", lambda value: isinstance(value, str)),
    "calls": ("a number", _count),
    "tokens": ("two numbers, `prompt:` and `completion:`", _counts),
    "cost_usd": ("an amount", _amount),
    "model": ("a name", lambda value: isinstance(value, str)),
    "api_base": ("an address", lambda value: isinstance(value, str)),
    "temperature": ("a number", _amount),
    "seed": ("a whole number", lambda value: type(value) is int),
    "timeout": ("seconds", _amount),
    "max_tokens": ("a number", _count),
    "max_cost": ("an amount", _amount),
}
"""What some keys hold, wherever they stand."""


def read(path: Path) -> tuple[Document, list[Document]]:
    """Return a transcript's header and turns.

    Raises:
        UsageError: the file cannot be read, or is no transcript; the message says where.
    """
    try:
        text = path.read_text(encoding="utf-8")
        documents = [document for document in yaml.safe_load_all(text) if document is not None]
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} is no transcript: {error}") from error
    return _checked(path, documents)


def _checked(path: Path, documents: list[Any]) -> tuple[Document, list[Document]]:
    if not documents or not all(isinstance(document, dict) for document in documents):
        raise UsageError(f"{path} is no transcript: it holds no YAML documents with keys")
    header, *turns = documents
    if header.get("adaptbot") != FORMAT:
        raise UsageError(f"{path} is no transcript: its first document lacks `adaptbot: {FORMAT}`")
    for number, turn in enumerate(turns, start=1):
        if not isinstance(turn.get("turn"), str):
            raise UsageError(f"{path}: document {number + 1} lacks `turn:`")
    for number, document in enumerate(documents, start=1):
        for key in document.keys() & _FORMS:
            form, fits = _FORMS[key]
            if not fits(document[key]):
                raise UsageError(f"{path}: document {number}: `{key}:` must be {form}")
    return header, turns


def read_cut(path: Path) -> tuple[Document, list[Document]]:
    """Return the header and the turns of a run that was cut off, however it was.

    A last document that is not whole is left out.

    Raises:
        UsageError: the file cannot be read, or is no transcript.
    """
    try:
        text = path.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    documents: list[Any] = []
    parts = text.split("\n---\n")
    for number, part in enumerate(parts, start=1):
        try:
            documents += [d for d in yaml.safe_load_all(part) if d is not None]
        except yaml.YAMLError as error:
            if number < len(parts):
                raise UsageError(f"{path} is no transcript: {error}") from error
    last = documents[-1] if len(documents) > 1 else {}
    # A plan may have lost lines and still be read; a whole one is followed by its check.
    kind = last.get("turn") if isinstance(last, dict) else None
    if last and (kind in (None, "propose") or not text.endswith("\n")):
        documents.pop()
    return _checked(path, documents)


def unfinished(folder: Path) -> list[Path]:
    """Return the transcripts of a folder whose runs have not ended, newest first.

    A run that another one has gone on with is not among them.
    """
    found: list[Path] = []
    gone_on: set[str] = set()
    for path in sorted(folder.glob("*.yaml"), reverse=True):
        try:
            text = path.read_text(encoding="utf-8", errors="replace")
        except OSError:
            continue
        gone_on |= set(_RESUMES.findall(text.split("\n---\n")[0]))
        if path.stem not in gone_on and not has_ended(text):
            found.append(path)
    return found


def has_ended(text: str) -> bool:
    """Tell whether a transcript's text tells the end of its run."""
    return text.rpartition("\n---\n")[2].startswith("turn: finished")


_RESUMES = re.compile(r"^resumes: ['\"]?(.+?)['\"]?$", re.MULTILINE)
