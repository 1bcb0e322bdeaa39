"""`adaptbot progress`: what became of each thing, of runs of every kind."""

import io
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from adaptbot_cli.adapters.display.progress_lines import mermaid, progress_lines, svg
from adaptbot_cli.adapters.transcript.documents import dump
from adaptbot_cli.adapters.transcript.loading import read
from adaptbot_cli.core.view.progress import Event, Progress, ProgressLine
from adaptbot_cli.errors import ReplayError, UsageError
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.past_runs import find_run, retrace
from adaptbot_cli.workspace import Workspace
from tests.cli.command import Home
from tests.cli.shape import misfits

TRANSCRIPTS = sorted(bundled("transcripts").glob("*.yaml"))
NOWHERE = Workspace(Path("/nowhere"))
SHAPE: dict[str, Any] = {
    "task": str, "domain": str, "executed": bool, "stopped": (str, type(None)),
    "note": (str, type(None)),
    "steps": list, "lines": list,
}  # fmt: skip


@pytest.fixture(scope="module")
def omelette(used: Home) -> Home:
    """Return a home in which an omelette was made, after the laundry."""
    for task, domain in (("wash the clothes", "household"), ("make omelette", "kitchen")):
        assert used.adaptbot("run", task, "--domain", domain, "--no-human").code == 0
    return used


def line(told: Any, name: str) -> Any:
    return next(line for line in told["lines"] if line["name"] == name)


def way(told: Any, name: str) -> list[tuple[str, str]]:
    return [(e["kind"], " ".join(e["what"])) for e in line(told, name)["events"]]


def test_what_happened_to_the_egg(omelette: Home) -> None:
    ended = omelette.adaptbot("progress", "--json")
    told = ended.json()
    assert (ended.code, ended.err) == (0, "") and told.keys() == SHAPE.keys()
    assert told["executed"] and told["stopped"] is None
    assert misfits(told["steps"][0], {"n": int, "call": str}) == []
    assert told["lines"][0]["name"] == "egg" and told["lines"][0]["required"]
    assert line(told, "egg")["start"] == "fridge"
    assert way(told, "egg") == [
        ("place", "robot_arm"), ("place", "bowl"), ("with", "salt"), ("state", "contents mixed"),
        ("place", "pan"), ("with", "oil"), ("state", "fried"), ("place", "plate"),
    ]  # fmt: skip
    assert ("gained", "egg salt") in way(told, "pan") and ("lost", "egg oil salt") in way(
        told, "pan"
    )
    assert way(told, "plate")[-1] == ("gained", "egg oil salt")
    steps = {step["n"]: step["call"] for step in told["steps"]}
    fried = next(e for e in line(told, "egg")["events"] if e["what"] == ["fried"])
    assert steps[fried["step"]] == "fry(egg, pan)"
    names = {line["name"] for line in told["lines"]}
    assert names == {"egg", "salt", "oil", "bowl", "pan", "plate", "stove"}


def test_the_terminal_shows_the_same_at_every_width(omelette: Home) -> None:
    for columns in ("40", "80", "140", "200"):
        shown = omelette.adaptbot("progress", COLUMNS=columns)
        rows = shown.out.splitlines()
        assert max(map(len, rows)) <= int(columns)
        for word in ("egg", "bowl", "pan", "plate", "fried", "fridge"):
            assert word in shown.out, columns
        assert ("━" in shown.out) == (int(columns) >= 140)


def test_the_latest_run_a_name_and_the_beginning_of_a_task(omelette: Home) -> None:
    first, last = sorted((omelette.workspace / "transcripts").glob("*.yaml"))
    names = [[], [last.stem], [last.stem[:-4]], ["make_ome"], ["make omelette"]]
    latest, *same, by_name, by_path = omelette.adaptbots(
        [["progress", *name, "--json"] for name in (*names, ["wash"], [str(first)])]
    )
    assert {ended.out for ended in same} == {latest.out}
    laundry = by_name.json()
    assert ("state", "clean") in way(laundry, "clothes")
    assert ("place", "washing_machine") in way(laundry, "detergent")
    assert by_path.json() == laundry


def test_a_name_that_means_no_run_or_several(omelette: Home) -> None:
    names = ("2", "soup", "", "../x", "\x1b[31m", ".")
    for ended in omelette.adaptbots([["progress", "--", name] for name in names]):
        assert ended.code == 2 and ended.err.startswith("error: ") and "\x1b" not in ended.err
        assert "wash_the_clothes" in ended.said


def test_no_run_yet(home: Home) -> None:
    ended = home.adaptbot("progress")
    assert ended.code == 2 and "no run is recorded" in ended.err


def test_what_is_no_transcript(omelette: Home) -> None:
    texts = ("", "hello", "a: [", "adaptbot: 1\n")
    odd = [omelette.write(f"odd{n}.yaml", text) for n, text in enumerate(texts)]
    for ended in omelette.adaptbots([["progress", path] for path in odd]):
        assert ended.code == 2 and "Traceback" not in ended.err


def test_the_picture_and_where_it_cannot_be_written(omelette: Home) -> None:
    path = omelette.folder / "lines.svg"
    ended = omelette.adaptbot("progress", "--svg", str(path))
    assert (ended.code, ended.out) == (0, "") and "written to" in ended.err
    text = "".join(ET.parse(path).getroot().itertext()).replace("\xa0", " ")
    assert all(word in text for word in ("egg", "╵fried", "plate", "╵+ salt"))
    ended = omelette.adaptbot("progress", "--svg", str(omelette.folder / "no" / "lines.svg"))
    assert ended.code == 2 and "cannot write" in ended.err
    ended = omelette.adaptbot("progress", "--json", "--mermaid")
    assert ended.code == 2


