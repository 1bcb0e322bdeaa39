"""How often the suggested answers are right: each thing is left out of its graph in turn.

`python tests/bench/suggestions.py [--published DIR] [--details]` prints a table for the bundled
domains and, where they are, the published graphs as they were after their human-assisted runs.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from rdflib import Literal, URIRef
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg, read_graphs
from adaptbot_cli.core.ask import agenda, learning, suggest
from adaptbot_cli.core.ask.questions import Question
from adaptbot_cli.core.domain import ItemClass
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Related
from adaptbot_cli.resources import bundled

DOMAINS = {"cooking": "kitchen", "cleaning": "household"}


@dataclass
class Score:
    """What became of the suggestions for one graph."""

    asked: Counter[str] = field(default_factory=Counter)
    made: Counter[str] = field(default_factory=Counter)
    right: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def add(self, kind: str, what: str, told: str | None, truth: str) -> None:
        self.asked[kind] += 1
        self.made[kind] += told is not None
        self.right[kind] += told == truth
        if told not in (None, truth):
            self.wrong.append(f"{kind} {what}: {told}, but {truth}")


def leave_out(kg: Kg) -> Score:
    """Take each thing's facts away, suggest them, and put them back."""
    score = Score()
    lexicon = WordNet()
    around: dict[str, tuple[Related, ...]] = {}
    for kind in kg.domain.teachable:
        for entity in list(kg.facts.subjects(None, kind.iri)):
            if isinstance(entity, URIRef):
                _one(kg, kind, entity, score, lexicon, around)
    return score


def _one(
    kg: Kg,
    kind: ItemClass,
    entity: URIRef,
    score: Score,
    lexicon: WordNet,
    around: dict[str, tuple[Related, ...]],
) -> None:
    name = kg.name(entity)
    facts = frozenset(kg.facts.triples((entity, None, None)))
    scene = Scene(kg, Task("none"), around=around)
    asked = Question("kind", name, "")
    for word in suggest.words_to_look_up(asked, scene):
        around[word] = lexicon.related(word, kg.domain.noun_fields)
    kg.learn(Delta(removed=facts))
    try:
        told = suggest.Likely(name, kg.domain.teachable, scene).kind()
        score.add("kind", name, told and told.value, kind.iri.rsplit("/", 1)[-1])
        new = learning.existence(kg, name, kind)
        kg.learn(new)
        for what, group, told_value, truth in _attributes(kg, name, facts, scene):
            score.add(group, what, told_value, truth)
        kg.learn(Delta(removed=new.added))
    finally:
        kg.learn(Delta(added=facts))


def _attributes(
    kg: Kg, name: str, facts: object, scene: Scene
) -> Iterator[tuple[str, str, str | None, str]]:
    known = {p: o for _, p, o in facts}  # type: ignore[attr-defined]
    for question in agenda.rest(name, scene, {}):
        prop = next(p for p in kg.domain.properties.values() if str(p.iri).endswith(question.prop))
        truth = known.get(prop.iri)
        if truth is None:
            continue
        told = question.suggested.value if question.suggested else None
        if isinstance(truth, Literal):
            said = {True: "yes", False: "no"}.get(truth.toPython(), str(truth))
            yield f"{name} {question.prop}", "attribute", told, said
        else:
            yield f"{name} {question.prop}", "place", told, kg.name(truth)


def graphs(published: Path | None) -> Iterator[tuple[str, Kg]]:
    for name in ("kitchen", "household"):
        yield name, load_kg(read_files(bundled("kg") / name), name)
    for path in sorted((published / "kg").glob("*.after-human.*")) if published else ():
        domain = DOMAINS[path.name.split(".")[0]]
        yield path.stem, load_kg(read_files(bundled("kg") / domain), domain, read_graphs([path]))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--published", type=Path)
    parser.add_argument("--details", action="store_true")
    options = parser.parse_args()
    shown = ("attribute", "place", "kind")
    table = Table("graph", *(f"{kind} {what}" for kind in shown for what in ("suggested", "right")))
    for name, kg in graphs(options.published):
        score = leave_out(kg)
        cells = []
        for kind in shown:
            made, right = score.made[kind], score.right[kind]
            cells += [f"{made} of {score.asked[kind]}", f"{100 * right / max(made, 1):.0f} %"]
        table.add_row(name, *cells)
        if options.details:
            print(name, *score.wrong, sep="\n  ")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
