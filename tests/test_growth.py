"""How work grows with a home: counted in calls, not by a clock, at two sizes one of which is four
times the other. An exponent of 0 is work that does not grow, 1 what grows as the facts do.

tests/bench/growth.py measures the time of whole commands, to a million facts.
"""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rdflib import RDF, Literal, URIRef

from adaptbot_cli.adapters.store.engine import ask
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.keeper import Held, start
from adaptbot_cli.adapters.store.reading import check_files, load_kg
from adaptbot_cli.core.ask.suggest import Likely
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.request.understand import understand
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.view import facts as view
from adaptbot_cli.core.words import NoLexicon
from adaptbot_cli.resources import bundled
from adaptbot_cli.session import change, queries, replay
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.knowledge import differences, why
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import ORIGIN, ex
from tests.asking import task_for
from tests.bench.synthetic import PLAN, grown

SMALL, TIMES = 500, 4
ONE = "SELECT ?s WHERE { ?s ex:obj_name ?n } LIMIT 1"
LEEK = Delta(
    added=frozenset(
        {
            (ex("leek"), RDF.type, ex("object")),
            (ex("leek"), ex("obj_name"), Literal("leek")),
            (ex("leek"), ex("obj_location"), ex("fridge")),
        }
    )
)


@pytest.fixture(scope="module")
def homes(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[Home, Home, Path]]:
    """Two sizes: a home of so many things, one that lacks them, and the file that has them."""
    return [_home(size, tmp_path_factory.mktemp("home")) for size in (SMALL, TIMES * SMALL)]


def _home(size: int, folder: Path) -> tuple[Home, Home, Path]:
    files = grown(read_files(bundled("kg") / "kitchen"), size)
    given = folder / "given.ttl"
    given.write_bytes(files["attributes.ttl"] + b"\n" + files["state.ttl"])
    workspace = Workspace(folder / "home")
    first = {**workspace.first_files("kitchen")}
    first |= {f"kg/kitchen/{name}": data for name, data in files.items()}
    start(workspace.root, "kitchen", lambda: first, ORIGIN.now)
    home = Home(workspace, "kitchen")
    assert home.kg and why(home, "egg").facts  # what the history says is kept from now on
    return home, Home(Workspace(folder / "other"), "kitchen"), given


def calls(work: Callable[[], object]) -> int:
    """Return how many calls some work makes, in Python and of what is built in."""
    count = 0

    def heard(_frame: Any, event: str, _arg: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(heard)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def exponent(homes: list[tuple[Home, Home, Path]], work: Callable[..., object]) -> float:
    small, large = (calls(lambda each=each: work(*each)) for each in homes)
    return math.log(large / small, TIMES)


def checked(home: Home, *_: object) -> None:
    home.kg.forget()
    assert replay.check(PLAN, task_for("make tea", home.kg), home.kg).goal_met


def shown(home: Home, *_: object) -> None:
    assert view.thing(home.kg, ex("egg")).name == "egg"


def asked(home: Home, *_: object) -> None:
    assert len(ask(home.kg.engine, ONE, queries.prefixes(home)).rows) == 1


def explained(home: Home, *_: object) -> None:
    assert {t[0] for t in home.matching(URIRef(ex("egg")))} == {ex("egg")}


def judged(home: Home, *_: object) -> None:
    assert Held("kg/kitchen", home._files, home.kg).new_faults(LEEK, {}) == []


@pytest.mark.parametrize("work", [checked, shown, asked, explained, judged])
def test_what_concerns_a_few_things_costs_the_same_in_any_home(
    homes: list[tuple[Home, Home, Path]], work: Callable[..., object]
) -> None:
    exponent(homes, work)  # what is worked out once for a graph is there from now on

    assert exponent(homes, work) < 0.1


def named_near(kg: Kg) -> None:
    assert "egg" in view.near(kg, "eggg")


def understood(kg: Kg) -> None:
    assert understand("make an omlette without eggss", kg, NoLexicon()).guesses


def suggested(kg: Kg) -> None:
    kinds = [kg.domain.classes[URIRef(ex("object"))]]
    Likely("leek", kinds, Scene(kg, task_for("make tea", kg))).kind()


@pytest.mark.parametrize("work", [named_near, understood, suggested])
def test_where_a_home_has_very_many_things_only_so_many_are_compared(
    work: Callable[[Kg], None],
) -> None:
    pack = read_files(bundled("kg") / "kitchen")
    graphs = [load_kg(grown(pack, size), "kg/kitchen") for size in (5_000, 5_000 * TIMES)]
    counted = []
    for kg in graphs:
        work(kg)  # what is worked out once for a graph is there from now on
        counted.append(calls(lambda kg=kg: work(kg)))

    assert math.log(counted[1] / counted[0], TIMES) < 0.2


def validated(home: Home, *_: object) -> None:
    assert check_files(home._files)[1] == []


def imported(_: Home, other: Home, given: Path) -> None:
    parcel, proposal = queries.imported(other, [given], False)
    assert parcel.accepted and not parcel.left_out
    assert change.commit(other, proposal)


def told_apart(home: Home, *_: object) -> None:
    assert differences(home, None, None)[0].delta.added


@pytest.mark.parametrize("work", [validated, imported, told_apart])
def test_what_concerns_the_whole_home_grows_as_its_facts_do(
    homes: list[tuple[Home, Home, Path]], work: Callable[..., object]
) -> None:
    assert exponent(homes, work) < 1.1


def test_a_home_is_judged_by_the_engine(homes: list[tuple[Home, Home, Path]]) -> None:
    facts = [home.kg.size()[1] for home, *_ in homes]
    made = [calls(lambda each=each: validated(*each)) for each in homes]

    assert made[1] - made[0] < 2 * (facts[1] - facts[0])
