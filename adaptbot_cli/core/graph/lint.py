"""Lint for packs: names in the domain, actions and tasks that nothing bears.

What a task names and this home lacks is worth a hint, no fault: a run of the task asks about it.
"""

from collections.abc import Iterable, Iterator
from functools import lru_cache, partial
from typing import Any

from rdflib import OWL, RDF, RDFS, XSD, URIRef

from adaptbot_cli.core.domain import Action, ItemClass
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.sparql import mentions
from adaptbot_cli.core.graph.terms import AB, DATATYPES, FALSE, TRUE, local
from adaptbot_cli.core.names import misspelt, nearest_remedy, normal, sentence_list
from adaptbot_cli.core.plan import Goal, Task

_STANDARD = tuple(map(str, (AB, RDF, RDFS, XSD, OWL)))
THING_LIKE = 0.75
"""How like a thing's name another must be spelt to be suggested: rice is no brioche."""


def misnamed(kg: Kg) -> Iterator[Fault]:
    """Give each class, property or thing that is named and not there.

    What a task's goal names and this home lacks is not among them: that is `lacking`.
    """
    for kind in kg.domain.classes.values():
        yield from _kind(kg, kind)
    yield from _properties(kg)
    for action in kg.domain.actions.values():
        yield from _action(kg, action)
    at = _at("domain.ttl", local(kg.domain.iri))
    agent = kg.domain.agent
    if agent and (agent, RDF.type, None) not in kg.facts:
        text = f"ab:agent is {local(agent)}, which attributes.ttl does not have"
        yield at(text, "give it a class there")
    for goal in (*kg.domain.goals, *kg.domain.advice):
        yield from _goal(kg, at, goal)
    for task in kg.domain.tasks:
        for goal in task.goals:
            yield from _goal(kg, _at("tasks.ttl", f'"{task.name}"'), goal, things=False)


def _at(file: str, entry: str) -> partial[Fault]:
    """What makes the faults of an entry."""
    return partial(Fault, file=file, entries=(entry,))


def _unknown(
    at: partial[Fault], problem: str, iri: URIRef, known: Iterable[URIRef], otherwise: str
) -> Fault:
    """A name that stands for nothing, and the nearest that would do."""
    remedy = nearest_remedy(local(iri), map(local, known), otherwise)
    return at(problem, remedy, unknown=local(iri))


def _kind(kg: Kg, kind: ItemClass) -> Iterator[Fault]:
    at, properties = _at("domain.ttl", local(kind.iri)), kg.domain.properties
    for above in kind.superclasses[1:]:
        if above not in kg.domain.classes and above != kind.iri:
            text = f"rdfs:subClassOf {local(above)} is no class of it"
            yield _unknown(at, text, above, kg.domain.classes, "declare it")
    names = (kind.name_property, kind.location_property)
    starts = (iri for start in kind.starts for iri in (start.prop, start.when))
    for iri in (*names, *kind.asks, *starts):
        if iri and iri not in properties:
            text = f"{local(iri)} is no property of it"
            yield _unknown(at, text, iri, properties, "declare it as an rdf:Property")
    for start in kind.starts:
        prop = properties.get(start.prop)
        if prop and prop.range == XSD.boolean and start.value not in (TRUE, FALSE):
            text = f"ab:starts gives {local(prop.iri)} the value {local(start.value)}"
            yield at(text, "write true or false, without quotes")


def _properties(kg: Kg) -> Iterator[Fault]:
    kinds = kg.domain.classes
    for prop in kg.domain.properties.values():
        at = _at("domain.ttl", local(prop.iri))
        if prop.domain and prop.domain not in kinds:
            text = f"{local(prop.domain)} is no class of it"
            yield _unknown(at, text, prop.domain, kinds, "declare it as an rdfs:Class")
        if prop.range and prop.range not in kinds and prop.range not in DATATYPES:
            text = f"rdfs:range {local(prop.range)} is no class or datatype"
            known = (*kinds, *DATATYPES)
            yield _unknown(at, text, prop.range, known, "write xsd:boolean, or a class")
        for implied in prop.implied:
            if implied.prop and implied.prop not in kg.domain.properties:
                text = f"{local(implied.prop)} is no property of it"
                yield _unknown(at, text, implied.prop, kg.domain.properties, "declare it")


def _action(kg: Kg, action: Action) -> Iterator[Fault]:
    at = _at("actions.ttl", action.name)
    for parameter in action.parameters:
        for iri in parameter.classes:
            if iri not in kg.domain.classes:
                text = f"parameter {parameter.name}: {local(iri)} is no class of domain.ttl"
                yield _unknown(at, text, iri, kg.domain.classes, "declare it there")
        for query in (parameter.default, parameter.instead, parameter.of_product):
            yield from _query(kg, at, query, f"a query of parameter {parameter.name}")
    purposes = (action.purpose,) if action.purpose else ()
    for condition in (*action.conditions, *action.advises, *purposes):
        yield from _query(kg, at, condition.query, f'"{condition.message}"')
        yield from _query(kg, at, condition.about, f'ab:about of "{condition.message}"')
    if action.effect is not None:
        yield from _query(kg, at, action.effect.select, "ab:effect")


