"""The versions of a domain in a workspace's repository: what each taught, and who taught each fact.

What a commit taught is worked out once: from the blocks that differ, not from whole files, and then
kept in a cache in the git directory, keyed by the commit. A cache that does not match is made anew.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import pyoxigraph
from pyoxigraph import BlankNode, Literal
from rdflib import RDFS
from rdflib.term import Node

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import FACT_FILES, read_files
from adaptbot_cli.adapters.store.trailers import Commit, answers, taught
from adaptbot_cli.adapters.store.turtle import BOM, engine, parse
from adaptbot_cli.core.changes import Changes, Entry
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.provenance import Chapter, Origin, Turnover, answer_id, short
from adaptbot_cli.core.terms import AB, Triple, local, node_of, triple_of
from adaptbot_cli.errors import KnowledgeError

ALL_FILES = (*FACT_FILES, "actions.ttl", "tasks.ttl", "domain.ttl")
PACK = Origin("pack")
UNCOMMITTED = Origin("uncommitted")

_OF_ENTRIES = frozenset({"tasks.ttl", "domain.ttl"})
_BY_IRI = frozenset({"domain.ttl", *FACT_FILES})
_PREFIX = re.compile(rb"^@prefix[ \t]+[^\s:<]*:[ \t]*<[^>\n]*>[ \t]*\.(?=[ \t]*\r?$)", re.MULTILINE)
_DIRECTIVE = re.compile(rb"@base|^[ \t]*(?:base|prefix|version)\b", re.IGNORECASE | re.MULTILINE)
# What makes a block mean something else than it says by itself.
_ALONE = re.compile(rb"[\[(]|_:|\.[ \t]+[^\s#]")
_SUBJECT = re.compile(rb"^[^\s#.@]\S* ", re.MULTILINE)
_CALLED = str(AB.calledAs)
_LABEL = str(RDFS.label)
_FORM = 1
"""The form of the cache: another one is not read."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What a file says: its single facts, and each other entry as a text to compare."""

    facts: frozenset[str] = frozenset()
    entries: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Taught:
    """What a commit changed: facts as N-Triples, and entries as (sign, file, name).

    `first` are the files that it was the first to hold.
    """

    sha: str
    removed: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    entries: tuple[tuple[str, str, str], ...] = ()
    first: tuple[str, ...] = ()

    @property
    def changes(self) -> Changes:
        """The same in the terms of the graph."""
        entries = tuple(Entry(*entry) for entry in self.entries)  # type: ignore[arg-type]
        return Changes(Delta(_triples(self.removed), _triples(self.added)), entries)


def _triples(lines: Iterable[str]) -> frozenset[Triple]:
    text = "".join(f"{line} .\n" for line in lines)
    found = pyoxigraph.parse(text, format=pyoxigraph.RdfFormat.N_TRIPLES)
    return frozenset(triple_of(quad.triple) for quad in found)


def line_of(triple: Triple) -> str:
    """Return a fact as the versions hold it: an N-Triples line without its full stop."""
    return str(pyoxigraph.Triple(*engine(triple)))


