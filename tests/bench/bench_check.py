"""How long it takes to check and execute a plan of 13 steps once everything is loaded.

The published implementation spends about half a second on each step; nothing is asserted.
"""

from pathlib import Path

from pytest_benchmark.fixture import BenchmarkFixture

from adaptbot_cli.adapters.store import reading
from adaptbot_cli.core.report import Result
from adaptbot_cli.session import replay, sources
from adaptbot_cli.workspace import Workspace
from tests.asking import task_for
from tests.bench.synthetic import PLAN
from tests.bench.table import Table

PUBLISHED_STEP = 0.5
"""Seconds a step, in the paper's published implementation."""


def test_check_and_execute(benchmark: BenchmarkFixture, table: Table, tmp_path: Path) -> None:
    kg = sources.load(Workspace(tmp_path / "none"), "kitchen")
    task = task_for("make tea", kg)

    def check() -> Result:
        kg.forget()  # a plan looked at again is answered from memory
        return replay.check(PLAN, task, kg)

    result: Result = benchmark(check)
    assert result.goal_met and len(result.report.steps) == 13
    seconds = float(benchmark.stats.stats.median)
    table.add("check and execute 13 steps", seconds, None, "below 15 ms")
    table.add("one step, against the published 0.5 s", seconds / 13, PUBLISHED_STEP, "")


def test_load(benchmark: BenchmarkFixture, table: Table, tmp_path: Path) -> None:
    workspace = Workspace(tmp_path / "none")

    def load() -> None:
        reading._examined.cache_clear()  # a pack read again in one process is remembered
        sources.load(workspace, "kitchen")

    benchmark.pedantic(load, rounds=10, warmup_rounds=1)
    table.add("load the kitchen", float(benchmark.stats.stats.median), None, "")
