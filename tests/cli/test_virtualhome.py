"""The bridge to VirtualHome's simulator, where the package with the simulator is installed."""

import importlib
import os
import sys
from pathlib import Path
from typing import Final

import pytest

from tests.cli.command import ROOT, Ended, Home

package = pytest.importorskip("virtualhome_eval")
pytest.importorskip("numpy")

EXAMPLE: Final = ROOT / "examples" / "virtualhome"
PATH: Final = os.pathsep.join([str(ROOT), str(Path(package.__file__).parents[1])])
BOOK: Final = "1073_1"
"""The number of a task that reads a book."""


@pytest.fixture
def reading(home: Home) -> Home:
    """Return a home with the household of a task, and the package's own steps as its plan."""
    made = home.python(
        str(EXAMPLE / "make_pack.py"), BOOK, "--workspace", str(home.workspace), PYTHONPATH=PATH
    )
    assert made.code == 0 and 'adaptbot run "read book"' in made.out, made.err
    return home


def bridge(*more: str) -> str:
    words = ["env", f"PYTHONPATH={PATH}", sys.executable, str(EXAMPLE / "bridge.py"), BOOK, *more]
    return "exec:" + " ".join(f"'{word}'" for word in words)


def run(home: Home, *more: str) -> Ended:
    return home.adaptbot(
        *("run", "read book", "--domain", "virtualhome", "--no-human", "--json"),
        *("--world", bridge(*more)),
    )


def test_the_pack_is_sound_and_the_bridge_keeps_to_the_protocol(reading: Home) -> None:
    assert reading.adaptbot("domain", "check", "virtualhome").code == 0
    ended = reading.adaptbot("world", "check", bridge(), "--domain", "virtualhome", "--json")
    assert ended.code == 0 and ended.json()["good"], ended.said


def test_the_steps_of_the_package_meet_its_goal_in_its_simulator(reading: Home) -> None:
    ended = run(reading)
    assert ended.code == 0 and ended.json()["world"]["failed"] == 0, ended.said


def test_a_book_that_lies_somewhere_else_is_found_though_nobody_is_there(reading: Home) -> None:
    ended = run(reading, "--move", "novel=inside:filing_cabinet")
    told = ended.json()
    assert ended.code == 0 and told["goal"]["met"], ended.said
    calls = [step["call"] for step in told["steps"] if step["status"] == "inserted"]
    assert ["open", "filing_cabinet"] in calls


def test_the_simulator_has_the_last_word(reading: Home) -> None:
    plan = reading.workspace / "prompts" / "library" / "virtualhome" / "task.plan"
    plan.write_text(plan.read_text(encoding="utf-8").replace('read("novel")\n', ""))
    told = run(reading).json()
    assert not told["goal"]["met"]
    assert "read or lookat must be done" in str(told["findings"])


def test_a_script_that_is_exported_is_executed_by_the_simulator(
    reading: Home, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = reading.write("book.plan", 'grab("novel")\nsit("chair_356")\nread("novel")\n')
    asked = ("export", plan, "--domain", "virtualhome", "--task", "read book", "--as", "script")
    script = reading.adaptbot(*asked)
    assert script.code == 0 and "[WALK] <novel> (1)" in script.out
    monkeypatch.syspath_prepend(str(EXAMPLE))
    scene = importlib.import_module("scene")
    task, simulator = scene.Task(BOOK), scene.simulator()
    names = simulator.utils.load_name_equivalence()
    graph = simulator.environment.EnvironmentGraph(task.graph)
    lines = simulator.scripts.read_script_from_list_string(script.out.splitlines())
    end = next(simulator.execution.ScriptExecutor(graph, names).find_solutions(lines), None)
    assert end is not None
    assert task.unmet(end.to_dict(), script.out.splitlines()) == []
