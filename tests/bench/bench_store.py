"""How long the store takes on homes of 1,000, 10,000 and 100,000 things.

    pytest -n 0 tests/bench/bench_store.py --benchmark-disable-gc

Loading and writing are compared with the engine's own (pyoxigraph) and with rdflib's parser and
serializer; a check with the one at the smallest size. rdflib is left out at the largest size, where
it takes minutes, unless ADAPTBOT_BENCH_ALL is set. Nothing is asserted of the times.
"""

import os
import time
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import pyoxigraph
import pytest
import rdflib
from rdflib import RDF, Literal

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.keeper import Keeper, start
from adaptbot_cli.adapters.store.reading import FACT_FILES, load_kg, triples
from adaptbot_cli.adapters.store.turtle import serialize
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import ATTRIBUTES, STATES
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.resources import bundled
from adaptbot_cli.session import replay
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import ORIGIN, ex, learned
from tests.asking import task_for
from tests.bench.synthetic import PLAN, grown
from tests.bench.table import Table

SIZES = (1_000, 10_000, 100_000)
TURTLE = pyoxigraph.RdfFormat.TURTLE
WITH_RDFLIB = 100_000 if os.environ.get("ADAPTBOT_BENCH_ALL") else 10_000
_checks: dict[int, float] = {}


@cache
def home(size: int) -> dict[str, bytes]:
    """Return the files of a home."""
    return grown(read_files(bundled("kg") / "kitchen"), size)


@cache
def graph(size: int) -> Kg:
    return load_kg(home(size), "home")


def median(work: Callable[[], object], rounds: int = 5) -> float:
    """Return the median time in seconds, warmed up once."""
    work()
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return sorted(times)[rounds // 2]


def raw_load(size: int) -> pyoxigraph.Store:
    """Load the two files of facts as the engine does by itself."""
    store = pyoxigraph.Store()
    for name, graph_name in FACT_FILES.items():
        store.bulk_load(home(size)[name], TURTLE, to_graph=pyoxigraph.NamedNode(graph_name))
    return store


def raw_dump(store: pyoxigraph.Store) -> list[bytes]:
    names = (pyoxigraph.NamedNode(name) for name in (ATTRIBUTES, STATES))
    return [store.dump(None, TURTLE, from_graph=name) for name in names]


@pytest.mark.parametrize("size", SIZES)
def test_load(size: int, table: Table) -> None:
    ours, raw = median(partial(load_kg, home(size), "home")), median(partial(raw_load, size))
    table.add(f"load {size:,} things", ours, raw, "2x of Oxigraph's bulk load")
    if size <= WITH_RDFLIB:
        begun = time.perf_counter()
        for name in FACT_FILES:
            rdflib.Graph().parse(data=home(size)[name], format="turtle")
        table.add("  the same, against rdflib's parser", ours, time.perf_counter() - begun, "")


@pytest.mark.parametrize("size", SIZES)
def test_write(size: int, table: Table) -> None:
    found = [triples(home(size)[name], name) for name in FACT_FILES]
    prefixes = {"ex": "http://example.org/"}
    ours = median(lambda: [serialize(facts, prefixes) for facts in found], 3)
    table.add(f"write {size:,} things", ours, median(partial(raw_dump, raw_load(size))), "")
    if size <= WITH_RDFLIB:
        graphs = [rdflib.Graph() for _ in found]
        for one, facts in zip(graphs, found, strict=True):
            one.addN((*fact, one) for fact in facts)
        begun = time.perf_counter()
        for one in graphs:
            one.serialize(format="turtle")
        table.add("  the same, against rdflib's serializer", ours, time.perf_counter() - begun, "")


@pytest.mark.parametrize("size", (0, *SIZES))
def test_commit(size: int, table: Table, tmp_path: Path) -> None:
    """One fact more, in a process that has committed before."""
    root = tmp_path / "home"
    files = {f"kg/kitchen/{name}": data for name, data in home(size).items()}
    first = Workspace(root).first_files("kitchen")
    start(root, "kitchen", lambda: {**first, **files}, ORIGIN.now)
    keeper, numbers = Keeper(root, "kitchen", ORIGIN), iter(range(1_000))

    def commit() -> None:
        name = f"leek_{next(numbers)}"
        keeper.keep(
            learned((ex(name), RDF.type, ex("object")), (ex(name), ex("obj_name"), Literal(name)))
        )

    seconds = median(commit, 9 if size < 100_000 else 3)
    raw = median(lambda: raw_dump(raw_load(size)), 3)
    what = f"{size:,} more things" if size else "the kitchen as it comes"
    table.add(f"commit a thing, {what}", seconds, raw, "below 50 ms" if not size else "")


@pytest.mark.parametrize("size", SIZES)
def test_validate(size: int, table: Table) -> None:
    table.add(f"validate {size:,} things", median(partial(faults, graph(size)), 1), None, "")


@pytest.mark.parametrize("size", SIZES)
def test_check(size: int, table: Table) -> None:
    kg = graph(size)
    task = task_for("make tea", kg)

    def check() -> None:
        kg.forget()
        assert replay.check(PLAN, task, kg).goal_met

    _checks[size] = median(check, 15)
    table.add(f"check 13 steps, {size:,} things", _checks[size], _checks[SIZES[0]], "1.5x")
