"""What was asked: from a person's words to tasks with required and excluded items (DESIGN, 5).

The words are read left to right, the longest name first: tasks, things, rooms, constraints. What
nothing explains is kept as unread; no word becomes a thing because it is unknown, only a noun that
stands where an ingredient or object stands.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from itertools import takewhile
from typing import Literal

from rdflib import URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core import english
from adaptbot_cli.core.domain import Action, Domain
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import normal, sentence_list, singulars, words
from adaptbot_cli.core.plan import Constraint, Task
from adaptbot_cli.core.terms import TRUE
from adaptbot_cli.core.words import Lexicon, NoLexicon, Sense

_LONGEST_NAME = 5
"""How many words of a request may name one thing."""

_A_SLIP = 0.74
"""How like a known word one must be to be a slip of the pen for it (a ratio of `difflib`)."""

_WORD = re.compile(r"w/o|[^\W_]+(?:['\u2019][^\W_]+)*|[,;.:!?&+]")
_STOPS = frozenset(";.:!?")
_BOUNDARIES = frozenset({"comma", "stop", "and", "or", "but"})
_PARTICLES = frozenset({"on", "off", "up", "out", "away", "down"})
_ENDS = frozenset({*_STOPS, ",", "and", "then", "please", "but", "with", "without"})

Names = Sequence[tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Reading:
    """What a request was understood to ask for: tasks, one after the other.

    `unread` are phrases that nothing explains, `guesses` words that were taken for others, as
    slips of the pen: written, meant. Until a person has confirmed them no goal is said to be met.
    `refused` is what the request says is not to be done; `names` are those of all known tasks.
    """

    text: str
    tasks: tuple[Task, ...]
    unread: tuple[str, ...] = ()
    guesses: tuple[tuple[str, str], ...] = ()
    refused: str = ""
    names: tuple[str, ...] = ()

    @property
    def doubts(self) -> tuple[str, ...]:
        """What a person must confirm, in sentences."""
        found = [f'"{written}" is read as {meant}' for written, meant in self.guesses]
        return (*found, *(f'"{phrase}" is not understood' for phrase in self.unread))

    @property
    def meant(self) -> str:
        """The tasks in words."""
        return "; then ".join(map(told, self.tasks)) or "nothing to do"

    @property
    def line(self) -> str:
        """The reading in one line: what is made, with what, without what, what is unread."""
        parts = [self.meant]
        parts += [f'"{written}" read as {meant}' for written, meant in self.guesses]
        parts += [f"not to be done: {self.refused}"] if self.refused else []
        parts += [f"not understood: {', '.join(self.unread)}"] if self.unread else []
        return " · ".join(parts)

    def confirmed(self) -> "Reading":
        """Return the reading as a person has confirmed it: nothing of it is in doubt."""
        tasks = tuple(replace(task, unread=()) for task in self.tasks)
        return replace(self, tasks=tasks, unread=(), guesses=())


def told(task: Task) -> str:
    """Return a task in words: its name, what it is made with and without, how many."""
    parts = [task.name.replace("_", " ") or "a plan"]
    parts += [f"x{task.amount}"] if task.amount > 1 else []
    parts += [f"with {sentence_list(task.required, 12)}"] if task.required else []
    parts += [f"without {sentence_list(task.excluded, 12)}"] if task.excluded else []
    parts += [f"so that it is {rule.name}" for rule in task.rules if rule.diet]
    parts += [f"to {task.place}"] if task.place and task.place not in task.name else []
    return " ".join(part.replace("_", " ") for part in parts)


def understand(
    text: str,
    kg: Kg,
    lexicon: Lexicon,
    requires: Iterable[str] = (),
    without: Iterable[str] = (),
    dishes: Iterable[str] = (),
) -> Reading:
    """Read a request: which tasks it means, what they require and what must not be used.

    `requires` and `without` add items, by name; `dishes` are names of what plans are known for.
    """
    vocabulary = _Vocabulary(kg, lexicon, tuple(dishes))
    asked = [normal(name) for name in requires if name.strip()]
    banned = [name for name in without if name.strip()]
    if not text.strip():
        task = _with_options(Task("", ()), asked, banned, vocabulary)
        return Reading(text, (task,), task.unread)
    tokens = [word.lower().replace("\u2019", "'") for word in _WORD.findall(text.replace("_", " "))]
    tokens, guesses = vocabulary.respelt(vocabulary.rejoined(tokens))
    reader = _Reader(vocabulary)
    reader.read(vocabulary.parts(tokens))
    tasks = tuple(
        _with_options(task, asked, banned, vocabulary) for task in reader.tasks(normal(text))
    )
    unread = tuple(dict.fromkeys((*reader.unread, *(u for task in tasks for u in task.unread))))
    doubts = (*unread, *(f"{written} ({meant}?)" for written, meant in guesses))
    return Reading(
        text,
        tuple(replace(task, unread=doubts, said=text.strip()) for task in tasks),
        unread,
        tuple(guesses),
        "; ".join(" ".join(part.text for part in clause) for clause in reader.refused),
        tuple(sorted({task.name for _, task in vocabulary.names})) if doubts else (),
    )


def listed(text: str, kg: Kg) -> Task | None:
    """Return the task of the domain that a text names, if it names one and says nothing else."""
    reading = understand(text, kg, NoLexicon())
    task = reading.tasks[0] if len(reading.tasks) == 1 else None
    return task if task is not None and task.known and not reading.doubts else None


def _with_options(
    task: Task, asked: Sequence[str], banned: Sequence[str], vocabulary: "_Vocabulary"
) -> Task:
    """Add what `--requires` and `--without` say exactly."""
    kg = vocabulary.kg
    rules, names, unread = list(task.rules), list(task.excluded), list(task.unread)
    for written in banned:
        rule, name = vocabulary.rule_called(normal(written), strict=True), normal(written)
        found = kg.find(name)
        rules += [rule] if rule and rule not in rules else []
        names.append(kg.name(found[0]) if found else name)
        if not rule and not found and not vocabulary.senses(name):
            near = get_close_matches(name, vocabulary.known_names, 1, _A_SLIP)
            names += near
            unread += [f"without {name}" + (f" ({near[0]}?)" if near else "")]
    excluded = tuple(dict.fromkeys(names))
    required = tuple(dict.fromkeys((*task.required, *asked)))
    barred = task.barred | vocabulary.barred(excluded)
    task = replace(task, rules=tuple(rules), excluded=excluded, barred=barred, unread=tuple(unread))
    needs = next((t.required for t in kg.domain.tasks if t.iri == task.iri), ())
    kept = tuple(n for n in required if n not in needs or n in asked or not excludes(n, task, kg))
    return replace(task, required=kept)


# ------------------------------------------------------------------------------ what is excluded


def excludes(name: str, task: Task, kg: Kg) -> str:
    """Return why a task rules out what bears a name, "" if it does not: the one predicate.

    It looks at the things that bear the name and at the name itself, known or not.
    """
    if normal(name) in task.barred:
        return f"the request excludes {name.replace('_', ' ')}"
    return next(filter(None, (excluded(entity, task, kg) for entity in kg.find(name)[:1])), "")


def excluded(entity: Node, task: Task, kg: Kg) -> str:
    """Return why a task rules out a thing, "" if it does not, or if that is not known."""
    if not task.barred and not task.rules:
        return ""
    name = kg.name(entity)
    if {normal(n) for n in (name, *kg.aliases(entity))} & task.barred:
        return f"the request excludes {name}"
    parts = words(name)
    if len(parts) > 1 and not named_whole(name, task):
        heads = {"_".join(parts[n:]) for n in range(1, len(parts))}
        if heads & task.barred:
            return f"the request excludes {sorted(heads & task.barred)[0]}, which {name} is"
    for rule in task.rules:
        unsafe = kg.is_a(entity, rule.classes) and not kg.ask(rule.query, {"item": entity})
        if unsafe and not unsure(entity, rule, kg):
            return rule.message.format(item=name)
    return ""


def named_whole(name: str, task: Task) -> bool:
    """Tell whether a task names a thing by its whole name: peanut butter is no butter then."""
    said = f" {' '.join(words(task.name))} "
    return f" {' '.join(words(name))} " in said or normal(name) in map(normal, task.required)


def unsure(entity: Node, rule: Constraint, kg: Kg) -> list[URIRef]:
    """Return the attributes of a thing on which a constraint rests and that nobody has said.

    None where what is known settles it: a cheese with milk in it is not vegan, whatever the rest.
    """
    if not kg.is_a(entity, rule.classes) or kg.ask(rule.query, {"item": entity}):
        return []
    if any((entity, prop, TRUE) in kg.facts for prop in rule.props):
        return []
    return [prop for prop in rule.props if kg.value(entity, prop) is None]


def doubtful(entity: Node, task: Task, kg: Kg) -> URIRef | None:
    """Return the attribute to ask for before a thing may be used, if the task rules things out."""
    found = (prop for rule in task.rules for prop in unsure(entity, rule, kg))
    return next(found, None)


def usable(name: str, task: Task, kg: Kg) -> bool:
    """Tell whether a task surely lets a name be used: unknown counts as excluded."""
    if excludes(name, task, kg):
        return False
    return all(doubtful(entity, task, kg) is None for entity in kg.find(name)[:1])


# ------------------------------------------------------------------------------------ the words

Role = Literal["word", "number", "measure", "comma", "stop", "and", "or", "but", "with", "without",
               "allergy", "allergen", "to", "from", "of", "for", "unread", "name"]  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Part:
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
        return " ".join(self.words)


@dataclass(slots=True)
class _Vocabulary:
    """The words that the home, the domain, the plan library and the lexicon know."""

    kg: Kg
    lexicon: Lexicon
    dishes: tuple[str, ...]
    _forms: dict[str, frozenset[str]] = field(default_factory=dict)
    _names: list[tuple[tuple[str, ...], Task]] = field(default_factory=list)
    _known: list[str] = field(default_factory=list)

    @property
    def domain(self) -> Domain:
        return self.kg.domain

    @property
    def cooks(self) -> bool:
        """Whether tasks are named after what they make ("tea"), not after what is to be done."""
        return bool(self.domain.products)

    def senses(self, word: str) -> tuple[Sense, ...]:
        return self.lexicon.senses(word)

    def forms(self, word: str) -> frozenset[str]:
        """A word, its singular and its base forms."""
        if word not in self._forms:
            bases = {sense.base for sense in self.senses(word)}
            self._forms[word] = frozenset({word, *singulars(word)[:1], *bases})
        return self._forms[word]

    def same(self, one: str, other: str) -> bool:
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
                if not any(_part_of(name, _plain(dish), self.domain) for name in classes):
                    named.setdefault(normal(dish), Task(dish, thin=True))
            for name, task in named.items():
                parts = tuple(w for w in words(name) if w not in english.DETERMINERS)
                for form in _orders(parts):
                    self._names.append((form, task))
        return self._names

    @property
    def known_names(self) -> list[str]:
        """Every single name that a word can be a slip for, in a fixed order."""
        if not self._known:
            found = {normal(name) for name in self.kg.names()}
            found |= {normal(name) for e in self.kg.instances(self.domain.kinds)
                      for name in self.kg.aliases(e)}  # fmt: skip
            found |= {
                name for rule in self.domain.constraints for name in (*rule.names, *rule.strict)
            }
            self._known = sorted(found)
        return self._known

    def respelt(self, tokens: list[str]) -> tuple[list[str], list[tuple[str, str]]]:
        """Return the words with slips of the pen put right, and which were."""
        explained = {
            word for part in self.parts(tokens) if part.role != "unread" for word in part.words
        }
        guesses, found = [], []
        for word in tokens:
            near = "" if word in explained or self.senses(word) else self._near(word)
            guesses += [(word, self._main_name(near, word))] if near else []
            found.append(near or word)
        return found, guesses

    def _main_name(self, near: str, written: str) -> str:
        """The name to tell for one that was meant: that of the pack, if it is as like the slip."""
        named = [task.name for name, task in self.names if name == (near,)]
        named += map(self.kg.name, self.kg.find(near))
        return next(iter(get_close_matches(written, named, 1, _A_SLIP)), near)

    def _near(self, word: str) -> str:
        if len(word) < 3 or not word.isalpha() or word in english.CONDITIONS:
            return ""
        known = {w for name in self.known_names for w in words(name)}
        known |= {w for name, _ in self.names for w in name}
        known |= english.VERBS | self.domain.fillers | english.OCCASIONS | english.PEOPLE
        known |= {"without", "with", "please", "could", "would", "free"}
        known |= {
            w for a in self.domain.actions.values() for n in (a.name, *a.aliases) for w in words(n)
        }
        if word in known:
            return ""
        likely = sorted(w for w in known if len(w) > 2 and abs(len(w) - len(word)) <= 3)
        for near in get_close_matches(word, likely, 3, _A_SLIP):
            if near[0] == word[0] or sorted(near) == sorted(word):
                return near
        return ""

    def parts(self, tokens: Sequence[str]) -> list[_Part]:
        """Take the words apart into names, the longest first, and words of English."""
        found: list[_Part] = []
        at = 0
        while at < len(tokens):
            part = self._part(tokens, at)
            found.append(part)
            at += len(part.words)
        return found

    def _part(self, tokens: Sequence[str], at: int) -> _Part:
        grammar = self._grammar(tokens, at)
        name = self._name(tokens, at)
        if name is None:
            return grammar or _Part("unread", (tokens[at],))
        if grammar is None or grammar.role in ("measure", "word"):
            longer = grammar is None or len(name.words) >= len(grammar.words)
            weak = grammar is not None and not (
                name.task or name.thing or name.rule or name.several
            )
            of = tokens[at + 1 : at + 2] == ["of"]
            weak = weak and not (name.action and grammar.role == "measure" and not of)  # type: ignore[union-attr]
            return name if longer and not weak else grammar or name
        return name if len(name.words) > len(grammar.words) else grammar

    def _grammar(self, tokens: Sequence[str], at: int) -> _Part | None:
        word = tokens[at]
        if word in (",", "&", "+") or word in _STOPS:
            role: Role = "comma" if word == "," else "stop" if word in _STOPS else "and"
            return _Part(role, (word,))
        tables: tuple[tuple[Role, tuple[tuple[str, ...], ...]], ...] = (
            ("allergy", english.ALLERGY), ("without", english.WITHOUT), ("with", english.WITH),
            ("and", english.AND), ("or", english.OR), ("but", english.BUT), ("to", english.TO),
            ("from", english.FROM), ("of", english.OF), ("for", english.FOR),
            ("word", english.COURTESY),
        )  # fmt: skip
        best: _Part | None = None
        for role, phrases in tables:
            for phrase in phrases:
                longer = best is None or len(phrase) > len(best.words)
                if longer and tuple(tokens[at : at + len(phrase)]) == phrase:
                    best = _Part(role, phrase)
        if best is not None:
            return best
        if word.isdigit() or word in english.NUMBERS:
            return _Part("number", (word,), number=_count(word))
        if word in english.AFTER_ALLERGEN:
            return _Part("allergen", (word,))
        if word in english.MEASURES:
            return _Part("measure", (word,))
        if word in english.GRAMMAR or word in english.VERBS or word in self.domain.fillers:
            return _Part("word", (word,))
        if word in english.PEOPLE or word in english.OCCASIONS:
            return _Part("word", (word,))
        return None

    def _name(self, tokens: Sequence[str], at: int) -> _Part | None:
        """The longest name that begins here, as everything that it may be."""
        task, end, called = self._task(tokens, at)
        best = end
        thing, state, rule, action = "", "", None, None
        several: tuple[str, ...] = ()
        for length in range(min(_LONGEST_NAME, len(tokens) - at), 0, -1):
            said = tokens[at : at + length]
            if at + length < best or any(not w[0].isalnum() for w in said):
                continue
            if length == 1 and said[0] in english.GRAMMAR:
                continue
            joined = "_".join(said)
            entities = self.kg.find(joined)
            group = self._numbered(joined) if not entities else ()
            ruled = self.rule_called(joined, strict=False)
            act = self._action(joined) or (self._gerund(joined) if length == 1 else None)
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
        said = tuple(tokens[at:best])
        number = next(filter(None, map(_count, said[1:])), 0) if called else 0
        return _Part("name", said, task, thing, several, rule, action, state, number, called)

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
        pairs = {n for n, _ in self.names if len(n) == 2 and n[1] in _PARTICLES}
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
                    or (_count(tokens[at]) and (wanted,) not in (*english.TO, *english.OF))
                )
            ):
                at += 1  # "two toys", and not the toy 2 of "toy 2 in the box"
            if at >= len(tokens) or not self.same(tokens[at], wanted):
                return 0
            at += 1
        return at

    def _numbered(self, name: str) -> tuple[str, ...]:
        """The things of a name that only a number tells apart: toy_1 and toy_2 of "toys"."""
        bases = {name, *singulars(name)}
        found = {n for n in self.kg.names() if n.rpartition("_")[2].isdigit()}
        return tuple(sorted(n for n in found if normal(n).rpartition("_")[0] in bases))

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

    def verb(self, part: _Part) -> Action | None:
        """The action that a part names, by itself or with what it is done to."""
        return part.action or (self._action(part.words[0]) if len(part.words) > 1 else None)

    def object(self, part: _Part) -> Iterable[str]:
        """The thing that a part names, or to which it says that something is done."""
        behind = (w for w in part.words[1:] if w not in english.DETERMINERS)
        found = self.kg.find("_".join(behind)) if not part.thing and self.verb(part) else ()
        return filter(None, (part.thing, *map(self.kg.name, found[:1])))

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
            nouns = [
                s for s in self.senses(name) if s.field.startswith("noun.") and s.base in bases
            ]
            if nouns:
                return anything or nouns[0].field in self.domain.noun_fields
        return False

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
        """The known things that the lexicon says are of a kind that is excluded."""
        fields = self.domain.noun_fields
        if not any(self.senses(name) for name in called):
            return
        for entity in self.kg.instances(self.domain.kinds):
            name = normal(self.kg.name(entity))
            above = self.lexicon.related(name, fields) if not called & {name} else ()
            if any(r.word in called and r.relation == "hypernym" and r.sense == 1 for r in above):
                yield name


def _count(word: str) -> int:
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
    if len(parts) > 2 and parts[1] in _PARTICLES:
        yield (parts[0], *parts[2:], parts[1])


# ---------------------------------------------------------------------------------- the sentence


def _empty(clause: Iterable[_Part]) -> bool:
    """Whether a clause names nothing."""
    return all(part.role == "word" for part in clause)


@dataclass(slots=True)
class _Draft:
    """A task as far as it has been read; without `task` it is what the words say themselves."""

    task: Task | None
    words: list[str] = field(default_factory=list)
    things: list[str] = field(default_factory=list)
    states: list[tuple[str, str]] = field(default_factory=list)
    inside: list[tuple[str, str]] = field(default_factory=list)
    action: Action | None = None
    amount: int = 1
    place: str = ""
    own: str = ""


@dataclass(slots=True)
class _Reader:
    """Reads the parts of a request from left to right.

    `mode` is what the last preposition or negation leads to; `run` are the things and unknown words
    since the last boundary, `pending` those that wait for the task that they belong to; `joined`
    says that a conjunction stands between the last task and here.
    """

    vocabulary: _Vocabulary
    drafts: list[_Draft] = field(default_factory=list)
    mode: str = "main"
    strict: bool = False
    joined: bool = False
    run: list[_Part] = field(default_factory=list)
    pending: list[_Part] = field(default_factory=list)
    number: int = 0
    vessel: str = ""
    state: str = ""
    alike: bool = False
    rules: list[Constraint] = field(default_factory=list)
    excluded: list[str] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    refused: list[Sequence[_Part]] = field(default_factory=list)
    barred_steps: list[tuple[str, str]] = field(default_factory=list)
    asked: bool = False

    @property
    def current(self) -> _Draft | None:
        return self.drafts[-1] if self.drafts else None

    def read(self, parts: Sequence[_Part]) -> None:
        """Read all parts."""
        at = 0
        while at < len(parts):
            at += self._take(parts, at)
        self._end()

    def _take(self, parts: Sequence[_Part], at: int) -> int:
        """Read one part; return how many parts that took."""
        part, after = parts[at], parts[at + 1 :]
        if part.role in _BOUNDARIES:
            self._boundary(part, parts, at)
            return 1
        if after and after[0].role == "allergen" and part.role in ("name", "unread", "measure"):
            self._exclude(part, strict=True)
            return 2
        clause = list(takewhile(lambda p: p.role not in _BOUNDARIES, after))
        leads = part.role in ("to", "from") and (clause or self.mode == "without")  # "put milk in"
        if part.role in ("with", "to", "from") and not leads and _empty(clause):
            self._miss(part.text)
        match part.role:
            case "without" | "allergy":
                return self._negation(part, parts, at)
            case "with":
                # "don't add sugar": the verb belongs to the negation
                if not (self.mode == "without" and parts[at - 1].role in ("without", "word")):
                    self._flush()
                    self.mode = "with"
            case "to" | "from" | "for":
                self._preposition(part, after)
            case "of":
                self._of(after)
            case "number":
                self._number(part, after)
            case "measure":
                pass
            case "word":
                self._word(part, parts[at - 1] if at else None)
            case "allergen":
                self._miss(part.text)
            case _:
                self._named(part, after) if part.role == "name" else self._unknown(part)
        return 1

    # boundaries ------------------------------------------------------------------------------

    def _boundary(self, part: _Part, parts: Sequence[_Part], at: int) -> None:
        self._flush()
        self.joined = True
        ends = part.role in ("stop", "but") or "then" in part.words
        after = parts[at + 1 :]
        if ends or self.mode in ("to", "from", "for") or self._begins(after, part.role == "comma"):
            self.mode, self.strict = "main", False
        elif after and set(after[0].words) & english.MORE and self.mode == "without":
            self.mode, self.strict = "with" if self.drafts else "main", False
        if part.role == "or" and self.mode != "without":
            around = [p.text for p in (*parts[max(at - 1, 0) : at], part, *parts[at + 1 : at + 2])]
            self._miss(" ".join(around))

    def _begins(self, after: Sequence[_Part], comma: bool = False) -> bool:
        """Whether a new task begins here: by its verb, or by its name where nothing is excluded.

        After a comma it may be the only one, and what is excluded have come first: "no milk, tea".
        """
        first = next((p for p in after if p.role not in ("word", "number", "measure")), None)
        verbs = [w for p in after[:1] for w in p.words if p.role == "word" and w in english.VERBS]
        if first is None or first.role != "name":
            return bool(verbs)
        verbal = first.task is not None and not first.thing and self._verbal(first)
        only = comma and not self.drafts and not any(p.task for p in after if p is not first)
        if verbs or verbal or (first.task is not None and (only or self.mode != "without")):
            return True
        # "... and a ham sandwich": what ends in a dish is one
        phrase = takewhile(lambda p: p.role in ("name", "word", "number", "measure", "of"), after)
        last = [part for part in phrase if part.role == "name"][-1:]
        return any(part.task is not None and not part.thing for part in last)

    def _verbal(self, part: _Part) -> bool:
        """Whether a task's name begins with what is to be done."""
        return not self.vocabulary.cooks or self.vocabulary.verb(part) is not None

    # what is excluded ------------------------------------------------------------------------

    def _negation(self, part: _Part, parts: Sequence[_Part], at: int) -> int:
        self._flush()
        verbs = english.VERBS | english.USES | (self.vocabulary.domain.fillers - english.GRAMMAR)
        following = [p for p in parts[at + 1 :] if p.role != "word" or set(p.words) & verbs]
        first = following[0] if following else None
        verbal = bool(set(part.words) & english.VERBAL) or part.words == ("do", "not")
        steps = first is not None and first.action is not None and not self._uses(first)
        if (verbal and (first is None or self._asks(first))) or (steps and self.vocabulary.cooks):
            return 1 + self._refuse(parts[at + 1 :])
        if _empty(takewhile(lambda p: p.role not in _BOUNDARIES, parts[at + 1 :])):
            self._miss(part.text)  # "tea without"
        self.mode, self.strict = "without", part.role == "allergy"
        self.joined = True
        return 1

    def _asks(self, part: _Part) -> bool:
        """Whether a part is a verb that asks for a task, so that "don't" takes it back."""
        if part.role == "word" or self._uses(part):
            return not self._uses(part)
        verb = part.action is not None or (part.task is not None and self._verbal(part))
        return part.role == "name" and verb and not (part.thing and not self.vocabulary.cooks)

    def _uses(self, part: _Part) -> bool:
        """Whether a part is a verb after which a negation rules out a thing, not the task."""
        verb = part.role == "word" or (self.vocabulary.cooks and part.action is not None)
        return verb and bool(set(part.words) & english.USES)

    def _refuse(self, parts: Sequence[_Part]) -> int:
        """Take up what is not to be done, to the end of its clause."""
        taken = 0
        for n, part in enumerate(parts):
            if part.role in ("stop", "but") or "then" in part.words:
                break
            if part.role in ("comma", "and") and self._begins(parts[n + 1 :]):
                break
            taken += 1
        self.refused.append(parts[:taken])
        return taken

    def _ruled_out(self, clause: Sequence[_Part]) -> None:
        """Let what is not to be done hold for the tasks beside it: a step, a thing, another task.

        A clause that says nothing of the kind has not been understood, nor has one that takes back
        what is asked for.
        """
        names = [part for part in clause if part.role == "name"]
        things = [n for part in names for n in (*self.vocabulary.object(part), *part.several)]
        verbs = [self.vocabulary.verb(part) for part in names if not part.thing]
        steps = [verb.name for verb in verbs if verb]
        others = [part.task for part in names if part.task and not part.thing]
        asked = [(draft.task, set(draft.things)) for draft in self.drafts]
        again = any(task in others and things_ >= set(things) for task, things_ in asked)
        for action in steps:
            self.barred_steps += [(action, thing) for thing in things or ("",)]
        if not steps and not again and not (self.vocabulary.cooks and others):
            self.excluded += [n for n in things if n not in self.excluded]
        strange = any(part.role == "unread" for part in clause)
        if again or strange or not (things or steps or (others and self.vocabulary.cooks)):
            self._miss(" ".join(("not", *(word for part in clause for word in part.words))))

    def _exclude(self, part: _Part, strict: bool) -> None:
        """Rule out what a part names: the thing, and the allergen of that name."""
        name = normal(part.text)
        rule = self.vocabulary.rule_called(name, strict) or part.rule
        if rule is not None and rule not in self.rules:
            self.rules.append(rule)
        self.excluded += [n for n in (part.thing or name, *part.several) if n not in self.excluded]
        known = rule or part.thing or part.several or self.vocabulary.noun(part.text)
        if not known or (strict and rule is None):
            self._miss(f"without {part.text}")

    # names -----------------------------------------------------------------------------------

    def _named(self, part: _Part, after: Sequence[_Part]) -> None:
        if part.rule is not None and (part.rule.diet or self.mode == "for"):
            self.rules += [part.rule] if part.rule not in self.rules else []
            return
        if self.mode == "without":
            self._without(part, after)
        elif self.mode in ("to", "from", "for"):
            self._placed(part)
        elif part.task is not None and self._is_task(part, after):
            self._begin(part)
        elif part.thing or part.several:
            self._thing(part, after)
        elif part.action is not None and self._starts_clause():
            self.drafts.append(_Draft(None, list(part.words), action=part.action))
            self.joined, self.asked = False, True
        elif part.state:
            self.state = part.state
        else:
            self._unknown(part)

    def _starts_clause(self) -> bool:
        return self.mode == "main" and not self.run and (self.joined or not self.drafts)

    def _without(self, part: _Part, after: Sequence[_Part]) -> None:
        task = part.task is not None and not self._verbal(part)
        of_dish = part.thing and after and after[0].task  # "no nuts banana smoothie"
        if (task or of_dish) and not self.drafts and not self.joined:
            self.mode = "main"
            self._thing(part, after) if of_dish else self._begin(part)
        elif part.thing or part.several or part.rule or part.task:
            self._exclude(part, self.strict)
            self.joined = False
        elif (part.action or part.state) and not self._uses(part):
            self._miss(f"without {part.text}")
        elif part.action or part.state:
            pass  # "don't put milk in"
        else:
            self._unknown(part)

    def _is_task(self, part: _Part, after: Sequence[_Part]) -> bool:
        """Whether a name that begins here is that of a task, rather than a thing for one."""
        if self.vocabulary.cooks:
            thing_only = self.mode == "with" and part.thing
            follows = after[0] if after else None
            modifies = part.thing and follows is not None and follows.role == "name" and (
                follows.task is not None or follows.thing)  # fmt: skip
            return not thing_only and not modifies
        if not part.thing:
            return True
        follows = next((p for p in after if p.role != "word"), None)
        object_ = follows is not None and (follows.thing or follows.several)
        object_ = object_ or (bool(after) and bool(set(after[0].words) & english.IT))
        return self.current is None or (self.joined and bool(object_) and len(part.words) < 2)

    def _begin(self, part: _Part) -> None:
        """Begin a task, with the things before it that belong to it."""
        cooks = self.vocabulary.cooks
        before = [*self.pending, *self.run] if cooks else []
        if self.drafts and not self.joined and not before:
            last = self.drafts[-1]
            if not cooks or not last.own or last.things[1:]:
                self._miss(part.text)
                return
            self.drafts.pop()  # "tea cake": the tea is no task of its own
            before = [_Part("name", tuple(last.words), thing=last.own)]
        self.pending, self.run = [], []
        draft = _Draft(part.task, amount=self.number or part.number or 1)
        self.number, self.mode, self.joined, self.asked = 0, "main", False, True
        self.drafts.append(draft)
        for modifier in before:
            self._modify(draft, modifier)
        draft.words += part.called or part.words
        if part.thing and cooks:
            draft.own = part.thing
            draft.things.append(part.thing)
            draft.states += [(part.thing, self.state)] if self.state else []
            self.state = ""

    def _modify(self, draft: _Draft, part: _Part) -> None:
        """Let what stands before a dish go into it, if it is a thing or could be one."""
        name = part.text.replace(" ", "_")
        if part.thing or part.several:
            draft.things += [part.thing] if part.thing else part.several
        elif self.vocabulary.noun(part.text):
            draft.things.append(name)
        else:
            self._miss(part.text)
            return
        draft.words += part.words
        draft.states += [(draft.things[-1], part.state)] if part.state else []

    def _thing(self, part: _Part, after: Sequence[_Part]) -> None:
        several = part.several
        if set(part.words) & english.MEASURES and after and after[0].role == "of":
            self.run.append(replace(part, task=None))  # the number goes to what it is full of
            return
        if several and self.number:
            several = several[: self.number]
            if len(several) < self.number:
                self._miss(f"{self.number} {part.text}")
        elif self.number > 1:
            self._miss(f"{self.number} {part.text}")  # no plan counts its eggs
        self.number = 0
        if self.vessel and part.thing:
            part = replace(part, words=(*self.vessel.split("_"), "of", *part.words))
            inside = (part.thing, self.vessel)
            target = self.current or _Draft(None)
            target.inside.append(inside)
            if self.current is None:
                self.drafts.append(target)
            self.run.append(_Part("name", (), thing=self.vessel))
            self.vessel = ""
        self.run.append(replace(part, several=several, state=self.state or "", task=None))
        self.state = ""

    def _unknown(self, part: _Part) -> None:
        """Take up an unknown word; with the noun before it it is one name: "tomato sauce"."""
        if set(part.words) & english.CONDITIONS:
            self._miss(part.text)
            return
        last = self.run[-1] if self.run else None
        compound = last and last.thing and self.vocabulary.noun(part.text)
        if last and last.words and (last.role == "unread" or compound):
            self.run[-1] = _Part("unread", (*last.words, *part.words))
        else:
            self.run.append(_Part("unread", part.words))

    # prepositions and the rest ------------------------------------------------------------------

    def _preposition(self, part: _Part, after: Sequence[_Part]) -> None:
        follows = next((p for p in after if p.role != "word"), None)
        self._flush()
        if self.mode == "without" and part.role == "for":  # "replace sugar for honey"
            self.mode = "with"
            return
        if part.role == "to" and follows is not None and follows.role == "unread":
            self.mode = "to"
        self.mode = part.role
        if not after or after[0].role in ("stop", "comma", "and"):
            self.mode = "main"

    def _placed(self, part: _Part) -> None:
        """A name behind a preposition: where something goes, comes from, or what it is for."""
        draft = self.current
        if part.task is not None and (not part.thing or not self.drafts) and self.vocabulary.cooks:
            self.mode, self.joined = "main", True
            self._begin(part)
            return
        name = part.thing or next(iter(part.several), "")
        if not name:
            self._miss(part.text)
        elif self.mode == "from":
            if not self._kept_in(name):
                self._miss(f"from {part.text}")
        elif self.mode == "for":
            self.run.append(replace(part, task=None))
        else:
            if draft is None:
                draft = _Draft(None)
                self.drafts.append(draft)
            draft.place = name
            draft.words += ("to", *part.words)
        self.number = 0

    def _kept_in(self, place: str) -> bool:
        """Whether every thing named so far is where it is to be taken from."""
        kg = self.vocabulary.kg
        things = [*(self.current.things if self.current else ()), *(p.thing for p in self.pending)]
        places = set(kg.find(place))
        for thing in filter(None, things):
            at: list[Node] = list(kg.find(thing)[:1])
            seen: set[Node] = set()
            while at and not seen & places:
                node = at.pop()
                if node not in seen:
                    seen.add(node)
                    at += [o for p in kg.domain.locations for o in kg.facts.objects(node, p)]
            if not seen & places:
                return False
        return True

    def _of(self, after: Sequence[_Part]) -> None:
        """A vessel of something: "a glass of water"."""
        last = self.run[-1] if self.run else None
        follows = next((p for p in after if p.role != "word"), None)
        dish = follows is not None and follows.task is not None and self.vocabulary.cooks
        if last is None or not last.thing:
            return
        if set(last.words) & english.MEASURES and (dish or self.mode == "with"):
            self.run.pop()  # a measure only
        elif follows is not None and follows.thing:
            self.run.pop()
            self.vessel = last.thing

    def _number(self, part: _Part, after: Sequence[_Part]) -> None:
        if self.mode == "for":
            if self.current is not None:
                self.current.amount = max(part.number, 1)
            else:
                self.number = part.number
            return
        follows = next((p for p in after if p.role not in ("word", "of")), None)
        if follows is not None and set(follows.words) & english.UNITS:
            self._miss(f"{part.text} {follows.text}")
        elif follows is not None and follows.role in ("name", "measure"):
            self.number = 0 if part.words == ("one",) or part.number == 1 else part.number
        elif part.number != 1 or part.words == ("1",):
            self._unknown(_Part("unread", part.words))

    def _word(self, part: _Part, before: _Part | None) -> None:
        word = part.words[0]
        verb = word in english.VERBS
        like = verb and before is not None and before.role == "name"  # "tea like my grandma's"
        ordinary = word in english.GRAMMAR or verb or len(part.words) > 1
        belongs = word in self.vocabulary.domain.fillers or self.mode == "for"
        belongs = belongs or (word in english.PEOPLE and self.mode != "to")
        if (
            (not ordinary and not belongs)
            or like
            or (self.mode == "with" and (verb or word == "just"))
        ):
            self._miss(part.text)
        if verb or word in self.vocabulary.domain.fillers:
            self.asked = self.asked or word not in english.GRAMMAR
        if self.mode == "without" and verb and word not in english.USES:
            self.mode = "main"

    def _flush(self) -> None:
        """End a run of names: what it holds goes where the last preposition says."""
        run, self.run = self.run, []
        if self.vessel:
            run.append(_Part("name", tuple(self.vessel.split("_")), thing=self.vessel))
            self.vessel = ""
        if self.state:
            self._miss(self.state)
            self.state = ""
        if not run:
            return
        if self.mode == "without":
            for part in run:
                self._exclude(part, self.strict)
        elif self.mode in ("to", "from", "for"):
            for part in run:
                self._miss(f"{self.mode} {part.text}") if not part.thing else self._add(part)
        elif self.current is not None and (self.mode == "with" or not self._waits()):
            for part in run:
                self._add(part)
        else:
            self.pending += run

    def _waits(self) -> bool:
        """Whether things may belong to a dish that is still to be named."""
        return self.vocabulary.cooks and self.joined

    def _add(self, part: _Part) -> None:
        """Let a thing go into the current task; an unknown one only if it could be one."""
        draft = self.current
        if draft is None:
            self.pending.append(part)
            return
        name = part.text.replace(" ", "_")
        behind = self.mode == "with" or not self.vocabulary.cooks
        if part.thing or part.several:
            found = [part.thing] if part.thing else list(part.several)
            draft.things += found
            draft.states += [(found[0], part.state)] if part.state else []
        elif behind and (
            self.vocabulary.noun(part.text, anything=draft.action is not None)
            or self._nameless(part.text)
        ):
            draft.things.append(name)
        else:
            self._miss(part.text)
            return
        draft.words += (*(("with",) if self.mode == "with" else ()), *part.words)

    def _nameless(self, phrase: str) -> bool:
        """Whether a short phrase may name a thing that no dictionary has."""
        parts = phrase.split()
        return (
            self.mode == "with" and len(parts) <= 2 and not any(map(self.vocabulary.senses, parts))
        )

    def _miss(self, phrase: str) -> None:
        if phrase and phrase not in self.unread:
            self.unread.append(phrase)

    def _end(self) -> None:
        self._flush()
        self._settle()
        self._share()
        for clause in self.refused if self.drafts else ():
            self._ruled_out(clause)

    def _share(self) -> None:
        """Let a bare verb be about what the verb beside it is: "wash and fold the towels"."""
        for n, draft in enumerate(self.drafts):
            about = draft.things or draft.place or draft.task is None or draft.task.known
            if self.vocabulary.cooks or about or set(draft.words[1:]) - _PARTICLES:
                continue
            for other in (*self.drafts[n + 1 : n + 2], *self.drafts[max(n - 1, 0) : n]):
                needs = other.task.required if other.task else ()
                named = [name for name in needs if set(words(name)) <= set(other.words)]
                draft.things = draft.things or other.things or named
            if not draft.things:
                self._miss(f"what to {' '.join(draft.words)}")

    def _settle(self) -> None:
        """Let what still waits for a task go into the last one, or be one."""
        left, self.pending = self.pending, []
        if not left:
            return
        if self.current is not None:
            for part in left:
                self._add(part) if part.thing or part.several else self._miss(part.text)
            return
        draft = _Draft(None)
        self.drafts.append(draft)
        for part in left:
            if part.thing or part.several:
                draft.things += [part.thing] if part.thing else part.several
                draft.states += [(draft.things[-1], part.state)] if part.state else []
            elif not (self.asked and self.vocabulary.noun(part.text) and len(left) == 1):
                self._miss(part.text)
            draft.words += part.words

    # tasks ------------------------------------------------------------------------------------

    def tasks(self, text: str) -> tuple[Task, ...]:
        """Return the tasks that were read; one that nothing is known of if nothing was."""
        if not self.drafts and not self.refused and not self.excluded:
            name = text.replace("_", " ")
            return (Task(name, thin=True, like=self.vocabulary.like(name)),)
        return tuple(self._task(draft) for draft in self.drafts)

    def _task(self, draft: _Draft) -> Task:
        task = draft.task
        things = tuple(dict.fromkeys(draft.things))
        excluded = tuple(dict.fromkeys(self.excluded))
        vocabulary = self.vocabulary
        place = draft.place
        if place and vocabulary.among_goals(place):
            things = tuple(dict.fromkeys((*things, place)))
        name = " ".join(dict.fromkeys(draft.words)) or sentence_list(things)
        read = Task(
            name,
            things,
            excluded=excluded,
            barred=vocabulary.barred(excluded),
            rules=tuple(self.rules),
            amount=draft.amount,
            place=place,
            inside=tuple(draft.inside),
            states=tuple(self._states(draft)),
            refused=tuple(self.barred_steps),
        )
        if task is not None and task.iri is not None:
            needed = [n for n in task.required if not any(self._serves(t, n) for t in things)]
            required = tuple(dict.fromkeys((*needed, *things)))
            return replace(
                read,
                name=task.name if task.known else name,
                required=required,
                goals=task.goals,
                known=task.known,
                iri=task.iri,
                judged_by=task.judged_by,
            )
        thin = not read.states and not read.inside
        return replace(read, thin=thin, like=vocabulary.like(name) if thin else ())

    def _serves(self, named: str, needed: str) -> bool:
        """Whether a thing serves as another does: both are fit to act "with" in the same action."""
        kg = self.vocabulary.kg
        pair = [*kg.find(named)[:1], *kg.find(needed)[:1]]
        return len(pair) == 2 and any(
            rule.of == part.name and all(kg.value(thing, rule.prop) == rule.value for thing in pair)
            for action in kg.domain.actions.values()
            for part in action.parameters
            if "with" in part.prepositions and all(kg.is_a(t, part.classes) for t in pair)
            for rule in action.attributes
        )

    def _states(self, draft: _Draft) -> Iterable[tuple[str, URIRef]]:
        """The states that the words ask for: of a thing ("sliced onion"), or by a verb."""
        kg = self.vocabulary.kg
        for name, word in draft.states:
            for prop in kg.domain.properties.values():
                found = kg.find(name)
                if word in prop.state_words and (not found or kg.is_a(found[0], [prop.domain])):
                    yield name, prop.iri
                    break
        effect = draft.action.effect if draft.action else None
        for subject, predicate, value in effect.inserts if effect else ():
            if isinstance(subject, Variable) and isinstance(predicate, URIRef) and value == TRUE:
                first = draft.action.parameters[0].name if draft.action else ""
                known = kg.domain.properties.get(predicate)
                classes = [known.domain] if known else []
                for name in draft.things if str(subject) == first else ():
                    found = kg.find(name)
                    if not found or any(kg.is_a(e, classes) for e in found):
                        yield name, predicate
