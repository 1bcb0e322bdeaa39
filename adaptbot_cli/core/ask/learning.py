"""From an answer to facts: the paper's knowledge refinement f_KE (III-C)."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from rdflib import RDF, XSD, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.ask.questions import (
    LATER,
    MOST_SHOWN,
    NO,
    UNKNOWN,
    YES,
    Answer,
    Choice,
    Follows,
    Names,
    Question,
    QuestionKind,
    yes_no,
)
from adaptbot_cli.core.domain import Action, Domain, ItemClass, Property
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, NUMBERS, Triple, local
from adaptbot_cli.core.names import normal, sound
from adaptbot_cli.core.plan import KeptPlan

MOST_FOUND = 100
"""How many things are found by what is typed."""


@dataclass(frozen=True, slots=True)
class Lesson:
    """What one answer taught: the facts, the question and answer they come from, a sentence.

    `action` is the action as it is from now on, if that is what was taught; `replaces` the same
    before, if it was there; `notes` say in words what it takes, requires and changes. What holds
    this `once` is forgotten when the run has ended, and is never reviewed or kept. `plan` is
    one that is kept for the task.
    """

    delta: Delta
    question: Question
    answer: Answer
    sentence: str
    action: Action | None = None
    replaces: Action | None = None
    notes: tuple[str, ...] = ()
    once: bool = False
    plan: KeptPlan | None = None


def alias(name: str, entity: URIRef) -> Delta:
    """Return the facts of `name` being another name for a known item or action."""
    return Delta(added=frozenset({(entity, AB.alias, Literal(normal(name)))}))


def absence(domain: Domain, name: str, subject: str) -> Delta:
    """Return the facts of an item or action not being there, so that it is never asked again."""
    predicate = AB.absentAction if subject == "action" else AB.absentItem
    return Delta(added=frozenset({(domain.iri, predicate, Literal(normal(name)))}))


def is_absent(kg: Kg, name: str, subject: str) -> bool:
    """Tell whether a person has said that this item or action is not there."""
    predicate = AB.absentAction if subject == "action" else AB.absentItem
    return (kg.domain.iri, predicate, Literal(normal(name))) in kg.facts


def safe_name(name: str) -> str:
    """Return a name's letters and digits, for an IRI or a file: never empty, never long."""
    safe = "".join(c if c.isalnum() and c.isascii() else "_" for c in normal(name)).strip("_")
    base = (safe or "thing")[:60]
    return base if base[0].isalpha() else f"n_{base}"


def entity_iri(kg: Kg, name: str) -> URIRef:
    """Return a new entity's IRI: the domain's namespace and a safe, readable, unused end."""
    base = safe_name(name)
    actions = {action.iri for action in kg.domain.actions.values()}
    reserved = {kg.domain.agent, *kg.domain.classes, *kg.domain.properties, *actions}
    candidates = (base if n == 1 else f"{base}_{n}" for n in range(1, 10_000))
    taken = (URIRef(kg.domain.namespace + end) for end in candidates)
    return next(i for i in taken if i not in reserved and (i, None, None) not in kg.facts)


def existence(kg: Kg, name: str, kind: ItemClass) -> Delta:
    """Return the facts of a new entity: its class, its name and the states it starts in."""
    iri = entity_iri(kg, name)
    facts: set[Triple] = {(iri, RDF.type, kind.iri)}
    if kind.name_property is not None:
        facts.add((iri, kind.name_property, Literal(normal(name))))
    facts |= {(iri, s.prop, s.value) for s in kind.starts if s.when is None}
    return Delta(added=frozenset(facts))


def attribute(kg: Kg, entity: URIRef, prop: Property, value: Node) -> Delta:
    """Return the facts of an attribute's value, with the states that it brings with it."""
    old = set(kg.facts.triples((entity, prop.iri, None))) if prop.functional else set()
    facts: set[Triple] = {(entity, prop.iri, value)}
    facts |= set(_starts(kg, entity, prop.iri, value))
    return Delta(frozenset(old - facts), frozenset(f for f in facts if f not in kg.facts))


def _starts(kg: Kg, entity: URIRef, prop: URIRef, value: Node) -> Iterable[Triple]:
    """The states that an entity starts in because this attribute is true of it."""
    for iri in kg.facts.objects(entity, RDF.type):
        kind = kg.domain.classes.get(iri)  # type: ignore[call-overload]
        for start in kind.starts if kind else ():
            known = kg.value(entity, start.prop)
            if start.when == prop and value == Literal(True) and known is None:
                yield (entity, start.prop, start.value)


