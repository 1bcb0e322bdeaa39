"""Finds the runs that have left questions open, and the plans that wait for the answers."""

import re
from collections.abc import Iterator, Mapping, Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from adaptbot_cli.adapters.transcript.documents import Document, answer_text, key_of
from adaptbot_cli.adapters.transcript.memory import Memory
from adaptbot_cli.adapters.transcript.reading import has_end, header_in, parse_cut, text_of
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.questions import LATER, STOP, UNKNOWN, YES, Key
from adaptbot_cli.errors import UsageError

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

    What nobody could say in one of the `sittings` since then, nobody could say of them either.

    Of the runs of one task only the newest counts. What is still open of them is for the graph to
    say, as it is now.
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
        for header, turns in _parsed(path, text if whole else header_in(text)):
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
        yield parse_cut(path, text)


def _left_over(path: Path, header: Document, turns: list[Document], since: set[Key]) -> LeftOver:
    memory = Memory()
    memory.take(turns)
    requires = tuple(header.get("requires") or ())
    task, domain = str(header.get("task", "")), str(header.get("domain", ""))
    without = tuple(header.get("without") or ())
    unknown = since | {*_unknown(turns)}
    sure = any(key[0] == "reading" and a.value == YES for key, a in memory.answers.items())
    return LeftOver(path, task, domain, requires, memory.plan, unknown, without, memory.plans, sure)


def _unknown(turns: list[Document]) -> Iterator[Key]:
    for turn in turns:
        key = key_of(turn)
        if turn["turn"] == "ask" and key is not None and answer_text(turn.get("answer")) == UNKNOWN:
            yield key


def _put_off(turn: Document) -> bool:
    """Whether a question was put off that knowledge answers, not one about the plan alone."""
    asked = turn["turn"] == "ask" and turn.get("kind") not in ("mend", "reading", "goal")
    return asked and turn.get("answer") in (LATER.value, STOP.value)
