"""What a new action takes: prefilled from the arguments that a plan has given it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from rdflib import XSD

from adaptbot_cli.core.acting.draft import Draft
from adaptbot_cli.core.domain import Kind, Parameter
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import safe_name
from adaptbot_cli.core.plan import Call
from adaptbot_cli.core.refine.calls import number
from adaptbot_cli.core.terms import local


def drafted(name: str, call: Call, kg: Kg) -> Draft:
    """Return a draft that takes what a call of the action gives it, and does nothing yet."""
    return taking(Draft(name), call, kg)


def taking(draft: Draft, call: Call, kg: Kg) -> Draft:
    """Return a draft with a parameter more for each argument of a call that it has none for."""
    open_ = list(draft.visible)
    parameters = list(draft.parameters)
    for arg in call.args:
        kind = kind_of(arg, kg)
        fitting = [n for n, p in enumerate(open_) if _takes(p, kind)]
        if fitting:
            open_ = open_[fitting[0] + 1 :]
        else:
            parameters.append(parameter_of(kind, parameters, kg))
    return replace(draft, parameters=tuple(parameters))


def _takes(parameter: Parameter, kind: Kind | None) -> bool:
    if kind is None:
        return parameter.datatype is not None
    return bool(set(kind.supers) & set(parameter.classes))


def kind_of(name: str, kg: Kg) -> Kind | None:
    """Return the kind of a known thing; of an unknown one, the kind that the domain asks for first.

    A number has none.
    """
    for entity in kg.find(name):
        for kind in kg.domain.teachable:
            if kg.is_a(entity, [kind.iri]):
                return kind
    return None if number(name) else kg.domain.teachable[0]


def parameter_of(kind: Kind | None, others: Sequence[Parameter], kg: Kg) -> Parameter:
    """Return a parameter that takes things of a kind, or a number, by the domain's usual name."""
    taken = {p.name for p in others}
    base = "number" if kind is None else _usual_name(kind, kg)
    free = (base if n == 1 else f"{base}_{n}" for n in range(1, 100))
    name = next(name for name in free if name not in taken)
    if kind is None:
        return Parameter(name, datatype=XSD.decimal)
    return Parameter(name, (kind.iri,))


def _usual_name(kind: Kind, kg: Kg) -> str:
    """What the domain's actions mostly call what takes just this kind."""
    names = Counter(
        parameter.name
        for action in kg.domain.actions.values()
        for parameter in action.parameters
        if parameter.classes == (kind.iri,) and not parameter.hidden
    )
    return names.most_common(1)[0][0] if names else safe_name(local(kind.iri))
