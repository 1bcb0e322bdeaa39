"""The clauses of a request, read from left to right: what is asked for, excluded, refused, unread.

What nothing explains is kept as unread; no word becomes a thing because it is unknown, only a noun
that stands where an ingredient or object stands.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile

from rdflib import URIRef, Variable

from adaptbot_cli.core import english
from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import TRUE
from adaptbot_cli.core.names import normal, sentence_list, singulars, words
from adaptbot_cli.core.plan import Constraint, Goal, Task
from adaptbot_cli.core.request.naming import BOUNDARIES, PARTICLES, Naming, Phrase


def concerns(goal: Goal, names: Iterable[str], kg: Kg) -> bool:
    """Tell whether a goal is asked at all: of the world, or of one of some items."""
    classes = [URIRef(iri) for iri in goal.classes]
    things = (entity for name in names for entity in kg.find(name)[:1])
    return not classes or any(kg.is_a(entity, classes) for entity in things)


def _empty(clause: Iterable[Phrase]) -> bool:
    """Whether a clause names nothing; "the one" stands for what was named."""
    return all(part.role == "word" or part.words == ("one",) for part in clause)


@dataclass(slots=True)
class _Draft:
    """A task as far as it has been read; without `task` it is what the words say themselves."""

    task: Task | None
    words: list[str] = field(default_factory=list)
    things: list[str] = field(default_factory=list)
    several: list[str] = field(default_factory=list)
    states: list[tuple[str, str]] = field(default_factory=list)
    inside: list[tuple[str, str]] = field(default_factory=list)
    action: Action | None = None
    amount: int = 1
    place: str = ""
    own: str = ""
    without: list[str] = field(default_factory=list)

    @property
    def known(self) -> bool:
        """Whether it is a task that the domain lists, with goals of its own."""
        return self.task is not None and self.task.known


@dataclass(slots=True)
class Clauses:
    """Reads the parts of a request from left to right.

    `mode` is what the last preposition or negation leads to; `run` are the things and unknown words
    since the last boundary, `pending` those that wait for the task that they belong to; `joined`
    says that a conjunction stands between the last task and here, `local` that none stood before
    the negation, which then is this task's own.
    """

    naming: Naming
    drafts: list[_Draft] = field(default_factory=list)
    mode: str = "main"
    strict: bool = False
    swaps: bool = False
    local: bool = False
    joined: bool = False
    run: list[Phrase] = field(default_factory=list)
    pending: list[Phrase] = field(default_factory=list)
    number: int = 0
    vessel: str = ""
    state: str = ""
    rules: list[Constraint] = field(default_factory=list)
    excluded: list[str] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    refused: list[Sequence[Phrase]] = field(default_factory=list)
    barred_steps: list[tuple[str, str]] = field(default_factory=list)
    asked: bool = False

    @property
    def current(self) -> _Draft | None:
        """The task that is being read."""
        return self.drafts[-1] if self.drafts else None

    def read(self, parts: Sequence[Phrase]) -> None:
        """Read all parts."""
        at = 0
        while at < len(parts):
            at += self._take(parts, at)
        self._end()

    def _take(self, parts: Sequence[Phrase], at: int) -> int:
        """Read one part; return how many parts that took."""
        part, after = parts[at], parts[at + 1 :]
        if part.role in BOUNDARIES:
            self._boundary(part, parts, at)
            return 1
        if after and after[0].role == "allergen" and part.role in ("name", "unread", "measure"):
            self._exclude(part, strict=True)
            return 2
        last = parts[at - 1] if at and parts[at - 1].role == "unread" else None
        if last and part.role in ("number", "unread") and english.CONDITIONS & {*last.words}:
            self._miss(part.text)  # "before 8", "every day"
            return 1
        clause = list(takewhile(lambda p: p.role not in BOUNDARIES, after))
        points = any(english.POINTERS & {*p.words} for p in clause) or self.mode == "without"
        leads = part.role in ("to", "from") and points  # "to me", "put milk in"
        if part.role in ("with", "to", "from") and not leads and _empty(clause):
            self._miss(part.text)
        match part.role:
            case "without" | "allergy":
                return self._negation(part, parts, at)
            case "with":
                # "don't add sugar": the verb belongs to the negation
                if at and parts[at - 1].text == "just":
                    self._miss("just")
                if not (self.mode == "without" and parts[at - 1].role in ("without", "word")):
                    self._flush()
                    self.mode = "with"
            case "to" if after and english.VERBS & {*after[0].words}:
                self._flush()  # "possible to get tea"
                self.mode = "main"
            case "to" | "from" | "for":
                self._preposition(part, after)
            case "of":
                self._of(after)
            case "number" if after and english.OF_TIME & {*after[0].words}:
                self._miss(f"{part.text} {after[0].text}")
                return 2
            case "number":
                self._number(part, after)
            case "measure":
                if self.mode == "to":
                    self._miss(f"to {part.text}")  # such a vessel is not known here
            case "word":
                self._word(part, parts[at - 1] if at else None)
            case "allergen":
                self._miss(part.text)
            case _:
                self._named(part, after) if part.role == "name" else self._unknown(part)
        return 1

    # boundaries ------------------------------------------------------------------------------

    def _boundary(self, part: Phrase, parts: Sequence[Phrase], at: int) -> None:
        self._flush()
        self.joined = True
        ends = part.role in ("stop", "but") or "then" in part.words
        after = parts[at + 1 :]
        if ends or self.mode in ("to", "from", "for") or self._begins(after, part.role == "comma"):
            self.mode, self.strict = "main", False
        elif after and set(after[0].words) & english.MORE and self.mode == "without":
            self.mode, self.strict = "with" if self.drafts else "main", False
        before = list(takewhile(lambda p: p.role not in BOUNDARIES, reversed(parts[:at])))
        rest = next((p for p in after if p.role != "word"), None)
        all_but = part.role == "but" and any(english.ALL & {*p.words} for p in before)
        if all_but and rest is not None and rest.role in ("name", "unread") and not rest.action:
            self.mode = "without"
        elif after and after[0].task and self.mode == "without" and self.drafts:
            self._miss(f"{part.text} {after[0].text}")  # "without milk and coffee": to have, or not
        if part.role == "but" and after and after[0].role in ("to", "from", "for"):
            self._miss(f"{part.text} {after[0].text}")  # "no milk in the tea, but in the coffee"
        if part.role == "or" and self.mode != "without":
            around = [p.text for p in (*parts[max(at - 1, 0) : at], part, *parts[at + 1 : at + 2])]
            self._miss(" ".join(around))

    def _begins(self, after: Sequence[Phrase], comma: bool = False) -> bool:
        """Whether a new task begins here: by its verb, or by its name where nothing is excluded.

        After a comma it may be the only one, and what is excluded have come first: "no milk, tea".
        What is counted is asked for: "without chives and two teas".
        """
        first = next((p for p in after if p.role not in ("word", "number", "measure")), None)
        verbs = [w for p in after[:1] for w in p.words if p.role == "word" and w in english.VERBS]
        if first is None or first.role != "name":
            return bool(verbs)
        verbal = first.task is not None and not first.thing and self._verbal(first)
        counted = any(p.role == "number" or {"a", "an"} & {*p.words} for p in after[:1])
        alone = not self.drafts and not any(p.task for p in after if p is not first)
        only = counted or (comma and alone)
        if verbs or verbal or (first.task is not None and (only or self.mode != "without")):
            return True
        # "... and a ham sandwich": what ends in a dish is one
        phrase = takewhile(lambda p: p.role in ("name", "word", "number", "measure", "of"), after)
        last = [part for part in phrase if part.role == "name"][-1:]
        return any(part.task is not None and not part.thing for part in last)

    def _verbal(self, part: Phrase) -> bool:
        """Whether a task's name begins with what is to be done."""
        return not self.naming.cooks or self.naming.verb(part) is not None

    # what is excluded ------------------------------------------------------------------------

    def _negation(self, part: Phrase, parts: Sequence[Phrase], at: int) -> int:
        self._flush()
        before = next((p for p in reversed(parts[:at]) if p.role != "word"), None)
        if before is not None and before.role == "without":  # "don't leave out the milk"
            taken = before.words[0] in english.VERBAL and part.words[0] not in english.NONE
            self.mode = "with" if taken else self.mode
            if not taken:
                self._miss(f"{before.text} {part.text}")
            return 1
        verbs = english.VERBS | english.USES | (self.naming.domain.fillers - english.GRAMMAR)
        following = [p for p in parts[at + 1 :] if p.role != "word" or set(p.words) & verbs]
        first = following[0] if following else None
        verbal = bool(set(part.words) & english.VERBAL) or part.words == ("do", "not")
        steps = first is not None and first.action is not None and not self._uses(first)
        asks = first is not None and self._asks(first)  # "instead of making tea" takes back as well
        takes_back = (verbal and (first is None or asks)) or (asks and following[0].role == "word")
        strange = first is not None and self._strange(first, verbal and part.words != ("not",))
        article, made_of, dish = (*parts[at + 1 : at + 4], part, part, part)[:3]
        whole = {"a", "an"} & {*article.words} and made_of.thing and dish.task and not dish.thing
        if takes_back or strange or whole or (steps and self.naming.cooks):
            return 1 + self._refuse(parts[at + 1 :], strange)
        ends = BOUNDARIES | {"to", "from", "for"}
        if _empty(takewhile(lambda p: p.role not in ends, parts[at + 1 :])):
            self._miss(part.text)  # "tea without", "no need for milk"
        self.mode, self.strict = "without", part.role == "allergy"
        self.local = not self.joined and not self.strict
        self.joined, self.swaps = True, bool(english.SWAPS & {*part.words})
        return 1

    def _asks(self, part: Phrase) -> bool:
        """Whether a part is a verb that asks for a task, so that "don't" takes it back."""
        if part.role == "word" or self._uses(part):
            return not self._uses(part)
        verb = part.action is not None or (part.task is not None and self._verbal(part))
        return part.role == "name" and verb and not (part.thing and not self.naming.cooks)

    def _uses(self, part: Phrase) -> bool:
        """Whether a part is a verb after which a negation rules out a thing, not the task."""
        verb = part.role == "word" or (self.naming.cooks and part.action is not None)
        return verb and bool(set(part.words) & english.USES)

    def _strange(self, part: Phrase, verbal: bool) -> bool:
        """Whether an unknown word is a verb: behind "don't" any that is one, else one in -ing that
        is no noun of the domain: "without waking anyone", but "without dressing"."""
        word = part.text
        verb = any(sense.field.startswith("verb.") for sense in self.naming.senses(word))
        gerund = word.endswith("ing") and not self.naming.noun(word)
        return part.role == "unread" and verb and (verbal or gerund)

    def _refuse(self, parts: Sequence[Phrase], strange: bool) -> int:
        """Take up what is not to be done, to the end of its clause; what is strange to a comma."""
        taken = 0
        for n, part in enumerate(parts):
            if part.role in ("stop", "but") or "then" in part.words:
                break
            if part.role in ("comma", "and") and (strange or self._begins(parts[n + 1 :])):
                break
            taken += 1
        self.refused.append(parts[:taken])
        return taken

    def _ruled_out(self, clause: Sequence[Phrase]) -> None:
        """Let what is not to be done hold for the tasks beside it: a step, a thing, another task.

        A clause that says nothing of the kind has not been understood, nor has one that takes back
        what is asked for.
        """
        text = " ".join(("not", *(word for part in clause for word in part.words)))
        if next((part.role for part in clause if part.role != "word"), "") == "unread":
            self._miss(text)  # "don't spill the milk" excludes no milk
            return
        names = [part for part in clause if part.role == "name"]
        things = [n for part in names for n in (*self.naming.object(part), *part.several)]
        verbs = [self.naming.verb(part) for part in names if not part.thing]
        steps = [verb.name for verb in verbs if verb]
        others = [part.task for part in names if part.task and not part.thing]
        asked = [(draft.task, set(draft.things)) for draft in self.drafts]
        again = any(task in others and things_ >= set(things) for task, things_ in asked)
        for action in steps:
            self.barred_steps += [(action, thing) for thing in things or ("",)]
        if not steps and not again and not (self.naming.cooks and others):
            self.excluded += [n for n in things if n not in self.excluded]
        strange = any(part.role in ("unread", "without") for part in clause)
        if again or strange or not (things or steps or (others and self.naming.cooks)):
            self._miss(text)

    def _exclude(self, part: Phrase, strict: bool) -> None:
        """Rule out what a part names: the thing, and the allergen of that name."""
        name = normal(part.text)
        rule = self.naming.rule_called(name, strict) or part.rule
        if rule is not None and rule not in self.rules:
            self.rules.append(rule)
        found = [part.thing or name, *part.several]
        self.excluded += [n for n in found if n not in self.excluded]
        if self.current is not None and self.local:
            self.current.without += found
        known = rule or part.thing or part.several or self.naming.noun(part.text)
        if not known or (strict and rule is None):
            self._miss(f"without {part.text}")

    # names -----------------------------------------------------------------------------------

    def _named(self, part: Phrase, after: Sequence[Phrase]) -> None:
        if part.rule is not None and (part.rule.diet or self.mode == "for"):
            self.rules += [part.rule] if part.rule not in self.rules else []
            if self.mode == "without":
                self._miss(f"without {part.text}")  # "not vegan"
            return
        if self.mode == "without":
            self._without(part, after)
        elif self.mode in ("to", "from", "for"):
            self._placed(part)
        elif part.task is not None and self._is_task(part, after):
            self._begin(part)
        elif part.thing or part.several:
            self._thing(part, after)
        elif (
            part.action is not None
            and self.mode == "main"
            and not self.run
            and (self.joined or not self.drafts)
        ):
            self.drafts.append(_Draft(None, list(part.words), action=part.action))
            self.joined, self.asked = False, True
        elif part.state:
            self.state = part.state
        else:
            self._unknown(part)

    def _without(self, part: Phrase, after: Sequence[Phrase]) -> None:
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

    def _is_task(self, part: Phrase, after: Sequence[Phrase]) -> bool:
        """Whether a name that begins here is that of a task, rather than a thing for one."""
        if self.naming.cooks:
            thing_only = self.mode == "with" and part.thing
            follows = after[0] if after else None
            modifies = part.thing and follows is not None and follows.role == "name" and (
                follows.task is not None or follows.thing)  # fmt: skip
            return not thing_only and not modifies
        if not part.thing:
            return True
        follows = next((p for p in after if p.role != "word"), None)
        named = after and set(after[0].words) & (english.IT | english.DETERMINERS)
        object_ = named or (follows is not None and (follows.thing or follows.several))
        return self.current is None or (self.joined and bool(object_) and len(part.words) < 2)

    def _begin(self, part: Phrase) -> None:
        """Begin a task, with the things before it that belong to it."""
        cooks = self.naming.cooks
        before = [*self.pending, *self.run]
        if self.drafts and not self.joined and not (before and cooks):
            last = self.drafts[-1]
            if not cooks or not last.own or last.things[1:]:
                self._miss(part.text)
                return
            self.drafts.pop()  # "tea cake": the tea is no task of its own
            before = [Phrase("name", tuple(last.words), thing=last.own)]
        self.pending, self.run = [], []
        draft = _Draft(part.task, amount=self.number or part.number or 1)
        self.number, self.mode, self.joined, self.asked = 0, "main", False, True
        first = self.drafts[0] if len(self.drafts) == 1 and not cooks else draft
        if first.place and not (first.task or first.action or first.things):
            draft.place = self.drafts.pop().place  # "on the shelf, put the book"
        self.drafts.append(draft)
        draft.words += (part.called or part.words) if not cooks else ()
        for modifier in before:
            self._modify(draft, modifier)
        draft.words += (part.called or part.words) if cooks else ()
        if part.thing and cooks:
            draft.own = part.thing
            draft.things.append(part.thing)
            draft.states += [(part.thing, self.state)] if self.state else []
            self.state = ""

    def _modify(self, draft: _Draft, part: Phrase) -> None:
        """Let what stands before a task go into it: a thing or, in a dish, what could be one."""
        name = part.text.replace(" ", "_")
        if part.things:
            draft.things += part.things
        elif self.naming.cooks and self.naming.noun(part.text):
            draft.things.append(name)
        else:
            self._miss(part.text)
            return
        draft.words += part.words
        draft.states += [(draft.things[-1], part.state)] if part.state else []

    def _thing(self, part: Phrase, after: Sequence[Phrase]) -> None:
        several = part.several
        if set(part.words) & english.MEASURES and after and after[0].role == "of":
            self.run.append(replace(part, task=None))  # the number goes to what it is full of
            return
        if not singulars(part.words[-1]):
            several = several[:1]  # "a toy", of four
        if several and self.number:
            several = several[: self.number]
            if len(several) < self.number:
                self._miss(f"{self.number} {part.text}")
        elif not self.naming.cooks and after and after[0].things:
            self._miss(f"{part.text} {after[0].text}")  # "the glass table"
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
            self.run.append(Phrase("name", (), thing=self.vessel))
            self.vessel = ""
        self.run.append(replace(part, several=several, state=self.state or "", task=None))
        self.state = ""

    def _unknown(self, part: Phrase) -> None:
        """Take up an unknown word; with the noun before it it is one name: "tomato sauce"."""
        if set(part.words) & english.CONDITIONS or self.naming.adverb(part.text):
            self._miss(part.text)
            return
        last = self.run[-1] if self.run else None
        # No compound begins with a plural: "onions upstairs" is no thing.
        single = last and last.thing and not singulars(last.words[-1])
        compound = single and self.naming.noun(part.text)
        if last and last.words and (last.role == "unread" or compound):
            self.run[-1] = Phrase("unread", (*last.words, *part.words))
        else:
            self.run.append(Phrase("unread", part.words))

    # prepositions and the rest ------------------------------------------------------------------

    def _preposition(self, part: Phrase, after: Sequence[Phrase]) -> None:
        self._flush()
        if self.swaps and part.role == "for":  # "swap sugar for honey"
            self.mode = "with"
            return
        if part.role == "for":
            self._for_whom(after)
        self.mode = part.role
        if not after or after[0].role in ("stop", "comma", "and"):
            self.mode = "main"

    def _for_whom(self, after: Sequence[Phrase]) -> None:
        """Count the people that something is for: "for me and my wife" are two."""
        found = list(takewhile(lambda p: p.role in ("word", "and"), after))
        words = [word for part in found for word in part.words]
        several = [word for word in words if word in english.EVERYONE]
        people = [w for w in words if w in english.PEOPLE | english.PERSONS]
        alone = not any(singulars(word) or word in english.CROWDS for word in people)
        joined = any(part.role == "and" for part in found) and len(people) > 1
        if several:
            self._miss(f"for {several[0]}")
        elif joined and alone and self.naming.cooks and self.current is not None:
            self.current.amount = max(self.current.amount, len(people))

    def _placed(self, part: Phrase) -> None:
        """A name behind a preposition: where something goes, comes from, or what it is for."""
        draft = self.current
        another = self.mode == "for" and self.joined  # "and for my wife coffee"
        if part.task is not None and (another or not part.thing or not self.drafts):
            self.mode, self.joined = "main", True
            self._begin(part)
            return
        name = part.thing or next(iter(part.several), "")
        if not name:
            self._miss(part.text)
        elif self.mode == "from" and self.naming.cooks and not self.naming.holds(name):
            self.mode = "with"  # "soup from tomato and onion"
            self._thing(part, ())
        elif self.mode == "from":
            if not self._kept_in(name):
                self._miss(f"from {part.text}")
        elif self.mode == "for":
            self.run.append(replace(part, task=None))
        else:
            if draft is None:
                draft = _Draft(None)
                self.drafts.append(draft)
            if draft.place:
                self._miss(f"to {draft.place}")
            draft.place = name
            draft.words += ("to", *part.words)
        self._count()

    def _kept_in(self, place: str) -> bool:
        """Whether every thing named so far is where it is to be taken from."""
        kg = self.naming.kg
        things = [*(self.current.things if self.current else ()), *(p.thing for p in self.pending)]
        places = kg.find(place)
        return bool(things) and all(
            any(e in places or kg.is_within(e, at) for e in kg.find(thing)[:1] for at in places)
            for thing in filter(None, things)
        )

    def _of(self, after: Sequence[Phrase]) -> None:
        """A vessel of something: "a glass of water"."""
        last = self.run[-1] if self.run else None
        follows = next((p for p in after if p.role != "word"), None)
        dish = follows is not None and follows.task is not None and self.naming.cooks
        if last is None or not last.thing:
            return
        if set(last.words) & english.MEASURES and (dish or self.mode == "with"):
            self.run.pop()  # a measure only
        elif follows is not None and follows.thing:
            self.run.pop()
            self.vessel = last.thing

    def _count(self) -> None:
        """Let a number that counts nothing be one that nobody understood."""
        if self.number:
            self._miss(str(self.number))
        self.number = 0

    def _number(self, part: Phrase, after: Sequence[Phrase]) -> None:
        self._count()
        named = [p for p in after if p.role not in ("word", "of")]
        follows = next(iter(named), None)
        if self.mode == "main" and follows is not None and follows.task is not None:
            self._flush()  # "two teas one coffee" are two tasks
            self.joined = True
        into = named[1] if self.naming.cooks and len(named) > 1 else None
        # "a 3 egg omelette" and "3 eggs omelette" are one; "3 cheese sandwiches" are three
        head = into if follows is not None and follows.thing and not follows.task else follows
        made_of = head is not None and head.task and (head is into or head.words[1:])
        one = made_of and head is not None and not singulars(head.words[-1])
        names = set(follows.words) if follows is not None else set()
        odd = self.naming.cooks and one and part.number > 1 and not names & english.MEASURES
        if follows is not None and (odd or names & english.UNITS):
            self._miss(f"{part.text} {follows.text}")
        elif self.mode == "for":
            if self.current is not None:
                self.current.amount = max(part.number, 1)
            else:
                self.number = part.number
        elif follows is not None and follows.role in ("name", "measure"):
            self.number = 0 if part.words == ("one",) or part.number == 1 else part.number
        elif part.number != 1 or part.words == ("1",) or (after and after[0].role == "without"):
            self._unknown(Phrase("unread", part.words))

    def _word(self, part: Phrase, before: Phrase | None) -> None:
        word = part.words[0]
        verb = word in english.VERBS
        like = verb and before is not None and before.role == "name"  # "tea like my grandma's"
        ordinary = word in english.GRAMMAR or verb or len(part.words) > 1
        belongs = word in self.naming.domain.fillers or self.mode == "for"
        belongs = belongs or (word in english.PEOPLE and self.mode != "to")
        just = self.mode == "with" and (verb or word == "just")
        hedged = word in english.HEDGES and before is not None and before.role == "without"
        question = before is None and word in english.QUESTIONS
        joins = before is not None and before.role in BOUNDARIES
        late = word == "first" and joins and bool(self.drafts)  # "tea, but first a salad"
        vague = word in english.VAGUE and not joins
        if not (ordinary or belongs) or like or just or hedged or question or late or vague:
            self._miss(part.text)
        if verb or word in self.naming.domain.fillers:
            self.asked = self.asked or word not in english.GRAMMAR
        if self.mode == "without" and verb and word not in english.USES:
            self.mode = "main"
        if self.mode == "main" and verb:
            self._no_modifiers()

    def _no_modifiers(self) -> None:
        """Let unknown words before a verb be no part of the dish behind it: "my job is to make"."""
        for parts in (self.pending, self.run):
            for part in [part for part in parts if part.role == "unread"]:
                parts.remove(part)
                self._miss(part.text)

    def _flush(self) -> None:
        """End a run of names: what it holds goes where the last preposition says."""
        run, self.run = self.run, []
        if self.vessel:
            run.append(Phrase("name", tuple(self.vessel.split("_")), thing=self.vessel))
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
        return self.naming.cooks and self.joined

    def _add(self, part: Phrase) -> None:
        """Let a thing go into the current task; an unknown one only if it could be one."""
        draft = self.current
        if draft is None:
            self.pending.append(part)
            return
        name = part.text.replace(" ", "_")
        behind = self.mode == "with" or not self.naming.cooks
        more = draft.known and self.mode == "main" and not self.naming.cooks
        if more and not (self.joined and self._widened(draft)):
            self._miss(part.text)
            if not part.things:
                return
        if part.things:
            draft.things += part.things
            draft.several += part.several
            draft.states += [(part.things[0], part.state)] if part.state else []
        elif behind and (
            self.naming.noun(part.text, anything=draft.action is not None)
            or self._nameless(part.text)
        ):
            draft.things.append(name)
        else:
            self._miss(part.text)
            return
        draft.words += (*(("with",) if self.mode == "with" else ()), *part.words)

    def _widened(self, draft: _Draft, less: Iterable[str] = ()) -> bool:
        """Whether a known errand can be about more, or `less`, than its name says: it then becomes
        one of its class, "clean the table and the shelf"."""
        for at in range(len(draft.words) - 1, 0, -1):
            general = self.naming.domain.task_classes.get("_".join(draft.words[:at]))
            parts = self.naming.parts(draft.words[at:])
            about = list(takewhile(lambda p: p.role != "to", parts))
            there = parts[len(about) + 1 :]
            named = [name for part in about for name in part.things]
            if not all(p.things for p in (*about, *there)) or there[1:]:
                continue
            if general is not None and (not less or {*less} & {*named}):
                draft.task = general
                draft.things = [*named, *draft.things]
                draft.several += [n for p in about for n in p.several]
                draft.place = draft.place or "".join(p.things[0] for p in there)
                return True
        return False

    def _nameless(self, phrase: str) -> bool:
        """Whether a short phrase may name a thing that no dictionary has."""
        parts = phrase.split()
        return self.mode == "with" and len(parts) <= 2 and not any(map(self.naming.senses, parts))

    def _miss(self, phrase: str) -> None:
        if phrase and phrase not in self.unread:
            self.unread.append(phrase)

    def _end(self) -> None:
        self._flush()
        self._count()
        self._settle()
        self._share()
        for clause in self.refused if self.drafts else ():
            self._ruled_out(clause)
        for draft in self.drafts if not self.naming.cooks else ():
            if draft.known and self.excluded:
                self._widened(draft, self.excluded)
            left_out = {*draft.several} & {*self.excluded}
            draft.things = [name for name in draft.things if name not in left_out]

    def _share(self) -> None:
        """Let a bare verb be about what the verb beside it is: "wash and fold the towels"."""
        for n, draft in enumerate(self.drafts):
            if self.naming.cooks or draft.things or draft.task is None or draft.known:
                continue
            named = {*takewhile(lambda word: word != "to", draft.words[1:])} - PARTICLES
            if named or (draft.place and not any(goal.places for goal in draft.task.goals)):
                continue
            # "wash and fold the towels", but "fold the towels and put them on the bed"
            behind = self.drafts[n + 1 : n + 2] if not draft.place else []
            for other in (*behind, *self.drafts[max(n - 1, 0) : n]):
                needs = other.task.required if other.task else ()
                called = [name for name in needs if set(words(name)) <= set(other.words)]
                draft.things = draft.things or other.things or called
            if not draft.things:
                self._miss(f"what to {' '.join(draft.words)}")

    def _settle(self) -> None:
        """Let what still waits for a task go into the last one, or be one."""
        left, self.pending = self.pending, []
        if not left:
            return
        if self.current is not None:
            for part in left:
                self._add(part) if part.things else self._miss(part.text)
            return
        draft = _Draft(None)
        self.drafts.append(draft)
        for part in left:
            if part.things:
                draft.things += part.things
                draft.states += [(draft.things[-1], part.state)] if part.state else []
            elif not (self.asked and self.naming.noun(part.text) and len(left) == 1):
                self._miss(part.text)
            draft.words += part.words

    # tasks ------------------------------------------------------------------------------------

    def tasks(self, text: str) -> tuple[Task, ...]:
        """Return the tasks that were read; one that nothing is known of if nothing was."""
        if not self.drafts and not self.refused and not self.excluded:
            name = text.replace("_", " ")
            return (Task(name, thin=True, like=self.naming.like(name)),)
        return tuple(self._task(draft) for draft in self.drafts)

    def _task(self, draft: _Draft) -> Task:
        task = draft.task
        things = tuple(dict.fromkeys(draft.things))
        others = {name for other in self.drafts if other is not draft for name in other.without}
        # "tea with sugar, and coffee without": what is asked for here is excluded there.
        elsewhere = others & {*draft.things} - {*draft.without}
        excluded = tuple(n for n in dict.fromkeys(self.excluded) if n not in elsewhere)
        naming = self.naming
        place = draft.place
        if place and naming.among_goals(place):
            things = tuple(dict.fromkeys((*things, place)))
        name = " ".join(dict.fromkeys(draft.words)).removesuffix(" with") or sentence_list(things)
        read = Task(
            name,
            things,
            excluded=excluded,
            barred=naming.barred(excluded),
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
            asked = any(
                concerns(goal, (n for n in things if n != place or not goal.places), naming.kg)
                for goal in task.goals
            )
            return replace(
                read,
                thin=bool(things) and not asked and not task.known and not naming.cooks,
                name=task.name if task.known else name,
                required=required,
                goals=task.goals,
                known=task.known,
                iri=task.iri,
                judged_by=task.judged_by,
            )
        thin = not read.states and not read.inside
        return replace(read, thin=thin, like=naming.like(name) if thin else ())

    def _serves(self, named: str, needed: str) -> bool:
        """Whether a thing serves as another does: both are fit to act "with" in the same action."""
        kg = self.naming.kg
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
        kg = self.naming.kg
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
