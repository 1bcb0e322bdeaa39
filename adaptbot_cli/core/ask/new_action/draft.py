"""An action as far as a person has described it, in words and as the triples of actions.ttl."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from string import Formatter

from rdflib import RDF, RDFS, Graph, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.ask.learning import entity_iri, safe_name
from adaptbot_cli.core.domain import (
    Action,
    AttributeRequirement,
    CalledAs,
    Condition,
    Domain,
    Parameter,
)
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.sparql import SKIP, prefixes_of, split_update, variables
from adaptbot_cli.core.graph.terms import AB, FALSE, TRUE, Triple, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.pack.actions import read_action

_PART = re.compile(rf"({SKIP})|\?(\w+)|(\s+)", re.DOTALL)
_PURPOSE = re.compile(r"(.*\bmust\b.*?) (?:to|before) .*", re.DOTALL)


def renamed(text: str, names: Mapping[str, str]) -> str:
    """Return a query on one line, its variables renamed and its comments left out."""

    def part(match: re.Match[str]) -> str:
        if match[1]:
            return "" if match[1].startswith("#") else match[1]
        return f"?{names.get(match[2], match[2])}" if match[2] else " "

    return re.sub(r" +", " ", _PART.sub(part, text)).strip()


def adapted(text: str, names: Mapping[str, str], taken: Collection[str]) -> str:
    """Return a query with its parameters renamed; its own variables never become parameters.

    `taken` are the names that its own variables must not have.
    """
    own = variables(text) - names.keys() - {"agent"}
    used = {*taken, *names.values(), *own}
    clear = dict(names)
    for name in sorted(own & {*taken, *names.values()}):
        free = (f"{name}_{n}" for n in range(2, 10_000))
        clear[name] = next(new for new in free if new not in used)
        used.add(clear[name])
    return renamed(text, clear)


def together(updates: Sequence[str], parameters: Collection[str]) -> str:
    """Return one update that does what several do.

    Each has variables of its own, all but the parameters and the robot.
    """
    groups: list[tuple[str, str, str]] = []
    taken: set[str] = set()
    shared = {name: name for name in parameters}
    for update in updates:
        clear = adapted(update, shared, taken)
        taken |= variables(clear) - {*parameters, "agent"}
        groups.append(split_update(clear))
    deletes, inserts, where = zip(*groups, strict=True)
    parts = [_group("DELETE", deletes, " . "), _group("INSERT", inserts, " . ")]
    return " ".join([*filter(None, parts), _group("WHERE", where, " ") or "WHERE {}"])


def _group(keyword: str, groups: Sequence[str], between: str) -> str:
    inside = between.join(g.strip().removesuffix(".").strip() for g in groups if g.strip())
    return f"{keyword} {{ {inside} }}" if inside else ""


def unprefixed(query: str) -> str:
    """Return a query as the domain's files have it: without the PREFIX lines added on reading."""
    return re.sub(r"^(?:PREFIX\s+\w*:\s*<[^>]*>\s*)+", "", query)


def prefixes(domain: Domain) -> dict[str, str]:
    """Return the prefixes that the queries of the domain's actions use."""
    texts = [c.query for action in domain.actions.values() for c in action.conditions]
    texts += [a.effect.select for a in domain.actions.values() if a.effect]
    texts += [p.default for a in domain.actions.values() for p in a.parameters]
    return {name: iri for text in texts for name, iri in prefixes_of(text).items()}


def short(iri: URIRef, spaces: Mapping[str, str]) -> str:
    """Return an IRI as a query has it: by a prefix, where one fits."""
    for prefix, space in sorted(spaces.items()):
        end = iri.removeprefix(space)
        if iri.startswith(space) and re.fullmatch(r"\w+", end):
            return f"{prefix}:{end}"
    return iri.n3()


def clause(message: str) -> str:
    """Return the requirement in a message, without its purpose, which is that of another action."""
    found = _PURPOSE.fullmatch(message)
    return found[1] if found else message


UNLESS = "not so that "
"""What begins the words of a requirement that only its failing has a sentence for."""


@dataclass(frozen=True, slots=True)
class Need:
    """Something that must hold: an attribute that an argument must have, or a SPARQL `ask`.

    `words` says it with the names of parameters in braces; `brings` are hidden parameters that it
    speaks of and that the action does not have yet.
    """

    words: str
    message: str
    attribute: AttributeRequirement | None = None
    ask: str = ""
    brings: tuple[Parameter, ...] = ()

    @property
    def names(self) -> set[str]:
        """The parameters that it speaks of, in its words or in its query."""
        return fields(self.words) | variables(self.ask)


@dataclass(frozen=True, slots=True)
class DraftEffect:
    """Something that is different afterwards: a SPARQL update, and what it comes to in `words`.

    Of two changes of the same `what` only one can be meant.
    """

    words: str
    update: str
    what: str = ""


