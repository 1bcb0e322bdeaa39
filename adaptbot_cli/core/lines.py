"""Reading a text line by line: prose, Markdown and code around the calls."""

import keyword
import re
from dataclasses import dataclass, field

from adaptbot_cli.core.control import Blocks, read_header
from adaptbot_cli.core.jsonplan import read_json
from adaptbot_cli.core.plan import Call
from adaptbot_cli.core.recap import SEPARATED, heading_strength
from adaptbot_cli.core.scan import Item, Reading, name_before, read_args, shown, swallow

_MOST_CALLS = 5000
_MOST_FINDINGS = 1000
_LOOK = 80

_FENCE = re.compile(r"[\s>]*(?:(?:[-*+]|\d+[.)])\s+)?(`{3,}|~{3,})([^`(\"]*)\Z")
_PREFIX = re.compile(r"[\s>|]*(?:(?:[-*+•·–—]|\(?\d{1,4}[.):]\)?|\#{1,6})\s+)*[*_`]*")
_COMMENT = re.compile(r"(?:^|(?<=[\s);`.,]))(?:#(?!\d)|//)")
_JSON = re.compile(r"[^\[{\"'`(]*([\[{])\s*(?:[\[{\"'\]}]|\Z)")
_TRAILING_IF = re.compile(r"[\s`*]*(?:if|unless|or)\b")
_PLURAL = {"s", "es", "ies"}

# What may stand before and behind a call that is no part of a sentence.
_LABEL = r"(?:<\w+>\s*)?(?:\**(?:step|action|call)\s*\d*\s*[.:)\-]+\**\s*)?(?:(?:then|and|next)\b)?"
_BEFORE = re.compile(
    rf"[\s>|*+\-•·–—`_;,.&#]*(?:\(?\d{{1,4}}[.:)]+\s*)?[*_`]*{_LABEL}[\s`*_]*(?:\w+\s*=\s*)?",
    re.IGNORECASE,
)
_BEHIND = re.compile(r"[\s`*_]*(?:\Z|\n|[;,.|#:\-–—→<&\])]|//|(?:then|and)\b)")
_SIMPLE = re.compile(r"[-+]?[\d.]+|[^\W\d]\w*")

_SILENT = re.compile(r"[\s\[\](){};,.`*_=\-|>~]*|\w+\s*=\s*[\[({]|pass|end\s*\w*|<[/?]?\w[^<>]*>")
_SENTENCE = re.compile(r"(?:[A-Z\d]|[-*•]\s)[^=(\"]*\s[^=(\"]*[.:!?]|[A-Z\d\s&.,:-]+|\w[\w ]*:|\*\*.*\*\*:?")
_ATTEMPT = re.compile(r"[a-z]+_\w+\s*(?:\[|[\"“'‘])")


@dataclass(slots=True)
class ReadText:
    """What stands in a text, in order; `gaps` tells what stands before the call of an index."""

    items: list[Item] = field(default_factory=list)
    gaps: dict[int, int] = field(default_factory=dict)


def read_text(text: str) -> ReadText:
    """Read the calls of a text whose lines end in a line feed."""
    reader = _Reader(text)
    reader.read()
    return reader.found


class _Reader:
    def __init__(self, text: str) -> None:
        self.found = ReadText()
        self._text = text
        self._calls = 0
        self._fenced = False
        self._fence_condition = ""
        self._blocks = Blocks()
        self._no_json_before = 0

    def read(self) -> None:
        pos = 0
        while pos < len(self._text):
            end = self._line_end(pos)
            if end == pos or self._text[pos:end].isspace():
                self._blocks.blank()
                pos = end + 1
                continue
            pos = self._read_line(pos, end)
            if self._calls > _MOST_CALLS or len(self.found.items) - self._calls > _MOST_FINDINGS:
                self._stop(pos)
                return

    def _read_line(self, start: int, end: int) -> int:
        """Read the line, and the lines that its last call or its JSON runs on over.

        Returns where to go on: the start of a line.
        """
        if self._read_fence(start, end):
            return end + 1
        after = self._read_json(start, end)
        if after:
            # Only what cannot be JSON any more can hold a call.
            return self._scan(after, self._line_end(after), "") + 1
        content = self._content(start, end)
        if self._is_comment(content, end):
            self._separate(start, end)
            return end + 1
        condition = self._condition_at(content, start)
        header = read_header(self._text, content, end, self._fenced)
        if header is None:
            return self._read_calls(start, content, end, condition) + 1
        if header.opens:
            self._blocks.open(content - start, header.condition)
            return end + 1
        line_end = self._scan(header.body, header.until, header.condition)
        if header.until < end and line_end == end:
            line_end = self._scan(header.until, end, condition)
        return line_end + 1
