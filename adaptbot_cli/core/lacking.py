"""What the known tasks name and this home does not have: worth a hint, no fault of the knowledge.

A run of such a task asks about the thing, or cannot be done here; nothing is wrong with the files.
"""

from collections.abc import Iterator

from rdflib import URIRef

from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.misnamed import THING_LIKE, unknown
from adaptbot_cli.core.names import misspelt, normal, sentence_list
from adaptbot_cli.core.plan import Goal, Task
from adaptbot_cli.core.roles import things_in
from adaptbot_cli.core.terms import local


def lacking(kg: Kg) -> Iterator[str]:
    """Tell of each thing that tasks need, or name in their goals, and the home does not have."""
    wanted: dict[str, dict[str, None]] = {}
    for task in kg.domain.tasks:
        for name in _lacked(kg, task):
            wanted.setdefault(name, {})[task.name] = None
    known = sorted(kg.names())
    for name, tasks in sorted(wanted.items()):
        near = misspelt(name, known, THING_LIKE)
        who = sentence_list(list(tasks), 3)
        remedy = "add it if it is here; else a run asks about it"
        remedy = f"the nearest there is {near}" if near else remedy
        yield f"tasks.ttl: {name} is not in attributes.ttl, and is named by {who}; {remedy}"


def _lacked(kg: Kg, task: Task) -> Iterator[str]:
    yield from (normal(item) for item in task.required if not kg.find(item))
    for goal in task.goals:
        for iri in _named(kg, goal):
            name = local(iri)
            # A thing of that name may be here, and yet not be the one that the goal names.
            yield str(iri) if kg.find(name) else normal(name)


def _named(kg: Kg, goal: Goal) -> Iterator[URIRef]:
    for query in (goal.query, goal.about, goal.helped_by):
        yield from (iri for iri in unknown(kg, query) if iri in things_in(query))
