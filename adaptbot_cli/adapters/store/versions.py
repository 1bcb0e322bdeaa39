"""The versions of a domain in a workspace's repository: what each taught, and who taught each fact.

What a commit taught is worked out once, from the lines that differ, and then kept in a cache in
the git directory: a line of JSON a commit, newest first, of which only those are read that mention
what is asked for. A cache that does not match is made anew.
"""

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import pyoxigraph
from pyoxigraph import BlankNode, Literal
from rdflib import RDFS
from rdflib.term import Node

from adaptbot_cli.adapters.store.files import names_of_pack, read_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import graph_of, in_order, paths_of
from adaptbot_cli.adapters.store.trailers import Commit, answers, taught
from adaptbot_cli.adapters.store.turtle import engine, parsed
from adaptbot_cli.core.changes import Changes, PackEntry
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.provenance import Chapter, Origin, Turnover, answer_id, short
from adaptbot_cli.core.terms import AB, Triple, local, node_of, triple_of
from adaptbot_cli.errors import KnowledgeError

PACK = Origin("pack")
UNCOMMITTED = Origin("uncommitted")

_OF_ENTRIES = frozenset({"tasks.ttl", "domain.ttl"})
_HEAD = re.compile(rb"(?:\xef\xbb\xbf)?(?:(?:@prefix [^\s:<]*: <[^<>\n]*> \.|#[^\n]*)?\n)*")
_BLOCKS = re.compile(rb"(?:(?:#[^\n]*\n)*[^\s#.@_]\S* \S[^\n]*\n(?:    \S[^\n]*\n)*\.\n\n?)*")
# What makes a block mean something else than it says by itself.
_UNCLEAR = re.compile(rb"[<\[(]|_:|\.[ \t]|\"\"\"|'''")
_SUBJECT = re.compile(rb"^[^\s.#]\S* ", re.MULTILINE)
_FACTS = 2_000
"""How many facts of a commit stand in a line of the cache."""
_AT = 65
"""Where the lines of the cache begin: behind a digest of them."""
_CALLED = str(AB.calledAs)
_LABEL = str(RDFS.label)


@dataclass(frozen=True, slots=True)
class FileFacts:
    """What a file says: its single facts, and each other entry as a text to compare."""

    facts: frozenset[str] = frozenset()
    entries: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class CommitDelta:
    """What a commit changed: facts as N-Triples, and entries as (sign, file, name).

    `first` are the files that it was the first to hold.
    """

    sha: str
    removed: Sequence[str] = ()
    added: Sequence[str] = ()
    entries: Sequence[tuple[str, str, str]] = ()
    first: Sequence[str] = ()

    @property
    def lines(self) -> bytes:
        """The same as JSON: a line, or several where it has many facts."""
        most = max(1, len(self.removed), len(self.added))
        parts = (
            (self.removed[n : n + _FACTS], self.added[n : n + _FACTS])
            for n in range(0, most, _FACTS)
        )
        rest = (self.entries, self.first)
        return "\n".join(_as_json((self.sha, *part, *rest)) for part in parts).encode()

    @property
    def changes(self) -> Changes:
        """The same in the terms of the graph."""
        entries = tuple(PackEntry(*entry) for entry in self.entries)  # type: ignore[arg-type]
        return Changes(Delta(_triples(self.removed), _triples(self.added)), entries)


def _triples(lines: Iterable[str]) -> frozenset[Triple]:
    text = "".join(f"{line} .\n" for line in lines)
    found = pyoxigraph.parse(text, format=pyoxigraph.RdfFormat.N_TRIPLES)
    return frozenset(triple_of(quad.triple) for quad in found)


def _line_of(triple: Triple) -> str:
    """A fact as the versions hold it: an N-Triples line without its full stop."""
    return str(pyoxigraph.Triple(*engine(triple)))


