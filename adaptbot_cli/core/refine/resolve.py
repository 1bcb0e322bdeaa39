"""From a written name to an item or action of the home: remedies from KG and words (III-B).

The remedies are tried in order, and a substitution is automatic only when it is safe: the
candidate is of the right kind and unique, the name is no required item, and the plan does not use
the candidate otherwise. What is not safe becomes a suggestion.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from rdflib import URIRef

from adaptbot_cli.core import english
from adaptbot_cli.core.ask.learning import is_absent
from adaptbot_cli.core.domain import Action, CalledAs
from adaptbot_cli.core.names import (
    folded,
    misspelt,
    nearest,
    normal,
    parted,
    sentence_list,
    variants,
    words,
)
from adaptbot_cli.core.plan import Approved, Change, Finding
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Related, Relation

_NUMBER = r"(?:\d[\d./]*[a-z]*|[½¼¾])"
# Which words are measures is not known here: without an "of" only a number goes, not a word.
_AMOUNTS = (
    re.compile(rf"(?:{_NUMBER}|an?|some) (?:[a-z]+ ){{0,2}}of (.+)"),
    re.compile(rf"(?:{_NUMBER}|an?|the|some) (.+)"),
    re.compile(rf"(.+?) ?\({_NUMBER}[^()]*\)"),
)


def without_amount(name: str) -> Iterator[tuple[str, bool]]:
    """Give what a name may be without its amount, and whether that is the one thing ("the egg")."""
    text = normal(name).replace("_", " ")
    for amount in _AMOUNTS:
        match = amount.fullmatch(text)
        rest = match[1].removeprefix("the ") if match else ""
        if rest:
            yield rest, text.startswith("the ")


T = TypeVar("T")

_REACH = {"synonym": 0, "hypernym": 1, "hyponym": 1}
"""How many edges away a word may be that is put in unasked."""

_INVERSE: Mapping[Relation, Relation] = {
    "synonym": "synonym",
    "hypernym": "hyponym",
    "hyponym": "hypernym",
}
_FEW = 2
"""How many narrower senses a word may have for one of them to be meant: a refrigerator is a fridge
or a cooler, but a fruit may be anything."""

BY_WORDS = frozenset({"synonym", "hypernym", "hyponym"})
"""The remedies that put in another thing on the evidence of words alone."""
_NEAR = 2
"""How many edges away a related word may be to be suggested."""

_SEVERAL = 2
"""How many other things with the last word of a name make it unsure which one is meant."""

_ALIKE = 0.75
"""From which likeness on another thing's name may have been meant as well."""

_PREPOSITIONS = frozenset({"on", "onto", "in", "into", "inside", "upon", "atop"})
_ARTICLES = frozenset({"a", "an", "the", "some", "of", "from", "with"})


@dataclass(frozen=True, slots=True)
class Named:
    """What a name was taken to mean: an entity, how, and states that the name implies of it."""

    entity: URIRef | None = None
    change: Change | None = None
    states: tuple[URIRef, ...] = ()
    finding: Finding | None = None


def item(name: str, classes: Sequence[URIRef], scene: Scene) -> Named:
    """Return the item that a name means where one of `classes` is wanted."""
    key = (name, tuple(classes))
    if key not in scene.meant:
        scene.meant[key] = _item(name, classes, scene)
    named: Named = scene.meant[key]
    return named


def _item(name: str, classes: Sequence[URIRef], scene: Scene) -> Named:
    for remedy in (
        _known,
        _spelled,
        _amount,
        _whole,
        _several,
        _place_of_phrase,
        _with_state,
        _product,
        _by_words,
    ):
        named = remedy(name, classes, scene)
        if named is not None:
            return named
    return Named(finding=unknown_item(name, classes, scene))


def _called(name: str, classes: Iterable[URIRef], scene: Scene) -> list[URIRef]:
    """The things of some classes that bear a name."""
    return [entity for entity in scene.kg.find(name) if scene.kg.is_a(entity, classes)]


