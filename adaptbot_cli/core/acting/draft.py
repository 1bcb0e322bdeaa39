"""An action as far as a person has described it."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from string import Formatter

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.acting.text import clause, renamed, unprefixed
from adaptbot_cli.core.domain import Action, AttributeRequirement, Condition, Domain, Parameter
from adaptbot_cli.core.sparql import variables
from adaptbot_cli.core.terms import TRUE

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
    """What must hold, from the sentence that says that it does not: "{rec} is not empty"."""
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
        if str(known.range).endswith("#boolean") and str(value) in ("true", "false"):
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
