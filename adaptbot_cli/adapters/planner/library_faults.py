"""What is wrong with a plan library: every fault of every plan."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from adaptbot_cli.adapters.planner.library import LibraryPlan, library_files, read_plan
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import nearest, normal
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.errors import PackError

_FORM = 'write one call a line, as in pick_up("vase")'


def library_faults(folders: Sequence[Path], kg: Kg | None) -> Iterator[Fault]:
    """Give each fault of a library.

    Its actions are looked up in `kg`, unless that is None.
    """
    owners: dict[str, Path] = {}
    for path in library_files(*folders):
        try:
            plan = read_plan(path)
            yield from _names(plan, owners)
            yield from _calls(plan, kg)
        except PackError as error:
            yield Fault(str(error))


def _names(plan: LibraryPlan, owners: dict[str, Path]) -> Iterator[Fault]:
    for name in plan.names:
        other = owners.setdefault(normal(name), plan.path)
        if other != plan.path:
            text = f'its name "{name}" is that of {other.name} too'
            yield Fault(text, "take it from one of them", str(plan.path))


def _calls(plan: LibraryPlan, kg: Kg | None) -> Iterator[Fault]:
    """What is wrong with the calls that a plan renders to with its own ingredients."""
    items = dict.fromkeys((*(plan.base or ()), *plan.ingredients))
    parsed = parse(plan.render(plan.names[0], items))
    if not parsed.calls:
        yield Fault("renders to no call", _FORM, str(plan.path))
    for finding in parsed.findings:
        yield Fault(finding.message, _FORM, str(plan.path))
    if kg is None:
        return
    scene = Scene(kg, Task(plan.names[0]))
    actions = kg.domain.actions
    known = [*actions, *(name for action in actions.values() for name in action.aliases)]
    for name in dict.fromkeys(written.call.action for written in parsed.calls):
        if resolve.action(name, scene).action is None:
            near = nearest(name, known, 1)
            remedy = f"the nearest there is {near[0]}" if near else "declare it in actions.ttl"
            yield Fault(f"{name} is no action of actions.ttl", remedy, str(plan.path))
