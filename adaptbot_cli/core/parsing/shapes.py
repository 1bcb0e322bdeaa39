"""Telling calls from prose by their shape: what stands before, in and behind a parenthesis."""

import keyword
import re

from adaptbot_cli.core.parsing.scan import Reading, name_before

_LOOK = 60
_LONG = 300

_QUOTED = re.compile(r"[ \t]*[\"'“‘]")
_PLURAL = {"s", "es", "ies"}
_TRAILING_IF = re.compile(r"[ \t`*]*(?=(?:if|unless)\b)")

# What may stand before and behind a call that is no part of a sentence.
_LABEL = (
    r"(?:<\w+>\s*)?(?:\**(?:step|action|call)\s*\d*\s*[.:)\-]+\**\s*)?"
    r"(?:(?:then|and|next|first|finally|lastly|now|followed\s+by)\b[,:]?)?"
)
# 1. 1.2 a) (iv) [x] 1️⃣ and what else leads a list item.
MARK = (
    r"(?:\(?(?:\d{1,4}(?:\.\d{1,4})*|[a-zA-Z]|[ivx]{1,4})[ ]?(?:[.:)|、．º]|\uFE0F?\u20E3)+"
    r"|\d{1,4}(?:\.\d{1,4})+(?=\s)|\[[ xX\d✓✔]{1,3}\](?=\s))\s*+"
)
_BEFORE = re.compile(
    # Any symbol that opens no value: bullets, arrows, ticks. Words are no marks.
    rf"(?:[^\w(){{}}\[\]/\\<]|_)*+(?:{MARK})?+[*_`]*+{_LABEL}"
    r"[\s`*_]*+(?:\w+\s*=\s*)?(?:await\s+)?\[?",
    re.IGNORECASE,
)
_BEHIND = re.compile(
    r"[ \t`*_\"']*(?:\Z|\n|[;,.|#:\-–—→⇒➜➔=<&\])(。；，、]"
    r"|//|(?:then|and|followed|s|sec\w*|min\w*|hours?)\b)"
)
_SIMPLE = re.compile(r"[-+]?[\d.]+|[^\W\d]\w*")
_COLON = re.compile(r"(?<!Error)(?<!Exception)[:：][ \t*_`]*\Z")
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
    return None if named is None or keyword.iskeyword(named[1]) else named


def is_call(text: str, anchor: int, start: int, name: str, reading: Reading, fenced: bool) -> bool:
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
    if reading.error:
        opened = text.find("(", start) + 1
        broken = _leads(text, anchor, start) and bool(_BROKEN.match(text, opened))
        return broken or bool(_QUOTES.match(text, opened))
    plain = all(_SIMPLE.fullmatch(arg) for arg in reading.args) or name.islower()
    alone = _stands_alone(text, anchor, start, reading)
    return plain and (alone or _ends_line(text, anchor, start, reading))


def alternative(text: str, anchor: int, start: int) -> str:
    """Name the condition of the second call in `clean("pan") or clean("pot")`."""
    gap = text[anchor:start] if start - anchor <= _LOOK else ""
    return "or" if gap.strip(" `*,") == "or" else ""


def trailing_condition(text: str, reading: Reading) -> str:
    """Find the condition behind a call: `clean("pan") if it is dirty`."""
    match = None if reading.error else _TRAILING_IF.match(text, reading.end)
    if match is None:
        return ""
    line = text[match.end() : match.end() + _LONG].partition("\n")[0]
    return line.partition("#")[0].strip()


def _stands_alone(text: str, anchor: int, start: int, reading: Reading) -> bool:
    behind = _BEHIND.match(text, reading.end)
    return behind is not None and _leads(text, anchor, start)


def _ends_line(text: str, anchor: int, start: int, reading: Reading) -> bool:
    """Tell whether a line ends with it behind a colon: "Slice the egg: slice(egg, knife)"."""
    colon = _COLON.search(text, max(anchor, start - _LOOK), start)
    return colon is not None and bool(_LINE_END.match(text, reading.end))


def _leads(text: str, anchor: int, start: int) -> bool:
    """Tell whether nothing of a sentence stands between two offsets: "2. ", "; then "."""
    near = start - anchor <= _LOOK
    return near and (start == anchor or bool(_BEFORE.fullmatch(text, anchor, start)))
