"""What becomes of other names for things: put in, suggested, or asked; with and without words.

`python tests/bench/names.py [--details]`: the names of `names.tsv` where anything can stand, with
the word knowledge of the lexicon and, as an ablation, without it.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[2]))

from adaptbot_cli.adapters.lexicon import NoLexicon, WordNet
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.refine import resolve
from adaptbot_cli.core.refine.check import names_to_look_up
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.resources import bundled

FILE = Path(__file__).with_suffix(".tsv")


def meant(name: str, kg: Kg, lexicon: Lexicon) -> tuple[str, tuple[str, ...]]:
    """Return what a name is taken to mean, "" if it is asked about, and what is suggested."""
    scene = Scene(kg, Task("none"))
    fields = kg.domain.noun_fields
    if not kg.find(name):
        scene.known[normal(name)] = lexicon.related(name, fields)
        for other in sorted(names_to_look_up([normal(name)], scene)):
            scene.known[other] = lexicon.related(other, fields)
    found = resolve.item(name, tuple(kg.domain.classes), scene)
    told = found.finding.candidates if found.finding else ()
    return kg.name(found.entity) if found.entity else "", told


def measured(lexicon: Lexicon) -> tuple[Counter[str], list[str]]:
    """Count what becomes of the names, and tell what was put in wrongly or missed."""
    graphs = {d: load_kg(read_files(bundled("kg") / d), d) for d in ("kitchen", "household")}
    count: Counter[str] = Counter()
    told = []
    for line in FILE.read_text(encoding="utf-8").splitlines()[1:]:
        name, domain, answer = line.split("\t")
        taken, near = meant(name, graphs[domain], lexicon)
        there = answer not in ("?", "-")
        count["names"] += 1
        count["there"] += there
        if taken:
            count["put in"] += 1
            count["put in rightly"] += taken == answer
        elif there:
            count["suggested"] += answer in near
        if taken != (answer if there else "") and (taken or answer not in near):
            told.append(
                f"{domain} {name}: {taken or 'asked, near ' + ', '.join(near)}; is {answer}"
            )
    return count, told


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--details", action="store_true")
    options = parser.parse_args()
    out = Console(width=120, highlight=False)
    table = Table("words", "names", "here", "put in", "of these right", "suggested first", box=None)
    for label, lexicon in (("WordNet", WordNet()), ("none", NoLexicon())):
        count, told = measured(lexicon)
        share = count["put in rightly"] / max(count["put in"], 1)
        figures = (count["names"], count["there"], count["put in"])
        table.add_row(label, *map(str, figures), f"{share:.1%}", str(count["suggested"]))
        if options.details:
            out.print(label, *told, "", sep="\n  ", markup=False)
    out.print(table)


if __name__ == "__main__":
    main()
