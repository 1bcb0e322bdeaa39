"""Lines without a call: which say nothing, which are remarks, and which were meant as a step."""

import re

LONG = 300
"""How much of a line is looked at."""

_SILENT = re.compile(
    r"(?:[\s\[\](){};,.`*_=\-|>~]*|\w+\s*=\s*[\[({]|pass|return(?:\s+\w+)?|end\s*\w*"
    r"|<[/?]?\w[^<>]*>|assert\s+\w+|self\.\w+\s*=\s*\w+"
    r"|(?:from\s+[\w.]+\s+)?import\s+[\w.*, ]+)(?:\s+#.*)?"
)
_SENTENCE = re.compile(
    r"(?:[A-Z\d]|[-*•]\s)[^=(\"]*\s[^=(\"]*[.:!?]|[A-Z\d\s&.,:-]+|\w[\w ]*:|\*\*.*\*\*:?"
)
_HEADING = re.compile(r"[\s>]*#|.*:[\s*_]*\Z|[\W\d]*(?:\*\*|__).*(?:\*\*|__)\s*\Z")
_ATTEMPT = re.compile(r"[a-z]+_\w+(?:\[|\s+[\"“'‘])")


def is_comment(line: str, fenced: bool) -> bool:
    """Tell whether a line holds a remark only. A Markdown heading may hold a call."""
    line = line.lstrip()
    if not line.startswith(("#", "//", '"""')):
        return False
    return fenced or not (line.startswith("##") or "`" in line)


def is_silent(line: str) -> bool:
    """Tell whether a line says nothing of a plan: brackets, `pass`, imports."""
    return _SILENT.fullmatch(line) is not None


def is_unknown(line: str) -> bool:
    """Tell whether a line of a code block says something that is neither call nor remark."""
    if len(line) > LONG:
        return True
    return not (is_silent(line) or _SENTENCE.fullmatch(line))


def is_heading(line: str) -> bool:
    """Tell whether a line announces what comes below it."""
    return _HEADING.match(line) is not None


def is_attempt(line: str) -> bool:
    """Tell whether a line was meant as a call, without parentheses."""
    return _ATTEMPT.match(line) is not None
