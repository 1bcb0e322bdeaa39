"""Requests in tests: what words mean on a graph, with the word knowledge that is shipped."""

from collections.abc import Sequence
from functools import cache

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner.library import names_in
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.request.understand import Reading, understand
from adaptbot_cli.resources import bundled


@cache
def lexicon() -> WordNet:
    """Return the shipped WordNet, loaded once."""
    return WordNet()


@cache
def dishes(domain: str) -> tuple[str, ...]:
    """Return the names that the bundled plans of a domain serve."""
    return tuple(names_in(bundled("prompts") / "library" / domain))


def reading_of(
    text: str, kg: Kg, requires: Sequence[str] = (), without: Sequence[str] = ()
) -> Reading:
    """Return what a request means on a graph."""
    return understand(text, kg, lexicon(), requires, without, dishes(kg.domain.name))


def task_for(text: str, kg: Kg, requires: Sequence[str] = ()) -> Task:
    """Return the first task that a request means."""
    return reading_of(text, kg, requires).tasks[0]
