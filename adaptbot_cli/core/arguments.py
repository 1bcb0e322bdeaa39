"""Arguments that a plan names, `put_down(loc="bowl", obj="egg")`, in the order of the action's."""

from dataclasses import replace

from adaptbot_cli.core import resolve
from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Call, Parsed
from adaptbot_cli.core.scene import Scene


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