def attribute_question(
    kg: Kg, name: str, prop: Property, context: str, prevents: str = ""
) -> Question:
    """Return the domain's own question for an attribute or place of `name`.

    `prevents` is what not knowing it prevents.
    """
    plain = name.replace("_", " ")
    quoted = f'"{plain}"'
    text = prop.question.format(name=quoted) if prop.question else f"Is {quoted} {prop.label}?"
    kind, choices, number = _form_of(kg, name, prop, prevents)
    known, further = Names(), Names()
    if kind == "place":
        # No new place can be called as something is that is no place.
        few = kg.few(kg.domain.classes, MOST_SHOWN)
        known = Names(kg.name(e) for e in few or () if not kg.is_a(e, [prop.range]))
        if few is None:
            known = Names.of((), finder(kg, kg.domain.classes, [prop.range]))
            further = Names.of((), finder(kg, [prop.range]))
    return Question(
        kind,
        name,
        text,
        local(prop.iri),
        choices=choices,
        known=known,
        further=further,
        context=context,
        label=prop.label,
        number=number,
        follows=_follows(prop),
    )


def _form_of(
    kg: Kg, name: str, prop: Property, prevents: str
) -> tuple[QuestionKind, tuple[Choice, ...], str]:
    """How a property is asked for, from its range: as yes or no, a number, a text or a place."""
    if prop.range == XSD.boolean:
        return "attribute", yes_no(prevents), ""
    if prop.range in NUMBERS:
        return "value", (), NUMBERS[prop.range]
    if prop.range not in kg.domain.classes:
        return "value", (), ""
    handy = sorted(
        places(kg, name, prop), key=lambda place: (-kg.named_in(place, MOST_FOUND), place)
    )
    choices = [Choice(kg.name(place), kg.name(place)) for place in handy]
    return "place", (*choices, Choice(UNKNOWN, "I don't know", prevents)), ""


def _follows(prop: Property) -> tuple[Follows, ...]:
    """From which answers this property's answer follows."""
    words: dict[Node, str] = {Literal(True): YES, Literal(False): NO}
    return tuple(
        Follows(local(i.prop), words[i.equals], words[i.value])
        for i in prop.implied
        if i.equals in words and i.value in words
    )


def places(kg: Kg, name: str, prop: Property) -> list[URIRef]:
    """Return where a thing can be: neither in itself, nor in the robot's hand."""
    kinds = [
        k.iri for k in kg.domain.classes.values() if prop.range in k.superclasses and not k.hand
    ]
    found: set[Node] = set(kg.few(kinds, MOST_SHOWN) or ())
    if not found:  # too many to show: those where things of like names are
        like = kg.likest(name, kg.domain.classes, MOST_SHOWN)
        found = {p for e in like for by in kg.domain.locations for p in kg.facts.objects(e, by)}
    hands = set(kg.instances(k.iri for k in kg.domain.classes.values() if k.hand))
    found -= {*kg.find(name), *hands}
    return sorted(p for p in found if isinstance(p, URIRef) and kg.is_a(p, kinds))


def finder(
    kg: Kg, classes: Iterable[Node], never: Iterable[Node] = ()
) -> Callable[[str], list[str]]:
    """Return what finds names of things of some classes, and of none of others, by what is typed:
    first what is called so, then what has most letters in common with it."""
    wanted, barred = frozenset(classes), frozenset(never)

    def found(typed: str) -> list[str]:
        things = dict.fromkeys((*kg.find(typed), *kg.likest(typed, wanted, MOST_FOUND)))
        fitting = (t for t in things if kg.is_a(t, wanted) and not kg.is_a(t, barred))
        return list(map(kg.name, fitting))

    return found


def attribute_value(kg: Kg, prop: Property, answer: str) -> Node | None:
    """Return the term that an answer stands for, or None if it leaves the attribute unknown."""
    if answer in (UNKNOWN, LATER.value):
        return None
    if prop.range == XSD.boolean:
        return {YES: Literal(True), NO: Literal(False)}.get(answer)
    if prop.range in kg.domain.classes:
        found = [entity for entity in kg.find(answer) if kg.is_a(entity, [prop.range])]
        return found[0] if found else None
    value = Literal(sound(answer.strip()), datatype=prop.range)
    return None if value.ill_typed else value


def number_trouble(form: str, text: str) -> str:
    """Return what is wrong with a value that is written as `form`; "" if nothing is.

    An empty text means that the value is unknown.
    """
    if not form or not text.strip():
        return ""
    datatype = XSD.integer if form == "whole number" else XSD.decimal
    return f"this is no {form}" if Literal(text.strip(), datatype=datatype).ill_typed else ""
