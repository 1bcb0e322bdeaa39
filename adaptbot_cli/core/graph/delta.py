"""Deltas, and the undo log that a rehearsal writes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import count

from adaptbot_cli.core.graph.terms import Triple


@dataclass(frozen=True, slots=True)
class Delta:
    """The triples that an effect or an answer removes and adds."""

    removed: frozenset[Triple] = frozenset()
    added: frozenset[Triple] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.removed or self.added)

    @property
    def inverse(self) -> "Delta":
        """The delta that undoes this one."""
        return Delta(self.added, self.removed)


def net(deltas: Iterable[Delta]) -> Delta:
    """Compose consecutive deltas into one."""
    removed: set[Triple] = set()
    added: set[Triple] = set()
    for delta in deltas:
        removed |= delta.removed - added
        added -= delta.removed
        added |= delta.added - removed
        removed -= delta.added
    return Delta(frozenset(removed), frozenset(added))


_UNSURE = -1
"""The number of a state that may be only partly written: never looked up."""


@dataclass(slots=True)
class UndoLog:
    """A line of changes, and how much of it is written.

    The same changes made from the same state lead to the same state, which bears the same number:
    so that what was found out about a state holds whenever it is come to again. Writing waits until
    something reads.
    """

    write: Callable[[Delta], None]
    state: int = 0
    changes: list[Delta] = field(default_factory=list)
    _past: list[int] = field(default_factory=list)
    _next: dict[tuple[int, Delta], int] = field(default_factory=dict)
    _numbers: "count[int]" = field(default_factory=lambda: count(1))
    _written: list[tuple[int, Delta]] = field(default_factory=list)
    _same: int = 0

    def append(self, delta: Delta) -> None:
        """Append a delta."""
        step = (self.state, delta)
        if step not in self._next:
            self._next[step] = next(self._numbers)
        self.changes.append(delta)
        self._past.append(self.state)
        self.state = self._next[step]

    def back_to(self, mark: int) -> None:
        """Drop every delta after the first `mark`."""
        if mark < len(self.changes):
            self.state = self._past[mark]
            del self.changes[mark:], self._past[mark:]
            self._same = min(self._same, mark)

    def settle(self) -> None:
        """Write what is not written yet, and take back what is written but not of this line.

        An interruption (Ctrl-C) may come between any two steps: what is being written bears no
        state until it is whole, so that the next time takes it back and writes it again.
        """
        if self._same == len(self._written) == len(self.changes):
            return
        states = [*self._past[1:], self.state] if self.changes else []
        written = self._written
        while self._same < min(len(written), len(states)):
            if written[self._same][0] != states[self._same]:
                break
            self._same += 1
        while len(written) > self._same:
            written[-1] = (_UNSURE, written[-1][1])
            self.write(written[-1][1].inverse)
            written.pop()
        for state, delta in zip(states[self._same :], self.changes[self._same :], strict=True):
            written.append((_UNSURE, delta))
            self.write(delta)
            written[-1] = (state, delta)
        self._same = len(written)

    def keep(self) -> None:
        """Make the current state the starting point: earlier deltas can no longer be undone."""
        self.settle()
        self.changes.clear()
        self._past.clear()
        self._next.clear()
        self._written.clear()
        self._same = 0
