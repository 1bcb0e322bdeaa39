"""What can be offered where no knowledge helps: steps to add, steps to leave out.

Neither is done unasked: a step that brings a required item into the dish changes the recipe, and
one that cannot be done may matter for more than the goal says.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.sparql import mentions
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.plan import Call, Finding, Goal, Parsed
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.refine.grounding import known_values, render, understand
from adaptbot_cli.core.refine.repair import LONGEST_REPAIR, MOST_IN_ALL, MOST_ROWS, Search, aim
from adaptbot_cli.core.report import GroundAction, Report
from adaptbot_cli.core.scene import Scene

_ROUNDS = 5
"""How often a mended plan is looked at again for what else would mend it."""

_MOST_LEFT_OUT = 40
"""How many steps are tried to be left out, one by one, at most."""

_IMPOSSIBLE = frozenset({"E102", "E103", "E202", "E203", "E204", "E301", "E302"})
_TOO_EARLY = frozenset({"E401"})
"""The codes of a step that nothing makes possible, and of one that is not possible where it stands,
so that steps before it may yet make it so."""

_UNMET = frozenset({"E501", "E503"})
"""The codes of what the task requires and the plan does not come to."""

_Things = Mapping[str, Node]


@dataclass(frozen=True, slots=True)
class Mended:
    """A plan that is nearer to its goal: its text, and each change of the old one in words.

    `reaches` tells whether it reaches the goal; `supposed` are facts that are not known and must be
    so for that.
    """

    text: str
    changes: tuple[str, ...]
    reaches: bool = True
    supposed: tuple[Triple, ...] = ()


@dataclass(frozen=True, slots=True)
class _Addition:
    """Calls to add before the step of index `place`, which answer a finding, and why.

    `supposed` are facts that are not known and that the calls need.
    """

    finding: Finding
    place: int
    calls: tuple[Call, ...]
    shown: str
    reason: str
    supposed: tuple[Triple, ...] = ()


def with_remedies(report: Report, scene: Scene) -> Report:
    """Return the report with, in each unmet requirement, the step that would meet it, and where."""
    unmet = [finding for finding in report.findings if finding.code in _UNMET]
    if not unmet or not report.executable:
        unmet = [finding for finding in unmet if finding.subject]
    record = {
        f: a.shown for f in unmet for a in [_addition(f, report, scene)] if a and not a.supposed
    }
    found = tuple(replace(f, remedy=record.get(f, "")) for f in report.findings)
    return replace(report, findings=found) if record else report


def mended(report: Report, scene: Scene, parse: Callable[[str], Parsed]) -> Mended | None:
    """Return a plan without what cannot be done, and with the steps that the goal lacks.

    None if that does not make it executable, or brings it no nearer to its goal.
    """
    changes: list[str] = []
    supposed: list[Triple] = []
    best: Mended | None = None
    short = len(report.open)
    vain: set[Finding] = set()
    with scene.kg.rehearsal():
        for _ in range(_ROUNDS):
            new = dict(_without_helpers(report, scene))
            out = _failing(report, _IMPOSSIBLE) - new.keys()
            added = _additions(report, scene, vain)
            if new or added:
                vain.clear()
            if not new and not out and not added:
                out = _failing(report, _IMPOSSIBLE | _TOO_EARLY)
            if not new and not out and not added:
                break
            changes += _describe(report, new, out, added)
            facts = dict.fromkeys(fact for a in added for fact in a.supposed)
            scene.kg.apply(Delta(added=frozenset(facts)))
            supposed += facts
            text = _written(report, new, out, added)
            report = examine(parse(text), text, scene)
            if report.executable and len(report.open) < short:
                short = len(report.open)
                best = Mended(text, tuple(dict.fromkeys(changes)), not short, tuple(supposed))
            if not short:
                break
    return best


def _failing(report: Report, codes: frozenset[str]) -> set[int]:
    """The steps that nothing but these codes is found of."""
    steps = enumerate(report.steps)
    return {n for n, s in steps if s.status == "finding" and s.codes and set(s.codes) <= codes}


def _without_helpers(report: Report, scene: Scene) -> Iterator[tuple[int, Call]]:
    """The failing steps that can be done with another helper than the one that they name."""
    for n in sorted(_failing(report, _IMPOSSIBLE | _TOO_EARLY)):
        call = report.steps[n].call
        known = resolve.action(call.action, scene).action
        for at, parameter in enumerate(known.visible[: len(call.args)] if known else ()):
            fewer = Call(call.action, (*call.args[:at], *call.args[at + 1 :]))
            free = parameter.default and not scene.requires(call.args[at])
            if free and understand(fewer, scene).ground is not None:
                yield n, fewer
                break


def _additions(report: Report, scene: Scene, vain: set[Finding]) -> list[_Addition]:
    """The steps that would bring about what the plan misses.

    What is made of the required items comes once they are all in. Findings that nothing answers
    join those looked at in `vain`, as the steps of the plan that can be done do not change by that.
    """
    unmet = [f for f in report.findings if f.code in _UNMET and f not in vain]
    for some in ([f for f in unmet if f.subject], [f for f in unmet if not f.subject]):
        found = [a for a in (_addition(f, report, scene) for f in some) if a]
        if found:
            return found
        vain.update(some)
    return []


def _addition(finding: Finding, report: Report, scene: Scene) -> _Addition | None:
    """The steps that answer a finding, and where they belong: where the fewest do.

    Steps that use what the plan leaves unused go before others, then those for which everything is
    known.
    """
    unused = frozenset(
        e for f in report.findings if f.code == "E501" for e in scene.kg.find(f.subject)[:1]
    )
    for goal, item in _goals(finding, scene):
        tries = [(unused, False)] if unused and item is None else []
        supposes = False
        for rather, supposing in (*tries, (frozenset(), False), (frozenset(), True)):
            if supposing and not supposes:
                break
            for limit in (1, 2, 4, LONGEST_REPAIR):
                search = Search(
                    scene.kg,
                    rather=rather,
                    supposing=supposing,
                    longest=limit,
                    bars=scene.bars,
                    left=MOST_IN_ALL,
                )
                found = _first(goal, item, report, scene, search)
                supposes |= search.supposes
                if found:
                    reason = goal.message.format(item=scene.kg.name(item)) if item else goal.message
                    return _as_addition(finding, *found, reason, report, scene)
    return None


def _goals(finding: Finding, scene: Scene) -> Iterator[tuple[Goal, URIRef | None]]:
    """The goals that a finding is about, each with the item that it is asked of, if with one."""
    for goal in (*scene.domain.goals, *scene.task.goals):
        classes = [URIRef(iri) for iri in goal.classes]
        if not finding.subject and not classes and goal.message == finding.message:
            yield goal, None
        asked = finding.subject in goal.items if goal.items else finding.subject and classes
        for item in scene.kg.find(finding.subject)[:1] if asked else ():
            if scene.kg.is_a(item, classes):
                yield goal, item


def _first(
    goal: Goal, item: URIRef | None, report: Report, scene: Scene, search: Search
) -> tuple[int, list[GroundAction]] | None:
    """Find the first place in the plan from which few enough steps bring a goal about.

    An item goes in before the first step that works on what holds it then, as ab:before tells, but
    not before the plan's own last step with it. Else looked at is where a step has just dealt with
    a thing that the goal is about. Last comes the end.
    """
    kg = scene.kg
    own = [n for n, b in enumerate(report.grounded) if b and item in b.values.values()]
    with kg.rehearsal():
        for n, (ground, delta) in enumerate(zip(report.grounded, report.deltas, strict=True)):
            dealt = set(ground.values.values()) if ground else set()
            if item is None:
                kg.apply(delta)
            elif (
                not ground or n <= max(own, default=-1) or str(ground.action.iri) not in goal.before
            ):
                dealt = set()
            place = n + 1 if item is None else n
            steps = _steps(goal, item, scene, search, dealt) if dealt else []
            if steps and place < len(report.steps):
                return place, steps
            if item is not None:
                kg.apply(delta)
        steps = _steps(goal, item, scene, search, None)
    return (len(report.steps), steps) if steps else None


def _steps(
    goal: Goal, item: URIRef | None, scene: Scene, search: Search, dealt: set[Node] | None
) -> list[GroundAction]:
    """The steps that bring a goal about now, with the first of the things that will do: those that
    a step has dealt with, if some are given."""
    kg = scene.kg
    given: dict[str, Node] = {"item": item} if item is not None else {}
    for row in _rows(goal, given, scene, dealt)[:MOST_ROWS]:
        mark = kg.mark
        more = {f"rather {n}": node for n, node in enumerate(sorted(search.rather, key=str))}
        steps = search.achieve(aim(kg, goal.query, given, {**row, **given, **more}))
        kg.undo_to(mark)
        used = {node for step in steps or () for node in step.values.values()}
        if steps and (not search.rather or search.rather & used):
            return steps
    return []


def _rows(goal: Goal, given: _Things, scene: Scene, dealt: set[Node] | None) -> list[_Things]:
    """The things that a goal may be brought about with, besides those that it names."""
    query = goal.helped_by or goal.about
    rows: list[_Things] = list(scene.kg.rows(query, given)) if query else [{}]
    if dealt is None:
        return rows
    if given:
        among = {*dealt, *given.values()}
        return [row for row in rows if set(row.values()) <= among]
    named = {iri for iri in mentions(goal.query) if scene.kg.classes(iri)}
    return [row for row in rows if dealt & ({*row.values()} or named)]


def _as_addition(
    finding: Finding,
    place: int,
    steps: list[GroundAction],
    reason: str,
    report: Report,
    scene: Scene,
) -> _Addition:
    while place and place <= len(report.steps) and report.steps[place - 1].status == "inserted":
        place -= 1  # before the missing steps that were inserted for the step that follows
    after = next((step for step in report.steps[place:] if step.source is not None), None)
    where = f"before {after.call.render()}" if after else "at the end"
    calls = tuple(render(step, scene.kg) for step in steps)
    doing = [c.render() for c, step in zip(calls, steps, strict=True) if not step.action.fetches]
    supposed = tuple(fact for step in steps for fact in _unknown(step, scene))
    return _Addition(finding, place, calls, f"{', '.join(doing)} {where}", reason, supposed)


def _unknown(ground: GroundAction, scene: Scene) -> Iterator[Triple]:
    """The attributes that an action needs and that are not known, as it needs them."""
    for need in ground.action.attributes:
        entity = ground.values.get(need.of)
        if not isinstance(entity, URIRef) or need.assume:
            continue
        if not known_values(scene.kg, entity, need.prop):
            yield entity, need.prop, need.value


def _describe(
    report: Report, new: Mapping[int, Call], out: set[int], added: Sequence[_Addition]
) -> list[str]:
    steps = report.steps
    return [
        *(f"{steps[n].call.render()} as {new[n].render()}: {steps[n].reason}" for n in sorted(new)),
        *(f"leave out {steps[n].call.render()}: {steps[n].reason}" for n in sorted(out)),
        *(f"add {a.shown}: {a.reason}" for a in added),
    ]


def _written(
    report: Report, new: Mapping[int, Call], out: set[int], added: Sequence[_Addition]
) -> str:
    """The plan's own steps as a text, without some and with others; the rest is found again."""
    lines = []
    for n in range(len(report.steps) + 1):
        lines += [call for a in added if a.place == n for call in a.calls]
        if n < len(report.steps):
            step = report.steps[n]
            if n not in out and step.status not in ("inserted", "dropped"):
                lines.append(new.get(n, step.call))
    return "\n".join(call.render() for call in lines)
