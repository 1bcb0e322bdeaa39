"""Steps in words: "Pick up the knife, then slice the apple on the cutting board".

Verbs, particles and prepositions come from the domain; the few words of English grammar that hold
them together stand in the tables here. An argument is placed by its preposition, by name; what has
none keeps its place, and what a noun is, is for the checks to find out.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import groupby, takewhile

from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.english import PRONOUNS, TIMES, UNCOUNTED, count_of
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal, parted
from adaptbot_cli.core.parse.calls import read_table, worded
from adaptbot_cli.core.plan import Call, keyworded

_ENGLISH = """
determiner: the a an some your my our his her its their this that these those any of
person: me us you him her them user human person robot agent yourself itself
joining: , ; & and then next finally first firstly second secondly third now also lastly afterwards
  afterward again subsequently please
adverb: now again there here back away together well once more please too also up down over directly
  then just first aside off
tail: until till while so because as since when once before after which who where without except
  ensuring making
if: if unless whenever whether
state: is are was were be been see hear notice have has had know contains
preposition: on onto in into inside to at from off under with using by for beside near over above
  below behind upon atop through along against via toward towards between within out around
number: one=1 two=2 three=3 four=4 five=5 six=6 seven=7 eight=8 nine=9 ten=10
phrase: on_top_of=on out_of=from next_to=beside off_of=off inside_of=inside in_front_of=before
  with_the_help_of=with by_using=with back_to=to back_in=in back_on=on back_into=into over_to=to
  up_to=to down_on=on away_in=in using=with via=with
