"""The page of a domain: classes with their things, properties, tasks; the actions stand apart."""

from collections.abc import Iterator

from rdflib import RDF, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Kind, Property
from adaptbot_cli.core.handbook.actions import action_lines
from adaptbot_cli.core.handbook.markdown import code, count, listed, must, said, sparql, table
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import a
from adaptbot_cli.core.plan import Goal
from adaptbot_cli.core.terms import local

_MOST_NAMES = 12
_NOTE = (
    "In the queries `?agent` is the robot and a parameter is a variable of its name. What a query "
    "finds by itself stands in *italics*."
)
_VALUES = {XSD.boolean: "yes or no", XSD.string: "a text", XSD.integer: "a whole number"}


def handbook(kg: Kg) -> str:
    """Return a readable page of a domain, as Markdown; the same for the same pack."""
    return "\n".join(_page(kg)).rstrip() + "\n"


def _page(kg: Kg) -> Iterator[str]:
    domain = kg.domain
    nodes, edges = kg.size()
    yield from (f"# {said(domain.name)}", "")
    if domain.comment:
        yield from (said(domain.comment), "")
    sizes = (len(domain.actions), "action"), (len(domain.tasks), "task"), (nodes, "node")
    yield ", ".join(count(*size) for size in (*sizes, (edges, "edge"))) + "."
    yield from ("", "## What there is", "")
    for kind in _roots(kg):
        yield from _kind(kg, kind, 0)
    yield from ("", "## What can be said of it", "")
    yield from ("### Attributes: what things are and can do", "")
    yield from _properties(kg, "attribute")
    yield from ("", "### States: how things are now", "")
    yield from _properties(kg, "state")
    yield from ("", "## What the robot can do", "", _NOTE, "")
    for action in domain.actions.values():
        yield from action_lines(action, kg)
    yield from ("## What must hold in the end", "")
    yield from _goals(kg, domain.goals)
    for advice in domain.advice:
        yield from (f"- a warning for each `?item` found, “{said(advice.message)}”:", "")
        yield from (*sparql(advice.source, "  "), "")
    yield from ("## Tasks", "")
    for task in sorted(domain.tasks, key=lambda task: task.name):
        yield from (f"### {said(task.name)}", "")
        others = [name for name, known in domain.task_names.items() if known is task]
        also = sorted(name.replace("_", " ") for name in others)[: _MOST_NAMES + 1]
        also = [name for name in also if name != task.name.replace("_", " ").lower()]
        yield from (f"Also asked for as: {', '.join(map(said, also))}.", "") if also else ()
        yield from (f"Requires {listed(sorted(task.required))}.", "")
        yield from _goals(kg, task.goals)


def _roots(kg: Kg) -> list[Kind]:
    kinds = kg.domain.kinds
    return [k for k in _ordered(kg) if not any(above in kinds for above in k.supers[1:])]


def _ordered(kg: Kg) -> list[Kind]:
    return sorted(kg.domain.kinds.values(), key=lambda k: (k.order or 99, k.label, k.iri))


def _kind(kg: Kg, kind: Kind, depth: int) -> Iterator[str]:
    """A class as an item of a list, those directly below it under it."""
    indent = "  " * depth
    about = f": {said(kind.comment)}" if kind.comment else ""
    yield f"{indent}- **{said(kind.label)}** {code(local(kind.iri))}{about}"
    for line in _of_kind(kg, kind):
        yield f"{indent}  - {line}"
    for other in _ordered(kg):
        between = [k for k in other.supers[1:] if k != kind.iri and kind.iri in _above(kg, k)]
        if kind.iri in other.supers[1:] and not between:
            yield from _kind(kg, other, depth + 1)


def _above(kg: Kg, iri: URIRef) -> tuple[URIRef, ...]:
    return kg.domain.kinds[iri].supers[1:] if iri in kg.domain.kinds else ()


def _of_kind(kg: Kg, kind: Kind) -> Iterator[str]:
    members = sorted(kg.name(thing) for thing in kg.facts.subjects(RDF.type, kind.iri))
    if members:
        more = f" and {len(members) - _MOST_NAMES} more" if len(members) > _MOST_NAMES else ""
        yield f"{len(members)} here: {listed(members[:_MOST_NAMES])}{more}"
    if kind.asks:
        asked = ", ".join(said(_label(kg, iri)) for iri in kind.asks)
        yield f"of a new one, a person is asked: {asked}"
    starts = [
        f"{said(_label(kg, start.prop))}: {_plain(kg, start.value)}"
        + (f" (if {said(_label(kg, start.when))})" if start.when else "")
        for start in kind.starts
    ]
    if starts:
        yield f"a new one starts with {', '.join(starts)}"


def _label(kg: Kg, iri: URIRef) -> str:
    return kg.domain.properties[iri].label if iri in kg.domain.properties else local(iri)


def _plain(kg: Kg, value: Node) -> str:
    if isinstance(value, Literal) and isinstance(value.value, bool):
        return "yes" if value.value else "no"
    return code(kg.name(value))


def _properties(kg: Kg, graph: str) -> Iterator[str]:
    found = [prop for prop in kg.domain.properties.values() if prop.graph == graph]
    found.sort(key=lambda prop: (_kind_label(kg, prop.domain), prop.label, prop.iri))
    rows = [
        (
            said(prop.label),
            code(local(prop.iri)),
            said(_kind_label(kg, prop.domain)),
            _value(kg, prop),
            _words(kg, prop),
        )
        for prop in found
    ]
    last = "question" if graph == "attribute" else "words for it, question"
    yield from table(("", "predicate", "of", "value", last), rows)


def _kind_label(kg: Kg, iri: URIRef) -> str:
    return kg.domain.kinds[iri].label if iri in kg.domain.kinds else local(iri)


def _value(kg: Kg, prop: Property) -> str:
    told = _VALUES.get(prop.range)
    return told or said(a(_kind_label(kg, prop.range)))


def _words(kg: Kg, prop: Property) -> str:
    parts = [", ".join(map(said, prop.state_words)), said(prop.question)]
    parts += [
        f"{_plain(kg, one.value)} if {said(_label(kg, one.prop))} is {_plain(kg, one.equals)}"
        for one in prop.implied
    ]
    return "; ".join(part for part in parts if part)


def _goals(kg: Kg, goals: tuple[Goal, ...]) -> Iterator[str]:
    for goal in goals:
        each = [said(_kind_label(kg, URIRef(iri))) for iri in goal.classes]
        of = f" (asked of each required {' or '.join(each)})" if each else ""
        yield from must(goal.source, goal.message, of)
