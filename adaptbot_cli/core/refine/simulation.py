"""A plan on its way through the graph: each step with what it needs and what it changes."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice

from rdflib import Literal
from rdflib.term import Node

from adaptbot_cli.core.ask.learning import is_absent
from adaptbot_cli.core.domain import Condition
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.sparql import variables
from adaptbot_cli.core.graph.terms import TRUE, Triple
from adaptbot_cli.core.plan import Finding, Status, Step, Written
from adaptbot_cli.core.refine.grounding import Sound, attribute_findings, render, sentence
from adaptbot_cli.core.refine.repair import (
    MOST_DEFAULTS,
    MOST_OF_A_PLAN,
    MOST_ROWS,
    MOST_TO_KEEP,
    Aim,
    Key,
    Search,
    aim,
    all_hold,
    barred,
    fact_aim,
    holds,
    is_done,
    key_of,
    needs_of,
    perform,
    readings,
)
from adaptbot_cli.core.report import GroundAction


@dataclass(slots=True)
class Simulation:
    """The plan as far as it has been rehearsed; `place` is that of the written call at hand,
    `left_there` are things that cannot be picked up and need not be. Without `repair` no step is
    inserted. `needed` tells up to which place the plan's own steps need facts of a thing (None: of
    any) with a predicate; what they need is brought about again where they stand. No step is
    inserted with what `bars` holds of. `left` are the actions that repairs may still try."""

    kg: Kg
    repair: bool = True
    needed: Mapping[tuple[Node | None, Node], int] = field(default_factory=dict)
    steps: list[Step] = field(default_factory=list)
    grounded: list[GroundAction | None] = field(default_factory=list)
    deltas: list[Delta] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    tainted: set[Node] = field(default_factory=set)
    left_there: set[Node] = field(default_factory=set)
    place: int = 0
    bars: Callable[[Node], bool] | None = None
    _achieved: dict[Triple, int] = field(default_factory=dict)
    _early: dict[Key, str] = field(default_factory=dict)
    gave_up: bool = False
    left: float = MOST_OF_A_PLAN

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
            why = f"{_reason(sound.dropped, self.kg)}, and it is not required"
            self._add(replace(step, status="dropped", reason=why), None)
        elif sound.ground is None:
            self._unsound(step, sound)
        else:
            self._sound(step, sound, sound.ground)

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

    def _sound(self, step: Step, sound: Sound, ground: GroundAction) -> None:
        """Take a step that is understood, with the first things for which it can be done."""
        start, count = self.kg.mark, len(self.steps)
        first: tuple[GroundAction, list[Finding]] | None = None
        again = False
        for reading in islice(readings(ground, self.kg), MOST_DEFAULTS if self.repair else 1):
            if first is not None:
                self._back_to(start, count)
                again = True
            tainted = bool(self.tainted & set(reading.values.values()))
            if not tainted and self._done_before(reading, step):
                return
            problems = [] if tainted else self._problems(reading, sound)
            if not problems:
                self._do(step, sound, reading, tainted)
                return
            first = first or (reading, problems)
        if first is None:
            return
        reading, problems = first
        if again:
            self._back_to(start, count)
        if self.repair and all(f.code == "E401" for f in problems) and is_done(reading, self.kg):
            self._back_to(start, count)
            why = f"{problems[0].message}, but what it is for is so already"
            self._add(replace(step, status="dropped", reason=why), None)
            return
        if again:
            problems = self._problems(reading, sound)  # with the steps that some of its needs have
        self._do(step, sound, reading, False, problems)

    def _problems(self, ground: GroundAction, sound: Sound) -> list[Finding]:
        problems = attribute_findings(ground, self.kg) + list(self._no_default(ground))
        return problems or list(self._unmet(ground, sound))

    def _do(
        self,
        step: Step,
        sound: Sound,
        ground: GroundAction,
        tainted: bool,
        problems: Sequence[Finding] = (),
    ) -> None:
        advice = () if tainted else tuple(self._advice(ground))
        status: Status = "finding" if problems else "changed" if sound.changes else "ok"
        self._note([*problems, *advice], step)
        codes = tuple(dict.fromkeys(f.code for f in (*problems, *advice)))
        reason = "; ".join(f.message for f in (*problems, *advice))
        mark = self.kg.mark
        if not problems and (not tainted or all_hold(ground, self.kg)):
            perform(ground, self.kg)
        self._add(replace(step, status=status, codes=codes, reason=reason), ground, mark)
        for fact in self.deltas[-1].added:
            self._achieved[fact] = len(self.steps)

    def _done_before(self, ground: GroundAction, step: Step) -> bool:
        """Whether a repair has moved this step to an earlier place, where it has been done."""
        reason = self._early.get(key_of(ground))
        if reason is None or not is_done(ground, self.kg):
            return False
        self._add(replace(step, status="dropped", reason=f"done before: {reason}"), None)
        return True

    def _back_to(self, mark: int, count: int) -> None:
        self.kg.undo_to(mark)
        del self.steps[count:], self.grounded[count:], self.deltas[count:]

    def _kept(self) -> frozenset[Triple]:
        """The states that the plan's steps have brought about: a repair may not undo them.

        Where a thing is, or the robot, is but a means to an end. What a later step needs again is
        brought about again where it stands.
        """
        return frozenset(
            fact
            for fact in self._achieved
            if isinstance(fact[2], Literal)
            and fact[0] != self.kg.domain.agent
            and all(self.needed.get((n, fact[1]), -1) <= self.place for n in (fact[0], None))
            and fact in self.kg.facts
        )

    def _advice(self, ground: GroundAction) -> Iterator[Finding]:
        for condition in ground.action.advises:
            if not holds(condition, ground, self.kg):
                message = sentence(condition.message, ground, self.kg)
                steps = self._suggested(condition, ground)
                yield Finding("W602", message, ground.action.name, candidates=steps)

    def _suggested(self, condition: Condition, ground: GroundAction) -> tuple[str, ...]:
        """The missing steps that would have made sense of a step, for the person to judge."""
        if not condition.about:
            return ()
        for row in self.kg.rows(condition.about, ground.values)[:MOST_ROWS]:
            wanted = aim(self.kg, condition.query, ground.values, {**ground.values, **row})
            mark = self.kg.mark
            steps = Search(self.kg, without=ground.action.name, bars=self.bars).achieve(wanted)
            calls = tuple(render(step, self.kg).render() for step in steps or ())
            self.kg.undo_to(mark)
            if calls:
                return calls
        return ()

    def _no_default(self, ground: GroundAction) -> Iterator[Finding]:
        asked = {name for c in ground.action.conditions for name in variables(c.query)}
        for parameter in ground.action.parameters:
            if parameter.default and parameter.name in asked - ground.values.keys():
                kinds = map(self.kg.domain.label, parameter.classes)
                what = f"{' or '.join(kinds)} here that can serve as {parameter.name}"
                yield Finding("E401", f"there is no {what}", ground.action.name)

    def _unmet(self, ground: GroundAction, sound: Sound) -> Iterator[Finding]:
        """Achieve all that the step needs, together; yield a finding for each need left open."""
        effect = ground.action.effect
        needs: list[tuple[Aim, str]] = []
        for entity, prop in sound.states:
            if not effect or prop not in effect.predicates:  # else the step itself brings it about
                text = f"{self.kg.name(entity)} must be {self.kg.domain.label(prop)} by then"
                needs.append((fact_aim(self.kg, (entity, prop, TRUE)), text))
        messages = (sentence(c.message, ground, self.kg) for c in ground.action.conditions)
        needs += zip(needs_of(ground, self.kg), messages, strict=True)
        if self.achieve(needs, ground):
            return
        for wanted, message in needs:  # those that can be met by themselves, to tell the others
            self.achieve([(wanted, message)], ground)
        for wanted, message in needs:
            if not wanted.holds():
                text = (
                    f"{message}; the search was given up at its limit" if self.gave_up else message
                )
                yield Finding("E401", text, ground.action.name)

    def achieve(self, needs: Sequence[tuple[Aim, str]], before: GroundAction | None = None) -> bool:
        """Insert the steps that make all of some needs hold, if there are any such steps.

        They do not undo what the plan has come to so far, unless nothing else helps: then a warning
        says so. Nor do they undo what the step that they stand `before` is for. A step that uses
        something barred is not made possible.
        """
        open_ = [message for wanted, message in needs if not wanted.holds()]
        if not open_ or not self.repair or (before and barred(before, self.bars)):
            return not open_
        aims = [wanted for wanted, _ in needs]
        mark = self.kg.mark
        left = max(MOST_TO_KEEP, self.left)
        search = Search(self.kg, kept=self._kept(), yielding=True, bars=self.bars, left=left)
        inserted = search.achieve(*aims)
        self.gave_up = search.gave_up
        self.left -= left - search.left
        if inserted and search.undone:
            self.kg.undo_to(mark)
            careful = replace(search, yielding=False, longest=len(inserted) + 3, most=MOST_TO_KEEP)
            better = careful.achieve(*aims)
            if better is None and before and is_done(before, self.kg):
                return False
            inserted = better or search.achieve(*aims) or []
            for fact in () if better else search.undone:
                name, number = self.kg.name(fact[0]), self._achieved[fact]
                text = f"what is missing here undoes what step {number} did to {name}"
                self.findings.append(Finding("W605", text, name, len(self.steps) + 1))
        if inserted is None:
            return False
        self.insert(inserted, "; ".join(dict.fromkeys(open_)), mark)
        return True

    def insert(self, inserted: Sequence[GroundAction], reason: str, mark: int) -> None:
        """Add steps that a repair has found and performed since `mark`."""
        for offset, ground in enumerate(inserted):
            call = render(ground, self.kg)
            step = Step(call, status="inserted", reason=reason)
            self._add(step, ground, mark + offset, mark + offset + 1)
            self._early[key_of(ground)] = reason

    def _note(self, findings: Iterable[Finding], step: Step) -> None:
        number = len(self.steps) + 1
        self.findings += [replace(f, step=number, line=step.line) for f in findings]

    def _add(
        self, step: Step, ground: GroundAction | None, start: int = -1, end: int | None = None
    ) -> None:
        self.steps.append(step if step.source is None else replace(step, place=self.place))
        self.grounded.append(ground)
        changes = self.kg.changes(start, end) if start >= 0 else []
        self.deltas.append(changes[0] if changes else Delta())
        for fact in self.deltas[-1].removed:
            self._achieved.pop(fact, None)


def _reason(name: str, kg: Kg) -> str:
    absent = is_absent(kg, name, "item") or is_absent(kg, name, "action")
    return f"{name} is not here" if absent else f"nobody has said what {name} is"
