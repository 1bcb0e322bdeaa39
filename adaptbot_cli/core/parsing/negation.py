"""Calls that a sentence says are not to be run: `Do not fry("egg")`, `instead of wait(5)`."""

import re

_LOOK = 160
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
    if before and _GOES_ON.fullmatch(text, anchor, min(start, anchor + _LOOK)):
        return before
    found = _NEGATION.search(text[max(anchor, start - _LOOK) : start])
    return found[0].strip(" \t*_`\"'“‘(") if found else ""
