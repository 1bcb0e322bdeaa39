"""Reads a domain pack's graphs into a `Domain`, noting the entry wherever it cannot."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from rdflib import RDF, RDFS, Graph, URIRef

from adaptbot_cli.core.domain import Domain, Implication, InitialState, ItemClass, Property
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.terms import AB, Triple, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.pack.actions import changed, query_of, read_actions
from adaptbot_cli.core.pack.entry import EntryReader, Notes, check_message, entries
from adaptbot_cli.core.pack.vocabulary import check_terms, check_types
from adaptbot_cli.core.plan import Constraint, Goal, Task


@dataclass(frozen=True, slots=True)
class Sources:
    """The parsed files of a pack, as one graph each."""

    domain: Graph
    actions: Graph
    tasks: Graph


def examine_domain(sources: Sources) -> tuple[Domain, Notes]:
    """Read a domain pack with all its faults; with one, the domain is good for checks only."""
    notes = Notes()
    domain = _the_domain(sources.domain, notes)
    for graph, file, types in (
        (sources.domain, "domain.ttl", (AB.Domain, RDFS.Class, RDF.Property, AB.Constraint)),
        (sources.actions, "actions.ttl", (AB.Action,)),
        (sources.tasks, "tasks.ttl", (AB.Task, AB.TaskClass)),
    ):
        check_terms(graph, file, notes)
        check_types(graph, file, types, notes)
    kinds = {e.node: _kind(e) for e in entries(sources.domain, "domain.ttl", RDFS.Class, notes)}
    declarations = entries(sources.domain, "domain.ttl", RDF.Property, notes)
    properties = {entry.node: _property(entry) for entry in declarations}
    declared = {*properties, RDF.type, RDFS.subClassOf}
    tasks = list(_tasks(sources.tasks, AB.Task, notes))
    read = Domain(
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
        part_words=frozenset(domain.texts(AB.partWord)),
        products=frozenset(domain.texts(AB.product)),
        classes=kinds,
        properties=properties,
        actions=read_actions(sources.actions, notes, properties, declared),
        tasks=tuple(dict.fromkeys(task for _, task in tasks)),
        task_names=dict(tasks),
        goals=_goals(domain, AB.goal),
        advice=_goals(domain, AB.advice),
        aliases=tuple(domain.texts(AB.alias)),
        task_classes=dict(_tasks(sources.tasks, AB.TaskClass, notes)),
        constraints=tuple(_constraints(sources.domain, notes)),
        filed_by=domain.maybe_iri(AB.filedBy) or RDF.type,
        servings=query_of(domain, domain.text(AB.servings, ""), "ab:servings", "SELECT", "vessel"),
    )
    _check_effects(read, notes)
    return read, notes


def with_tasks(domain: Domain, triples: Iterable[Triple]) -> Domain:
    """Return a domain with the tasks of some triples, in the place of its own of the same names.

    Their queries may use the prefixes ex: (the domain's namespace), ab:, rdf: and rdfs:.

    Raises:
        PackError: a task lacks something or does not make sense.
    """
    graph = Graph(bind_namespaces="none")
    for prefix, space in (("ex", domain.namespace), ("ab", AB), ("rdf", RDF), ("rdfs", RDFS)):
        graph.bind(prefix, str(space))
    for triple in triples:
        graph.add(triple)
    notes = Notes()
    names = {**domain.task_names, **dict(_tasks(graph, AB.Task, notes))}
    notes.refuse()
    return replace(domain, tasks=tuple(dict.fromkeys(names.values())), task_names=names)


def _check_effects(domain: Domain, notes: Notes) -> None:
    """Note each effect on what lasts: what things are, are called and can do (G_k)."""
    lasting = {RDF.type, RDFS.subClassOf, *domain.name_properties()}
    attributes = {prop.iri for prop in domain.properties.values() if prop.graph == "attribute"}
    for action in domain.actions.values():
        for predicate in sorted((lasting | attributes) & set(changed(action.effect))):
            text = f"ab:effect changes {local(predicate)}, which says what a thing is or is called"
            remedy = "let it change a state; kinds and names are for people to teach"
            if predicate not in lasting:
                text = f"ab:effect changes {local(predicate)}, which is an attribute"
                remedy = "let it change a state, or declare this with ab:graph ab:state"
            notes.add(Fault(text, remedy, "actions.ttl", (local(action.iri),)))


def _the_domain(graph: Graph, notes: Notes) -> EntryReader:
    found = sorted(graph.subjects(RDF.type, AB.Domain), key=str)
    if len(found) != 1:
        text = f"needs exactly one entry typed ab:Domain, has {len(found)}"
        remedy = 'write "a ab:Domain" in the one that names the domain'
        notes.add(Fault(text, remedy, "domain.ttl"))
    if found:
        return EntryReader.of(graph, "domain.ttl", found[0], notes)
    # What a domain lacks that is not there is nothing to tell.
    return EntryReader.of(graph, "domain.ttl", AB.Domain, Notes())


def _kind(entry: EntryReader) -> ItemClass:
    superclasses = _supers(entry.graph, entry.node)
    parents = set(entry.graph.objects(entry.node, RDFS.subClassOf))
    if any(entry.node in _supers(entry.graph, above) for above in superclasses if above in parents):
        text = " below ".join(local(iri) for iri in (*superclasses, entry.node))
        entry.note(f"is a class below itself: {text}", "take one rdfs:subClassOf away")
    return ItemClass(
        iri=entry.node,
        label=entry.text(RDFS.label, local(entry.node)),
        comment=entry.text(RDFS.comment, ""),
        superclasses=superclasses,
        name_property=entry.maybe_iri(AB.nameProperty),
        location_property=entry.maybe_iri(AB.locationProperty),
        order=entry.number(AB.kindOrder),
        asks=tuple(iri for part in entry.listed(AB.asks) for iri in _asked(part)),
        starts=tuple(start for part in entry.parts(AB.starts) for start in _start(part)),
        prompted=entry.flag(AB.prompted),
        hand=entry.flag(AB.hand),
    )


def _supers(graph: Graph, node: URIRef) -> tuple[URIRef, ...]:
    found = graph.transitive_objects(node, RDFS.subClassOf)
    return tuple(dict.fromkeys(iri for iri in found if isinstance(iri, URIRef)))


def _asked(entry: EntryReader) -> Iterator[URIRef]:
    if isinstance(entry.node, URIRef):
        yield entry.node
    else:
        value = f"ab:asks lists {entry.node}, which is no property"
        entry.note(value, "list properties such as ex:is_fragile, without quotes")


def _start(entry: EntryReader) -> Iterator[InitialState]:
    value, prop = entry.value(AB.value), entry.iri(AB.property)
    if value is None:
        entry.note("an ab:starts lacks ab:value", "add it, such as false")
        return
    yield InitialState(prop, value, entry.maybe_iri(AB.when))


def _property(entry: EntryReader) -> Property:
    graph = local(entry.iri(AB.graph))
    if graph and graph not in ("attribute", "state"):
        remedy = "ab:attribute is for what lasts, ab:state for what a plan changes"
        entry.note("ab:graph must be ab:attribute or ab:state", remedy)
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
        implied=tuple(one for part in entry.parts(AB.impliedBy) for one in _implication(part)),
    )


def _implication(entry: EntryReader) -> Iterator[Implication]:
    equals, value, prop = entry.value(AB.equals), entry.value(AB.value), entry.iri(AB.property)
    if equals is None or value is None:
        entry.note("an ab:impliedBy needs ab:equals and ab:value", "add them, such as true")
        return
    yield Implication(prop, equals, value)


def _goals(entry: EntryReader, predicate: URIRef) -> tuple[Goal, ...]:
    return tuple(goal for part in entry.parts(predicate) for goal in _goal(part))


def _goal(entry: EntryReader) -> Iterator[Goal]:
    classes = tuple(str(iri) for iri in entry.iris(AB["class"]))
    asks, selects = entry.text(AB.ask, ""), entry.text(AB.select, "")
    if bool(asks) == bool(selects):
        remedy = "ab:ask says what must hold, ab:select finds what is wrong"
        entry.note("a goal needs either ab:ask or ab:select", remedy)
        return
    ask = query_of(entry, asks, "ab:ask", "ASK")
    select = query_of(entry, selects, "ab:select", "SELECT", "item")
    message = entry.text(AB.message)
    check_message(entry, message, ("item",) if classes or selects else ())
    about = query_of(entry, entry.text(AB.about, ""), "ab:about", "SELECT")
    before = frozenset(str(iri) for iri in entry.iris(AB.before))
    helped_by = query_of(entry, entry.text(AB["with"], ""), "ab:with", "SELECT")
    places = query_of(entry, entry.text(AB.places, ""), "ab:places", "SELECT", "place")
    yield Goal(ask or select, message, classes, about, before, asks or selects, helped_by, places)


def _tasks(graph: Graph, kind: URIRef, notes: Notes) -> Iterator[tuple[str, Task]]:
    """Every task, or class of tasks, under each of its names, normalised."""
    owners: dict[str, str] = {}
    for entry in entries(graph, "tasks.ttl", kind, notes):
        name, goals = entry.text(RDFS.label), _goals(entry, AB.goal)
        listed = kind == AB.Task
        needs = entry.texts(AB.needs)
        if listed and not (needs or goals):
            entry.note("says neither what it requires nor its goal", "add ab:needs or ab:goal")
        task = Task(name, needs, goals, listed, entry.node, name)
        for called in (name, *entry.texts(AB.alias)):
            other = owners.setdefault(normal(called), entry.entry)
            if other != entry.entry and called:
                entry.note(f'its name "{called}" is that of {other} too', "change one")
            yield normal(called), task


def _constraints(graph: Graph, notes: Notes) -> Iterator[Constraint]:
    for entry in entries(graph, "domain.ttl", AB.Constraint, notes):
        name, ask = entry.text(RDFS.label), entry.text(AB.ask)
        message = entry.text(AB.message)
        check_message(entry, message, ("item",))
        yield Constraint(
            name=name,
            names=tuple(map(normal, (name, *entry.texts(AB.alias)))),
            classes=entry.iris(AB["class"]),
            props=entry.iris(AB.property),
            query=query_of(entry, ask, "ab:ask", "ASK"),
            message=message,
            diet=entry.flag(AB.diet),
            strict=tuple(map(normal, entry.texts(AB.allergyTo))),
            source=ask,
        )
