"""Three-way merge of what two sides know of one home, and the answers of which only one can stand.

A fact that both began with stays if neither has retracted it; one that either has added comes in.
So any order of merging gives the same graph. What the domain does not allow beside each other is a
conflict for a person to settle.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Literal as OneOf

from rdflib import RDF
from rdflib.term import Node

from adaptbot_cli.core.ask.questions import Answer, Choice, Question
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, FACT_TERMS, FALSE, TRUE, Triple, local
from adaptbot_cli.core.names import a

Facts = frozenset[Triple]
Side = OneOf["ours", "theirs"]
Key = tuple[Node, Node | None]
_NONE: Facts = frozenset()


@dataclass(frozen=True, slots=True)
class Merge:
    """The facts that two sides have in common (`base`), and those of each now."""

    base: Facts
    ours: Facts
    theirs: Facts

    @property
    def facts(self) -> Facts:
        """The merged facts; where sides are in conflict, those of both."""
        both = self.ours & self.theirs
        return both | (self.ours - self.base) | (self.theirs - self.base)


@dataclass(frozen=True, slots=True)
class Conflict:
    """Answers of which one stands: the facts of each side that exclude the other's.

    `about` is the thing, `prop` the property with one value, None where the thing as a whole is in
    question: whether it is there, or what it is.
    """

    about: Node
    prop: Node | None
    ours: Facts
    theirs: Facts

    @property
    def key(self) -> Key:
        """What the conflict is about, the same on either side."""
        return self.about, self.prop

    def settled(self, facts: Facts, side: Side) -> Facts:
        """Return merged facts in which one side's answer stands."""
        return (facts - self.ours - self.theirs) | (self.ours if side == "ours" else self.theirs)


def conflicts(merge: Merge, domain: Domain) -> list[Conflict]:
    """Return the conflicts that the domain's declarations show: two values of a property that has
    one, values that exclude each other (`ab:impliedBy`), a thing that one side has retracted and
    the other says more of, one that is there to one side and absent to the other."""
    found = {
        conflict.key: conflict
        for part in (_gone(merge), _absent(merge, domain), _values(merge, domain))
        for conflict in part
    }
    whole = {about for about, prop in found if prop is None}
    return [found[key] for key in sorted(found, key=str) if key[1] is None or key[0] not in whole]


def of_faults(faults: Iterable[Fault], merge: Merge) -> list[Conflict]:
    """Return the conflicts behind what the domain does not allow in the merged facts; none for a
    fault that the choice of a side cannot mend."""
    found = {}
    for fault in faults:
        things = {fault.about, *(subject for subject, _, _ in fault.facts)} - {None}
        ours, theirs = (
            frozenset(t for t in facts if t[0] in things and t[1] not in FACT_TERMS)
            | (fault.facts & facts)
            for facts in (merge.ours, merge.theirs)
        )
        if ours != theirs and fault.about is not None:
            found[fault.about] = Conflict(fault.about, None, ours, theirs)
    return [found[about] for about in sorted(found, key=str)]


def _values(merge: Merge, domain: Domain) -> Iterator[Conflict]:
    """Slots of one value that both sides have filled otherwise since they parted, and pairs of
    slots that the sides have filled so that one excludes the other."""
    functional = {prop.iri for prop in domain.properties.values() if prop.functional}
    ours, theirs, base = map(_by_slot, (merge.ours, merge.theirs, merge.base))
    for slot in sorted(ours.keys() & theirs.keys()):
        mine, other = ours[slot], theirs[slot]
        if slot[1] in functional and mine != other and base.get(slot) not in (mine, other):
            yield Conflict(*slot, mine, other)
    merged = _by_slot(merge.facts)
    for prop in domain.properties.values():
        for implied in prop.implied:
            for subject, predicate in sorted(slot for slot in merged if slot[1] == implied.prop):
                pair = ((subject, predicate), (subject, prop.iri))
                equal = (*pair[0], implied.equals) in merged[pair[0]]
                if not equal or merged.get(pair[1], _NONE) <= {(*pair[1], implied.value)}:
                    continue
                mine, other = (
                    side.get(pair[0], _NONE) | side.get(pair[1], _NONE) for side in (ours, theirs)
                )
                if mine and other and mine != other:
                    yield Conflict(*pair[1], mine, other)


