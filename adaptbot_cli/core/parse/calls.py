"""Reading one call: its name, its arguments, what is wrong with it; and telling it from prose."""

import keyword
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from adaptbot_cli.core.english import TIMES, UNCOUNTED, count_of
from adaptbot_cli.core.plan import Call

SHOWN = 60
"""How many characters of a source a message quotes."""
LEFT_OUT = "P105"
"""The code of an item that is a line of prose among the calls."""
BIND, RETURN, JUMP, PROSE, SAID, GAP = "bind", "return", "jump", "prose", "said", "gap"
"""Codes of items that are no calls: a name given a value, the end of a function, a way out of a
loop, a line of prose, a string that may be a step in words, and what stands between calls."""

_NAME_LIMIT = 100
_MOST_ARGS = 500
_MOST_TIMES = 50
_LOOK = 60
_LONG = 300
_LOOK_BACK = 160
_CLOSING = {
    '"': '"', "'": "'", "`": "`", "‘": "’'", "’": "’'",
    "“": '”"“', "”": '”"', "„": '“”"', "«": "»",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Line:
    """What kind of line an item stands in.

    `marked` tells that it is an item of a list, `heads` that it announces what comes below;
    `group` numbers the lists, `run` the lines that no blank line parts; `block` is where the head
    stands that it is under, `number` the item's own, -1 if it has none.
    """

    marked: bool = False
    heads: bool = False
    fenced: bool = False
    indent: int = 0
    group: int = 0
    run: int = 0
    block: int = 0
    number: int = -1


@dataclass(frozen=True, slots=True)
class Item:
    """Something found at the offset `start` of a text: a call, or what is wrong there by `code`.

    Of each argument of a call in code, `written` tells how it was: "" in quotes, "n" a bare name,
    "f" a format string, "l" a list or an object. `time` is the step of an atom of a logic program.
    """

    start: int
    source: str
    call: Call | None = None
    code: str = ""
    message: str = ""
    written: tuple[str, ...] = ()
    time: int = -1
    line: Line = Line()

    def told(self, code: str, message: str = "") -> "Item":
        """Return what is said of this item in place of a call."""
        return replace(self, call=None, code=code, message=message, time=-1)

    def conditional(self, condition: str) -> "Item":
        """Report a call that only runs under a condition, or below a word such as "avoid" never."""
        if FORBIDS.match(condition):
            below = f"{shown(self.source)} is below {shown(condition)}"
            return self.told("P106", f"{below}: it is not to be run, so it is no step.")
        under = f"{shown(self.source)} is under the condition {shown(condition)}"
        return self.told("P103", f"{under}: only plain calls are run.")

    def fault(self, why: str) -> "Item":
        """Report a call that cannot be read."""
        return self.told("P102", f"{shown(self.source)} cannot be read: {why}.")


@dataclass(frozen=True, slots=True)
class Arguments:
    """The arguments behind a parenthesis: of each its keyword, itself, and how it is `written`.

    `error` says what broke off the reading at `end`.
    """

    found: tuple[tuple[str, str, str], ...]
    end: int
    quoted: bool
    error: str = ""

    @property
    def args(self) -> tuple[str, ...]:
        """The arguments alone."""
        return tuple(arg for _, arg, _ in self.found)


def read_table(written: str) -> dict[str, tuple[str, ...]]:
    """Read a table of words: rows such as `name: words`, which lines that are indented go on."""
    rows = re.findall(r"^(\w+):((?:.|\n )*)", written, re.MULTILINE)
    return {name: tuple(words.split()) for name, words in rows}


def worded(pattern: str, flags: int = 0) -> re.Pattern[str]:
    """Compile a pattern of words in any case; a space stands for white space, ' for ’ as well."""
    spaced = re.sub(r"(?<!\[) (?!\])", r"\\s+", pattern.replace("'", "['’]"))
    return re.compile(spaced, re.IGNORECASE | flags)


FORBIDDING = (
    r"(?:(?:[a-z]+[_ ]){0,3}(?:do|to)[_ ](?:not|avoid)(?:[_ ]do)?|(?:what )?not[_ ]to[_ ]do"
    r"|don.?t(?: do)?|avoid|never|not|forbidden"
    r"|(?:bad|wrong|incorrect)(?:[_ ](?:example|plan|steps?|way))?)"
)
FORBIDS = worded(rf"{FORBIDDING}\Z")
"""A head or a key of what is not to be done."""


def shown(source: str) -> str:
    """Quote a source in a message: one line of printable text, shortened."""
    line = " ".join(source[: 4 * SHOWN].split())
    safe = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)
    return f"`{safe if len(safe) <= SHOWN else safe[: SHOWN - 3] + '...'}`"


