"""What a domain's files hold, and what a change of facts makes of them."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from rdflib import RDF, RDFS
from rdflib.term import Node

from adaptbot_cli.adapters.store.reading import (
    FACT_FILES,
    load_domain,
    load_kg,
    read_files,
    readable,
)
from adaptbot_cli.adapters.store.turtle import patch
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.faults import Fault, new_faults
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.terms import AB, ACTION_PARTS, FACT_TERMS, STATES, Triple, kept

_ACTIONS = "actions.ttl"


@dataclass(slots=True)
class Held:
    """A domain's files as bytes and, loaded once, as a graph; `where` names them in messages."""

    where: str
    files: dict[str, bytes]
    kg: Kg

    @classmethod
    def read(cls, folder: Path, where: str, last: "Held | None" = None) -> "Held":
        """Read a domain's folder; what was read `last` is returned if it is still the same.

        Raises:
            KnowledgeError, PackError: the files cannot be read or make no domain.
        """
        files = read_files(folder)
        if last is not None and last.files == files:
            return last
        return cls.of(files, where)

    @classmethod
    def of(cls, files: Mapping[str, bytes], where: str) -> "Held":
        """Load a domain from the bytes of its files. Raises as `read` does."""
        return cls(where, dict(files), load_kg(files, where))

    def after(self, change: Delta) -> dict[str, bytes]:
        """Return the files that a change of facts makes differ, as they are after it.

        Raises:
            KnowledgeError: a term cannot be written in Turtle.
        """
        return dict(self._edited(change))

    def _edited(self, change: Delta) -> Iterator[tuple[str, bytes]]:
        parts = _parts(change)
        for name in (*FACT_FILES, _ACTIONS):
            old = [t for t in sorted(change.removed) if name in self._files_of(t, parts)]
            new = [t for t in sorted(change.added) if self._file_of(t, parts) == name]
            if old or new:
                text = self.files[name].decode("utf-8")
                edited = patch(text, old, new, f"{self.where}/{name}")
                if edited != text:
                    yield name, edited.encode("utf-8")

    def _files_of(self, triple: Triple, parts: frozenset[Node]) -> Collection[str]:
        """The files that may hold a fact: somebody may have written it into the wrong one."""
        subject, predicate, value = triple
        astray = (subject, predicate, kept(value)) in self.kg.strays
        return FACT_FILES if astray else (self._file_of(triple, parts),)

    def _file_of(self, triple: Triple, parts: frozenset[Node]) -> str:
        subject, predicate, value = triple
        if subject in parts:
            return _ACTIONS
        own = predicate if predicate != RDF.type else value
        if predicate == RDFS.label or (own.startswith(str(AB)) and own not in FACT_TERMS):  # type: ignore[attr-defined]
            return _ACTIONS
        return "state.ttl" if self.kg.home_of(predicate) == STATES else "attributes.ttl"

    def new_faults(self, change: Delta, changed: Mapping[str, bytes]) -> list[Fault]:
        """Return what a change would break; `changed` are the files after it.

        Raises:
            KnowledgeError, PackError: the files could not be read again or make no domain.
        """
        for name in changed.keys() & FACT_FILES.keys():
            readable(changed[name], f"{self.where}/{name}")
        domain = load_domain({**self.files, **changed}, self.where)
        return new_faults(self.kg, self._facts(change), domain)

    def learn(self, change: Delta, changed: Mapping[str, bytes]) -> None:
        """Go along with a change that was written."""
        self.files |= changed
        self.kg.learn(self._facts(change))
        self.kg.domain = load_domain(self.files, self.where)

    def _facts(self, change: Delta) -> Delta:
        """The part of a change that is about the home, not about what an action is."""
        parts = _parts(change)
        removed, added = (
            frozenset(t for t in triples if self._file_of(t, parts) != _ACTIONS)
            for triples in (change.removed, change.added)
        )
        return Delta(removed, added)


def _parts(change: Delta) -> frozenset[Node]:
    """The actions that a change describes, and their parts."""
    facts = change.removed | change.added
    actions = {s for s, p, o in facts if p == RDF.type and o == AB.Action}
    return frozenset(actions | {o for _, p, o in facts if p in ACTION_PARTS})
