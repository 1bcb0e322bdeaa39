"""The facts of a taught action, and the action as it is read back from them."""

from collections.abc import Iterator

from rdflib import RDF, RDFS, Graph, Literal, URIRef

from adaptbot_cli.core.acting.draft import Draft, Need, plain
from adaptbot_cli.core.acting.text import prefixes, together
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.domain import Action, CalledAs, Parameter
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import entity_iri, safe_name
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.pack.actions import read_action
from adaptbot_cli.core.terms import AB, Triple, local


def written(draft: Draft, kg: Kg) -> tuple[Action, Delta]:
    """Return a new action with its facts, read back as from a file of the domain.

    Every fact is a line of actions.ttl in the form of a hand-written entry, but that its parts
    are named nodes and its parameters bear `ab:order` instead of standing in a list.

    Raises:
        PackError: the facts make no action.
    """
    iri = entity_iri(kg, draft.name)
    facts = set(_facts(iri, draft))
    graph = Graph(bind_namespaces="none")
    for prefix, space in prefixes(kg.domain).items():
        graph.bind(prefix, space)
    for fact in facts:
        graph.add(fact)
    declared = {*kg.domain.properties, RDF.type, RDFS.subClassOf}
    return read_action(graph, iri, kg.domain.properties, declared), Delta(added=frozenset(facts))


def _facts(iri: URIRef, draft: Draft) -> Iterator[Triple]:
    yield iri, RDF.type, AB.Action
    yield iri, RDFS.label, Literal(normal(draft.name))
    yield iri, AB.explain, Literal(explained(draft))
    for n, parameter in enumerate(draft.parameters, start=1):
        node = URIRef(f"{iri}_{parameter.name}")
        yield iri, AB.parameter, node
        yield node, AB.order, Literal(n)
        yield from _parameter(node, parameter)
    for n, need in enumerate(draft.needs, start=1):
        node = URIRef(f"{iri}_needs_{n}")
        yield iri, AB.requires, node
        yield node, AB.order, Literal(n)
        yield node, AB.message, Literal(need.message)
        yield from _need(node, need)
    if draft.changes:
        names = [p.name for p in draft.parameters]
        yield iri, AB.effect, Literal(together([c.update for c in draft.changes], names))


def explained(draft: Draft) -> str:
    """Say in a line what an action does, for a model to read."""
    if not draft.changes:
        return "taught by a person; its effect is not known"
    text = "; ".join(plain(change.words) for change in draft.changes)
    return f"taught by a person: then {text}"


def _parameter(node: URIRef, parameter: Parameter) -> Iterator[Triple]:
    yield node, AB.name, Literal(parameter.name)
    for iri in parameter.classes:
        yield node, AB["class"], iri
    if parameter.datatype is not None:
        yield node, AB.datatype, parameter.datatype
    for predicate, flag in ((AB.optional, parameter.optional), (AB.hidden, parameter.hidden)):
        if flag:
            yield node, predicate, Literal(True)
    if parameter.default:
        yield node, AB.default, Literal(parameter.default)
    if parameter.instead:
        yield node, AB.instead, Literal(parameter.instead)
        yield node, AB.insteadMeans, Literal(parameter.instead_means)
    for word, value in parameter.words.items():
        yield node, AB.trueWord if value == Literal(True) else AB.falseWord, Literal(word)
    for word, by in parameter.units.items():
        yield node, AB.unit, Literal(f"{word}={by:g}")


def _need(node: URIRef, need: Need) -> Iterator[Triple]:
    if need.attribute is None:
        yield node, AB.ask, Literal(need.ask)
        return
    yield node, AB.of, Literal(need.attribute.of)
    yield node, AB.attribute, need.attribute.prop
    yield node, AB.value, need.attribute.value
    if need.attribute.assume:
        yield node, AB.ifUnknown, AB.holds


def called(name: str, action: Action, fixed: list[CalledAs], kg: Kg) -> Delta:
    """Return the facts of a name for a known action with some of its arguments fixed."""
    facts: set[Triple] = set()
    base = entity_iri(kg, f"{local(action.iri)}_as_{safe_name(name)}")
    for n, part in enumerate(fixed, start=1):
        node = base if n == 1 else URIRef(f"{base}_{n}")
        facts |= {
            (action.iri, AB.calledAs, node),
            (node, AB.alias, Literal(normal(name))),
            (node, AB.parameter, Literal(part.parameter)),
            (node, AB.value, part.value),
        }
    return Delta(added=frozenset(facts))
