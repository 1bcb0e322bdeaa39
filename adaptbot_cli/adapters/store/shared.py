"""A home's graph on a SPARQL 1.1 server: what is fetched of it, and the guarded update.

Attributes and state are two named graphs there. A third is the log: for each update the trailers of
the answers behind it, as in a commit, so that whoever fetches a fact knows who gave it.

What the server holds is a stranger's: facts that the domain does not allow are left out.
"""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final
from uuid import uuid4

import pyoxigraph
from rdflib import RDF, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.adapters.store.endpoint import Endpoint
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.trailers import answers, parse, write
from adaptbot_cli.adapters.store.turtle import engine_term
from adaptbot_cli.adapters.store.versions import facts_of
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.imports import accept
from adaptbot_cli.core.graph.merge import Facts
from adaptbot_cli.core.graph.terms import (
    AB,
    DATATYPES,
    FACT_TERMS,
    Triple,
    is_value,
    local,
    node_of,
)
from adaptbot_cli.core.view.provenance import Told
from adaptbot_cli.errors import KnowledgeError

_CLOSED: Final = 4
"""How often the places of things, and theirs, are fetched after them."""
_MANY: Final = 5_000
"""Things in one query, and answers that are fetched for what is new, at most."""


@dataclass(frozen=True, slots=True)
class Fetched:
    """Facts of a server about the things of a `scope` (None: all there are), and sentences about
    those that were left out. Of what has one value, but several there, `doubled` has them all."""

    facts: Facts
    doubled: Facts = frozenset()
    scope: frozenset[Node] | None = None
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class SharedGraph:
    """The graph of a domain on a server.

    Methods raise KnowledgeError: the server cannot be used, or answers in part only.
    """

    endpoint: Endpoint
    domain: Domain
    graphs: Mapping[str, str]

    @classmethod
    def of(cls, endpoint: Endpoint, domain: Domain, settings: Mapping[str, Any]) -> "SharedGraph":
        """Return the graph of a domain, in graphs as configured or named by the domain."""
        names = {"attributes": "attribute", "state": "state", "log": "log"}
        own = f"urn:adaptbot:home:{domain.name}"
        graphs = {key: str(settings.get(f"kg.{key}") or f"{own}:{n}") for key, n in names.items()}
        return cls(endpoint, domain, graphs)

    def everything(self) -> Fetched:
        """Fetch all facts."""
        [(count,)] = self._ask("SELECT (COUNT(*) AS ?n) WHERE { ?s ?p ?o }")
        rows = self._ask("SELECT ?s ?p ?o WHERE { ?s ?p ?o }")
        if len(rows) < int(count.value):
            raise KnowledgeError(
                f"the shared graph sent {len(rows):,} of {int(count.value):,} facts: raise what "
                "the server sends in one answer at most, or fetch what you need: kg pull NAME…"
            )
        return self._accepted(rows, None)

    def about(
        self, things: Iterable[Node], names: Iterable[str] = (), kinds: Iterable[Node] = ()
    ) -> Fetched:
        """Fetch what is known of things, of whatever bears one of these names and of the members
        of classes, with the places that these are in: a few queries, however many are asked."""
        open_ = set(things)
        rows: list[tuple[Any, ...]] = []
        named = {Literal(name) for name in names}
        naming = (AB.alias, AB.absentItem, *self.domain.name_properties())
        parts = []
        if named:
            values = f"VALUES ?np {{ {_terms(naming)} }} VALUES ?n {{ {_terms(named)} }}"
            parts.append(f"{{ {values} ?s ?np ?n }}")
        if kinds := list(kinds):
            parts.append(f"{{ VALUES ?k {{ {_terms(kinds)} }} ?s a ?k }}")
        scope = set(open_)
        if parts:
            where = " UNION ".join(parts)
            rows += self._ask(f"SELECT DISTINCT ?s ?p ?o WHERE {{ {where} ?s ?p ?o }}")
            scope |= {node_of(row[0]) for row in rows}
            open_ |= self._places(rows) - scope
        for _ in range(_CLOSED):
            if not open_:
                break
            if len(open_) > _MANY:
                raise KnowledgeError(f"this touches more than {_MANY:,} things; use kg pull")
            found = self._ask(
                f"SELECT ?s ?p ?o WHERE {{ VALUES ?s {{ {_terms(open_)} }} ?s ?p ?o }}"
            )
            rows += found
            scope |= open_
            open_ = self._places(found) - scope
        return self._accepted(rows, frozenset(scope))

    def _places(self, rows: Iterable[tuple[Any, ...]]) -> set[Node]:
        """What is named as a value, to be known as a thing itself."""
        iri = pyoxigraph.NamedNode
        found = {node_of(o) for _, p, o in rows if isinstance(o, iri) and p.value != str(RDF.type)}
        return found - set(self.domain.classes)

    def _ask(self, query: str) -> list[tuple[Any, ...]]:
        found = self.endpoint.ask(query, (self.graphs["attributes"], self.graphs["state"]))
        if not isinstance(found, list):
            raise KnowledgeError("the shared graph answers a SELECT with yes or no")
        return found

    def _accepted(self, rows: Sequence[tuple[Any, ...]], scope: frozenset[Node] | None) -> Fetched:
        given: set[Triple] = set()
        left: list[str] = []
        for row in rows:
            try:
                subject, predicate, value = map(node_of, row)
            except (TypeError, ValueError):  # a term that no graph of a home holds
                continue
            prop = self.domain.properties.get(predicate)  # type: ignore[call-overload]
            if prop is not None and isinstance(value, Literal):
                value = _as_declared(value, prop.range)
                if prop.range in DATATYPES and not is_value(value, prop.range):
                    left.append(f"{local(subject)} {local(predicate)}: {value} is no value of it")
                    continue
            if scope is None or subject != self.domain.iri or predicate in FACT_TERMS:
                given.add((subject, predicate, value))
        slots = Counter(t[:2] for t in given if self._single(t[1]) and t[1] != RDF.type)
        doubled = frozenset(t for t in given if slots[t[:2]] > 1)
        parcel = accept(given - doubled, self.domain, frozenset(), {})
        left += [f"{' '.join(map(local, t))}: {why}" for t, why in parcel.left_out.items()]
        return Fetched(parcel.accepted, doubled, scope, tuple(left))

    def behind(self, delta: Delta) -> list[Told]:
        """Fetch the answers behind changes, the latest last."""
        things = {s for s, _, _ in delta.removed | delta.added}
        if not things:
            return []
        rows = self.endpoint.ask(
            f"SELECT DISTINCT ?at ?text WHERE {{ GRAPH <{self.graphs['log']}> {{ "
            f"VALUES ?s {{ {_terms(list(things)[:_MANY])} }} "
            f"?u <{AB.about}> ?s ; <{AB.answers}> ?text ; <{AB.at}> ?at }} }} "
            f"ORDER BY ?at LIMIT {_MANY}"
        )
        texts = [row[1].value for row in rows]
        return [answer for text in texts for answer in answers(parse(f"x\n\n{text}")[2])]

    def write(self, delta: Delta, expected: Facts, trailers: Iterable[tuple[str, str]]) -> bool:
        """Make a change there if what it rests on is as `expected`; tell whether it was made.

        `expected` are all facts there of the things that the change names; none at all: the graphs
        are empty.
        """
        entry = URIRef(f"urn:uuid:{uuid4()}")
        things = {s for s, _, _ in delta.removed | delta.added}
        found = {
            (entry, AB.answers, Literal(write(trailers))),
            (entry, AB.at, Literal(datetime.now(UTC).isoformat())),
            *((entry, AB.about, thing) for thing in things),
        }
        log = f"GRAPH <{self.graphs['log']}>"
        added = f"{self._graphs(delta.added)} {log} {{ {_lines(found)} }}"
        self.endpoint.update(
            f"DELETE {{ {self._graphs(delta.removed)} }} INSERT {{ {added} }} "
            f"WHERE {{ {self._guard(delta, expected)} }}"
        )
        return bool(self.endpoint.ask(f"ASK {{ {log} {{ <{entry}> <{AB.at}> ?at }} }}"))

    def _guard(self, delta: Delta, expected: Facts) -> str:
        """What must hold for a change to be made: every slot that it fills or empties, and the
        class of each thing that it names, is as it was."""
        if not expected:
            parts = ("attributes", "state")
            return " ".join(
                _nothing(self.graphs[part], "?s", "?p", n) for n, part in enumerate(parts)
            )
        changed = delta.removed | delta.added
        there = {s for s, _, _ in expected}  # of a new thing it is enough that it is not there yet
        slots = {(s, p) for s, p, _ in changed if s in there and self._single(p)}
        slots |= {(s, RDF.type) for s, _, _ in changed if s != self.domain.iri}
        slots |= {(o, RDF.type) for _, p, o in changed if isinstance(o, URIRef) and p != RDF.type}
        must = {t for t in expected if t[:2] in slots} | delta.removed
        lines = [self._graphs(must)]
        for number, (subject, predicate) in enumerate(sorted(slots)):
            values = sorted(t for t in expected if t[:2] == (subject, predicate))
            graph, s, p = self._graph(predicate), *_written((subject, predicate))
            lines.append(_nothing(graph, s, p, number, [engine_term(t[2]) for t in values]))
        return " ".join(lines)

    def _single(self, predicate: Node) -> bool:
        prop = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return predicate == RDF.type or (prop is not None and prop.functional)

    def _graph(self, predicate: Node) -> str:
        prop = self.domain.properties.get(predicate)  # type: ignore[call-overload]
        return self.graphs["state" if prop is not None and prop.graph == "state" else "attributes"]

    def _graphs(self, facts: Iterable[Triple]) -> str:
        """Facts, each in the graph that its predicate belongs to."""
        by_graph: dict[str, list[Triple]] = {}
        for triple in sorted(facts):
            by_graph.setdefault(self._graph(triple[1]), []).append(triple)
        return " ".join(f"GRAPH <{g}> {{ {_lines(found)} }}" for g, found in by_graph.items())