@dataclass(frozen=True)
class _Cache:
    """What commits changed as `CommitDelta.lines`, newest commit first, behind a digest of it."""

    data: bytes = b""

    @classmethod
    def of_lines(cls, lines: bytes) -> "_Cache":
        """Return a cache of some lines."""
        return cls(_digest(lines) + b"\n" + lines)

    @property
    def is_whole(self) -> bool:
        """Whether the lines are those that were written."""
        return self.data[:_AT] == _digest(memoryview(self.data)[_AT:]) + b"\n"

    @cached_property
    def spans(self) -> dict[str, tuple[int, int]]:
        """Where each commit's lines begin and end, by sha."""
        found: dict[str, tuple[int, int]] = {}
        at = _AT
        while at < len(self.data):
            end = _line_end(self.data, at, len(self.data))
            sha = self.data[at + 2 : at + 42].decode()
            found[sha] = (found.get(sha, (at,))[0], end)
            at = end + 1
        return found

    def of(self, sha: str) -> bytes | None:
        """Return the lines of a commit, None if there are none."""
        start, end = self.spans.get(sha, (0, 0))
        return self.data[start:end] or None

    def about(self, texts: Sequence[bytes]) -> Iterator[CommitDelta]:
        """Give the commits with those of their lines in which one of some texts stands; with all
        of them if there are no texts."""
        for start, end in self.spans.values():
            removed, added, line = list[str](), list[str](), None
            while start < end:
                stop = _line_end(self.data, start, end)
                if not texts or any(self.data.find(t, start, stop) >= 0 for t in texts):
                    line = CommitDelta(*json.loads(self.data[start:stop]))
                    removed += line.removed
                    added += line.added
                start = stop + 1
            if line is not None:
                yield replace(line, removed=removed, added=added)


