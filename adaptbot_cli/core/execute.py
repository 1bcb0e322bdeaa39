"""A plan carried out on a copy of G_s, and whether its goal is met then (Algorithm 1, execute)."""

from collections.abc import Iterator
from dataclasses import dataclass

from rdflib import URIRef

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.plan import Finding, Goal, Step, Task
from adaptbot_cli.core.rehearse import holds, perform
from adaptbot_cli.core.report import Bound, Outcome, Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.static import sentence


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """The executor that carries a plan out on a copy of G_s: nothing in the world changes."""

    kg: Kg

    def execute(self, report: Report) -> Outcome:
        """Carry out a plan's steps in order, then check the goal (Algorithm 1, execute)."""
        scene = Scene(self.kg, report.task)
        deltas: list[Delta] = []
        with self.kg.rehearsal():
            steps = zip(report.steps, report.bounds, strict=True)
            for number, (step, bound) in enumerate(steps, start=1):
                if bound is None:
                    deltas.append(Delta())
                    continue
                error = self._step(number, step, bound)
                if error is not None:
                    return Outcome(tuple(deltas), error)
                deltas += self.kg.changes(self.kg.mark - 1)
            unmet, missing = check_goal(scene)
        return Outcome(tuple(deltas), None, unmet, missing)

    def _step(self, number: int, step: Step, bound: Bound) -> Finding | None:
        failing = [c for c in bound.action.conditions if not holds(c, bound, self.kg)]
        if failing:
            message = sentence(failing[0].message, bound, self.kg)
            return Finding("E401", message, bound.action.name, step=number, line=step.line)
        perform(bound, self.kg)
        return None


def check_goal(scene: Scene) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return the goal conditions that do not hold now, and the required items they concern."""
    findings: list[Finding] = []
    missing: list[str] = []
    for goal in (*scene.domain.goals, *scene.task.goals):
        for name, finding in _goal(goal, scene.task, scene.kg):
            findings.append(finding)
            missing += [name] if name else []
    return tuple(findings), tuple(dict.fromkeys(missing))


def _goal(goal: Goal, task: Task, kg: Kg) -> Iterator[tuple[str, Finding]]:
    if not goal.classes:
        if not kg.ask(goal.query, {"agent": kg.domain.agent}):
            yield "", Finding("E503", goal.message)
        return
    classes = [URIRef(iri) for iri in goal.classes]
    for name in task.required:
        found = [e for e in kg.find(name) if kg.is_a(e, classes)]
        if found and not any(kg.ask(goal.query, {"item": e}) for e in found):
            yield name, Finding("E503", goal.message.format(item=name), name)
