"""From the calls of a plan to a report: understand, rehearse with repairs, check the goal."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Parameter
from adaptbot_cli.core.expand import expand
from adaptbot_cli.core.kg import Delta, Kg
from adaptbot_cli.core.learning import is_absent
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Call, Finding, Goal, Parsed, Status, Step, Task, Written
from adaptbot_cli.core.rehearse import Aim, Repair, aim_of, complete, holds, perform
from adaptbot_cli.core.report import Bound, Outcome, Report
from adaptbot_cli.core.resolve import action
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.sparql import mentions, variables
from adaptbot_cli.core.static import Sound, number, render, sentence, understand
from adaptbot_cli.core.terms import TRUE

_MOST_ROWS = 3
"""With how many of the things that a goal is about its repair is tried."""

_OF_A_NAME = frozenset({"E101", "E201"})
_OF_ITS_STEP = frozenset({"E401", "W602"})
"""The codes of findings about a name, and of those about the state at one step of the plan."""


def words_to_look_up(calls: Iterable[Call], scene: Scene) -> tuple[set[str], set[str]]:
    """Return the unknown item names and the unknown action names of a plan, not yet looked up."""
    items: set[str] = set()
    actions: set[str] = set()
    for call in calls:
        if action(call.action, scene).action is None:
            actions.add(normal(call.action))
        items |= {normal(arg) for arg in call.args if not number(arg) and not scene.kg.find(arg)}
    items -= {word for a in scene.domain.actions.values() for p in a.parameters for word in p.words}
    known = set(scene.known)
    return items - known, actions - known


def examine(parsed: Parsed, text: str, scene: Scene) -> Report:
    """Check, refine and repair a plan on the graph, which is left as it was.

    Every finding of the plan is reported at once, each once. State conditions are only checked
    where everything before them about the same things could be understood.
    """
    scene.notice([written.call for written in parsed.calls])
    sounds: list[Sound] = []
    walk = _Walk(scene.kg)
    with scene.kg.rehearsal():
        before = _spoilers(scene)
        for place, written in enumerate(parsed.calls):
            meant = expand(written.call, scene)
            if not meant.calls:
                walk.skip(written, meant.dropped)
            for call in meant.calls:
                sound = understand(call, scene)
                if meant.change is not None:
                    sound = replace(sound, changes=(meant.change, *sound.changes))
                sounds.append(sound)
                later = [w.call for w in parsed.calls[place + 1 :]]
                walk.take(written, sound, _pointless(sound, later, scene))
        _put_right(walk, before, scene)
        _reach_goals(walk, scene)
        unmet, missing = check_goal(scene) if not walk.tainted else ((), ())
    absent = _unused(sounds, parsed, scene)
    seen = {finding.subject for finding in absent}
    unmet = tuple(f for f in unmet if f.subject not in seen)
    findings = (*parsed.findings, *_once(walk.findings), *absent, *unmet)
    return Report(
        task=scene.task,
        text=text,
        steps=tuple(walk.steps),
        findings=tuple(dict.fromkeys(findings)),
        bounds=tuple(walk.bounds),
        deltas=tuple(walk.deltas),
        missing=tuple(dict.fromkeys((*(f.subject for f in absent), *missing))),
    )


def _once(findings: Iterable[Finding]) -> Iterable[Finding]:
    """Findings without those that an earlier step has already; a state is that of its own step.

    A name is unknown but once, though what is near it depends on what the step wants there.
    """
    first: dict[tuple[str, str, str, int | None], Finding] = {}
    for finding in findings:
        step = finding.step if finding.code in _OF_ITS_STEP else None
        message = finding.message if finding.code not in _OF_A_NAME else ""
        first.setdefault((finding.code, finding.subject, message, step), finding)
    return first.values()


@dataclass(slots=True)
class _Walk:
    """The plan as far as it has been rehearsed."""

    kg: Kg
    steps: list[Step] = field(default_factory=list)
    bounds: list[Bound | None] = field(default_factory=list)
    deltas: list[Delta] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    tainted: set[Node] = field(default_factory=set)

    def skip(self, written: Written, reason: str) -> None:
        """Leave out a step of the plan that is not needed."""
        step = Step(written.call, written.source, written.line, "dropped", reason=reason)
        self._add(step, None)

    def take(self, written: Written, sound: Sound, pointless: str = "") -> None:
        """Take one step of the plan, with the missing steps before it."""
        step = Step(sound.call, written.source, written.line, changes=sound.changes)
        if pointless:
            self._add(replace(step, status="dropped", reason=pointless), None)
        elif sound.dropped:
            why = f"{_reason(sound.dropped, self.kg)}, and the goal does not need it"
            self._add(replace(step, status="dropped", reason=why), None)
        elif sound.bound is None:
            self._unsound(step, sound)
        else:
            self._sound(step, sound, sound.bound)

    def _unsound(self, step: Step, sound: Sound) -> None:
        self.tainted |= {e for arg in sound.call.args for e in self.kg.find(arg)} or {Literal("?")}
        self._note(sound.findings, step)
        codes = tuple(dict.fromkeys(f.code for f in sound.findings))
        message = "; ".join(f.message for f in sound.findings)
        self._add(replace(step, status="finding", codes=codes, reason=message), None)

    def _sound(self, step: Step, sound: Sound, bound: Bound) -> None:
        bound = complete(bound, self.kg)
        problems = [*self._no_default(bound), *self._unmet(bound, sound)]
        advice = list(self._advice(bound))
        if self.tainted & set(bound.values.values()):
            problems, advice = [], []
        status: Status = "changed" if sound.changes else "ok"
        if problems:
            status = "finding"
        self._note([*problems, *advice], step)
        codes = tuple(dict.fromkeys(f.code for f in (*problems, *advice)))
        reason = "; ".join(f.message for f in (*problems, *advice))
        mark = self.kg.mark
        if not problems:
            perform(bound, self.kg)
        self._add(replace(step, status=status, codes=codes, reason=reason), bound, mark)

    def _advice(self, bound: Bound) -> Iterator[Finding]:
        for condition in bound.action.advises:
            if not holds(condition, bound, self.kg):
                message = sentence(condition.message, bound, self.kg)
                yield Finding("W602", message, bound.action.name)

    def _no_default(self, bound: Bound) -> Iterator[Finding]:
        for parameter in bound.action.parameters:
            if parameter.name not in bound.values and _matters(parameter, bound):
                kinds = [self.kg.domain.kinds[c].label for c in parameter.classes]
                what = f"{' or '.join(kinds)} here that can serve as {parameter.name}"
                yield Finding("E401", f"there is no {what}", bound.action.name)

    def _unmet(self, bound: Bound, sound: Sound) -> Iterator[Finding]:
        """Achieve what the step needs, yielding a finding for each need that stays open."""
        for entity, prop in sound.states:
            if bound.action.effect and prop in bound.action.effect.predicates:
                continue  # the step itself brings the state about
            finding = self._achieve(*self._state(entity, prop))
            if finding:
                yield finding
        needs = [
            (aim_of(condition, bound, self.kg), sentence(condition.message, bound, self.kg))
            for condition in bound.action.conditions
        ]
        for _ in range(2):  # achieving a later condition may undo an earlier one: look twice
            mark = self.kg.mark
            unmet = [(aim, message) for aim, message in needs if self._achieve(aim, message)]
            if self.kg.mark == mark:
                break
        else:
            unmet = [(aim, message) for aim, message in needs if not aim.holds()]
        for _, message in unmet:
            yield Finding("E401", message, bound.action.name)

    def _state(self, entity: URIRef, prop: URIRef) -> tuple[Aim, str]:
        aim = Aim(lambda: (entity, prop, TRUE) in self.kg.facts, frozenset({prop}), {"it": entity})
        label = self.kg.domain.properties[prop].label
        return aim, f"{self.kg.name(entity)} must be {label} by then"

    def _achieve(self, aim: Aim, message: str) -> Finding | None:
        if aim.holds():
            return None
        mark = self.kg.mark
        inserted = Repair(self.kg).achieve(aim)
        if inserted is None:
            return Finding("E401", message)
        self.insert(inserted, message, mark)
        return None

    def insert(self, inserted: Sequence[Bound], reason: str, mark: int) -> None:
        """Add steps that a repair has found and performed since `mark`."""
        for offset, bound in enumerate(inserted):
            call = render(bound, self.kg)
            step = Step(call, status="inserted", reason=reason)
            self._add(step, bound, mark + offset, mark + offset + 1)

    def _note(self, findings: Iterable[Finding], step: Step) -> None:
        number = len(self.steps) + 1
        self.findings += [replace(f, step=number, line=step.line) for f in findings]

    def _add(
        self, step: Step, bound: Bound | None, start: int = -1, end: int | None = None
    ) -> None:
        self.steps.append(step)
        self.bounds.append(bound)
        changes = self.kg.changes(start, end) if start >= 0 else []
        self.deltas.append(changes[0] if changes else Delta())


def _pointless(sound: Sound, later: Sequence[Call], scene: Scene) -> str:
    """Why a step is not needed: what it is for holds already, or what it fetches is not moved."""
    if sound.bound is not None:
        return _served(sound.bound, scene)
    if sound.action is None or not sound.action.fetches:
        return ""
    fetched = set(scene.kg.find(sound.call.args[0])) if sound.call.args else set()
    for call in later:
        if call.args and fetched & set(scene.kg.find(call.args[0])):
            following = understand(call, scene).bound
            return _needless(sound, following, scene) if following else ""
    return ""


def _needless(sound: Sound, following: Bound, scene: Scene) -> str:
    """Why what cannot be fetched need not be: the step that follows can be done without."""
    served = _served(following, scene)
    following = complete(following, scene.kg)
    if served or not all(holds(c, following, scene.kg) for c in following.action.conditions):
        return served
    told = "; ".join(finding.message for finding in sound.findings)
    return f"{told}, and {following.action.name} does not need it"


def _served(bound: Bound, scene: Scene) -> str:
    """The sentence of an action's purpose, if it holds before the action is done."""
    purpose = bound.action.purpose
    if purpose is None:
        return ""
    bound = complete(bound, scene.kg)
    return sentence(purpose.message, bound, scene.kg) if holds(purpose, bound, scene.kg) else ""


