"""Errors planted in a graph, to see what the person's answers and the world each put right."""

import random
from collections.abc import Sequence

from rdflib import XSD, Literal
from rdflib.term import Node

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.terms import Triple


def plant(facts: Sequence[Triple], kg: Kg, share: float, seed: int) -> list[Triple]:
    """Return facts with errors in a share of the places and of the attributes.

    A wrong place is another one that something of the same class is kept in; an attribute of yes or
    no is missing or the other way round, one as often as the other. The same seed plants the same.
    """
    chance = random.Random(f"planted {seed}")
    locations = set(kg.domain.locations)
    kept: dict[Node, set[Node]] = {}
    for _, predicate, value in facts:
        if predicate in locations:
            kept.setdefault(predicate, set()).add(value)
    hands = set(kg.instances(k.iri for k in kg.domain.kinds.values() if k.hand))
    planted = []
    for fact in sorted(facts):
        subject, predicate, value = fact
        places = sorted(kept.get(predicate, set()) - {value, subject} - hands, key=str)
        known = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
        wrong = chance.random() < share
        if wrong and places:
            planted.append((subject, predicate, chance.choice(places)))
        elif wrong and known and known.graph != "state" and known.range == XSD.boolean:
            flipped = Literal(not value.toPython())  # type: ignore[attr-defined]
            planted += [(subject, predicate, flipped)] if chance.random() < 0.5 else []
        else:
            planted.append(fact)
    return planted


def repaired(result: Result, lost: frozenset[Triple]) -> tuple[int, int]:
    """Return how many of the facts that errors took away were put right: by the person who told
    them, and by what was seen of them."""
    told = {fact for lesson in result.lessons for fact in lesson.delta.added}
    surprise = result.outside.surprise if result.outside else Delta()
    seen = {fact[:2] for fact in surprise.removed | surprise.added}
    return len(lost & told), sum(fact[:2] in seen for fact in lost - told)
