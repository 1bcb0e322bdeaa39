"""What the model on board is shown: a few plans of the library, each as an answer to its task.

A small model goes by examples more than by rules, and its grammar keeps it to the actions anyway.
So the prompt is not the one of the large models: no list of actions, only tasks and their plans,
the nearest one last.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from adaptbot_cli.adapters.planner.library import LibraryPlan, nearest_plan
from adaptbot_cli.adapters.planner.local.engine import Engine
from adaptbot_cli.adapters.planner.local.found import model_file, on_board
from adaptbot_cli.adapters.planner.local.grammar import grammar
from adaptbot_cli.adapters.planner.prompts import MOST_NAMES, Prompts
from adaptbot_cli.adapters.planner.provider import load
from adaptbot_cli.core.names import singulars, words
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Propose

EXAMPLES = 2
"""How many plans of the library the model is shown."""

Message = dict[str, str]
_NAME = re.compile(r'"([^"\n]+)"')


def nearest_plans(task: Task, library: Iterable[LibraryPlan], count: int) -> list[LibraryPlan]:
    """Return the plans nearest to a task, farthest first: the one that the library itself would
    take, then those that share most words of their names and most ingredients with the task."""
    plans = list(library)
    taken = nearest_plan(task.name, plans)
    first = taken[0] if taken else None
    ranked = sorted(plans, key=lambda plan: (plan is not first, -_nearness(task, plan)))
    return ranked[:count][::-1]


def _nearness(task: Task, plan: LibraryPlan) -> float:
    named = max((_shared(_words(task.name), _words(name)) for name in plan.names), default=0.0)
    return named + _shared(set(task.required), set(plan.ingredients))


def _words(text: str) -> set[str]:
    return {(singulars(word) or (word,))[0] for word in words(text)}


def _shared(one: set[str], other: set[str]) -> float:
    """Jaccard's index: what two sets share, of all that they hold."""
    return len(one & other) / (len(one | other) or 1)


@dataclass(slots=True)
class BoardPrompts:
    """What the model that `name`, `local` or `local:PATH`, means is told. `prompts` are those of
    the large models, whose examples, names and re-prompts it shares.

    Raises:
        ModelError: on making, if it is not installed, or the file is missing or no model.
    """

    name: str
    prompts: Prompts
    file: Path = field(init=False)
    _grammar: str = field(default="", init=False)

    def __post_init__(self) -> None:
        self.file = model_file(self.name)

    @property
    def model(self) -> str:
        """The name by which litellm knows the model: it says which, not where it lies."""
        return f"local/{self.file.stem}"

    def messages(self, turn: Propose) -> list[Message]:
        """Return the chat: examples, the task, and at a re-prompt the last plan and its findings.

        Makes the model known to litellm when it is first called.
        """
        if not self._grammar:
            self._register()
        chat: list[Message] = []
        for plan in nearest_plans(turn.task, self.prompts.plans(), EXAMPLES):
            chat += _exchange(plan)
        names = {name for message in chat for name in _NAME.findall(message["content"])}
        self._grammar = grammar(self.prompts.kg.domain, names | told(turn.task) | self._known())
        chat.append(_said("user", _asked(turn.task.name, turn.task.required)))
        if turn.attempt:
            chat.append(_said("assistant", turn.previous))
            chat.append(_said("user", self.prompts.again(turn)))
        return chat

    def _register(self) -> None:
        load()  # with our settings, before the next line imports it
        from adaptbot_cli.adapters.planner.local.provider import register

        register(self.file.stem, Engine(self.file), lambda: self._grammar)

    def _known(self) -> set[str]:
        """The names of the things that a prompt names, whatever the task."""
        kg = self.prompts.kg
        kinds = [kind.iri for kind in kg.domain.teachable if kind.prompted]
        found = (kg.instances([kind])[:MOST_NAMES] for kind in kinds)
        return {kg.name(entity) for entities in found for entity in entities}


def for_model(name: str, prompts: Prompts) -> "tuple[str, Prompts | BoardPrompts]":
    """Return how litellm names a model, and what it is told. Raises ModelError as BoardPrompts."""
    if not on_board(name):
        return name, prompts
    board = BoardPrompts(name, prompts)
    return board.model, board


def told(task: Task) -> set[str]:
    """Return the names that a task tells, known or not: required items, words, pairs of words."""
    said = words(task.name)
    return {*task.required, *said, *("_".join(pair) for pair in pairwise(said))}


def _exchange(plan: LibraryPlan) -> list[Message]:
    """A plan of the library, as if the model had been asked for it and had written it."""
    name, items = plan.names[0], plan.ingredients
    written = (line.partition("#")[0].rstrip() for line in plan.render(name, items).splitlines())
    text = "\n".join(line for line in written if line)
    return [_said("user", _asked(name, items)), _said("assistant", text)]


def _asked(task: str, items: Iterable[str]) -> str:
    told = ", ".join(items)
    return f"Task: {task}\nUse all of: {told}" if told else f"Task: {task}"


def _said(role: str, content: str) -> Message:
    return {"role": role, "content": content}
