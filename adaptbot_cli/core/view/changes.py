"""What changed between two versions of a home's knowledge, by fact and by name; how a workspace
stands."""

from collections import ChainMap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import Any, Literal

from rdflib import RDF, RDFS, URIRef
from rdflib import Literal as Value
from rdflib.term import Node

from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.terms import AB, ACTION_PARTS, Triple, local, ordered
from adaptbot_cli.core.view.descriptions import plainly

Sign = Literal["added", "removed", "changed"]


@dataclass(frozen=True, slots=True)
class PackEntry:
    """An entry of the domain, actions or tasks file that is not made of single facts."""

    sign: Sign
    file: str
    name: str


@dataclass(frozen=True, slots=True)
class Changes:
    """The differences between two versions: single facts, and entries as a whole."""

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
        for subject, predicate, value in ordered(triples):
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
    parts = {value for e in edits if e.predicate in PARTS for value in (e.old, e.new)}
    explained = {t.entity for t in things for edit in t.edits if edit.predicate == AB.explain}
    shown = (
        replace(t, edits=tuple(e for e in t.edits if e.predicate != AB.effect))
        if t.entity in explained
        else t
        for t in things
    )
    return [thing for thing in shown if thing.entity not in parts]


PARTS = ACTION_PARTS | {AB.parameters}
"""The predicates from an action to its parts, which are shown with the action."""

_FIXED = (AB.alias, AB.parameter, AB.value)

_TERMS: Mapping[Node, str] = {
    RDF.type: "kind",
    AB.alias: "also called",
    AB.absentItem: "has no",
    AB.absentAction: "cannot",
    RDFS.label: "name",
    AB.explain: "explained as",
    AB.parameter: "takes",
    AB.requires: "refused where",
    AB.calledAs: "also called",
}


@dataclass(frozen=True, slots=True)
class Words:
    """Puts facts into the words of a domain; `names` has the things of every version."""

    domain: Domain
    names: Mapping[Node, str]

    @classmethod
    def of(cls, domain: Domain, *versions: Collection[Triple]) -> "Words":
        """Collect the names in some facts; earlier ones take precedence.

        A part of a taught action is called by its name there, or by what is said without it; a name
        with an argument that is always the same, by both.
        """
        named_by = {*domain.name_properties(), RDFS.label, AB.name, AB.message}
        names: dict[Node, str] = {}
        for facts in versions:
            fixed = set()
            for subject, predicate, value in facts:
                if predicate in named_by and isinstance(value, Value):
                    text = plainly(str(value)) if predicate == AB.message else str(value)
                    names.setdefault(subject, text)
                elif predicate == AB.calledAs:
                    fixed.add(value)
            about = {(s, p): str(value) for s, p, value in facts if s in fixed} if fixed else {}
            for part in fixed:
                names[part] = "{}, {} always {}".format(*(about.get((part, p)) for p in _FIXED))
        return cls(domain, names)

    def also(self, facts: Collection[Triple]) -> "Words":
        """Return words that also know the names in further facts."""
        more = Words.of(self.domain, facts).names
        return Words(self.domain, ChainMap(self.names, more))  # type: ignore[arg-type]

    def name(self, node: Node) -> str:
        """Return a thing's name, a class's label, or the end of an IRI."""
        if node == self.domain.iri:
            return f"this {self.domain.name}"
        return self.names.get(node) or self.domain.label(node)

    def label(self, predicate: Node) -> str:
        """Return what people call a predicate."""
        return _TERMS.get(predicate) or self.domain.label(predicate)

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
        places = {kind.location_property for kind in self.domain.classes.values()}
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


@dataclass(frozen=True, slots=True)
class Status:
    """How a workspace stands: its revision and its last change, edits, waiting transcripts.

    `changes` are what the edits come to; `problem` says why they are unknown, `faults` what
    keeps them from being committed.
    """

    root: PurePath
    domain: str
    revision: str | None = None
    subject: str = ""
    edited: Sequence[str] = ()
    changes: Changes | None = None
    problem: str = ""
    faults: Sequence[Fault] = ()
    waiting: Sequence[PurePath] = ()
