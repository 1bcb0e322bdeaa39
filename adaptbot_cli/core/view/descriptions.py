"""Actions, tasks and classes as people read them: what they take, need and do."""

import re
from collections.abc import Iterator
from typing import Any

from rdflib import Literal, Variable
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, Domain, ItemClass, Parameter
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import FALSE, TRUE, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.request.understand import listed

_NAMED = re.compile(r"\{(\w+)\}")


def action_called(kg: Kg, name: str) -> Action | None:
    """Return the action of a name or of another name for it."""
    wanted = normal(name)
    actions = kg.domain.actions.values()
    own = next((action for action in actions if normal(action.name) == wanted), None)
    return own or next((a for a in actions if wanted in map(normal, a.names)), None)


def task_called(kg: Kg, name: str) -> Task | None:
    """Return the task of a name or a request, if the domain lists it."""
    return kg.domain.task_names.get(normal(name)) or listed(name, kg)


def action(kg: Kg, found: Action) -> dict[str, Any]:
    """Return what an action takes, requires and changes as a plain object."""
    effect = found.effect
    return {
        "action": found.name,
        "iri": str(found.iri),
        "explain": found.explain,
        "also_called": [*found.names[1:], *kg.aliases(found.iri)],
        "parameters": [_parameter(kg.domain, parameter) for parameter in found.parameters],
        "requires": [
            *(
                {
                    "of": needed.of,
                    "attribute": local(needed.prop),
                    "value": _plain(needed.value),
                    "if_not": plainly(needed.message),
                }
                for needed in found.attributes
            ),
            *(
                {"holds": " ".join(c.query.split()), "if_not": plainly(c.message)}
                for c in found.conditions
            ),
        ],
        "advises": [plainly(condition.message) for condition in found.advises],
        "changes": {
            "removes": [_template(triple) for triple in effect.deletes] if effect else [],
            "adds": [_template(triple) for triple in effect.inserts] if effect else [],
        },
        "afterwards": list(_afterwards(found, kg.domain)),
        "effect_known": effect is not None,
    }


def _parameter(domain: Domain, parameter: Parameter) -> dict[str, Any]:
    classes = map(domain.label, parameter.classes)
    datatype = [local(parameter.datatype)] if parameter.datatype else []
    return {
        "name": parameter.name,
        "takes": [*classes, *datatype],
        "optional": parameter.optional or bool(parameter.default),
        "hidden": parameter.hidden,
    }


def _plain(value: Node) -> Any:
    plain = getattr(value, "value", None)
    return plain if isinstance(plain, bool | int | float | str) else local(value)


def _afterwards(found: Action, domain: Domain) -> Iterator[str]:
    """What is different after an action, in words: "obj: sliced", "obj: place to"."""
    names = {parameter.name for parameter in found.parameters}
    effect, label = found.effect, domain.label

    def called(node: Node) -> str:
        return f"the {local(domain.agent)}" if node == Variable("agent") else str(_plain(node))

    new = {(s, p) for s, p, _ in effect.inserts} if effect else set()
    for s, p, value in effect.inserts if effect else ():
        if value in (TRUE, FALSE):
            yield f"{called(s)}: {'' if value == TRUE else 'not '}{label(p)}"
        elif isinstance(value, Variable) and str(value) not in names:
            yield f"{called(s)}: {label(p)} may change"
        else:
            yield f"{called(s)}: {label(p)} {called(value)}"
    for s, p, value in effect.deletes if effect else ():
        if (s, p) not in new:
            what = "" if isinstance(value, Literal) else f" {called(value)}"
            yield f"{called(s)}: no longer {label(p)}{what}"


def _template(triple: tuple[Node, Node, Node]) -> str:
    return " ".join(f"?{node}" if isinstance(node, Variable) else local(node) for node in triple)


def plainly(message: str) -> str:
    """Return a message of the domain with its parameters by name, where none has a value."""
    return _NAMED.sub(r"\1", message)


def task(found: Task, domain: Domain) -> dict[str, Any]:
    """Return what a task needs and when it is done as a plain object."""
    names = sorted(
        n for n, t in domain.task_names.items() if t == found and n != normal(found.name)
    )
    return {
        "task": found.name,
        "also_called": names,
        "needs": list(found.required),
        "done_unless": [plainly(goal.message) for goal in (*domain.goals, *found.goals)],
    }


def kind(domain: Domain, found: ItemClass) -> dict[str, Any]:
    """Return a class with its comment and questions as a plain object."""
    superclasses = [
        domain.classes[iri].label for iri in found.superclasses[1:] if iri in domain.classes
    ]
    asked = [domain.properties[iri] for iri in found.asks if iri in domain.properties]
    return {
        "class": local(found.iri),
        "label": found.label,
        "about": found.comment,
        "is_a": superclasses,
        "asked": [{"property": local(p.iri), "label": p.label} for p in asked],
    }
