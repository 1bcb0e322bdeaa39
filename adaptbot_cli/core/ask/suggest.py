"""Likely answers, from the nearest known things; the person has the say (paper, III-C).

Near is what has the same name in part, or a broader word in common (WordNet), among the things of
the same kind; things that are known to differ in an attribute are less near. What all of a kind
agree on counts as well, but little. An answer is only suggested where the things agree.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.ask.questions import NO, YES, Question, Suggestion
from adaptbot_cli.core.domain import ItemClass, Property
from adaptbot_cli.core.graph.terms import FALSE, TRUE, local
from adaptbot_cli.core.names import normal, sentence_list, words
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Related

MOST = 500
"""The most things that words are compared with: of more, those with names most alike."""

SURE, SURE_OF_PLACE, SURE_OF_KIND = 0.7, 0.5, 0.75
"""The share of the weight that an answer needs: a place is but one of many."""

RIGHT, RIGHT_PLACE = 0.88, 0.75
"""The share of known things for which suggestions must be right, or none is made."""

_TRIALS, _ENOUGH, _ENOUGH_OF_KINDS = 60, 20, 12
"""How many known things this is tried with at most, and with how many at least."""

_SAME_HEAD, _SAME_WORD = 0.8, 0.3
_DIFFERS = 0.3
_OF_THE_KIND = 0.01
_NEAR = 0.2
"""How near things of the same last word are, of any same word; what is left of the weight of a
thing that differs in an attribute; the weight of a thing only for its kind; from where a thing
counts as like the one asked about."""

_AS_NEAR = 0.6
"""How near a thing is to the nearest one, at least, to be named with it."""


@dataclass(frozen=True, slots=True)
class Near:
    """A known thing, and how near it is to the one asked about, from 0 to 1."""

    entity: URIRef
    weight: float


def words_to_look_up(question: Question, scene: Scene) -> tuple[str, ...]:
    """Return the words still to be looked up, by which known things are compared with a new one."""
    if question.kind not in ("kind", "place", "attribute") or question.subject != "item":
        return ()
    kinds = [kind.iri for kind in scene.domain.teachable]
    known = scene.kg.likest(question.about, kinds, MOST)
    names = [question.about, *(scene.kg.name(entity) for entity in known)]
    wanted = {form for name in names for form in _forms(name)}
    return tuple(sorted(wanted - scene.around.keys()))


def _forms(name: str) -> tuple[str, ...]:
    """The words under which a name may be looked up: as a whole, and its last one."""
    return tuple(dict.fromkeys((normal(name), *words(name)[-1:])))


class _Words:
    """A name, and the words above and below it with how far away they are."""

    def __init__(self, name: str, known: Mapping[str, Sequence[Related]]) -> None:
        self.name = normal(name)
        self.parts = words(name)
        found = next((known[form] for form in _forms(name) if known.get(form)), ())
        self.related: dict[str, int] = {}
        self.above: dict[str, int] = {}
        self.called: dict[str, str] = {}
        first = min((word.sense for word in found), default=0)
        for word in found:
            if word.sense != first:
                continue
            _keep_least(self.related, word.word, word.distance)
            if word.relation != "hyponym":
                sense = word.gloss or word.word
                _keep_least(self.above, sense, word.distance)
                self.called[sense] = min(self.called.get(sense, word.word), word.word, key=_plain)

    def nearness(self, other: "_Words") -> float:
        """How near another name is, from 0 to 1."""
        ways = [self.related.get(other.name), other.related.get(self.name)]
        shared = self.above.keys() & other.above.keys()
        ways += [self.above[gloss] + other.above[gloss] for gloss in shared]
        by_words = max((1 / (1 + far) for far in ways if far is not None), default=0.0)
        if self.parts[-1:] == other.parts[-1:]:
            return max(by_words, _SAME_HEAD)
        return max(by_words, _SAME_WORD if set(self.parts) & set(other.parts) else 0.0)

    def broader(self, others: Sequence["_Words"]) -> str:
        """The nearest word that stands above this name and above some others, "" if none does."""
        shared = set(self.above).intersection(*(other.above for other in others))
        far = {sense: sum(w.above[sense] for w in (self, *others)) for sense in shared}
        nearest = min(shared, key=lambda sense: (far[sense], self.called[sense]), default="")
        return self.called.get(nearest, "")


def _plain(word: str) -> tuple[bool, int]:
    """A sort key that puts the plainest synonym first: "vegetable" before "veg", "green_goods"."""
    return "_" in word, -len(word)


def _keep_least(distances: dict[str, int], key: str, distance: int) -> None:
    distances[key] = min(distance, distances.get(key, distance))


class Likely:
    """Likely answers about one thing, from what is known of the other things of its kinds.

    The facts and the words are read once. A value that the near things agree on is only suggested
    if the same way of suggesting gives the right values for the known things: each of the nearest
    is left out in turn, and `RIGHT` of the guesses must be.
    """

    def __init__(self, name: str, kinds: Sequence[ItemClass], scene: Scene) -> None:
        self.name, self.kinds, self.scene = name, kinds, scene
        kg = scene.kg
        known = kg.likest(name, [kind.iri for kind in kinds], MOST)
        self.words = {entity: _Words(kg.name(entity), scene.around) for entity in known}
        asked = dict.fromkeys(prop for kind in kinds for prop in kind.asks)
        self.values = {prop: self._known(prop) if known else {} for prop in asked}

    def _known(self, prop: URIRef) -> dict[Node, Node]:
        facts, declared = self.scene.kg.facts, self.scene.domain.properties.get(prop)
        values: dict[Node, Node] = {}
        for entity in self.words:
            stated = next((o for _, _, o in sorted(facts.triples((entity, prop, None)))), None)
            implied = (
                rule.value
                for rule in (declared.implied if declared else ())
                if (entity, rule.prop, rule.equals) in facts
            )
            value = stated if stated is not None else next(implied, None)
            if value is not None:
                values[entity] = value
        return values

    def near(self, entity: URIRef | None, words: "_Words") -> list[Near]:
        """Return the things with how near they are, nearest first, without one of them."""
        found = [Near(e, words.nearness(w)) for e, w in self.words.items() if e != entity]
        return sorted(found, key=lambda near: (-near.weight, near.entity))

    def attribute(self, prop: Property) -> Suggestion | None:
        """Return the likely value of an attribute, or the likely place."""
        entity = next(iter(self.scene.kg.find(self.name)), None)
        if entity not in self.words or prop.iri not in self.values:
            return None
        near = self.near(entity, self.words[entity])
        guess = self._guess(entity, near, prop)
        if guess is None or not self._trusted(guess, near, prop):
            return None
        answers: dict[Node, str] = {TRUE: YES, FALSE: NO}
        value = answers.get(guess.value)
        if value is None and isinstance(guess.value, URIRef):
            value = self.scene.kg.name(guess.value)
        if value is None:
            return None
        return Suggestion(value, self._reason(self.words[entity], guess.like))

    def kind(self) -> Suggestion | None:
        """Return the likely kind of a new thing, if such guesses are right for known things."""
        kg = self.scene.kg
        of: dict[Node, Node] = {
            entity: kind.iri
            for kind in self.kinds
            for entity in self.words
            if kg.is_of(entity, kind)
        }
        words = _Words(self.name, self.scene.around)
        near = self.near(None, words)
        best = _kind(near, of)
        if best is None:
            return None
        right = tried = 0
        for one in near[:_TRIALS]:
            guess = _kind(self.near(one.entity, self.words[one.entity]), of)
            tried += guess is not None
            right += guess is not None and guess.value == of.get(one.entity)
        if tried < _ENOUGH_OF_KINDS or right < RIGHT * tried:
            return None
        return Suggestion(local(best.value), self._reason(words, best.like))

    def _guess(self, entity: URIRef, near: Sequence[Near], prop: Property) -> "_Guess | None":
        """The value that the near things agree on, if they do enough."""
        record = {p: v[entity] for p, v in self.values.items() if p != prop.iri and entity in v}
        weights = [
            (n, n.weight**2 * self._agreement(n.entity, record) + _OF_THE_KIND) for n in near
        ]
        best = _best(weights, self.values[prop.iri])
        if best is None:
            return None
        place = isinstance(best.value, URIRef)
        unsure = best.share < (SURE_OF_PLACE if place else SURE)
        return None if unsure or not best.like else best

    def _agreement(self, entity: URIRef, record: Mapping[URIRef, Node]) -> float:
        """What is left of a thing's weight, seeing in how many attributes it is known to differ."""
        differing = (
            1
            for prop, value in record.items()
            if isinstance(value, Literal) and self.values[prop].get(entity, value) != value
        )
        return float(_DIFFERS ** sum(differing))

    def _trusted(self, guess: "_Guess", near: Sequence[Near], prop: Property) -> bool:
        """Whether such guesses are right for the nearest things."""
        key = (prop.iri, guess.value, tuple(kind.iri for kind in self.kinds))
        if key not in self.scene.trust:
            right = tried = 0
            for one in near[:_TRIALS]:
                truth = self.values[prop.iri].get(one.entity)
                if truth is None:
                    continue
                others = self.near(one.entity, self.words[one.entity])
                other = self._guess(one.entity, others, prop)
                if other is not None and other.value == guess.value:
                    tried += 1
                    right += other.value == truth
            needed = RIGHT_PLACE if isinstance(guess.value, URIRef) else RIGHT
            self.scene.trust[key] = tried >= _ENOUGH and right >= needed * tried
        return self.scene.trust[key]

    def _reason(self, words: "_Words", like: Sequence[URIRef]) -> str:
        """Name the nearest of the things that agree, and a broader word for them all."""
        if like:
            named = [self.words[entity] for entity in like[:2]]
            broader = words.broader(named).replace("_", " ")
            text = sentence_list([other.name.replace("_", " ") for other in named])
            return f"as for {text}" + (f" ({broader})" if broader else "")
        return f"as for almost every {next((kind.label for kind in self.kinds), 'thing')}"


@dataclass(frozen=True, slots=True)
class _Guess:
    """The value with the most weight, its share, and the really near things that have it."""

    value: Node
    share: float
    like: list[URIRef]


def _kind(near: Sequence[Near], of: Mapping[Node, Node]) -> _Guess | None:
    best = _best([(n, n.weight**2) for n in near if n.weight >= _NEAR], of)
    return best if best is not None and best.share >= SURE_OF_KIND else None


def _best(weights: Sequence[tuple[Near, float]], values: Mapping[Node, Node]) -> _Guess | None:
    sums: dict[Node, float] = {}
    for near, weight in weights:
        value = values.get(near.entity)
        if value is not None:
            sums[value] = sums.get(value, 0.0) + weight
    if not sums:
        return None
    best = max(sorted(sums, key=str), key=lambda value: sums[value])
    having = [(n, w) for n, w in weights if values.get(n.entity) == best and n.weight >= _NEAR]
    most = max((weight for _, weight in having), default=0.0)
    like = sorted((-w, n.entity) for n, w in having if w >= _AS_NEAR * most)
    return _Guess(best, sums[best] / sum(sums.values()), [entity for _, entity in like])
