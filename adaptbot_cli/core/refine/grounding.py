"""From one call to a ground action, without running it: action, arguments, kinds, attributes."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action, AttributeRequirement, CalledAs, Parameter
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.robots import held_by_another
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.names import a, normal
from adaptbot_cli.core.plan import Call, Change, Finding, Parsed
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.report import GroundAction
from adaptbot_cli.core.request.understand import doubtful
from adaptbot_cli.core.scene import Scene


@dataclass(frozen=True, slots=True)
class Sound:
    """A call as understood: its ground action, or the findings that prevent one.

    `states` are states that the call's wording implies of its items; `dropped` is the name for
    whose sake the step is dropped, if it is; `action` what was meant, if that much is known.
    """

    call: Call
    ground: GroundAction | None
    changes: tuple[Change, ...] = ()
    findings: tuple[Finding, ...] = ()
    states: tuple[tuple[URIRef, URIRef], ...] = ()
    dropped: str = ""
    action: Action | None = None


def understand(call: Call, scene: Scene) -> Sound:
    """Resolve a call's names by the remedies and check what holds of them at any time."""
    aside = _aside(call, scene)
    if aside and not any(scene.requires(arg) for arg in call.args):
        return Sound(call, None, dropped=aside)
    named = resolve.action(call.action, scene)
    if named.action is None:
        findings = dict.fromkeys((named.finding, *_argument_findings(call, scene)))
        return Sound(call, None, findings=tuple(f for f in findings if f))
    action, kind_change = _of_the_items_kind(named.action, call, scene)
    call, left_out = _without_aside(call, action, scene)
    changes = tuple(change for change in (named.change, kind_change, left_out) if change)
    return _bind(action, call, scene, changes, named.fixed)


def _aside(call: Call, scene: Scene) -> str:
    if scene.sets_aside(call.action, "action"):
        return call.action
    return next((arg for arg in call.args if scene.sets_aside(arg, "item")), "")


def _without_aside(call: Call, action: Action, scene: Scene) -> tuple[Call, Change | None]:
    """The call without an argument that is not there and that the action can do without."""
    for arg, parameter in zip(call.args, action.visible, strict=False):
        if (parameter.optional or parameter.default) and scene.sets_aside(arg, "item"):
            args = tuple(other for other in call.args if other != arg)
            why = f"{arg} is not known here, and {action.name} finds its own {parameter.name}"
            return Call(call.action, args), Change(arg, "left out", "default", why)
    return call, None


def _argument_findings(call: Call, scene: Scene) -> Iterator[Finding]:
    """What is unknown among the arguments of an unknown action."""
    things = tuple(scene.domain.classes)
    for arg in call.args:
        if number(arg) is None:
            named = resolve.item(arg, things, scene)
            if named.finding is not None:
                yield named.finding


def _of_the_items_kind(action: Action, call: Call, scene: Scene) -> tuple[Action, Change | None]:
    """The action of the same family that takes the kind of thing that the first item is."""
    if not action.family or not call.args or not action.parameters:
        return action, None
    entity = resolve.item(call.args[0], action.parameters[0].classes, scene).entity
    if entity is None or scene.kg.is_a(entity, action.parameters[0].classes):
        return action, None
    for other in scene.domain.actions.values():
        if other.family == action.family and scene.kg.is_a(entity, other.parameters[0].classes):
            why = f"{scene.kg.name(entity)} is {a(scene.kg.kind_label(entity))}"
            return other, Change(action.name, other.name, "kind", why)
    return action, None


