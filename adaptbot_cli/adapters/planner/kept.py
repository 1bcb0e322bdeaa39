"""Plans that are kept for a task: written, matched to it, proposed first (docs/plans.md).

A kept plan is a file of the plan library (`planner/library.py`) in the workspace's folder
`plans/DOMAIN`, with what was asked for and where the plan comes from in its front matter. It serves
that very request, and like all plans it is checked anew each time.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from adaptbot_cli.adapters.planner.library import LibraryPlan, folded, read_library
from adaptbot_cli.core.learning import Lesson, safe_name
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.terms import local
from adaptbot_cli.core.turns import Planner, Proposal, Propose


def asked_of(task: Task) -> dict[str, Any]:
    """Return what a task asks for beside its name, as front matter has it."""
    excluded = {*task.excluded, *(rule.name for rule in task.rules)}
    record: dict[str, Any] = {
        "requires": sorted(task.required),
        "without": sorted(excluded | {" ".join(pair).strip() for pair in task.refused}),
        "amount": task.amount if task.amount != 1 else None,
        "place": task.place,
        "inside": sorted(map(list, task.inside)),
        "states": sorted([item, local(state)] for item, state in task.states),
    }
    return {key: value for key, value in record.items() if value}


def name_of(task: Task) -> str:
    """Return the name of the file that a task's plan is kept in, without its ending."""
    asked = asked_of(task)
    parts = [f"without_{'_'.join(asked['without'])}"] if "without" in asked else []
    parts += [f"{key}_{asked[key]}" for key in ("amount", "place") if key in asked]
    parts += ["_in_".join(pair) for pair in asked.get("inside", ())]
    return "_".join(map(safe_name, (task.name, *parts)))


def plan_of(lesson: Lesson, planner: str = "", run: str = "") -> LibraryPlan:
    """Return the plan that a person has agreed to keep.

    `planner` names who planned it at first, `run` the transcript, "" if there is none.
    """
    if lesson.plan is None:
        raise ValueError("this lesson keeps no plan")
    task, answer = lesson.plan.task, lesson.answer
    source = {"why": lesson.question.prop, "by": answer.by, "at": answer.at}
    source |= {"planner": planner, "run": run.removesuffix(".yaml")}
    kept = {key: value for key, value in source.items() if value}
    path, body = Path(f"{name_of(task)}.plan"), f"{lesson.plan.text}\n"
    return LibraryPlan(path, (task.name,), None, task.required, {}, body, asked_of(task), kept)


def plan_file(lesson: Lesson, planner: str, run: str) -> tuple[str, bytes]:
    """Return the name and the content of the file of a plan that a person has agreed to keep."""
    plan = plan_of(lesson, planner, run)
    front = {
        "names": [*plan.names],
        "ingredients": [*plan.ingredients],
        "asked": plan.asked,
        "kept": plan.kept,
    }
    text = yaml.safe_dump(front, sort_keys=False, allow_unicode=True, width=1_000)
    return plan.path.name, f"---\n{text}---\n{plan.body}".encode()


def find(task: Task, plans: Iterable[LibraryPlan]) -> LibraryPlan | None:
    """Return the plan that is kept for a task, None if none is."""
    return next(
        (
            plan
            for plan in plans
            if folded(plan.names[0]) == folded(task.name) and plan.asked == asked_of(task)
        ),
        None,
    )


def origin(plan: LibraryPlan) -> str:
    """Say where a kept plan comes from: "changed by hand, kept by ann, 2026-11-30"."""
    why, by, at = (str(plan.kept.get(key, "")) for key in ("why", "by", "at"))
    return ", ".join(part for part in (why, by and f"kept by {by}", at[:10]) if part)


@dataclass(slots=True)
class KeptFirst:
    """A planner that proposes the plan that is kept for a task before it asks another one.

    A kept plan that has findings is what the other one is asked to mend; where that one `listens`
    to no findings, as the plan library, it is asked as if for the first time.
    """

    plans: Sequence[LibraryPlan]
    planner: Planner
    listens: bool = True
    _given: str = ""

    @property
    def name(self) -> str:
        """The other planner's name."""
        return self.planner.name

    def propose(self, turn: Propose) -> Proposal:
        """Return the kept plan, or what the other planner proposes. Raises ModelError."""
        if not turn.attempt and (found := find(turn.task, self.plans)):
            self._given = found.body.strip()
            return Proposal(self._given, calls=0, source=origin(found))
        if turn.attempt and turn.previous == self._given and not self.listens:
            self._given = ""
            turn = replace(turn, attempt=0, previous="", findings=())
        return self.planner.propose(turn)


def kept_plans(folder: Path) -> list[LibraryPlan]:
    """Read the plans that are kept in a folder, by name. Raises PackError."""
    return [plan for plan in read_library(folder) if plan.kept]


def request_of(plan: LibraryPlan) -> str:
    """Return the request that a kept plan serves: "2 omelette without onion"."""
    asked = plan.asked
    parts = [str(asked["amount"])] if "amount" in asked else []
    parts.append(plan.names[0])
    if asked.get("without"):
        parts.append(f"without {sentence_list([*map(str, asked['without'])])}")
    return " ".join(parts)