def _reason(name: str, kg: Kg) -> str:
    absent = is_absent(kg, name, "item") or is_absent(kg, name, "action")
    return f"{name} is not here" if absent else f"nobody has said what {name} is"


def _matters(parameter: Parameter, bound: Bound) -> bool:
    queries = [c.query for c in bound.action.conditions]
    return bool(parameter.default) and any(parameter.name in variables(q) for q in queries)


def _spoilers(scene: Scene) -> set[tuple[int, Node]]:
    """What already spoils a result before the plan: not the plan's fault."""
    return {
        (n, row["item"])
        for n, goal in enumerate(scene.domain.advice)
        for row in scene.kg.rows(goal.query, {})
        if "item" in row
    }


def _put_right(walk: _Walk, before: set[tuple[int, Node]], scene: Scene) -> None:
    """Undo at the end what the plan leaves in the wrong state, or warn of it."""
    for n, node in sorted(_spoilers(scene) - before):
        goal = scene.domain.advice[n]
        message = goal.message.format(item=scene.kg.name(node))
        aim = Aim(
            lambda n=n, node=node: (n, node) not in _spoilers(scene),  # type: ignore[misc]
            mentions(goal.query),
            {"item": node},
        )
        mark = walk.kg.mark
        inserted = Repair(walk.kg).achieve(aim)
        if inserted is None:
            walk.findings.append(Finding("W601", message, scene.kg.name(node)))
        else:
            walk.insert(inserted, message, mark)


