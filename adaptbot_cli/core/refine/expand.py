"""Words that stand for other items: "all", what the plan makes, a vessel for its contents.

They are read at the point of the plan where they are written, since what a vessel holds or which
items are together depends on what was done before.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, Parameter
from adaptbot_cli.core.names import normal, sentence_list, words
from adaptbot_cli.core.plan import Call, Change
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.grounding import known_values
from adaptbot_cli.core.scene import Scene


@dataclass(frozen=True, slots=True)
class Meant:
    """The calls that one written call means, and the change that made them of it.

    Without calls the step is not needed, and `dropped` says why.
    """

    calls: tuple[Call, ...]
    change: Change | None = None
    dropped: str = ""


def expand(call: Call, scene: Scene) -> Meant:
    """Return what a call means where an argument stands for other items; else the call itself."""
    action = resolve.action(call.action, scene).action
    pairs = zip(call.args, action.visible, strict=False) if action else ()
    for position, (arg, parameter) in enumerate(pairs):
        found = _stands_for(arg, parameter, action, scene) if action else None
        if found is not None and action is not None:
            return _meant(call, position, action, *found)
    return Meant((call,))


def _meant(call: Call, position: int, action: Action, names: list[str], by: str, why: str) -> Meant:
    if action.fetches and len(names) > 1:
        text = sentence_list(names)
        return Meant((), dropped=f"{why}: {text}, each fetched by the step that uses it")
    arg = call.args[position]
    args = [(*call.args[:position], name, *call.args[position + 1 :]) for name in names]
    change = Change(arg, ", ".join(names), by, why)
    return Meant(tuple(Call(call.action, given) for given in args), change)


Found = tuple[list[str], str, str]


def _stands_for(arg: str, parameter: Parameter, action: Action, scene: Scene) -> Found | None:
    if parameter.datatype is not None:
        return None
    for reading in (_instead, _quantifier, _product):
        found = reading(arg, parameter, action, scene)
        if found is not None and found[0]:
            return found
    return None


def _instead(arg: str, parameter: Parameter, action: Action, scene: Scene) -> Found | None:
    """What the domain puts in the place of a thing that does not fit: the contents of a vessel."""
    known = scene.kg.find(arg)
    if not parameter.instead or not known or any(_does(e, parameter, action, scene) for e in known):
        return None
    rows = scene.kg.rows(parameter.instead, {"given": known[0]})
    entities = {row[parameter.name] for row in rows if parameter.name in row}
    fitting = sorted((e for e in entities if _does(e, parameter, action, scene)), key=str)
    name = scene.kg.name(known[0])
    return [scene.kg.name(e) for e in fitting], "relation", f"{name} {parameter.instead_means}"


def _does(entity: Node, parameter: Parameter, action: Action, scene: Scene) -> bool:
    """Whether a thing is of the kind that a parameter takes and no attribute rules it out."""
    if not isinstance(entity, URIRef) or not scene.kg.is_a(entity, parameter.classes):
        return False
    for need in action.attributes:
        values = known_values(scene.kg, entity, need.prop)
        if need.of == parameter.name and values and need.value not in values:
            return False
    return True


def _quantifier(arg: str, parameter: Parameter, action: Action, scene: Scene) -> Found | None:
    """All required items, those included of which something is not known yet: it is asked."""
    if normal(arg) not in scene.domain.quantifiers:
        return None
    unknown = [item for item in scene.task.required if not scene.kg.find(item)]
    names = [scene.kg.name(entity) for entity in _required(parameter, action, scene)]
    return names + unknown, "quantifier", f'"{arg}" stands for the required items'


def _product(arg: str, parameter: Parameter, action: Action, scene: Scene) -> Found | None:
    """What the plan makes: what holds it, the one item it is named after, or what it is made of."""
    finding = resolve.item(arg, parameter.classes, scene).finding
    if finding is None or finding.code != "E203":
        return None
    holder = (
        scene.kg.first(parameter.of_product, parameter.name, {}) if parameter.of_product else None
    )
    if holder is not None:
        return [scene.kg.name(holder)], "product", f"{arg} is in it"
    parts = words(arg)
    named = [part for part in parts if scene.requires(part) and scene.kg.find(part)]
    if len(named) == 1:
        return [scene.kg.name(scene.kg.find(named[0])[0])], "product", f"{arg} is made of it"
    if not all(scene.kg.find(item) for item in scene.task.required):
        return None  # what it is made of is not all known yet
    fitting = [
        e for e in _required(parameter, action, scene) if _surely(e, parameter, action, scene)
    ]
    names = [scene.kg.name(entity) for entity in fitting]
    return names, "product", f"{arg} is what the required items become"


def _required(parameter: Parameter, action: Action, scene: Scene) -> list[URIRef]:
    """The required items that an action may be done to, as far as is known."""
    found: Iterable[URIRef] = (e for name in scene.task.required for e in scene.kg.find(name)[:1])
    return [e for e in found if _does(e, parameter, action, scene)]


def _surely(entity: URIRef, parameter: Parameter, action: Action, scene: Scene) -> bool:
    """Whether every attribute that an action needs of a thing is known of it."""
    needs = [need for need in action.attributes if need.of == parameter.name and not need.assume]
    return all(known_values(scene.kg, entity, need.prop) for need in needs)
