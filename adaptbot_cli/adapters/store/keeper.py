"""Keeps what was learned: changes the workspace's Turtle files and commits them.

Hand edits of a domain's files are committed first, as a commit of their own, so that a run's facts
never mix with them. Edits with faults of their own are left out of both, for their author to mend.
"""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path

from rdflib import RDF, RDFS, URIRef
from rdflib.term import Node

from adaptbot_cli.adapters.store import files as disk
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.filing import Filing
from adaptbot_cli.adapters.store.git import UNFINISHED, Repo
from adaptbot_cli.adapters.store.reading import (
    FACT_FILES,
    fact_files,
    in_order,
    is_large,
    load_domain,
    load_kg,
    misplaced,
    parse,
    parts_of,
)
from adaptbot_cli.adapters.store.trailers import compose, of_lessons, write
from adaptbot_cli.adapters.store.turtle import parsed, rewrite, statements, tokens
from adaptbot_cli.adapters.store.versions import Versions
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import (
    AB,
    ACTION_PARTS,
    FACT_TERMS,
    STATES,
    Triple,
    kept,
    ordered,
)
from adaptbot_cli.core.graph.validate import faults, new_faults
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.core.turns import Believe, Keep, Kept
from adaptbot_cli.errors import KnowledgeError, UsageError

_ACTIONS = "actions.ttl"
_TYPE, _LABEL, _OWN = RDF.type, RDFS.label, str(AB)
PlanFile = Callable[[Lesson, str, str], tuple[str, bytes]]
"""Returns the name and the content of the file of a plan that is to be kept, from the lesson that
says so, the planner's name and the transcript's."""


@dataclass(frozen=True, slots=True)
class CommitSource:
    """Where what is learned comes from: named in every commit.

    `robot` is which one acted, where it is not the domain's own.
    """

    planner: str
    transcript: str
    now: Callable[[], datetime]
    robot: str = ""

    def trailers(self, task: str) -> list[tuple[str, str]]:
        """Return the trailers of a commit of a run of a task."""
        given = (("Robot", self.robot), ("Transcript", self.transcript))
        return [("Task", task), ("Planner", self.planner), *(each for each in given if each[1])]


