"""Reads actions.ttl: parameters, requirements, effects, and slips in the queries of these."""

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping

import pyoxigraph
from rdflib import RDFS, Graph, Literal, URIRef, Variable

from adaptbot_cli.core.domain import (
    Action,
    AttributeRequirement,
    CalledAs,
    Condition,
    Effect,
    Parameter,
    Property,
)
from adaptbot_cli.core.graph.clock import LONGEST, within
from adaptbot_cli.core.graph.sparql import (
    bindable,
    dollars,
    makes_text,
    mentions,
    one_newline,
    prefixed,
    reaches_out,
    split_update,
    template,
    used_variables,
    variables,
)
from adaptbot_cli.core.graph.terms import AB, DATATYPES, WRITTEN, Triple, is_value, local
from adaptbot_cli.core.names import a, misspelt, nearest, nearest_remedy, sentence_list
from adaptbot_cli.core.pack.entry import (
    NOTHING,
    EntryReader,
    Notes,
    check_message,
    entries,
    order_of,
)
from adaptbot_cli.core.pack.vocabulary import check_terms

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
            entry.note(message, f"the nearest there is ?{meant}", likely=True)


_CORRECT = "correct the query; its prefixes are those of the file"


def query_of(entry: EntryReader, text: str, what: str, form: str, gives: str = "") -> str:
    """Return an entry's query, ready to be asked with bindings; "" if it is not valid.

    `gives` is a variable that a SELECT must give values for.
    """
    text = one_newline(text).strip()
    if not text:
        return ""
    if not re.match(rf"{form}\b", text, re.IGNORECASE):
        entry.note(f"{what} must be a SPARQL {form}", f"begin it with {form}")
        return ""
    if re.match(r"SELECT\s+(DISTINCT\s+|REDUCED\s+)?\*", text, re.IGNORECASE):
        problem = f"{what} must name the variables that it gives, not *"
        entry.note(problem, f"write SELECT ?{gives or 'item'}")
        return ""
    query = prefixed(entry.graph, text) + form + text[len(form) :]
    given = valid(entry, query, what)
    if given is None:
        return ""
    if gives and gives not in given:
        message = " and ".join(f"?{name}" for name in given)
        entry.note(f"{what} must give ?{gives}, but gives {message}", f"select ?{gives}")
        return ""
    return bindable(query) if valid(entry, bindable(query), what) is not None else ""


def valid(entry: EntryReader, query: str, what: str) -> tuple[str, ...] | None:
    """Return the variables that a SELECT gives, none of an ASK; None if the query is not valid, or
    asks more than this graph. Raises EndlessError."""
    if refused_dollars(entry, query, what):
        return None
    if len(query) > LONGEST:
        entry.note(f"{what} has more than {LONGEST:,} characters", "make it shorter")
        return None
    if made := makes_text(query):
        entry.note(f"{what} has {made}, which can fill the memory", "compare what is there")
        return None
    try:
        if word := reaches_out(query):
            text = f"{what} has {word}, which reaches outside the graph"
            entry.note(text, "ask this graph alone")
            return None
        return within(lambda: _given(query), f"{entry.file}, entry {entry.entry}: {what}")
    except (SyntaxError, ValueError) as error:
        text = " ".join(str(error).split())
        text = text.removeprefix("this is no valid SPARQL: ")
        entry.note(f"{what} is no valid SPARQL: {text}", _CORRECT)
        return None


def _given(query: str) -> tuple[str, ...]:
    """The variables that a query gives, asked of an empty graph."""
    found = pyoxigraph.Store().query(query)
    if isinstance(found, pyoxigraph.QuerySolutions):
        return tuple(variable.value for variable in found.variables)
    return ()


def refused_dollars(entry: EntryReader, query: str, what: str) -> bool:
    """Note each variable that is written with a dollar, which could not be bound."""
    found = dict.fromkeys(dollars(query))
    for name in found:
        entry.note(f"{what} writes {name}", f"write ?{name[1:]}")
    return bool(found)


def read_actions(
    graph: Graph, notes: Notes, properties: Mapping[URIRef, Property], declared: Collection[URIRef]
) -> dict[str, Action]:
    """Read every action, by name. `declared` are the predicates that domain.ttl knows."""
    found = list(entries(graph, "actions.ttl", AB.Action, notes))
    actions: dict[str, Action] = {}
    for entry in sorted(found, key=order_of):
        action = _action(entry)
        _check_action(entry, action, properties, declared)
        if action.name in actions:
            other = local(actions[action.name].iri)
            entry.note(f'"{action.name}" is the rdfs:label of {other} too', "change one")
        actions.setdefault(action.name, action)
    _check_names(found, actions)
    return actions