@dataclass(frozen=True, slots=True)
class Draft:
    """A new action: what it takes, requires and changes. Without changes its effect is not known.

    `like` is the known one that it was copied from.
    """

    name: str
    parameters: tuple[Parameter, ...] = ()
    needs: tuple[Need, ...] = ()
    changes: tuple[DraftEffect, ...] = ()
    like: str = ""

    @property
    def visible(self) -> tuple[Parameter, ...]:
        """The parameters that a plan writes."""
        return tuple(p for p in self.parameters if not p.hidden)

    def toggled_need(self, need: Need) -> "Draft":
        """Return the draft with one requirement more, or without it if it is there."""
        kept = tuple(n for n in self.needs if n.words != need.words)
        if len(kept) < len(self.needs):
            return replace(self, needs=kept)._without_idle()
        brought = tuple(p for p in need.brings if p.name not in {q.name for q in self.parameters})
        return replace(
            self, needs=(*kept, need), parameters=(*self.parameters, *brought)
        )._without_idle()

    def toggled_change(self, change: DraftEffect) -> "Draft":
        """Return the draft with one change more, or without it if it is there."""
        kept = tuple(c for c in self.changes if c.words != change.words)
        if len(kept) == len(self.changes):
            kept = (*(c for c in kept if not c.what or c.what != change.what), change)
        return replace(self, changes=kept)

    def without(self, name: str) -> "Draft":
        """Return the draft without a parameter and whatever speaks of it."""
        return replace(
            self,
            parameters=tuple(p for p in self.parameters if p.name != name),
            needs=tuple(n for n in self.needs if name not in n.names),
            changes=tuple(c for c in self.changes if name not in fields(c.words)),
        )._without_idle()

    def _without_idle(self) -> "Draft":
        """Leave out hidden parameters that nothing speaks of."""
        spoken = {name for need in self.needs for name in need.names}
        spoken |= {name for c in self.changes for name in fields(c.words) | variables(c.update)}
        spoken |= {name for p in self.parameters for name in variables(p.default) - {p.name}}
        kept = tuple(p for p in self.parameters if not p.hidden or p.name in spoken)
        return replace(self, parameters=kept)


def fields(words: str) -> set[str]:
    """Return the parameters that a sentence names in braces."""
    return {name for _, name, _, _ in Formatter().parse(words) if name}


def from_action(name: str, action: Action, domain: Domain) -> Draft:
    """Return a draft that takes, requires and changes what a known action does."""
    needs = [need_of(part, domain, {}) for part in action.attributes]
    needs += [condition(part, {}) for part in action.conditions]
    changes: list[DraftEffect] = []
    if action.effect is not None:
        words = (
            "; ".join(_effect_words(action, domain))
            or f"what {action.name} changes: {action.explain}"
        )
        changes.append(DraftEffect(words, renamed(action.effect.update, {})))
    parameters = tuple(_plain(p) for p in action.parameters)
    return Draft(name, parameters, tuple(needs), tuple(changes), action.name)


def need_of(part: AttributeRequirement, domain: Domain, names: Mapping[str, str]) -> Need:
    """Return an attribute requirement of a known action, with its parameter renamed."""
    of = names.get(part.of, part.of)
    message = again(part.message, {part.of: of})
    if fields(message) - {of}:
        message = f"{{{of}}} will not do"
    words = state_words(of, part.prop, part.value, domain)
    return Need(words, message, replace(part, of=of, message=message))


def condition(part: Condition, names: Mapping[str, str], ask: str = "") -> Need:
    """Return a condition of a known action; `ask` is its query with the parameters renamed."""
    message = again(clause(part.message), names)
    return Need(_wanted(message), message, ask=ask or renamed(part.source, {}))


def _wanted(message: str) -> str:
    """The requirement behind the sentence of its failure: "{rec} is not empty"."""
    if " must " in message:
        return message
    match = re.fullmatch(r"(\{\w+\} is) (\w+)", message)
    return f"{match[1]} not {match[2]}" if match else f"{UNLESS}{message}"


def state_words(of: str, prop: URIRef, value: Node, domain: Domain) -> str:
    """Say that an attribute or state of a parameter has a value: "{obj}: sliced"."""
    label = domain.properties[prop].label
    return f"{{{of}}}: {label}" if value == TRUE else f"{{{of}}}: not {label}"


def _effect_words(action: Action, domain: Domain) -> Iterable[str]:
    """The states that an action's effect sets, in words."""
    names = {p.name for p in action.parameters}
    for subject, prop, value in action.effect.inserts if action.effect else ():
        known = domain.properties.get(prop)  # type: ignore[call-overload]
        if known is None or str(subject) not in names or isinstance(value, URIRef):
            continue
        if value in (TRUE, FALSE):
            yield state_words(str(subject), known.iri, value, domain)


def _plain(parameter: Parameter) -> Parameter:
    """A parameter with its queries as the domain's files have them."""
    return replace(
        parameter,
        default=renamed(unprefixed(parameter.default), {}),
        instead=renamed(unprefixed(parameter.instead), {}),
        of_product="",
    )


def plain(words: str) -> str:
    """Return a sentence about parameters with their own names: what is kept of it."""
    return again(words, {}).replace("{", "").replace("}", "")


def in_words(texts: Iterable[str], examples: Mapping[str, str]) -> list[str]:
    """Fill sentences about parameters with the things of an example."""
    return [text.format_map(_ExampleNames(examples)) for text in texts]


def again(words: str, names: Mapping[str, str]) -> str:
    """Rename the parameters that a sentence names in braces."""
    return words.format_map({name: f"{{{names.get(name, name)}}}" for name in fields(words)})


class _ExampleNames(dict[str, str]):
    """Names of examples; a parameter that has none stands for itself."""

    def __missing__(self, name: str) -> str:
        return f"the {name}"


def signature(name: str, parameters: Sequence[Parameter]) -> str:
    """Write an action with the parameters that a plan writes: `slice(obj, tool?)`."""
    lines = (p.name + ("?" if p.optional or p.default else "") for p in parameters if not p.hidden)
    return f"{name}({', '.join(lines)})"


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