@dataclass(frozen=True, slots=True)
class WorkspaceStart:
    """The revision of a workspace, the files edited by hand since, and the graph of both.

    `files` are those that the graph was loaded from; `notes` are sentences for the person: what a
    recovery did, what is left unread.
    """

    revision: str | None
    edited: tuple[str, ...]
    kg: Kg
    files: dict[str, bytes]
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class Held:
    """A domain's files as bytes and, loaded once, as a graph; `where` names them in messages."""

    where: str
    files: dict[str, bytes]
    kg: Kg

    @classmethod
    def of(cls, files: Mapping[str, bytes], where: str, large: int | None = None) -> "Held":
        """Load a domain from the bytes of its files, as `load_kg` does.

        Raises:
            KnowledgeError, PackError: the files make no domain.
        """
        return cls(where, dict(files), load_kg(files, where, large=large))

    def after(self, change: Delta) -> dict[str, bytes]:
        """Return the files that a change of facts makes differ, as they are after it.

        Raises:
            KnowledgeError: a term cannot be written in Turtle.
        """
        parts, filing, found = _parts(change), Filing(self.files, self.kg), {}
        old, new = defaultdict[str, list[Triple]](list), defaultdict[str, list[Triple]](list)
        removed, added = (defaultdict[tuple[str, Node], list[Triple]](list) for _ in range(2))
        for triple in ordered(change.removed):
            for file in self._files_of(triple, parts):
                removed[file, triple[0]].append(triple)
        for triple in ordered(change.added):
            added[self._file_of(triple, parts), triple[0]].append(triple)
        for (file, subject), triples in removed.items():
            for name in filing.holding(file, subject):
                old[name] += triples
        for (file, subject), triples in added.items():
            new[filing.filed(file, subject, len(triples), change.added)] += triples
        for name in in_order((*old, *new)):
            text = (self.files.get(name) or filing.heading(name)).decode("utf-8")
            where = f"{self.where}/{name}"
            edited = rewrite(text, old.get(name, ()), new.get(name, ()), where)
            if edited != text:
                found[name] = edited.encode("utf-8")
        return found

    def _files_of(self, triple: Triple, parts: frozenset[Node]) -> Collection[str]:
        """The files that may hold a fact: somebody may have written it into the wrong one."""
        subject, predicate, value = triple
        astray = (subject, predicate, kept(value)) in self.kg.strays
        return FACT_FILES if astray else (self._file_of(triple, parts),)

    def _file_of(self, triple: Triple, parts: frozenset[Node]) -> str:
        subject, predicate, value = triple
        if subject in parts:
            return _ACTIONS
        own = str(value if predicate == _TYPE else predicate)
        if predicate == _LABEL or (own.startswith(_OWN) and URIRef(own) not in FACT_TERMS):
            return _ACTIONS
        return "state.ttl" if self.kg.home_of(predicate) == STATES else "attributes.ttl"

    def new_faults(self, change: Delta, changed: Mapping[str, bytes]) -> list[Fault]:
        """Return what a change would break; `changed` are the files after it, if any differs.

        Raises:
            KnowledgeError, PackError: the files could not be read again or make no domain.
        """
        if not changed:
            return []
        for name in fact_files(changed):
            parsed(changed[name], f"{self.where}/{name}")
        domain = load_domain({**self.files, **changed}, self.where)
        return new_faults(self.kg, self._facts(change), domain)

    def judged(
        self, change: Delta, lessons: Sequence[Lesson] = (), hint: str = ""
    ) -> dict[str, bytes]:
        """Return what `after` does, if the domain allows the change.

        `lessons` are what it comes from, named where it is refused; `hint` ends the refusal.

        Raises:
            KnowledgeError: it does not, or the change cannot be written.
        """
        changed = self.after(change)
        if found := self.new_faults(change, changed):
            text = "; ".join(f"{f.message if f.facts else f}{_cause(f, lessons)}" for f in found)
            rest = f". Nothing was changed{f'; {hint}' if hint else ''}."
            raise KnowledgeError(
                f"this cannot be kept beside what {self.where} holds now: {text}{rest}"
            )
        return changed

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


