"""What the words of a request may name: tasks, things, rooms, constraints, actions, states.

The longest name that begins at a word counts, and a phrase is everything that it may be.
`clauses.py` puts the phrases together.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Literal

from rdflib import URIRef

from adaptbot_cli.core import english
from adaptbot_cli.core.domain import Action, Domain
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal, singulars, words
from adaptbot_cli.core.plan import Constraint, Task
from adaptbot_cli.core.words import Lexicon, Sense

_LONGEST_NAME = 5
"""How many words of a request may name one thing."""

A_SLIP = 0.74
"""How like a known word one must be to be a slip of the pen for it (a ratio of `difflib`)."""

_STOPS = frozenset(";.:!?)")
BOUNDARIES = frozenset({"comma", "stop", "and", "or", "but"})
PARTICLES = frozenset({"on", "off", "up", "out", "away", "down"})
_ENDS = frozenset({
    *_STOPS, ",", "&", "+", "and", "plus", "then", "please", "but", "with", "without", "for", "in",
    "as", "at", "followed", "from", "if", "when", "until", "now", "again", "today", "tonight",
})  # fmt: skip


Role = Literal["word", "number", "measure", "comma", "stop", "and", "or", "but", "with", "without",
               "allergy", "allergen", "to", "from", "of", "for", "unread", "name"]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Phrase:
    """Words of a request that belong together, and everything that they may be."""

    role: Role
    words: tuple[str, ...]
    task: Task | None = None
    thing: str = ""
    several: tuple[str, ...] = ()
    rule: Constraint | None = None
    action: Action | None = None
    state: str = ""
    number: int = 0
    called: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The words as one text."""
        return " ".join(self.words)

    @property
    def things(self) -> tuple[str, ...]:
        """The names of what it may mean: one thing, or those of its number."""
        return (self.thing,) if self.thing else self.several


