"""The knowledge graph of this home: G_k and G_s (paper, III-A), asked by SPARQL."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, TypeVar

import pyoxigraph
from rdflib import RDF, RDFS, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.domain import ActionIndex, Domain, Effect, ItemClass
from adaptbot_cli.core.graph.clock import within
from adaptbot_cli.core.graph.delta import Delta, UndoLog
from adaptbot_cli.core.graph.index import BASE, FOLDED, WITHOUT_S, WORD, NameIndex, parted
from adaptbot_cli.core.graph.sparql import is_plain, variables
from adaptbot_cli.core.graph.terms import (
    AB,
    ATTRIBUTES,
    SCHEMA,
    STATES,
    Triple,
    local,
    node_of,
    term_of,
    triple_of,
)
from adaptbot_cli.core.names import folded, normal, variants, without_s, words

_SIZE = f"""
    SELECT (COUNT(DISTINCT ?s) AS ?nodes) (COUNT(*) AS ?edges) WHERE {{
      VALUES ?graph {{ <{ATTRIBUTES}> <{STATES}> }}
      GRAPH ?graph {{ ?s ?p ?o . FILTER(!STRSTARTS(STR(?p), "{AB}")) }}
    }}"""

_TYPE = term_of(RDF.type)

T = TypeVar("T")

MOST_VALUES = 5
"""How many values of a default are looked at."""

Bindings = Mapping[str, Node]
Pattern = tuple[Node | None, Node | None, Node | None]
Asked = tuple[int, str, tuple[tuple[str, Node], ...]]
"""A query of the graph in one of its states, with what its variables are bound to. Bindings that a
query has no variable for are left out: they are an error to the engine."""


@dataclass(slots=True)
class _Known:
    """What was worked out of the names and classes of a graph: all is forgotten when it learns."""

    names: dict[str, tuple[URIRef, ...]] = field(default_factory=dict)
    proper: dict[Node, str] = field(default_factory=dict)
    classes: dict[Node, frozenset[Node]] = field(default_factory=dict)
    instances: dict[frozenset[Node], list[URIRef]] = field(default_factory=dict)
    robots: tuple[URIRef, ...] | None = None
    size: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class Facts:
    """The facts of a store's graph, or of all its graphs, in rdflib's terms."""

    engine: pyoxigraph.Store
    graph: URIRef | None = None

    def triples(self, pattern: Pattern) -> Iterator[Triple]:
        """Give the facts of a pattern, in which None stands for any term."""
        try:
            wanted = (None if node is None else term_of(node) for node in (*pattern, self.graph))
            found = self.engine.quads_for_pattern(*wanted)
        except (TypeError, ValueError):  # no fact has such a term there
            return
        for quad in found:
            yield triple_of(quad.triple)

    def __iter__(self) -> Iterator[Triple]:
        return self.triples((None, None, None))

    def __contains__(self, pattern: Pattern) -> bool:
        return next(self.triples(pattern), None) is not None

    def subjects(self, predicate: Node | None, value: Node | None = None) -> Iterator[Node]:
        """Give the subjects of what has a predicate and a value."""
        return (subject for subject, _, _ in self.triples((None, predicate, value)))

    def objects(self, subject: Node | None, predicate: Node | None) -> Iterator[Node]:
        """Give the values of a subject's predicate."""
        return (value for _, _, value in self.triples((subject, predicate, None)))