@dataclass(slots=True)
class Keeper:
    """The store of a domain in a workspace that `start` has made ready.

    Whatever is committed is judged on the files as they are at that moment, not on the graph that
    the run started from; they are read again only if they have changed. `plan_file` writes a plan
    that is to be kept; `large` is from how many lines of facts on a home is kept on disk.
    """

    root: Path
    domain: str
    origin: CommitSource
    held: Held | None = None
    plan_file: PlanFile | None = None
    large: int | None = None

    @property
    def _where(self) -> str:
        return f"kg/{self.domain}"

    def keep(self, turn: Keep) -> Kept:
        """Commit lessons, with the question and answer behind every fact (DESIGN, 7).

        Raises:
            KnowledgeError: the files cannot be written or committed, no longer make a domain, or
                would hold what the domain does not allow; nothing has changed then.
        """
        more = len(turn.lessons) - 1
        title = turn.lessons[0].sentence + (f" (and {more} more)" if more else "")
        trailers = self.origin.trailers(turn.task.name)
        sentences = [lesson.sentence for lesson in turn.lessons]
        message = compose(f"learn: {title}", [*trailers, *of_lessons(turn.lessons)], sentences)
        text = f" {self.origin.transcript}" if self.origin.transcript else ""
        hint = f"the answers are in the transcript{text}"
        change = net(lesson.delta for lesson in turn.lessons)
        plans: dict[str, bytes | None] = {}
        for lesson in turn.lessons:
            if lesson.plan and self.plan_file is not None:
                name, data = self.plan_file(lesson, self.origin.planner, self.origin.transcript)
                plans[f"plans/{self.domain}/{name}"] = data
        return Kept(self.change(change, message, turn.lessons, hint, plans))

    def believe(self, turn: Believe) -> Kept:
        """Commit what a step did and what was seen then, with the step. Raises as `keep` does."""
        trailers = self.origin.trailers(turn.task.name)
        trailers += [("Step", turn.step)] if turn.step else []
        message = compose(f"state: {turn.step or 'seen before the first step'}", trailers)
        return Kept(self.change(turn.delta, message, hint="it is in the transcript"))

    def trace(self, fact: str) -> str:
        """Return where a fact such as `onion IsLiquid true` comes from. Raises KnowledgeError."""
        return Versions.of(self.root, self.domain).trace(fact)

    def apply(self, task: str, deltas: Iterable[Delta]) -> str | None:
        """Commit the state that an executed plan leaves. Raises KnowledgeError as `keep` does."""
        trailers = replace(self.origin, transcript="").trailers(task)
        message = compose(f'state: after "{task}"', trailers)
        return self.change(net(deltas), message, hint="what was learned has been kept")

    def change(
        self,
        change: Delta,
        message: str,
        lessons: Sequence[Lesson] = (),
        hint: str = "",
        others: Mapping[str, bytes | None] = {},
    ) -> str | None:
        """Commit a change of facts if the files, as they are now, allow it; return the revision.

        A change that is there already makes no commit. `lessons` and `hint` are as for
        `Held.judged`; `others` are files that are written or, with None, removed beside those of
        facts.

        Raises:
            KnowledgeError: as `keep` does.
        """
        repo = Repo.open_or_init(self.root)
        with repo.writing():
            found = read_files(self.root / self._where, self.root)
            if self.held is None or self.held.files != found:
                self.held = Held.of(found, self._where, self.large)
            held = self.held
            changed = held.judged(change, lessons, hint)
            there = {path: disk.read(self.root, path) for path in others}
            if edits := repo.dirty(list(others), there):
                commit_hand_edits(repo, edits, "", self.origin.now())
            written = {path: data for path, data in others.items() if data != there[path]}
            written |= {f"{self._where}/{name}": data for name, data in changed.items()}
            if not written:
                return repo.head()
            apart, staged = self._beside_edits(repo, held, change, written)
            for path in apart.keys() - written.keys():
                written[path] = held.files[path.removeprefix(f"{self._where}/")]
            revision = repo.commit(written, message, self.origin.now(), apart, staged)
            held.learn(change, changed)
            if self.large is not None and is_large(held.files, self.large):
                from adaptbot_cli.adapters.store import copies

                copies.keep_copy(held.kg, parts_of(held.files))
            return revision

    def _beside_edits(
        self, repo: Repo, held: Held, change: Delta, written: Mapping[str, bytes | None]
    ) -> tuple[dict[str, bytes], dict[str, bytes]]:
        """Commit hand edits, if there are any, first.

        If they have faults, return what is committed of the change without them, and what is
        staged: the edits stay as they are.
        """
        edited = [
            f"{self._where}/{name}" for name in Versions(self.domain, repo).edited(held.files)
        ]
        if not edited:
            return {}, {}
        head = repo.head()
        committed = _held_at(repo, self.domain, head)
        if committed is not None and faults_of(held, committed):
            try:
                after = committed.after(change)
                if not committed.new_faults(change, after):
                    apart = {f"{self._where}/{name}": data for name, data in after.items()}
                    return apart, self._staged(repo, held, change, {*apart, *written}, head)
            except KnowledgeError:
                pass  # what was learned makes no sense without the edits
        commit_hand_edits(repo, edited, "", self.origin.now())
        return {}, {}

    def _staged(
        self, repo: Repo, held: Held, change: Delta, paths: Iterable[str], head: str | None
    ) -> dict[str, bytes]:
        """What the user has staged of these files, after the change."""
        found = {}
        for path in sorted(paths):
            data, name = repo.staged(path), path.removeprefix(f"{self._where}/")
            if data is not None and data != repo.read(path, head):
                try:
                    after = Held(self._where, {**held.files, name: data}, held.kg).after(change)
                except (KnowledgeError, UnicodeDecodeError):
                    continue
                found[path] = after.get(name, data)
        return found