"""
_TABLE = read_table(_ENGLISH)
_DETERMINERS, _PERSONS, _JOINING, _ADVERBS, _TAIL, _IF, _STATES, _PREPOSITIONS = (
    frozenset(_TABLE[name]) for name in list(_TABLE)[:8]
)
_NUMBERS = dict(word.split("=") for word in _TABLE["number"])
_PHRASAL = {
    tuple(words.split("_")): word
    for words, word in (entry.split("=") for entry in _TABLE["phrase"])
}
_PARTICLES = _ADVERBS | _PREPOSITIONS
_NEXT = frozenset({";", "then", "finally", "next", "afterwards", "lastly"})
_PLURAL = frozenset({"them", "these", "those", "both", "all"})
"""Pronouns that stand for all things that the steps before were about."""
_SEVERAL = re.compile(r"[^s]s\Z|\A\d")
"""What a name of several things looks like: "eggs", "2 eggs"."""
_ENDS = _NEXT - {"next"} | {",", "&", "and", "×"}
_NO_VERBS = _STATES | _DETERMINERS | _PREPOSITIONS | _ADVERBS | _TAIL | PRONOUNS | _PERSONS
_ARTICLES = frozenset({"a", "an", "the", "your", "my"})
_OBJECTS = (_DETERMINERS - {"of"}) | {"it", "them"}
"""What an order is about begins so: "the egg", "them"."""
_MOST = 50
_MOST_LEADS = 10
_LOOK_BACK = 3
"""How many steps a pronoun for one thing looks back."""
_TIMES = "×"
"""How often a step is done: "twice", "3 times"."""
_TOWARDS = frozenset({"to", "into", "onto"})
_ASIDE_MARKS = frozenset({"from", "with", "for"})
"""What says whence, with what or how long; the others say which thing is meant."""
_TOKEN = re.compile(
    r"[\"“`]([^\"”`\n]+)[\"”`]|(?<!\w)['‘]([^'’\n]+)['’](?!\w)"
    rf"|({TIMES}|{UNCOUNTED})"
    r"|(->|=>|>>|→|⇒|(?<=\s)/(?=\s))|(\d+(?:[.,]\d+)?|[^\W\d](?:[\w'’]|-(?!>))*|[,;&])",
    re.IGNORECASE,
)
ARROW = re.compile(r"->|=>|>>|→|⇒")
ASIDE = re.compile(rf"\s[(\[](?!{TIMES}[)\]])([^()\[\]]*)[)\]]")
"""A remark in brackets, unless it says how often."""
_TOLD_TIMES = re.compile(rf"\s[(\[]({TIMES}|{UNCOUNTED})[)\]]", re.IGNORECASE)
_ASIDE = re.compile(r"\s[–—-]\s|[*_]*(:)[*_]*\s+")
_INVERTED = (
    (worded(r"use (.{1,60}?) to (\w.*)"), r"\2 with \1"),
    (worded(r"((?:with|using|on|in|from)\s[^,]{1,60}),\s*((?:(?!\band\b|[,;]).)*)"), r"\2 \1"),
    (worded(r"((?:once|when|while|after|before|until|as soon as|if|unless)\s[^,]{1,60}),\s*(.*)"),
     r"\2 \1"),
)  # fmt: skip
"""Orders whose object, tool or time comes first, and how they read otherwise."""
_LABEL = worded(
    r"(?:[\s>*_#`•\-–—→|]|<\w[^<>]*>)*"
    r"(?:\(?(?:step|action|task|move)?\s*#?\d{1,3}(?:\.\d{1,3})*\s*[.):\-–]+[\s*_]*"
    r"|(?:step|action|move|task)\s*\d*\s*[.):\-–]+(?!>|(?<=[a-z]-)\w)[\s*_]*"
    r"|\(?[a-z][.)]\s|\[(?:(?:step|action|task)\s*\d*|[ x]|\d{1,3})\]\s|[①-⑳❶-❿Ⅰ-ⅻ]\.?"
    r"|[\s>*_#`•])*"
)
_LEADS = (
    worded(r"(?:first(?:ly)?|then|next|finally|lastly|now|after that|afterwards|and)\b[,:]? "),
    worded(
        r"(?:(?:i|you|we|the robot|robot|it|he|she|they|the agent|let's|let us)(?:'(?:ll|m|d))? "
        r"(?:(?:will|would|should|must|can|shall|may|might|could|also|(?:needs?|have|has|want) to"
        r"|start by|begin by|suggest|recommend|(?:am|is|are) going to|now|then|first|next|finally"
        r") )*|let's |let (?:us|me) |please |(?:make sure|remember|be sure|try) to "
        r"|(?:start|begin)(?: (?:off|out))? (?:by|with) |make sure (?:that )?you "
        r"|(?:do not|don't) forget to |optional(?:ly)?\b[,:]?\s*)"
    ),
)
_NEGATED = worded(r"(?:please )?(?:do not|don't|never|avoid|without)\b")
OPTIONAL = worded(r"\W*(optional(?:ly)?\b|(?:you|i|we|one) (?:may|might|could)\b)")
OPEN = worded(
    r"\W*(?:(?:\.\.\.|…)\W*|(?:and )?(?:so on|etc)\b.*"
    r"|(?:then |and )?(?:(?:(?:do|repeat|perform) )?"
    r"(?:(?:the )?same\b(?! time)|(?:repeat|continue|likewise|similarly|ditto)\b|again\W*$)"
    rf"|(?:do|perform) (?:this|that|it|so|them|these|all)\b.*?(?:\bagain\b|{TIMES}|{UNCOUNTED})"
    r"|(?:go|return|jump|loop) (?:back )?to (?:the )?(?:step|start|beginning)\b|start over\b).*)",
    re.DOTALL,
)
"""What stands for steps that are not written out."""
CLOSED = worded(
    r"\W*(?:(?:serve and )?enjoy\b.*|done|finished|end|stop|complete[d]?|finish|that's (?:it|all)"
    r"|(?:the )?task (?:is )?(?:done|complete[d]?|finished))\W*"
)
"""What ends a plan."""


Named = Sequence[tuple[str, Sequence[str]]]
"""What steps did, and with what, the last one first."""


@dataclass(frozen=True, slots=True)
class Verb:
    """A name of an action as words: the verb's further words, and the actions that it may mean."""

    name: str
    rest: tuple[str, ...]
    action: Action

    def at(self, preposition: str, with_object: bool) -> str:
        """Name the parameter that a preposition marks, "" if none; an object is the first one."""
        marked = [p.name for p in self.action.visible if preposition in p.prepositions]
        first = self.action.visible[0].name if self.action.visible and with_object else ""
        return next((name for name in marked if name != first), next(iter(marked), ""))