@dataclass(slots=True)
class Kg:
    """A home's knowledge graph under a domain.

    The facts live in two named graphs of one store, so that a query sees both. `rehearsal` lets
    effects be tried and takes them back, whatever happens inside. `named_by` are the predicates
    that hold names. Names and classes are learned and never an effect: `store` tells them whatever
    is being tried, `facts` all that holds now.
    """

    domain: Domain
    engine: pyoxigraph.Store
    named_by: tuple[URIRef, ...] = ()
    strays: frozenset[Triple] = frozenset()
    store: Facts = field(init=False)
    _known: _Known = field(default_factory=_Known)
    _undo_log: UndoLog = field(init=False)
    _depth: int = 0
    _answers: dict[Asked, Any] = field(default_factory=dict)
    _changes: dict[Asked, Delta] = field(default_factory=dict)
    _values: dict[tuple[str, Asked], tuple[Node, ...]] = field(default_factory=dict)
    _index: ActionIndex | None = None
    _names: NameIndex | None = None

    def __post_init__(self) -> None:
        self._undo_log = UndoLog(self._write)
        self.store = Facts(self.engine)

    @property
    def facts(self) -> Facts:
        """All facts, as they are now: those of G_k, of G_s and the classes."""
        self._undo_log.settle()
        return self.store

    @classmethod
    def load(cls, domain: Domain, attributes: Iterable[Triple], states: Iterable[Triple]) -> "Kg":
        """Build a graph from the facts of G_k and G_s."""
        engine = pyoxigraph.Store()
        for name, given in ((ATTRIBUTES, attributes), (STATES, states)):
            engine.extend(_quad(triple, name) for triple in given)
        return cls.over(domain, engine)

    @classmethod
    def over(cls, domain: Domain, store: pyoxigraph.Store) -> "Kg":
        """Build a graph on a store that holds facts in the named graphs of G_k and G_s already.

        A fact that stands in the wrong one of the two is moved: its predicate says where it is.
        `strays` are these facts.
        """
        kg = cls(domain, store, domain.name_properties())
        for kind in domain.classes.values():
            for parent in kind.superclasses[1:]:
                store.add(_quad((kind.iri, RDFS.subClassOf, parent), SCHEMA))
        strays = (_move(store, predicate, kg.home_of(predicate)) for predicate in domain.properties)
        kg.strays = frozenset(fact for facts in strays for fact in facts)
        return kg

    @classmethod
    def of_copy(
        cls, domain: Domain, store: pyoxigraph.Store, names: NameIndex, size: tuple[int, int]
    ) -> "Kg":
        """Return the graph on a store that `over` has seen before, with what is known of it: an
        index of its names, and its size."""
        kg = cls(domain, store, domain.name_properties())
        kg._names, kg._known.size = names, size
        return kg

    def under(self, domain: Domain) -> "Kg":
        """Return the same facts under another domain, with nothing worked out from them yet.

        What the one learns the other has too, but may have worked out otherwise before.
        """
        self._undo_log.settle()
        return Kg(domain, self.engine, domain.name_properties())

    def graph(self, name: URIRef) -> Facts:
        """Return the named graph G_k (`ATTRIBUTES`), G_s (`STATES`) or the classes (`SCHEMA`)."""
        self._undo_log.settle()
        return Facts(self.engine, name)

    def home_of(self, predicate: Node) -> URIRef:
        """Return which of the two graphs a predicate belongs to."""
        known = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return STATES if known is not None and known.graph == "state" else ATTRIBUTES

    def ask(self, query: str, bindings: Bindings) -> bool:
        """Answer a SPARQL ASK with variables bound."""
        answer: bool = self._answer(query, bindings)
        return answer

    def rows(self, query: str, bindings: Bindings) -> list[dict[str, Node]]:
        """Return the solutions of a SPARQL SELECT with variables bound."""
        rows: list[dict[str, Node]] = self._answer(query, bindings)
        return rows

    def counted(self, query: str) -> list[dict[str, Node]]:
        """Return the solutions of a SELECT of this program's own, however long it takes."""
        return list(_rows(self._evaluate(self._asked(query, {}))))

    def _answer(self, query: str, bindings: Bindings) -> Any:
        """Answer a query; what was asked in this very state before is not asked again."""
        key = self._asked(query, bindings)
        if key not in self._answers:
            self._answers[key] = _in_time(key, lambda: _plain(self._evaluate(key)))
        return self._answers[key]

    def _evaluate(self, asked: Asked) -> Any:
        """Ask the engine; the solutions of a SELECT are those of the state at this moment."""
        self._undo_log.settle()
        given = {pyoxigraph.Variable(name): term_of(value) for name, value in asked[2]}
        return self.engine.query(asked[1], use_default_graph_as_union=True, substitutions=given)

    def first(self, query: str, name: str, bindings: Bindings) -> Node | None:
        """Return the value of `name` in the first solution of a SELECT, if there is one."""
        return next(iter(self.values(query, name, bindings)), None)

    def values(self, query: str, name: str, bindings: Bindings) -> tuple[Node, ...]:
        """Return the first values of `name` in the solutions of a SELECT, each once.

        No more rows are fetched than that takes.
        """
        key = self._asked(query, bindings)
        if (name, key) not in self._values:
            self._values[name, key] = _in_time(key, lambda: self._first_values(key, name))
        return self._values[name, key]

    def _first_values(self, asked: Asked, name: str) -> tuple[Node, ...]:
        found: dict[Node, None] = {}
        for row in _rows(self._evaluate(asked)):
            found |= {row[name]: None} if name in row else {}
            if len(found) == MOST_VALUES:
                break
        return tuple(found)

    @property
    def state(self) -> int:
        """The number of the state that holds now, while effects are tried."""
        return self._undo_log.state

    @property
    def index(self) -> ActionIndex:
        """The domain's actions by what their effects change."""
        if self._index is None:
            self._index = ActionIndex(self.domain.actions.values())
        return self._index

    def with_fact(self, fact: Triple, instead_of: Iterable[Triple]) -> Delta:
        """Return the change that puts a fact back, for the one that has replaced it if it can
        have one value only."""
        known = self.domain.properties.get(URIRef(str(fact[1])))
        single = known is not None and known.functional
        others = (other for other in instead_of if single and other[:2] == fact[:2])
        return Delta(frozenset(others), frozenset({fact}))

    def _asked(self, query: str, bindings: Bindings) -> Asked:
        names = variables(query)
        given = ((n, v) for n, v in bindings.items() if n in names and isinstance(v, str))
        return self._undo_log.state, query, tuple(given)

    def value(self, subject: Node, predicate: Node) -> Node | None:
        """Return the one value of a functional property, the smallest if there are several."""
        return min(self.facts.objects(subject, predicate), key=str, default=None)

    def objects(self, subject: Node, predicate: Node) -> list[Node]:
        """Return the values of a predicate of a thing now, sorted."""
        self._undo_log.settle()
        found = self.engine.quads_for_pattern(term_of(subject), term_of(predicate), None, None)
        return sorted({node_of(quad.object) for quad in found}, key=str)

    def named_in(self, value: Node, most: int) -> int:
        """Return how many facts have a thing as their value now, counted up to `most`."""
        self._undo_log.settle()
        found = self.engine.quads_for_pattern(None, None, term_of(value), None)
        return sum(1 for _ in islice(found, most))

    def find(self, name: str) -> tuple[URIRef, ...]:
        """Return the entities that bear a name, an alias of it or a plain variant of it."""
        if name not in self._known.names:
            self._known.names[name] = self._look_up(name)
        return self._known.names[name]

    def _look_up(self, name: str) -> tuple[URIRef, ...]:
        """A thing's own name goes before another name that was taught for something else."""
        for predicates in (self.named_by, (AB.alias,)):
            for form in variants(name):
                for text in dict.fromkeys((form, form.upper(), form.title())):
                    found = {
                        subject
                        for predicate in predicates
                        for subject in self._called(text, predicate)
                        if self.classes(subject)
                    }
                    if found:
                        return tuple(sorted(found))
        for form in variants(name):
            for predicates in (self.named_by, (AB.alias,)):
                if alike := self._folded(form, predicates):
                    return alike
        return ()

    def numbered(self, base: str) -> tuple[URIRef, ...]:
        """Return the things whose names are a name and a number: toy_1 and toy_2 of "toy"."""
        found = map(URIRef, self.spellings.things(BASE, base))
        return tuple(t for t in found if self.classes(t) and _is_numbered(self.name(t), base))

    def _folded(self, name: str, predicates: Iterable[URIRef]) -> tuple[URIRef, ...]:
        """The things that some predicates call so but for accents, case and separators."""
        base, number = parted(name)
        wanted = folded(name)
        return tuple(
            thing
            for thing in map(URIRef, self.spellings.things(FOLDED, folded(base), number))
            if any(folded(text) == wanted for p in predicates for text in self._texts(thing, p))
            and self.classes(thing)
        )

    @property
    def spellings(self) -> NameIndex:
        """The index of all names, made when it is first needed."""
        return self._names or self.indexed_in(NameIndex())

    def indexed_in(self, index: NameIndex) -> NameIndex:
        """Enter all names into an index, use it from now on and return it."""
        index.add(self._all_named())
        self._names = index
        return index

    def _all_named(self) -> Iterator[tuple[str, str]]:
        """Give every thing with each of its names, or with the end of its IRI if it has none."""
        named = set()
        for predicate in (*self.named_by, AB.alias):
            for thing, name in self._named(predicate):
                named.add(thing)
                yield thing, name
        unnamed = (t for t in self.instances(self.domain.classes) if str(t) not in named)
        yield from ((str(thing), local(thing)) for thing in unnamed)

    def _named(self, predicate: URIRef) -> Iterator[tuple[str, str]]:
        for quad in self.engine.quads_for_pattern(None, term_of(predicate), None, None):
            if isinstance(quad.subject, pyoxigraph.NamedNode):
                yield quad.subject.value, _text(quad.object)

    def _called(self, text: str, predicate: URIRef) -> Iterator[URIRef]:
        value = pyoxigraph.Literal(text)
        for quad in self.engine.quads_for_pattern(None, term_of(predicate), value, None):
            if isinstance(quad.subject, pyoxigraph.NamedNode):
                yield URIRef(quad.subject.value)

    def spelled(self, name: str) -> tuple[URIRef, ...]:
        """Return the entities whose names differ from this one by an "s" in a word at most."""
        base, number = parted(name)
        wanted = without_s(name)
        found = map(URIRef, self.spellings.things(WITHOUT_S, " ".join(without_s(base)), number))
        return tuple(t for t in found if without_s(self.name(t)) == wanted and self.classes(t))

    def with_word(self, word: str) -> tuple[URIRef, ...]:
        """Return the things with a word in their names."""
        found = map(URIRef, self.spellings.things(WORD, word))
        return tuple(t for t in found if word in words(self.name(t)) and self.classes(t))

    def with_head(self, word: str) -> tuple[URIRef, ...]:
        """Return the things whose names end in a word, as a cutting board does in board."""
        return tuple(t for t in self.with_word(word) if words(self.name(t))[-1] == word)

    def alike(self, name: str, classes: Iterable[Node], most: int = 100) -> list[str]:
        """Return the names of at most `most` things of some classes that are worth comparing with
        a name: those that share the most pairs of letters with it."""
        return [self.name(entity) for entity in self._like(name, classes, most)]

    def names_like(self, name: str, most: int = 300) -> list[str]:
        """Return all names of the `most` things that are worth comparing with a name."""
        things = self._like(name, self.domain.classes, most)
        return [text for thing in things for text in self._every_name(thing)]

    def _like(self, name: str, classes: Iterable[Node], most: int) -> list[URIRef]:
        wanted, looked = frozenset(classes), 2 * most
        while True:
            alike = self.spellings.alike(name, looked)
            fitting = (
                entity for entity in map(URIRef, dict.fromkeys(alike)) if self.is_a(entity, wanted)
            )
            found = list(islice(fitting, most))
            if len(found) == most or len(alike) < looked:
                return found
            looked *= 4

    def aliases(self, entity: Node) -> tuple[str, ...]:
        """Return the other names that people have taught for an entity."""
        return tuple(sorted(str(name) for name in self.facts.objects(entity, AB.alias)))

    def name(self, entity: Node) -> str:
        """Return an entity's name, or the end of its IRI."""
        proper = self._known.proper
        if entity not in proper:
            found = (min(self._texts(entity, p), default=None) for p in self.named_by)
            proper[entity] = next((v for v in found if v is not None), local(entity))
        return proper[entity]

    def _texts(self, entity: Node, predicate: URIRef) -> Iterator[str]:
        """The values of a predicate as texts, without making terms of them."""
        if isinstance(entity, URIRef):
            found = self.engine.quads_for_pattern(term_of(entity), term_of(predicate), None, None)
            yield from (_text(quad.object) for quad in found)

    def names(self) -> frozenset[str]:
        """Return the names of all things."""
        return frozenset(name for p in self.named_by for _, name in self._named(p))

    def bears(self, name: str) -> bool:
        """Tell whether anything is called so, whatever it is."""
        return any(True for p in self.named_by for _ in self._called(name, p))

    def classes(self, entity: Node) -> frozenset[Node]:
        """Return an entity's classes, superclasses included."""
        if entity not in self._known.classes:
            found = (sup for kind in self._kinds(entity) for sup in kind.superclasses)
            self._known.classes[entity] = frozenset(found)
        return self._known.classes[entity]

    @property
    def robots(self) -> tuple[URIRef, ...]:
        """The robots of this home, sorted by IRI: that which acts, and what is of its class."""
        if self._known.robots is None:
            agent = self.domain.agent
            found = {agent, *self.instances(self.store.objects(agent, RDF.type))}
            self._known.robots = tuple(sorted(found))
        return self._known.robots

    def is_a(self, entity: Node, classes: Iterable[Node]) -> bool:
        """Tell whether an entity belongs to one of some classes."""
        return not self.classes(entity).isdisjoint(classes)

    def placed_by(self, thing: Node) -> set[URIRef]:
        """Return the properties that say where a thing is: those of its classes."""
        kinds = (kind for kind in self.domain.classes.values() if kind.iri in self.classes(thing))
        return {kind.location_property for kind in kinds if kind.location_property is not None}

    def can_move(self, thing: Node) -> bool:
        """Tell whether some action brings a thing to another place."""
        return not self.domain.moved.isdisjoint(self.placed_by(thing))

    def is_of(self, entity: Node, kind: ItemClass) -> bool:
        """Tell whether an entity is stated to be of this very kind."""
        return (entity, RDF.type, kind.iri) in self.facts

    def is_within(self, thing: Node, place: Node) -> bool:
        """Tell whether a thing is now in or on a place, or in something that is."""
        at, seen = [thing], {thing}
        while at:
            node = at.pop()
            on = {o for p in self.domain.locations for o in self.facts.objects(node, p)} - seen
            if place in on:
                return True
            seen |= on
            at += on
        return False

    def contents(self, place: Node) -> list[URIRef]:
        """Return the things that are in or on a place now, sorted."""
        found = {s for prop in self.domain.locations for s in self.facts.subjects(prop, place)}
        return sorted(s for s in found if isinstance(s, URIRef))

    def kind_label(self, entity: Node) -> str:
        """Return in a word what an entity is, from its class."""
        return next((kind.label for kind in self._kinds(entity)), "thing")

    def _kinds(self, entity: Node) -> list[ItemClass]:
        stated = set(self.store.objects(entity, RDF.type))
        found = (kind for kind in self.domain.classes.values() if kind.iri in stated)
        return sorted(found, key=lambda kind: str(kind.iri))

    def instances(self, classes: Iterable[Node]) -> list[URIRef]:
        """Return the entities of some classes, sorted by IRI."""
        wanted, known = frozenset(classes), self._known.instances
        if wanted not in known:
            known[wanted] = list(map(URIRef, sorted(set(self._members(wanted)))))
        return list(known[wanted])

    def few(self, classes: Iterable[Node], most: int) -> list[URIRef] | None:
        """Return the entities of some classes, sorted by IRI; None if they are more than `most`."""
        wanted = frozenset(classes)
        many = len(list(islice(self._members(wanted), most + 1))) > most
        return None if many else self.instances(wanted)

    def likest(self, name: str, classes: Iterable[Node], most: int) -> list[URIRef]:
        """Return the entities of some classes, sorted by IRI; of more than `most` only those whose
        names are worth most to be compared with a name."""
        wanted = frozenset(classes)
        few = self.few(wanted, most)
        return sorted(self._like(name, wanted, most)) if few is None else few

    def _members(self, classes: frozenset[Node]) -> Iterator[str]:
        for kind in self.domain.classes.values():
            if not classes.isdisjoint(kind.superclasses):
                for quad in self.engine.quads_for_pattern(None, _TYPE, term_of(kind.iri), None):
                    if isinstance(quad.subject, pyoxigraph.NamedNode):
                        yield quad.subject.value

    def delta(self, effect: Effect | None, bindings: Bindings) -> Delta:
        """Return what an effect would change now, without changing it."""
        if effect is None:
            return Delta()
        # Two effects may find the same things and change them otherwise: the SELECT is not enough.
        key = self._asked(effect.update, bindings)
        if key not in self._changes:
            self._changes[key] = self._change(effect, bindings)
        return self._changes[key]

    def _change(self, effect: Effect, bindings: Bindings) -> Delta:
        rows = [{**bindings, **row} for row in self.rows(effect.select, bindings)]
        removed = set(_filled(effect.deletes, rows))
        added = set(_filled(effect.inserts, rows))
        return Delta(
            frozenset(t for t in removed - added if self._holds(t)),
            frozenset(t for t in added if not self._holds(t)),
        )

    def _holds(self, triple: Triple) -> bool:
        """Whether a fact is there; asked of its own graph, which is quicker than of all."""
        self._undo_log.settle()
        return self._quad(triple) in self.engine

    def apply(self, delta: Delta) -> None:
        """Change the graph; inside a `rehearsal` the change is taken back at its end."""
        self._undo_log.append(delta)
        if not self._depth:
            self._undo_log.keep()

    def undo_to(self, mark: int) -> None:
        """Take back every change of this rehearsal after the first `mark`."""
        self._undo_log.back_to(mark)

    @property
    def mark(self) -> int:
        """The number of changes made in this rehearsal, to come back to."""
        return len(self._undo_log.changes)

    def changes(self, start: int, end: int | None = None) -> list[Delta]:
        """Return the changes of this rehearsal from one mark to another."""
        return self._undo_log.changes[start:end]

    def last_change(self) -> frozenset[Triple]:
        """Return the triples that the last change of this rehearsal took away or added."""
        [delta] = self._undo_log.changes[-1:] or [Delta()]
        return delta.removed | delta.added

    @contextmanager
    def rehearsal(self) -> Iterator[None]:
        """Let effects be tried: everything applied inside is taken back at the end."""
        start = self.mark
        self._depth += 1
        try:
            yield
        finally:
            self.undo_to(start)
            self._depth -= 1

    def learn(self, delta: Delta) -> None:
        """Change the graph for good and forget what was worked out from the old one."""
        size, subjects = self._known.size, {s for s, _, _ in delta.removed | delta.added}
        had = {subject: self._edges(subject) for subject in subjects} if size else {}
        self.apply(delta)
        if size:
            has = {subject: self._edges(subject) for subject in subjects}
            size = (
                size[0] + sum(bool(has[s]) - bool(had[s]) for s in subjects),
                size[1] + sum(has[s] - had[s] for s in subjects),
            )
        self._known = _Known(size=size)
        if self._names is not None:
            named = ((str(s), t) for s in subjects for t in self._every_name(s))
            self._names.add(named)
        self.forget()

    def _every_name(self, entity: Node) -> list[str]:
        predicates = (*self.named_by, AB.alias)
        return [t for p in predicates for t in self._texts(entity, p)] or [local(entity)]

    def _edges(self, subject: Node) -> int:
        """How many facts `size` counts of a subject."""
        quads = self.engine.quads_for_pattern(term_of(subject), None, None, None)
        homes = (pyoxigraph.NamedNode(ATTRIBUTES), pyoxigraph.NamedNode(STATES))
        own = str(AB)
        return sum(q.graph_name in homes and not q.predicate.value.startswith(own) for q in quads)

    def forget(self) -> None:
        """Forget the answers to queries."""
        self._answers.clear()
        self._changes.clear()
        self._values.clear()

    def _write(self, delta: Delta) -> None:
        for triple in delta.removed:
            self.engine.remove(self._quad(triple))
        for triple in delta.added:
            self.engine.add(self._quad(triple))

    def _quad(self, triple: Triple) -> pyoxigraph.Quad:
        """A fact in its own graph, as the engine holds it."""
        return _quad(triple, self.home_of(triple[1]))

    def size(self) -> tuple[int, int]:
        """Return nodes and edges: subjects of facts, and facts (the paper's Table I counts)."""
        if self._known.size is None:
            [row] = self.counted(_SIZE)
            self._known.size = int(row["nodes"].toPython()), int(row["edges"].toPython())  # type: ignore[attr-defined]
        return self._known.size