@dataclass
class Versions:
    """A domain's versions. Methods raise KnowledgeError if the repository cannot be read."""

    domain: str
    repo: Repo

    @classmethod
    def of(cls, root: Path, domain: str) -> "Versions":
        """Open the repository of a workspace that exists. Raises KnowledgeError if it has none."""
        repo = Repo.open(root)
        if repo is None:
            raise KnowledgeError(
                f"the workspace {root} has no versions: no git repository is there"
            )
        return cls(domain, repo)

    @cached_property
    def _known(self) -> dict[str, Taught]:
        """What is known of commits, from the cache and by now; in the order of the cache."""
        try:
            found = json.loads(self.repo.cached(f"{self.domain}.json") or b"")
            if found["form"] != _FORM or not isinstance(found["commits"], list):
                return {}
            return {
                entry[0]: Taught(
                    str(entry[0]),
                    tuple(map(str, entry[1])),
                    tuple(map(str, entry[2])),
                    tuple((str(a), str(b), str(c)) for a, b, c in entry[3]),
                    tuple(map(str, entry[4])),
                )
                for entry in found["commits"]
            }
        except (ValueError, KeyError, TypeError, IndexError, RecursionError):
            return {}

    def path(self, name: str) -> str:
        """Return a file's path in the workspace."""
        return f"kg/{self.domain}/{name}"

    def head(self) -> str | None:
        """Return the revision that the workspace is at."""
        return self.repo.head()

    def files(self, revision: str | None) -> dict[str, bytes]:
        """Return the files at a revision; those on disk if it is None."""
        if revision is None:
            return read_files(self.repo.root / "kg" / self.domain, self.repo.root)
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
        pairs = [
            (n, _reading(before, n, self.path(n)), _reading(after, n, self.path(n)))
            for n in ALL_FILES
            if before.get(n) != after.get(n)
        ]
        return _difference("", pairs, ()).changes

    def taught(self) -> Iterator[Taught]:
        """Give every commit that changed the domain's files, newest first, with what it changed.

        A file that a commit left as no valid Turtle counts as it was before; of a merge only
        what is in none of its parents counts as its own.
        """
        head, found = self.head(), list[Taught]()
        known, fresh = self._known, 0
        newest = next(iter(known), None)
        since = newest if head and newest and self.repo.leads_to(newest, head) else None
        for commit in self.repo.log([f"kg/{self.domain}"], since):
            one = known.get(commit.sha)
            fresh += one is None
            one = one or self.taught_by(commit)
            found.append(one)
            yield one
        if since is not None:
            found += known.values()
            yield from known.values()
        if fresh or len(found) != len(known):
            told = [[t.sha, t.removed, t.added, t.entries, t.first] for t in found]
            data = json.dumps({"form": _FORM, "commits": told}, separators=(",", ":"))
            self.repo.cache(f"{self.domain}.json", data.encode())
            self.__dict__["_known"] = {t.sha: t for t in found}

    def taught_by(self, commit: Commit) -> Taught:
        """Return what a commit changed of the domain."""
        for blobs in (self._tree, self._readable_blobs):
            now = blobs(commit.sha)
            parents = [blobs(parent) for parent in commit.parents]
            try:
                found = [self._since(commit.sha, now, old) for old in parents or [{}]]
                break
            except KnowledgeError:
                continue  # a version is no valid Turtle: it counts as it was before
        first = tuple(n for n in ALL_FILES if n in now and not any(n in old for old in parents))
        if len(found) == 1:
            return replace(found[0], first=first)
        removed = set.intersection(*(set(one.removed) for one in found))
        added = set.intersection(*(set(one.added) for one in found))
        signs = [{entry[1:]: entry[0] for entry in one.entries} for one in found]
        entries = tuple(
            ("changed" if any(s[key] == "changed" for s in signs) else signs[0][key], *key)
            for key in signs[0]
            if all(key in other for other in signs)
        )
        return Taught(commit.sha, tuple(sorted(removed)), tuple(sorted(added)), entries, first)

    def _since(self, sha: str, now: Mapping[str, str], old: Mapping[str, str]) -> Taught:
        pairs = []
        for name in ALL_FILES:
            if now.get(name) != old.get(name):
                blobs = (self._data(old.get(name)), self._data(now.get(name)))
                pairs.append((name, *_differing(*blobs, name, self.path(name))))
        return _difference(sha, pairs, ())

    def _data(self, blob: str | None) -> bytes | None:
        return None if blob is None else self._blob(blob)

    @cached_property
    def _blob(self) -> Any:
        return lru_cache(maxsize=16)(self.repo.blob)

    @cached_property
    def _tree(self) -> Callable[[str], dict[str, str]]:
        """The blob of each file at a revision, by name."""
        names = {self.path(name): name for name in ALL_FILES}

        @lru_cache(maxsize=64)
        def tree(revision: str) -> dict[str, str]:
            found = self.repo.blobs(revision, tuple(names))
            return {names[path]: blob for path, blob in found.items()}

        return tree

    def _readable_blobs(self, revision: str) -> dict[str, str]:
        """The same, of the newest readable version of each file that a revision builds on."""
        found = {}
        for name in ALL_FILES:
            sha, at = revision, self._tree(revision).get(name)
            while at is not None and not self._readable(at, name):
                parents = self.repo.commit_of(sha).parents
                sha = parents[0] if parents else ""
                at = self._tree(sha).get(name) if sha else None
            if at is not None:
                found[name] = at
        return found

    @cached_property
    def _readable(self) -> Any:
        @lru_cache(maxsize=4096)
        def readable(blob: str, name: str) -> bool:
            try:
                for _ in parse(self._blob(blob), name):
                    pass
            except (SyntaxError, ValueError, KnowledgeError):
                return False
            return True

        return readable

    # ---------------------------------------------------------------------------- who taught it

    def commit_of(self, revision: str) -> tuple[Commit, Taught] | None:
        """Return a commit with what it changed; None if it changed nothing of this domain.

        Raises:
            KnowledgeError: there is no such revision.
        """
        commit = self.repo.commit_of(self.repo.resolve(revision))
        found = self._known.get(commit.sha) or self.taught_by(commit)
        return (commit, found) if found.removed or found.added or found.entries else None

    def answered(self, name: str) -> tuple[Commit, Delta, str]:
        """Return the commit of an answer's id such as `3fa2b1c.2`, what it taught, its question.

        Raises:
            KnowledgeError: there is no such answer.
        """
        revision, _, number = name.rpartition(".")
        try:
            found = self.commit_of(revision) if number.isdecimal() else None
        except KnowledgeError:
            found = None
        if found is not None:
            commit, one = found
            for told in answers(commit.trailers):
                if told.number == int(number):
                    delta = one.changes.delta
                    removed, added = (
                        taught(told, "-", delta.removed),
                        taught(told, "+", delta.added),
                    )
                    return commit, Delta(removed, added), told.question
        raise KnowledgeError(f'there is no answer "{name}"; `adaptbot kg log` tells their ids')

    def origins(self, facts: Iterable[Triple], pack: frozenset[Triple]) -> dict[Triple, Origin]:
        """Return where facts of the working files come from: the last commit that added each.

        `pack` are the facts that the bundled domain came with.
        """
        wanted = {line_of(triple): triple for triple in facts}
        head = self.head()
        committed = facts_of(self.files(head)) if head else frozenset()
        found = {t: UNCOMMITTED for t in wanted.values() if t not in committed}
        left = {line for line, triple in wanted.items() if triple in committed}
        for one in self.taught() if left else ():
            for line in left.intersection(one.added):
                found[wanted[line]] = self._origin(one, "+", wanted[line], pack)
            left.difference_update(one.added)
        return found | {wanted[line]: Origin("start") for line in left}

    def history(
        self, subject: Node, predicate: Node, pack: frozenset[Triple]
    ) -> Iterator[Turnover]:
        """Give what came and went of one predicate of one thing, newest first."""
        begin = line_of((subject, predicate, subject)).rpartition(" ")[0] + " "
        for one in self.taught():
            for sign, lines in (("+", one.added), ("-", one.removed)):
                for triple in sorted(_triples(line for line in lines if line.startswith(begin))):
                    yield Turnover(sign, triple, self._origin(one, sign, triple, pack))

    def trace(self, fact: str) -> str:
        """Return the answer behind a fact such as `onion IsLiquid true`, from the latest commit."""
        last = fact.rpartition(" ")[2]
        for one in self.taught():
            likely = _triples(line for line in one.added if last in line)
            if not one.first and f"+ {fact}" in {short("+", triple) for triple in likely}:
                told = answers(self.repo.commit_of(one.sha).trailers)
                said = (answer.said for answer in told if f"+ {fact}" in answer.facts)
                return next(said, f"commit {one.sha[:7]}")
        return f"from the {self.domain} as it came"

    def _origin(self, one: Taught, sign: str, triple: Triple, pack: frozenset[Triple]) -> Origin:
        """Why a commit added or removed a fact."""
        commit = self._commit(one.sha)
        about = _of_commit(commit)
        for told in answers(commit.trailers):
            if taught(told, sign, [triple]):
                return replace(
                    about,
                    source="answer",
                    answer=answer_id(commit.sha, told.number),
                    question=told.question,
                    said=told.said,
                    by=told.by or about.by,
                    at=told.at,
                )
        if one.first and not commit.trailers:
            return PACK if triple in pack else replace(about, source="start")
        if about.source == "answer":
            # A run of the first edition took along what was edited by hand meanwhile.
            return replace(about, source="hand edit", task="", planner="", transcript="")
        return about

    @cached_property
    def _commit(self) -> Any:
        return lru_cache(maxsize=256)(self.repo.commit_of)

    def chapter(self, one: Taught) -> Chapter:
        """Return what a commit taught as people read it."""
        commit = self._commit(one.sha)
        told = answers(commit.trailers)
        lines = [line.strip() for line in commit.body.splitlines() if line.strip()]
        if len(lines) != len(told):
            lines = ["; ".join(answer.facts) for answer in told]
        start = bool(one.first) and not commit.trailers
        return Chapter(_of_commit(commit), told, tuple(lines), one.changes, start)