def _gone(merge: Merge) -> Iterator[Conflict]:
    """Things that one side has retracted and of which the other has learned more."""
    things = {s for s, p, _ in merge.base if p == RDF.type}
    ours, theirs = ({s for s, p, _ in side if p == RDF.type} for side in (merge.ours, merge.theirs))
    for left, new in ((things - ours, merge.theirs), (things - theirs, merge.ours)):
        more = new - merge.base
        for thing in sorted(left & {node for s, _, o in more for node in (s, o)}, key=str):
            yield Conflict(thing, None, *_around(thing, merge))


def _absent(merge: Merge, domain: Domain) -> Iterator[Conflict]:
    """Things that are there to one side, where to the other nothing is called so."""
    found = {t for t in merge.ours ^ merge.theirs if t[1] == AB.absentItem}
    naming = {AB.alias, *domain.name_properties()}
    for thing, predicate, name in sorted(merge.ours ^ merge.theirs):
        if predicate in naming:
            for absence in (t for t in found if t[2] == name):
                ours, theirs = _around(thing, merge)
                if absence in merge.ours and (thing, predicate, name) in merge.theirs:
                    yield Conflict(thing, None, ours | {absence}, theirs)
                elif absence in merge.theirs and (thing, predicate, name) in merge.ours:
                    yield Conflict(thing, None, ours, theirs | {absence})


def _around(thing: Node, merge: Merge) -> tuple[Facts, Facts]:
    """The facts of each side about a thing, or with it as a value."""
    ours, theirs = (
        frozenset(t for t in side if thing in (t[0], t[2])) for side in (merge.ours, merge.theirs)
    )
    return ours, theirs


def _by_slot(facts: Facts) -> dict[tuple[Node, Node], Facts]:
    found: dict[tuple[Node, Node], set[Triple]] = {}
    for triple in facts:
        found.setdefault(triple[:2], set()).add(triple)
    return {slot: frozenset(triples) for slot, triples in found.items()}


_KEYS = {"yes": "y", "no": "n", "ours": "o", "theirs": "t"}


def question(conflict: Conflict, kg: Kg, sources: tuple[str, str]) -> Question:
    """Return the question which of two answers stands; `sources` say who gave each."""
    about, label = kg.name(conflict.about), "which"
    prop = kg.domain.properties.get(conflict.prop)  # type: ignore[call-overload]
    sides = [_origin_text(facts, conflict, kg) for facts in (conflict.ours, conflict.theirs)]
    plain = f'"{about.replace("_", " ")}"'
    text = f"What holds of {plain}?"
    if prop is not None:
        label = prop.label
        text = (prop.question or f"What is right of {{name}}: {label}?").format(name=plain)
    values = [
        message if prop is not None and len(set(sides)) == 2 else side
        for message, side in zip(sides, ("ours", "theirs"), strict=True)
    ]
    given = zip(values, sides, ("here", "there"), sources, strict=True)
    choices = tuple(
        Choice(value, message, f"{where}, {source}" if source else where, _KEYS.get(value, ""))
        for value, message, where, source in given
    )
    return Question(
        "conflict",
        about,
        text,
        local(conflict.prop) if conflict.prop is not None else "",
        choices=(*choices, Choice("later", "ask me later", "nothing is merged until then", "l")),
        label=label,
    )


def side_of(answer: Answer, asked: Question) -> Side | None:
    """Return the side that an answer to `question` lets stand, None if neither."""
    values = [choice.value for choice in asked.choices[:2]]
    sides: tuple[Side, Side] = ("ours", "theirs")
    return dict(zip(values, sides, strict=True)).get(answer.value)


def _origin_text(facts: Facts, conflict: Conflict, kg: Kg) -> str:
    """The answer of one side, in words."""
    if conflict.prop is not None:
        mine = [value for _, p, value in sorted(facts) if p == conflict.prop]
        words: dict[Node, str] = {TRUE: "yes", FALSE: "no"}
        return " and ".join(words.get(v) or kg.name(v) for v in mine) or "unknown"
    kinds = [value for s, p, value in sorted(facts) if s == conflict.about and p == RDF.type]
    if not kinds:
        return "it is not here"
    return f"it is {' and '.join(a(kg.domain.label(kind)) for kind in kinds)}"
