"""Reads a domain pack's graphs into a `Domain`, naming the entry wherever it cannot."""

from collections.abc import Iterable
from dataclasses import dataclass

from rdflib import RDF, RDFS, Graph, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Domain, Implication, Kind, Property, Start
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.pack.actions import read_actions
from adaptbot_cli.core.pack.entry import Entry, check_message, entries, query_of
from adaptbot_cli.core.pack.vocabulary import check_terms
from adaptbot_cli.core.plan import Goal, Task
from adaptbot_cli.core.terms import AB, local
from adaptbot_cli.errors import PackError


@dataclass(frozen=True, slots=True)
class Sources:
    """The parsed files of a pack, as one graph each."""

    domain: Graph
    actions: Graph
    tasks: Graph


def read_domain(sources: Sources) -> Domain:
    """Read a domain pack.

    Raises:
        PackError: an entry lacks something or does not make sense; the message names file, entry
            and what to do.
    """
    domain = Entry.of(sources.domain, "domain.ttl", _the_domain(sources.domain))
    for graph, file in (
        (sources.domain, "domain.ttl"),
        (sources.actions, "actions.ttl"),
        (sources.tasks, "tasks.ttl"),
    ):
        check_terms(graph, file)
    kinds = {iri: _kind(entry) for iri, entry in entries(sources.domain, "domain.ttl", RDFS.Class)}
    properties = _properties(sources.domain)
    declared = {*properties, RDF.type, RDFS.subClassOf}
    tasks = _tasks(sources.tasks)
    return Domain(
        iri=domain.node,
        name=domain.text(RDFS.label),
        comment=domain.text(RDFS.comment, ""),
        namespace=domain.text(AB.namespace),
        agent=domain.iri(AB.agent),
        purpose=domain.text(AB.purpose, "doing a task"),
        noun_fields=frozenset(domain.texts(AB.wordField)),
        verb_fields=frozenset(domain.texts(AB.verbField)),
        fillers=frozenset(domain.texts(AB.filler)),
        quantifiers=frozenset(domain.texts(AB.quantifier)),
        products=frozenset(domain.texts(AB.product)),
        kinds=kinds,
        properties=properties,
        actions=read_actions(sources.actions, declared),
        tasks=tuple(dict.fromkeys(task for _, task in tasks)),
        task_names=dict(tasks),
        goals=_goals(domain, AB.goal),
        advice=_goals(domain, AB.advice),
    )


def _the_domain(graph: Graph) -> Node:
    found = sorted(graph.subjects(RDF.type, AB.Domain), key=str)
    if len(found) != 1:
        raise PackError(f"domain.ttl: needs exactly one entry typed ab:Domain, has {len(found)}")
    return found[0]


def _kind(entry: Entry) -> Kind:
    return Kind(
        iri=entry.node,
        label=entry.text(RDFS.label, local(entry.node)),
        comment=entry.text(RDFS.comment, ""),
        supers=_supers(entry.graph, entry.node),
        name_property=entry.maybe_iri(AB.nameProperty),
        location_property=entry.maybe_iri(AB.locationProperty),
        order=entry.number(AB.kindOrder),
        asks=tuple(part.node for part in entry.listed(AB.asks)),
        starts=tuple(_start(part) for part in entry.parts(AB.starts)),
        prompted=entry.flag(AB.prompted),
    )


def _supers(graph: Graph, node: URIRef) -> tuple[URIRef, ...]:
    found = graph.transitive_objects(node, RDFS.subClassOf)
    return tuple(dict.fromkeys(iri for iri in found if isinstance(iri, URIRef)))


def _start(entry: Entry) -> Start:
    value = entry.value(AB.value)
    if value is None:
        raise entry.fail("an ab:starts lacks ab:value")
    return Start(entry.iri(AB.property), value, entry.maybe_iri(AB.when))


def _properties(graph: Graph) -> dict[URIRef, Property]:
    return {iri: _property(e) for iri, e in entries(graph, "domain.ttl", RDF.Property)}


def _property(entry: Entry) -> Property:
    graph = local(entry.iri(AB.graph))
    if graph not in ("attribute", "state"):
        raise entry.fail("ab:graph must be ab:attribute or ab:state")
    question = entry.text(AB.question, "")
    check_message(entry, question, ("name",))
    return Property(
        iri=entry.node,
        label=entry.text(RDFS.label, local(entry.node)),
        graph=graph,
        domain=entry.iri(RDFS.domain),
        range=entry.iri(RDFS.range),
        question=question,
        functional=entry.flag(AB.functional),
        state_words=entry.texts(AB.stateWord),
        implied=tuple(_implication(part) for part in entry.parts(AB.impliedBy)),
    )


def _implication(entry: Entry) -> Implication:
    equals, value = entry.value(AB.equals), entry.value(AB.value)
    if equals is None or value is None:
        raise entry.fail("an ab:impliedBy needs ab:equals and ab:value")
    return Implication(entry.iri(AB.property), equals, value)


def _goals(entry: Entry, predicate: URIRef) -> tuple[Goal, ...]:
    return tuple(_goal(part) for part in entry.parts(predicate))


def _goal(entry: Entry) -> Goal:
    classes = tuple(str(iri) for iri in entry.iris(AB["class"]))
    ask = query_of(entry, entry.text(AB.ask, ""), "ab:ask", "ASK")
    select = query_of(entry, entry.text(AB.select, ""), "ab:select", "SELECT", "item")
    if bool(ask) == bool(select):
        raise entry.fail("a goal needs either ab:ask or ab:select")
    message = entry.text(AB.message)
    check_message(entry, message, ("item",) if classes or select else ())
    about = query_of(entry, entry.text(AB.about, ""), "ab:about", "SELECT")
    before = frozenset(str(iri) for iri in entry.iris(AB.before))
    return Goal(ask or select, message, classes, about, before)


def _tasks(graph: Graph) -> list[tuple[str, Task]]:
    """Every task under each of its names, normalised."""
    found: list[tuple[str, Task]] = []
    for _, entry in entries(graph, "tasks.ttl", AB.Task):
        task = Task(entry.text(RDFS.label), _needs(entry), _goals(entry, AB.goal), known=True)
        names: Iterable[str] = (task.name, *entry.texts(AB.alias))
        found.extend((normal(name), task) for name in names)
    return found


def _needs(entry: Entry) -> tuple[str, ...]:
    needs = entry.texts(AB.needs)
    if not needs:
        raise entry.fail("lacks ab:needs, the items that the task requires; add at least one")
    return needs