def read_action(
    graph: Graph, node: URIRef, properties: Mapping[URIRef, Property], declared: Collection[URIRef]
) -> Action:
    """Read one action, as `read_actions` does, alone. Raises PackError."""
    notes = Notes()
    check_terms(graph, "actions.ttl", notes)
    entry = EntryReader.of(graph, "actions.ttl", node, notes)
    action = _action(entry)
    _check_action(entry, action, properties, declared)
    notes.refuse()
    return action


def _action(entry: EntryReader) -> Action:
    requires = entry.parts(AB.requires)
    needs = [part for part in requires if part.value(AB.attribute)]
    return Action(
        iri=entry.node,
        name=entry.text(RDFS.label),
        explain=entry.text(AB.explain),
        parameters=tuple(_parameter(part) for part in _parameters(entry)),
        attributes=tuple(need for part in needs for need in _attribute(part)),
        conditions=tuple(_condition(part) for part in requires if part not in needs),
        advises=tuple(_condition(part) for part in entry.parts(AB.advises)),
        effect=_effect(entry),
        aliases=entry.texts(AB.alias),
        called_as=tuple(c for part in entry.parts(AB.calledAs) for c in _called_as(part)),
        family=entry.text(AB.family, ""),
        verb=entry.text(AB.verb, "") or entry.text(RDFS.label).split("_")[0],
        fetches=entry.flag(AB.fetches),
        irreversible=entry.flag(AB.irreversible) if entry.value(AB.irreversible) else None,
        purpose=next(map(_condition, entry.parts(AB.purpose)), None),
    )


def _parameters(entry: EntryReader) -> tuple[EntryReader, ...]:
    return entry.listed(AB.parameters) or entry.parts(AB.parameter)


def _parameter(entry: EntryReader) -> Parameter:
    name = entry.text(AB.name)
    if name and not re.fullmatch(r"[a-z][a-z_0-9]*", name):
        problem = f'parameter "{name}": a name has small letters, digits and underscores'
        entry.note(problem, f'write "{re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")}"')
    classes, datatype = entry.iris(AB["class"]), entry.maybe_iri(AB.datatype)
    if bool(classes) == bool(datatype):
        problem = f'parameter "{name}" needs either ab:class or ab:datatype'
        entry.note(problem, "write ab:class for a thing, ab:datatype for a value")
    if datatype is not None and datatype not in WRITTEN:
        known = ", ".join(f"xsd:{local(iri)}" for iri in WRITTEN)
        problem = f'parameter "{name}": ab:datatype {local(datatype)} is nothing a plan can write'
        entry.note(problem, f"write one of {known}")
    words = {word: Literal(True) for word in entry.texts(AB.trueWord)}
    words |= {word: Literal(False) for word in entry.texts(AB.falseWord)}
    return Parameter(
        name=name,
        classes=classes,
        datatype=datatype,
        optional=entry.flag(AB.optional),
        hidden=entry.flag(AB.hidden),
        default=_select(entry, AB.default, name),
        instead=_select(entry, AB.instead, name),
        instead_means=entry.text(AB.insteadMeans, "stands for them"),
        words=words,
        units=dict(_units(entry)),
        of_product=_select(entry, AB.ofProduct, name),
        prepositions=entry.texts(AB.preposition),
    )


def _select(entry: EntryReader, predicate: URIRef, name: str) -> str:
    what = f'ab:{local(predicate)} of parameter "{name}"'
    return query_of(entry, entry.text(predicate, ""), what, "SELECT", name)


def _units(entry: EntryReader) -> Iterator[tuple[str, float]]:
    """The words that a number may carry, written as "hours=60"."""
    for unit in entry.texts(AB.unit):
        word, _, by = unit.partition("=")
        try:
            yield word, float(by)
        except ValueError:
            problem = f'ab:unit "{unit}" needs a word and a number'
            entry.note(problem, 'write it as in "hours=60"')


def _attribute(entry: EntryReader) -> Iterator[AttributeRequirement]:
    of, value, message = entry.text(AB.of), entry.value(AB.value), entry.text(AB.message)
    if entry.text(AB.ask, ""):
        entry.note("an ab:requires has both ab:attribute and ab:ask", "make two of it")
    if value is None:
        entry.note("an ab:requires with ab:attribute needs ab:value", "add it, such as true")
        return
    assume = entry.value(AB.ifUnknown) == AB.holds
    yield AttributeRequirement(of, entry.iri(AB.attribute), value, message, assume)


