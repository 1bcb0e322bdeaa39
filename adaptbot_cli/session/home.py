"""A domain in a workspace: its graph, its files, its versions."""

from collections import ChainMap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from rdflib import XSD, Literal
from rdflib.term import Node

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import fact_files, graph_of, in_order
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import SCHEMA, Triple
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.sources import load
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:  # slow, and most commands want the graph alone
    from adaptbot_cli.adapters.store.versions import Versions
    from adaptbot_cli.core.view.changes import Words


@dataclass
class Home:
    """A domain in a workspace, with its versions if it has any."""

    workspace: Workspace
    domain: str

    @cached_property
    def kg(self) -> Kg:
        """The graph as it is now. Raises KnowledgeError, PackError, UsageError."""
        return load(self.workspace, self.domain)

    @cached_property
    def versions(self) -> "Versions | None":
        """The versions; None where the workspace holds nothing of the domain yet."""
        from adaptbot_cli.adapters.store.versions import Versions

        self.workspace.folder(self.domain)  # says so if there is no such domain
        repo = Repo.open(self.workspace.root) if self.workspace.has(self.domain) else None
        return Versions(self.domain, repo) if repo is not None else None

    def needed(self) -> "Versions":
        """Return the versions. Raises KnowledgeError if there are none."""
        if self.versions is None:
            raise KnowledgeError(
                f"the workspace {self.workspace.root} has no versions of the {self.domain} "
                "yet; the first run or change makes them"
            )
        return self.versions

    @cached_property
    def _files(self) -> dict[str, bytes]:
        files = self.workspace.files(self.domain)
        return {name: files[name] for name in in_order(files)}

    @cached_property
    def facts(self) -> frozenset[Triple]:
        """The single facts of the files as they are now, those about taught actions too."""
        return _facts_of(self._files)

    @cached_property
    def _of_actions(self) -> frozenset[Triple]:
        """Those of the files that hold no facts of things."""
        return _facts_of({n: data for n, data in self._files.items() if graph_of(n) is None})

    def matching(self, subject: Node | None = None, predicate: Node | None = None) -> set[Triple]:
        """Return those of `facts` with a subject or a predicate, without reading all of them.

        The graph has values in the engine's canonical form; where a file may have another, as 1.50
        for 1.5, all are read after all.
        """
        found = set(self.kg.facts.triples((subject, predicate, None)))
        found -= set(self.kg.graph(SCHEMA))
        exact = not any(b"^^" in self._files[name] for name in fact_files(self._files))
        if exact and all(_is_canonical(value) for _, _, value in found):
            return found | {
                t for t in self._of_actions if subject in (None, t[0]) and predicate in (None, t[1])
            }
        return {t for t in self.facts if subject in (None, t[0]) and predicate in (None, t[1])}

    @cached_property
    def pack(self) -> frozenset[Triple]:
        """The single facts that the bundled domain came with; none if it is not bundled."""
        return _facts_of(read_files(bundled("kg") / self.domain))

    @cached_property
    def words(self) -> "Words":
        """Names and labels, as they are now and as the bundled domain had them."""
        from adaptbot_cli.core.view.changes import Words

        domain, pack = self.kg.domain, Words.of(self.kg.domain, self.pack)
        here = Words.of(domain, self._of_actions)
        return Words(domain, ChainMap(_LazyNames(self.kg), here.names, pack.names))  # type: ignore[arg-type]


def _facts_of(files: Mapping[str, bytes]) -> frozenset[Triple]:
    from adaptbot_cli.adapters.store.versions import facts_of

    return facts_of(files)


class _LazyNames(Mapping["Node", str]):
    """The names of a graph's things, looked up one by one."""

    def __init__(self, kg: Kg) -> None:
        self.kg = kg

    def __getitem__(self, node: Node) -> str:
        found = next((n for p in self.kg.named_by for n in self.kg.store.objects(node, p)), None)
        if found is None:
            raise KeyError(node)
        return str(found)

    def __iter__(self) -> Iterator[Node]:
        return (s for p in self.kg.named_by for s in self.kg.store.subjects(p))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _is_canonical(value: Node) -> bool:
    """Whether a value is one that a file can only write in the engine's own form."""
    return not isinstance(value, Literal) or value.datatype in (None, XSD.string, XSD.boolean)
