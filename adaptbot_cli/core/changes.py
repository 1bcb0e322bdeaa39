"""What changed between two versions of a home's knowledge, fact by fact and by name."""

from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from rdflib import RDF, RDFS, URIRef
from rdflib import Literal as Value
from rdflib.term import Node

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.describing import plainly
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.terms import AB, Triple, local

Sign = Literal["added", "removed", "changed"]


@dataclass(frozen=True, slots=True)
class PackEntry:
    """An entry of the domain, actions or tasks file that is not made of single facts."""

    sign: Sign
    file: str
    name: str


@dataclass(frozen=True, slots=True)
class Changes:
    """What one version says that another does not: single facts, and entries as a whole."""

    delta: Delta = field(default_factory=Delta)
    entries: tuple[PackEntry, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.delta or self.entries)


@dataclass(frozen=True, slots=True)
class ValueChange:
    """A predicate's value that was added (no `old`), removed (no `new`) or changed."""

    predicate: Node
    old: Node | None = None
    new: Node | None = None

    @property
    def sign(self) -> Sign:
        """Whether the value was added, removed or changed."""
        if self.old is None:
            return "added"
        return "removed" if self.new is None else "changed"


@dataclass(frozen=True, slots=True)
class Edited:
    """A thing and what changed about it."""

    entity: Node
    edits: tuple[ValueChange, ...]

    @property
    def sign(self) -> Sign:
        """Whether the thing itself is new, gone or only changed."""
        kinds = [edit.sign for edit in self.edits if edit.predicate == RDF.type]
        return kinds[0] if len(set(kinds)) == 1 else "changed"


def grouped(delta: Delta, words: "Words") -> list[Edited]:
    """Group a change by the things it is about, by name; one old and one new value are a change."""
    about: dict[Node, dict[Node, tuple[list[Node], list[Node]]]] = {}
    for side, triples in enumerate((delta.removed, delta.added)):
        for subject, predicate, value in sorted(triples):
            sides = about.setdefault(subject, {}).setdefault(predicate, ([], []))
            sides[side].append(value)
    entities = sorted(about, key=lambda entity: (words.name(entity), str(entity)))
    return [Edited(entity, tuple(_edits(about[entity], words))) for entity in entities]


def _edits(
    sides: Mapping[Node, tuple[list[Node], list[Node]]], words: "Words"
) -> Iterable[ValueChange]:
    for predicate in sorted(sides, key=words.order):
        removed, added = sides[predicate]
        if len(removed) == len(added) == 1:
            yield ValueChange(predicate, removed[0], added[0])
            continue
        yield from (ValueChange(predicate, old=value) for value in removed)
        yield from (ValueChange(predicate, new=value) for value in added)


def by_thing(delta: Delta, words: "Words") -> list[Edited]:
    """Group a change as people read it: the parts of an action with the action, and its effect in
    the words that explain it."""
    things = grouped(delta, words)
    edits = [edit for thing in things for edit in thing.edits]
    parts = {value for e in edits if e.predicate in _PARTS for value in (e.old, e.new)}
    explained = {t.entity for t in things for edit in t.edits if edit.predicate == AB.explain}
    shown = (
        replace(t, edits=tuple(e for e in t.edits if e.predicate != AB.effect))
        if t.entity in explained
        else t
        for t in things
    )
    return [thing for thing in shown if thing.entity not in parts]


_PARTS = frozenset({AB.parameter, AB.parameters, AB.requires})

_TERMS: Mapping[Node, str] = {
    RDF.type: "kind",
    AB.alias: "also called",
    AB.absentItem: "has no",
    AB.absentAction: "cannot",
    RDFS.label: "name",
    AB.explain: "explained as",
    AB.parameter: "takes",
    AB.requires: "refused where",
}


