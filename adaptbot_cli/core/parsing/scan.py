"""Reading one call, character by character: its name, its arguments, what is wrong with it."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from adaptbot_cli.core.plan import Call

SHOWN = 60
"""How many characters of a source a message quotes."""
LEFT_OUT = "P105"
"""The code of an item that is a line of prose among the calls."""

_NAME_LIMIT = 100
_MOST_ARGS = 500
_CLOSING = {
    '"': '"', "'": "'", "`": "`", "‘": "’'", "’": "’'",
    "“": '”"“', "”": '”"', "„": '“”"', "«": "»",
}  # fmt: skip
_APOSTROPHES = "'’"
# Markdown escapes the underscore: pick\_up. Some models write pick-up.
_NAME = re.compile(r"(?<!\w)(?:[^\W\d]\w*\.)*((?:[^\W\d]|\\_)(?:\w|\\_|-(?=[^\W\d]))*)\Z")
_SPACE = re.compile(r"[^\S\n]*")
_COMMENT = re.compile(r"(?:#|//)[^\n]*")
_KEYWORD = re.compile(
    r"([^\W\d]\w{0,80})[^\S\n]*(?:=(?!=)|:(?=[^\S\n]*[\"'“‘`]))[^\S\n]*",
)
_BARE = re.compile(r"[^,()\"“”„«»`\n\[\]{}]*")
_ESCAPE = re.compile(r"\\(u[0-9a-fA-F]{4}|.)")
_ESCAPED = {"n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f"}

# A line that a call cannot run on into: a blank one, a fence, or the next call.
_BREAK = re.compile(
    r"[^\S\n]*(?:\n|\Z|```|~~~|(?:[-*+•][^\S\n]+|\d+[.)][^\S\n]*)?[`*]*[^\W\d][\w.]{0,80}\()"
)

_UNCLOSED = "the parenthesis is never closed"
UNCLOSED_QUOTE = "the quote is never closed"
NESTED = "there is a call inside the call"


@dataclass(frozen=True, slots=True)
class Item:
    """Something found at the offset `start` of a text: a call, or what is wrong there by `code`."""

    start: int
    source: str
    call: Call | None = None
    code: str = ""
    message: str = ""


@dataclass(frozen=True, slots=True)
class Reading:
    """The arguments behind a parenthesis. `error` says what broke off the reading at `end`."""

    args: tuple[str, ...]
    end: int
    quoted: bool
    error: str = ""
    names: tuple[str, ...] = ()

    def named(self) -> tuple[tuple[str, str], ...]:
        """Return each argument behind its keyword, or behind "" if it has none."""
        return tuple(zip(self.names, self.args, strict=True))


def shown(source: str) -> str:
    """Quote a source in a message: one line of printable text, shortened."""
    line = " ".join(source[: 4 * SHOWN].split())
    safe = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)
    return f"`{safe if len(safe) <= SHOWN else safe[: SHOWN - 3] + '...'}`"


def conditional(start: int, source: str, condition: str) -> Item:
    """Report a call that only runs under a condition."""
    message = (
        f"{shown(source)} is under the condition {shown(condition)}: only plain calls are run."
    )
    return Item(start, source, code="P103", message=message)


def negated(start: int, source: str, negation: str) -> Item:
    """Report a call that a sentence says is not to be run."""
    message = f"{shown(source)} is behind {shown(negation)}: it is not to be run, so it is no step."
    return Item(start, source, code="P106", message=message)


def name_before(text: str, paren: int, floor: int) -> tuple[int, str] | None:
    """Find the action's name that ends at `paren`, not looking further back than `floor`.

    Returns where it is written and the name: `robot.slice(` is `slice`, written from `robot`.
    """
    start = max(floor, paren - _NAME_LIMIT)
    match = _NAME.search(text[start:paren])
    if match is None:
        return None
    return start + match.start(), match[1].replace("\\_", "_")


def kept(named: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the arguments that say anything: ontology files are plumbing of the prompt."""
    return [(name, arg) for name, arg in named if arg and not arg.lower().endswith(".ttl")]


