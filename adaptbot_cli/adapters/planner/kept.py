"""Plans that are kept for a task: written, matched to it, proposed first (docs/plans.md).

A kept plan is a file of the plan library (`planner/library.py`) in the workspace's folder
`plans/DOMAIN`, with what was asked for and where the plan comes from in its front matter. It serves
that very request, and like all plans it is checked anew each time.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from adaptbot_cli.adapters.planner.library import LibraryPlan, library_files, read_plan, stems
from adaptbot_cli.core.ask.learning import Lesson, safe_name
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Planner, Proposal, Propose
from adaptbot_cli.errors import PackError


def asked_of(task: Task) -> dict[str, list[str]]:
    """Return what a task asks for, as front matter has it: what makes two requests the same."""
    excluded = {*task.excluded, *(rule.name for rule in task.rules)}
    record = {
        "task": stems(task.name),
        "requires": sorted(task.required),
        "without": sorted(excluded | {" ".join(pair).strip() for pair in task.refused}),
        "amount": [str(task.amount)] if task.amount != 1 else [],
        "place": [task.place] if task.place else [],
        "inside": sorted(map(" in ".join, task.inside)),
        "states": sorted(f"{item} {local(state)}" for item, state in task.states),
        "unread": list(task.unread),
    }
    return {key: value for key, value in record.items() if value}


def plan_of(lesson: Lesson, planner: str = "", run: str = "") -> LibraryPlan:
    """Return the plan that a person has agreed to keep.

    `planner` names who planned it at first, `run` the transcript, "" if there is none.
    """
    if lesson.plan is None:
        raise ValueError("this lesson keeps no plan")
    task, answer, asked = lesson.plan.task, lesson.answer, asked_of(lesson.plan.task)
    source = {"request": task.said or task.name, "why": lesson.question.prop, "by": answer.by}
    source |= {"at": answer.at, "planner": planner, "run": run.removesuffix(".yaml")}
    kept = {key: value for key, value in source.items() if value}
    digest = hashlib.sha256(repr(sorted(asked.items())).encode()).hexdigest()[:4]
    path = Path(f"{safe_name(' '.join(asked.get('task', ())))}_{digest}.plan")
    body = f"{lesson.plan.text}\n"
    return LibraryPlan(path, (task.name,), None, task.required, {}, body, asked, kept)


def plan_file(lesson: Lesson, planner: str, run: str) -> tuple[str, bytes]:
    """Return the name and the content of the file of a plan that a person has agreed to keep."""
    plan = plan_of(lesson, planner, run)
    front: dict[str, Any] = {"names": [*plan.names], "ingredients": [*plan.ingredients]}
    front |= {"asked": plan.asked, "kept": plan.kept}
    text = yaml.safe_dump(front, sort_keys=False, allow_unicode=True, width=1_000)
    return plan.path.name, f"---\n{text}---\n{plan.body}".encode()


def find(task: Task, plans: Iterable[LibraryPlan]) -> LibraryPlan | None:
    """Return the plan that is kept for a task, None if none is."""
    asked = asked_of(task)
    return next((plan for plan in plans if plan.asked == asked), None)


def origin(plan: LibraryPlan) -> str:
    """Say where a kept plan comes from: "changed by hand, kept by ann, 2026-11-30"."""
    why, by, at = (plan.kept.get(key, "") for key in ("why", "by", "at"))
    return ", ".join(part for part in (why, by and f"kept by {by}", at[:10]) if part)


@dataclass(frozen=True, slots=True)
class KeptFirst:
    """A planner that proposes the plan that is kept for a task before it asks another one.

    A kept plan that has findings is what the other one is asked to mend; where that one `listens`
    to no findings, as the plan library, it is asked once as if for the first time.
    """

    plans: Sequence[LibraryPlan]
    planner: Planner
    listens: bool = True

    @property
    def name(self) -> str:
        """The other planner's name."""
        return self.planner.name

    def propose(self, turn: Propose) -> Proposal:
        """Return the kept plan, or what the other planner proposes. Raises ModelError."""
        found = find(turn.task, self.plans)
        if found is not None and not turn.attempt:
            return Proposal(found.body.strip(), calls=0, source=origin(found))
        if turn.attempt and not self.listens:
            if found is None or turn.previous != found.body.strip():
                return Proposal(turn.previous, calls=0)
            turn = replace(turn, attempt=0, previous="", findings=())
        return self.planner.propose(turn)


def kept_plans(folder: Path) -> tuple[list[LibraryPlan], dict[Path, str]]:
    """Read the plans that are kept in a folder, by name; and by file, what is wrong with those that
    are none."""
    plans, faults = [], {}
    for path in library_files(folder):
        try:
            plan = read_plan(path)
        except PackError as error:
            faults[path] = str(error)
            continue
        if plan.kept:
            plans.append(plan)
        else:
            faults[path] = f"{path}: its front matter lacks `kept`; see docs/plans.md"
    return plans, faults
