"""A simulated person who knows a home: answers from a graph that knows the truth."""

import random
from dataclasses import dataclass, field

from rdflib import URIRef

from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import (
    ABSENT,
    AGAIN,
    EXISTS,
    IS_NOT,
    IS_SO,
    LATER,
    NO,
    UNKNOWN,
    YES,
    Answer,
    Question,
)
from adaptbot_cli.core.domain import Property
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import FALSE, TRUE, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.refine.grounding import known_values

KEY, THINK, WORDS_A_MINUTE = 0.28, 1.35, 238
"""Seconds to press a key and to decide (keystroke-level model: Card, Moran and Newell, 1980), and
the speed of silent reading (Brysbaert, 2019)."""


@dataclass(slots=True)
class SimulatedHuman:
    """Answers from `truth`; with probability `error` gives another answer that could be chosen.

    Its answers depend on the question and the seed alone, not on what was asked before. It
    counts what the questions cost: `about` what was asked about, `prompts` and `seconds` at the
    terminal (docs/evaluation.md, "The simulated person").
    """

    truth: Kg
    error: float = 0.0
    seed: str = ""
    by: str = "simulated"
    about: list[str] = field(default_factory=list)
    prompts: int = 0
    seconds: float = 0.0

    def ask(self, question: Question) -> Answer:
        """Answer a question from the truth, or wrongly by chance."""
        value = self._truly(question)
        chance = random.Random(f"{self.seed}|{'|'.join(question.key)}")
        if value != LATER.value and chance.random() < self.error:
            value = _wrongly(value, question, chance)
        if value != LATER.value:
            self._count(question, value)
        return Answer(value, self.by)

    def review(self, lessons: tuple[Lesson, ...]) -> bool:
        """Accept what was learned: one look, one key."""
        self.prompts += 1
        self.seconds += _reading(" ".join(lesson.sentence for lesson in lessons)) + THINK + KEY
        return True

    def _truly(self, question: Question) -> str:
        match question.kind:
            case "existence":
                is_action = question.subject == "action"
                return self._action(question) if is_action else self._item(question)
            case "kind":
                return self._kind(question)
            case "attribute":
                return self._attribute(question)
            case "place":
                return self._place(question)
            case "failed":
                return self._failed(question)
            case _:  # what is offered, such as steps that the goal needs; nothing else is known
                agreed = any(choice.value == YES for choice in question.choices)
                return YES if agreed else LATER.value

    def _item(self, question: Question) -> str:
        found = self.truth.find(question.about)
        if not found:
            return ABSENT
        same = question.known.meant(self.truth.name(found[0]))
        return f"is {same}" if same else EXISTS

    def _action(self, question: Question) -> str:
        for action in self.truth.domain.actions.values():
            names = (action.name, *action.aliases, *self.truth.aliases(action.iri))
            if question.about in map(normal, names):
                return f"is {action.name}"
        return ABSENT

    def _kind(self, question: Question) -> str:
        entity = self._entity(question)
        offered = [choice.value for choice in question.choices]
        classes = self.truth.classes(entity) if entity else frozenset()
        return next((kind for kind in offered if kind in {local(c) for c in classes}), UNKNOWN)

    def _attribute(self, question: Question) -> str:
        entity, prop = self._entity(question), self._property(question)
        values = known_values(self.truth, entity, prop.iri) if entity and prop else set()
        if TRUE in values:
            return YES
        return NO if FALSE in values else UNKNOWN

    def _place(self, question: Question) -> str:
        entity, prop = self._entity(question), self._property(question)
        place = self.truth.value(entity, prop.iri) if entity and prop else None
        name = normal(self.truth.name(place)) if place is not None else ""
        offered = {normal(choice.value): choice.value for choice in question.choices}
        return offered.get(name) or question.further.meant(name) or UNKNOWN

    def _failed(self, question: Question) -> str:
        """What is true of what a failed step was done with; else that it be tried again, once."""
        for choice in question.choices:
            kind, _, rest = choice.value.partition(" ")
            prop, _, name = rest.partition(" ")
            if f"{kind} " in (IS_SO, IS_NOT):
                asked = Question("attribute", name, "", prop)
                if self._attribute(asked) == (YES if f"{kind} " == IS_SO else NO):
                    return choice.value
        if question.about in self.about:
            return LATER.value
        return AGAIN

    def _entity(self, question: Question) -> URIRef | None:
        return next(iter(self.truth.find(question.about)), None)

    def _property(self, question: Question) -> Property | None:
        known = self.truth.domain.properties.values()
        return next((prop for prop in known if local(prop.iri) == question.prop), None)

    def _count(self, question: Question, value: str) -> None:
        if question.about not in self.about:
            self.about.append(question.about)
        self.prompts += 1
        self.seconds += _reading(f"{question.context} {question.text}") + THINK
        self.seconds += (_place_of(value, question) + 1) * KEY
        if value.startswith("is "):  # which one is meant is a prompt of its own, a name to type
            self.prompts += 1
            self.seconds += THINK + (len(value.removeprefix("is ")) + 1) * KEY


def _reading(text: str) -> float:
    """Seconds to read a text."""
    return len(text.split()) * 60 / WORDS_A_MINUTE


def _place_of(value: str, question: Question) -> int:
    """How many keys lead to a choice: one for each choice above it."""
    offered = [choice.value for choice in question.choices]
    chosen = "is" if value.startswith("is ") else value
    return offered.index(chosen) if chosen in offered else 0


def _wrongly(value: str, question: Question, chance: random.Random) -> str:
    """Another answer that the question offers: what is denied, mistaken, put somewhere else."""
    if question.kind == "existence":
        return EXISTS if value == ABSENT else ABSENT
    if value in (YES, NO):
        return YES if value == NO else NO
    never = {value, UNKNOWN, LATER.value}
    others = [choice.value for choice in question.choices if choice.value not in never]
    return chance.choice(others) if others else value
