"""What a commit says in its message: subject, sentences, and trailers with the provenance.

Messages are composed and read back here only. Every value is escaped, so that no line break of a
model's name, an answer or a login can begin another trailer; who answered and when are trailers of
their own (`By-1`, `At-1`), so that no punctuation of an answer can pass for them.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache

from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.view.provenance import Told, plain, short

Trailers = tuple[tuple[str, str], ...]

_UNSAFE = re.compile(
    r"\\|[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]|^ | $"
)
_ESCAPED = re.compile(r"\\(?:(\\)|u([0-9a-f]{4}))")
_TRAILER = re.compile(r"([A-Za-z0-9][A-Za-z0-9-]*):(?:[ \t]+(.*))?")
_NUMBERED = re.compile(r"(Question|Answer|Suggested|By|At|Fact)-([0-9]{1,6})")
_SIGNED = re.compile(r"(.*?)(?: \(([^()]*)\))?", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Commit:
    """A commit; `when` is aware."""

    sha: str
    author: str
    when: datetime
    message: str
    parents: tuple[str, ...] = ()

    @property
    def subject(self) -> str:
        """The first paragraph, in one line."""
        return parse(self.message)[0]

    @property
    def body(self) -> str:
        """What stands between the subject and the trailers."""
        return parse(self.message)[1]

    @property
    def trailers(self) -> Trailers:
        """Keys and values of the last paragraph, if it consists of such."""
        return parse(self.message)[2]


def escape(text: str) -> str:
    """Write a value on one line that reads back as the same value."""

    def escaped(match: re.Match[str]) -> str:
        return "\\\\" if match[0] == "\\" else f"\\u{ord(match[0]):04x}"

    return _UNSAFE.sub(escaped, text)


def unescape(text: str) -> str:
    """Return the value that `escape` wrote."""
    return _ESCAPED.sub(lambda match: match[1] or chr(int(match[2], 16)), text)


def compose(subject: str, trailers: Iterable[tuple[str, str]], body: Sequence[str] = ()) -> str:
    """Write a message: the subject in one line, sentences, and the trailers, all values escaped."""
    head = escape(" ".join(subject.split()))
    lines = "".join(f"  {escape(line)}\n" for line in body)
    return "\n".join(part for part in (f"{head}\n", lines, write(trailers)) if part)


def write(trailers: Iterable[tuple[str, str]]) -> str:
    """Write trailers, one a line, all values escaped."""
    return "".join(f"{key}: {escape(value)}\n" for key, value in trailers)


def of_lessons(lessons: Iterable[Lesson]) -> Iterator[tuple[str, str]]:
    """Give the trailers of lessons: as `of_answers` does, of their answers."""
    return of_answers(
        Told(0, lesson.question.text, lesson.answer.value or "", lesson.answer.by,
             lesson.answer.at, in_short(lesson.delta), lesson.answer.suggestion)
        for lesson in lessons
    )  # fmt: skip


def of_answers(answers: Iterable[Told]) -> Iterator[tuple[str, str]]:
    """Give the trailers of answers: the question, the answer, by whom, when, and every fact."""
    for number, told in enumerate(answers, start=1):
        yield f"Question-{number}", told.question
        yield f"Answer-{number}", told.said
        if told.suggestion:
            yield f"Suggested-{number}", told.suggestion
        yield f"By-{number}", told.by
        yield f"At-{number}", told.at
        yield from ((f"Fact-{number}", fact) for fact in told.facts)


def in_short(delta: Delta) -> tuple[str, ...]:
    """Return the facts of a change as the trailers have them, each with its sign."""
    sides = (("-", delta.removed), ("+", delta.added))
    return tuple(f"{sign} {' '.join(map(local, t))}" for sign, side in sides for t in sorted(side))


@lru_cache(maxsize=64)
def parse(message: str) -> tuple[str, str, Trailers]:
    """Take a message apart as git does: subject, body, and trailers if the last paragraph is so."""
    paragraphs = [part for part in re.split(r"\n[ \t]*\n+", message.strip("\n")) if part.strip()]
    subject = " ".join(paragraphs[0].split("\n")) if paragraphs else ""
    trailers = _trailers(paragraphs[-1]) if len(paragraphs) > 1 else ()
    body = "\n\n".join(paragraphs[1 : -1 if trailers else None])
    # What plain git has written is not escaped; it seldom has trailers.
    return unescape(subject) if trailers else subject, body, trailers


def _trailers(paragraph: str) -> Trailers:
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
    return tuple((key, unescape(value)) for key, value in found)


def answers(trailers: Iterable[tuple[str, str]]) -> tuple[Told, ...]:
    """Return the answers that a commit's trailers record, in order.

    A commit of the first edition has no `At-1`: there the person and the time stand in parentheses
    at the end of the answer.
    """
    parts: dict[int, dict[str, list[str]]] = {}
    for key, value in trailers:
        match = _NUMBERED.fullmatch(key)
        if match:
            parts.setdefault(int(match[2]), {}).setdefault(match[1], []).append(value)
    found = []
    for number, fields in sorted(parts.items()):
        question, text, by, at, likely = (
            fields.get(key, [""])[0] for key in ("Question", "Answer", "By", "At", "Suggested")
        )
        if "At" not in fields and (match := _SIGNED.fullmatch(text)):
            text, signed = match[1], match[2] or ""
            by, _, at = signed.rpartition(", ") if ", " in signed else (signed, "", "")
        found.append(Told(number, question, text, by, at, tuple(fields.get("Fact", ())), likely))
    return tuple(found)


def taught(answer: Told, sign: str, facts: Iterable[tuple[object, ...]]) -> frozenset[tuple]:  # type: ignore[type-arg]
    """Return those facts that an answer of a commit taught."""
    written = set(map(plain, answer.facts))
    return frozenset(fact for fact in facts if short(sign, fact) in written)  # type: ignore[arg-type]