def _of_commit(commit: Commit) -> Origin:
    """What a commit tells of itself: who, when, for which task, with which model."""
    fields = dict(reversed(commit.trailers))
    source = fields.get("Source", "")
    if not source and commit.subject.startswith("state: "):
        source = "state"
    if not source:
        source = "answer" if answers(commit.trailers) else "git"
    return Origin(
        source,
        commit.sha,
        commit.author.partition(" <")[0],
        commit.when.isoformat(timespec="seconds"),
        commit.subject,
        fields.get("Task", ""),
        fields.get("Planner", ""),
        fields.get("Transcript", ""),
        by=fields.get("By", ""),
    )


def facts_of(files: Mapping[str, bytes]) -> frozenset[Triple]:
    """Return the single facts of some files. Raises KnowledgeError if one is no valid Turtle."""
    read = (_reading(files, name, name) for name in files)
    return frozenset().union(*(_triples(one.facts) for one in read))


def _reading(files: Mapping[str, bytes], name: str, path: str) -> Reading:
    return read(files[name], name, path) if name in files else Reading()


@lru_cache(maxsize=64)
def read(data: bytes, name: str, path: str) -> Reading:
    """Read a file's facts and entries. Raises KnowledgeError if it is no valid Turtle."""
    try:
        triples = [quad.triple for quad in parse(data, path)]
    except (SyntaxError, ValueError) as error:
        line = getattr(error, "lineno", None)
        where = f", line {line}" if line else ""
        problem = getattr(error, "msg", error)
        raise KnowledgeError(f"{path}{where}: this is no valid Turtle: {problem}") from error
    by_subject: dict[object, list[pyoxigraph.Triple]] = {}
    for triple in triples:
        by_subject.setdefault(triple.subject, []).append(triple)
    facts: set[str] = set()
    entries: dict[str, str] = {}
    for subject, about in by_subject.items():
        if isinstance(subject, BlankNode):
            continue
        deep = {t for t in about if isinstance(t.object, BlankNode)}
        whole = name in _OF_ENTRIES or (name == "actions.ttl" and deep)
        called = {t for t in about if t.predicate.value == _CALLED} - deep
        facts |= {str(t) for t in (called if whole else set(about) - deep)}
        if whole or deep:
            told = set(about) - called if whole else deep
            named = local(node_of(subject)) if name in _BY_IRI else _entry_name(subject, about)
            entries[named] = _described(told, by_subject, set())
    return Reading(frozenset(facts), entries)


