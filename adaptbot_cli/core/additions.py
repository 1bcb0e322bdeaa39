"""Steps that would bring about what a plan misses, and where in the plan they belong."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.plan import Call, Finding, Goal
from adaptbot_cli.core.rehearse import LONGEST_REPAIR, MOST_ROWS, Aim, Repair
from adaptbot_cli.core.report import Bound, Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.sparql import mentions
from adaptbot_cli.core.static import known_values, render
from adaptbot_cli.core.terms import Triple

_UNMET = frozenset({"E501", "E503"})
"""The codes of what the task requires and the plan does not come to."""


@dataclass(frozen=True, slots=True)
class Addition:
    """Calls to add before the step of index `place`; what they need first is inserted as ever.

    `finding` is the one that they answer, `where` says in words where they belong, `reason` why;
    `told` are those of the calls that do more than fetch; `supposed` are facts that are not known
    and that the calls need.
    """

    finding: Finding
    place: int
    calls: tuple[Call, ...]
    told: str
    where: str
    reason: str
    supposed: tuple[Triple, ...] = ()


def with_remedies(report: Report, scene: Scene) -> Report:
    """Return the report with, in the findings of unused items, the step that would use them."""
    unused = (f for f in report.findings if f.code in _UNMET and f.subject)
    added = (a for finding in unused for a in _uses(finding, report, scene))
    told = {a.finding: f"{a.told} {a.where}" for a in added}
    found = (replace(f, remedy=told.get(f, "")) for f in report.findings)
    return replace(report, findings=tuple(found)) if told else report


def additions(report: Report, scene: Scene) -> list[Addition]:
    """Return the steps that would bring about what the plan misses, and where.

    A required item goes in before the first step that works on what holds it then, as the goal's
    ab:before tells; else at the end. What else the task wants is done where fewest steps do it.
    """
    unmet = [finding for finding in report.findings if finding.code in _UNMET]
    unused = [a for f in unmet if f.subject for a in _uses(f, report, scene)]
    # What is made of the items comes once they are all in.
    return unused or [a for f in unmet if not f.subject for a in _reaches(f, report, scene)]


def _uses(finding: Finding, report: Report, scene: Scene) -> Iterator[Addition]:
    """Steps that use a required item: for the first goal that is about it."""
    for item in scene.kg.find(finding.subject)[:1]:
        for goal in (*scene.domain.goals, *scene.task.goals):
            classes = [URIRef(iri) for iri in goal.classes]
            if goal.helped_by and scene.kg.is_a(item, classes):
                found = _before(goal, item, report, scene)
                if found:
                    reason = goal.message.format(item=scene.kg.name(item))
                    yield _addition(finding, *found, reason, report, scene)
                    return


def _reaches(finding: Finding, report: Report, scene: Scene) -> Iterator[Addition]:
    """Steps that bring a goal of the task about."""
    for goal in scene.task.goals:
        if not goal.classes and goal.message == finding.message:
            found = _cheapest(goal, report, scene)
            if found:
                yield _addition(finding, *found, goal.message, report, scene)


def _addition(
    finding: Finding, place: int, steps: list[Bound], reason: str, report: Report, scene: Scene
) -> Addition:
    while place and place <= len(report.steps) and report.steps[place - 1].status == "inserted":
        place -= 1  # before the missing steps that were inserted for the step that follows
    after = next((step for step in report.steps[place:] if step.source is not None), None)
    where = f"before {after.call.render()}" if after else "at the end"
    calls = tuple(render(step, scene.kg) for step in steps)
    told = [c.render() for c, step in zip(calls, steps, strict=True) if not step.action.fetches]
    supposed = tuple(fact for step in steps for fact in _unknown(step, scene))
    return Addition(finding, place, calls, ", ".join(told), where, reason, supposed)


def _unknown(bound: Bound, scene: Scene) -> Iterator[Triple]:
    """The attributes that an action needs and that are not known, as it needs them."""
    for need in bound.action.attributes:
        entity = bound.values.get(need.of)
        if not isinstance(entity, URIRef) or need.assume:
            continue
        if not known_values(scene.kg, entity, need.prop):
            yield entity, need.prop, need.value


Found = tuple[int, list[Bound]]


def _before(goal: Goal, item: URIRef, report: Report, scene: Scene) -> Found | None:
    """Go through the plan to the first step before which an item can be made use of.

    Not before the plan's own last step with the item, which would take it away again.
    """
    kg = scene.kg
    own = [n for n, b in enumerate(report.bounds) if b and item in b.values.values()]
    start = max(own, default=-1)
    with kg.rehearsal():
        for n, (bound, delta) in enumerate(zip(report.bounds, report.deltas, strict=True)):
            if n > start and bound is not None and str(bound.action.iri) in goal.before:
                among = {*bound.values.values(), item}
                rows = [r for r in _rows(goal, item, scene) if set(r.values()) <= among]
                steps = _shortest(goal, rows, scene)
                if steps:
                    return n, steps
            kg.apply(delta)
        steps = _shortest(goal, _rows(goal, item, scene), scene)
    return (len(report.steps), steps) if steps else None


def _cheapest(goal: Goal, report: Report, scene: Scene) -> Found | None:
    """Find the first place in the plan from which the fewest steps bring a goal about.

    Steps that use what the plan leaves unused go before others; then those that one last action
    completes before those that several do; then those for which everything is known.
    """
    unused = _unused(report, scene)
    for with_it in (True, False) if unused else (False,):
        for together, supposing in ((False, False), (True, False), (False, True)):
            for limit in range(1, LONGEST_REPAIR + 1):
                rather = frozenset(unused.values()) if with_it else frozenset()
                found = _first(goal, report, scene, limit, together, supposing, rather)
                if found:
                    return found
    return None


def _first(
    goal: Goal,
    report: Report,
    scene: Scene,
    limit: int,
    together: bool,
    supposing: bool,
    rather: frozenset[Node],
) -> Found | None:
    """Find the first place in the plan from which few enough steps bring a goal about.

    Looked at is where a step has just dealt with a thing that the goal is about, and the end.
    """
    kg = scene.kg
    more = {str(n): node for n, node in enumerate(sorted(rather, key=str))}
    with kg.rehearsal():
        for n, (bound, delta) in enumerate(zip(report.bounds, report.deltas, strict=True), 1):
            kg.apply(delta)
            rows = _rows(goal, None, scene)
            if n < len(report.steps):
                dealt_with = set(bound.values.values()) if bound else set()
                rows = [row for row in rows if dealt_with & set(row.values())]
            repair = Repair(
                kg, together=together, supposing=supposing, rather=rather, bars=scene.bars
            )
            steps = _steps(goal, [{**row, **more} for row in rows], scene, repair, limit)
            used = {node for step in steps for node in step.values.values()}
            if steps and (not rather or rather & used):
                return n, steps
    return None


def _unused(report: Report, scene: Scene) -> dict[str, Node]:
    """The required items that no step uses: steps to add may be done with them."""
    names = [f.subject for f in report.findings if f.code == "E501"]
    return {name: entity for name in names for entity in scene.kg.find(name)[:1]}


def _rows(goal: Goal, item: URIRef | None, scene: Scene) -> list[Mapping[str, Node]]:
    """The things that a goal may be brought about with: those it is about, or those it names."""
    given: dict[str, Node] = {} if item is None else {"item": item}
    if goal.helped_by:
        return [{**row, **given} for row in scene.kg.rows(goal.helped_by, given)]
    named = sorted(iri for iri in mentions(goal.query) if scene.kg.classes(iri))
    return [{"named": iri} for iri in named]


def _steps(
    goal: Goal, rows: list[Mapping[str, Node]], scene: Scene, repair: Repair, limit: int
) -> list[Bound]:
    """The steps that bring a goal about now, with the first of the things that will do."""
    kg = scene.kg
    agent = {"agent": scene.domain.agent}
    for row in rows[:MOST_ROWS]:
        mark = kg.mark
        given = {**agent, **{name: node for name, node in row.items() if name == "item"}}
        aim = Aim(lambda g=given: kg.ask(goal.query, g), mentions(goal.query), row)  # type: ignore[misc]
        steps = repair.within(aim, limit)
        kg.undo_to(mark)
        if steps:
            return steps
    return []


def _shortest(goal: Goal, rows: list[Mapping[str, Node]], scene: Scene) -> list[Bound]:
    """The fewest steps that bring a goal about now."""
    for limit in range(1, LONGEST_REPAIR + 1):
        steps = _steps(goal, rows, scene, Repair(scene.kg, bars=scene.bars), limit)
        if steps:
            return steps
    return []
