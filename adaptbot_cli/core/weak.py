"""Goals of a pack that say too little: met before anything is done, or by anything at all.

Worth a hint, no fault: a home may happen to be as a task wants it, and a dish of which anything can
be made is best judged so.
"""

from collections.abc import Iterator
from dataclasses import replace

from adaptbot_cli.core.clauses import concerns
from adaptbot_cli.core.execute import check_goal
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.plan import Goal
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.sparql import mentions, ruled_out


def weak(kg: Kg) -> Iterator[str]:
    """Tell of each task and class of tasks whose own goals are weak where it names nothing else."""
    classes = {task.iri: task for task in kg.domain.task_classes.values()}
    own = kg.under(replace(kg.domain, goals=()))
    for task in (*kg.domain.tasks, *classes.values()):
        goals = [goal for goal in task.goals if concerns(goal, task.required, kg)]
        if not goals:
            continue
        where = f"tasks.ttl, entry {task.name}"
        if not check_goal(Scene(own, task))[0]:
            yield (
                f"{where}: its goal holds here before anything is done; "
                "ask for something that only doing it brings about"
            )
        elif not any(goal.classes or _names_a_thing(goal, kg) for goal in goals):
            yield (
                f'{where}: its goal ("{goals[0].message}" otherwise) is about no item; '
                "name the item in ab:ask, or ask for each ?item of ab:needs with ab:class"
            )


def _names_a_thing(goal: Goal, kg: Kg) -> bool:
    return any(kg.classes(iri) for iri in mentions(goal.query) - ruled_out(goal.query))
