"""How long commands take to start, against an empty Typer application with Rich help.

    pytest -n 0 tests/bench/bench_startup.py tests/bench/bench_check.py --benchmark-disable-gc

The ratios are of one run on one machine; nothing is asserted of them.
"""

import subprocess
import sys
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.bench.table import Table
from tests.cli.command import Home

ROUNDS = 15
EMPTY = """
import typer

app = typer.Typer(help="An empty application.")


@app.command()
def nothing(name: str = "") -> None:
    '''Do nothing.'''


app()
"""
COMMANDS = {
    "adaptbot --help": (["-m", "adaptbot_cli", "--help"], "at most 1.5x"),
    "adaptbot kg show": (["-m", "adaptbot_cli", "kg", "show"], "at most 3x"),
    'adaptbot run "make omelette"': (
        ["-m", "adaptbot_cli", "run", "make omelette", "--dry-run"],
        "",
    ),
}
LIVE = ["-m", "adaptbot_cli", "run", "make omelette", "--dry-run", "--model", "openai/none"]
"""A run with a live model; that nobody listens there is told after the first line."""
_medians: dict[str, float] = {}


def median(benchmark: BenchmarkFixture, home: Home, arguments: list[str]) -> float:
    """Return the median time of a command, warmed up, in seconds."""

    def start() -> None:
        subprocess.run(
            [sys.executable, *arguments],
            cwd=home.folder,
            env=home.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=True,
        )

    benchmark.pedantic(start, rounds=ROUNDS, warmup_rounds=1)
    return float(benchmark.stats.stats.median)


def test_empty_application(benchmark: BenchmarkFixture, table: Table, tmp_path: Path) -> None:
    script = tmp_path / "empty.py"
    script.write_text(EMPTY)
    seconds = median(benchmark, Home(tmp_path), [str(script), "--help"])
    _medians["empty"] = seconds
    table.add("an empty Typer application, --help", seconds, seconds, "baseline")


@pytest.mark.parametrize("name", COMMANDS)
def test_command(name: str, benchmark: BenchmarkFixture, table: Table, tmp_path: Path) -> None:
    arguments, goal = COMMANDS[name]
    seconds = median(benchmark, Home(tmp_path), arguments)
    table.add(name, seconds, _medians["empty"], goal)


def test_first_line_of_a_live_run(
    benchmark: BenchmarkFixture, table: Table, tmp_path: Path
) -> None:
    home = Home(tmp_path)
    address = ["--api-base", "http://127.0.0.1:9/v1"]

    def start() -> None:
        with subprocess.Popen(
            [sys.executable, *LIVE, *address],
            cwd=home.folder,
            env={**home.environment(), "OPENAI_API_KEY": "none"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as process:
            assert process.stdout is not None and process.stdout.read(1)
            process.kill()

    benchmark.pedantic(start, rounds=ROUNDS, warmup_rounds=1)
    seconds = float(benchmark.stats.stats.median)
    table.add("first line of a run with a live model", seconds, _medians["empty"], "0.5 s")