NODE = r't\d+s\d+(\(\["[^"\n]*"\]\)|\["[^"\n]*"\]|\("[^"\n]*"\))?'
FLOWCHART = re.compile(
    rf'flowchart LR\n((  subgraph t\d+\["[^"\n]*"\]\n    direction LR\n'
    rf'(    {NODE}( -->\|"[^"\n]*"\| {NODE})?\n)+  end\n)+|  nothing\["[^"\n]*"\]\n)'
)


def shown_in_every_way(progress: Progress) -> None:
    """Draw progress lines in each form and check the form."""
    for width in (30, 80, 140):
        console = Console(width=width, record=True, file=io.StringIO())
        console.print(progress_lines(progress, width))
        text = console.export_text()
        assert all(visible_line.isprintable() for visible_line in text.splitlines())
    assert FLOWCHART.fullmatch(mermaid(progress)), mermaid(progress)
    ET.fromstring(svg(progress))


@pytest.mark.parametrize("path", TRANSCRIPTS, ids=lambda path: path.stem)
def test_every_transcript_has_lines(path: Path) -> None:
    progress = retrace(path, NOWHERE)
    assert progress.lines
    shown_in_every_way(progress)
    assert retrace(path, NOWHERE) == progress


@pytest.mark.parametrize("most", [6, pytest.param(1_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("path", TRANSCRIPTS, ids=lambda path: path.stem)
def test_an_interrupted_transcript_is_told_as_far_as_it_came(
    path: Path, most: int, tmp_path: Path
) -> None:
    """It is cut after each of its documents, or after about so many, the last but one too."""
    header, turns = read(path)
    whole = retrace(path, NOWHERE)
    told = 0
    for count in sorted({*range(0, len(turns), len(turns) // most + 1), len(turns) - 1}):
        cut = tmp_path / "cut.yaml"
        cut.write_text("".join(map(dump, (header, *turns[:count]))), encoding="utf-8")
        try:
            progress = retrace(cut, NOWHERE)
        except UsageError as error:
            assert "before there was a plan" in str(error)
            continue
        told += 1
        shown_in_every_way(progress)
    assert told and replace(progress, note="") == whole, "all but the last document tells all"


def test_a_transcript_that_tells_another_story_is_refused(tmp_path: Path) -> None:
    path = next(path for path in TRANSCRIPTS if path.stem == "goal-not-met")
    header, turns = read(path)
    odd = tmp_path / "odd.yaml"
    turns[-1]["goal_met"] = not turns[-1]["goal_met"]
    odd.write_text("".join(map(dump, (header, *turns))), encoding="utf-8")
    with pytest.raises(ReplayError, match="goal_met"):
        retrace(odd, NOWHERE)


def test_a_run_that_cannot_be_executed(home: Home) -> None:
    plan = 'pick_up_obj("egg")\nput_down_obj("egg", "bowl")\nfry("water", "pan")\nslice("water")\n'
    script = (
        dump({"adaptbot": 1, "task": "odd dish", "domain": "kitchen", "replans": 0})
        + dump({"turn": "ask", "kind": "reading", "about": "odd_dish", "answer": "y"})
        + dump({"turn": "propose", "reply": plan})
        + dump({"turn": "ask", "kind": "mend", "about": "odd_dish", "answer": "no"})
        + dump({"turn": "finished", "outcome": "findings"})
    )
    ended = home.adaptbot("progress", home.write("odd.yaml", script), "--json")
    told = ended.json()
    assert ended.code == 0 and not told["executed"] and told["stopped"]
    assert way(told, "egg")[:2] == [("place", "robot_arm"), ("place", "bowl")]
    assert all("slice" not in step["call"] for step in told["steps"])
    shown = home.adaptbot("progress", str(home.folder / "odd.yaml"))
    assert "rehearsed, not executed" in shown.said and "stopped: " in shown.said


def test_a_run_on_files_that_are_edited_and_not_committed(home: Home) -> None:
    assert home.adaptbot("domain", "new", "garden").code == 0
    path = home.workspace / "kg/garden/state.ttl"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("ex:vase ex:lies_in ex:shelf", "ex:vase ex:lies_in ex:bench"))
    assert home.adaptbot("run", "pack the vase", "--domain", "garden", "--no-human").code == 0
    told = home.adaptbot("progress", "--json").json()
    assert line(told, "vase")["start"] == "bench"
    assert [what for kind, what in way(told, "vase") if kind == "place"][-1] == "crate"
    assert "files as they are now" in told["note"]
    path = home.workspace / "kg/garden/attributes.ttl"
    path.write_text(path.read_text().replace("ex:is_fragile true", "ex:is_fragile false"))
    assert home.adaptbot("progress").code == 3  # the story is another one now


def test_hostile_names_are_only_text() -> None:
    odd = '<script>"]; end %% [bold]\x1b[31m`_*'
    event = Event(1, "with", (odd, "- a", "1. b"), odd)
    lines = (ProgressLine(odd, odd, True, odd, (event, Event(1, "place", (odd,)))),)
    progress = Progress(odd, odd, ((1, odd),), lines, False, odd)
    shown_in_every_way(progress)
    assert "<script>" not in svg(progress) and "\x1b" not in mermaid(progress)


def test_a_plan_that_changes_nothing() -> None:
    shown_in_every_way(Progress("nothing", "kitchen", (), (), True))


def test_finding_a_run_writes_nothing(tmp_path: Path) -> None:
    with pytest.raises(UsageError):
        find_run(Workspace(tmp_path / "none"), "x")
    assert not (tmp_path / "none").exists()