def _bind(
    action: Action,
    call: Call,
    scene: Scene,
    changes: tuple[Change, ...],
    fixed: tuple[CalledAs, ...] = (),
) -> Sound:
    values: dict[str, Node] = {}
    findings: list[Finding] = []
    found_changes = list(changes)
    states: list[tuple[URIRef, URIRef]] = []
    slots = _open(action, call, fixed)
    for arg in call.args:
        read = _argument(arg, slots, scene)
        if (read is None or read.finding) and _no_use(arg, action, slots, scene):
            why = f"{action.name} takes no number"
            found_changes.append(Change(arg, "left out", "default", why))
            continue
        if read is None:
            most = f"{action.name} takes at most {len(action.visible)}, not {len(call.args)}"
            findings.append(Finding("E102", most, action.name))
            break
        slots = slots[slots.index(read.parameter) + 1 :]
        if read.finding is not None:
            findings.append(read.finding)
        elif read.value is not None:
            values[read.parameter.name] = read.value
        if read.named.change is not None and read.named.change not in found_changes:
            found_changes.append(read.named.change)
        states += [(read.named.entity, p) for p in read.named.states if read.named.entity]
    values |= {part.parameter: part.value for part in fixed}
    lacking = [p.name for p in slots if p in action.required and p.name not in values]
    if lacking:
        text = f"{action.name} needs {' and '.join(lacking)} as well"
        findings.append(Finding("E102", text, action.name))
    ground = GroundAction(action, values)
    failing = attribute_findings(ground, scene.kg)
    findings += [_not_meant(f, found_changes, action, scene) for f in failing]
    # Nobody need say what an unknown name is that is excluded.
    asked = (f for f in findings if f.code != "E201" or not scene.excludes(f.subject))
    once = tuple(dict.fromkeys((*_excluded(call, ground, scene), *asked)))
    if once:
        return Sound(call, None, tuple(found_changes), once, action=action)
    proper = render(ground, scene.kg)
    return Sound(proper, ground, tuple(found_changes), states=tuple(states))


def _not_meant(finding: Finding, changes: list[Change], action: Action, scene: Scene) -> Finding:
    """A thing that words put in and that an attribute rules out was not meant after all."""
    for change in changes:
        if (
            change.by in resolve.BY_WORDS
            and finding.code == "E302"
            and change.target == finding.subject
        ):
            classes = tuple(c for p in action.visible for c in p.classes)
            changes.remove(change)
            return resolve.unknown_item(change.source, classes, scene)
    return finding


def _excluded(call: Call, ground: GroundAction, scene: Scene) -> Iterator[Finding]:
    """What the request rules out among the things of a call, known or not."""
    for arg in call.args:
        if not scene.kg.find(arg) and scene.excludes(arg):
            yield Finding("E505", scene.excludes(arg), arg)
    for value in ground.values.values():
        name, why = scene.kg.name(value), scene.excluded(value)
        if why:
            yield Finding("E505", why, name)
        elif (prop := doubtful(value, scene.task, scene.kg)) is not None:
            label = scene.domain.label(prop)
            message = f"it is not known whether {name} is {label}, which is excluded"
            yield Finding("E301", message, name, prop=local(prop))


def _no_use(arg: str, action: Action, slots: list[Parameter], scene: Scene) -> bool:
    """Whether an argument is a number for an action of things that has all it needs without.

    It may have a unit that some action knows: "2 pots" are no number.
    """
    found = number(arg)
    if found is None or any(p.datatype is not None for p in action.visible):
        return False
    units = {u for a in scene.domain.actions.values() for p in a.parameters for u in p.units}
    if found[1] and found[1] not in units:
        return False
    return all(p.optional or p.default for p in slots)


def _open(action: Action, call: Call, fixed: tuple[CalledAs, ...]) -> list[Parameter]:
    """The parameters that a call's arguments are for: not those that its name fixes, unless the
    call writes them all the same."""
    found = [p for p in action.visible if p.name not in {part.parameter for part in fixed}]
    return found if len(call.args) <= len(found) else list(action.visible)


@dataclass(frozen=True, slots=True)
class _Read:
    """One argument as read for one parameter."""

    parameter: Parameter
    value: Node | None
    named: resolve.Named
    finding: Finding | None