@dataclass(frozen=True, slots=True)
class Clause:
    """A verb with its arguments: one step, or one for each of several objects.

    `done` is the action and what it is about; `elided` tells that its object is that of the next
    clause: "wash and cut the apple".
    """

    calls: tuple[Call, ...]
    done: tuple[str, Sequence[str]]
    left_out: str = ""
    condition: str = ""
    elided: bool = False


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The words of a domain that phrases are read with; by default there are none."""

    verbs: Mapping[str, Sequence[Verb]] = field(default_factory=dict)
    names: frozenset[str] = frozenset()
    is_thing: Callable[[str], object] = frozenset[str]().__contains__
    called: Mapping[str, Action] = field(default_factory=dict)

    @classmethod
    def of(cls, kg: Kg) -> "Vocabulary":
        """Return the words of a home: names of its actions, taught ones too, and of its things."""
        verbs: dict[str, list[Verb]] = {}
        called: dict[str, Action] = {}
        for action in kg.domain.actions.values():
            own = (*action.names, action.verb, action.family, *kg.aliases(action.iri))
            for name in dict.fromkeys(normal(name) for name in own if name):
                first, *rest = name.split("_")
                called.setdefault(name, action)
                verbs.setdefault(first, []).append(Verb(name, tuple(rest), action))
                if rest:
                    verbs.setdefault(name.replace("_", ""), []).append(Verb(name, (), action))
        longest = {
            first: sorted(found, key=lambda v: -len(v.rest)) for first, found in verbs.items()
        }
        names = frozenset({*called, *(name.replace("_", "") for name in called)})
        return cls(longest, names, kg.find, called)

    def knows(self, name: str) -> bool:
        """Tell whether a name is an action's."""
        return normal(name) in self.names or normal(parted(name)) in self.names

    def takes(self, action: str, name: str) -> bool:
        """Tell whether an action has a parameter of a name."""
        known = self.called.get(normal(action))
        return known is not None and any(p.name == name for p in known.parameters)

    def fitting(self, action: str, args: Sequence[str]) -> tuple[list[str], list[str]]:
        """Part arguments that are told by their places into what an action takes and the rest.

        Left out are first who does it, then what is no thing of the home, then the last.
        """
        known = self.called.get(normal(action))
        does = [arg.rstrip("0123456789") in _PERSONS for arg in args]
        order = sorted(
            range(len(args)), key=lambda n: (not does[n], bool(self.is_thing(args[n])), -n)
        )
        left = set(order[: max(0, len(args) - len(known.visible)) if known else 0])
        return [a for n, a in enumerate(args) if n not in left], [args[n] for n in sorted(left)]

    def proper(self, name: str) -> str:
        """Return the action's name that is spelt without its separators, such as switchon."""
        return next((verb.name for verb in self.verbs.get(name, ()) if not verb.rest), name)

    def puts(self, verb: Verb, mark: str) -> str:
        """Name the action that puts where `mark` says what `verb` fetches: "bring it to me"."""
        taken = verb.action.visible[0].classes if verb.action.fetches else ()
        if not taken or mark not in _TOWARDS:
            return ""
        for action in (v.action for found in self.verbs.values() for v in found):
            first, *others = action.visible or (None,)
            alike = first is not None and first.classes == taken and not action.fetches
            if alike and any(mark in p.prepositions for p in others if p):
                return action.name
        return ""

    def meaning(self, action: str) -> str:
        """Return what an action's name comes to, the same for all of its names."""
        found = self.called.get(action.lower())
        return (found.family or found.name) if found else action

    def begins(self, phrase: str) -> bool:
        """Tell whether a phrase begins with a verb of the domain."""
        return any(self._begins(part) for part in _parts(phrase))

    def _begins(self, part: str) -> bool:
        tokens, at = _opened(part)
        behind = tuple(token.word for token in tokens[at + 1 :] if token.word)
        fits = any(
            verb.rest == behind[: len(verb.rest)] or not _PARTICLES.isdisjoint(verb.rest)
            for verb in self.verbs_of(tokens[at])
        )
        whole = bool(behind) or not self.is_thing(tokens[at].word)
        return fits and whole and not CLOSED.fullmatch(part)

    def shaped(self, phrase: str) -> bool:
        """Tell whether a phrase looks like a step: an order, "sit on the sofa", an arrow."""
        first, second = _tokens(_stripped(phrase))[:2]
        going = second.word in _PREPOSITIONS and first.word.isalpha() and self._verbal(first.word)
        arrow = ARROW.search(_stripped(phrase))
        return bool(self.names and (arrow or going)) or self.ordered(phrase)

    def ordered(self, phrase: str) -> bool:
        """Tell whether a phrase looks like an order with a verb that the domain does not know."""
        for part in _parts(phrase) if self.names else ():
            tokens, at = _opened(part)
            first, second, third = (token.word for token in tokens[at : at + 3])
            apart = second in _ADVERBS and third in _OBJECTS  # "break up the chocolate"
            if self.starts_clause(tokens, at) or (apart and self._verbal(first)):
                return True
        return False

    def _verbal(self, word: str) -> bool:
        return word not in _NO_VERBS and not self.is_thing(word)

    def starts_clause(self, tokens: Sequence["_Token"], at: int) -> bool:
        """Tell whether a clause begins at a token that follows a comma or "and"."""
        word, behind = tokens[at].word, tokens[at + 1].word if tokens[at].word else ""
        if self.verbs_of(tokens[at]):
            return behind not in ("", ",", ";", "and", "then") or not self.is_thing(word)
        return word not in _NO_VERBS and word.isalpha() and behind in _OBJECTS

    def verbs_of(self, token: "_Token") -> Sequence[Verb]:
        """Return the verbs that a word is a form of."""
        if token.quoted:
            return ()
        word = normal(parted(token.written))
        first, joined, _ = word.partition("_")
        if joined:
            whole = [Verb(word, (), v.action) for v in self.verbs.get(first, ()) if v.name == word]
            if whole:
                return whole
        return next((self.verbs[form] for form in _forms(word) if form in self.verbs), ())

    def read(self, phrase: str, unknown: bool, before: Named = ()) -> list[Clause]:
        """Read a phrase as steps; [] if it cannot be read as such.

        With `unknown`, it may begin with a verb that is none of the domain's. `before` is what the
        steps before did, the last one first, which a pronoun stands for.
        """
        parts = _parts(phrase)
        # What a colon stands behind is a heading, unless it begins as a step does.
        steps = [part for part in parts if self._begins(part)
                 or (len(parts) > 1 and part[-1:] != ":" and self.shaped(part))]  # fmt: skip
        steps = steps or parts[-1:]
        if steps == parts[:1] and len(parts) > 1 and not _tokens(parts[0])[1].word:
            parts = steps = [" ".join((parts[0].rstrip(":"), *parts[1:]))]  # "take: the egg"
        found = self._read(steps[0], unknown, before)
        for part in steps[1:]:  # "Slice the onion: take the knife": the first is a heading then
            told = [clause.done for clause in found[::-1]]
            of = self._read(part, unknown, [*told, *before])
            done, again = (
                {self.meaning(call.action) for clause in clauses for call in clause.calls}
                for clauses in (found, of)
            )
            found = of if done & again else [*found, *of]
        dropped = [part.strip() for part in parts[1:] if part not in steps]
        if found and dropped:
            text = ", ".join(filter(None, (found[-1].left_out, *dropped)))
            found[-1] = replace(found[-1], left_out=text)
        return found

    def _read(self, phrase: str, unknown: bool, before: Named) -> list[Clause]:
        phrase = _stripped(phrase)
        steps = ARROW.split(phrase)
        if len(steps) > 1 and not all(self._begins(s) or self.shaped(s) for s in steps):
            return []  # "egg -> pan" says no step
        tokens = list(_tokens(phrase))
        found: list[Clause] = []
        at = _skip(tokens, 0)
        while tokens[at].word:
            reader = _ClauseReader(self, tokens, at, before)
            try:
                clause = reader.read(bool(self.names) and (unknown or bool(found)))
            except _UnreadError:
                return []
            before = [clause.done, *before]
            at = _skip(tokens, reader.at)
            joined = {token.word for token in tokens[reader.at : at]} <= {",", "&", "and"}
            found.append(replace(clause, elided=clause.elided and joined))
        for n in range(len(found) - 2, -1, -1):
            first = next((name for name, _ in found[n + 1].calls[0].named()), "none")
            if found[n].elided and not first:
                action, of = found[n].done[0], found[n + 1].done[1]
                calls = tuple(keyworded(action, [("", each)]) for each in of)
                found[n] = replace(found[n], calls=calls, done=(action, of))
        return found


