"""A plan on its way through the graph: each step with what it needs and what it changes."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.domain import Condition, Parameter
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import is_absent
from adaptbot_cli.core.plan import Finding, Status, Step, Written
from adaptbot_cli.core.rehearse import (
    MOST_ROWS,
    Aim,
    Repair,
    aim_of,
    all_hold,
    complete,
    holds,
    perform,
)
from adaptbot_cli.core.report import Bound
from adaptbot_cli.core.sparql import variables
from adaptbot_cli.core.static import Sound, attribute_findings, render, sentence
from adaptbot_cli.core.terms import TRUE


@dataclass(slots=True)
class Walk:
    """The plan as far as it has been rehearsed; `place` is that of the written call at hand,
    `left_there` are things that cannot be picked up and need not be. Without `repair` no step is
    inserted, and none ever with what `bars` holds of."""

    kg: Kg
    repair: bool = True
    steps: list[Step] = field(default_factory=list)
    bounds: list[Bound | None] = field(default_factory=list)
    deltas: list[Delta] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    tainted: set[Node] = field(default_factory=set)
    left_there: set[Node] = field(default_factory=set)
    place: int = 0
    bars: Callable[[Node], bool] | None = None

    def skip(self, written: Written, reason: str) -> None:
        """Leave out a step of the plan that is not needed."""
        step = Step(written.call, written.source, written.line, "dropped", reason=reason)
        self._add(step, None)

    def take(self, written: Written, sound: Sound, pointless: str = "") -> None:
        """Take one step of the plan, with the missing steps before it."""
        step = Step(sound.call, written.source, written.line, changes=sound.changes)
        if pointless:
            self._pointless(step, sound, pointless)
        elif sound.dropped:
            why = f"{_reason(sound.dropped, self.kg)}, and the goal does not need it"
            self._add(replace(step, status="dropped", reason=why), None)
        elif sound.bound is None:
            self._unsound(step, sound)
        else:
            self._sound(step, sound, sound.bound)

    def _pointless(self, step: Step, sound: Sound, reason: str) -> None:
        """Leave out a step that is not needed; if it could not be done either, say so."""
        findings = [Finding("W603", reason, f.subject) for f in sound.findings[:1]]
        self._note(findings, step)
        self.left_there |= {e for f in findings for e in self.kg.find(f.subject)}
        codes = tuple(f.code for f in findings)
        self._add(replace(step, status="dropped", reason=reason, codes=codes), None)

    def _unsound(self, step: Step, sound: Sound) -> None:
        self.tainted |= {e for arg in sound.call.args for e in self.kg.find(arg)} or {Literal("?")}
        self._note(sound.findings, step)
        codes = tuple(dict.fromkeys(f.code for f in sound.findings))
        message = "; ".join(f.message for f in sound.findings)
        self._add(replace(step, status="finding", codes=codes, reason=message), None)

    def _sound(self, step: Step, sound: Sound, bound: Bound) -> None:
        bound = complete(bound, self.kg)
        problems: list[Finding] = []
        advice: list[Finding] = []
        tainted = bool(self.tainted & set(bound.values.values()))
        if not tainted:
            problems = attribute_findings(bound, self.kg) + list(self._no_default(bound))
            problems += [] if problems else self._unmet(bound, sound)
            advice = list(self._advice(bound))
        status: Status = "changed" if sound.changes else "ok"
        if problems:
            status = "finding"
        self._note([*problems, *advice], step)
        codes = tuple(dict.fromkeys(f.code for f in (*problems, *advice)))
        reason = "; ".join(f.message for f in (*problems, *advice))
        mark = self.kg.mark
        if not problems and (not tainted or all_hold(bound, self.kg)):
            perform(bound, self.kg)
        self._add(replace(step, status=status, codes=codes, reason=reason), bound, mark)

    def _advice(self, bound: Bound) -> Iterator[Finding]:
        for condition in bound.action.advises:
            if not holds(condition, bound, self.kg):
                message = sentence(condition.message, bound, self.kg)
                steps = self._suggested(condition, bound)
                yield Finding("W602", message, bound.action.name, candidates=steps)

    def _suggested(self, condition: Condition, bound: Bound) -> tuple[str, ...]:
        """The missing steps that would have made sense of a step, for the person to judge."""
        if not condition.about:
            return ()
        for row in self.kg.rows(condition.about, bound.values)[:MOST_ROWS]:
            aim = aim_of(condition, bound, self.kg)
            aim = replace(aim, values={**bound.values, **row})
            mark = self.kg.mark
            steps = Repair(self.kg, without=bound.action.name, bars=self.bars).achieve(aim)
            calls = tuple(render(step, self.kg).render() for step in steps or ())
            self.kg.undo_to(mark)
            if calls:
                return calls
        return ()

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
        inserted = Repair(self.kg, bars=self.bars).achieve(aim) if self.repair else None
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
        self.steps.append(step if step.source is None else replace(step, place=self.place))
        self.bounds.append(bound)
        changes = self.kg.changes(start, end) if start >= 0 else []
        self.deltas.append(changes[0] if changes else Delta())


def _reason(name: str, kg: Kg) -> str:
    absent = is_absent(kg, name, "item") or is_absent(kg, name, "action")
    return f"{name} is not here" if absent else f"nobody has said what {name} is"


def _matters(parameter: Parameter, bound: Bound) -> bool:
    queries = [c.query for c in bound.action.conditions]
    return bool(parameter.default) and any(parameter.name in variables(q) for q in queries)
