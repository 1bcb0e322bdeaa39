"""Actions on a domain's page: parameters, requirements and effects in words and in SPARQL."""

from collections.abc import Iterator

from rdflib import Literal, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, AttributeRequirement, Effect, Parameter
from adaptbot_cli.core.handbook.markdown import code, listed, must, said, sparql
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.terms import Triple, local


def action_lines(action: Action, kg: Kg) -> Iterator[str]:
    """Give the lines of an action's section."""
    names = [p.name if p in action.required else f"[{p.name}]" for p in action.visible]
    yield from (f"### `{action.name}({', '.join(names)})`", "")
    yield from (f"{said(action.explain)[:1].upper()}{said(action.explain)[1:]}.", "")
    yield from _other_names(action, kg)
    for parameter in action.parameters:
        yield f"- {code(parameter.name)}: {_parameter(parameter, kg)}"
    yield from ("",) if action.parameters else ()
    if action.attributes or action.conditions:
        yield from ("**Requires**", "")
        for need in action.attributes:
            yield from (f"- {_attribute(need, kg)}", "")
        for condition in action.conditions:
            yield from must(condition.source, condition.message)
    if action.advises:
        yield from ("**Warns**", "")
        for condition in action.advises:
            yield from must(condition.source, condition.message)
    if action.effect is None:
        yield from ("**Changes** nothing.", "")
        return
    yield from ("**Changes**", "")
    yield from (*(f"- {line}" for line in _effect(action, action.effect, kg)), "")
    yield from (*sparql(action.effect.update), "")


def _other_names(action: Action, kg: Kg) -> Iterator[str]:
    if action.aliases:
        yield from (f"Also called {listed(action.aliases)}.", "")
    for called in action.called_as:
        value = _value(called.value, action, kg)
        told = f"{listed(called.names)} sets {code(called.parameter)} to {value}"
        yield from (f"{told}.", "")
    if action.purpose is not None:
        yield from (f"Left out where “{said(action.purpose.message)}”.", "")


def _parameter(parameter: Parameter, kg: Kg) -> str:
    kinds = kg.domain.kinds
    labels = [kinds[iri].label if iri in kinds else local(iri) for iri in parameter.classes]
    what = " or ".join(map(said, labels)) or code(local(parameter.datatype or URIRef("")))
    notes = []
    if parameter.hidden:
        notes.append("never written, found by the tool")
    elif parameter.default:
        notes.append("may be left out: the likeliest is taken")
    elif parameter.optional:
        notes.append("may be left out")
    if parameter.instead:
        notes.append(f"another thing {said(parameter.instead_means)}")
    words = ", ".join(f"{code(word)}" for word in parameter.words)
    notes += [f"written as {words}"] if words else []
    return f"{what} ({'; '.join(notes)})" if notes else what


def _attribute(need: AttributeRequirement, kg: Kg) -> str:
    prop = kg.domain.properties.get(need.prop)
    label = prop.label if prop is not None else local(need.prop)
    wanted = {True: "yes", False: "no"}.get(need.value.toPython(), local(need.value))  # type: ignore[attr-defined]
    unknown = "taken to hold" if need.assume else "asked"
    told = f"{code(need.of)}: {said(label)} ({code(local(need.prop))}) is {wanted}"
    return f"{told}; if unknown, it is {unknown}; or else “{said(need.message)}”"


def _effect(action: Action, effect: Effect, kg: Kg) -> Iterator[str]:
    """What a template takes away and adds; one line, with an arrow, for a value replaced."""
    replaced = {t[:2] for t in effect.deletes} & {t[:2] for t in effect.inserts}
    for triple in effect.deletes:
        if triple[:2] not in replaced:
            yield f"no longer: {_fact(triple, '=', action, kg)}"
    for triple in effect.inserts:
        yield _fact(triple, "→" if triple[:2] in replaced else "=", action, kg)


def _fact(triple: Triple, sign: str, action: Action, kg: Kg) -> str:
    subject, predicate, value = triple
    known = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
    label = said(known.label) if known is not None else _value(predicate, action, kg)
    return f"{_value(subject, action, kg)} · {label} {sign} {_value(value, action, kg)}"


def _value(node: Node, action: Action, kg: Kg) -> str:
    """A node of a template: a parameter, what the query finds, the robot, a value."""
    if isinstance(node, Variable):
        if str(node) == "agent":
            return "the robot"
        return code(str(node)) if _is_parameter(node, action) else f"*{said(str(node))}*"
    if isinstance(node, Literal) and isinstance(node.value, bool):
        return "yes" if node.value else "no"
    return code(kg.name(node))


def _is_parameter(node: Variable, action: Action) -> bool:
    return any(parameter.name == str(node) for parameter in action.parameters)
