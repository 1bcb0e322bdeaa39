"""Reading one call: its name, its arguments, what is wrong with it; and telling it from prose."""

import keyword
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from adaptbot_cli.core.english import TIMES, UNCOUNTED, count_of
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
_SPACE = re.compile(r"[^\S\n]*(?:(?:#|//)[^\n]*)?")
_KEYWORD = re.compile(
    r"([^\W\d]\w{0,80})[^\S\n]*(?:=(?!=)|:(?=[^\S\n]*[\"'“‘`]))[^\S\n]*",
)
_STRING_PREFIX = re.compile(r"[fFrRbBuU]{1,2}(?=[\"'])")
_BARE = re.compile(r"[^,()\"“”„«»`\n\[\]{}]*")
_LITERAL = re.compile(r"\[[^\[\](){}\n]*\]|\{[^\[\](){}\n]*\}")
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


@dataclass(frozen=True, slots=True)
class ArgumentList:
    """The arguments behind a parenthesis. `error` says what broke off the reading at `end`."""

    args: tuple[str, ...]
    end: int
    quoted: bool
    error: str = ""
    names: tuple[str, ...] = ()
    written: tuple[str, ...] = ()

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


def fault(start: int, source: str, why: str) -> Item:
    """Report a call that cannot be read."""
    return Item(start, source, code="P102", message=f"{shown(source)} cannot be read: {why}.")


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


def read_args(text: str, pos: int) -> ArgumentList:
    """Read the arguments from behind an opening parenthesis up to its closing one.

    Never reads past the next parenthesis, quotes aside, that it does not understand.
    """
    args: list[tuple[str, str, str]] = []
    quoted = False
    for _ in range(_MOST_ARGS):
        pos = _gap(text, pos)
        char = text[pos : pos + 1]
        if char == ")":
            found = [arg for arg in args if kept([arg[:2]])]
            names, values, written = zip(*found, strict=True) if found else ((), (), ())
            return ArgumentList(values, pos + 1, quoted, names=names, written=written)
        if char == ",":
            pos += 1
            continue
        if char in ("", "\n"):
            return ArgumentList((), pos, quoted, _UNCLOSED)
        arg = _argument(text, pos)
        quoted = quoted or arg.quoted
        if arg.error:
            return ArgumentList((), arg.end, quoted, arg.error)
        args.append((*arg.named()[0], arg.written[0]))
        pos = arg.end
    return ArgumentList((), pos, quoted, "it has hundreds of arguments")


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


def _gap(text: str, pos: int) -> int:
    """Skip space, comments and the line breaks that a call may hold."""
    while True:
        match = _SPACE.match(text, pos)
        pos = match.end() if match else pos
        if text[pos : pos + 1] != "\n" or _BREAK.match(text, pos + 1):
            return pos
        pos += 1


def _argument(text: str, pos: int) -> ArgumentList:
    named = _KEYWORD.match(text, pos)
    pos = named.end() if named else pos
    names = (named[1] if named else "",)
    prefix = _STRING_PREFIX.match(text, pos)
    pos = prefix.end() if prefix else pos
    if text[pos : pos + 1] in _CLOSING:
        return _quoted(text, pos, names, "f" if prefix and "f" in prefix[0].lower() else "")
    literal = _LITERAL.match(text, pos)
    match = literal or _BARE.match(text, pos)
    end = match.end() if match else pos
    arg = text[pos:end].strip()
    how = "l" if literal else "n"
    return ArgumentList((arg,), end, False, _after(text, end, arg), names, (how,))


def _quoted(text: str, pos: int, names: tuple[str, ...], written: str) -> ArgumentList:
    match = _STRINGS[text[pos]].match(text, pos)
    if match is None:
        return ArgumentList((), pos, True, UNCLOSED_QUOTE)
    error = _after(text, match.end(), "")
    return ArgumentList((unescape(match[1]).strip(),), match.end(), True, error, names, (written,))


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

