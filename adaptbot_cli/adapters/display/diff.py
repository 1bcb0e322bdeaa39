"""What a run changes in the knowledge graph: facts learned, and the state after the plan."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from rdflib import RDF, Literal, URIRef
from rdflib.term import Node
from rich.console import Group, RenderableType
from rich.text import Text

from adaptbot_cli.adapters.display.words import (
    GAP,
    Mark,
    columns,
    heading,
    join,
    plain_text,
    wrapped,
)
from adaptbot_cli.core.delta import Delta, net
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.terms import AB, STATES, Triple, local

_ADDED, _REMOVED, _CHANGED = Mark("+", "green"), Mark("−", "red"), Mark("~", "yellow")
_WIDEST_NAME, _WIDEST_PROPERTY = 20, 24
"""How wide these columns may become, so that values keep room beside them."""


NOTHING_SEEN = Delta()
"""What surprised where a plan is only rehearsed."""


@dataclass(frozen=True, slots=True)
class PropertyDiff:
    """One property of one thing: the values it had and no longer has, and the new ones."""

    about: str
    prop: str
    old: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    graph: str = ""

    @property
    def mark(self) -> Mark:
        """The sign of the change."""
        if self.old and self.new:
            return _CHANGED
        return _REMOVED if self.old else _ADDED


def diff_table(
    lessons: Sequence[Lesson],
    deltas: Iterable[Delta] | None,
    kg: Kg,
    width: int,
    first: Sequence[str] = (),
    seen: Delta = NOTHING_SEEN,
) -> RenderableType:
    """Return what was learned and how the state differs after the plan, at most `width` wide.

    `deltas` are the changes of the executed steps in order, None if nothing was executed; only
    their net effect is shown, what was `seen` otherwise than expected marked. Things named in
    `first`, such as the items a task requires, come before the others.
    """
    learned = [row for lesson in lessons for row in _learned(lesson, kg)]
    changed = sorted(_rows(net(deltas or ()), kg), key=_Rank(kg, first))
    surprising = {(row.about, row.prop) for row in _rows(seen, kg)}
    states = [
        replace(row, graph="seen" if (row.about, row.prop) in surprising else "") for row in changed
    ]
    names = _width((row.about for row in (*learned, *states)), _WIDEST_NAME)
    lessons_part = [heading("Learned"), _listed(learned, names, width, ""), Text()]
    return Group(
        *(lessons_part if learned else ()),
        heading("State after the plan"),
        _listed(states, names, width, "unchanged" if deltas is not None else "not executed"),
    )


def _width(texts: Iterable[str], widest: int) -> int:
    return min(max((plain_text(text).cell_len for text in texts), default=1), widest)


def _listed(rows: Sequence[PropertyDiff], names: int, width: int, none: str) -> RenderableType:
    if not rows:
        return Text(none, "dim")
    props = _width((row.prop for row in rows), _WIDEST_PROPERTY)
    values = [_values(row) for row in rows]
    room = max(width - 1 - names - props - 3 * GAP, 8)
    table = columns(1, names, props, min(room, max(value.cell_len for value in values)))
    above = ""
    for row, value in zip(rows, values, strict=True):
        name = "" if row.about == above else row.about
        above = row.about
        sign = Text(row.mark.sign, row.mark.style)
        table.add_row(sign, plain_text(name), plain_text(row.prop, "dim"), wrapped(value))
    return table


def _values(row: PropertyDiff) -> Text:
    old = plain_text(", ".join(row.old), "red" if not row.new else "dim")
    new = plain_text(", ".join(row.new), row.mark.style)
    text = join([part for part in (old, new) if part], " → ")
    return text.append(f"  {row.graph}", "dim italic") if row.graph else text


def _learned(lesson: Lesson, kg: Kg) -> Iterator[PropertyDiff]:
    """The facts of a lesson; a new action as one line, whatever facts it takes to describe it."""
    if lesson.action is not None:
        name = lesson.question.about if lesson.replaces else lesson.action.name
        for note in lesson.notes:
            prop, colon, text = note.partition(": ")
            yield (
                PropertyDiff(name, prop, new=(text,))
                if colon
                else PropertyDiff(name, "action", new=(note,))
            )
        return
    yield from _rows(lesson.delta, kg)


def _rows(delta: Delta, kg: Kg) -> list[PropertyDiff]:
    """A change grouped by thing and property."""
    changes: dict[tuple[Node, Node], tuple[list[Node], list[Node]]] = {}
    for side, triples in enumerate((delta.removed, delta.added)):
        for subject, predicate, value in sorted(triples, key=_order):
            changes.setdefault((subject, predicate), ([], []))[side].append(value)
    return [_row(subject, predicate, *sides, kg) for (subject, predicate), sides in changes.items()]


@dataclass(frozen=True, slots=True)
class _Rank:
    """The order of the changes of state: what matters to the task first, the robot last."""

    kg: Kg
    first: Sequence[str]

    def __call__(self, row: PropertyDiff) -> tuple[object, ...]:
        name = normal(row.about)
        matters = name not in {normal(item) for item in self.first}
        agent = row.about == self.kg.name(self.kg.domain.agent)
        return (agent, matters, name, row.prop not in self._places(), row.prop)

    def _places(self) -> set[str]:
        kinds = self.kg.domain.kinds.values()
        return {_label(k.location_property, self.kg) for k in kinds if k.location_property}


def _order(triple: Triple) -> tuple[str, ...]:
    return tuple(map(str, triple))


def _row(subject: Node, predicate: Node, old: list[Node], new: list[Node], kg: Kg) -> PropertyDiff:
    if predicate in _ABSENCES:
        return PropertyDiff(", ".join(map(local, new or old)), _ABSENCES[predicate], new=("no",))
    graph = "state" if kg.home_of(predicate) == STATES else "attribute"
    about, prop = kg.name(subject), _label(predicate, kg)
    return PropertyDiff(about, prop, _names(predicate, old, kg), _names(predicate, new, kg), graph)


_ABSENCES: Mapping[Node, str] = {AB.absentItem: "is here", AB.absentAction: "is possible"}


def _label(predicate: Node, kg: Kg) -> str:
    if predicate == RDF.type:
        return "kind"
    if predicate == AB.alias:
        return "also called"
    known = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
    return known.label if known is not None and known.label else local(predicate)


def _names(predicate: Node, values: Iterable[Node], kg: Kg) -> tuple[str, ...]:
    return tuple(_value(predicate, value, kg) for value in values)


def _value(predicate: Node, value: Node, kg: Kg) -> str:
    if isinstance(value, Literal) and isinstance(value.value, bool):
        return "yes" if value.value else "no"
    if predicate == RDF.type:
        kind = kg.domain.kinds.get(value)  # type: ignore[call-overload]
        return kind.label if kind is not None else local(value)
    return kg.name(value) if isinstance(value, URIRef) else str(value)