@dataclass(frozen=True, slots=True)
class _Token:
    """A word in lower case and as written; one that is quoted stands in quotation marks."""

    word: str
    written: str

    @property
    def quoted(self) -> bool:
        return self.word.startswith('"')


_END = (_Token("", ""),) * 3
"""What stands behind the last token, so that each has some behind it."""


@lru_cache(maxsize=1024)  # a line is looked at for a verb, for an order, and as steps
def _tokens(phrase: str) -> Sequence[_Token]:
    found: list[_Token] = []
    for match in _TOKEN.finditer(phrase):
        quoted = (match[1] or match[2] or "").strip()
        if quoted and re.fullmatch(r"[\w\s'’-]+", quoted):
            found.append(_Token(f'"{quoted.lower()}"', quoted))
        elif quoted:
            found += _tokens(quoted)[:-3]
        elif match[3]:
            found.append(_Token(_TIMES, match[3]))
        elif match[4]:
            found.append(_Token(";", ";"))
        elif match[5]:  # a quotation of nothing but white space is no word
            found.append(_Token(match[5].lower().replace("’", "'"), match[5]))
    return (*found, *_END)


def label_end(phrase: str) -> int:
    """Return where the marks end that lead an item: "Step 3:", "- [ ]"."""
    label = _LABEL.match(phrase)
    return label.end() if label else 0


