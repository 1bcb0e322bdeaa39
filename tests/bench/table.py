"""The table in which benchmarks show what they have measured."""

from collections.abc import Iterator

Row = tuple[str, float, float | None, str]


class Table:
    """Rows of a name, median seconds, the baseline's, and what we want of it."""

    def __init__(self) -> None:
        self.rows: list[Row] = []

    def add(self, name: str, seconds: float, baseline: float | None, goal: str) -> None:
        self.rows.append((name, seconds, baseline, goal))

    def lines(self) -> Iterator[str]:
        yield f"{'what':44} {'median':>10} {'ratio':>8}  goal"
        for name, seconds, baseline, goal in self.rows:
            ratio = f"{seconds / baseline:.2f}x" if baseline else ""
            yield f"{name:44} {seconds * 1000:7.1f} ms {ratio:>8}  {goal}"
