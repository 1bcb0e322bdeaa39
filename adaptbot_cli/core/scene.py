"""What a plan is looked at with: the graph, the task, the words, the names it uses."""

from dataclasses import dataclass, field
from typing import Any

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.ask.learning import is_absent
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal, words
from adaptbot_cli.core.plan import Call, Task
from adaptbot_cli.core.request.understand import doubtful, excluded, excludes
from adaptbot_cli.core.words import Related


@dataclass(slots=True)
class Scene:
    """Everything that judging one plan needs.

    Without `repair` a plan is looked at as it is: nothing is put in, left out or added.
    `known` holds the word knowledge looked up so far, `used` the names that the plan writes;
    `aside` the items and actions whose steps are dropped, `drop` whether dropping is allowed;
    `agreed` the names that words were put in for in a plan that the person then edited, `instead`
    those that stand for something known in this run only;
    `near` remembers the names near a name and `meant` what a name means, both costly to find;
    `taken` which name a thing was put in for, so that two never become one; `around` holds the word
    knowledge of the names of known things, which likely answers are found by, and `trust` for
    which properties these have proved right. In a world outside, `done` are the things that steps
    were carried out with, and `spoiled` is what was in the wrong state before the first of them.
    """

    kg: Kg
    task: Task
    known: dict[str, tuple[Related, ...]] = field(default_factory=dict)
    used: frozenset[str] = frozenset()
    aside: frozenset[str] = frozenset()
    agreed: set[str] = field(default_factory=set)
    instead: set[str] = field(default_factory=set)
    drop: bool = True
    repair: bool = True
    near: dict[tuple[str, frozenset[URIRef]], list[str]] = field(default_factory=dict)
    meant: dict[tuple[str, tuple[URIRef, ...]], Any] = field(default_factory=dict)
    taken: dict[URIRef, str] = field(default_factory=dict)
    around: dict[str, tuple[Related, ...]] = field(default_factory=dict)
    trust: dict[tuple[URIRef, Node, tuple[URIRef, ...]], bool] = field(default_factory=dict)
    done: set[Node] = field(default_factory=set)
    spoiled: set[tuple[int, Node]] | None = None

    @property
    def domain(self) -> Domain:
        """The domain of the graph."""
        return self.kg.domain

    def notice(self, calls: list[Call]) -> None:
        """Take note of every name that a plan writes."""
        self.used = frozenset(normal(arg) for call in calls for arg in call.args)
        self.near.clear()
        self.meant.clear()
        self.taken.clear()

    def requires(self, name: str) -> bool:
        """Tell whether the task requires the item of this name."""
        wanted = {normal(item) for item in self.task.required}
        if normal(name) in wanted:
            return True
        entities = set(self.kg.find(name))
        return any(entities & set(self.kg.find(item)) for item in wanted)

    def excludes(self, name: str) -> str:
        """Return why the request rules out what bears a name, "" if it does not."""
        return excludes(name, self.task, self.kg)

    def excluded(self, entity: Node) -> str:
        """Return why the request rules out a thing, "" if it does not."""
        return excluded(entity, self.task, self.kg)

    def bars(self, node: Node) -> bool:
        """Tell whether no step may be added with a thing: it is excluded, or may be."""
        return bool(self.excluded(node)) or doubtful(node, self.task, self.kg) is not None

    def uses(self, entity: URIRef) -> bool:
        """Tell whether the plan names this entity by its own name."""
        names = {normal(self.kg.name(entity)), *map(normal, self.kg.aliases(entity))}
        return not names.isdisjoint(self.used)

    def is_product(self, name: str) -> bool:
        """Tell whether a name means what the task makes, not a thing of the home."""
        parts = set(words(name)) - self.domain.fillers
        made = set(words(self.task.name)) - self.domain.fillers
        needed = {word for item in self.task.required for word in words(item)}
        dish = {word for word in made - needed if not self.kg.find(word)}
        if not self.domain.products:
            return False  # nothing is made in this domain: a task's words name things
        meant = self.domain.products | dish
        return (bool(parts & meant) and parts - needed <= meant) or (bool(parts) and parts <= made)

    def sets_aside(self, name: str, subject: str) -> bool:
        """Tell whether the steps with this name are to be dropped, if dropping is allowed."""
        if not self.drop or (subject == "item" and self.requires(name)):
            return False
        if subject == "action" and normal(name) in self.domain.actions:
            return False  # an item that is not there may bear the name of an action
        known = subject == "item" and self.kg.find(name)
        return normal(name) in self.aside or (not known and is_absent(self.kg, name, subject))
