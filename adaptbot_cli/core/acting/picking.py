"""The parts of a new action, put together by one pick after the other."""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace

from adaptbot_cli.core.acting.draft import Draft, DraftEffect, Need, in_words, plain, signature
from adaptbot_cli.core.acting.offers import changes, needs
from adaptbot_cli.core.acting.taking import parameter_of
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import a
from adaptbot_cli.core.plan import Call
from adaptbot_cli.core.questions import UNKNOWN, Choice, Question

TAKES, REQUIRES, CHANGES = "takes", "requires", "changes"
PARTS = (TAKES, REQUIRES, CHANGES)
DONE = "done"

_TEXTS = {
    TAKES: "What else does {} take, or not take?",
    REQUIRES: "What must hold before {}?",
    CHANGES: "What is different after {}?",
}


@dataclass(frozen=True, slots=True)
class Pick:
    """Something that can be picked: the words people read, and the draft that it leads to."""

    label: str
    leads_to: Draft
    there: bool = False


def put_together(
    part: str, draft: Draft, call: Call, kg: Kg, counts: dict[str, int]
) -> Generator[Question, str, Draft]:
    """Ask for one part of an action until that is all; return the draft as it is then.

    `call` is the plan's own, for an example; `counts` how often each part has been asked for.
    """
    while True:
        counts[part] += 1
        offers = _OFFERS[part](draft, examples(draft, call), kg)
        picked = yield _question(part, draft, call, offers, counts[part])
        if picked == UNKNOWN and part == CHANGES:
            return replace(draft, changes=())
        if picked not in offers:
            return draft
        draft = offers[picked].leads_to


def _question(
    part: str, draft: Draft, call: Call, offers: Mapping[str, Pick], nth: int
) -> Question:
    choices = [Choice(value, offer.label) for value, offer in offers.items() if offer.there]
    choices += [Choice(value, offer.label) for value, offer in offers.items() if not offer.there]
    first = [Choice(DONE, "that is all")]
    if part == REQUIRES and not draft.needs:
        first = [Choice(DONE, "nothing")]
    if part == CHANGES:
        unknown = Choice(UNKNOWN, "I don't know, or nothing that I keep track of")
        first = [*first, unknown] if draft.changes else [unknown]
    text = _TEXTS[part].format(f'"{draft.name.replace("_", " ")}"')
    shown = words_of(draft, examples(draft, call))
    return Question(
        "action",
        draft.name,
        text,
        f"{part}_{nth}",
        "action",
        choices=(*first, *choices),
        notes=shown,
    )


def _takes(draft: Draft, shown: Mapping[str, str], kg: Kg) -> dict[str, Pick]:
    """A parameter less, one that can be left out, or one more of some kind."""
    found: dict[str, Pick] = {}
    for p in draft.visible:
        found[f"not {p.name}"] = Pick(f"not the {p.name}", draft.without(p.name), there=True)
        if not p.default:
            text = "must always be named" if p.optional else "can be left out"
            other = [replace(q, optional=not q.optional) if q == p else q for q in draft.parameters]
            leads_to = replace(draft, parameters=tuple(other))
            found[f"{p.name} {text}"] = Pick(f"the {p.name} {text}", leads_to, there=True)
    for kind in kg.domain.teachable:
        more = parameter_of(kind, draft.parameters, kg)
        leads_to = replace(draft, parameters=(*draft.parameters, more))
        found[f"also {more.name}"] = Pick(f"also {a(kind.label)}: the {more.name}", leads_to)
    return found


def _requires(draft: Draft, shown: Mapping[str, str], kg: Kg) -> dict[str, Pick]:
    there = {need.words: need for need in draft.needs}
    offered = {**there, **{n.words: n for n in needs(draft, kg.domain) if n.words not in there}}
    return {
        plain(words): _offer(n, words in there, draft.toggled_need(n), shown)
        for words, n in offered.items()
    }


def _changes(draft: Draft, shown: Mapping[str, str], kg: Kg) -> dict[str, Pick]:
    return {
        plain(c.words): _offer(c, c in draft.changes, draft.toggled_change(c), shown)
        for c in changes(draft, kg.domain)
    }


def _offer(
    part: Need | DraftEffect, there: bool, leads_to: Draft, shown: Mapping[str, str]
) -> Pick:
    [label] = in_words([part.words], shown)
    return Pick(f"no longer: {label}" if there else label, leads_to, there)


_OFFERS = {TAKES: _takes, REQUIRES: _requires, CHANGES: _changes}


def examples(draft: Draft, call: Call) -> dict[str, str]:
    """Return the things that the plan names for the parameters, to say with them what is meant."""
    names = (arg.replace("_", " ") for arg in call.args)
    return {p.name: arg for p, arg in zip(draft.visible, names, strict=False)}


def words_of(draft: Draft, shown: Mapping[str, str]) -> tuple[str, ...]:
    """Say in lines what an action takes, requires and changes, `shown` being an example of it."""
    shown = shown or {p.name: p.name for p in draft.parameters}
    required = in_words([need.words for need in draft.needs], shown)
    changed = in_words([change.words for change in draft.changes], shown)
    like = f", much like {draft.like}" if draft.like else ""
    return (
        f"{signature(draft.name, draft.parameters)}{like}",
        f"requires: {'; '.join(required) or 'nothing'}",
        f"changes: {'; '.join(changed) or 'its effect is not known'}",
    )
