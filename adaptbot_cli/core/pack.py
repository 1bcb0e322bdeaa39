"""Reads a domain pack's graphs into a `Domain`, naming the entry wherever it cannot."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from string import Formatter

from rdflib import RDF, RDFS, Graph, Literal, URIRef
from rdflib.collection import Collection
from rdflib.term import Node

from adaptbot_cli.core.domain import (
    Action,
    AttributeRequirement,
    CalledAs,
    Condition,
    Domain,
    Effect,
    Implication,
    Kind,
    Parameter,
    Property,
    Start,
)
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Goal, Task
from adaptbot_cli.core.sparql import (
    bindable,
    mentions,
    prefixed,
    split_update,
    template,
    variables,
)
from adaptbot_cli.core.terms import AB, local
from adaptbot_cli.errors import PackError


@dataclass(frozen=True, slots=True)
class Sources:
    """The parsed files of a pack, as one graph each."""

    domain: Graph
    actions: Graph
    tasks: Graph


def read_domain(sources: Sources) -> Domain:
    """Read a domain pack.

    Raises:
        PackError: an entry lacks something or does not make sense; the message names file, entry
            and what to do.
    """
    domain = _Entry.of(sources.domain, "domain.ttl", _the_domain(sources.domain))
    kinds = {iri: _kind(entry) for iri, entry in _entries(sources.domain, "domain.ttl", RDFS.Class)}
    tasks = _tasks(sources.tasks)
    return Domain(
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
        products=frozenset(domain.texts(AB.product)),
        kinds=kinds,
        properties=_properties(sources.domain),
        actions=_actions(sources),
        tasks=tuple(dict.fromkeys(task for _, task in tasks)),
        task_names=dict(tasks),
        goals=_goals(domain, AB.goal),
        advice=_goals(domain, AB.advice),
    )


@dataclass(frozen=True, slots=True)
class _Entry:
    """One node of a pack's file, with readers that complain in sentences."""

    graph: Graph
    file: str
    entry: str
    node: URIRef

    @classmethod
    def of(cls, graph: Graph, file: str, node: Node, entry: str = "") -> "_Entry":
        return cls(graph, file, entry or local(node), node)  # type: ignore[arg-type]

    def fail(self, problem: str) -> PackError:
        return PackError(f"{self.file}, entry {self.entry}: {problem}")

    def value(self, predicate: URIRef) -> Node | None:
        values = sorted(self.graph.objects(self.node, predicate), key=str)
        if len(values) > 1:
            raise self.fail(f"has {len(values)} values for ab:{local(predicate)}; keep one")
        return values[0] if values else None

    def text(self, predicate: URIRef, default: str | None = None) -> str:
        value = self.value(predicate)
        if value is None:
            if default is not None:
                return default
            raise self.fail(f"lacks {_term(predicate)}; add it")
        return str(value)

    def texts(self, predicate: URIRef) -> tuple[str, ...]:
        return tuple(sorted(str(value) for value in self.graph.objects(self.node, predicate)))

    def iri(self, predicate: URIRef) -> URIRef:
        value = self.value(predicate)
        if not isinstance(value, URIRef):
            raise self.fail(f"needs an IRI as {_term(predicate)}")
        return value

    def iris(self, predicate: URIRef) -> tuple[URIRef, ...]:
        values = self.graph.objects(self.node, predicate)
        return tuple(sorted(value for value in values if isinstance(value, URIRef)))

    def maybe_iri(self, predicate: URIRef) -> URIRef | None:
        return None if self.value(predicate) is None else self.iri(predicate)

    def flag(self, predicate: URIRef) -> bool:
        value = self.value(predicate)
        return isinstance(value, Literal) and value.toPython() is True

    def number(self, predicate: URIRef) -> int | None:
        value = self.value(predicate)
        if value is None:
            return None
        if not isinstance(value, Literal) or not isinstance(value.toPython(), int):
            raise self.fail(f"needs a whole number as {_term(predicate)}")
        return int(value.toPython())

    def parts(self, predicate: URIRef) -> tuple["_Entry", ...]:
        """The nodes below `predicate`, by their ab:order, then by their text."""
        nodes = [self._part(node) for node in self.graph.objects(self.node, predicate)]
        return tuple(sorted(nodes, key=_order))

    def listed(self, predicate: URIRef) -> tuple["_Entry", ...]:
        head = self.value(predicate)
        if head is None:
            return ()
        return tuple(self._part(node) for node in Collection(self.graph, head))

    def _part(self, node: Node) -> "_Entry":
        return _Entry.of(self.graph, self.file, node, self.entry)


def _order(entry: _Entry) -> tuple[int, str]:
    return entry.number(AB.order) or 0, " ".join(sorted(map(str, entry.graph.objects(entry.node))))


