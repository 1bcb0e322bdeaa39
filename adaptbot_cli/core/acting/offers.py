"""What a new action may require and change: what the domain's actions do already."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

from rdflib import URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.acting.draft import (
    UNLESS,
    Draft,
    DraftEffect,
    Need,
    condition,
    need_of,
    state_words,
)
from adaptbot_cli.core.acting.text import adapted, prefixes, renamed, short, unprefixed
from adaptbot_cli.core.domain import Action, Domain, Parameter, Property
from adaptbot_cli.core.sparql import variables
from adaptbot_cli.core.terms import FALSE, TRUE, Triple

Mapping = dict[str, str]


def needs(draft: Draft, domain: Domain) -> list[Need]:
    """Return what a new action may require, the attributes first, each once."""
    found: dict[str, Need] = {}
    for action in domain.actions.values():
        for part in action.attributes:
            source = _parameter(action, part.of)
            for names, _ in _mappings([source], draft, domain):
                need = need_of(part, domain, names)
                found.setdefault(need.words, need)
    for need in (*_states(draft, domain), *_conditions(draft, domain)):
        if not need.words.startswith(UNLESS):
            found.setdefault(need.words, need)
    return list(found.values())


def _states(draft: Draft, domain: Domain) -> Iterator[Need]:
    """A state that some action brings about: the steps for it can be inserted."""
    spaces = prefixes(domain)
    for parameter, prop in _changeable(draft, domain):
        name = parameter.name
        ask = f"ASK {{ ?{name} {short(prop.iri, spaces)} true }}"
        words = state_words(name, prop.iri, TRUE, domain)
        yield Need(words, f"{{{name}}} must be {prop.label}", ask=ask)


def _conditions(draft: Draft, domain: Domain) -> Iterator[Need]:
    for action in domain.actions.values():
        for part in action.conditions:
            named = variables(part.source) & {p.name for p in action.parameters}
            used = [p for p in action.parameters if p.name in named]
            for names, brings in _mappings(used, draft, domain):
                taken = {p.name for p in draft.parameters}
                ask = adapted(part.source, names, taken)
                yield replace(condition(part, names, ask), brings=brings)


def changes(draft: Draft, domain: Domain) -> list[DraftEffect]:
    """Return what may be different after a new action, each once."""
    found = {change.words: change for change in draft.changes}
    for change in (*_new_states(draft, domain), *_moves(draft, domain)):
        found.setdefault(change.words, change)
    return list(found.values())


def _new_states(draft: Draft, domain: Domain) -> Iterator[DraftEffect]:
    spaces = prefixes(domain)
    for parameter, prop in _changeable(draft, domain):
        name, named = parameter.name, short(prop.iri, spaces)
        for value, text in ((TRUE, "true"), (FALSE, "false")):
            words = state_words(name, prop.iri, value, domain)
            update = (
                f"DELETE {{ ?{name} {named} ?old }} INSERT {{ ?{name} {named} {text} }} "
                f"WHERE {{ OPTIONAL {{ ?{name} {named} ?old }} }}"
            )
            yield DraftEffect(words, update, f"{name} {prop.iri}")


def _changeable(draft: Draft, domain: Domain) -> Iterator[tuple[Parameter, Property]]:
    """The states that a thing can be in and that some action changes, by parameter."""
    touched = {iri for a in domain.actions.values() if a.effect for iri in a.effect.predicates}
    for parameter in draft.visible:
        for prop in domain.properties.values():
            boolean = str(prop.range).endswith("#boolean") and prop.graph == "state"
            if boolean and prop.iri in touched and _is(parameter, [prop.domain], domain):
                yield parameter, prop


def _moves(draft: Draft, domain: Domain) -> Iterator[DraftEffect]:
    """To be in the hand, or in another place: all that the action which does so changes."""
    taking = {a.name: _in_hand(a, a.effect.inserts) for a in domain.actions.values() if a.effect}
    putting = {a.name: _in_hand(a, a.effect.deletes) for a in domain.actions.values() if a.effect}
    held = _predicates(taking) & _predicates(putting)
    for action in domain.actions.values():
        if action.effect is None:
            continue
        taken = [p for p, prop in taking[action.name] if prop in held]
        put = [p for p, prop in putting[action.name] if prop in held]
        where = [p for p in action.visible if p not in put and p.classes]
        if taken:
            yield from _as(action, taken[:1], "{0} is in the hand", draft, domain)
        elif put and where:
            yield from _as(action, [put[0], where[0]], "{0} is in or on {1}", draft, domain)


def _as(
    action: Action, used: Sequence[Parameter], words: str, draft: Draft, domain: Domain
) -> Iterator[DraftEffect]:
    """The effect of a known action, done to parameters of the draft."""
    for names, brings in _mappings(used, draft, domain):
        if action.effect is not None and not brings:
            update = adapted(action.effect.update, names, {p.name for p in draft.parameters})
            text = words.format(*(f"{{{names[p.name]}}}" for p in used))
            yield DraftEffect(text, update, f"{names[used[0].name]} place")


Handled = list[tuple[Parameter, Node]]


def _in_hand(action: Action, triples: Sequence[Triple]) -> Handled:
    """The parameters that stand in some relation to the robot, with the relation."""
    related = {str(o): p for s, p, o in triples if s == Variable("agent")}
    return [(p, related[p.name]) for p in action.visible if p.name in related]


def _predicates(handled: dict[str, Handled]) -> set[Node]:
    return {predicate for pairs in handled.values() for _, predicate in pairs}


def _mappings(
    used: Sequence[Parameter], draft: Draft, domain: Domain
) -> Iterator[tuple[Mapping, tuple[Parameter, ...]]]:
    """Every way to read a known action's parameters as those of the draft.

    A parameter with a default for which the draft has nothing comes along, hidden.
    """
    options: list[list[Parameter | None]] = []
    for source in used:
        fitting: list[Parameter | None] = [p for p in draft.parameters if _fits(p, source, domain)]
        bringable = source.default and source.name not in {p.name for p in draft.parameters}
        options.append(fitting or ([None] if bringable else []))
    for chosen in product(*options):
        given = [p for p in chosen if p is not None]
        if len({p.name for p in given}) < len(given):
            continue
        pairs = list(zip(used, chosen, strict=True))
        names = {source.name: source.name if p is None else p.name for source, p in pairs}
        brings = tuple(_brought(source, names) for source, p in pairs if p is None)
        yield names, brings


def _brought(source: Parameter, names: Mapping) -> Parameter:
    default = renamed(unprefixed(source.default), names)
    return replace(source, default=default, optional=True, hidden=True, instead="", of_product="")


def _fits(parameter: Parameter, source: Parameter, domain: Domain) -> bool:
    if source.datatype is not None or parameter.datatype is not None:
        return source.datatype == parameter.datatype
    return _is(parameter, source.classes, domain)


def _is(parameter: Parameter, classes: Sequence[URIRef], domain: Domain) -> bool:
    """Whether everything that a parameter takes belongs to one of some classes."""
    kinds = [domain.kinds[iri] for iri in parameter.classes if iri in domain.kinds]
    return bool(kinds) and all(set(kind.supers) & set(classes) for kind in kinds)


def _parameter(action: Action, name: str) -> Parameter:
    return next(p for p in action.parameters if p.name == name)
