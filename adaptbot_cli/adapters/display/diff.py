"""What a run changes in the knowledge graph: facts learned, and the state after the plan."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from rdflib import URIRef
from rdflib.term import Node
from rich.console import Group, RenderableType
from rich.text import Text

from adaptbot_cli.adapters.display.cells import GAP, Mark, Wrapped, columns, plain_text
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, Triple
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.view.changes import Words, grouped

SIGNS: Mapping[str, Mark] = {
    "added": Mark("+", "green"),
    "removed": Mark("−", "red"),
    "changed": Mark("~", "yellow"),
}
_ABSENCES: Mapping[Node, str] = {AB.absentItem: "is here", AB.absentAction: "is possible"}
_WIDEST_NAME, _WIDEST_PROPERTY = 20, 24
"""How wide these columns may become, so that values keep room beside them."""
_MOST = 100
"""How many changes are listed: nobody reads on where a bowl of thousands is emptied."""


@dataclass(frozen=True, slots=True)
class _Row:
    """One property of one thing with its old and new value, "" for none."""

    sign: str
    about: str
    prop: str
    old: str = ""
    new: str = ""
    note: str = ""


def diff_table(
    lessons: Sequence[Lesson],
    deltas: Iterable[Delta] | None,
    kg: Kg,
    width: int,
    first: Sequence[str] = (),
    seen: Collection[Triple] = (),
) -> RenderableType:
    """Return what was learned and how the state differs after the plan, at most `width` wide.

    `deltas` are the changes of the executed steps in order, None if nothing was executed; only
    their net effect is shown, and marked where it was `seen` rather than expected. Things named in
    `first`, such as the items a task requires, come before the others, the robot last.
    """
    learned = [row for lesson in lessons for row in _learned(lesson, kg)]
    agent, wanted = kg.name(kg.domain.agent), {normal(name) for name in first}
    surprising: dict[tuple[Node, Node], str] = {fact[:2]: "seen" for fact in seen}
    states = sorted(
        _rows(net(deltas or ()), kg, surprising),
        key=lambda row: (row.about == agent, normal(row.about) not in wanted),
    )
    names = _width((row.about for row in (*learned, *states)), _WIDEST_NAME)
    lessons_part = [Text("Learned", "bold"), _listed(learned, names, width, ""), Text()]
    return Group(
        *(lessons_part if learned else ()),
        Text("State after the plan", "bold"),
        _listed(states, names, width, "unchanged" if deltas is not None else "not executed"),
    )


def _width(texts: Iterable[str], widest: int) -> int:
    return min(max((plain_text(text).cell_len for text in texts), default=1), widest)


def _listed(rows: Sequence[_Row], names: int, width: int, none: str) -> RenderableType:
    if not rows:
        return Text(none, "dim")
    more = len(rows) - _MOST
    rows = rows[:_MOST]
    props = _width((row.prop for row in rows), _WIDEST_PROPERTY)
    values = [_values(row) for row in rows]
    room = max(width - 1 - names - props - 3 * GAP, 8)
    table = columns(1, names, props, min(room, max(value.cell_len for value in values)))
    above = ""
    for row, value in zip(rows, values, strict=True):
        mark, name = SIGNS[row.sign], "" if row.about == above else row.about
        above = row.about
        sign = Text(mark.sign, mark.style)
        table.add_row(sign, plain_text(name), plain_text(row.prop, "dim"), Wrapped(value))
    return Group(table, Text(f"and {more:,} more", "dim")) if more > 0 else table


def _values(row: _Row) -> Text:
    old = plain_text(row.old, "dim" if row.new else "red")
    new = plain_text(row.new, SIGNS[row.sign].style)
    text = Text(" → ").join(part for part in (old, new) if part)
    return text.append(f"  {row.note}", "dim italic") if row.note else text


def _learned(lesson: Lesson, kg: Kg) -> Iterator[_Row]:
    """The facts of a lesson; a new action by its notes, whatever facts it takes to describe it."""
    if lesson.action is None:
        yield from _rows(lesson.delta, kg, None)
        return
    name = lesson.question.about if lesson.replaces else lesson.action.name
    for note in lesson.notes:
        prop, colon, text = note.partition(": ")
        yield _Row("added", name, *((prop, "", text) if colon else ("action", "", note)))


def _rows(delta: Delta, kg: Kg, notes: Mapping[tuple[Node, Node], str] | None) -> Iterator[_Row]:
    """A change by thing and property; without `notes` each row is noted with its graph."""
    nodes = {node for fact in delta.removed | delta.added for node in fact[::2]}
    names: dict[Node, str] = {}
    names |= {n: kg.name(n) for n in nodes if isinstance(n, URIRef) and n not in kg.domain.classes}
    words = Words(kg.domain, names)
    for thing in grouped(delta, words):
        for edit in thing.edits:
            about, prop = words.name(thing.entity), words.label(edit.predicate)
            old, new = ("" if v is None else words.value(v) for v in (edit.old, edit.new))
            graph = words.graph(edit.predicate)
            note = graph if notes is None else notes.get((thing.entity, edit.predicate), "")
            if edit.predicate in _ABSENCES:
                about, prop, note = new or old, _ABSENCES[edit.predicate], ""
                old, new = old and "no", new and "no"
            yield _Row(edit.sign, about, prop, old, new, note)
