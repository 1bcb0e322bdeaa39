"""What a text's code has given names to, and the loops that can be unrolled with it."""

import re
from dataclasses import dataclass, field

from adaptbot_cli.core.parsing.loops import Value, read_binding, unroll
from adaptbot_cli.core.parsing.scan import Item, Reading, kept
from adaptbot_cli.core.plan import keyworded

_LOOP = re.compile(r"for\s+\w[\w\s,]*\bin\b[^\n]*:\s*(?:#[^\n]*)?\Z")
_MADE = re.compile(r"(\w+)[^\S\n]*=[^\S\n]*\Z")
_LOOK = 300


@dataclass(slots=True)
class Known:
    """The constants of a text, read as they come; `unused` tells where those of code stand that
    nothing has made use of, with their lines."""

    text: str
    unused: dict[str, tuple[int, str]] = field(default_factory=dict)
    _names: dict[str, Value] = field(default_factory=dict)

    def bind(self, start: int, end: int, code: bool) -> int:
        """Take note of a constant; returns the end of what binds it, 0 if the line is no such."""
        binding = read_binding(self.text, start, end)
        if binding is None:
            return 0
        self._names[binding.name] = binding.value
        if code:
            self.unused[binding.name] = (start, self.text[start:end].rstrip())
        return binding.end

    def loop(self, start: int, content: int, end: int) -> tuple[list[Item], int]:
        """Read a loop over constants as its steps, turn by turn; returns them and the line's end.

        No items: the loop depends on more than what is written.
        """
        if not _LOOP.match(self.text, content, end):
            return [], end
        after = self._block_end(start, end)
        block = self.text[start:after]
        turns, used = unroll(block, self._names) or ([], set[str]())
        lines = [start]
        for line in block.splitlines(keepends=True):
            lines.append(lines[-1] + len(line))
        for name in used:
            self.unused.pop(name, None)
        items = [Item(lines[t.line], t.source, keyworded(t.action, kept(t.args))) for t in turns]
        return items, after

    def meant(self, reading: Reading, source: str) -> list[tuple[str, str]]:
        """Return a call's arguments, a name without quotes as what it has been given to mean."""
        return [(name, self._constant(arg, source)) for name, arg in reading.named()]

    def makes_receiver(self, start: int, reading: Reading) -> bool:
        """Tell whether this is `robot = Robot()`, and `robot` is what calls are made on."""
        made = _MADE.search(self.text[max(0, start - _LOOK) : start])
        return made is not None and not reading.args and f"{made[1]}." in self.text

    def _constant(self, arg: str, source: str) -> str:
        value = self._names.get(arg)
        if not isinstance(value, str) or re.search(rf"[\"'“‘`]{arg}[\"'”’`]", source):
            return arg
        self.unused.pop(arg, None)
        return value

    def _block_end(self, start: int, end: int) -> int:
        """Find the end of the last line that is indented deeper than the one at `start`."""
        indent, last = indent_of(self.text, start), end
        while end < len(self.text):
            line, end = end + 1, self.text.find("\n", end + 1)
            end = len(self.text) if end < 0 else end
            blank = not self.text[line:end].strip()
            if not blank and indent_of(self.text, line) <= indent:
                break
            last = last if blank else end
        return last


def indent_of(text: str, start: int) -> int:
    """Return how many columns the line at `start` is indented."""
    line = text[start : start + _LOOK].expandtabs(4)
    return len(line) - len(line.lstrip())
