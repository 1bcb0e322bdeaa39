"""The parts of a new action: what can be picked, and what each pick makes of the draft."""

from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from rdflib import XSD, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.ask.learning import safe_name
from adaptbot_cli.core.ask.new_action.draft import (
    UNLESS,
    Draft,
    DraftEffect,
    Need,
    adapted,
    condition,
    in_words,
    need_of,
    plain,
    prefixes,
    renamed,
    short,
    signature,
    state_words,
    unprefixed,
)
from adaptbot_cli.core.ask.questions import UNKNOWN, Choice, Question
from adaptbot_cli.core.domain import Action, Domain, ItemClass, Parameter, Property
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.sparql import variables
from adaptbot_cli.core.graph.terms import FALSE, TRUE, Triple, local
from adaptbot_cli.core.names import a
from adaptbot_cli.core.plan import Call
from adaptbot_cli.core.refine.grounding import number

Renaming = dict[str, str]


def needs(draft: Draft, domain: Domain) -> list[Need]:
    """Return what a new action may require, the attributes first, each once."""
    found: dict[str, Need] = {}
    for action in domain.actions.values():
        for part in action.attributes:
            source = next(p for p in action.parameters if p.name == part.of)
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
            boolean = prop.range == XSD.boolean and prop.graph == "state"
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
) -> Iterator[tuple[Renaming, tuple[Parameter, ...]]]:
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


def _brought(source: Parameter, names: Renaming) -> Parameter:
    default = renamed(unprefixed(source.default), names)
    return replace(source, default=default, optional=True, hidden=True, instead="", of_product="")


def _fits(parameter: Parameter, source: Parameter, domain: Domain) -> bool:
    if source.datatype is not None or parameter.datatype is not None:
        return source.datatype == parameter.datatype
    return _is(parameter, source.classes, domain)


def _is(parameter: Parameter, classes: Sequence[URIRef], domain: Domain) -> bool:
    """Whether everything that a parameter takes belongs to one of some classes."""
    kinds = [domain.classes[iri] for iri in parameter.classes if iri in domain.classes]
    return bool(kinds) and all(set(kind.superclasses) & set(classes) for kind in kinds)


def taking(draft: Draft, call: Call, kg: Kg) -> Draft:
    """Return a draft with a parameter more for each argument of a call that it has none for."""
    open_ = list(draft.visible)
    parameters = list(draft.parameters)
    for arg in call.args:
        kind = kind_of(arg, kg)
        fitting = [n for n, p in enumerate(open_) if _is_taken(p, kind)]
        if fitting:
            open_ = open_[fitting[0] + 1 :]
        else:
            parameters.append(parameter_of(kind, parameters, kg))
    return replace(draft, parameters=tuple(parameters))


def _is_taken(parameter: Parameter, kind: ItemClass | None) -> bool:
    if kind is None:
        return parameter.datatype is not None
    return bool(set(kind.superclasses) & set(parameter.classes))


def kind_of(name: str, kg: Kg) -> ItemClass | None:
    """Return the kind of a known thing; of an unknown one, the kind that the domain asks for first.

    A number has none.
    """
    for entity in kg.find(name):
        for kind in kg.domain.teachable:
            if kg.is_a(entity, [kind.iri]):
                return kind
    return None if number(name) else kg.domain.teachable[0]


def parameter_of(kind: ItemClass | None, others: Sequence[Parameter], kg: Kg) -> Parameter:
    """Return a parameter that takes things of a kind, or a number, by the domain's usual name."""
    taken = {p.name for p in others}
    base = "number" if kind is None else _usual_name(kind, kg)
    free = (base if n == 1 else f"{base}_{n}" for n in range(1, 100))
    name = next(name for name in free if name not in taken)
    if kind is None:
        return Parameter(name, datatype=XSD.decimal)
    return Parameter(name, (kind.iri,))


def _usual_name(kind: ItemClass, kg: Kg) -> str:
    """What the domain's actions mostly call what takes just this kind."""
    names = Counter(
        parameter.name
        for action in kg.domain.actions.values()
        for parameter in action.parameters
        if parameter.classes == (kind.iri,) and not parameter.hidden
    )
    return names.most_common(1)[0][0] if names else safe_name(local(kind.iri))


TAKES, REQUIRES, CHANGES = "takes", "requires", "changes"
PARTS = (TAKES, REQUIRES, CHANGES)
DONE = "done"

_TEXTS = {
    TAKES: "What else does {} take, or not take?",
    REQUIRES: "What must hold before {}?",
    CHANGES: "What is different after {}?",
}


