"""Steps that would bring a required item into the result, and where in the plan they belong."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.plan import Call, Finding, Goal
from adaptbot_cli.core.rehearse import MOST_ROWS, Aim, Repair
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.sparql import mentions
from adaptbot_cli.core.static import render

_UNUSED = frozenset({"E501", "E503"})
"""The codes of a required item that is not used."""


@dataclass(frozen=True, slots=True)
class Addition:
    """A call to add before the step of index `place`; what it needs first is inserted as ever.

    `finding` is the one that it answers, `where` says in words where it belongs, `reason` why.
    """

    finding: Finding
    place: int
    call: Call
    where: str
    reason: str


def with_remedies(report: Report, scene: Scene) -> Report:
    """Return the report with, in the findings of unused items, the step that would use them."""
    told = {a.finding: f"{a.call.render()} {a.where}" for a in additions(report, scene)}
    found = (replace(f, remedy=told.get(f, "")) for f in report.findings)
    return replace(report, findings=tuple(found)) if told else report


def additions(report: Report, scene: Scene) -> list[Addition]:
    """Return, for each required item that is not used, the steps that would use it and where.

    They go before the first step that works on what holds the item then, as the goal's ab:before
    tells; if there is none, at the end of the plan.
    """
    found = []
    for finding in report.findings:
        if finding.code in _UNUSED:
            found += list(_addition(finding, report, scene))[:1]
    return found


def _addition(finding: Finding, report: Report, scene: Scene) -> Iterator[Addition]:
    for item in scene.kg.find(finding.subject)[:1]:
        for goal in (*scene.domain.goals, *scene.task.goals):
            classes = [URIRef(iri) for iri in goal.classes]
            if goal.about and scene.kg.is_a(item, classes):
                place = _place(goal, item, report, scene)
                if place is not None:
                    reason = goal.message.format(item=scene.kg.name(item))
                    yield Addition(finding, *place, _where(place[0], report), reason)


def _place(goal: Goal, item: URIRef, report: Report, scene: Scene) -> tuple[int, Call] | None:
    """Go through the plan to the first step before which the goal can be brought about."""
    kg = scene.kg
    with kg.rehearsal():
        for n, (bound, delta) in enumerate(zip(report.bounds, report.deltas, strict=True)):
            if bound is not None and str(bound.action.iri) in goal.before:
                worked_on = {*bound.values.values(), item}
                call = _call(goal, item, scene, worked_on)
                if call:
                    return _plan_place(n, report), call
            kg.apply(delta)
        call = _call(goal, item, scene)
    return (len(report.steps), call) if call else None


def _where(place: int, report: Report) -> str:
    after = (step for step in report.steps[place:] if step.source is not None)
    step = next(after, None)
    return f"before {step.call.render()}" if step else "at the end"


def _plan_place(n: int, report: Report) -> int:
    """The place before a step and the missing steps that were inserted for it."""
    while n and report.steps[n - 1].status == "inserted":
        n -= 1
    return n


def _call(goal: Goal, item: URIRef, scene: Scene, among: set[Node] | None = None) -> Call | None:
    """The step that brings the goal about for an item now, if it can be done `among` these."""
    kg = scene.kg
    rows = kg.rows(goal.about, {"item": item})
    for row in [r for r in rows if among is None or set(r.values()) <= among][:MOST_ROWS]:
        mark = kg.mark
        values = {**row, "item": item}
        steps = Repair(kg).achieve(
            Aim(lambda: kg.ask(goal.query, {"item": item}), mentions(goal.query), values)
        )
        call = render(steps[-1], kg) if steps else None
        kg.undo_to(mark)
        if call is not None:
            return call
    return None