@dataclass(frozen=True)
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
    def _known(self) -> _Cache:
        """The cache; an empty one if it was not written so."""
        found = _Cache(self.repo.cached(self.domain) or b"")
        return found if found.is_whole else _Cache()

    @property
    def folder(self) -> str:
        """The folder of the domain's files in the workspace."""
        return f"kg/{self.domain}"

    def files(self, revision: str | None) -> dict[str, bytes]:
        """Return the files at a revision; those on disk if it is None."""
        if revision is None:
            return read_files(self.repo.root / self.folder, self.repo.root)
        blobs = self._blobs(revision)
        return {name: self.repo.blob(blobs[name]) for name in in_order(blobs)}

    def edited(self) -> list[str]:
        """Return the names of the files that differ from the last commit."""
        head = self.repo.head()
        known = self._blobs(head) if head else {}
        there = names_of_pack(self.repo.root / self.folder, self.repo.root)
        dirty = self.repo.dirty(paths_of(self.domain, there, known))
        return [path.removeprefix(f"{self.folder}/") for path in dirty]

    def between(self, before: Mapping[str, bytes], after: Mapping[str, bytes]) -> Changes:
        """Return what changed from some files to others.

        Raises:
            KnowledgeError: a file is no valid Turtle; the message names it.
        """
        return self._difference("", before, after).changes

    def taught(self, *about: str) -> Iterator[CommitDelta]:
        """Give every commit that changed the domain's files, newest first, with what it changed.

        With texts that what is sought is `about` (N-Triples, names), only those that have one, and
        of a commit with very many facts only those near them.
        A file that a commit left as no valid Turtle counts as it was before; of a merge only
        what is in none of its parents counts as its own.
        """
        head, known = self.repo.head(), self._known
        newest = next(iter(known.spans), None)
        since = newest if head and newest and self.repo.leads_to(newest, head) else None
        shas = [commit.sha for commit in self.repo.log([self.folder], since)]
        if shas if since else shas != list(known.spans):
            new = [known.of(sha) or self.taught_by(self._commit(sha)).lines for sha in shas]
            known = _Cache.of_lines(b"\n".join([*new, *([known.data[_AT:]] if since else [])]))
            self.repo.cache(self.domain, known.data)
            self.__dict__["_known"] = known
        yield from known.about(
            [_as_json(text)[1:-1].encode("utf-8", "surrogatepass") for text in about]
        )

    def taught_by(self, commit: Commit) -> CommitDelta:
        """Return what a commit changed of the domain."""
        now, *old = blobs = [self._blobs(sha) for sha in (commit.sha, *commit.parents)]
        try:
            found = self._since(commit.sha, *blobs)
        except KnowledgeError:
            now, *old = blobs = [self._readable(sha) for sha in (commit.sha, *commit.parents)]
            found = self._since(commit.sha, *blobs)
        first = tuple(n for n in in_order(now) if not any(n in each for each in old))
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
        return CommitDelta(commit.sha, sorted(removed), sorted(added), entries, first)

    def _since(
        self, sha: str, now: Mapping[str, str], *parents: Mapping[str, str]
    ) -> list[CommitDelta]:
        """What a commit changed of each parent, or of nothing if it has none."""
        found = []
        for old in parents or [{}]:
            names = [n for n in in_order((*now, *old)) if now.get(n) != old.get(n)]
            before, after = ({n: self._blob(b[n]) for n in names if n in b} for b in (old, now))
            found.append(self._difference(sha, before, after))
        return found

    @lru_cache(maxsize=16)  # noqa: B019 - a process has few of them
    def _blob(self, blob: str) -> bytes:
        return self.repo.blob(blob)

    @lru_cache(maxsize=64)  # noqa: B019
    def _blobs(self, revision: str) -> dict[str, str]:
        """The blob of each file at a revision, by name."""
        return self.repo.folder(self.folder, revision)

    def _readable(self, revision: str) -> dict[str, str]:
        """The same, of the newest readable version of each file that a revision builds on."""
        found = {}
        for name in in_order(self._blobs(revision)):
            sha, at = revision, self._blobs(revision).get(name)
            while at is not None and not self._is_readable(at, name):
                sha = next(iter(self.repo.commit_of(sha).parents), "")
                at = self._blobs(sha).get(name) if sha else None
            if at is not None:
                found[name] = at
        return found

    @lru_cache(maxsize=4096)  # noqa: B019
    def _is_readable(self, blob: str, name: str) -> bool:
        try:
            return parsed(self._blob(blob), name) is not None
        except KnowledgeError:
            return False

    def _difference(
        self, sha: str, before: Mapping[str, bytes], after: Mapping[str, bytes]
    ) -> CommitDelta:
        """What changed in some files. Raises KnowledgeError: one is no valid Turtle."""
        gone, came = set[str](), set[str]()
        entries = []
        for name in in_order((*before, *after)):
            path = f"{self.folder}/{name}"
            a, b = before.get(name), after.get(name)
            if a == b:
                continue
            if graph_of(name) and a and b and (differing := _lines_that_differ(a, b)):
                head, *sides = differing
                for facts, lines in zip((gone, came), sides, strict=True):
                    facts.update(*(_entries_in(head, line, path) for line in lines))
                continue
            old, new = (FileFacts() if d is None else read(d, name, path) for d in (a, b))
            gone |= old.facts
            came |= new.facts
            for entry in sorted({*old.entries, *new.entries}):
                was, is_ = old.entries.get(entry), new.entries.get(entry)
                if was != is_:
                    sign = "added" if was is None else "removed" if is_ is None else "changed"
                    entries.append((sign, name, entry))
        return CommitDelta(sha, sorted(gone - came), sorted(came - gone), entries)

    # ---------------------------------------------------------------------------- who taught it

    def commit_of(self, revision: str) -> tuple[Commit, CommitDelta] | None:
        """Return a commit with what it changed; None if it changed nothing of this domain.

        Raises:
            KnowledgeError: there is no such revision.
        """
        commit = self.repo.commit_of(self.repo.resolve(revision))
        found = self.taught_by(commit)
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
            for answer in answers(commit.trailers):
                if answer.number == int(number):
                    delta = one.changes.delta
                    gone, came = (
                        taught(answer, "-", delta.removed),
                        taught(answer, "+", delta.added),
                    )
                    return commit, Delta(gone, came), answer.question
        raise KnowledgeError(f'there is no answer "{name}"; `adaptbot kg log` tells their ids')

    def origins(self, facts: Iterable[Triple], pack: frozenset[Triple]) -> dict[Triple, Origin]:
        """Return where facts of the working files come from: the last commit that added each.

        `pack` are the facts that the bundled domain came with.
        """
        wanted = {_line_of(triple): triple for triple in facts}
        head = self.repo.head()
        committed = frozenset(wanted.values())
        if self.edited():
            committed = facts_of(self.files(head)) if head else frozenset()
        found = {t: UNCOMMITTED for t in wanted.values() if t not in committed}
        left = {line for line, triple in wanted.items() if triple in committed}
        subjects = {line.partition(" ")[0] for line in left}
        for one in self.taught(*subjects) if left else ():
            for line in left.intersection(one.added):
                found[wanted[line]] = self._origin(one, "+", wanted[line], pack)
            left.difference_update(one.added)
        return found | {wanted[line]: Origin("start") for line in left}

    def changed(self, facts: Iterable[Triple], head: str, since: str) -> Origin:
        """Return who last changed any of these facts, of the commits that lead to `head` and not
        to `since`; an origin of no source if none of them did."""
        wanted = {_line_of(triple): triple for triple in facts}
        for commit in self.repo.log([self.folder], since, head):
            one = self.taught_by(commit)
            for sign, lines in (("+", one.added), ("-", one.removed)):
                for line in sorted(wanted.keys() & set(lines)):
                    return self._origin(one, sign, wanted[line], frozenset())
        return Origin("")

    def history(
        self, subject: Node, predicate: Node, pack: frozenset[Triple]
    ) -> Iterator[Turnover]:
        """Give what came and went of one predicate of one thing, newest first."""
        begin = _line_of((subject, predicate, subject)).rpartition(" ")[0] + " "
        for one in self.taught(begin):
            for sign, lines in (("+", one.added), ("-", one.removed)):
                for triple in sorted(_triples(line for line in lines if line.startswith(begin))):
                    yield Turnover(sign, triple, self._origin(one, sign, triple, pack))

    def trace(self, fact: str) -> str:
        """Return the answer behind a fact such as `onion IsLiquid true`, from the latest commit."""
        last = fact.rpartition(" ")[2]
        for one in self.taught(last):
            likely = _triples(line for line in one.added if last in line)
            if not one.first and f"+ {fact}" in {short("+", triple) for triple in likely}:
                found = answers(self._commit(one.sha).trailers)
                lines = (answer.said for answer in found if f"+ {fact}" in answer.facts)
                return next(lines, f"commit {one.sha[:7]}")
        return f"from the {self.domain} as it came"

    def _origin(
        self, one: CommitDelta, sign: str, triple: Triple, pack: frozenset[Triple]
    ) -> Origin:
        """Why a commit added or removed a fact."""
        commit = self._commit(one.sha)
        about = _of_commit(commit)
        for answer in answers(commit.trailers):
            if taught(answer, sign, [triple]):
                return replace(
                    about,
                    source="answer",
                    answer=answer_id(commit.sha, answer.number),
                    question=answer.question,
                    said=answer.said,
                    by=answer.by or about.by,
                    at=answer.at,
                    suggestion=answer.suggestion,
                )
        if one.first and not commit.trailers:
            return PACK if triple in pack else replace(about, source="start")
        if about.source == "answer":
            # A run of the first edition took along what was edited by hand meanwhile.
            return replace(about, source="hand edit", task="", planner="", transcript="", robot="")
        return about

    @lru_cache(maxsize=256)  # noqa: B019
    def _commit(self, sha: str) -> Commit:
        return self.repo.commit_of(sha)

    def chapter(self, one: CommitDelta) -> Chapter:
        """Return what a commit taught as people read it."""
        commit = self._commit(one.sha)
        found = answers(commit.trailers)
        lines = [line.strip() for line in commit.body.splitlines() if line.strip()]
        if len(lines) != len(found):
            lines = ["; ".join(answer.facts) for answer in found]
        start = bool(one.first) and not commit.trailers
        return Chapter(_of_commit(commit), found, tuple(lines), one.changes, start)


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
        robot=fields.get("Robot", ""),
    )