@dataclass(slots=True)
class Naming:
    """The words that the home, the domain, the plan library and the lexicon know."""

    kg: Kg
    lexicon: Lexicon
    dishes: tuple[str, ...]
    _forms: dict[str, frozenset[str]] = field(default_factory=dict)
    _names: list[tuple[tuple[str, ...], Task]] = field(default_factory=list)
    _known: list[str] = field(default_factory=list)

    @property
    def domain(self) -> Domain:
        """The domain of the graph."""
        return self.kg.domain

    @property
    def cooks(self) -> bool:
        """Whether tasks are named after what they make ("tea"), not after what is to be done."""
        return bool(self.domain.products)

    def senses(self, word: str) -> tuple[Sense, ...]:
        """Return what the lexicon knows of a word."""
        return self.lexicon.senses(word)

    def forms(self, word: str) -> frozenset[str]:
        """A word, its singular and its base forms."""
        if word not in self._forms:
            bases = {sense.base for sense in self.senses(word)}
            self._forms[word] = frozenset({word, *singulars(word)[:1], *bases})
        return self._forms[word]

    def same(self, one: str, other: str) -> bool:
        """Tell whether two words are forms of one."""
        if one[:2] != other[:2]:  # forms of one word begin alike, and the lexicon is slow to open
            return False
        return one == other or not self.forms(one).isdisjoint(self.forms(other))

    @property
    def names(self) -> list[tuple[tuple[str, ...], Task]]:
        """The names of tasks, of classes of tasks and of dishes, as words, with what they mean."""
        if not self._names:
            named: dict[str, Task] = {}
            for task in {t.iri: t for t in self.domain.task_classes.values()}.values():
                taught = self.kg.aliases(task.iri) if task.iri else ()
                named.update({normal(name): task for name in taught})
            named.update(self.domain.task_classes)
            named.update(self.domain.task_names)
            classes = [
                _plain(name) for name in (*self.domain.task_classes, *self.domain.task_names)
            ]
            for dish in self.dishes:
                errand = not self.domain.products and self._action(normal(dish))
                if dish.endswith(" of") or errand:
                    continue  # "glass of", "water": what it is about is still to come
                # "chicken soup" is a soup with chicken, whatever plan there is for it
                parts = _plain(dish)
                if not any(_part_of(name, parts, self.domain) for name in classes):
                    named.setdefault(normal(dish), Task(dish, thin=True))
            for name, task in named.items():
                parts = tuple(w for w in words(name) if w not in english.DETERMINERS)
                for form in _orders(parts):
                    self._names.append((form, task))
        return self._names

    def names_like(self, word: str) -> list[str]:
        """Return the names of things and constraints that a word can be a slip for, sorted."""
        rules = (n for rule in self.domain.constraints for n in (*rule.names, *rule.strict))
        return sorted({*map(normal, self.kg.names_like(word)), *rules})

    def respelt(self, tokens: list[str]) -> tuple[list[str], list[tuple[str, str]]]:
        """Return the words with slips of the pen put right, and which were."""
        explained = {
            word
            for part in self.parts(tokens)
            if part.role != "unread" or part.words in english.OTHERS
            for word in part.words
        }
        guesses, found = [], []
        for word in tokens:
            near = "" if word in explained or self.senses(word) else self._near(word)
            guesses += [(word, self._main_name(near, word))] if near else []
            found.append(near or word)
        return found, guesses

    def _main_name(self, near: str, written: str) -> str:
        """The name to show for the one meant: the name in the pack, if it is as like the slip."""
        named = [task.name for name, task in self.names if name == (near,)]
        named += map(self.kg.name, self.kg.find(near))
        return next(iter(get_close_matches(written, named, 1, A_SLIP)), near)

    def _near(self, word: str) -> str:
        if len(word) < 3 or not word.isalpha() or word in english.CONDITIONS:
            return ""
        known = {w for name in self.names_like(word) for w in words(name)}
        known |= {w for name, _ in self.names for w in name}
        known |= english.VERBS | self.domain.fillers | english.OCCASIONS | english.PEOPLE
        known |= {"without", "with", "please", "could", "would", "free"}
        known |= {
            w for a in self.domain.actions.values() for n in (a.name, *a.aliases) for w in words(n)
        }
        if word in known:
            return ""
        likely = sorted(w for w in known if len(w) > 2 and abs(len(w) - len(word)) <= 3)
        for near in get_close_matches(word, likely, 3, A_SLIP):
            if near[0] == word[0] or sorted(near) == sorted(word):
                return near
        return ""

    def parts(self, tokens: Sequence[str]) -> list[Phrase]:
        """Take the words apart into names, the longest first, and words of English."""
        found: list[Phrase] = []
        at = 0
        while at < len(tokens):
            part = self._part(tokens, at)
            found.append(part)
            at += len(part.words)
        return found

    def _part(self, tokens: Sequence[str], at: int) -> Phrase:
        grammar = self._grammar(tokens, at)
        name = self._name(tokens, at)
        if name is None:
            return grammar or Phrase("unread", (tokens[at],))
        if grammar is None or grammar.role in ("measure", "word"):
            longer = grammar is None or len(name.words) >= len(grammar.words)
            weak = grammar is not None and not (
                name.task or name.thing or name.rule or name.several
            )
            of = tokens[at + 1 : at + 2] == ["of"]
            weak = weak and not (name.action and grammar.role == "measure" and not of)  # type: ignore[union-attr]
            return name if longer and not weak else grammar or name
        return name if len(name.words) > len(grammar.words) else grammar

    def _grammar(self, tokens: Sequence[str], at: int) -> Phrase | None:
        word = tokens[at]
        if word in (",", "&", "+") or word in _STOPS:
            role: Role = "comma" if word == "," else "stop" if word in _STOPS else "and"
            return Phrase(role, (word,))
        tables: tuple[tuple[Role, tuple[tuple[str, ...], ...]], ...] = (
            ("allergy", english.ALLERGY), ("without", english.WITHOUT), ("with", english.WITH),
            ("and", english.AND), ("or", english.OR), ("but", english.BUT), ("to", english.TO),
            ("from", english.FROM), ("of", english.OF), ("for", english.FOR),
            ("word", english.COURTESY), ("unread", english.OTHERS),
        )  # fmt: skip
        best: Phrase | None = None
        for role, phrases in tables:
            for phrase in phrases:
                longer = best is None or len(phrase) > len(best.words)
                if longer and tuple(tokens[at : at + len(phrase)]) == phrase:
                    best = Phrase(role, phrase)
        if best is not None:
            return best
        if number_of(word):
            return Phrase("number", (word,), number=number_of(word))
        if word in english.AFTER_ALLERGEN:
            return Phrase("allergen", (word,))
        if word in english.MEASURES:
            return Phrase("measure", (word,))
        if word in english.GRAMMAR or word in english.VERBS or word in self.domain.fillers:
            return Phrase("word", (word,))
        if word in english.PEOPLE or word in english.OCCASIONS:
            return Phrase("word", (word,))
        return None

    def _name(self, tokens: Sequence[str], at: int) -> Phrase | None:
        """The longest name that begins here, as everything that it may be."""
        task, end, called = self._task(tokens, at)
        best = end
        thing, state, rule, action = "", "", None, None
        several: tuple[str, ...] = ()
        for length in range(min(_LONGEST_NAME, len(tokens) - at), 0, -1):
            entries = tokens[at : at + length]
            if at + length < best or any(not w[0].isalnum() for w in entries):
                continue
            if length == 1 and entries[0] in english.GRAMMAR:
                continue
            joined = "_".join(entries)
            entities = self.kg.find(joined)
            group = self._numbered(joined) if not entities else ()
            ruled = self.rule_called(joined, strict=False)
            act = self.done(joined) if length == 1 else self._action(joined)
            prop = self._state(joined) if length == 1 else ""
            if not (entities or group or ruled or act or prop):
                continue
            if at + length > best:
                task, best, called = None, at + length, ()
            thing = self.kg.name(entities[0]) if entities else ""
            several, rule, action, state = group, ruled, act, prop
            break
        if not best:
            return None
        if thing and task is None and best - at > 1:
            # "green tea" is a thing, and a tea as well.
            head, ended, _ = self._task(tokens, best - 1)
            task = head if ended == best else None
        entries = tuple(tokens[at:best])
        number = next(filter(None, map(number_of, entries[1:])), 0) if called else 0
        return Phrase("name", entries, task, thing, several, rule, action, state, number, called)

    def _task(self, tokens: Sequence[str], at: int) -> tuple[Task | None, int, tuple[str, ...]]:
        """The task with the longest name that begins here, where that ends, and the name."""
        best: tuple[Task | None, int, tuple[str, ...]] = (None, 0, ())
        rank = (0, False, False)
        for name, task in self.names:
            verb = len(name) == 1 and name != (tokens[at],) and self._done(tokens[at])
            if not name or verb or not self.same(tokens[at], name[0]):
                continue  # to fry, and fried, are no fries
            ended = self._matches(tokens, at, name)
            found = (len(name), task.known, task.iri is not None)
            if ended and found > rank:
                best, rank = (task, ended, name), found
        return best

    def rejoined(self, tokens: list[str]) -> list[str]:
        """Return the words with the particle of a verb next to it: "turn the lamp off"."""
        known = (*(name for name, _ in self.names), *english.WITHOUT)
        pairs = {n for n in known if len(n) == 2 and n[1] in PARTICLES}
        found = list(tokens)
        for at, word in enumerate(tokens):
            for verb, particle in pairs:
                if not self.same(word, verb) or particle in found[at + 1 : at + 2]:
                    continue
                ends = (n for n in range(at + 1, len(found)) if found[n] in _ENDS)
                end = next(ends, len(found))
                if particle in found[at + 1 : end] and found.index(particle, at + 1) == end - 1:
                    del found[end - 1]
                    found.insert(at + 1, particle)
        return found

    def _matches(self, tokens: Sequence[str], at: int, name: tuple[str, ...]) -> int:
        """Where a name that begins at a word ends, with determiners passed over; 0 if it is not
        there."""
        for n, wanted in enumerate(name):
            while (
                n
                and at < len(tokens)
                and (
                    tokens[at] in english.DETERMINERS
                    or (number_of(tokens[at]) and (wanted,) not in (*english.TO, *english.OF))
                )
            ):
                at += 1  # "two toys", and not the toy 2 of "toy 2 in the box"
            if at >= len(tokens) or not self.same(tokens[at], wanted):
                return 0
            if tokens[at] in singulars(wanted) and self.kg.numbered(tokens[at]):
                return 0  # a toy is not the toys
            at += 1
        return at

    def _numbered(self, name: str) -> tuple[str, ...]:
        """The things whose names differ in a number only: toy_1 and toy_2 of "toys"."""
        bases = {name, *singulars(name)}
        return tuple(sorted(self.kg.name(thing) for b in bases for thing in self.kg.numbered(b)))

    def rule_called(self, name: str, strict: bool) -> Constraint | None:
        """The constraint of a name; with `strict` also by what an allergy calls it."""
        forms = {name, *singulars(name)}
        for rule in self.domain.constraints:
            if forms & {*rule.names, *(rule.strict if strict else ())}:
                return rule
        return None

    def _action(self, name: str) -> Action | None:
        for action in self.domain.actions.values():
            if name in (action.name, action.verb) or name in action.aliases:
                return action
        return None

    def verb(self, part: Phrase) -> Action | None:
        """The action that a part names, by itself or with what it is done to."""
        return part.action or (self._action(part.words[0]) if len(part.words) > 1 else None)

    def object(self, part: Phrase) -> Iterable[str]:
        """The thing that a part names, or to which it says that something is done."""
        behind = (w for w in part.words[1:] if w not in english.DETERMINERS)
        found = self.kg.find("_".join(behind)) if not part.thing and self.verb(part) else ()
        return filter(None, (part.thing, *map(self.kg.name, found[:1])))

    def done(self, name: str) -> Action | None:
        """The action that a verb names, in -ing or not."""
        return self._action(name) or self._gerund(name)

    def _gerund(self, word: str) -> Action | None:
        """The action that a form in -ing is of: "frying"."""
        bases = sorted(self.forms(word)) if word.endswith("ing") else []
        return next(filter(None, map(self._action, bases)), None)

    def _done(self, word: str) -> bool:
        """Whether a word says what is done to a thing, or how it then is."""
        return bool(self._action(word) or self._state(word)) and self.cooks

    def _state(self, word: str) -> str:
        states = (p for p in self.domain.properties.values() if word in p.state_words)
        return word if next(states, None) else ""

    def noun(self, phrase: str, anything: bool = False) -> bool:
        """Whether a phrase, or its last word, is a noun of the domain's word fields, or of any."""
        for name in (phrase.replace(" ", "_"), phrase.rpartition(" ")[2]):
            bases = {name, *singulars(name)}
            # What a word means first may be left out of the lexicon: heat is no radiator.
            fields = ("noun.", "omitted")
            nouns = [s for s in self.senses(name) if s.field.startswith(fields) and s.base in bases]
            if nouns:
                return anything or nouns[0].field in self.domain.noun_fields
        return False

    def adverb(self, word: str) -> bool:
        """Whether a word says how, where or how often something is done."""
        return word in english.ADVERBS or (word.endswith("ly") and not self.senses(word))

    def holds(self, name: str) -> bool:
        """Whether a thing is a place for others."""
        kg = self.kg
        ranges = [kg.domain.properties[by].range for by in kg.domain.locations]
        return any(kg.is_a(entity, ranges) for entity in kg.find(name)[:1])

    def among_goals(self, name: str) -> bool:
        """Whether a thing is of a class that the domain's goals are about."""
        classes = [URIRef(iri) for goal in self.domain.goals for iri in goal.classes]
        return any(self.kg.is_a(entity, classes) for entity in self.kg.find(name)[:1])

    def barred(self, names: Iterable[str]) -> frozenset[str]:
        """The names of what is excluded, with those of the same things and of kinds of them."""
        found: set[str] = set()
        fields = self.domain.noun_fields
        for name in names:
            base = normal(name)
            called = {base, *singulars(base)}
            called |= {
                normal(a)
                for e in self.kg.find(base)
                for a in (self.kg.name(e), *self.kg.aliases(e))
            }
            near = {r.word for c in called for r in self.lexicon.related(c, fields)
                    if r.relation in ("synonym", "hyponym") and r.sense == 1}  # fmt: skip
            found |= called | near
            found |= set(self._kinds_of(called))
        return frozenset(found)

    def like(self, name: str) -> tuple[str, ...]:
        """The classes of tasks that the lexicon says a dish or a verb is one of."""
        parts = words(name)
        fields = self.domain.noun_fields if self.domain.products else self.domain.verb_fields
        head = parts[-1:] if self.domain.products else parts[:1]
        found = (
            r.word
            for word in ("_".join(parts), *(w for w in head if w not in english.VERBS))
            for r in self.lexicon.related(word, fields)
            if r.relation != "hyponym" and r.word in self.domain.task_classes
        )
        return tuple(dict.fromkeys(found))[:1]

    def _kinds_of(self, called: set[str]) -> Iterable[str]:
        """The known things that the lexicon says are of a kind that is excluded: ham is a cut of
        pork."""
        fields = self.domain.noun_fields
        if not any(self.senses(name) for name in called):
            return
        for name in sorted(self.kg.spellings.bases()):
            above = self.lexicon.related(name, fields) if not called & {name} else ()
            kinds = {r.word for r in above if r.relation == "hypernym" and r.sense == 1}
            if not called.isdisjoint(kinds | {kind.rpartition("_")[2] for kind in kinds}):
                yield from (name, *(normal(self.kg.name(e)) for e in self.kg.numbered(name)))


def number_of(word: str) -> int:
    """The number that a word is, 0 if it is none."""
    if word.isascii() and word.isdigit() and len(word) < 6:
        return int(word)
    return english.NUMBERS.get(word, 0)


def _plain(name: str) -> tuple[str, ...]:
    """The words of a name, without determiners, each in its singular."""
    parts = (word for word in words(name) if word not in english.DETERMINERS)
    return tuple((singulars(word) or (word,))[0] for word in parts)


def _part_of(name: tuple[str, ...], dish: tuple[str, ...], domain: Domain) -> bool:
    """Whether a dish is one of a class by the end of its name, an errand by its beginning."""
    return (dish[-len(name) :] if domain.products else dish[: len(name)]) == name


def _orders(parts: tuple[str, ...]) -> Iterable[tuple[str, ...]]:
    """A name, and with its particle behind its object: "turn on music", "turn music on"."""
    yield parts
    if len(parts) > 2 and parts[1] in PARTICLES:
        yield (parts[0], *parts[2:], parts[1])
