"""What the stored plans are worth on a graph, and for which of them a change matters."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.core.changes import about
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Task

if TYPE_CHECKING:
    from rdflib.term import Node

    from adaptbot_cli.core.kg import Kg


def verdict_changes(
    before: "Kg", now: "Kg", delta: Delta, library: Sequence[Path]
) -> list[tuple[str, str, str]]:
    """Return the tasks whose plan is judged otherwise after a change: task, old, new.

    `library` are the folders of the plans, an earlier one before a later one.
    """
    found = []
    for task, plan in _plans(before, library):
        if _matters(delta, task, plan, before, now):
            old, new = _verdict(task, plan, before), _verdict(task, plan, now)
            if old != new:
                found.append((task.name, old, new))
    return found


def _plans(kg: "Kg", folders: Sequence[Path]) -> Iterator[tuple[Task, str]]:
    """The library's plans for the domain's tasks, and for the names that they bear themselves."""
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.planner.library import Library, names_in, read_library
    from adaptbot_cli.core.request import understand
    from adaptbot_cli.core.turns import Propose
    from adaptbot_cli.errors import ModelError

    library = Library(tuple(folders), kg.domain, kg=kg)
    names = [task.name for task in kg.domain.tasks]
    names += [plan.names[0] for plan in read_library(*folders)]
    dishes, words = names_in(*folders), WordNet()
    read = (understand(name, kg, words, dishes=dishes).tasks for name in names)
    for task in {task.name: task for tasks in read for task in tasks}.values():
        try:
            yield task, library.propose(Propose(task)).text
        except ModelError:
            continue


def _matters(delta: Delta, task: Task, plan: str, before: "Kg", now: "Kg") -> bool:
    """Whether a change can touch a plan: it names a thing of it, or may use one without a name."""
    from adaptbot_cli.core.parse import parse

    changed = about(delta)
    if any(_used_unnamed(node, before) or _used_unnamed(node, now) for node in _subjects(delta)):
        return True
    names = {normal(str(value)) for _, _, value in delta.removed | delta.added}
    written = {arg for call in parse(plan).calls for arg in (call.call.action, *call.call.args)}
    return any(
        normal(name) in names or changed & {*before.find(name), *now.find(name)}
        for name in (*written, *task.required)
    )


def _subjects(delta: Delta) -> "set[Node]":
    return {subject for subject, _, _ in delta.removed | delta.added}


def _used_unnamed(node: "Node", kg: "Kg") -> bool:
    """Whether a step may use it though the plan does not name it: an action, a place, a tool."""
    kinds = kg.domain.kinds.values()
    prompted = [kind.iri for kind in kinds if kind.prompted]
    actions = kg.domain.actions.values()
    return kg.is_a(node, prompted) or any(action.iri == node for action in actions)


def _verdict(task: Task, plan: str, kg: "Kg") -> str:
    from adaptbot_cli.session.playing import check

    result = check(plan, task, kg)
    return "goal met" if result.goal_met else result.verdict.replace("_", " ")