def _term(predicate: URIRef) -> str:
    prefix = "ab" if predicate.startswith(str(AB)) else "rdfs"
    return f"{prefix}:{local(predicate)}"


def _the_domain(graph: Graph) -> Node:
    found = sorted(graph.subjects(RDF.type, AB.Domain), key=str)
    if len(found) != 1:
        raise PackError(f"domain.ttl: needs exactly one entry typed ab:Domain, has {len(found)}")
    return found[0]


def _entries(graph: Graph, file: str, kind: URIRef) -> Iterator[tuple[URIRef, _Entry]]:
    for node in sorted(graph.subjects(RDF.type, kind), key=str):
        if isinstance(node, URIRef):
            yield node, _Entry.of(graph, file, node)


def _kind(entry: _Entry) -> Kind:
    return Kind(
        iri=entry.node,
        label=entry.text(RDFS.label, local(entry.node)),
        comment=entry.text(RDFS.comment, ""),
        supers=_supers(entry.graph, entry.node),
        name_property=entry.maybe_iri(AB.nameProperty),
        location_property=entry.maybe_iri(AB.locationProperty),
        order=entry.number(AB.kindOrder),
        asks=tuple(part.node for part in entry.listed(AB.asks)),
        starts=tuple(_start(part) for part in entry.parts(AB.starts)),
        prompted=entry.flag(AB.prompted),
    )


def _supers(graph: Graph, node: URIRef) -> tuple[URIRef, ...]:
    found = graph.transitive_objects(node, RDFS.subClassOf)
    return tuple(dict.fromkeys(iri for iri in found if isinstance(iri, URIRef)))


def _start(entry: _Entry) -> Start:
    value = entry.value(AB.value)
    if value is None:
        raise entry.fail("an ab:starts lacks ab:value")
    return Start(entry.iri(AB.property), value, entry.maybe_iri(AB.when))


def _properties(graph: Graph) -> dict[URIRef, Property]:
    return {iri: _property(e) for iri, e in _entries(graph, "domain.ttl", RDF.Property)}


def _property(entry: _Entry) -> Property:
    graph = local(entry.iri(AB.graph))
    if graph not in ("attribute", "state"):
        raise entry.fail("ab:graph must be ab:attribute or ab:state")
    question = entry.text(AB.question, "")
    _check_message(entry, question, ("name",))
    return Property(
        iri=entry.node,
        label=entry.text(RDFS.label, local(entry.node)),
        graph=graph,
        domain=entry.iri(RDFS.domain),
        range=entry.iri(RDFS.range),
        question=question,
        functional=entry.flag(AB.functional),
        state_words=entry.texts(AB.stateWord),
        implied=tuple(_implication(part) for part in entry.parts(AB.impliedBy)),
    )


def _implication(entry: _Entry) -> Implication:
    equals, value = entry.value(AB.equals), entry.value(AB.value)
    if equals is None or value is None:
        raise entry.fail("an ab:impliedBy needs ab:equals and ab:value")
    return Implication(entry.iri(AB.property), equals, value)


def _actions(sources: Sources) -> dict[str, Action]:
    entries = [entry for _, entry in _entries(sources.actions, "actions.ttl", AB.Action)]
    known = set(_properties(sources.domain)) | {RDF.type, RDFS.subClassOf}
    actions = [_action(entry, known) for entry in sorted(entries, key=_order)]
    return {action.name: action for action in actions}


def _action(entry: _Entry, known: set[URIRef]) -> Action:
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


def _parameter(entry: _Entry) -> Parameter:
    name = entry.text(AB.name)
    if not re.fullmatch(r"[a-z][a-z_0-9]*", name):
        raise entry.fail(f'parameter "{name}": a name has small letters, digits and underscores')
    classes, datatype = entry.iris(AB["class"]), entry.maybe_iri(AB.datatype)
    if bool(classes) == bool(datatype):
        raise entry.fail(f'parameter "{name}" needs either ab:class or ab:datatype')
    words = {word: Literal(True) for word in entry.texts(AB.trueWord)}
    words |= {word: Literal(False) for word in entry.texts(AB.falseWord)}
    what = f'ab:default of parameter "{name}"'
    default = _query(entry, entry.text(AB.default, ""), what, "SELECT")
    what = f'ab:instead of parameter "{name}"'
    instead = _query(entry, entry.text(AB.instead, ""), what, "SELECT")
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
    )


def _attribute(entry: _Entry) -> AttributeRequirement:
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


def _condition(entry: _Entry) -> Condition:
    query = _query(entry, entry.text(AB.ask), "ab:ask", "ASK")
    return Condition(query, entry.text(AB.message), mentions(query))


def _purpose(entry: _Entry) -> Condition | None:
    parts = entry.parts(AB.purpose)
    return _condition(parts[0]) if parts else None