@lru_cache(maxsize=1024)
def _stripped(phrase: str) -> str:
    """Return a phrase without what leads it: list marks, "Step 3:", "I will"."""
    phrase = _TOLD_TIMES.sub(r" \1", phrase[label_end(phrase) :])
    phrase = ASIDE.sub("", re.sub(r"\*\*|__|</\w+>", "", phrase)).rstrip(" .!*_`|")
    for _ in range(_MOST_LEADS):
        found = [m for m in (lead.match(phrase) for lead in _LEADS) if m]
        turned = next((form for form in _INVERTED if form[0].fullmatch(phrase)), None)
        if found:
            phrase = phrase[max(m.end() for m in found) :]
        elif turned is not None:
            phrase = turned[0].sub(turned[1], phrase)
        else:
            break
    return phrase


def _parts(phrase: str) -> list[str]:
    """Return what may be the step: of "Take the milk: it is cold" or "Plan: take the milk"."""
    parts = _ASIDE.sub(r"\1\n", phrase[label_end(phrase) :]).split("\n")
    lines = (part for part in parts if _tokens(part)[_skip(_tokens(part), 0)].word)
    return [part for part in lines if len(parts) == 1 or not CLOSED.fullmatch(part)] or parts


def _opened(part: str) -> tuple[Sequence[_Token], int]:
    """Return the tokens of a part, and which of them its first clause begins with."""
    tokens = _tokens(_stripped(part))
    return tokens, _skip(tokens, 0)


def _skip(tokens: Sequence[_Token], at: int) -> int:
    """Skip what joins clauses, and adverbs before a verb: "carefully"."""
    while tokens[at].word in _JOINING or (tokens[at].word.endswith("ly") and tokens[at + 1].word):
        at += 1
    return at