def _held_at(repo: Repo, domain: str, revision: str | None) -> Held | None:
    """A domain as it was committed; None if that makes no domain."""
    files = Versions(domain, repo).files(revision) if revision else {}
    try:
        return Held.of(files, f"kg/{domain}")
    except KnowledgeError:
        return None


def faults_of(now: Held, before: Held | None) -> list[Fault]:
    """What is wrong with a domain's files that was not yet wrong before."""
    old = set() if before is None else {*map(str, (*faults(before.kg), *misplaced(before.kg)))}
    return [fault for fault in (*faults(now.kg), *misplaced(now.kg)) if str(fault) not in old]


def edit_faults(repo: Repo, domain: str) -> list[Fault]:
    """Return what is wrong with the files and was not yet at the last commit.

    Raises:
        KnowledgeError, PackError: the files make no domain.
    """
    where = f"kg/{domain}"
    now = Held.of(read_files(repo.root / where, repo.root), where)
    head = repo.head()
    return faults_of(now, _held_at(repo, domain, head)) if head else []


def edited_plans(repo: Repo, domain: str) -> list[str]:
    """Return the paths of the kept plans of a domain that differ from those committed."""
    folder = f"plans/{domain}"
    found = {*disk.names(repo.root, folder), *repo.folder(folder, repo.head())}
    return repo.dirty([f"{folder}/{name}" for name in sorted(found) if name.endswith(".plan")])


def commit_hand_edits(
    repo: Repo, edited: Iterable[str], message: str, when: datetime, by: str = ""
) -> str:
    """Commit hand edits of a domain's files as they are; the caller is in `repo.writing`."""
    names = ", ".join(path.rpartition("/")[2] for path in edited)
    text = write([("Source", "hand edit"), *([("By", by)] if by else [])])
    contents = {path: disk.read(repo.root, path) for path in edited}
    return repo.commit(contents, f"{message.strip() or f'hand edit: {names}'}\n\n{text}", when)


def start(
    root: Path,
    domain: str,
    first: Callable[[], Mapping[str, bytes]],
    now: Callable[[], datetime],
    large: int | None = None,
) -> WorkspaceStart:
    """Write and commit what a first use of a domain needs; return what a run starts from.

    `first` gives the files that a first use writes. It is asked while the workspace is locked, so
    that it sees what another run has just made. No file that is there already is written. Files
    that are there and were never committed are committed if the domain finds nothing wrong with
    them, else left as hand edits. The graph is loaded as `load_kg` does with `large`.

    Raises:
        KnowledgeError: the workspace cannot be written, or its files make no domain.
    """
    repo = _repository(root)
    with repo.writing():
        new = {p: data for p, data in first().items() if disk.read(root, p) is None}
        own = f"kg/{domain}/"
        found = read_files(root / "kg" / domain, root)
        found |= {p.removeprefix(own): data for p, data in new.items() if p.startswith(own)}
        kg = load_kg(found, f"kg/{domain}", large=large)
        committed = in_order(repo.folder(f"kg/{domain}", repo.head()))
        there = {f"{own}{name}": found[name] for name in in_order(found)}
        unknown = set() if committed else there.keys() - new.keys()
        if unknown and faults(kg):
            unknown = set()
        if new or unknown:
            contents = {**new, **{path: there[path] for path in unknown}}
            repo.commit(dict(sorted(contents.items())), f"start: the {domain} as it comes", now())
        edited = tuple(f"{own}{name}" for name in Versions(domain, repo).edited(found))
        return WorkspaceStart(repo.head(), edited, kg, found, tuple(_notes(repo, found)))