_LOOK = 60
_LONG = 300
_QUOTED = re.compile(r"[ \t]*[\"'“‘]")
_PLURAL = {"s", "es", "ies"}
_OFTEN = re.compile(
    rf"[ \t`*_.,;–—-]*(?:[(\[#]\s*|//\s*)?(?:do[ ]it[ ]|repeat(?:ed)?[ ])?(?:({TIMES})|{UNCOUNTED}"
    r"|\]\s*\*\s*\d+)",
    re.IGNORECASE,
)
_MOST_TIMES = 50
_TRAILING_IF = re.compile(
    r"[ \t`*]*(?=(?:if|unless|for[ \t]+(?:each|every|all)|for[ \t]+[\w, ()]{1,60}[ \t]in)\b)"
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
_BEFORE = re.compile(
    # Any symbol that opens no value: bullets, arrows, ticks. Words are no marks.
    rf"(?:[^\w(){{}}\[\]/\\<]|_)*(?:{MARK}|(?!{MARK}))[*_`]*+{_LABEL}"
    r"[\s`*_]*+(?:\w+\s*=\s*)?(?:await\s+)?\[?",
    re.IGNORECASE,
)
_NUMBERED = re.compile(r"[.:;,]\s+\(?1[.):]\s*\Z")
_BEHIND = re.compile(
    r"[ \t`*_\"']*(?:\Z|\(?\d{1,3}[.)]\s|[^\W\d]\w*\(|\n|[;,.|#:\-–—→⇒➜➔=<>&\])(。；，、]"
    r"|//|(?:then|and|followed|s|sec\w*|min\w*|hours?)\b)",
    re.IGNORECASE,
)
_SIMPLE = re.compile(r"[-+]?[\d.]+|[^\W\d]\w*")
_COLON = re.compile(r"(?:(?<!Error)(?<!Exception)[:：]|→|⇒|[-=]>)[ \t*_`]*\Z")
_OTHERWISE = re.compile(
    r"[\s`*,;.]*(or[\s`*,]*|(?:if|unless|while|else)\b.*)|assert\b.*\b(else)[\s:]*", re.I | re.S
)
_SENTENCE_END = re.compile(r"[ \t`*_.,;!\"'。；，]*(?:(?:#|//)[^\n]*)?(?:\Z|\n)|\.\s+[A-Z]")
_LINE_END = re.compile(r"[ \t`*_.,;!\"'。；，]*(?:(?:#|//)[^\n]*)?(?:\Z|\n)")
_QUOTES = re.compile(r"[^\n\"“”]{0,80}[,(=][ \t]*[\"“]")
_BROKEN = re.compile(r"\s*(?:\w+(?:\s*,\s*\w+)*\s*(?:\n|\Z)|[\[{])")


def call_name(text: str, anchor: int, floor: int, paren: int) -> tuple[int, str] | None:
    """Find the name before a parenthesis and where it is written, looking back to `floor`.

    A space may stand between them only behind an underscored name, or where nothing but list marks
    leads from `anchor` to it.
    """
    named = name_before(text, paren, floor)
    if named is None and text[paren - 1 : paren] == " " and paren > floor:
        quoted = _QUOTED.match(text, paren + 1)
        spaced = name_before(text, paren - 1, floor) if quoted else None
        joined = spaced and "_" in spaced[1]
        named = spaced if spaced and (joined or _leads(text, anchor, spaced[0])) else None
    if named is None or (keyword.iskeyword(named[1]) and not _is_whole(text, anchor, named, paren)):
        return None
    return named


def _is_whole(text: str, anchor: int, named: tuple[int, str], paren: int) -> bool:
    """Tell whether a word of Python is the name of a call: nothing else stands in its place."""
    if text[paren - 1].isspace() or not _leads(text, anchor, named[0]):
        return False
    return ends_line(text, paren)


def ends_line(text: str, paren: int) -> bool:
    """Tell whether a call whose parenthesis opens here is the last that its line says."""
    reading = read_args(text, paren + 1)
    return not reading.error and bool(_LINE_END.match(text, reading.end))


def is_call(
    text: str,
    anchor: int,
    start: int,
    name: str,
    reading: ArgumentList,
    fenced: bool,
    knows: Callable[[str], bool],
) -> bool:
    """Tell whether a name at `start` and its parenthesis are meant as a call.

    `anchor` is where the line begins, or where its last call ended. "the pan(s)" or
    "slice(s) of bread" in a sentence are no calls; in a code block almost everything is.
    """
    plural = not reading.quoted and len(reading.args) == 1 and reading.args[0] in _PLURAL
    if fenced:
        return not plural or _stands_alone(text, anchor, start, reading)
    if plural:
        return False
    if reading.quoted or "_" in name or text[max(0, start - 1) : start] == "`":
        return True
    if knows(name) and not reading.error and _stands_alone(text, anchor, start, reading):
        return True
    if reading.error:
        opened = text.find("(", start) + 1
        broken = _leads(text, anchor, start) and bool(_BROKEN.match(text, opened))
        return broken or bool(_QUOTES.match(text, opened))
    plain = all(_SIMPLE.fullmatch(arg) for arg in reading.args) or name.islower()
    alone = _stands_alone(text, anchor, start, reading)
    return plain and (alone or _ends_line(text, anchor, start, reading))


def alternative(text: str, anchor: int, start: int) -> str:
    """Name the condition of the second call in `clean("pan") or clean("pot")`, or `...; if ...`."""
    gap = text[anchor:start] if start - anchor <= _LOOK else ""
    match = _OTHERWISE.fullmatch(gap)
    return (match[1] or match[2]).rstrip(" `*") if match else ""


def trailing_condition(text: str, reading: ArgumentList) -> str:
    """Find the condition behind a call: `clean("pan") if it is dirty`."""
    match = None if reading.error else _TRAILING_IF.match(text, reading.end)
    if match is None:
        return ""
    line = text[match.end() : match.end() + _LONG].partition("\n")[0]
    return line.partition("#")[0].strip(" `*")


def how_often(text: str, reading: ArgumentList) -> tuple[int, str]:
    """Return how often what stands behind a call says it is done, and what says no number."""
    reply = None if reading.error else _OFTEN.match(text, reading.end)
    if reply is None:
        return 1, ""
    count = min(count_of(reply[1] or ""), _MOST_TIMES)
    return (count, "") if count else (1, reply[0].strip(" `*_([#,;"))


def _stands_alone(text: str, anchor: int, start: int, reading: ArgumentList) -> bool:
    behind = _BEHIND.match(text, reading.end)
    return behind is not None and _leads(text, anchor, start)


def _ends_line(text: str, anchor: int, start: int, reading: ArgumentList) -> bool:
    """Tell whether a line or sentence ends with it behind a colon: "Cut it: slice(egg, knife)"."""
    colon = _COLON.search(text, max(anchor, start - _LOOK), start)
    return colon is not None and bool(_SENTENCE_END.match(text, reading.end))


def _leads(text: str, anchor: int, start: int) -> bool:
    """Tell whether nothing of a sentence stands between two offsets: "2. ", "; then ".

    The first of a numbered list may stand behind a sentence.
    """
    if start - anchor > _LOOK:
        return bool(_NUMBERED.search(text, start - _LOOK, start))
    led = start == anchor or _BEFORE.fullmatch(text, anchor, start)
    return bool(led or _NUMBERED.search(text, anchor, start))


WRAPPED = re.compile(
    r"[^\w()\n]*(?:\d+[.):]\s*)?(?:\w+\.)*([^\W\d]\w*)\(\s*\[?\s*(\w+\s*,\s*|)([^\W\d][\w-]*)\("
)
"""The beginning of a call inside a call, behind who does it, or inside the list that one takes."""

WRAPPERS = frozenset(
    {"do", "occurs", "occ", "o", "happens", "happen", "execute", "perform", "act", "exec", "apply",
     "run", "action", "step", "call", "plan", "todo"}
)  # fmt: skip
"""What says of another call that it is done."""

_LOOK_BACK = 160
# Behind these anything may come before the call: "Never put it there by put_down(...)".
_ORDER = r"do\s+not|don['’]?t|never|(?:must|should|shall)(?:\s+not|n['’]t)"
# Behind these only words that announce the call: "The pan is not clean clean(...)" is a step.
_DIRECT = (
    r"not|avoid(?:ing)?|instead\s+of|rather\s+than|without|can(?:not|['’]t)|needn['’]t|no\s+need"
    r"|refrain(?:ing)?\s+from|skip(?:ping)?|omit(?:ting)?|neither|nor"
)
_BREAKS = (
    r"so|but|then|therefore|thus|hence|because|until|before|unless|forget|fail|hesitate|only|just"
)
_ANNOUNCES = (
    r"ever|again|yet|to|for|use|using|call|calling|do|doing|run|running|execute|executing|perform"
    r"|performing|write|writing|include|including|the|a|any|action|step|function|command"
)
_NEGATION = re.compile(
    rf"(?<![\w'’])(?:(?:{_ORDER})(?:[*`\"]*+[ \t]++[*`\"]*+(?!(?:{_BREAKS})\b)[\w'’-]++){{0,8}}"
    rf"|(?:{_DIRECT})(?:[*`\"]*+[ \t]++[*`\"]*+(?:{_ANNOUNCES})\b){{0,6}})[ \t*_`\"'“‘(]*\Z",
    re.IGNORECASE,
)
_GOES_ON = re.compile(r"[\s`*_,\"”]*\b(?:and|or|nor)[\s`*_\"“]*", re.IGNORECASE)


def negation(text: str, anchor: int, start: int, before: str) -> str:
    """Return what says that the call at `start` is not to be run, or nothing.

    `anchor` is where its line or the call before it ended, `before` what was said of that one.
    """
    if before and _GOES_ON.fullmatch(text, anchor, min(start, anchor + _LOOK_BACK)):
        return before
    found = _NEGATION.search(text[max(anchor, start - _LOOK_BACK) : start])
    return found[0].strip(" \t*_`\"'“‘(") if found else ""
