"""The plan of a run, or of a text, for a robot's own executive."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.core.report import Report, Result
from adaptbot_cli.core.turns import Executed, Turn
from adaptbot_cli.session.playing import check_request, replay
from adaptbot_cli.session.starting import PDDL_FILES
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from adaptbot_cli.core.kg import Kg
    from adaptbot_cli.core.plan import Finding


@dataclass(frozen=True, slots=True)
class Exported:
    """A plan as a text, "" if it is not one to hand over; `findings` tell why it is not."""

    text: str
    findings: tuple["Finding", ...] = ()


class _Rehearsals:
    """An observer that keeps the last plan of each task that ran through in the rehearsal."""

    def __init__(self) -> None:
        self.reports: dict[object, Report] = {}

    def asked(self, turn: Turn) -> None:
        """Keep nothing: the reply is not there yet."""

    def replied(self, turn: Turn, reply: object) -> None:
        """Keep a plan before anything of it is done."""
        if isinstance(turn, Executed) and not any(step.done for step in turn.report.steps):
            self.reports[turn.report.task] = turn.report


def export_text(text: str, request: str, workspace: Workspace, kg: "Kg", form: str) -> Exported:
    """Check a plan's text, and write it in a form.

    Raises:
        KnowledgeError: a PDDL file of the pack cannot be read.
    """
    result = check_request(text, request, workspace, kg)
    return _exported(result, [result.report], workspace, kg, form)


def export_run(path: Path, workspace: Workspace, form: str) -> Exported:
    """Write the plan of a run in a form: as it was when it was checked, before a robot acted.

    Raises:
        UsageError: it is no transcript.
        ReplayError: it no longer tells the same story.
        KnowledgeError: a PDDL file of the pack cannot be read.
    """
    from adaptbot_cli.adapters.transcript import read
    from adaptbot_cli.session.loading import EDITS, kg_of, load

    header, _ = read(path)
    edited = str(header.get("graph", "")).endswith(EDITS)
    domain = str(header.get("domain", ""))
    kg = load(workspace, domain) if edited else kg_of(header, path, workspace)
    kept = _Rehearsals()
    result = replay(path, workspace, [kept], kg)
    return _exported(result, [*kept.reports.values()], workspace, kg, form)


def _exported(
    result: Result, reports: Sequence[Report], workspace: Workspace, kg: "Kg", form: str
) -> Exported:
    from adaptbot_cli.adapters.export import FORMS, grounded, spellings
    from adaptbot_cli.core.findings import blocks

    unmet = tuple(f for r in result.runs or (result,) if r.outcome for f in r.outcome.unmet)
    world = result.outside is not None
    findings = tuple(dict.fromkeys((*(f for r in reports for f in r.findings), *unmet)))
    whole = bool(reports) and all(report.executable for report in reports)
    if not whole or not (world or result.goal_met):
        return Exported("", findings or result.report.findings)
    plan = grounded(reports, kg, spellings(_sources(workspace, kg.domain.name)))
    return Exported(FORMS[form](plan), tuple(f for f in findings if not blocks(f)))


def _sources(workspace: Workspace, domain: str) -> list[str]:
    from adaptbot_cli.adapters.store import files

    read = (files.read(workspace.root, f"kg/{domain}/{name}") for name in PDDL_FILES)
    return [data.decode("utf-8", "replace") for data in read if data is not None]
