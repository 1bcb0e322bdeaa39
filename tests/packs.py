"""The bundled domain packs as plain graphs, for tests of their data."""

import os
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from rdflib import RDF, RDFS, Graph, Literal, Namespace
from rdflib.term import Node

from adaptbot_cli.adapters.planner.library import LibraryPlan, read_library
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg, read_graphs
from adaptbot_cli.core.graph.kg import Kg

ROOT: Final = Path(__file__).resolve().parents[1]
PUBLISHED: Final = Path(os.environ.get("ADAPTBOT_PUBLISHED") or ROOT.parent / "shared/published")
"""The recordings and graphs of the paper's authors, where they are at hand."""
AB: Final = Namespace("urn:adaptbot:")
EX: Final = Namespace("http://example.org/")
TRUE: Final = Literal(True)
FALSE: Final = Literal(False)
NAMES: Final = (EX.room_name, EX.rec_name, EX.obj_name, EX.tool_name)
CALL: Final = re.compile(r'(\w+)\(((?:"[^"]*"|[\d.]+)(?:, (?:"[^"]*"|[\d.]+))*)\)( +#.*)?')


@dataclass(frozen=True)
class Pack:
    """A domain's five files and its plan library."""

    name: str

    @property
    def folder(self) -> Path:
        return ROOT / "kg" / self.name

    def kg(self, *facts: Path) -> Kg:
        """Return the domain as a new graph of its own, with its facts or those of other files."""
        return load_kg(read_files(self.folder), self.name, read_graphs(facts))

    @cache  # noqa: B019 - the packs are module constants
    def graph(self, *files: str) -> Graph:
        """Return the union of the named Turtle files."""
        union = Graph()
        for file in files:
            union.parse(self.folder / f"{file}.ttl")
        return union

    @property
    def facts(self) -> Graph:
        return self.graph("attributes", "state")

    @property
    def schema(self) -> Graph:
        return self.graph("domain")

    @cache  # noqa: B019
    def library(self) -> dict[str, LibraryPlan]:
        """Return the plans of the library by file name."""
        folder = ROOT / "prompts" / "library" / self.name
        return {plan.path.stem: plan for plan in read_library(folder)}

    def names(self, *predicates: Node) -> set[str]:
        """Return the names that things have by these predicates, or by any."""
        wanted = predicates or NAMES
        return {str(name) for p in wanted for name in self.graph("attributes").objects(None, p)}

    def tasks(self) -> list[str]:
        """Return the tasks' labels in alphabetical order."""
        tasks = self.graph("tasks")
        nodes = tasks.subjects(RDF.type, AB.Task)
        return sorted(str(tasks.value(node, RDFS.label)) for node in nodes)

    def needs(self, task: str) -> list[str]:
        """Return a task's required items in alphabetical order."""
        tasks = self.graph("tasks")
        node = tasks.value(None, RDFS.label, Literal(task))
        return sorted(str(item) for item in tasks.objects(node, AB.needs))

    def action_names(self) -> set[str]:
        actions = self.graph("actions")
        return {str(actions.value(a, RDFS.label)) for a in actions.subjects(RDF.type, AB.Action)}


KITCHEN: Final = Pack("kitchen")
HOUSEHOLD: Final = Pack("household")
PACKS: Final = (KITCHEN, HOUSEHOLD)


def names(text: str) -> tuple[str, ...]:
    """Return the names in a text with commas between them."""
    return tuple(" ".join(name.split()) for name in text.split(","))


def calls(lines: list[str]) -> list[tuple[str, list[str]]]:
    """Return a rendered plan's calls as (action, arguments); every line must be one."""
    parsed = []
    for line in filter(str.strip, lines):
        match = CALL.fullmatch(line)
        assert match, f"not a call: {line!r}"
        parsed.append((match[1], re.findall(r'"([^"]*)"', match[2])))
    return parsed