def _nothing(graph: str, s: str, p: str, number: int, but: Sequence[Any] = ()) -> str:
    """A filter: nothing stands in a slot of a graph but some values."""
    others = " && ".join(f"?o{number} != {value}" for value in but)
    rest = f" . FILTER({others})" if others else ""
    return f"FILTER NOT EXISTS {{ GRAPH <{graph}> {{ {s} {p} ?o{number}{rest} }} }}"


def _written(nodes: Iterable[Node]) -> Iterator[str]:
    return (str(engine_term(node)) for node in nodes)


def _terms(nodes: Iterable[Node]) -> str:
    return " ".join(sorted(_written(nodes)))


def _lines(facts: Iterable[Triple]) -> str:
    return " ".join(f"{' '.join(_written(triple))} ." for triple in sorted(facts))


def _as_declared(value: Literal, wanted: Node) -> Literal:
    """A literal with the datatype that the domain declares, where a server has kept another of the
    same value: Virtuoso keeps true as 1."""
    words = {"1": "true", "0": "false"} if "boolean" in str(wanted) else {}
    found = Literal(words.get(str(value), str(value)), datatype=URIRef(str(wanted)))
    return value if value.datatype in (None, URIRef(str(wanted))) or found.ill_typed else found


@dataclass(slots=True)
class Shadow:
    """What a server held when it was last looked at, and the commit here that knew it.

    It is what both sides have in common. Where it is lost, nothing counts as in common, and no
    fact is taken back.
    """

    repo: Repo
    key: str
    facts: Facts | None = None
    head: str | None = None

    @classmethod
    def of(cls, repo: Repo, shared: SharedGraph) -> "Shadow":
        """Read what is remembered of a server's graph."""
        key = f"shared-{shared.domain.name}"
        head, _, data = (repo.cached(key) or b"").partition(b"\n")
        known = json.loads(head) if head else {}
        if known.get("at") != [shared.endpoint.url, shared.graphs["attributes"]]:
            return cls(repo, key)
        return cls(repo, key, facts_of({key: data}), known["head"])

    def keep(self, shared: SharedGraph, facts: Facts, head: str | None) -> None:
        """Remember what the server holds now."""
        self.facts, self.head = facts, head
        known = {"at": [shared.endpoint.url, shared.graphs["attributes"]], "head": head}
        lines = "".join(f"{line}\n" for line in sorted(" ".join(_written(t)) + " ." for t in facts))
        self.repo.cache(self.key, f"{json.dumps(known)}\n{lines}".encode())
