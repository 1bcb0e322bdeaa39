"""Homes of any size, made from the classes and properties of a domain, whatever they are called."""

from collections.abc import Iterator
from itertools import cycle, islice

from rdflib import XSD

from adaptbot_cli.adapters.store.reading import load_domain
from adaptbot_cli.core.domain import Domain, Kind, Property
from adaptbot_cli.core.terms import local

FEW_ARE_PLACES = 50
"""One thing in so many is of a class that others are in."""

Fact = tuple[str, str, str]  # which graph, predicate and value as Turtle


def grown(files: dict[str, bytes], size: int) -> dict[str, bytes]:
    """Return a pack with `size` more things: the same ones every time."""
    domain = load_domain(files, "grown")
    blocks: dict[str, list[str]] = {"attribute": [], "state": []}
    places: list[tuple[str, Kind]] = []
    for number, kind in enumerate(islice(_kinds(domain), size), start=1):
        name = f"{local(kind.iri)}_no_{number}"
        facts = list(_facts(domain, kind, name, places))
        for graph, found in blocks.items():
            lines = [f"{verb} {value} ;" for home, verb, value in facts if home == graph]
            if lines:
                head = f"<{domain.namespace}{name}> "
                found.append(head + "\n    ".join(lines) + "\n.\n")
        if not domain.places.isdisjoint(kind.supers):
            places.append((name, kind))
    return {
        **files,
        "attributes.ttl": files["attributes.ttl"]
        + ("\n" + "\n".join(blocks["attribute"])).encode(),
        "state.ttl": files["state.ttl"] + ("\n" + "\n".join(blocks["state"])).encode(),
    }


def _kinds(domain: Domain) -> Iterator[Kind]:
    """Classes in turn; those of places come seldom, as in a home."""
    places = [kind for kind in domain.teachable if not domain.places.isdisjoint(kind.supers)]
    things = cycle([kind for kind in domain.teachable if kind not in places])
    rooms = cycle(places)
    for number in cycle(range(FEW_ARE_PLACES)):
        yield next(rooms) if number == 0 else next(things)


def _facts(domain: Domain, kind: Kind, name: str, places: list[tuple[str, Kind]]) -> Iterator[Fact]:
    yield "attribute", "a", f"<{kind.iri}>"
    if kind.name_property is not None:
        yield "attribute", f"<{kind.name_property}>", f'"{name}"'
    for prop in (domain.properties[iri] for iri in kind.asks):
        if prop.range == XSD.boolean:
            yield prop.graph, f"<{prop.iri}>", "false"
        elif prop.iri == kind.location_property:
            yield from _place(domain, prop, places)


def _place(domain: Domain, prop: Property, places: list[tuple[str, Kind]]) -> Iterator[Fact]:
    """The newest place of a class that fits, so that each holds a few things."""
    for name, kind in reversed(places[-10:]):
        if prop.range in kind.supers:
            yield prop.graph, f"<{prop.iri}>", f"<{domain.namespace}{name}>"
            return
