"""A domain pack as a page to read: handbook.j2, filled from the graph."""

import re
from collections.abc import Iterable, Iterator, Sequence, Sized
from dataclasses import dataclass
from inspect import cleandoc
from pathlib import Path

import jinja2
from rdflib import RDF, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, ItemClass, Parameter, Property
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.names import a
from adaptbot_cli.core.plan import Goal, Task
from adaptbot_cli.core.view import descriptions
from adaptbot_cli.core.visible import visible

_SPECIAL = re.compile(r"([\\`*\[\]<>|#~]|(?<!\w)_|_(?!\w))")
_RANGES = {XSD.boolean: "yes or no", XSD.string: "a text", XSD.integer: "a whole number"}
_MOST_NAMES = 13


def handbook(kg: Kg) -> str:
    """Return a readable page of a domain, as Markdown; the same for the same pack."""
    page = _Page(kg)
    env = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    env.filters |= {
        "escaped": escaped,
        "code": code,
        "listed": listed,
        "sparql": sparql,
        "count": _count,
        "local": local,
        "label": page.label,
        "value": page.value,
        "range": page.range,
        "capital": lambda text: text[:1].upper() + text[1:],
    }
    template = env.get_template("handbook.j2")
    return template.render(page=page, domain=kg.domain, sizes=kg.size()).rstrip() + "\n"


def escaped(text: str) -> str:
    """Return a text on one line, nothing in which Markdown reads as more than text."""
    return _SPECIAL.sub(r"\\\1", visible(text))


def code(text: str) -> str:
    """Return a name as code."""
    return f"`{visible(text).replace('`', chr(0x2BC))}`"


def listed(names: Iterable[str]) -> str:
    """Return names as code, with commas."""
    return ", ".join(map(code, names))


def sparql(text: str, indent: str = "") -> str:
    """Return a query as a block of code, which nothing in it ends."""
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
    lines = (f"{indent}{visible(line)}".rstrip() for line in cleandoc(text).splitlines())
    return "\n".join((f"{indent}{fence}sparql", *lines, f"{indent}{fence}"))


def _count(number: int | Sized, one: str) -> str:
    number = number if isinstance(number, int) else len(number)
    return f"{number} {one}{'' if number == 1 else 's'}"


@dataclass(frozen=True, slots=True)
class _Page:
    """What the template asks of a graph; texts come back ready for Markdown."""

    kg: Kg

    def label(self, iri: URIRef) -> str:
        """Name a class or a property in words."""
        domain = self.kg.domain
        known = domain.properties.get(iri) or domain.classes.get(iri)
        return escaped(known.label if known else local(iri))

    def range(self, prop: Property) -> str:
        """Say what values a property has."""
        return _RANGES.get(prop.range) or escaped(a(self.label(prop.range)))

    def value(self, node: Node) -> str:
        """Write a value."""
        if isinstance(node, Literal) and isinstance(node.value, bool):
            return "yes" if node.value else "no"
        return code(self.kg.name(node))

    def roots(self) -> list[ItemClass]:
        """Return the classes that stand below no other one of the domain."""
        kinds = self.kg.domain.classes
        return [
            k for k in self._ordered() if not any(above in kinds for above in k.superclasses[1:])
        ]

    def below(self, kind: ItemClass) -> list[ItemClass]:
        """Return the classes directly below one."""
        return [
            other
            for other in self._ordered()
            if kind.iri in other.superclasses[1:]
            and not any(
                k != kind.iri and kind.iri in self._above(k) for k in other.superclasses[1:]
            )
        ]

    def _ordered(self) -> list[ItemClass]:
        kinds = self.kg.domain.classes.values()
        return sorted(kinds, key=lambda k: (k.order or 99, k.label, k.iri))

    def _above(self, iri: URIRef) -> tuple[URIRef, ...]:
        kinds = self.kg.domain.classes
        return kinds[iri].superclasses[1:] if iri in kinds else ()

    def members(self, kind: ItemClass) -> list[str]:
        """Return the names of the things of a class."""
        return sorted(self.kg.name(thing) for thing in self.kg.facts.subjects(RDF.type, kind.iri))

    def properties(self, graph: str) -> list[Property]:
        """Return the properties whose facts belong into a graph."""
        found = [prop for prop in self.kg.domain.properties.values() if prop.graph == graph]
        return sorted(found, key=lambda prop: (self.label(prop.domain), prop.label, prop.iri))

    def words(self, prop: Property) -> Iterator[str]:
        """Give the words of a state, the question, and what a value follows from."""
        yield from filter(None, (", ".join(map(escaped, prop.state_words)), escaped(prop.question)))
        for one in prop.implied:
            equals = f"{self.label(one.prop)} is {self.value(one.equals)}"
            yield f"{self.value(one.value)} if {equals}"

    def parameter(self, parameter: Parameter) -> str:
        """Say what a parameter stands for."""
        labels = " or ".join(map(self.label, parameter.classes))
        what = labels or code(local(parameter.datatype or URIRef("")))
        left_out = (
            (parameter.hidden, "never written, found by the tool"),
            (parameter.default, "may be left out: the likeliest is taken"),
            (parameter.optional, "may be left out"),
        )
        notes = [text for holds, text in left_out if holds][:1]
        if parameter.instead:
            notes.append(f"another thing {escaped(parameter.instead_means)}")
        if parameter.words:
            notes.append(f"written as {listed(parameter.words)}")
        return f"{what} ({'; '.join(notes)})" if notes else what

    def changes(self, action: Action) -> list[str]:
        """Return what is different after an action, in words."""
        return list(map(escaped, descriptions.action(self.kg, action)["afterwards"]))

    def asked_of(self, goal: Goal) -> str:
        """Say of which required items a goal is asked."""
        each = " or ".join(self.label(URIRef(iri)) for iri in goal.classes)
        return f" (asked of each required {each})" if each else ""

    def other_names(self, task: Task) -> Sequence[str]:
        """Return under what other names a task is known, the first of them."""
        known = self.kg.domain.task_names.items()
        also = sorted(name.replace("_", " ") for name, other in known if other is task)
        return [n for n in also[:_MOST_NAMES] if n != task.name.replace("_", " ").lower()]
