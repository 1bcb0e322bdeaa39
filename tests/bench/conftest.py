"""Shows what the benchmarks of a run have measured: times, and ratios to a baseline."""

import pytest

from tests.bench.table import Table

_TABLE = pytest.StashKey[Table]()


def pytest_configure(config: pytest.Config) -> None:
    config.stash[_TABLE] = Table()


@pytest.fixture
def table(request: pytest.FixtureRequest) -> Table:
    """Return the table of this run."""
    return request.config.stash[_TABLE]


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    found = terminalreporter.config.stash[_TABLE]
    if found.rows:
        terminalreporter.section("measured in this run")
        for line in found.lines():
            terminalreporter.write_line(line)
