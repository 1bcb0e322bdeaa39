"""Reads actions.ttl: parameters, requirements, effects."""

import re
from collections.abc import Collection

from rdflib import RDFS, Graph, Literal, URIRef

from adaptbot_cli.core.domain import (
    Action,
    AttributeRequirement,
    CalledAs,
    Condition,
    Effect,
    Parameter,
)
from adaptbot_cli.core.pack.entry import (
    Entry,
    check_message,
    entries,
    order_of,
    query_of,
    refuse_dollars,
    valid,
)
from adaptbot_cli.core.sparql import mentions, prefixed, split_update, template, variables
from adaptbot_cli.core.terms import AB, local


def read_actions(graph: Graph, declared: Collection[URIRef]) -> dict[str, Action]:
    """Read every action, by name. `declared` are the predicates that domain.ttl knows.

    Raises:
        PackError: an entry lacks something or does not make sense.
    """
    found = [entry for _, entry in entries(graph, "actions.ttl", AB.Action)]
    actions: dict[str, Action] = {}
    for entry in sorted(found, key=order_of):
        action = _action(entry, declared)
        if action.name in actions:
            other = local(actions[action.name].iri)
            raise entry.fail(f'"{action.name}" is the rdfs:label of {other} too; change one')
        actions[action.name] = action
    return actions


def _action(entry: Entry, known: Collection[URIRef]) -> Action:
    parts = entry.listed(AB.parameters) or entry.parts(AB.parameter)
    parameters = tuple(_parameter(part) for part in parts)
    requires = entry.parts(AB.requires)
    action = Action(
        iri=entry.node,
        name=entry.text(RDFS.label),
        explain=entry.text(AB.explain),
        parameters=parameters,
        attributes=tuple(_attribute(part) for part in requires if part.value(AB.attribute)),
        conditions=tuple(_condition(part) for part in requires if not part.value(AB.attribute)),
        advises=tuple(_condition(part) for part in entry.parts(AB.advises)),
        effect=_effect(entry),
        aliases=entry.texts(AB.alias),
        called_as=tuple(_called_as(part) for part in entry.parts(AB.calledAs)),
        family=entry.text(AB.family, ""),
        verb=entry.text(AB.verb, "") or entry.text(RDFS.label).split("_")[0],
        fetches=entry.flag(AB.fetches),
        purpose=_purpose(entry),
    )
    _check_action(entry, action, known)
    return action


def _parameter(entry: Entry) -> Parameter:
    name = entry.text(AB.name)
    if not re.fullmatch(r"[a-z][a-z_0-9]*", name):
        raise entry.fail(f'parameter "{name}": a name has small letters, digits and underscores')
    classes, datatype = entry.iris(AB["class"]), entry.maybe_iri(AB.datatype)
    if bool(classes) == bool(datatype):
        raise entry.fail(f'parameter "{name}" needs either ab:class or ab:datatype')
    words = {word: Literal(True) for word in entry.texts(AB.trueWord)}
    words |= {word: Literal(False) for word in entry.texts(AB.falseWord)}
    what = f'ab:default of parameter "{name}"'
    default = query_of(entry, entry.text(AB.default, ""), what, "SELECT", name)
    what = f'ab:instead of parameter "{name}"'
    instead = query_of(entry, entry.text(AB.instead, ""), what, "SELECT", name)
    return Parameter(
        name=name,
        classes=classes,
        datatype=datatype,
        optional=entry.flag(AB.optional),
        hidden=entry.flag(AB.hidden),
        default=default,
        instead=instead,
        instead_means=entry.text(AB.insteadMeans, "stands for them"),
        words=words,
        units=_units(entry),
        of_product=query_of(entry, entry.text(AB.ofProduct, ""), "ab:ofProduct", "SELECT", name),
    )


def _units(entry: Entry) -> dict[str, float]:
    """The words that a number may carry, written as "hours=60"."""
    try:
        return {word: float(by) for word, by in (u.split("=") for u in entry.texts(AB.unit))}
    except ValueError:
        raise entry.fail('ab:unit needs a word and a number, such as "hours=60"') from None


def _attribute(entry: Entry) -> AttributeRequirement:
    value = entry.value(AB.value)
    if value is None:
        raise entry.fail("an ab:requires with ab:attribute needs ab:value")
    return AttributeRequirement(
        entry.text(AB.of),
        entry.iri(AB.attribute),
        value,
        entry.text(AB.message),
        entry.value(AB.ifUnknown) == AB.holds,
    )


def _condition(entry: Entry) -> Condition:
    query = query_of(entry, entry.text(AB.ask), "ab:ask", "ASK")
    about = query_of(entry, entry.text(AB.about, ""), "ab:about", "SELECT")
    return Condition(query, entry.text(AB.message), mentions(query), about)


def _purpose(entry: Entry) -> Condition | None:
    parts = entry.parts(AB.purpose)
    return _condition(parts[0]) if parts else None


def _called_as(entry: Entry) -> CalledAs:
    value = entry.value(AB.value)
    if value is None:
        raise entry.fail("an ab:calledAs needs ab:value")
    return CalledAs(entry.texts(AB.alias), entry.text(AB.parameter), value)


def _effect(entry: Entry) -> Effect | None:
    text = entry.text(AB.effect, "")
    if not text:
        return None
    refuse_dollars(entry, text, "ab:effect")
    prefixes = prefixed(entry.graph, text)
    try:
        deletes, inserts, where = split_update(text)
    except ValueError as problem:
        raise entry.fail(f"ab:effect {problem}") from None
    names = " ".join(f"?{name}" for name in sorted(variables(text)))
    select = f"{prefixes}SELECT {names or '*'} WHERE {{ {where} }}"
    valid(entry, select, "ab:effect")
    try:
        templates = template(prefixes, deletes), template(prefixes, inserts)
    except ValueError as problem:
        raise entry.fail(f"ab:effect is no valid SPARQL: {problem}") from None
    changed = mentions(prefixes + deletes) | mentions(prefixes + inserts)
    return Effect(text.strip(), select, *templates, changed | _bound_predicates(prefixes, where))


def _bound_predicates(prefixes: str, where: str) -> frozenset[URIRef]:
    """Predicates that an effect may change through a variable: those its VALUES rows name."""
    rows = " ".join(re.findall(r"VALUES[^{]*\{([^}]*)\}", where, re.IGNORECASE))
    return mentions(prefixes + rows)


def _check_action(entry: Entry, action: Action, known: Collection[URIRef]) -> None:
    names = [parameter.name for parameter in action.parameters]
    for need in action.attributes:
        if need.of not in names:
            raise entry.fail(f'ab:of "{need.of}" is none of its parameters')
        if need.prop not in known:
            raise entry.fail(f"ab:attribute {local(need.prop)} is not declared in domain.ttl")
    for called in action.called_as:
        if called.parameter not in names:
            raise entry.fail(f'ab:parameter "{called.parameter}" is none of its parameters')
    for predicate in _changed(action.effect):
        if predicate not in known:
            raise entry.fail(f"ab:effect: {local(predicate)} is not declared in domain.ttl")
    purposes = (action.purpose,) if action.purpose else ()
    for condition in (*action.conditions, *action.advises, *purposes):
        check_message(entry, condition.message, names)
    for need in action.attributes:
        check_message(entry, need.message, names)


def _changed(effect: Effect | None) -> list[URIRef]:
    """The predicates that an effect changes, but for those that a variable stands for."""
    triples = (*effect.deletes, *effect.inserts) if effect else ()
    return sorted({predicate for _, predicate, _ in triples if isinstance(predicate, URIRef)})
