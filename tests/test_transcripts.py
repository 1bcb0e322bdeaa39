"""Every bundled transcript replays, and together they show each kind of run."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.adapters.transcript.loading import read
from adaptbot_cli.adapters.transcript.recorder import Recorder
from adaptbot_cli.core.turns import Ask, Checked, Learned, Propose
from adaptbot_cli.resources import bundled
from adaptbot_cli.session import replay
from adaptbot_cli.session.sources import kg_of
from adaptbot_cli.workspace import Workspace

FILES = sorted(bundled("transcripts").glob("*.yaml"))


class Seen:
    """An observer that keeps the turns of a run."""

    def __init__(self) -> None:
        self.turns: list[tuple[Any, Any]] = []

    def asked(self, turn: Any) -> None:
        """Keep nothing: the reply is not there yet."""

    def replied(self, turn: Any, reply: Any) -> None:
        self.turns.append((turn, reply))

    def all(self, kind: type) -> list[tuple[Any, Any]]:
        return [(turn, reply) for turn, reply in self.turns if isinstance(turn, kind)]

    def answered(self, subject: str, value: str) -> bool:
        """Whether an existence question was answered so."""
        return any(
            turn.question.kind == "existence"
            and turn.question.subject == subject
            and reply.value.split()[0] == value
            for turn, reply in self.all(Ask)
        )


def recorded(source: Path, target: Path, *observers: Any) -> Any:
    """Replay a transcript, without any workspace, and record that; return the result."""
    nowhere = Workspace(target.parent / "none")
    header, _ = read(source)
    with target.open("w", encoding="utf-8") as file:
        recorder = Recorder(file, kg_of(header, source, nowhere))
        recorder.header({k: v for k, v in header.items() if k != "adaptbot"})
        result = replay.replay(source, nowhere, [*observers, recorder])
        recorder.finished(result)
    assert not nowhere.root.exists()
    return result


@pytest.fixture(scope="module")
def copies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of what was recorded of the replays."""
    return tmp_path_factory.mktemp("copies")


@pytest.fixture(scope="module")
def runs(copies: Path) -> dict[str, tuple[Seen, Any]]:
    """Replay all of them."""
    found = {}
    for path in FILES:
        seen = Seen()
        found[path.stem] = (seen, recorded(path, copies / path.name, seen))
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_replays_to_its_documented_end(path: Path, runs: dict[str, tuple[Seen, Any]]) -> None:
    _, turns = read(path)
    assert turns[-1]["turn"] == "finished", "a golden transcript pins its end"
    result = runs[path.stem][1]
    assert (result.verdict, result.goal_met) == (turns[-1]["outcome"], turns[-1]["goal_met"])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_says_what_it_shows(path: Path) -> None:
    assert path.read_text(encoding="utf-8").startswith("# ")


def _refines(seen: Seen, _: Any) -> bool:
    steps = (step for turn, _ in seen.all(Checked) for step in turn.report.steps)
    return any(step.changes for step in steps)


def _inserts(seen: Seen, _: Any) -> bool:
    steps = (step for turn, _ in seen.all(Checked) for step in turn.report.steps)
    return any(step.status == "inserted" for step in steps)


def _guards(seen: Seen, _: Any) -> bool:
    findings = (finding for turn, _ in seen.all(Propose) for finding in turn.findings)
    return any(finding.code == "E502" for finding in findings)


KINDS: dict[str, Callable[[Seen, Any], bool]] = {
    "an item that exists": lambda seen, _: seen.answered("item", "exists"),
    "an item that is not there": lambda seen, _: seen.answered("item", "absent"),
    "another name for an item": lambda seen, _: seen.answered("item", "is"),
    "an action that exists": lambda seen, _: seen.answered("action", "exists"),
    "an action that is not possible": lambda seen, _: seen.answered("action", "absent"),
    "another name for an action": lambda seen, _: seen.answered("action", "is"),
    "an attribute asked for": lambda seen, _: any(
        turn.question.kind == "attribute" for turn, _ in seen.all(Ask)
    ),
    "a refinement": _refines,
    "a missing step": _inserts,
    "a re-prompt": lambda seen, _: any(turn.attempt for turn, _ in seen.all(Propose)),
    "a required item guarded": _guards,
    "a plan mended": lambda seen, result: (
        result.goal_met and any(turn.question.kind == "mend" for turn, _ in seen.all(Ask))
    ),
    "an answer corrected": lambda seen, _: any(reply.to for _, reply in seen.all(Ask)),
    "a goal that is not met": lambda _, result: not result.goal_met,
    "no model at all": lambda _, result: result.usage.model_calls == 0,
    "something learned": lambda seen, _: bool(seen.all(Learned)),
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_run_is_shown(kind: str, runs: dict[str, tuple[Seen, Any]]) -> None:
    assert any(KINDS[kind](seen, result) for seen, result in runs.values())


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_replay_that_is_recorded_replays_to_the_same_bytes(
    path: Path, runs: dict[str, tuple[Seen, Any]], copies: Path, tmp_path: Path
) -> None:
    assert path.stem in runs
    again = tmp_path / path.name
    recorded(copies / path.name, again)
    assert again.read_bytes() == (copies / path.name).read_bytes()