def _known(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    found = scene.kg.find(name)
    if not found:
        return None
    entity = next((e for e in found if scene.kg.is_a(e, classes)), found[0])
    return Named(entity, _renamed(name, entity, scene))


def _renamed(name: str, entity: URIRef, scene: Scene) -> Change | None:
    proper = scene.kg.name(entity)
    if name == proper:
        return None
    learned = not {normal(form) for form in scene.kg.aliases(entity)}.isdisjoint(variants(name))
    if learned:
        why = f"{name} is another name for {proper}"
        if normal(name) in scene.instead:
            why = f"{proper} is used instead, this time only"
        return Change(name, proper, "alias", why, "human")
    return Change(name, proper, "normalisation", f"{name} is {proper}, written differently")


def _spelled(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    """A name that differs by an "s" alone, as a possessive or plural inside it does."""
    if len(words(name)) < 2 or is_absent(scene.kg, name, "item"):
        return None
    found = [e for e in scene.kg.spelled(name) if scene.kg.is_a(e, classes)]
    if len(found) != 1:
        return None
    return Named(found[0], _renamed(name, found[0], scene))


def _amount(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    """A known item behind a number, an article or an amount: "2 eggs", "a pinch of salt"."""
    for rest, definite in without_amount(name):
        found = _called(rest, classes, scene)
        if found and definite:
            return Named(found[0], _renamed(name, found[0], scene))
        if found and not scene.kg.is_a(found[0], scene.domain.places):  # "2 plates" are two
            proper = scene.kg.name(found[0])
            why = f"{name} is an amount of {proper}"
            return Named(found[0], Change(name, proper, "amount", why))
        if scene.requires(rest) and not scene.kg.find(rest):
            return Named(finding=unknown_item(rest, classes, scene))
    return None


def _whole(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    """A thing named by a part of it: "the pot's contents", "fridge door"."""
    parts = [word.removesuffix("'s").removesuffix("'") for word in words(name)]
    rest = [w for w in parts if w not in scene.domain.part_words and w not in _ARTICLES]
    found = _called("_".join(rest), classes, scene)
    if not found or scene.domain.part_words.isdisjoint(parts):
        return None
    proper = scene.kg.name(found[0])
    return Named(found[0], Change(name, proper, "part", f'"{name}" means {proper} here'))


def _several(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    if normal(name) not in scene.domain.quantifiers:
        return None
    message = f'"{name}" stands for several items; name each in a step of its own'
    return Named(finding=Finding("E204", message, name))


def _place_of_phrase(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    """A phrase of a thing and where it is, "egg on bread on plate".

    Where a place is wanted it is the last place that is named, else the thing that comes first.
    """
    parts = words(name)
    cuts = [n for n, part in enumerate(parts) if part in _PREPOSITIONS]
    if not cuts:
        return None
    for part, wanted, by in (
        (parts[cuts[-1] + 1 :], scene.domain.places, "place of the phrase"),
        (parts[: cuts[0]], frozenset(classes), "thing of the phrase"),
    ):
        text = "_".join(word for word in part if word not in _ARTICLES)
        found = _called(text, classes, scene)
        if found and scene.kg.is_a(found[0], wanted):
            proper = scene.kg.name(found[0])
            return Named(found[0], Change(name, proper, by, f'"{name}" means {proper} here'))
    return None


def _with_state(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    """A state word with a known item, "sliced_apple": the item, which must then be so."""
    parts = words(name)
    for prop in scene.domain.properties.values():
        lines = [part for part in parts if part in prop.state_words]
        rest = "_".join(p for p in parts if p not in prop.state_words and p not in _ARTICLES)
        if not lines or not rest:
            continue
        found = _called(rest, [prop.domain], scene)
        if found:
            proper = scene.kg.name(found[0])
            why = f"{name} is {proper} that is {prop.label}"
            return Named(found[0], Change(name, proper, "state", why), (prop.iri,))
        if scene.requires(rest) and not scene.kg.find(rest):
            return Named(finding=unknown_item(rest, classes, scene))
    return None


def _product(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    if scene.requires(name) or not scene.is_product(name):
        return None
    message = f'"{name}" is what the plan makes, not an item of the home'
    return Named(finding=Finding("E203", message, name))


def _by_words(name: str, classes: Sequence[URIRef], scene: Scene) -> Named | None:
    """A synonym, broader or narrower word that names exactly one item of the right kind.

    Both words must be meant in their first senses, and nothing else here may be called so.
    """
    if not scene.repair or scene.requires(name) or is_absent(scene.kg, name, "item"):
        return None
    related = scene.known.get(normal(name), ())
    best = _best(related, lambda w: set(_called(w, classes, scene)))
    if best is None or best[0].sense > 1:
        return None
    word, entity = best
    sure = _mutual(name, word, entity, scene) and not _rivals(name, entity, classes, scene)
    if not sure or scene.bars(entity):
        return None
    if scene.uses(entity) and normal(name) not in scene.agreed:
        return None
    if scene.taken.setdefault(entity, normal(name)) != normal(name):
        return None
    proper = scene.kg.name(entity)
    return Named(entity, Change(name, proper, word.relation, _word_evidence(name, word)))


def _mutual(name: str, word: Related, entity: URIRef, scene: Scene) -> bool:
    """Whether what the item is called leads back to the name, in its own first sense.

    A broader word must be the last of the name or a synonym, or both have one sense.
    A narrower word must be one of few.
    """
    back = scene.known.get(normal(scene.kg.name(entity)), ())
    first = min((other.sense for other in back), default=0)
    inverse = _INVERSE[word.relation]
    forms = set(variants(name)) | {folded(name)}
    leads = any(
        other.sense == first
        and other.relation == inverse
        and not {other.word, folded(other.word)}.isdisjoint(forms)
        for other in back
    )
    related = scene.known.get(normal(name), ())
    if back and not leads:
        return False
    if word.relation == "hypernym" and back:
        same = (w.word for w in related if (w.relation, w.sense) == ("synonym", word.sense))
        own = words(scene.kg.name(entity))[-1:]
        head = any(words(form)[-1:] == own for form in (name, *same))
        return head or len({w.sense for w in related}) == len({w.sense for w in back}) == 1
    if word.relation == "hyponym":
        narrower = {w.gloss for w in related if w.relation == "hyponym" and w.distance == 1}
        return len(narrower) <= _FEW
    return True


def _rivals(name: str, entity: URIRef, classes: Sequence[URIRef], scene: Scene) -> bool:
    """Whether another item's name holds this one or is spelt much like it: which one is meant?"""
    text, own = folded(name), scene.kg.name(entity)
    others = [other for other in scene.kg.alike(name, classes) if other != own]
    holding = (n for n in others if len(text) > 3 and (text in folded(n) or folded(n) in text))
    parts = set(words(name)) - set(words(own))
    if len(words(name)) > 1 and any(parts & set(words(other)) for other in others):
        return True
    # Of several knives, which one is a paring knife? A frying pan is no cake pan.
    several = [e for part in words(name)[-1:] for e in scene.kg.with_head(part) if e != entity]
    return any(holding) or len(several) >= _SEVERAL or bool(misspelt(name, others, _ALIKE))


def _best(related: Iterable[Related], named: Callable[[str], set[T]]) -> tuple[Related, T] | None:
    """The one thing that the word's first sense names at the shortest distance within reach."""
    words = list(related)
    first = min((word.sense for word in words), default=0)
    near = [w for w in words if w.sense == first and w.distance <= _REACH[w.relation]]
    for distance in sorted({word.distance for word in near}):
        ring = [word for word in near if word.distance == distance]
        things = {thing for word in ring for thing in named(word.word)}
        if things:
            thing = next(iter(things))
            word = next(word for word in ring if thing in named(word.word))
            return (word, thing) if len(things) == 1 else None
    return None


def _word_evidence(name: str, word: Related) -> str:
    text, other = name.replace("_", " "), word.word.replace("_", " ")
    relations = {
        "synonym": f"WordNet: {text} means the same as {other}",
        "hypernym": f"WordNet: {text} is a kind of {other}",
        "hyponym": f"WordNet: {other} is a kind of {text}",
    }
    return relations[word.relation]


def unknown_item(name: str, classes: Sequence[URIRef], scene: Scene) -> Finding:
    """Return the finding of an item that the KG does not know, with what is near it."""
    if normal(name) in english.PRONOUNS:
        message = f'"{name}" stands for nothing: no step before names a thing that it could mean'
        return Finding("E201", message, name)
    near = near_items(name, classes, scene)
    if is_absent(scene.kg, name, "item"):
        message = f"{name} is not here, as a person has said"
    elif near:
        message = f"{name} is not in the knowledge graph; near it: {sentence_list(near)}"
    else:
        message = f"{name} is not in the knowledge graph"
    return Finding("E201", message, name, candidates=tuple(near))


def near_items(name: str, classes: Sequence[URIRef], scene: Scene) -> list[str]:
    """Return names of items of the right kind near a name: related words first, then spelling."""
    key = (normal(name), frozenset(classes))
    if key not in scene.near:
        scene.near[key] = _near_items(name, classes, scene)
    return scene.near[key]


def _near_items(name: str, classes: Sequence[URIRef], scene: Scene) -> list[str]:
    """First what holds the name or its last word or bears a related word, then what is alike."""
    related = [word.word for word in scene.known.get(normal(name), ()) if word.distance <= _NEAR]
    whole = [
        scene.kg.name(entity)
        for word in related
        for entity in sorted(_called(word, classes, scene))
    ]
    parts = {part for word in (name, *related) for part in words(word)[-1:]}
    alike = scene.kg.alike(name, classes)
    heads = [folded(part) for part in (name, *words(name)[-1:]) if len(part) > 3]
    holding = [other for head in heads for other in alike if head in folded(other)]
    sharing = [
        scene.kg.name(entity)
        for part in sorted(parts)
        for entity in scene.kg.with_head(part)
        if scene.kg.is_a(entity, classes)
    ]
    near = dict.fromkeys([*holding, *whole, *sharing, *nearest(name, alike)])
    return [other for other in near if not scene.excludes(other)][:5]


@dataclass(frozen=True, slots=True)
class NamedAction:
    """What an action's name was taken to mean, with the arguments that the name itself fixes."""

    action: Action | None = None
    change: Change | None = None
    fixed: tuple[CalledAs, ...] = ()
    finding: Finding | None = None


def action(name: str, scene: Scene) -> NamedAction:
    """Return the action that a name means."""
    known = scene.domain.actions.get(normal(name))
    if known is not None:
        return NamedAction(known)
    for remedy in (_action_named, _action_by_verb, _action_by_words):
        named = remedy(name, scene)
        if named is not None:
            return named
    return NamedAction(finding=_unknown_action(name, scene))


def _plain(name: str, scene: Scene) -> tuple[str, ...]:
    """A name without separators, and without an ending that actions have: add_obj is add."""
    head, _, ending = normal(parted(name)).rpartition("_")
    endings = {known.rpartition("_")[2] for known in scene.domain.actions if "_" in known}
    return (folded(name), folded(head)) if head and ending in endings else (folded(name),)


def _action_named(name: str, scene: Scene) -> NamedAction | None:
    """An action by a name of it, whatever parts its words: pickUp, turnon; sauté is saute."""
    for wording in _plain(name, scene):
        for known in scene.domain.actions.values():
            taught = wording in map(folded, scene.kg.aliases(known.iri))
            fixed = tuple(c for c in known.called_as if wording in map(folded, c.names))
            by: Approved = "human" if taught else "rule"
            if wording == folded(known.name):
                why = f"{name} is {known.name}, written differently"
                return NamedAction(known, Change(name, known.name, "normalisation", why))
            if taught or wording in map(folded, known.aliases):
                why = f"{name} is another name for {known.name}"
                if normal(name) in scene.instead:
                    why = f"{known.name} is done instead, this time only"
                return NamedAction(known, Change(name, known.name, "alias", why, by))
            if fixed:
                text = sentence_list([called.parameter for called in fixed])
                why = f"{name} is {known.name} with {text} set"
                return NamedAction(known, Change(name, known.name, "alias", why), fixed)
    return None


def _action_by_verb(name: str, scene: Scene) -> NamedAction | None:
    """An action named by its verb alone: stir is stir_contents, if nothing else stirs."""
    for text in _plain(name, scene):
        found = [known for known in scene.domain.actions.values() if folded(known.verb) == text]
        if len(found) == 1:
            why = f"{found[0].name} is the only action that does so"
            return NamedAction(found[0], Change(name, found[0].name, "verb", why))
    return None


def _action_by_words(name: str, scene: Scene) -> NamedAction | None:
    if not scene.repair or is_absent(scene.kg, name, "action"):
        return None
    related = scene.known.get(normal(name), ())
    same = {word.word for word in related if word.relation == "synonym"}
    best = _best(related, lambda word: _actions_called(word, scene, aliases=word in same))
    if best is None or best[0].sense > 1 or best[0].relation == "hyponym":
        return None
    word, known = best[0], scene.domain.actions[best[1]]
    return NamedAction(known, Change(name, known.name, word.relation, _verb_evidence(name, word)))


def _actions_called(word: str, scene: Scene, aliases: bool) -> set[str]:
    actions = scene.domain.actions.values()
    return {a.name for a in actions if word in (a.name, a.verb, *(a.aliases if aliases else ()))}


def _verb_evidence(name: str, word: Related) -> str:
    text, other = name.replace("_", " "), word.word.replace("_", " ")
    if word.relation == "synonym":
        return f"WordNet: to {text} means to {other}"
    way, broad = (text, other) if word.relation == "hypernym" else (other, text)
    return f"WordNet: to {way} is a way to {broad}"


def _unknown_action(name: str, scene: Scene) -> Finding:
    near = near_actions(name, scene)
    message = f"{name} is not an action of this robot"
    if is_absent(scene.kg, name, "action"):
        message += ", as a person has said"
    elif near:
        message += f"; near it: {sentence_list(near)}"
    return Finding("E101", message, name, candidates=tuple(near))


def near_actions(name: str, scene: Scene) -> list[str]:
    """Return names of actions near a name: related words first, then spelling."""
    related = [
        action.name
        for word in scene.known.get(normal(name), ())
        for action in scene.domain.actions.values()
        if word.distance <= _NEAR and word.word in (action.name, action.verb, *action.aliases)
    ]
    actions = scene.domain.actions.values()
    verbs = nearest(normal(name).split("_")[0], {action.verb for action in actions})
    alike = [action.name for verb in verbs for action in actions if action.verb == verb]
    called = {folded(other): action.name for action in actions for other in action.names}
    spelled = [called[other] for other in nearest(folded(name), called)]
    return list(dict.fromkeys([*related, *alike, *spelled]))[:5]