def _reach_goals(walk: _Walk, scene: Scene) -> None:
    """Add the steps that bring a goal about, where the domain says what they may be about."""
    agent = {"agent": scene.domain.agent}
    for goal in (*scene.domain.goals, *scene.task.goals):
        if not goal.about or walk.tainted or scene.kg.ask(goal.query, agent):
            continue
        for row in scene.kg.rows(goal.about, agent)[:_MOST_ROWS]:
            aim = Aim(lambda q=goal.query: scene.kg.ask(q, agent), mentions(goal.query), row)  # type: ignore[misc]
            mark = walk.kg.mark
            inserted = Repair(walk.kg).achieve(aim)
            if inserted is not None:
                walk.insert(inserted, goal.message, mark)
                break


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


def _unused(sounds: Sequence[Sound], parsed: Parsed, scene: Scene) -> list[Finding]:
    """Findings for the required items that no step of the plan names."""
    entities = {v for s in sounds if s.bound for v in s.bound.values.values()}
    written = {normal(arg) for w in parsed.calls for arg in w.call.args}
    findings = []
    for name in scene.task.required:
        meant = set(scene.kg.find(name))
        if parsed.calls and not meant & entities and normal(name) not in written:
            message = f"the task requires {name}, which no step of the plan uses"
            findings.append(Finding("E501", message, name))
    return findings


def lost_items(old: Parsed, new: Parsed, scene: Scene) -> tuple[str, ...]:
    """Return the required items that an earlier plan names and a new one no longer does."""

    def named(parsed: Parsed, name: str) -> bool:
        meant = set(scene.kg.find(name))
        args = {arg for w in parsed.calls for arg in w.call.args}
        return any(normal(a) == normal(name) or meant & set(scene.kg.find(a)) for a in args)

    required = scene.task.required
    return tuple(name for name in required if named(old, name) and not named(new, name))


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

