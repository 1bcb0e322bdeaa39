"""What was asked: from a person's words to tasks with required and excluded items (DESIGN, 5).

`naming.py` says what its words may name, `clauses.py` what they come to. Here is what holds for the
whole: what a person confirms, and the one predicate for what is excluded.
"""

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import TRUE
from adaptbot_cli.core.names import normal, sentence_list, words
from adaptbot_cli.core.plan import Constraint, Task
from adaptbot_cli.core.request.clauses import Clauses
from adaptbot_cli.core.request.naming import A_SLIP, Naming, number_of
from adaptbot_cli.core.words import Lexicon, NoLexicon

_WORD = re.compile(
    r"w/o(?:ut)?\b|w/|(?<!\S)-\d+|\d+(?:[.,:/-]\d+)+|[^\W_]+(?:['\u2019][^\W_]+)*|[,;.:!?&+/%)]|[^\w\s]"
)
_MINUS = re.compile(r"(?<=\s)[-!\u00ac](?=[^\W_])")
"""A sign that takes the word behind it away: "tea -sugar"."""

_PLAIN = str.maketrans("_\u2019\n\uff0c\u3001\uff1b\u3002\uff1a", " ',,,;.:")
"""Marks as they are read: a new line parts what is asked for as a comma does."""

_MARKS = ",;.:!?&+/%)"
_SIGNS = ("Sc", "Sm", "So")
"""The Unicode categories of signs that mean something; other marks only part or point out words."""


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
        return (*found, *(f'"{phrase}" is {trouble(phrase)}' for phrase in self.unread))

    @property
    def meant(self) -> str:
        """The tasks in words."""
        return "; then ".join(map(describe, self.tasks)) or "nothing to do"

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


def trouble(phrase: str) -> str:
    """Return what a phrase is that is unread: "2 eggs" are clear, but nothing counts them."""
    return "a number that no plan counts" if phrase[0].isdigit() else "not understood"


def describe(task: Task) -> str:
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
    naming = Naming(kg, lexicon, tuple(dishes))
    asked = [normal(name) for name in requires if name.strip()]
    banned = [name for name in without if name.strip()]
    if not text.strip():
        task = _with_options(Task("", ()), asked, banned, naming)
        return Reading(text, (task,), task.unread)
    tokens = _words(text)
    tokens, guesses = naming.respelt(naming.rejoined(tokens))
    reader = Clauses(naming)
    reader.read(naming.parts(tokens))
    named = [draft.things for draft in reader.drafts] or [[]]
    tasks = tuple(
        _with_options(task, [*asked, *things], banned, naming)
        for task, things in zip(reader.tasks(normal(text)), named, strict=False)
    )
    unread = tuple(dict.fromkeys((*reader.unread, *(u for task in tasks for u in task.unread))))
    doubts = (*unread, *(f"{written} ({meant}?)" for written, meant in guesses))
    return Reading(
        text,
        tuple(replace(task, unread=doubts, said=text.strip()) for task in tasks),
        unread,
        tuple(guesses),
        "; ".join(" ".join(part.text for part in clause) for clause in reader.refused),
        tuple(sorted({task.name for _, task in naming.names})) if doubts else (),
    )


def _words(text: str) -> list[str]:
    """The words, numbers, marks and signs of a text, in lower case."""
    plain = _MINUS.sub(" without ", text.translate(_PLAIN).lower())
    return [
        word
        for word in _WORD.findall(plain)
        if word[1:] or word.isalnum() or word in _MARKS or unicodedata.category(word) in _SIGNS
    ]


def listed(text: str, kg: Kg) -> Task | None:
    """Return the task of the domain that a text names, None if it asks for anything else."""
    reading = understand(text, kg, NoLexicon())
    task = reading.tasks[0] if len(reading.tasks) == 1 else None
    return task if task is not None and task.known and not reading.doubts else None


def _with_options(
    task: Task, asked: Sequence[str], banned: Sequence[str], naming: "Naming"
) -> Task:
    """Add what `--requires` and `--without` say exactly; what a task needs but they or the request
    exclude falls away, unless it is `asked` for by name as well.
    """
    kg = naming.kg
    rules, names, unread = list(task.rules), list(task.excluded), list(task.unread)
    refused = list(task.refused)
    unread += [name for name in asked if number_of(name.partition("_")[0]) and not kg.find(name)]
    for written in banned:
        rule, name = naming.rule_called(normal(written), strict=True), normal(written)
        found = kg.find(name)
        action = None if rule or found else naming.done(name)
        if action is not None:
            refused.append((action.name, ""))
            continue
        rules += [rule] if rule and rule not in rules else []
        names.append(kg.name(found[0]) if found else name)
        if not rule and not found and not naming.noun(name):
            near = get_close_matches(name, naming.names_like(name), 1, A_SLIP)
            names += near
            unread += [f"without {name}" + (f" ({near[0]}?)" if near else "")]
    excluded = tuple(dict.fromkeys(names))
    required = tuple(dict.fromkeys((*task.required, *asked)))
    barred = task.barred | naming.barred(excluded)
    task = replace(task, rules=tuple(rules), excluded=excluded, barred=barred)
    task = replace(task, refused=tuple(refused), unread=tuple(unread))
    listed = (*kg.domain.tasks, *kg.domain.task_classes.values())
    needs = next((each.required for each in listed if each.iri == task.iri), ())
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
    text = f" {' '.join(words(task.name))} "
    # Peanut butter is no butter where the task names it whole.
    whole = f" {' '.join(parts)} " in text or normal(name) in map(normal, task.required)
    if len(parts) > 1 and not whole:
        heads = {"_".join(parts[n:]) for n in range(1, len(parts))}
        if heads & task.barred:
            return f"the request excludes {sorted(heads & task.barred)[0]}, which {name} is"
    for rule in task.rules:
        unsafe = kg.is_a(entity, rule.classes) and not kg.ask(rule.query, {"item": entity})
        if unsafe and not unsure(entity, rule, kg):
            return rule.message.format(item=name)
    return ""


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