def read_args(text: str, pos: int) -> Reading:
    """Read the arguments from behind an opening parenthesis up to its closing one.

    Never reads past the next parenthesis, quotes aside, that it does not understand.
    """
    args: list[tuple[str, str]] = []
    quoted = False
    for _ in range(_MOST_ARGS):
        pos = _gap(text, pos)
        char = text[pos : pos + 1]
        if char == ")":
            said = kept(args)
            names, values = tuple(n for n, _ in said), tuple(a for _, a in said)
            return Reading(values, pos + 1, quoted, names=names)
        if char == ",":
            pos += 1
            continue
        if char in ("", "\n"):
            return Reading((), pos, quoted, _UNCLOSED)
        arg = _argument(text, pos)
        quoted = quoted or arg.quoted
        if arg.error:
            return Reading((), arg.end, quoted, arg.error)
        args += arg.named()
        pos = arg.end
    return Reading((), pos, quoted, "it has hundreds of arguments")


def swallow(text: str, pos: int) -> int:
    """Find where a call that cannot be read ends: behind its parenthesis, or with the line."""
    depth = 1
    while pos < len(text) and text[pos] != "\n" and depth:
        depth += {"(": 1, ")": -1}.get(text[pos], 0)
        pos += 1
    return pos


def _gap(text: str, pos: int) -> int:
    """Skip space, comments and the line breaks that a call may hold."""
    while True:
        pos = _skip(text, pos)
        if text[pos : pos + 1] != "\n" or _BREAK.match(text, pos + 1):
            return pos
        pos += 1


def _skip(text: str, pos: int) -> int:
    match = _SPACE.match(text, pos)
    pos = match.end() if match else pos
    comment = _COMMENT.match(text, pos)
    return comment.end() if comment else pos


def _argument(text: str, pos: int) -> Reading:
    keyword = _KEYWORD.match(text, pos)
    pos = keyword.end() if keyword else pos
    names = (keyword[1] if keyword else "",)
    if text[pos : pos + 1] in _CLOSING:
        return _quoted(text, pos, names)
    match = _BARE.match(text, pos)
    end = match.end() if match else pos
    arg = text[pos:end].strip()
    return Reading((arg,), end, False, _after(text, end, arg), names)


def _quoted(text: str, pos: int, names: tuple[str, ...]) -> Reading:
    match = _STRINGS[text[pos]].match(text, pos)
    if match is None:
        return Reading((), pos, True, UNCLOSED_QUOTE)
    error = _after(text, match.end(), "")
    return Reading((unescape(match[1]).strip(),), match.end(), True, error, names)


def _after(text: str, pos: int, bare: str) -> str:
    """Say what is wrong with what follows an argument, if anything is."""
    pos = _gap(text, pos)
    char = text[pos : pos + 1]
    if char in (",", ")"):
        return ""
    if char in ("", "\n"):
        return _UNCLOSED
    if char == "(":
        return NESTED if bare.isidentifier() else "there is a parenthesis inside an argument"
    if char in "[]{}":
        return "an argument is a list or an object"
    return "a quote stands inside an argument" if bare else "a comma is missing between arguments"


def unescape(written: str) -> str:
    """Undo backslash escapes as in JSON; a backslash that escapes nothing stays."""
    if "\\" not in written:
        return written
    plain = _ESCAPE.sub(_unescaped, written)
    # Two \\u escapes may be the halves of one character.
    return plain.encode("utf-16", "surrogatepass").decode("utf-16", "surrogatepass")


def _unescaped(match: re.Match[str]) -> str:
    escaped = match[1]
    if len(escaped) > 1:
        return chr(int(escaped[1:], 16))
    if escaped in _CLOSING or escaped in "\\/":
        return escaped
    return _ESCAPED.get(escaped, match[0])


def _string(opening: str) -> re.Pattern[str]:
    """Build the pattern of a string. An apostrophe before a letter closes nothing."""
    closing = _CLOSING[opening]
    plain, inside, ends = rf"[^\\\n{closing}]*+", r"\\.", f"[{closing}]"
    if closing[-1] in _APOSTROPHES:
        inside += rf"|{ends}(?=\w)"
        ends += r"(?!\w)"
    return re.compile(rf"{re.escape(opening)}({plain}(?:(?:{inside}){plain})*){ends}")


_STRINGS = {opening: _string(opening) for opening in _CLOSING}