def facts_of(files: Mapping[str, bytes]) -> frozenset[Triple]:
    """Return the single facts of some files. Raises KnowledgeError if one is no valid Turtle."""
    return frozenset().union(*(_triples(read(files[name], name, name).facts) for name in files))


@lru_cache(maxsize=64)
def read(data: bytes, name: str, path: str) -> FileFacts:
    """Read a file's facts and entries. Raises KnowledgeError if it is no valid Turtle."""
    triples = parsed(data, path)
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
            found = set(about) - called if whole else deep
            by_iri = name == "domain.ttl" or graph_of(name) is not None
            named = local(node_of(subject)) if by_iri else _entry_name(subject, about)
            entries[named] = _described(found, by_subject, set())
    return FileFacts(frozenset(facts), entries)


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


@lru_cache(maxsize=4096)
def _entries_in(head: bytes, line: bytes, path: str) -> frozenset[str]:
    return frozenset(map(str, parsed(head + line, path)))


def _lines_that_differ(
    old: bytes, new: bytes
) -> tuple[bytes, frozenset[bytes], frozenset[bytes]] | None:
    """The prefixes of two versions of a file, and the lines, with subjects, that only one has.

    None where that may not be all that differs: the writer's form alone tells where a block ends,
    and that it stands for itself.
    """
    head = _HEAD.match(old).end()  # type: ignore[union-attr]
    start = old.rfind(b"\n\n", 0, _alike(old, new)) + 2
    rest = _alike(old[: start - 1 : -1], new[: start - 1 : -1])
    end = old.find(b"\n\n", len(old) - rest) + 1 or len(old)
    parts = old[start:end], new[start : len(new) - len(old) + end]
    around = old[head - 1 : start] + old[end:]
    # A directive, another way to write a subject, a text with lines of its own.
    if start < head or any(mark in around for mark in (b"<", b'"""', b"'''")):
        return None
    for part in parts:
        if not _BLOCKS.fullmatch(part) or _UNCLEAR.search(part):
            return None
        if any(b"\n" + subject in around for subject in _SUBJECT.findall(part)):
            return None
    before, after = (frozenset(_with_subjects(part)) for part in parts)
    return old[:head], before - after, after - before


def _with_subjects(blocks: bytes) -> Iterator[bytes]:
    """The lines of blocks of the writer's form, each with its subject."""
    subject = b""
    for line in blocks.split(b"\n"):
        if line.startswith(b"    "):
            yield subject + line + b"\n.\n"
        elif line[:1] not in (b"", b".", b"#"):
            subject = line[: line.index(b" ")]
            yield line + b"\n.\n"


def _alike(one: bytes, other: bytes) -> int:
    """How many bytes two texts begin with alike."""
    low, high = 0, min(len(one), len(other))
    while low < high:
        middle = (low + high + 1) // 2
        if one[low:middle] == other[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def _as_json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))


def _digest(lines: bytes | memoryview) -> bytes:
    return hashlib.sha256(lines).hexdigest().encode()


def _line_end(data: bytes, start: int, end: int) -> int:
    found = data.find(b"\n", start, end)
    return end if found < 0 else found
