"""The plan of a run, or of a text, for a robot's own executive."""

from collections.abc import Sequence
from pathlib import Path

from adaptbot_cli.adapters.store import files
from adaptbot_cli.adapters.transcript.loading import read
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.report import Outcome, Report
from adaptbot_cli.core.turns import Checked, Executed, Turn
from adaptbot_cli.session.drive import Noting
from adaptbot_cli.session.packs import PDDL_FILES
from adaptbot_cli.session.replay import check_request, replay
from adaptbot_cli.session.sources import kg_of
from adaptbot_cli.workspace import Workspace

Exported = tuple[str, tuple[Finding, ...]]
"""A plan as a text, "" if it is not one to hand over, and the findings that tell why it is not."""


def export_text(text: str, request: str, workspace: Workspace, kg: Kg, form: str) -> Exported:
    """Check a plan's text, and write it in a form.

    Raises:
        KnowledgeError: a PDDL file of the pack cannot be read.
    """
    result = check_request(text, request, workspace, kg)
    return _exported([(result.report, result.outcome)], workspace, kg, form)


def export_run(path: Path, workspace: Workspace, form: str) -> Exported:
    """Write the plan of a run in a form: as it was when it was checked, before a robot acted.

    Raises:
        UsageError: it is no transcript.
        ReplayError: it no longer tells the same story.
        KnowledgeError: a PDDL file of the pack cannot be read.
    """
    kg = kg_of(read(path)[0], path, workspace, edited=True)
    plans: dict[object, tuple[Report, Outcome | None]] = {}

    def note(turn: Turn, reply: object) -> None:
        if isinstance(turn, Checked):
            plans.setdefault(turn.report.task, (turn.report, None))
        elif isinstance(turn, Executed) and not any(step.done for step in turn.report.steps):
            plans[turn.report.task] = turn.report, turn.outcome

    replay(path, workspace, [Noting(note)], kg)
    return _exported([*plans.values()], workspace, kg, form)


def _exported(
    plans: Sequence[tuple[Report, Outcome | None]], workspace: Workspace, kg: Kg, form: str
) -> Exported:
    from adaptbot_cli.adapters.plan_forms import FORMS, grounded, spellings

    unmet = [f for _, outcome in plans if outcome for f in outcome.unmet]
    findings = tuple(dict.fromkeys((*(f for r, _ in plans for f in r.findings), *unmet)))
    ready = (  # it ran through in the rehearsal, and met its goal there
        outcome and outcome.error is None and not outcome.unmet and r.executable and not r.open
        for r, outcome in plans
    )
    if not plans or not all(ready):
        return "", findings
    folder = f"kg/{kg.domain.name}"
    read = (files.read(workspace.root, f"{folder}/{name}") for name in PDDL_FILES)
    words = spellings([data.decode("utf-8", "replace") for data in read if data is not None])
    return FORMS[form](grounded([r for r, _ in plans], kg, words)), findings
