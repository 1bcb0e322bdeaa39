"""Homes of any size, made from the classes, properties and names of a domain, whatever they are.

As in a real home, what is true of things differs and is not always known, a few places hold most
things, rooms and appliances come several times, and names repeat: numbered (`cup_2`) within a
class, the same in different classes, with another name now and then.
"""

from collections.abc import Iterator
from random import Random

from rdflib import RDF, XSD, URIRef

from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.domain import Domain, ItemClass, Property
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import local

FEW_ARE_PLACES = 40
"""One thing in so many is of a class that others are in."""
KNOWN, TRUE, ALSO_CALLED, TWICE = 0.85, 0.3, 0.05, 0.1
"""How likely a value is known, a known one true; a thing has another name, or another's name."""
FACTS_A_THING = 7
"""About how many facts a thing of the kitchen has."""

PLAN = """\
pick_up_rec("pot")
put_down_rec("pot", "stove")
pick_up_obj("water")
pour_contents("water", "pot")
switch("stove", "on")
boil("water", "pot")
pick_up_obj("tea")
put_down_obj("tea", "pot")
wait(3)
switch("stove", "off")
pick_up_rec("cup")
put_down_rec("cup", "table")
pour_contents("pot", "cup")
"""
"""A plan that needs the bundled kitchen alone, whatever it has grown to: it makes tea."""

Fact = tuple[str, str, str]  # which graph, predicate and value as Turtle


def grown(files: dict[str, bytes], size: int, seed: int = 1) -> dict[str, bytes]:
    """Return a pack with `size` more things: the same ones every time, in alphabetical order."""
    home = _Growing(load_kg(files, "grown"), Random(seed))
    blocks: dict[str, list[str]] = {"attribute": [], "state": []}
    for name, facts in sorted(home.thing() for _ in range(size)):
        for graph, found in blocks.items():
            lines = [f"{verb} {value}" for at, verb, value in facts if at == graph]
            if lines:
                found.append(f"{name} " + " ;\n    ".join(lines) + " ;\n.\n")
    attributes, states = ("\n" + "\n".join(found) for found in blocks.values())
    return {
        **files,
        "attributes.ttl": files["attributes.ttl"] + attributes.encode(),
        "state.ttl": files["state.ttl"] + states.encode(),
    }


class _Growing:
    """A home to which things are added one by one."""

    def __init__(self, kg: Kg, random: Random) -> None:
        self.domain: Domain = kg.domain
        self.random = random
        self.count = 0
        self.named: dict[tuple[str, URIRef], int] = {}
        self.last = ""
        self.places: dict[URIRef, list[str]] = {}
        self.nouns: dict[URIRef, list[str]] = {}
        for kind in self.domain.teachable:
            bearers = [thing for thing in kg.instances([kind.iri]) if kg.is_of(thing, kind)]
            self.nouns[kind.iri] = [kg.name(thing) for thing in bearers] or [local(kind.iri)]
            for thing in bearers:
                self._enter(kind, self._written(thing))
                self.named[kg.name(thing), kind.iri] = 1
        holding = [
            k for k in self.domain.teachable if not self.domain.places.isdisjoint(k.superclasses)
        ]
        self.kinds = [k for k in self.domain.teachable if k not in holding], holding

    def thing(self) -> tuple[str, list[Fact]]:
        """Return another thing with its facts."""
        self.count += 1
        things, holding = self.kinds
        kind = self.random.choice(things if self.count % FEW_ARE_PLACES and things else holding)
        name = self._name(kind)
        written = self._written(URIRef(f"{self.domain.namespace}{local(kind.iri)}_{self.count}"))
        facts = list(self._facts(kind, name))
        self._enter(kind, written)
        return written, facts

    def _name(self, kind: ItemClass) -> str:
        """Seldom the name of a thing of another class; else a common one, numbered."""
        nouns = self.nouns[kind.iri]
        name = nouns[int(len(nouns) * self.random.random() ** 2)]
        if self.last and self.random.random() < TWICE and (self.last, kind.iri) not in self.named:
            name = self.last
        number = self.named[name, kind.iri] = self.named.get((name, kind.iri), 0) + 1
        self.last = f"{name}_{number}" if number > 1 else name
        self.named[self.last, kind.iri] = max(1, self.named.get((self.last, kind.iri), 0))
        return self.last

    def _facts(self, kind: ItemClass, name: str) -> Iterator[Fact]:
        yield "attribute", "rdf:type", self._written(kind.iri)
        if kind.name_property is not None:
            yield "attribute", self._written(kind.name_property), f'"{name}"'
        if self.random.random() < ALSO_CALLED:
            yield "attribute", "ab:alias", f'"number_{self.count}"'
        for prop in (self.domain.properties[iri] for iri in kind.asks):
            if prop.iri == kind.location_property:
                yield from self._place(prop)
            elif prop.range == XSD.boolean and self.random.random() < KNOWN:
                truth = str(self.random.random() < TRUE).lower()
                yield prop.graph, self._written(prop.iri), truth

    def _place(self, prop: Property) -> Iterator[Fact]:
        """A place of a class that fits: most things are in a few of them."""
        fitting = self.places.get(prop.range, ())
        if fitting:
            place = fitting[int(len(fitting) * self.random.random() ** 3)]
            yield prop.graph, self._written(prop.iri), place

    def _enter(self, kind: ItemClass, written: str) -> None:
        for above in self.domain.places.intersection(kind.superclasses):
            self.places.setdefault(above, []).append(written)

    def _written(self, iri: URIRef) -> str:
        if iri.startswith(str(RDF)):
            return f"rdf:{local(iri)}"
        return f"ex:{iri.removeprefix(self.domain.namespace)}"
