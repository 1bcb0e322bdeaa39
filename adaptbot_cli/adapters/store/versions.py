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
from itertools import chain, groupby
from pathlib import Path

import pyoxigraph
from pyoxigraph import BlankNode, Literal
from rdflib import RDFS
from rdflib.term import Node

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import graph_of, in_order, paths_of
from adaptbot_cli.adapters.store.trailers import Commit, answers, taught
from adaptbot_cli.adapters.store.turtle import engine, parsed
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import AB, Triple, local, node_of, triple_of
from adaptbot_cli.core.view.changes import Changes, PackEntry
from adaptbot_cli.core.view.provenance import Chapter, Origin, Turnover, answer_id, short
from adaptbot_cli.errors import KnowledgeError

PACK = Origin("pack")
UNCOMMITTED = Origin("uncommitted")

_OF_ENTRIES = frozenset({"tasks.ttl", "domain.ttl"})
_HEAD = re.compile(rb"(?:\xef\xbb\xbf)?(?:(?:@prefix [^\s:<]*: <[^<>\n]*> \.|#[^\n]*)?\n)*")
_BLOCK = re.compile(rb"(?:#[^\n]*\n)*([^\s#.@_]\S* )\S[^\n]*\n(?:    \S[^\n]*\n)*\.\n?")
# What makes a block mean something else than it says by itself.
_UNCLEAR = re.compile(rb"[\[(]|_:|\.[ \t]")
_HEADS = re.compile(rb"(?:^|\.)[ \t]*(\S+ )", re.MULTILINE)
_FACTS = 2_000
"""How many facts of a commit stand in a line of the cache."""
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

    `first` tells that it was the first to hold one of the files.
    """

    sha: str
    removed: Sequence[str] = ()
    added: Sequence[str] = ()
    entries: Sequence[tuple[str, str, str]] = ()
    first: bool = False

    @property
    def lines(self) -> list[bytes]:
        """The same as JSON: a line, or several where it has many facts."""
        most = max(1, len(self.removed), len(self.added))
        parts = ((self.removed[n : n + _FACTS], self.added[n : n + _FACTS])
                 for n in range(0, most, _FACTS))  # fmt: skip
        rest = (self.entries, self.first)
        return [_as_json((self.sha, *part, *rest)) for part in parts]

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
    def _known(self) -> list[bytes]:
        """The lines of `CommitDelta`s in the cache, newest first; none if it was not written so."""
        digest, _, data = (self.repo.cached(self.domain) or b"").partition(b"\n")
        return data.split(b"\n") if digest == _digest(data) else []

    @property
    def folder(self) -> str:
        """The folder of the domain's files in the workspace."""
        return f"kg/{self.domain}"

    def files(self, revision: str | None) -> dict[str, bytes]:
        """Return the files at a revision; those on disk if it is None."""
        if revision is None:
            found = read_files(self.repo.root / self.folder, self.repo.root)
            return {name: found[name] for name in in_order(found)}
        blobs = self._blobs(revision)
        return {name: self.repo.blob(blobs[name]) for name in in_order(blobs)}

    def edited(self, found: Mapping[str, bytes] | None = None) -> list[str]:
        """Return the names of the files that differ from the last commit; `found` are those on
        disk, if they have been read."""
        found = self.files(None) if found is None else found
        known = self.repo.folder(self.folder, self.repo.head())
        names = {path: path.removeprefix(f"{self.folder}/")
                 for path in paths_of(self.domain, found, known)}  # fmt: skip
        held = {path: found.get(name) for path, name in names.items()}
        return [names[path] for path in self.repo.dirty(list(names), held)]

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
        newest = _sha(known[0]) if known else None
        since = newest if head and newest and self.repo.leads_to(newest, head) else None
        shas = [commit.sha for commit in self.repo.log([self.folder], since)]
        if shas or (known and not since):
            old = {} if since else {sha: [*lines] for sha, lines in groupby(known, _sha)}
            new = (old.get(sha) or self.taught_by(self._commit(sha)).lines for sha in shas)
            known = [*chain.from_iterable(new), *(known if since else ())]
            data = b"\n".join(known)
            self.repo.cache(self.domain, _digest(data) + b"\n" + data)
            self.__dict__["_known"] = known
        if about:
            texts = [_as_json(text)[1:-1] for text in about]
            near = {n for text in texts for n, line in enumerate(known) if text in line}
            known = [known[n] for n in sorted(near)]
        for _, lines in groupby(known, _sha):
            parts = [CommitDelta(*json.loads(line)) for line in lines]
            removed, added = ([t for part in parts for t in getattr(part, side)]
                              for side in ("removed", "added"))  # fmt: skip
            yield replace(parts[0], removed=removed, added=added)

    def taught_by(self, commit: Commit) -> CommitDelta:
        """Return what a commit changed of the domain."""
        now, *old = blobs = [self._blobs(sha) for sha in (commit.sha, *commit.parents)]
        try:
            found = self._since(commit.sha, *blobs)
        except KnowledgeError:
            now, *old = blobs = [self._readable(sha) for sha in (commit.sha, *commit.parents)]
            found = self._since(commit.sha, *blobs)
        first = any(not any(name in each for each in old) for name in in_order(now))
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
        data = self._blob(blob)  # one that is damaged is no file that somebody left so
        try:
            return parsed(data, name) is not None
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
            if graph_of(name) and a and b and (differing := _blocks_that_differ(a, b)):
                old, new = (frozenset(map(str, parsed(blocks, path))) for blocks in differing)
                gone |= old
                came |= new
                continue
            then, now = (FileFacts() if d is None else read(d, name, path) for d in (a, b))
            gone |= then.facts
            came |= now.facts
            for entry in sorted({*then.entries, *now.entries}):
                was, is_ = then.entries.get(entry), now.entries.get(entry)
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
        commit = self.repo.commit_of(revision)
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
            delta = one.changes.delta
            for answer in (each for each in answers(commit.trailers) if each.number == int(number)):
                sides = (("-", delta.removed), ("+", delta.added))
                gone, came = (taught(answer, sign, facts) for sign, facts in sides)
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


def _blocks_that_differ(old: bytes, new: bytes) -> tuple[bytes, bytes] | None:
    """The blocks that only one of two versions of a file has, each with the prefixes.

    None where that may not be all that differs: the writer's form alone tells where a block ends,
    and that it stands for itself.
    """
    head = _HEAD.match(old)[0]  # type: ignore[index]
    bodies = [data[len(head) :] for data in (old, new)]
    # A directive, another way to write a subject, a text with lines of its own.
    unclear = any(mark in body for body in bodies for mark in (b"<", b'"""', b"'''"))
    if unclear or not new.startswith(head):
        return None
    before, after = (dict.fromkeys(body.split(b"\n\n")) for body in bodies)
    blocks = [_BLOCK.fullmatch(block) for block in before.keys() ^ after.keys() if block]
    if not all(block and not _UNCLEAR.search(block[0]) for block in blocks):
        return None
    rest = b"\n".join(before.keys() & after.keys())
    if not {block[1] for block in blocks if block}.isdisjoint(_HEADS.findall(rest)):
        return None
    one, other = (b"\n".join([head, *(s for s in side if s not in other)])
                  for side, other in ((before, after), (after, before)))  # fmt: skip
    return one, other


def _as_json(value: object) -> bytes:
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    return text.encode("utf-8", "surrogatepass")


def _sha(line: bytes) -> str:
    return line[2:42].decode()


def _digest(lines: bytes) -> bytes:
    return hashlib.sha256(lines).hexdigest().encode()