def kept(named: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return the arguments that say anything: ontology files are plumbing of the prompt."""
    return [(name, arg) for name, arg in named if arg and not arg.lower().endswith(".ttl")]


def line_end(text: str, pos: int) -> int:
    """Return where the line of an offset ends."""
    end = text.find("\n", pos)
    return len(text) if end < 0 else end


def swallow(text: str, pos: int) -> int:
    """Find where a call that cannot be read ends: behind its parenthesis, or with the line."""
    depth = 1
    while pos < len(text) and text[pos] != "\n" and depth:
        depth += {"(": 1, ")": -1}.get(text[pos], 0)
        pos += 1
    return pos


def _string(opening: str) -> re.Pattern[str]:
    """Build the pattern of a string. An apostrophe before a letter closes nothing."""
    closing = _CLOSING[opening]
    plain, inside, ends = rf"[^\\\n{closing}]*+", r"\\.", f"[{closing}]"
    if closing[-1] in "'’":
        inside += rf"|{ends}(?=\w)"
        ends += r"(?!\w)"
    return re.compile(rf"{re.escape(opening)}({plain}(?:(?:{inside}){plain})*){ends}")


_STRINGS = {opening: _string(opening) for opening in _CLOSING}
_SPACE = re.compile(r"[^\S\n]*(?:(?:#|//)[^\n]*)?")
_KEYWORD = re.compile(
    r"(?:([^\W\d]\w{0,80})[^\S\n]*(?:=(?!=)|:(?=[^\S\n]*[\"'“‘`]))[^\S\n]*)?"
    r"([fFrRbBuU]{1,2}(?=[\"']))?"
)
_PLAIN = re.compile(r"(\[[^\[\](){}\n]*\]|\{[^\[\](){}\n]*\})|[^,()\"“”„«»`\n\[\]{}]*")
# A line that a call cannot run on into: a blank one, a fence, or the next call.
_BREAK = re.compile(
    r"[^\S\n]*(?:\n|\Z|```|~~~|(?:[-*+•][^\S\n]+|\d+[.)][^\S\n]*)?[`*]*[^\W\d][\w.]{0,80}\()"
)
UNCLOSED_QUOTE = "the quote is never closed"
NESTED = "there is a call inside the call"
_UNCLOSED = "the parenthesis is never closed"
_MISSING = "a comma is missing between arguments"


def read_args(text: str, pos: int) -> Arguments:
    """Read the arguments from behind an opening parenthesis up to its closing one.

    Never reads past the next parenthesis, quotes aside, that it does not understand.
    """
    found: list[tuple[str, str, str]] = []
    quoted = False
    for _ in range(_MOST_ARGS):
        pos = _gap(text, pos)
        if text[pos : pos + 1] == ")":
            return Arguments(tuple(arg for arg in found if kept([arg[:2]])), pos + 1, quoted)
        if text[pos : pos + 1] == ",":
            pos += 1
            continue
        head = _KEYWORD.match(text, pos)
        name, prefix, pos = (head[1] or "", head[2] or "", head.end()) if head else ("", "", pos)
        string = _STRINGS.get(text[pos : pos + 1])
        quoted = quoted or string is not None
        match = (string or _PLAIN).match(text, pos)
        if match is None:
            return Arguments((), pos, quoted, UNCLOSED_QUOTE)
        pos = match.end()
        if string:
            found.append((name, unescape(match[1]).strip(), "f" if "f" in prefix.lower() else ""))
        else:
            found.append((name, match[0].strip(), "l" if match[1] else "n"))
        at = _gap(text, pos)
        error = _wrong(text[at : at + 1], "" if string else match[0].strip())
        if error:
            return Arguments((), pos, quoted, error)
    return Arguments((), pos, quoted, "it has hundreds of arguments")


def _gap(text: str, pos: int) -> int:
    """Skip space, comments and the line breaks that a call may hold."""
    while True:
        match = _SPACE.match(text, pos)
        pos = match.end() if match else pos
        if text[pos : pos + 1] != "\n" or _BREAK.match(text, pos + 1):
            return pos
        pos += 1


def _wrong(char: str, bare: str) -> str:
    """Say what is wrong with what follows an argument, if anything is."""
    if char == "(":
        return NESTED if bare.isidentifier() else "there is a parenthesis inside an argument"
    if char in "[]{}":
        return "an argument is a list or an object" if char else _UNCLOSED
    missing = "a quote stands inside an argument" if bare else _MISSING
    return {",": "", ")": "", "\n": _UNCLOSED}.get(char, missing)


_ESCAPE = re.compile(r"\\(?:u([0-9a-fA-F]{4})|(.))")
_ESCAPED = {
    "n": "\n", "t": "\t", "r": "\r", "b": "\b", "f": "\f",
    **{mark: mark for mark in (*_CLOSING, "\\", "/")},
}  # fmt: skip


def unescape(written: str) -> str:
    """Undo backslash escapes as in JSON; a backslash that escapes nothing stays."""
    plain = _ESCAPE.sub(lambda m: chr(int(m[1], 16)) if m[1] else _ESCAPED.get(m[2], m[0]), written)
    # Two \\u escapes may be the halves of one character.
    return plain.encode("utf-16", "surrogatepass").decode("utf-16", "surrogatepass")


# Markdown escapes the underscore: pick\_up. Some models write pick-up.
_NAME = re.compile(r"(?<!\w)(?:[^\W\d]\w*\.)*((?:[^\W\d]|\\_)(?:\w|\\_|-(?=[^\W\d]))*)\Z")
_QUOTED = re.compile(r"[ \t]*[\"'“‘]")
_PLURAL = {"s", "es", "ies"}
_OFTEN = worded(
    r"[ \t`*_.,;–—-]*(?:[(\[#]\s*|//\s*)?(?:do it |repeat(?:ed)? )?"
    rf"(?:({TIMES})|{UNCOUNTED}|\]\s*\*\s*\d+)"
)
_TRAILING_IF = re.compile(
    r"[ \t`*]*(?=(?:if|unless|for[ \t]+(?:each|every|all)|for[ \t]+[\w, ()]{1,60}[ \t]in)\b)"
    r"|[ \t`*;.]*[(\[#–—-]+[ \t]*(?=optional(?:ly)?\b)"
)
# What may stand before and behind a call that is no part of a sentence.
_LABEL = (
    r"(?:<\w+>\s*)?(?:\**(?:step|action|call)\s*\d*\s*[.:)\-]+\**\s*)?"
    r"(?:(?:then|and|next|first|finally|lastly|now|followed\s+by|if|unless|while|else)\b[,:]?)?"
)
# 1. 1.2 a) (iv) [x] 1️⃣ and what else leads a list item.
MARK = (
    r"(?:\(?(?:\d{1,4}(?:\.\d{1,4})*|[a-zA-Z]|[ivx]{1,4})[ ]?(?:[.:)|、．º]|\uFE0F?\u20E3)+"
    r"|\d{1,4}(?:\.\d{1,4})+(?=\s)|\[(?:(?:[Ss]tep|[Aa]ction|[Tt]ask)\s*\d*|[ xX\d✓✔]{1,3})\](?=\s)"
    r"|[①-⑳❶-❿Ⅰ-ⅻ]\.?)\s*+"
)
_BEFORE = worded(
    # Any symbol that opens no value: bullets, arrows, ticks. Words are no marks.
    rf"(?:[^\w(){{}}\[\]/\\<]|_)*(?:{MARK}|(?!{MARK}))[*_`]*+{_LABEL}"
    r"[\s`*_]*+(?:\w+\s*=\s*)?(?:await\s+)?\[?"
)
_NUMBERED = re.compile(r"[.:;,]\s+\(?1[.):]\s*\Z")
_BEHIND = re.compile(
    r"[ \t`*_\"']*(?:\Z|\(?\d{1,3}[.)]\s|[^\W\d]\w*\(|\n|[;,.|#:\-–—→⇒➜➔=<>&\])(。；，、]"
    r"|//|(?:then|and|followed|s|sec\w*|min\w*|hours?)\b)",
    re.IGNORECASE,
)
_SIMPLE = re.compile(r"[-+]?[\d.]+|[^\W\d]\w*")
_COLON = re.compile(r"(?:(?<!Error)(?<!Exception)[:：]|→|⇒|[-=]>)[ \t*_`]*\Z")
_OTHERWISE = worded(
    r"[\s`*,;.]*(or[\s`*,]*|(?:if|unless|while|else)\b.*)|assert\b.*\b(else)[\s:]*", re.DOTALL
)
_LINE_END = re.compile(r"[ \t`*_.,;!\"'。；，]*(?:(?:#|//)[^\n]*)?(?:\Z|\n)")
_SENTENCE_END = re.compile(rf"{_LINE_END.pattern}|\.\s+[A-Z]")
_QUOTES = re.compile(r"[^\n\"“”]{0,80}[,(=][ \t]*[\"“]")
_BROKEN = re.compile(r"\s*(?:\w+(?:\s*,\s*\w+)*\s*(?:\n|\Z)|[\[{])")


def call_name(text: str, anchor: int, floor: int, paren: int) -> tuple[int, str] | None:
    """Find the name before a parenthesis and where it is written, looking back to `floor`.

    `robot.slice(` is `slice`, written from `robot`. A space may stand between them only behind an
    underscored name, or where nothing but list marks leads from `anchor` to it. A word of Python
    is the name of a call only where nothing else stands in its place.
    """
    spaced = text[paren - 1 : paren] == " " and paren > floor and _QUOTED.match(text, paren + 1)
    end = paren - bool(spaced)
    start = max(floor, end - _NAME_LIMIT)
    match = _NAME.search(text[start:end])
    if match is None:
        return None
    start, name = start + match.start(), match[1].replace("\\_", "_")
    leads = _leads(text, anchor, start)
    fits = leads or not spaced or "_" in name
    if keyword.iskeyword(name):
        fits = leads and not text[paren - 1].isspace() and ends_line(text, paren)
    return (start, name) if fits else None


def ends_line(text: str, paren: int) -> bool:
    """Tell whether a call whose parenthesis opens here is the last that its line says."""
    reading = read_args(text, paren + 1)
    return not reading.error and bool(_LINE_END.match(text, reading.end))


def is_call(
    text: str,
    anchor: int,
    start: int,
    name: str,
    reading: Arguments,
    fenced: bool,
    knows: Callable[[str], bool],
) -> bool:
    """Tell whether a name at `start` and its parenthesis are meant as a call.

    `anchor` is where the line begins, or where its last call ended. "the pan(s)" or
    "slice(s) of bread" in a sentence are no calls; in a code block almost everything is.
    """
    leads = _leads(text, anchor, start)
    alone = leads and bool(_BEHIND.match(text, reading.end))
    if not reading.quoted and len(reading.args) == 1 and reading.args[0] in _PLURAL:
        return fenced and alone
    if fenced or reading.quoted or "_" in name or text[max(0, start - 1) : start] == "`":
        return True
    if reading.error:
        opened = text.find("(", start) + 1
        return bool((leads and _BROKEN.match(text, opened)) or _QUOTES.match(text, opened))
    if alone and knows(name):
        return True
    # A line or sentence ends with it behind a colon: "Cut it: slice(egg, knife)".
    colon = _COLON.search(text, max(anchor, start - _LOOK), start)
    ends = colon is not None and bool(_SENTENCE_END.match(text, reading.end))
    return (alone or ends) and (name.islower() or all(map(_SIMPLE.fullmatch, reading.args)))


def _leads(text: str, anchor: int, start: int) -> bool:
    """Tell whether nothing of a sentence stands between two offsets: "2. ", "; then ".

    The first of a numbered list may stand behind a sentence.
    """
    near = start - anchor <= _LOOK
    led = near and (start == anchor or _BEFORE.fullmatch(text, anchor, start))
    return bool(led or _NUMBERED.search(text, anchor if near else start - _LOOK, start))


def alternative(text: str, anchor: int, start: int) -> str:
    """Name the condition of the second call in `clean("pan") or clean("pot")`, or `...; if ...`."""
    match = _OTHERWISE.fullmatch(text, anchor, start) if start - anchor <= _LOOK else None
    return (match[1] or match[2]).rstrip(" `*") if match else ""


def ruled(text: str, reading: Arguments) -> tuple[int, str]:
    """Return how often a call is done, and its condition, by what stands behind it.

    `clean("pan") twice`, `clean("pan") if it is dirty`; what says no number is a condition.
    """
    often = None if reading.error else _OFTEN.match(text, reading.end)
    count = min(count_of(often[1] or ""), _MOST_TIMES) if often else 1
    if often and not count:
        return 1, often[0].strip(" `*_([#,;")
    match = None if reading.error else _TRAILING_IF.match(text, reading.end)
    line = text[match.end() : match.end() + _LONG].partition("\n")[0] if match else ""
    return count, line.partition("#")[0].strip(" `*" if "(" in line else " `*)]")


WRAPPED = re.compile(
    r"[^\w()\n]*(?:\d+[.):]\s*)?(?:\w+\.)*([^\W\d]\w*)\(\s*\[?\s*(\w+\s*,\s*|)([^\W\d][\w-]*)\("
)
"""The beginning of a call inside a call, behind who does it, or inside the list that one takes."""

WRAPPERS = frozenset(
    {"do", "occurs", "occ", "o", "happens", "happen", "execute", "perform", "act", "exec", "apply",
     "run", "action", "step", "call", "plan", "todo"}
)  # fmt: skip
"""What says of another call that it is done."""

_BREAKS = (
    "so but then therefore thus hence because until before unless forget fail hesitate only just"
)
_ANNOUNCES = (
    "ever again yet to for use using call calling do doing run running execute executing perform"
    " performing write writing include including the a any action step function command"
)
_NEGATION = worded(
    # Behind these anything may come before the call: "Never put it there by put_down(...)".
    r"(?<![\w\x27’])(?:(?:do not|don'?t|never|(?:must|should|shall)(?: not|n't))"
    rf"(?:[*`\"]*+[ \t]++[*`\"]*+(?!(?:{_BREAKS.replace(' ', '|')})\b)[\w\x27’-]++){{0,8}}"
    # Behind these only words that announce it: "The pan is not clean clean(...)" is a step.
    r"|(?:not|avoid(?:ing)?|instead of|rather than|without|can(?:not|'t)|needn't|no need"
    r"|refrain(?:ing)? from|skip(?:ping)?|omit(?:ting)?|neither|nor)"
    rf"(?:[*`\"]*+[ \t]++[*`\"]*+(?:{_ANNOUNCES.replace(' ', '|')})\b){{0,6}})"
    r"[ \t*_`\"\x27“‘(]*\Z"
)
_GOES_ON = worded(r"[\s`*_,\"”]*\b(?:and|or|nor)[\s`*_\"“]*")


def negation(text: str, anchor: int, start: int, before: str) -> str:
    """Return what says that the call at `start` is not to be run, or nothing.

    `anchor` is where its line or the call before it ended, `before` what was said of that one.
    """
    if before and _GOES_ON.fullmatch(text, anchor, min(start, anchor + _LOOK_BACK)):
        return before
    found = _NEGATION.search(text[max(anchor, start - _LOOK_BACK) : start])
    return found[0].strip(" \t*_`\"'“‘(") if found else ""