def _condition(entry: EntryReader) -> Condition:
    source = entry.text(AB.ask)
    query = query_of(entry, source, "ab:ask", "ASK")
    about = query_of(entry, entry.text(AB.about, ""), "ab:about", "SELECT")
    return Condition(query, entry.text(AB.message), mentions(query), about, source)


def _called_as(entry: EntryReader) -> Iterator[CalledAs]:
    value, parameter = entry.value(AB.value), entry.text(AB.parameter)
    if value is None:
        entry.note("an ab:calledAs needs ab:value", "add it, such as true")
        return
    yield CalledAs(entry.texts(AB.alias), parameter, value)


def _effect(entry: EntryReader) -> Effect | None:
    text = one_newline(entry.text(AB.effect, ""))
    if not text or refused_dollars(entry, text, "ab:effect"):
        return None
    if len(text) > LONGEST:
        entry.note(f"ab:effect has more than {LONGEST:,} characters", "make it shorter")
        return None
    prefixes = prefixed(entry.graph, text)
    form = "write DELETE {…} INSERT {…} WHERE {…}"
    try:
        deletes, inserts, where = split_update(text)
    except ValueError as problem:
        entry.note(f"ab:effect {problem}", form)
        return None
    names = " ".join(f"?{name}" for name in sorted(variables(text)))
    select = f"{prefixes}SELECT {names or '*'} WHERE {{ {where}\n}}"
    if valid(entry, select, "ab:effect") is None:
        return None
    try:
        templates = template(prefixes, deletes), template(prefixes, inserts)
    except ValueError as problem:
        entry.note(f"ab:effect is no valid SPARQL: {problem}", form)
        return None
    changed = mentions(prefixes + deletes) | mentions(prefixes + inserts)
    return Effect(text.strip(), select, *templates, changed | _bound_predicates(prefixes, where))


def _bound_predicates(prefixes: str, where: str) -> frozenset[URIRef]:
    """Predicates that an effect may change through a variable: those its VALUES rows name."""
    rows = " ".join(re.findall(r"VALUES[^{]*\{([^}]*)\}", where, re.IGNORECASE))
    return mentions(prefixes + rows)


def _check_action(
    entry: EntryReader,
    action: Action,
    properties: Mapping[URIRef, Property],
    declared: Collection[URIRef],
) -> None:
    names = [part.text(AB.name) for part in _parameters(entry)]
    these = f"its parameters are {', '.join(names)}" if names else "it has no parameter"
    for twice in sorted({name for name in names if name and names.count(name) > 1}):
        entry.note(f'has two parameters named "{twice}"', "rename one")
    for need in action.attributes:
        if need.of not in names:
            entry.note(f'ab:of "{need.of}" is none of its parameters', these)
        if need.prop and need.prop not in declared:
            text = f"ab:attribute {local(need.prop)} is not declared in domain.ttl"
            entry.note(text, _declare(need.prop, declared), local(need.prop))
        elif need.prop in properties and properties[need.prop].graph == "state":
            text = f"ab:attribute {local(need.prop)} is a state, which is never asked for"
            entry.note(text, "write a condition with ab:ask instead")
    for called in action.called_as:
        if called.parameter not in names:
            entry.note(f'ab:parameter "{called.parameter}" is none of its parameters', these)
    for predicate in changed(action.effect):
        if predicate not in declared:
            text = f"ab:effect: {local(predicate)} is not declared in domain.ttl"
            entry.note(text, _declare(predicate, declared), local(predicate))
    purposes = (action.purpose,) if action.purpose else ()
    for condition in (*action.conditions, *action.advises, *purposes):
        check_message(entry, condition.message, names)
    for need in action.attributes:
        check_message(entry, need.message, names)
    check_queries(entry, _parameters(entry), names)
    check_effect(entry, action.effect, names, properties)


def _declare(iri: URIRef, declared: Collection[URIRef]) -> str:
    return nearest_remedy(local(iri), map(local, declared), "declare it there as an rdf:Property")


def _check_names(found: Collection[EntryReader], actions: Mapping[str, Action]) -> None:
    """Note every other name that means two actions."""
    owners: dict[str, Action] = dict(actions)
    files = {entry.node: entry for entry in found}
    for action in actions.values():
        called = (name for names in action.called_as for name in names.names)
        for name in (*action.aliases, *called):
            other = owners.setdefault(name, action)
            if other is not action and action.iri != NOTHING:
                text = f'its other name "{name}" means {other.name} too'
                files[action.iri].note(text, "take it from one of them")


def changed(effect: Effect | None) -> list[URIRef]:
    """The predicates that an effect changes, but for those that a variable stands for."""
    triples = (*effect.deletes, *effect.inserts) if effect else ()
    return sorted({predicate for _, predicate, _ in triples if isinstance(predicate, URIRef)})
