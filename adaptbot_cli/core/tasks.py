"""From what a person asks for to a task with required items."""

from collections.abc import Iterable
from dataclasses import replace

from adaptbot_cli.core import resolve
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import affirmed, normal, singulars, words
from adaptbot_cli.core.plan import Parsed, Task
from adaptbot_cli.core.scene import Scene

_LONGEST_NAME = 3
"""How many words of a request may name one item."""


def task_for(text: str, kg: Kg, requires: Iterable[str] = ()) -> Task:
    """Return the task that a request means: one that the domain lists, or a new one.

    `requires` adds required items. A task that is not listed requires the known items that its
    name tells: "cheese sandwich" requires cheese, "salad with tomato" tomato.
    """
    task = listed(text, kg) or Task(" ".join(words(text)) or text.strip(), _told(text, kg))
    extra = [normal(name) for name in requires if name.strip()]
    unwanted = set(words(text)) - set(affirmed(text))
    wanted = (name for name in (*task.required, *extra) if not unwanted & set(words(name)))
    return replace(task, required=tuple(dict.fromkeys(wanted)))


def listed(text: str, kg: Kg) -> Task | None:
    """Return the task of the domain that a request means: "make an omelette" is the omelette."""
    key = content(text, kg)
    return next((t for name, t in kg.domain.task_names.items() if content(name, kg) == key), None)


def content(text: str, kg: Kg) -> tuple[str, ...]:
    """Return the words of a request that carry meaning, without plurals."""
    kept = (word for word in affirmed(text) if word not in kg.domain.fillers)
    return tuple((singulars(word) or (word,))[0] for word in kept)


def modifiers(text: str, kg: Kg) -> tuple[str, ...]:
    """Return the words of a request that say what goes into it, rather than what it is.

    In English the last word before "with" is the thing made, unless the first is what is done to
    it: "cheese sandwich" is made of cheese, "fry the egg" of egg. Where a domain makes nothing, the
    last word names a thing as well: "water the orchid".
    """
    parts = affirmed(text)
    cut = parts.index("with") if "with" in parts else len(parts)
    before = [word for word in parts[:cut] if word not in kg.domain.fillers]
    after = [word for word in parts[cut + 1 :] if word not in kg.domain.fillers]
    scene = Scene(kg, Task(text))
    if len(before) > 1 and resolve.action(before[0], scene).action is not None:
        return (*before[1:], *after)
    return (*(before[:-1] if kg.domain.products else before), *after)


def _told(text: str, kg: Kg) -> tuple[str, ...]:
    """The known items that a request tells, its last word too if there is no other."""
    found = _items(modifiers(text, kg), kg)
    head = [word for word in affirmed(text) if word not in kg.domain.fillers][-1:]
    return found or _items(tuple(head), kg)


def _items(told: tuple[str, ...], kg: Kg) -> tuple[str, ...]:
    classes = [iri for iri in kg.domain.kinds if str(iri) in _goal_classes(kg)]
    found: list[str] = []
    start = 0
    while start < len(told):
        for length in range(_LONGEST_NAME, 0, -1):
            name = "_".join(told[start : start + length])
            meant = [e for e in kg.find(name) if kg.is_a(e, classes)]
            if meant:
                found.append(kg.name(meant[0]))
                start += length - 1
                break
        start += 1
    return tuple(dict.fromkeys(found))


def _goal_classes(kg: Kg) -> set[str]:
    return {iri for goal in kg.domain.goals for iri in goal.classes}


def with_told(task: Task, parsed: Parsed, kg: Kg) -> Task:
    """Return the task with those items required that its own words and its plan both name."""
    if task.known:
        return task
    told = set(modifiers(task.name, kg))
    args = (normal(arg) for written in parsed.calls for arg in written.call.args)
    named = [arg for arg in args if arg in told and arg not in task.required]
    return replace(task, required=tuple(dict.fromkeys((*task.required, *named))))
