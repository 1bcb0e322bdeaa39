"""What must come to an end: a hang becomes a failure, and nothing is said of how long it takes."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

MINUTES = 5


@contextmanager
def ends() -> Iterator[None]:
    """Let the block end by itself; after some minutes it hangs, and the test fails."""
    if not hasattr(signal, "SIGALRM"):
        yield
        return

    def hung(number: int, frame: FrameType | None) -> None:
        raise AssertionError(f"it did not end in {MINUTES} minutes")

    before = signal.signal(signal.SIGALRM, hung)
    signal.alarm(MINUTES * 60)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
