"""Slips in an action's queries that are valid SPARQL and do nothing, or what nobody meant."""

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping

from rdflib import Literal, URIRef, Variable

from adaptbot_cli.core.datatypes import DATATYPES, is_value
from adaptbot_cli.core.domain import Effect, Property
from adaptbot_cli.core.names import a, misspelt, nearest, sentence_list
from adaptbot_cli.core.pack.entry import EntryReader
from adaptbot_cli.core.pack.queries import valid
from adaptbot_cli.core.sparql import prefixed, split_update, used_variables
from adaptbot_cli.core.terms import AB, Triple, local

_LIKE = 0.8
"""How alike a variable and a parameter must be spelt for the one to be a slip for the other."""


def check_queries(
    entry: EntryReader, parameters: Iterable[EntryReader], names: Collection[str]
) -> None:
    """Doubt each variable of a condition, or of a parameter's query, that is likely misspelt."""
    terms = (AB.requires, AB.advises, AB.purpose)
    for part in (part for term in terms for part in entry.parts(term)):
        for term in (AB.ask, AB.about):
            _check_spelling(entry, part.text(term, ""), f"ab:{local(term)}", names)
    for part in parameters:
        for term in (AB.default, AB.instead, AB.ofProduct):
            what = f'ab:{local(term)} of parameter "{part.text(AB.name)}"'
            _check_spelling(entry, part.text(term, ""), what, {*names, "given"})


def check_effect(
    entry: EntryReader,
    effect: Effect | None,
    names: Collection[str],
    properties: Mapping[URIRef, Property],
) -> None:
    """Note what of an effect would be left out, or would write what domain.ttl does not allow."""
    if effect is None:
        return
    triples = (*effect.deletes, *effect.inserts)
    written = {str(n) for triple in triples for n in triple if isinstance(n, Variable)}
    for name in sorted(written - _bound(entry, effect) - {*names, "agent"}):
        near = nearest(name, sorted({*names, "agent"}), 1)
        text = f"ab:effect writes ?{name}, which is no parameter and not bound in its WHERE"
        text += ", so that nothing is written"
        known = (
            f"its parameters are {sentence_list(sorted(names), 9)}" if names else "bind it there"
        )
        entry.note(text, f"the nearest there is ?{near[0]}" if near else known)
    _check_spelling(entry, effect.update, "ab:effect", names, written)
    for triple in dict.fromkeys(triples):
        prop = properties.get(triple[1])  # type: ignore[call-overload]
        if prop is not None:
            _check_value(entry, triple, prop)


def _bound(entry: EntryReader, effect: Effect) -> set[str]:
    """The variables that the WHERE of an effect gives values to."""
    where = split_update(effect.update)[2]
    query = f"{prefixed(entry.graph, where)}SELECT * WHERE {{ {where}\n}}"
    return set(valid(entry, query, "ab:effect") or ())


def _check_value(entry: EntryReader, triple: Triple, prop: Property) -> None:
    """Note a literal, or a thing, that cannot be a value of its property."""
    value, name = triple[2], local(prop.iri)
    if isinstance(value, Variable) or not prop.range:
        return
    text = f'"{value}"' if isinstance(value, Literal) else local(value)
    problem = f"ab:effect writes {text} as {name}, which must be {a(local(prop.range))}"
    if prop.range in DATATYPES and not is_value(value, prop.range):
        entry.note(problem, f"write {DATATYPES[prop.range]}")
    elif prop.range not in DATATYPES and isinstance(value, Literal):
        entry.note(problem, "write a thing such as ex:thing, or a parameter")


def _check_spelling(
    entry: EntryReader, text: str, what: str, names: Collection[str], but: Collection[str] = ()
) -> None:
    """Doubt each variable that stands once, and is spelt almost as a parameter is.

    Of a name that differs in a number (?place2) or in a word more (?old_place) it is meant.
    """
    counts = Counter(used_variables(text))
    for name in (name for name, count in counts.items() if count == 1 and name not in but):
        meant = misspelt(name, (*names, "agent"), _LIKE)
        slip = meant not in ("", name) and meant.count("_") == name.count("_")
        if slip and not re.search(r"\d", name):
            message = f"{what} names ?{name}, which stands there once and is no parameter"
            entry.doubt(message, f"the nearest there is ?{meant}")