def _argument(arg: str, slots: list[Parameter], scene: Scene) -> _Read | None:
    """Read an argument for the first open parameter that it fits, or for the first at all."""
    if not slots:
        return None
    first = _read(arg, slots[0], scene)
    if first.finding is None or not (slots[0].optional or slots[0].default):
        return first
    others = (_read(arg, slot, scene) for slot in slots[1:])
    return next((read for read in others if read.finding is None), first)


def _read(arg: str, parameter: Parameter, scene: Scene) -> _Read:
    if parameter.datatype is not None:
        return _read_value(arg, parameter, scene)
    named = resolve.item(arg, parameter.classes, scene)
    finding = named.finding
    if named.entity is not None and not scene.kg.is_a(named.entity, parameter.classes):
        finding = _wrong_kind(arg, named.entity, parameter, scene)
    return _Read(parameter, named.entity, named, finding)


def _read_value(arg: str, parameter: Parameter, scene: Scene) -> _Read:
    """Read a number or a word; what has no number is a placeholder if the domain has a default."""
    value = _value(arg, parameter)
    if value is not None:
        change = None
        if str(value) != arg and not parameter.words:
            change = Change(arg, str(value), "unit", f"in {parameter.name}, {arg} is {value}")
        return _Read(parameter, value, resolve.Named(change=change), None)
    default = scene.kg.first(parameter.default, parameter.name, {}) if parameter.default else None
    if default is None or any(character.isdigit() for character in arg):
        return _Read(parameter, None, resolve.Named(), _no_value(arg, parameter))
    why = f'"{arg}" says no number of {parameter.name}'
    change = Change(arg, str(default), "default", why)
    return _Read(parameter, default, resolve.Named(change=change), None)


def _value(arg: str, parameter: Parameter) -> Node | None:
    if parameter.words:
        return parameter.words.get(normal(arg))
    found = number(arg)
    if found is None or (found[1] and found[1] not in parameter.units):
        return None
    if not found[1]:
        return Literal(found[0], datatype=parameter.datatype)
    amount = float(found[0]) * parameter.units[found[1]]
    return Literal(f"{amount:g}", datatype=parameter.datatype)


def number(arg: str) -> tuple[str, str] | None:
    """Return the number and the unit that an argument consists of: "35 min" is ("35", "min")."""
    found = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?)\s*([^\W\d_]*)\.?", arg.strip())
    return (found[1], found[2].lower()) if found else None


def _no_value(arg: str, parameter: Parameter) -> Finding:
    if parameter.words:
        options = " or ".join(parameter.words)
        return Finding("E103", f'"{arg}" is not {options}', arg, candidates=tuple(parameter.words))
    return Finding("E103", f'"{arg}" is not a number of {parameter.name}', arg)


def _wrong_kind(arg: str, entity: URIRef, parameter: Parameter, scene: Scene) -> Finding:
    kinds = [scene.domain.classes[c].label for c in parameter.classes if c in scene.domain.classes]
    name, label = scene.kg.name(entity), scene.kg.kind_label(entity)
    message = f"{name} is {a(label)}, not {a(' or '.join(kinds))}"
    near = resolve.near_items(arg, parameter.classes, scene)
    return Finding("E202", message, name, candidates=tuple(near))


def attribute_findings(ground: GroundAction, kg: Kg) -> list[Finding]:
    """Return the attribute requirements that do not hold, or are not known to hold."""
    findings = []
    for need in ground.action.attributes:
        entity = ground.values.get(need.of)
        if isinstance(entity, URIRef):
            finding = _attribute(need, entity, ground, kg)
            findings += [finding] if finding else []
    return findings or [*_with_another(ground, kg)] or [*_nowhere(ground, kg)]


