"""The versions of a domain in a workspace's repository, and what each of them taught."""

import hashlib
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pyoxigraph
from pyoxigraph import BlankNode, Literal

from adaptbot_cli.adapters.store.git import Commit, Repo
from adaptbot_cli.adapters.store.reading import FACT_FILES, read_files
from adaptbot_cli.core.changes import Changes, Entry
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.terms import AB, Triple, local, node_of, triple_of
from adaptbot_cli.errors import KnowledgeError

ALL_FILES = (*FACT_FILES, "actions.ttl", "tasks.ttl", "domain.ttl")
_OF_ENTRIES = frozenset({"tasks.ttl", "domain.ttl"})
_BY_IRI = frozenset({"domain.ttl", *FACT_FILES})


@dataclass(frozen=True, slots=True)
class Reading:
    """What a file says: its single facts, and each other entry as a text to compare."""

    facts: frozenset[pyoxigraph.Triple] = frozenset()
    entries: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Taught:
    """What a commit changed. `first` are the files that it was the first to hold."""

    commit: Commit
    changes: Changes
    first: frozenset[str] = frozenset()


@dataclass(slots=True)
class Versions:
    """A domain's versions. Methods raise KnowledgeError if the repository cannot be read."""

    root: Path
    domain: str
    repo: Repo
    _read: dict[bytes, Reading] = field(default_factory=dict)

    @classmethod
    def of(cls, root: Path, domain: str) -> "Versions":
        """Open the repository of a workspace that exists."""
        return cls(root, domain, Repo.open_or_init(root))

    def path(self, name: str) -> str:
        """Return a file's path in the workspace."""
        return f"kg/{self.domain}/{name}"

    def head(self) -> str | None:
        """Return the revision that the workspace is at."""
        return self.repo.head()

    def files(self, revision: str | None) -> dict[str, bytes]:
        """Return the files at a revision; those on disk if it is None."""
        if revision is None:
            return read_files(self.root / "kg" / self.domain)
        found = {name: self.repo.read(self.path(name), revision) for name in ALL_FILES}
        return {name: data for name, data in found.items() if data is not None}

    def edited(self) -> list[str]:
        """Return the names of the files that differ from the last commit."""
        dirty = self.repo.dirty([self.path(name) for name in ALL_FILES])
        return [name for name in ALL_FILES if self.path(name) in dirty]

    def between(self, before: Mapping[str, bytes], after: Mapping[str, bytes]) -> Changes:
        """Return what changed from some files to others.

        Raises:
            KnowledgeError: a file is no valid Turtle; the message names it.
        """
        return _changes(self._readings(before), self._readings(after))

    def facts(self, files: Mapping[str, bytes]) -> frozenset[Triple]:
        """Return the single facts of some files. Raises KnowledgeError as `between` does."""
        found = (t for reading in self._readings(files).values() for t in reading.facts)
        return frozenset(map(triple_of, found))

    def _readings(self, files: Mapping[str, bytes]) -> dict[str, Reading]:
        return {name: self._reading(name, data) for name, data in files.items()}

    def _reading(self, name: str, data: bytes) -> Reading:
        key = name.encode() + b"\0" + hashlib.sha256(data).digest()
        if key not in self._read:
            self._read[key] = read(data, name, self.path(name))
        return self._read[key]

    def taught(self) -> Iterator[Taught]:
        """Give every commit that changed the domain's files, newest first, with what it changed.

        A file that a commit left as no valid Turtle counts as it was before; of a merge only
        what is in none of its parents counts as its own.
        """
        for commit in self.repo.log([f"kg/{self.domain}"]):
            now = self._at(commit.sha)
            before = [self._at(parent) for parent in commit.parents]
            first = frozenset(name for name in now if not any(name in old for old in before))
            yield Taught(commit, _own_changes(before, now), first)

    def _at(self, revision: str) -> dict[str, Reading]:
        found = ((name, self._readable(name, revision)) for name in ALL_FILES)
        return {name: reading for name, reading in found if reading is not None}

    def _readable(self, name: str, revision: str) -> Reading | None:
        """The newest readable version of a file that a revision builds on."""
        while True:
            data = self.repo.read(self.path(name), revision)
            if data is None:
                return None
            try:
                return self._reading(name, data)
            except KnowledgeError:
                revision += "^"
                try:
                    self.repo.read(self.path(name), revision)
                except KnowledgeError:
                    return None


