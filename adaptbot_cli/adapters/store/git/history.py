"""Commits as people read them."""

import re
from dataclasses import dataclass
from datetime import datetime
from typing import Final

_TRAILER: Final = re.compile(r"([A-Za-z0-9][A-Za-z0-9-]*):(?:[ \t]+(.*))?")


@dataclass(frozen=True, slots=True)
class Commit:
    """A commit; `body` is what stands between the subject and the trailers, `when` is aware."""

    sha: str
    author: str
    when: datetime
    subject: str
    body: str
    trailers: tuple[tuple[str, str], ...]
    parents: tuple[str, ...] = ()


def commit_from(
    sha: str, author: str, when: datetime, message: str, parents: tuple[str, ...] = ()
) -> Commit:
    """Take a message apart as git does: subject, body, and trailers if the last paragraph is so."""
    paragraphs = [part for part in re.split(r"\n[ \t]*\n+", message.strip("\n")) if part.strip()]
    subject = " ".join(paragraphs[0].split("\n")) if paragraphs else ""
    trailers = _trailers(paragraphs[-1]) if len(paragraphs) > 1 else ()
    body = paragraphs[1 : -1 if trailers else None]
    return Commit(sha, author, when, subject, "\n\n".join(body), trailers, parents)


def _trailers(paragraph: str) -> tuple[tuple[str, str], ...]:
    """Read `Key: value` lines; an indented line goes on with the value before it."""
    found: list[tuple[str, str]] = []
    for line in paragraph.split("\n"):
        match = _TRAILER.fullmatch(line.rstrip())
        if match:
            found.append((match[1], match[2] or ""))
        elif line[:1] in (" ", "\t") and found:
            key, value = found.pop()
            found.append((key, f"{value} {line.strip()}".strip()))
        else:
            return ()
    return tuple(found)