def _notes(repo: Repo, found: Mapping[str, bytes]) -> Iterator[str]:
    """What a person should know before the first write, each said once or until it is mended."""
    yield from repo.notes
    old = repo.root / ".adaptbot"
    if repo.cached("unread") is None and any(old.glob("journal/*.json")):
        yield f"{old} is of an earlier version and was not read; remove it"
        repo.cache("unread", b"1")
    if repo.cached("comments") is None:
        inner = [name for name in fact_files(found) if _has_inner_comments(found[name])]
        if inner:
            yield (
                f"comments inside an entry of {sentence_list(inner)} go when that entry changes; "
                "those between entries stay"
            )
            repo.cache("comments", b"1")


def _has_inner_comments(data: bytes) -> bool:
    """Whether a comment stands inside an entry."""
    if not any(mark in data for mark in (b"\n#", b" #", b"\t#")):
        return False
    text = data.decode("utf-8", "replace")
    return any(
        "#" in text[place.start : place.end]
        and any(
            "#" in text[before.end() : after.start()]
            for before, after in pairwise(tokens(text, place))
        )
        for place in statements(text)
    )


def _repository(root: Path) -> Repo:
    """The repository of a workspace: its own if its folder is new, else the one that it lies in."""
    made = not root.is_dir() or all(p.name.startswith(UNFINISHED) for p in root.iterdir())
    return Repo.open_or_init(root, own=made)


def create(root: Path, files: Mapping[str, bytes], more: Mapping[str, bytes], message: str) -> str:
    """Write and commit new files; return the revision. `more` are written only where missing.

    Raises:
        UsageError: one of `files` is there already; nothing is written then.
        KnowledgeError: the workspace cannot be written.
    """
    repo = _repository(root)
    with repo.writing():
        there = sorted(path for path in files if disk.read(root, path) is not None)
        if there:
            raise UsageError(f"{root / there[0]} is there already, and nothing is overwritten")
        missing = {p: data for p, data in more.items() if disk.read(root, p) is None}
        return repo.commit(dict(sorted({**files, **missing}.items())), message)


def renamed(files: Mapping[str, bytes], domain: URIRef, new: URIRef, name: str) -> dict[str, bytes]:
    """Return a pack's valid Turtle files with the domain under another IRI and rdfs:label.

    Everything else in them, comments and order too, stays as it is.
    """
    return {
        file: _renamed(data.decode("utf-8"), file, domain, new, name).encode("utf-8")
        for file, data in files.items()
    }


def _renamed(text: str, file: str, domain: URIRef, new: URIRef, name: str) -> str:
    spaces = dict(parse(text.encode("utf-8"), file).namespaces())
    written = {f"<{domain}>": f"<{new}>"}
    for prefix, space in spaces.items():
        if domain.startswith(space):
            written[f"{prefix}:{domain[len(space) :]}"] = f"{prefix}:{new[len(space) :]}"
    labels = {f"<{RDFS.label}>"} | {
        f"{p}:label" for p, iri in spaces.items() if str(iri) == str(RDFS)
    }
    edits = []
    for place in statements(text):
        found = list(tokens(text, place))
        edits += [(*t.span(), written[t[0]]) for t in found if t[0] in written]
        if place.head in written:
            edits += [
                (*t.span(), f'"{name}"')
                for b, t in pairwise(found)
                if b[0] in labels and t[0][0] in "\"'"
            ]
    for start_, end, now in sorted(edits, reverse=True):
        text = text[:start_] + now + text[end:]
    return text


def _cause(fault: Fault, lessons: Sequence[Lesson]) -> str:
    direct = [lesson for lesson in lessons if lesson.delta.added & fault.facts]
    near = [
        lesson
        for lesson in lessons
        if fault.about in {t[0] for t in lesson.delta.added | lesson.delta.removed}
    ]
    lines = [f'"{x.answer.value}" to "{x.question.text}"' for x in direct or near]
    return f" (from the answer {' and '.join(lines)})" if lines else ""