def _quad(triple: Triple, graph: URIRef) -> pyoxigraph.Quad:
    subject, predicate, value = map(term_of, triple)
    return pyoxigraph.Quad(subject, predicate, value, term_of(graph))


def _move(store: pyoxigraph.Store, predicate: URIRef, home: URIRef) -> list[Triple]:
    """Move the facts of a predicate to the one of the two graphs that they belong to.

    Returns those that were moved.
    """
    other = pyoxigraph.NamedNode(ATTRIBUTES if home == STATES else STATES)
    strays = list(store.quads_for_pattern(None, pyoxigraph.NamedNode(predicate), None, other))
    for quad in strays:
        moved = (quad.subject, quad.predicate, quad.object, pyoxigraph.NamedNode(home))
        store.add(pyoxigraph.Quad(*moved))
        store.remove(quad)
    return [triple_of(quad.triple) for quad in strays]


def _in_time(asked: Asked, answer: Callable[[], T]) -> T:
    """Answer a query: by the clock, which costs more than most answers, if it may take long."""
    _, query, given = asked
    if is_plain(query, frozenset(name for name, _ in given)):
        return answer()
    return within(answer, f"a query of the domain ({' '.join(query.split())[:200]})")


def _plain(result: Any) -> bool | list[dict[str, Node]]:
    """The answer to an ASK, or all solutions of a SELECT."""
    return bool(result) if isinstance(result, pyoxigraph.QueryBoolean) else list(_rows(result))


def _rows(solutions: Any) -> Iterator[dict[str, Node]]:
    """The engine's solutions, one by one."""
    names = [variable.value for variable in solutions.variables]
    for solution in solutions:
        values = ((name, solution[name]) for name in names)
        yield {name: node_of(value) for name, value in values if value is not None}


def _text(value: Any) -> str:
    return str(getattr(value, "value", value))


def _filled(template: Iterable[Triple], rows: Iterable[Bindings]) -> Iterator[Triple]:
    """The triples of a template with its variables filled in, those left out that lack a value."""
    for row in rows:
        for triple in template:
            subject, predicate, value = (
                row.get(str(node)) if isinstance(node, Variable) else node for node in triple
            )
            if subject is not None and predicate is not None and value is not None:
                yield subject, predicate, value


def _is_numbered(name: str, base: str) -> bool:
    """Whether a name is another with a number behind it."""
    front, _, number = name.rpartition("_")
    return number.isdigit() and normal(front) == base