def _called_as(entry: _Entry) -> CalledAs:
    value = entry.value(AB.value)
    if value is None:
        raise entry.fail("an ab:calledAs needs ab:value")
    return CalledAs(entry.texts(AB.alias), entry.text(AB.parameter), value)


def _effect(entry: _Entry) -> Effect | None:
    text = entry.text(AB.effect, "")
    if not text:
        return None
    prefixes = prefixed(entry.graph, text)
    try:
        deletes, inserts, where = split_update(text)
    except ValueError as problem:
        raise entry.fail(f"ab:effect {problem}") from None
    names = " ".join(f"?{name}" for name in sorted(variables(text)))
    select = f"{prefixes}SELECT {names or '*'} WHERE {{ {where} }}"
    _valid(entry, select, "ab:effect")
    try:
        templates = template(prefixes, deletes), template(prefixes, inserts)
    except ValueError as problem:
        raise entry.fail(f"ab:effect is no valid SPARQL: {problem}") from None
    changed = mentions(prefixes + deletes) | mentions(prefixes + inserts)
    return Effect(text.strip(), select, *templates, changed | _bound_predicates(prefixes, where))


def _bound_predicates(prefixes: str, where: str) -> frozenset[URIRef]:
    """Predicates that an effect may change through a variable: those its VALUES rows name."""
    rows = " ".join(re.findall(r"VALUES[^{]*\{([^}]*)\}", where))
    return mentions(prefixes + rows)


def _query(entry: _Entry, text: str, what: str, form: str) -> str:
    if not text:
        return ""
    if not re.match(rf"\s*{form}\b", text):
        raise entry.fail(f"{what} must be a SPARQL {form}")
    query = prefixed(entry.graph, text) + text.strip()
    _valid(entry, query, what)
    _valid(entry, bindable(query), what)
    return bindable(query)


def _valid(entry: _Entry, query: str, what: str) -> None:
    problem = syntax_problem(query)
    if problem:
        raise entry.fail(f"{what} is no valid SPARQL: {problem}")


def syntax_problem(query: str) -> str:
    """Return what is wrong with a query's syntax, or nothing."""
    import pyoxigraph

    try:
        pyoxigraph.Store().query(query)
    except SyntaxError as error:
        return " ".join(str(error).split())
    return ""


def _check_action(entry: _Entry, action: Action, known: set[URIRef]) -> None:
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
        _check_message(entry, condition.message, names)
    for need in action.attributes:
        _check_message(entry, need.message, names)


def _changed(effect: Effect | None) -> list[URIRef]:
    """The predicates that an effect changes, but for those that a variable stands for."""
    triples = (*effect.deletes, *effect.inserts) if effect else ()
    return sorted({predicate for _, predicate, _ in triples if isinstance(predicate, URIRef)})


def _check_message(entry: _Entry, message: str, names: Iterable[str]) -> None:
    """Make sure that a message of the domain can be filled in."""
    try:
        fields = [field for _, field, _, _ in Formatter().parse(message) if field is not None]
    except ValueError as problem:
        raise entry.fail(f'the message "{message}" has a brace too many: {problem}') from None
    for name in fields:
        if name not in names:
            only = " or ".join(f"{{{known}}}" for known in names) or "no parameter"
            raise entry.fail(f'the message "{message}" names {{{name}}}; it may name {only}')


def _goals(entry: _Entry, predicate: URIRef) -> tuple[Goal, ...]:
    return tuple(_goal(part) for part in entry.parts(predicate))


def _goal(entry: _Entry) -> Goal:
    classes = tuple(str(iri) for iri in entry.iris(AB["class"]))
    ask = _query(entry, entry.text(AB.ask, ""), "ab:ask", "ASK")
    select = _query(entry, entry.text(AB.select, ""), "ab:select", "SELECT")
    if bool(ask) == bool(select):
        raise entry.fail("a goal needs either ab:ask or ab:select")
    message = entry.text(AB.message)
    _check_message(entry, message, ("item",) if classes or select else ())
    about = _query(entry, entry.text(AB.about, ""), "ab:about", "SELECT")
    return Goal(ask or select, message, classes, about)


def _tasks(graph: Graph) -> list[tuple[str, Task]]:
    """Every task under each of its names, normalised."""
    found: list[tuple[str, Task]] = []
    for _, entry in _entries(graph, "tasks.ttl", AB.Task):
        task = Task(entry.text(RDFS.label), _needs(entry), _goals(entry, AB.goal), known=True)
        names: Iterable[str] = (task.name, *entry.texts(AB.alias))
        found.extend((normal(name), task) for name in names)
    return found


def _needs(entry: _Entry) -> tuple[str, ...]:
    needs = entry.texts(AB.needs)
    if not needs:
        raise entry.fail("lacks ab:needs, the items that the task requires; add at least one")
    return needs


