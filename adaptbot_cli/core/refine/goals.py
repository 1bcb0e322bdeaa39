"""A plan rehearsed on a copy of G_s, and whether a goal is met (Algorithm 1, execute).

A pack's goals that are weak are worth a hint, no fault: a home may happen to be as a task wants it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.sparql import mentions, ruled_out
from adaptbot_cli.core.graph.terms import TRUE
from adaptbot_cli.core.plan import Finding, Goal, Task
from adaptbot_cli.core.refine.grounding import sentence
from adaptbot_cli.core.refine.repair import holds, perform
from adaptbot_cli.core.report import Outcome, Report
from adaptbot_cli.core.request.clauses import concerns
from adaptbot_cli.core.request.understand import excluded
from adaptbot_cli.core.scene import Scene


def rehearsed(report: Report, kg: Kg) -> Outcome:
    """Carry out a plan's steps in order on a copy of G_s, then check the goal."""
    scene = Scene(kg, report.task)
    deltas: list[Delta] = []
    with kg.rehearsal():
        steps = zip(report.steps, report.grounded, strict=True)
        for number, (step, ground) in enumerate(steps, start=1):
            if ground is None:
                deltas.append(Delta())
                continue
            for condition in ground.action.conditions:
                if not holds(condition, ground, kg):
                    message = sentence(condition.message, ground, kg)
                    name = ground.action.name
                    error = Finding("E401", message, name, step=number, line=step.line)
                    return Outcome(tuple(deltas), error)
            perform(ground, kg)
            deltas += kg.changes(kg.mark - 1)
        unmet, missing = check_goal(scene)
    return Outcome(tuple(deltas), None, unmet, missing)


def check_goal(scene: Scene) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return the goal conditions that do not hold now, and the required items they concern."""
    findings: list[Finding] = []
    missing: list[str] = []
    for goal in (*scene.domain.goals, *scene.task.goals):
        for name, finding in _goal(goal, scene.task, scene.kg):
            findings.append(finding)
            missing += [name] if name else []
    findings += _asked(scene.task, scene.kg)
    return tuple(findings), tuple(dict.fromkeys(missing))


def _asked(task: Task, kg: Kg) -> Iterator[Finding]:
    """What the words of the request ask for besides, and what does not hold."""
    for content, vessel in task.inside:
        if not any(kg.is_within(e, place) for e in kg.find(content) for place in kg.find(vessel)):
            yield Finding("E503", f"there is no {content} in the {vessel}", content)
    for name, prop in task.states:
        if not any((entity, prop, TRUE) in kg.facts for entity in kg.find(name)):
            yield Finding("E503", f"{name} is not {kg.domain.label(prop)}", name)
    if task.place and not any(goal.places for goal in task.goals):
        things = [e for name in task.required if name != task.place for e in kg.find(name)[:1]]
        there = kg.find(task.place)
        found = [kg.is_within(e, place) for e in things for place in there]
        if not any(found) or (not kg.domain.products and sum(found) < len(things)):
            yield Finding("E503", f"what was asked for is not at {task.place}", task.place)
    if task.amount > 1 or task.barred or task.rules:
        rows = kg.rows(kg.domain.servings, {}) if kg.domain.servings else []
        # What was made before, for another task, is no serving of this one.
        inside = [e for name in task.required for e in kg.find(name)]
        vessels = sorted({row["vessel"] for row in rows}, key=str)
        served = [at for at in vessels if any(kg.is_within(e, at) for e in inside)]
        for dish in (at for at in served if all(kg.is_within(e, at) for e in inside)):
            for thing in kg.contents(dish):
                if why := excluded(thing, task, kg):
                    text = f"{why}, and it is in the {kg.name(dish)}"
                    yield Finding("E503", text, kg.name(thing))
        if len(served) < task.amount > 1:
            made = f"the plan makes {len(served)}" if served else "no plan counts what it makes"
            yield Finding("E506", f"{task.amount} are asked for, and {made}", str(task.amount))


def _goal(goal: Goal, task: Task, kg: Kg) -> Iterator[tuple[str, Finding]]:
    if not goal.classes:
        if not kg.ask(goal.query, {"agent": kg.domain.agent}):
            yield "", Finding("E503", goal.message)
        return
    classes = [URIRef(iri) for iri in goal.classes]
    places: list[Mapping[str, Node]] = [{}]
    if goal.places:
        named = [{"place": place} for place in kg.find(task.place)] if task.place else []
        places = (
            [*named] if task.place else [{"place": r["place"]} for r in kg.rows(goal.places, {})]
        )
    for name in goal.items or task.required:
        found = [e for e in kg.find(name) if kg.is_a(e, classes)]
        if goal.places and name == task.place:
            continue
        if found and not any(kg.ask(goal.query, {"item": e, **p}) for e in found for p in places):
            yield name, Finding("E503", goal.message.format(item=name), name)


def weak(kg: Kg) -> Iterator[Fault]:
    """Give a hint for each task and class of tasks whose own goals are weak."""
    classes = {task.iri: task for task in kg.domain.task_classes.values()}
    own = kg.under(replace(kg.domain, goals=()))
    for task in (*kg.domain.tasks, *classes.values()):
        goals = [goal for goal in task.goals if concerns(goal, task.required, kg)]
        if not goals:
            continue
        text = remedy = ""
        if not check_goal(Scene(own, task))[0]:
            text = "its goal holds here before anything is done"
            remedy = "ask for something that only doing it brings about"
        elif not any(
            goal.classes or any(map(kg.classes, mentions(goal.query) - ruled_out(goal.query)))
            for goal in goals
        ):
            text = f'its goal ("{goals[0].message}" otherwise) is about no item'
            remedy = "name the item in ab:ask, or ask for each ?item of ab:needs with ab:class"
        if text:
            yield Fault(text, remedy, "tasks.ttl", (task.name,), hint=True)