def _entry_name(subject: object, about: Iterable[pyoxigraph.Triple]) -> str:
    labels = (t.object for t in about if t.predicate.value == _LABEL)
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


def _differing(
    old: bytes | None, new: bytes | None, name: str, path: str
) -> tuple[Reading, Reading]:
    """Read of two versions of a file what differs: only the blocks that do, if they stand alone.

    Raises:
        KnowledgeError: one is no valid Turtle.
    """
    if old is not None and new is not None and (parts := _parts(old, new)) is not None:
        try:
            return read(parts[0], name, path), read(parts[1], name, path)
        except KnowledgeError:
            pass  # a block that does not stand for itself: look at all of it
    before, after = (Reading() if d is None else read(d, name, path) for d in (old, new))
    return before, after


def _parts(old: bytes, new: bytes) -> tuple[bytes, bytes] | None:
    """The blocks that only one of two versions of a file has, each with the prefixes; None if the
    text does not tell where a block ends, or what it says without the others."""
    if _prefixes(old) is None or _prefixes(old) != _prefixes(new):
        return None
    prefixes = _prefixes(old) or ()
    before, after = _blocks(old), _blocks(new)
    texts = []
    for own, other, data in ((before, after, old), (after, before, new)):
        changed = [block for block in own if block not in other]
        for block in changed:
            if _ALONE.search(block):
                return None
            for head in _SUBJECT.findall(block):
                if data.count(b"\n" + head) + data.startswith(head) > 1:
                    return None
        texts.append(b"\n".join([*prefixes, *changed]))
    return texts[0], texts[1]


@lru_cache(maxsize=8)
def _prefixes(data: bytes) -> tuple[bytes, ...] | None:
    """The prefixes that hold all over a file; None where blocks may mean more than they say."""
    found = tuple(_PREFIX.findall(data[: data.rfind(b"@prefix") + 1000]))
    names = {prefix.split()[1].partition(b"<")[0] for prefix in found}
    if len(found) != len(names) or data.count(b"@prefix") != len(names):
        return None
    if data.count(b"<") > len(found) and _DIRECTIVE.search(data):
        return None
    return None if b'"""' in data or b"'''" in data else found


@lru_cache(maxsize=8)
def _blocks(data: bytes) -> dict[bytes, None]:
    return dict.fromkeys(data.removeprefix(BOM.encode()).replace(b"\r\n", b"\n").split(b"\n\n"))


def _difference(
    sha: str, pairs: Iterable[tuple[str, Reading, Reading]], first: Sequence[str]
) -> Taught:
    """What changed in some files: by name, what each said before and says now."""
    before, after = set[str](), set[str]()
    entries = []
    for name, old, new in pairs:
        before |= old.facts
        after |= new.facts
        for entry in sorted({*old.entries, *new.entries}):
            a, b = old.entries.get(entry), new.entries.get(entry)
            if a != b:
                sign = "added" if a is None else "removed" if b is None else "changed"
                entries.append((sign, name, entry))
    gone, came = tuple(sorted(before - after)), tuple(sorted(after - before))
    return Taught(sha, gone, came, tuple(entries), tuple(first))