def read(data: bytes, name: str, path: str) -> Reading:
    """Read a file's facts and entries. Raises KnowledgeError if it is no valid Turtle."""
    try:
        parsed = pyoxigraph.parse(io.BytesIO(data), format=pyoxigraph.RdfFormat.TURTLE)
        triples = [quad.triple for quad in parsed]
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        where = f", line {line}" if line else ""
        problem = getattr(error, "msg", error)
        raise KnowledgeError(f"{path}{where}: this is no valid Turtle: {problem}") from error
    by_subject: dict[object, list[pyoxigraph.Triple]] = {}
    for triple in triples:
        by_subject.setdefault(triple.subject, []).append(triple)
    facts: set[pyoxigraph.Triple] = set()
    entries: dict[str, str] = {}
    for subject, about in by_subject.items():
        if isinstance(subject, BlankNode):
            continue
        deep = {t for t in about if isinstance(t.object, BlankNode)}
        whole = name in _OF_ENTRIES or (name == "actions.ttl" and deep)
        taught = {t for t in about if t.predicate.value == str(AB.calledAs)} - deep
        facts |= taught if whole else set(about) - deep
        if whole or deep:
            told = set(about) - taught if whole else deep
            named = local(node_of(subject)) if name in _BY_IRI else _entry_name(subject, about)
            entries[named] = _described(told, by_subject, set())
    return Reading(frozenset(facts), entries)


def _entry_name(subject: object, about: Iterable[pyoxigraph.Triple]) -> str:
    label = "http://www.w3.org/2000/01/rdf-schema#label"
    labels = (t.object for t in about if t.predicate.value == label)
    named = (value.value for value in labels if isinstance(value, Literal))
    return min(named, default=None) or local(node_of(subject))


def _described(
    triples: Iterable[pyoxigraph.Triple],
    by_subject: Mapping[object, list[pyoxigraph.Triple]],
    seen: set[object],
) -> str:
    """Triples with what stands below their blank nodes, as a text that names no blank node."""
    lines = []
    for triple in triples:
        value = str(triple.object)
        if isinstance(triple.object, BlankNode) and triple.object not in seen:
            below = by_subject.get(triple.object, [])
            value = f"[{_described(below, by_subject, seen | {triple.object})}]"
        lines.append(f"{triple.predicate} {value}")
    return " ; ".join(sorted(lines))


def _changes(before: Mapping[str, Reading], after: Mapping[str, Reading]) -> Changes:
    return _own_changes([before], after)


def _own_changes(before: Sequence[Mapping[str, Reading]], after: Mapping[str, Reading]) -> Changes:
    """What is in none of the versions before, and what was in all of them and is gone."""
    now = _all_facts(after)
    old = [_all_facts(version) for version in before]
    some = frozenset[pyoxigraph.Triple]().union(*old)
    every = frozenset.intersection(*old) if old else frozenset()
    delta = Delta(frozenset(map(triple_of, every - now)), frozenset(map(triple_of, now - some)))
    return Changes(delta, tuple(_entries(before, after)))


def _all_facts(version: Mapping[str, Reading]) -> frozenset[pyoxigraph.Triple]:
    return frozenset[pyoxigraph.Triple]().union(*(r.facts for r in version.values()))


def _entries(
    before: Sequence[Mapping[str, Reading]], after: Mapping[str, Reading]
) -> Iterator[Entry]:
    for name in ALL_FILES:
        new = after[name].entries if name in after else {}
        olds = [version[name].entries if name in version else {} for version in before]
        for entry in sorted({*new, *(key for old in olds for key in old)}):
            told = [old.get(entry) for old in olds]
            if new.get(entry) in told or (not olds and entry not in new):
                continue
            if entry not in new:
                yield Entry("removed", name, entry)
            else:
                yield Entry("changed" if any(told) else "added", name, entry)
