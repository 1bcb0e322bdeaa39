"""The knowledge graph of this home: G_k and G_s (paper, III-A), asked by SPARQL."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from rdflib import RDF, RDFS, Dataset, Graph, Literal, URIRef, Variable
from rdflib.namespace import NamespaceManager
from rdflib.term import Identifier, Node

from adaptbot_cli.core.domain import Domain, Effect, Kind
from adaptbot_cli.core.names import variants, without_s
from adaptbot_cli.core.sparql import variables
from adaptbot_cli.core.terms import AB, ATTRIBUTES, SCHEMA, STATES, Triple, local

_SIZE = f"""
    SELECT (COUNT(DISTINCT ?s) AS ?nodes) (COUNT(*) AS ?edges) WHERE {{
      VALUES ?graph {{ <{ATTRIBUTES}> <{STATES}> }}
      GRAPH ?graph {{ ?s ?p ?o . FILTER(!STRSTARTS(STR(?p), "{AB}")) }}
    }}"""

Bindings = Mapping[str, Node]


@dataclass(frozen=True, slots=True)
class Delta:
    """What an effect or an answer changes: triples taken away, triples added."""

    removed: frozenset[Triple] = frozenset()
    added: frozenset[Triple] = frozenset()

    def __bool__(self) -> bool:
        return bool(self.removed or self.added)


def net(deltas: Iterable[Delta]) -> Delta:
    """Fold changes made one after the other into what they come to."""
    removed: set[Triple] = set()
    added: set[Triple] = set()
    for delta in deltas:
        removed |= delta.removed - added
        added -= delta.removed
        added |= delta.added - removed
        removed -= delta.added
    return Delta(frozenset(removed), frozenset(added))


@dataclass(slots=True)
class Kg:
    """A home's knowledge graph under a domain.

    The facts live in two named graphs of one store, so that a query sees both. `rehearsal` lets
    effects be tried and takes them back, whatever happens inside. `named_by` are the predicates
    that hold names.
    """

    domain: Domain
    facts: Dataset
    named_by: tuple[URIRef, ...] = ()
    _graphs: dict[URIRef, Graph] = field(default_factory=dict)
    _names: dict[str, tuple[URIRef, ...]] = field(default_factory=dict)
    _proper: dict[Node, str] = field(default_factory=dict)
    _classes: dict[Node, frozenset[Node]] = field(default_factory=dict)
    _spellings: dict[tuple[str, ...], tuple[URIRef, ...]] = field(default_factory=dict)
    _log: list[Delta] | None = None

    @classmethod
    def load(cls, domain: Domain, attributes: Iterable[Triple], states: Iterable[Triple]) -> "Kg":
        """Build a graph from the facts of G_k and G_s."""
        facts = Dataset(store="Oxigraph", default_union=True)
        # Queries bring their own prefixes; rdflib's thirty would be copied for each of them.
        facts.namespace_manager = NamespaceManager(facts, bind_namespaces="none")
        kg = cls(domain, facts, domain.name_properties())
        for kind in domain.kinds.values():
            for parent in kind.supers[1:]:
                kg.graph(SCHEMA).add((kind.iri, RDFS.subClassOf, parent))
        graphs = {name: kg.graph(name) for name in (ATTRIBUTES, STATES)}
        for name, given in ((ATTRIBUTES, attributes), (STATES, states)):
            homes = ((t, kg.home_of(t[1]) if t[1] in domain.properties else name) for t in given)
            facts.addN((*t, graphs[home]) for t, home in homes)
        return kg

    def graph(self, name: URIRef) -> Graph:
        """Return the named graph G_k (`ATTRIBUTES`), G_s (`STATES`) or the classes (`SCHEMA`)."""
        if name not in self._graphs:
            self._graphs[name] = self.facts.get_context(name)
        return self._graphs[name]

    def home_of(self, predicate: Node) -> URIRef:
        """Return which of the two graphs a predicate belongs to."""
        known = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return STATES if known is not None and known.graph == "state" else ATTRIBUTES

    def ask(self, query: str, bindings: Bindings) -> bool:
        """Answer a SPARQL ASK with variables bound."""
        return bool(self.facts.query(query, initBindings=_used(query, bindings)).askAnswer)

    def rows(self, query: str, bindings: Bindings) -> list[dict[str, Node]]:
        """Return the solutions of a SPARQL SELECT with variables bound."""
        result = self.facts.query(query, initBindings=_used(query, bindings))
        return [{str(k): v for k, v in row.items()} for row in result.bindings]

    def first(self, query: str, name: str, bindings: Bindings) -> Node | None:
        """Return the value of `name` in the first solution of a SELECT, if there is one."""
        return next((row[name] for row in self.rows(query, bindings) if name in row), None)

    def value(self, subject: Node, predicate: Node) -> Node | None:
        """Return the one value of a functional property, the smallest if there are several."""
        return min(self.facts.objects(subject, predicate), key=str, default=None)

    def find(self, name: str) -> tuple[URIRef, ...]:
        """Return the entities that bear a name, an alias of it or a plain variant of it."""
        if name not in self._names:
            self._names[name] = self._look_up(name)
        return self._names[name]

    def _look_up(self, name: str) -> tuple[URIRef, ...]:
        """A thing's own name goes before another name that was taught for something else."""
        for predicates in (self.named_by, (AB.alias,)):
            for form in variants(name):
                for text in dict.fromkeys((form, form.upper(), form.title())):
                    found = {
                        subject
                        for predicate in predicates
                        for subject in self.facts.subjects(predicate, Literal(text))
                        if isinstance(subject, URIRef) and self.classes(subject)
                    }
                    if found:
                        return tuple(sorted(found))
        return ()

    def spelled(self, name: str) -> tuple[URIRef, ...]:
        """Return the entities whose names differ from this one by an "s" in a word at most."""
        if not self._spellings:
            for entity in self.instances(self.domain.kinds):
                key = without_s(self.name(entity))
                self._spellings[key] = (*self._spellings.get(key, ()), entity)
        return self._spellings.get(without_s(name), ())

    def aliases(self, entity: Node) -> tuple[str, ...]:
        """Return the other names that people have taught for an entity."""
        return tuple(sorted(str(name) for name in self.facts.objects(entity, AB.alias)))

    def name(self, entity: Node) -> str:
        """Return an entity's name, or the end of its IRI."""
        if entity not in self._proper:
            values = (self.value(entity, predicate) for predicate in self.named_by)
            self._proper[entity] = next((str(v) for v in values if v is not None), local(entity))
        return self._proper[entity]

    def classes(self, entity: Node) -> frozenset[Node]:
        """Return an entity's classes, superclasses included."""
        if entity not in self._classes:
            found = (sup for kind in self._kinds(entity) for sup in kind.supers)
            self._classes[entity] = frozenset(found)
        return self._classes[entity]

    def is_a(self, entity: Node, classes: Iterable[Node]) -> bool:
        """Tell whether an entity belongs to one of some classes."""
        return not self.classes(entity).isdisjoint(classes)

    def kind_label(self, entity: Node) -> str:
        """Return in a word what an entity is, from its class."""
        return next((kind.label for kind in self._kinds(entity)), "thing")

    def _kinds(self, entity: Node) -> list[Kind]:
        stated = set(self.facts.objects(entity, RDF.type))
        return sorted((k for k in self.domain.kinds.values() if k.iri in stated), key=_iri)

    def instances(self, classes: Iterable[Node]) -> list[URIRef]:
        """Return the entities of some classes, sorted by IRI."""
        wanted = set(classes)
        kinds = [k.iri for k in self.domain.kinds.values() if not wanted.isdisjoint(k.supers)]
        found = {s for kind in kinds for s in self.facts.subjects(RDF.type, kind)}
        return sorted(s for s in found if isinstance(s, URIRef))

    def delta(self, effect: Effect | None, bindings: Bindings) -> Delta:
        """Return what an effect would change now, without changing it."""
        if effect is None:
            return Delta()
        rows = [{**bindings, **row} for row in self.rows(effect.select, bindings)]
        removed = set(_filled(effect.deletes, rows))
        added = set(_filled(effect.inserts, rows))
        return Delta(
            frozenset(t for t in removed - added if self._holds(t)),
            frozenset(t for t in added if not self._holds(t)),
        )

    def _holds(self, triple: Triple) -> bool:
        """Whether a fact is there; asked of its own graph, which is quicker than of all."""
        return triple in self.graph(self.home_of(triple[1]))

    def apply(self, delta: Delta) -> None:
        """Change the graph; inside a `rehearsal` the change is taken back at its end."""
        if self._log is not None:
            self._log.append(delta)
        self._write(delta.removed, delta.added)

    def undo_to(self, mark: int) -> None:
        """Take back every change of this rehearsal after the first `mark`."""
        while self._log is not None and len(self._log) > mark:
            delta = self._log.pop()
            self._write(delta.added, delta.removed)

    @property
    def mark(self) -> int:
        """The number of changes made in this rehearsal, to come back to."""
        return len(self._log or ())

    def changes(self, start: int, end: int | None = None) -> list[Delta]:
        """Return the changes of this rehearsal from one mark to another."""
        return (self._log or [])[start:end]

    def last_change(self) -> frozenset[Triple]:
        """Return the triples that the last change of this rehearsal took away or added."""
        delta = self._log[-1] if self._log else Delta()
        return delta.removed | delta.added

    @contextmanager
    def rehearsal(self) -> Iterator[None]:
        """Let effects be tried: everything applied inside is taken back at the end."""
        outer, self._log = self._log, []
        try:
            yield
        finally:
            self.undo_to(0)
            self._log = outer

    def learn(self, delta: Delta) -> None:
        """Change the graph for good and forget what was worked out from the old one."""
        self.apply(delta)
        self._names.clear()
        self._proper.clear()
        self._classes.clear()

    def _write(self, removed: Iterable[Triple], added: Iterable[Triple]) -> None:
        for triple in removed:
            self.graph(self.home_of(triple[1])).remove(triple)
        for triple in added:
            self.graph(self.home_of(triple[1])).add(triple)

    def size(self) -> tuple[int, int]:
        """Return nodes and edges: subjects of facts, and facts (the paper's Table I counts)."""
        [row] = self.rows(_SIZE, {})
        return int(row["nodes"].toPython()), int(row["edges"].toPython())  # type: ignore[attr-defined]


def _iri(kind: Kind) -> str:
    return str(kind.iri)


def _filled(template: Iterable[Triple], rows: Iterable[Bindings]) -> Iterator[Triple]:
    """The triples of a template with its variables filled in, those left out that lack a value."""
    for row in rows:
        for triple in template:
            subject, predicate, value = (
                row.get(str(node)) if isinstance(node, Variable) else node for node in triple
            )
            if subject is not None and predicate is not None and value is not None:
                yield subject, predicate, value


def _used(query: str, bindings: Bindings) -> dict[str, Identifier]:
    """The bindings that a query has variables for: others are an error to the engine."""
    names = variables(query)
    given = ((name, value) for name, value in bindings.items() if name in names)
    return {name: value for name, value in given if isinstance(value, Identifier)}
