"""What is measured of one trial. Each measure is defined in docs/evaluation.md."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.report import GroundAction, Report, Result
from adaptbot_cli.core.view.summary import findings
from adaptbot_cli.evaluation.figures import WORLD_MEANS, WORLD_SHARES

OF_WORLD = frozenset({*WORLD_SHARES, *WORLD_MEANS})
"""The measures that only a trial in a world has."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One task in one arm, measured.

    `nodes` and `edges` are those of the graph before and after; `taught` the facts learned, as
    N-Triples; `answers` what the model said, where it is not recorded elsewhere. The last ones are
    of a trial in a world: the goal there, steps that failed and were recovered from without the
    person, planted errors that the person and the world put right.
    """

    id: str
    arm: str
    task: str
    model: str
    domain: str
    index: int
    outcome: str
    executable: bool
    goal_met: bool
    overlap: float | None
    effective_overlap: float | None
    required_lost: int
    model_calls: int
    prompt_tokens: int
    completion_tokens: int
    questions: int
    prompts: int
    person_seconds: float
    nodes: tuple[int, int]
    edges: tuple[int, int]
    seconds: float
    required: tuple[str, ...]
    unused: tuple[str, ...]
    unworked: tuple[str, ...]
    lost: tuple[str, ...]
    findings: dict[str, int]
    messages: tuple[str, ...]
    substitutions: tuple[dict[str, str], ...]
    asked: tuple[dict[str, str], ...]
    taught: tuple[str, ...]
    recorded: dict[str, float]
    answers: tuple[str, ...] = ()
    world_goal_met: bool | None = None
    steps_failed: int | None = None
    recovered: int | None = None
    repaired_by_person: int | None = None
    repaired_by_seeing: int | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the trial as a plain object, as it is read back from a file."""
        record = {key: v for key, v in asdict(self).items() if v is not None or key not in OF_WORLD}
        return {key: list(v) if isinstance(v, tuple) else v for key, v in record.items()}


@dataclass(frozen=True, slots=True)
class ItemCounts:
    """What a result says of the task's required items.

    `used` are those that a step which succeeded names; `worked` those that such a step did more
    with than fetch them; `lost` those that no step uses any more while nothing says so.
    """

    used: tuple[str, ...]
    worked: tuple[str, ...]
    lost: tuple[str, ...]


def seen(result: Result, required: Iterable[str], found: Iterable[Finding], kg: Kg) -> ItemCounts:
    """Look at what became of the required items; `told` are the findings that the arm reports."""
    steps = list(_succeeded(result.report))
    wanted = tuple(required)
    met = {entity for ground, delta in steps for entity in _met(ground, delta)}
    needed = {entity for name in wanted for entity in kg.find(name)}
    worked = {
        entity
        for ground, delta in steps
        if not _carries(ground.action, delta, needed, kg)
        for entity in _met(ground, delta)
    }
    used = tuple(name for name in wanted if met & set(kg.find(name)))
    reported = {normal(finding.subject) for finding in found}
    names, things = _named(result.report, kg)
    lost = tuple(
        name
        for name in wanted
        if normal(name) not in reported | names and not things & set(kg.find(name))
    )
    return ItemCounts(used, tuple(name for name in wanted if worked & set(kg.find(name))), lost)


def _succeeded(report: Report) -> Iterator[tuple[GroundAction, Delta]]:
    """The steps that changed the world as they should, with what they changed."""
    rows = zip(report.steps, report.grounded, report.deltas, strict=True)
    for step, ground, delta in rows:
        took_place = step.status not in ("dropped", "finding") and step.done != "failed"
        if ground is not None and delta and took_place:
            yield ground, delta


def _met(ground: GroundAction, delta: Delta) -> set[Node]:
    """The things that a step is about: its arguments, hidden ones too, and what it changed."""
    return {*ground.values.values(), *(triple[0] for triple in delta.added | delta.removed)}


def _carries(action: Action, delta: Delta, needed: set[URIRef], kg: Kg) -> bool:
    """Tell whether a step only fetches: it takes a thing, or sets it down on a fixed place.

    Setting it down on a place that the task itself requires is what the task wants: toys go into
    the toy box.
    """
    if action.fetches:
        return True
    places = {kind.location_property for kind in kg.domain.classes.values()}
    changed = delta.added | delta.removed
    if any(t[1] not in places and t[0] != kg.domain.agent for t in changed):
        return False
    movable = {c for a in kg.domain.actions.values() if a.fetches for c in a.parameters[0].classes}
    reached = [t[2] for t in delta.added if t[1] in places]
    return not any(kg.is_a(place, movable) or place in needed for place in reached)


def _named(report: Report, kg: Kg) -> tuple[set[str], set[Node]]:
    """What the steps that were not dropped are about: names as written, and things."""
    rows = zip(report.steps, report.grounded, strict=True)
    kept = [(step, ground) for step, ground in rows if step.status != "dropped"]
    names = {normal(arg) for step, _ in kept for arg in step.call.args}
    things = {value for _, ground in kept if ground for value in ground.values.values()}
    return names, things | {entity for name in names for entity in kg.find(name)}


def substitutions(result: Result) -> tuple[dict[str, str], ...]:
    """Return every substitution of the final plan, each once, with its evidence."""
    found = [
        {"from": c.source, "to": c.target, "by": c.by, "evidence": c.evidence}
        for step in result.report.steps
        for c in step.changes
    ]
    return tuple({tuple(entry.values()): entry for entry in found}.values())


def codes(result: Result) -> dict[str, int]:
    """Return how many findings of each code are left."""
    return dict(sorted(Counter(finding.code for finding in findings(result)).items()))


def messages(result: Result) -> tuple[str, ...]:
    """Return what the findings left say, each with its code and step."""
    return tuple(
        f"{f.code} step {f.step}: {f.message}" if f.step else f"{f.code} {f.message}"
        for f in findings(result)
    )


def asked(result: Result) -> tuple[dict[str, str], ...]:
    """Return the questions asked, with the answers."""
    return tuple(
        {"about": q.about, "kind": q.kind, "prop": q.prop, "answer": a.value}
        for q, a in result.questions
    )


def taught(result: Result) -> tuple[str, ...]:
    """Return the facts learned, as N-Triples, those left out that graphs do not count."""
    facts = {t for lesson in result.lessons for t in lesson.delta.added if lesson.action is None}
    own = str(AB)
    return tuple(
        sorted(f"{s.n3()} {p.n3()} {o.n3()} ." for s, p, o in facts if not str(p).startswith(own))
    )


def share(part: Iterable[str], whole: Iterable[str]) -> float | None:
    """Return |part| / |whole| (paper, equation 1), None where nothing is required."""
    count = len(list(whole))
    return len(list(part)) / count if count else None
