"""The runs of a workspace, from their transcripts."""

from dataclasses import asdict, dataclass
from typing import Any

from adaptbot_cli.workspace import Workspace


@dataclass(frozen=True, slots=True)
class PastRun:
    """A run as its transcript tells it; `outcome` is "" if it has not ended."""

    id: str
    task: str
    domain: str
    planner: str
    world: str
    outcome: str
    goal_met: bool

    @property
    def told(self) -> str:
        """What it came to, in words."""
        if not self.outcome:
            return "not ended: adaptbot resume"
        if self.goal_met:
            return "goal met"
        plain = {"executable": "executable, goal not met", "no_plan": "no plan"}
        return plain.get(self.outcome, "findings remain")

    def as_json(self) -> dict[str, Any]:
        """Return the run as a plain object."""
        return {**asdict(self), "outcome": self.outcome or None, "world": self.world or None}


def found_runs(workspace: Workspace, task: str = "", last: int = 20) -> list[PastRun]:
    """Return the newest runs, those of a task if words of it are given; other files are no runs."""
    from adaptbot_cli.adapters.transcript import glanced
    from adaptbot_cli.core.names import words
    from adaptbot_cli.errors import UsageError

    found: list[PastRun] = []
    for path in sorted(workspace.transcripts.glob("*.yaml"), reverse=True):
        try:
            header, end = glanced(path)
        except UsageError:
            continue
        asked = str(header.get("task", ""))
        if not set(words(task)) <= set(words(asked)):
            continue
        domain, planner, world = (str(header.get(k) or "") for k in ("domain", "planner", "world"))
        outcome, met = str(end.get("outcome") or ""), end.get("goal_met") is True
        found.append(PastRun(path.stem, asked, domain, planner, world, outcome, met))
        if len(found) == last:
            break
    return found
