"""Reads transcripts: whole ones, those of runs that were cut off, and what these left open."""

import re
from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.adapters.transcript.documents import FORMAT, Document, answer_of, key_of
from adaptbot_cli.adapters.transcript.memory import Memory
from adaptbot_cli.core.ask.questions import LATER, STOP, UNKNOWN, YES, Key
from adaptbot_cli.core.names import normal
from adaptbot_cli.errors import UsageError
from adaptbot_cli.resources import root_of


def _is_count(value: Any) -> bool:
    return type(value) is int and value >= 0


def _is_amount(value: Any) -> bool:
    return type(value) in (int, float) and 0 <= value < float("inf")


def _is_text(value: Any, longest: int = 200_000) -> bool:
    return isinstance(value, str) and len(value) <= longest


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and len(value) <= 100 and all(_is_text(v, 1_000) for v in value)


_COUNT, _AMOUNT = ("a number", _is_count), ("an amount", _is_amount)
_FORMS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "policy": ('"tutor" or "paper"', lambda value: value in ("tutor", "paper")),
    "replans": _COUNT,
    "requires": ("a list of names", _are_names),
    "task": ("a text of at most 1,000 characters", lambda value: len(str(value)) <= 1_000),
    "reply": ("a text of at most 200,000 characters", _is_text),
    "calls": _COUNT,
    "tokens": (
        "two numbers, `prompt:` and `completion:`",
        lambda value: isinstance(value, dict) and all(map(_is_count, value.values())),
    ),
    "cost_usd": _AMOUNT,
    "model": ("a name", _is_text),
    "api_base": ("an address", _is_text),
    "temperature": _AMOUNT,
    "seed": ("a whole number", lambda value: type(value) is int),
    "timeout": ("seconds", _is_amount),
    "max_tokens": _COUNT,
    "max_cost": _AMOUNT,
}
"""What some keys hold, wherever they stand."""


def read(path: Path) -> tuple[Document, list[Document]]:
    """Return a transcript's header and turns.

    Raises:
        UsageError: the file cannot be read, or is no transcript; the message says where.
    """
    data = bounded.read_bytes(path, bounded.YAML, UsageError, root=root_of(path))
    name = f"{path} is no transcript: it"
    return _checked(path, bounded.parse_yaml(bounded.decode(data, name, UsageError), name))


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
    return _parse_cut(path, text_of(path))


def header_of(path: Path) -> Document:
    """Return a transcript's header; its turns are not looked at. Raises UsageError."""
    return _parse_cut(path, _header_in(text_of(path)))[0]


def _header_in(text: str) -> str:
    head, _, rest = text.partition("\n---\n")
    return f"{head}\n" if rest else head


def _parse_cut(path: Path, text: str) -> tuple[Document, list[Document]]:
    documents: list[Any] = []
    parts = text.split("\n---\n")
    for number, part in enumerate(parts, start=1):
        try:
            documents += bounded.parse_yaml(part, f"{path} is no transcript: it")
        except UsageError:
            if number < len(parts):
                raise
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
    for path, text in _texts(folder):
        if path.stem not in gone_on and not has_end(text):
            if not any(_parsed(path, text)):  # what else lies in the folder is no run
                continue
            found.append(path)
        gone_on |= set(_RESUMES.findall(_header_in(text)))
    return found


def glanced(path: Path) -> tuple[Document, Document]:
    """Return a transcript's header and its last document, empty if its run has not ended.

    What lies between is not looked at. Raises UsageError: it is no transcript.
    """
    text = text_of(path)
    header = _parse_cut(path, _header_in(text))[0]
    end = text.rpartition("\n---\n")[2] if has_end(text) else ""
    last = next(iter(bounded.parse_yaml(end, f"{path} is no transcript: it")), None)
    return header, last if isinstance(last, dict) else {}


def has_end(text: str) -> bool:
    """Return whether a transcript has the end of its run."""
    return text.rpartition("\n---\n")[2].startswith("turn: finished")


def text_of(path: Path) -> str:
    """Return a transcript's text; one of a workspace is reached through no link.

    Raises:
        UsageError: it cannot be read.
    """
    data = bounded.read_bytes(path, bounded.YAML, UsageError, root=root_of(path))
    return data.decode("utf-8", "replace")


_RESUMES = re.compile(r"^resumes: ['\"]?(.+?)['\"]?$", re.MULTILINE)
_PUTS_OFF = re.compile(rf"answer['\"]?\s*:\s*['\"]?(?:{LATER.value}|{STOP.value})")


@dataclass(frozen=True, slots=True)
class LeftOver:
    """A run that has left questions open: what it was to do, and the last plan that it had.

    `unknown` are the questions that the person could not answer; `plans` the last plans by task,
    where the request was for several; `confirmed` whether the person has confirmed its reading.
    """

    path: Path
    task: str
    domain: str
    requires: tuple[str, ...]
    plan: str
    unknown: Set[Key]
    without: tuple[str, ...] = ()
    plans: Mapping[str, str] = field(default_factory=dict)
    confirmed: bool = False


def left_over(folder: Path, sittings: Path) -> list[LeftOver]:
    """Return the runs of a folder that have left questions open, newest first.

    A question that nobody could answer in one of the `sittings` since then counts as unanswered.

    Of the runs of one task only the newest counts. Which questions are still open depends on the
    graph as it is now.
    """
    found: list[LeftOver] = []
    seen: set[object] = set()
    later = [
        (path.stem, frozenset(_unknown(turns)))
        for path, text in _texts(sittings)
        if UNKNOWN in text
        for _, turns in _parsed(path, text)
    ]
    for path, text in _texts(folder):
        ended = has_end(text)
        # Of what has ended and put nothing off the header alone is read.
        whole = not ended or _PUTS_OFF.search(text)
        for header, turns in _parsed(path, text if whole else _header_in(text)):
            since = {key for stem, keys in later if stem > path.stem for key in keys}
            run = _left_over(path, header, turns, since)
            requires = tuple(sorted(map(normal, run.requires)))
            key = (normal(run.task), run.domain, requires, run.without)
            if key not in seen and run.plan and (not ended or any(map(_put_off, turns))):
                found.append(run)
            seen.add(key)
    return found


def _texts(folder: Path) -> Iterator[tuple[Path, str]]:
    """The transcripts of a folder, newest first; whatever else lies there is none."""
    for path in sorted(folder.glob("*.yaml"), reverse=True):
        with suppress(UsageError):
            yield path, text_of(path)


def _parsed(path: Path, text: str) -> Iterator[tuple[Document, list[Document]]]:
    with suppress(UsageError):
        yield _parse_cut(path, text)


def _left_over(path: Path, header: Document, turns: list[Document], since: set[Key]) -> LeftOver:
    memory = Memory()
    memory.take(turns)
    return LeftOver(
        path,
        str(header.get("task", "")),
        str(header.get("domain", "")),
        tuple(header.get("requires") or ()),
        memory.plan,
        since | {*_unknown(turns)},
        tuple(header.get("without") or ()),
        memory.plans,
        any(key[0] == "reading" and a.value == YES for key, a in memory.answers.items()),
    )


def _unknown(turns: list[Document]) -> Iterator[Key]:
    for turn in turns:
        key = key_of(turn)
        if turn["turn"] == "ask" and key is not None and answer_of(turn).value == UNKNOWN:
            yield key


def _put_off(turn: Document) -> bool:
    """Whether a question was put off that knowledge answers, not one about the plan alone."""
    asked = turn["turn"] == "ask" and turn.get("kind") not in ("mend", "reading", "goal")
    return asked and turn.get("answer") in (LATER.value, STOP.value)
