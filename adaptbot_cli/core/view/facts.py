"""The graph as people look at it: a thing with its facts, a class with its members."""

from dataclasses import dataclass
from typing import Any

from rdflib import RDF, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import ItemClass
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.robots import robot_called
from adaptbot_cli.core.graph.terms import STATES, local
from adaptbot_cli.core.names import nearest, normal

_MEMBERS = f"""
    SELECT ?kind (COUNT(DISTINCT ?thing) AS ?members) WHERE {{ ?thing <{RDF.type}> ?kind }}
    GROUP BY ?kind"""


@dataclass(frozen=True, slots=True)
class Thing:
    """A thing of the home: its facts by predicate, and the names of what is in or on it."""

    name: str
    kind: str
    place: str
    aliases: tuple[str, ...]
    attributes: dict[str, Any]
    states: dict[str, Any]
    holds: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the thing as a plain object."""
        return {
            "name": self.name,
            "class": self.kind,
            "place": self.place or None,
            "aliases": list(self.aliases),
            "attributes": self.attributes,
            "states": self.states,
            "holds": list(self.holds),
        }


def called(kg: Kg, name: str) -> tuple[URIRef, ...]:
    """Return the things that bear a name; a robot is called as its IRI ends, and needs none."""
    robot = None if (found := kg.find(name)) else robot_called(kg, name)
    return found if robot is None or (robot, None, None) not in kg.facts else (robot,)


def thing(kg: Kg, entity: URIRef) -> Thing:
    """Return everything that is known of an entity."""
    kinds = sorted(local(iri) for iri in kg.facts.objects(entity, RDF.type))
    facts: dict[URIRef, dict[str, Any]] = {}
    place = ""
    for _, predicate, value in sorted(kg.facts.triples((entity, None, None))):
        prop = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
        if prop is None or predicate in kg.named_by:
            continue
        if predicate in kg.domain.locations:
            place = kg.name(value)
        facts.setdefault(kg.home_of(predicate), {})[local(predicate)] = _plain(kg, value)
    states = facts.get(STATES, {})
    attributes = {
        k: v for home, record in facts.items() if home != STATES for k, v in record.items()
    }
    return Thing(
        kg.name(entity),
        ", ".join(kinds),
        place,
        kg.aliases(entity),
        attributes,
        states,
        tuple(kg.name(inside) for inside in kg.contents(entity)),
    )


def _plain(kg: Kg, value: Node) -> Any:
    if isinstance(value, Literal):
        plain = value.toPython()
        return plain if isinstance(plain, bool | int | float | str) else str(plain)
    return kg.name(value)


def everything(kg: Kg) -> list[tuple[ItemClass, list[Thing]]]:
    """Return every class that has members of its own, with them, in the domain's order."""
    groups = []
    for kind in sorted(kg.domain.classes.values(), key=lambda k: (k.order or 99, k.iri)):
        members = sorted(kg.facts.subjects(RDF.type, kind.iri), key=str)
        things = [thing(kg, entity) for entity in members if isinstance(entity, URIRef)]
        if things:
            groups.append((kind, sorted(things, key=lambda t: t.name)))
    return groups


def counts(kg: Kg) -> list[tuple[ItemClass, int]]:
    """Return every class that has members of its own, with their number, in the domain's order."""
    kinds = sorted(kg.domain.classes.values(), key=lambda k: (k.order or 99, k.iri))
    rows = kg.counted(_MEMBERS)
    counted = {row["kind"]: int(str(row["members"])) for row in rows if "kind" in row}
    return [(kind, counted[kind.iri]) for kind in kinds if kind.iri in counted]


def kind_called(kg: Kg, name: str) -> ItemClass | None:
    """Return the class of a name, by its IRI's end or its label."""
    wanted = {normal(name), normal(name).removesuffix("s")}
    for kind in kg.domain.classes.values():
        if {normal(local(kind.iri)), normal(kind.label)} & wanted:
            return kind
    return None


def members(kg: Kg, kind: ItemClass) -> list[Thing]:
    """Return the things of a class and its subclasses, by name."""
    found = (thing(kg, entity) for entity in kg.instances([kind.iri]))
    return sorted(found, key=lambda t: t.name)


def near(kg: Kg, name: str, whatever: bool = False) -> list[str]:
    """Return the names of things and actions most like a name that is neither.

    With `whatever` those of classes and tasks too.
    """
    among = set(kg.names_like(name))
    for action in kg.domain.actions.values():
        among |= {action.name, *action.aliases}
    if whatever:
        kinds = kg.domain.classes.values()
        among |= {local(kind.iri) for kind in kinds} | {kind.label for kind in kinds}
        among |= {task.name for task in kg.domain.tasks}
    return nearest(name, among)