@dataclass(frozen=True, slots=True)
class Pick:
    """Something that can be picked: the words people read, and the draft that it leads to."""

    label: str
    leads_to: Draft
    there: bool = False


def put_together(
    part: str, draft: Draft, call: Call, kg: Kg, counts: dict[str, int]
) -> Generator[Question, str, Draft]:
    """Ask for one part of an action until that is all; return the draft as it is then.

    `call` is the plan's own, for an example; `counts` how often each part has been asked for.
    """
    while True:
        counts[part] += 1
        offers = _OFFERS[part](draft, examples(draft, call), kg)
        picked = yield _question(part, draft, call, offers, counts[part])
        if picked == UNKNOWN and part == CHANGES:
            return replace(draft, changes=())
        if picked not in offers:
            return draft
        draft = offers[picked].leads_to


def _question(
    part: str, draft: Draft, call: Call, offers: Mapping[str, Pick], nth: int
) -> Question:
    choices = [Choice(value, offer.label) for value, offer in offers.items() if offer.there]
    choices += [Choice(value, offer.label) for value, offer in offers.items() if not offer.there]
    first = [Choice(DONE, "that is all")]
    if part == REQUIRES and not draft.needs:
        first = [Choice(DONE, "nothing")]
    if part == CHANGES:
        unknown = Choice(UNKNOWN, "I don't know, or nothing that I keep track of")
        first = [*first, unknown] if draft.changes else [unknown]
    text = _TEXTS[part].format(f'"{draft.name.replace("_", " ")}"')
    shown = words_of(draft, examples(draft, call))
    return Question(
        "action",
        draft.name,
        text,
        f"{part}_{nth}",
        "action",
        choices=(*first, *choices),
        notes=shown,
    )


def _takes(draft: Draft, shown: Mapping[str, str], kg: Kg) -> dict[str, Pick]:
    """A parameter less, one that can be left out, or one more of some kind."""
    found: dict[str, Pick] = {}
    for p in draft.visible:
        found[f"not {p.name}"] = Pick(f"not the {p.name}", draft.without(p.name), there=True)
        if not p.default:
            text = "must always be named" if p.optional else "can be left out"
            other = [replace(q, optional=not q.optional) if q == p else q for q in draft.parameters]
            leads_to = replace(draft, parameters=tuple(other))
            found[f"{p.name} {text}"] = Pick(f"the {p.name} {text}", leads_to, there=True)
    for kind in kg.domain.teachable:
        more = parameter_of(kind, draft.parameters, kg)
        leads_to = replace(draft, parameters=(*draft.parameters, more))
        found[f"also {more.name}"] = Pick(f"also {a(kind.label)}: the {more.name}", leads_to)
    return found


def _requires(draft: Draft, shown: Mapping[str, str], kg: Kg) -> dict[str, Pick]:
    there = {need.words: need for need in draft.needs}
    offered = {**there, **{n.words: n for n in needs(draft, kg.domain) if n.words not in there}}
    return {
        plain(words): _offer(n, words in there, draft.toggled_need(n), shown)
        for words, n in offered.items()
    }


def _changes(draft: Draft, shown: Mapping[str, str], kg: Kg) -> dict[str, Pick]:
    return {
        plain(c.words): _offer(c, c in draft.changes, draft.toggled_change(c), shown)
        for c in changes(draft, kg.domain)
    }


def _offer(
    part: Need | DraftEffect, there: bool, leads_to: Draft, shown: Mapping[str, str]
) -> Pick:
    [label] = in_words([part.words], shown)
    return Pick(f"no longer: {label}" if there else label, leads_to, there)


_OFFERS = {TAKES: _takes, REQUIRES: _requires, CHANGES: _changes}


def examples(draft: Draft, call: Call) -> dict[str, str]:
    """Return the things that the plan names for the parameters, to say with them what is meant."""
    names = (arg.replace("_", " ") for arg in call.args)
    return {p.name: arg for p, arg in zip(draft.visible, names, strict=False)}


def words_of(draft: Draft, shown: Mapping[str, str]) -> tuple[str, ...]:
    """Say in lines what an action takes, requires and changes, `shown` being an example of it."""
    shown = shown or {p.name: p.name for p in draft.parameters}
    required = in_words([need.words for need in draft.needs], shown)
    changed = in_words([change.words for change in draft.changes], shown)
    like = f", much like {draft.like}" if draft.like else ""
    return (
        f"{signature(draft.name, draft.parameters)}{like}",
        f"requires: {'; '.join(required) or 'nothing'}",
        f"changes: {'; '.join(changed) or 'its effect is not known'}",
    )