def _goal(kg: Kg, at: partial[Fault], goal: Goal, *, things: bool = True) -> Iterator[Fault]:
    for iri in map(URIRef, goal.classes):
        if iri not in kg.domain.classes:
            text = f'ab:class {local(iri)} of "{goal.message}" is no class of domain.ttl'
            yield _unknown(at, text, iri, kg.domain.classes, "declare it there")
    actions = {action.iri: action.name for action in kg.domain.actions.values()}
    for iri in map(URIRef, sorted(goal.before)):
        if iri not in actions:
            text = f'ab:before {local(iri)} of "{goal.message}" is no action of actions.ttl'
            yield _unknown(at, text, iri, actions, "declare it there")
    for query, what in (
        (goal.query, ""),
        (goal.about, "ab:about of "),
        (goal.helped_by, "ab:with of "),
    ):
        yield from _query(kg, at, query, f'{what}"{goal.message}"', things=things)


def unknown(kg: Kg, query: str) -> list[URIRef]:
    """Return the IRIs that a query names and neither domain.ttl nor any fact knows, sorted."""
    known = {*kg.domain.properties, *kg.domain.classes, kg.domain.agent, kg.domain.iri}
    return [
        iri
        for iri in sorted(mentions(query) - known)
        if not str(iri).startswith(_STANDARD)
        and (iri, None, None) not in kg.facts
        and (None, None, iri) not in kg.facts
    ]


def _query(
    kg: Kg, at: partial[Fault], query: str, what: str, *, things: bool = True
) -> Iterator[Fault]:
    """What a query names that is not there; the things among it only if asked for."""
    for iri in unknown(kg, query):
        if iri not in things_in(query):
            text = f"{local(iri)} in {what} is not declared in domain.ttl"
            known = (*kg.domain.properties, *kg.domain.classes)
            yield _unknown(at, text, iri, known, "declare it there, or correct the name")
        elif things:
            here = {local(s) for s in kg.facts.subjects(RDF.type) if isinstance(s, URIRef)}
            near = misspelt(local(iri), here, THING_LIKE)
            remedy = f"the nearest there is {near}" if near else "add it there, or correct the name"
            yield at(f"{local(iri)} in {what} is not in attributes.ttl", remedy)


@lru_cache(maxsize=1024)
def things_in(query: str) -> frozenset[URIRef]:
    """Return the IRIs of a query that stand for things: neither as a predicate nor as a class.

    A query that cannot be taken apart has none.
    """
    from rdflib.plugins.sparql.algebra import translateQuery
    from rdflib.plugins.sparql.parser import parseQuery

    try:
        algebra = translateQuery(parseQuery(query)).algebra
    except Exception:  # its parser raises many kinds; the engine tells what is no valid query
        return frozenset()
    return mentions(query) - set(_terms(algebra))


def _terms(part: Any) -> Iterator[URIRef]:
    """The predicates and classes of the triples below a node of the algebra."""
    if isinstance(part, dict):
        # get of rdflib's nodes gives the key itself where there is none
        for _, predicate, value in dict.get(part, "triples") or ():
            yield from _path(predicate)
            if predicate == RDF.type and isinstance(value, URIRef):
                yield value
        for below in part.values():
            yield from _terms(below)
    elif isinstance(part, list | tuple | set):
        for below in part:
            yield from _terms(below)


def _path(predicate: Any) -> Iterator[URIRef]:
    """The predicates that a property path is made of."""
    if isinstance(predicate, URIRef):
        yield predicate
    parts = getattr(predicate, "args", None) or [
        getattr(predicate, name) for name in ("arg", "path") if hasattr(predicate, name)
    ]
    for part in parts:
        yield from _path(part)


def lacking(kg: Kg) -> Iterator[Fault]:
    """Give a hint for each thing that tasks need or their goals name, and the home lacks."""
    wanted: dict[str, dict[str, None]] = {}
    for task in kg.domain.tasks:
        for name in _lacked(kg, task):
            wanted.setdefault(name, {})[task.name] = None
    # What bears the name and is of no known class is no lack, but a fault that is told.
    for name, tasks in sorted((n, t) for n, t in wanted.items() if not kg.bears(n)):
        near = misspelt(name, kg.names_like(name), THING_LIKE)
        who = sentence_list(list(tasks), 3)
        remedy = "add it if it is here; else a run asks about it"
        remedy = f"the nearest there is {near}" if near else remedy
        text = f"{name} is not in attributes.ttl, and is named by {who}"
        yield Fault(text, remedy, "tasks.ttl", hint=True)


def _lacked(kg: Kg, task: Task) -> Iterator[str]:
    yield from (normal(item) for item in task.required if not kg.find(item))
    queries = (q for goal in task.goals for q in (goal.query, goal.about, goal.helped_by))
    for iri in (iri for query in queries for iri in unknown(kg, query) if iri in things_in(query)):
        # A thing of that name may be here, and yet not be the one that the goal names.
        yield str(iri) if kg.find(local(iri)) else normal(local(iri))