def _with_another(ground: GroundAction, kg: Kg) -> Iterator[Finding]:
    """What another robot holds: that is out of reach."""
    for thing in ground.values.values():
        fact = held_by_another(kg, thing) if isinstance(thing, URIRef) else None
        if fact is not None:
            robot, held = kg.name(fact[0]), kg.name(fact[2])
            within = f", and {kg.name(thing)} is in it" if fact[2] != thing else ""
            prop = min(map(local, kg.placed_by(fact[2])), default="")
            yield Finding("E402", f"{robot} holds {held}{within}", held, prop=prop)


def _nowhere(ground: GroundAction, kg: Kg) -> Iterator[Finding]:
    """What cannot be fetched, as nobody knows where it is."""
    thing = next(iter(ground.values.values()), None) if ground.action.fetches else None
    props = kg.placed_by(thing) if thing else set()
    if isinstance(thing, URIRef) and props and all(kg.value(thing, p) is None for p in props):
        name = kg.name(thing)
        yield Finding("E301", f"it is not known where {name} is", name, prop=local(min(props)))


def _attribute(
    need: AttributeRequirement, entity: URIRef, ground: GroundAction, kg: Kg
) -> Finding | None:
    values = known_values(kg, entity, need.prop)
    if need.value in values or (need.assume and not values):
        return None
    if values:
        message = sentence(need.message, ground, kg)
        return Finding("E302", message, kg.name(entity), prop=local(need.prop))
    message = f"it is not known whether {kg.name(entity)} is {kg.domain.label(need.prop)}"
    return Finding("E301", message, kg.name(entity), prop=local(need.prop))


def known_values(kg: Kg, entity: URIRef, prop: URIRef) -> set[Node]:
    """Return the values of an attribute, those included that follow from another fact."""
    values = set(kg.facts.objects(entity, prop))
    if values or prop not in kg.domain.properties:
        return values
    implied = kg.domain.properties[prop].implied
    return {i.value for i in implied if (entity, i.prop, i.equals) in kg.facts}


def sentence(message: str, ground: GroundAction, kg: Kg) -> str:
    """Fill the names of a step's items into a message of the domain."""
    names = {p.name: f"a {p.name}" for p in ground.action.parameters}
    names |= {name: kg.name(value) for name, value in ground.values.items()}
    return message.format(**names)


def render(ground: GroundAction, kg: Kg) -> Call:
    """Write a ground action as a call with the home's own names."""
    args = (_word(p, ground.values.get(p.name), kg) for p in ground.action.visible)
    return Call(ground.action.name, tuple(arg for arg in args if arg is not None))


def _word(parameter: Parameter, value: Node | None, kg: Kg) -> str | None:
    if value is None:
        return None
    words = [word for word, meaning in parameter.words.items() if meaning == value]
    if words:
        return words[0]
    return kg.name(value) if isinstance(value, URIRef) else str(value)


def in_order(parsed: Parsed, scene: Scene) -> Parsed:
    """Return a plan whose calls of known actions have their arguments where they are read.

    Everything that looks at a call behind this looks at positions alone.
    """
    calls = (replace(w, call=_ordered(w.call, scene)) for w in parsed.calls)
    return replace(parsed, calls=tuple(calls))


def _ordered(call: Call, scene: Scene) -> Call:
    action = resolve.action(call.action, scene).action if call.names else None
    return call if action is None else Call(call.action, _arguments(call, action))


def _arguments(call: Call, action: Action) -> tuple[str, ...]:
    """The arguments by the action's parameters, those without a name in what is left of these.

    As written, if a name is none of this action's or is given twice.
    """
    names = [normal(name) for name in call.names if name]
    parameters = {normal(p.name): n for n, p in enumerate(action.visible)}
    if len(set(names)) < len(names) or not set(names) <= set(parameters):
        return call.args
    open_ = iter(n for name, n in parameters.items() if name not in names)
    at = [parameters[normal(name)] if name else next(open_, len(parameters)) for name in call.names]
    return tuple(
        arg for _, arg in sorted(zip(at, call.args, strict=True), key=lambda pair: pair[0])
    )