@dataclass(frozen=True, slots=True)
class Words:
    """Puts facts into the words of a domain; `names` has the things of every version."""

    domain: Domain
    names: Mapping[Node, str]

    @classmethod
    def of(cls, domain: Domain, *versions: Iterable[Triple]) -> "Words":
        """Collect the names in some facts; earlier ones take precedence.

        A part of a taught action is called by its name there, or by what is said without it.
        """
        named_by = {*domain.name_properties(), RDFS.label, AB.name, AB.message}
        names: dict[Node, str] = {}
        for facts in versions:
            for subject, predicate, value in facts:
                if predicate in named_by and isinstance(value, Value):
                    text = plainly(str(value)) if predicate == AB.message else str(value)
                    names.setdefault(subject, text)
        return cls(domain, names)

    def also(self, facts: Iterable[Triple]) -> "Words":
        """Return words that also know the names in further facts."""
        more = Words.of(self.domain, facts).names
        return Words(self.domain, ChainMap(self.names, more))  # type: ignore[arg-type]

    def name(self, node: Node) -> str:
        """Return a thing's name, a class's label, or the end of an IRI."""
        if node == self.domain.iri:
            return f"this {self.domain.name}"
        kind = self.domain.kinds.get(node)  # type: ignore[call-overload]
        return self.names.get(node) or (kind.label if kind else local(node))

    def label(self, predicate: Node) -> str:
        """Return what people call a predicate."""
        prop = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return _TERMS.get(predicate) or (prop.label if prop else local(predicate))

    def value(self, node: Node) -> str:
        """Return a value as people read it: yes, no, a name or a text."""
        if isinstance(node, Value) and isinstance(node.value, bool):
            return "yes" if node.value else "no"
        return str(node) if isinstance(node, Value) else self.name(node)

    def graph(self, predicate: Node) -> str:
        """Return which graph a predicate belongs to: "attribute" or "state"."""
        prop = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return prop.graph if prop else "attribute"

    def order(self, predicate: Node) -> tuple[int, str]:
        """Return what predicates are sorted by: kind, name, place, the rest by label."""
        places = {kind.location_property for kind in self.domain.kinds.values()}
        first = [predicate == RDF.type, predicate in self.domain.name_properties()]
        first.append(predicate in places)
        return (first.index(True) if True in first else 3, self.label(predicate))

    def sentence(self, triple: Triple) -> str:
        """Return a fact in words: "egg: place fridge"."""
        subject, predicate, value = triple
        return f"{self.name(subject)}: {self.label(predicate)} {self.value(value)}"


def as_json(changes: Changes, words: Words) -> dict[str, Any]:
    """Return a change as a plain object: by entity, each value with its predicate and label."""
    plain = words.value
    things = []
    for edited in grouped(changes.delta, words):
        edits = [
            {
                "change": edit.sign,
                "predicate": local(edit.predicate),
                "label": words.label(edit.predicate),
                "graph": words.graph(edit.predicate),
                "old": None if edit.old is None else plain(edit.old),
                "new": None if edit.new is None else plain(edit.new),
            }
            for edit in edited.edits
        ]
        things.append(
            {
                "name": words.name(edited.entity),
                "iri": str(edited.entity),
                "change": edited.sign,
                "facts": edits,
            }
        )
    entries = [{"change": e.sign, "file": e.file, "entry": e.name} for e in changes.entries]
    return {
        "added": len(changes.delta.added),
        "removed": len(changes.delta.removed),
        "things": things,
        "entries": entries,
    }


def as_update(delta: Delta, write: Callable[[Node], str]) -> str:
    """Return a change as a SPARQL update that makes it; `write` writes a term safely."""
    parts = []
    for keyword, triples in (("DELETE DATA", delta.removed), ("INSERT DATA", delta.added)):
        lines = [f"  {' '.join(map(write, triple))} ." for triple in sorted(triples)]
        if lines:
            parts.append("\n".join([f"{keyword} {{", *lines, "}"]))
    return " ;\n".join(parts) + ("\n" if parts else "")


def about(delta: Delta) -> frozenset[URIRef]:
    """Return the things that a change is about or names."""
    triples = delta.removed | delta.added
    found = {node for subject, _, value in triples for node in (subject, value)}
    return frozenset(node for node in found if isinstance(node, URIRef))