def _forms(word: str) -> Iterator[str]:
    """Yield what a word may be a form of: "slicing" and "slices" are slice."""
    yield word
    if word.endswith(("ies", "ied")):
        yield f"{word[:-3]}y"
    for ending in ("ing", "es", "s", "ed"):
        if word.endswith(ending) and len(word) > len(ending) + 2:
            stem = word[: -len(ending)]
            yield from (stem, f"{stem}e", stem[:-1]) if ending in ("ing", "ed") else (stem,)


class _UnreadError(Exception):
    """A clause cannot be read; never leaves this module."""


Phrases = list[tuple[str, list[str]]]
"""Noun phrases, each list behind its preposition."""


class _ClauseReader:
    """Reads one clause from `at`; leaves `at` behind it."""

    def __init__(self, words: Vocabulary, tokens: list[_Token], at: int, before: Named) -> None:
        self.at = at
        self._words = words
        self._tokens = tokens
        self._before = before
        self._left_out: list[str] = []
        self._condition = ""
        self._often = 1
        self._said: list[str] = []

    def read(self, unknown: bool) -> Clause:
        """Read the clause, with `unknown` also one whose verb is none of the domain's.

        Raises:
            _UnreadError: it is no clause, or more than one thing may be meant.
        """
        first = self._tokens[self.at]
        verbs = self._words.verbs_of(first)
        self.at += 1
        start = self.at
        if not verbs:
            behind = self._tokens[self.at].word  # "egg in the pan"
            thing = behind not in _OBJECTS and self._words.is_thing(first.word)
            named = first.word.replace("-", "").replace("_", "").isalpha()
            if not unknown or not named or thing or first.word in _NO_VERBS | _IF:
                raise _UnreadError
        verb = self._verb(verbs)
        glued = verb is not None and first.word == verb.name.replace("_", "") != verb.name
        printed = all(token.written.isupper() for token in self._tokens[:-3])  # as planners do
        command = glued or printed or re.search(r"\w[_-]\w", first.word)
        phrases = self._commanded() if command else self._phrases()
        name = verb.name if verb else first.word
        if verbs and verb is None:  # "turn the heat down": no action is that one
            marks = [mark for mark, _ in phrases if mark]
            after = [t.word for t in self._tokens[start : start + 1] if t.word in _PARTICLES]
            name = "_".join([name, *(after or marks)[:1]])
            phrases = [("", nps) for _, nps in phrases]
        objects = [np for mark, nps in phrases if not mark for np in nps]
        about = objects or [np for _, nps in phrases for np in nps][:1]
        if verb and any(p.datatype for p in verb.action.visible[:1]):
            about = []
        elided = not phrases and self._often == 1 and bool(not verb or verb.action.required)
        return Clause(
            tuple(self._calls(name, verb, objects, phrases)) * min(self._often, _MOST),
            (name, about),
            ", ".join(self._left_out),
            self._condition,
            elided,
        )

    def _verb(self, verbs: Sequence[Verb]) -> Verb | None:
        """Return the verb whose further words follow, here or behind its object, and take them."""
        for verb in verbs:
            end = self.at + len(verb.rest)
            here = tuple(token.word for token in self._tokens[self.at : end])
            if verb.rest and here == verb.rest:
                self.at = end
                return verb
        for verb in verbs:
            if len(verb.rest) == 1 and self._take_apart(verb.rest[0]):
                return verb
        plain = (v for v in verbs if not v.rest[1:] and _PARTICLES.isdisjoint(v.rest))
        return next((verb for verb in verbs if not verb.rest), next(plain, None))

    def _take_apart(self, particle: str) -> bool:
        """Take a particle that stands behind its object, each time: "the stove on"."""
        n, taken, tokens = self.at + 1, False, self._tokens
        while tokens[n - 1].word and tokens[n].word:
            word, behind = tokens[n].word, tokens[n + 1].word
            ends = not behind or behind in _JOINING | _PREPOSITIONS | _TAIL
            marks = word in _PREPOSITIONS or not behind
            if word == particle and ends and word not in _PARTICLES:
                return True  # "pour the pot's contents"
            if word == particle and ends and marks and (word, behind) not in _PHRASAL:
                del tokens[n]
                taken = True
            elif word in _JOINING and (
                not taken or self._words.starts_clause(tokens, _skip(tokens, n))
            ):
                break
            else:
                n += 1
        return taken

    def _commanded(self) -> Phrases:
        """Read the arguments behind a name such as pick_up: single words, or phrases."""
        tokens = self._tokens[self.at : -3]
        words = {token.word for token in tokens}
        if words & (_DETERMINERS | _PREPOSITIONS | _JOINING) or len(tokens) > 4:
            return self._phrases()
        self.at += len(tokens)
        return [("", [token.written]) for token in tokens]

    def _phrases(self) -> Phrases:
        """Read noun phrases up to the end of the clause, each list behind its preposition."""
        found: Phrases = []
        mark, nps = "", list[str]()
        while word := self._tokens[self.at].word:
            behind = self._tokens[self.at + 1]
            if word in _IF | _TAIL or (word == "by" and behind.word.endswith("ing")):
                self._tail(word)
                break
            if word == "or":
                raise _UnreadError  # which of them?
            if word == _TIMES:
                written = self._tokens[self.at].written
                self._often = count_of(written)
                self._condition = self._condition or ("" if self._often else written)
                self.at += 1
                continue
            if word in _ENDS:
                after = _skip(self._tokens, self.at)
                joined = {token.word for token in self._tokens[self.at : after]}
                more = nps or found
                if not more or joined & _NEXT or self._words.starts_clause(self._tokens, after):
                    break
                self.at = after
                nps += self._noun_phrase()
                continue
            preposition, length = self._preposition()
            if preposition:
                thing = self._words.is_thing(behind.word)
                ends = self._tokens[self.at + 2].word or ","
                if (
                    word == "to"
                    and not thing
                    and ends not in _JOINING | _TAIL
                    and self._words.verbs_of(behind)
                ):
                    self.at += 1  # "go to the fridge to get the milk"
                    break
                if nps or mark:
                    found.append((mark, nps))
                self.at += length
                mark, nps = preposition, self._noun_phrase()
                continue
            before = self.at
            more = self._noun_phrase()
            if more and nps:
                found.append((mark, nps))
                mark, nps = "", []
            nps += more
            self.at += self.at == before
        return [*found, (mark, nps)] if nps or mark else found

    def _preposition(self) -> tuple[str, int]:
        """Return the preposition that begins here, "" if none does, and its number of words."""
        words = tuple(token.word for token in self._tokens[self.at : self.at + 4])
        for length in (4, 3, 2, 1):
            if words[:length] in _PHRASAL:
                return _PHRASAL[words[:length]], length
        particle = words[0] in ("up", "down", "off", "away") and not words[1]
        return (words[0], 1) if particle or words[0] in _PREPOSITIONS else ("", 0)

    def _tail(self, word: str) -> None:
        """Note what the clause ends with, up to the next clause: "until it is brown"."""
        start, tokens = self.at, self._tokens
        while tokens[self.at].word:
            self.at += 1
            after = _skip(tokens, self.at)
            if after > self.at and self._words.verbs_of(tokens[after]):
                break
        text = " ".join(token.written for token in tokens[start : self.at])
        if word in _IF:
            self._condition = text
        else:
            self._left_out.append(text)

    def _noun_phrase(self) -> list[str]:
        """Read a noun phrase; a pronoun is what the steps before were about, a person nothing."""
        parts: list[_Token] = []
        while word := self._tokens[self.at].word:
            token, behind = self._tokens[self.at], self._tokens[self.at + 1].word
            stops = _JOINING | _PREPOSITIONS | _TAIL | _IF | _ADVERBS
            if token.quoted:
                parts.append(token)
                self.at += 1
                break
            if word == "of" and parts:
                parts.append(token)
            elif word in _IF | _TAIL | _ENDS | {"or"} or (word != "of" and self._preposition()[0]):
                break
            elif word in _DETERMINERS and parts and parts[-1].word != "of":
                if all(p.word in _PERSONS for p in parts):
                    parts = []  # "bring me the apple"
                elif parts[-1].word not in ("all", "both"):
                    break
            elif word in _ARTICLES and not behind:
                raise _UnreadError  # it breaks off
            elif word not in _DETERMINERS or not behind or behind in stops:
                parts.append(token)
            self.at += 1
        kept = [
            p for p in parts
            if p.quoted or not (p.word in _ADVERBS or (p.word.endswith("ly") and len(p.word) > 4))
        ]  # fmt: skip
        if not kept:
            return []
        words = [p.word for p in kept if p.word not in ("of", "two", "three")]
        if set(words) <= _PLURAL:
            return self._them() or [" ".join(p.written for p in kept)]
        if len(kept) == 1 and words[0] in PRONOUNS:
            return next((of for _, of in self._referents()[:_LOOK_BACK]), words)
        text = [_NUMBERS.get(kept[0].word, kept[0].written), *(p.written for p in kept[1:])]
        self._said.append(" ".join(text))
        return self._said[-1:]

    def _referents(self) -> list[tuple[str, list[str]]]:
        """Return what the steps before did and with what, without what this clause names too."""
        behind = takewhile(
            lambda token: token.word not in _JOINING, self._tokens[self.at : self.at + 20]
        )
        said = f" {' '.join([*self._said, *(token.written for token in behind)])} ".lower()
        named = ((act, [n for n in of if f" {n.lower()} " not in said]) for act, of in self._before)
        return [(act, of) for act, of in named if of]

    def _them(self) -> list[str]:
        """Return the things that the step before was about, or steps of one action in a row.

        The nearest that are several; if none are, what the step before was about.
        """
        before = self._referents()
        runs = [[*run][::-1] for _, run in groupby(before, key=lambda step: step[0])]
        named = [[name for _, of in steps for name in of] for steps in (before[:1], *runs)]
        several = (names for names in named if len(names) > 1 or _SEVERAL.search(names[0]))
        return list(dict.fromkeys(next(several, named[0]))) if before else []

    def _calls(
        self, name: str, verb: Verb | None, objects: list[str], phrases: Phrases
    ) -> Iterator[Call]:
        """Yield the step, or one for each of several objects."""
        placed: dict[str, str] = {}
        others: list[str] = []
        brought: list[Call] = []
        for mark, nps in phrases:
            if not mark or not nps:
                continue
            text = f"{mark} {' and '.join(nps)}"
            at = verb.at(mark, bool(objects)) if verb else ""
            hidden = verb and any(mark in p.prepositions for p in verb.action.parameters)
            if all(np.lower() in _PERSONS for np in nps) or at in placed or (hidden and not at):
                self._left_out.append(text)  # the action finds its own
            elif at and len(nps) > 1:
                raise _UnreadError  # which of them is meant, or what else is to be done?
            elif at:
                placed[at] = nps[0]
            elif not verb or not (objects or placed) or nps[0][:1].isdigit():
                others += nps
            elif objects and (put := self._words.puts(verb, mark)):
                objects += nps[1:]  # "bring the plate to the table, and the bowl"
                brought += [keyworded(put, [("", np), ("", nps[0])]) for np in objects]
            elif objects and mark in _ASIDE_MARKS:
                self._left_out.append(text)
            elif objects:
                objects[-1] += f" {text}"  # "the pan on the stove" is one thing
            else:
                placed[list(placed)[-1]] += f" {text}"
        behind = [*placed.items(), *(("", np) for np in others)]
        if verb and placed and objects and verb.action.visible[0].name in placed:
            self._left_out += objects  # what is mixed in the bowl is what the bowl holds
            objects = []
        each = [[("", np)] for np in objects]
        if sum(not mark for mark, _ in phrases) > 1:
            each = [[pair for pairs in each for pair in pairs]]
        for n, first in enumerate(each or [[]]):
            yield keyworded(name, [*first, *behind])
            yield from brought[n : n + 1] if len(each) == len(objects) else ()


def is_negated(phrase: str) -> bool:
    """Tell whether a phrase says what is not to be done."""
    return bool(_NEGATED.match(_stripped(phrase)))
