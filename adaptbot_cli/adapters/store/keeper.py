"""Keeps what was learned: edits the workspace's Turtle files and commits them."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from rdflib import RDF, RDFS

from adaptbot_cli.adapters.store.files import lock, recover, write_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import DOMAIN_FILES, FACT_FILES, load_kg, read_files
from adaptbot_cli.adapters.store.turtle import patch
from adaptbot_cli.core.delta import Delta, net
from adaptbot_cli.core.faults import faults
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.terms import AB, STATES, Triple, local
from adaptbot_cli.core.turns import Keep, Kept
from adaptbot_cli.errors import KnowledgeError

_ACTION_TERMS = frozenset(
    {AB.parameter, AB.order, AB.name, AB["class"], AB.explain, AB.effect, AB.requires, RDFS.label}
)


@dataclass(frozen=True, slots=True)
class Origin:
    """Where what is learned comes from: named in every commit."""

    planner: str
    transcript: str
    now: Callable[[], datetime]


@dataclass(frozen=True, slots=True)
class Keeper:
    """The store of a domain in a workspace. `first` gives the files that a first use writes.

    It is asked while the workspace is locked, so that it sees what another run has just made.
    """

    root: Path
    domain: str
    kg: Kg
    origin: Origin
    first: Callable[[], Mapping[str, bytes]]

    def start(self) -> str | None:
        """Write and commit what a first use needs; return the revision that the run starts from.

        No file that is there already is written.

        A folder that is made here is a repository of its own; one that was there already is
        versioned by the repository that it lies in.

        Raises:
            KnowledgeError: the workspace cannot be written.
        """
        made = not self.root.is_dir() or not any(self.root.iterdir())
        with lock(self.root):
            recover(self.root)
            repo = Repo.open_or_init(self.root, own=made)
            first = {p: data for p, data in self.first().items() if not (self.root / p).exists()}
            if first:
                write_files(self.root, first)
            head = repo.head()
            known = {p for p in self._paths() if head and repo.read(p, head) is not None}
            new = sorted({*first, *self._paths()} - known)
            if new:
                message = f"start: the {self.domain} as it comes"
                return repo.commit(new, message, self.origin.now())
            return head

    def edited(self) -> list[str]:
        """Return the domain's files that a person has changed since the last commit."""
        return Repo.open_or_init(self.root).dirty(self._paths())

    def _paths(self) -> list[str]:
        return [f"kg/{self.domain}/{name}" for name in (*DOMAIN_FILES, *FACT_FILES)]

    def keep(self, turn: Keep) -> Kept:
        """Commit lessons, with the question and answer behind every fact (DESIGN, 7).

        Raises:
            KnowledgeError: the files cannot be written or committed, no longer make a domain, or
                would hold what the domain does not allow; nothing has changed then.
        """
        deltas = [lesson.delta for lesson in turn.lessons]
        told = f" {self.origin.transcript}" if self.origin.transcript else ""
        hint = f"the answers are in the transcript{told}"
        return Kept(self._commit(deltas, _message(turn, self.origin), hint))

    def apply(self, task: str, deltas: Iterable[Delta]) -> str | None:
        """Commit the state that an executed plan leaves. Raises KnowledgeError as `keep` does."""
        message = f'state: after "{task}"\n\nTask: {task}\nPlanner: {self.origin.planner}\n'
        return self._commit(list(deltas), message, "what was learned has been kept")

    def _commit(self, deltas: list[Delta], message: str, hint: str) -> str | None:
        with lock(self.root):
            recover(self.root)
            files = read_files(self.root / "kg" / self.domain)
            changed = {name: data for name, data in self._edited(files, deltas) if data}
            if changed:
                self._refuse_new_faults(files, {**files, **changed}, hint)
            paths = {f"kg/{self.domain}/{name}": data for name, data in changed.items()}
            repo = Repo.open_or_init(self.root)
            edited = [path for path in repo.dirty(sorted(paths)) if path in paths]
            message += "".join(f"Hand-edited: {path}\n" for path in edited)
            old = {f"kg/{self.domain}/{name}": files[name] for name in changed}
            with self._put_back(repo, old):
                write_files(self.root, paths)
                return repo.commit(sorted(paths), message, self.origin.now())

    def _refuse_new_faults(
        self, before: Mapping[str, bytes], after: Mapping[str, bytes], hint: str
    ) -> None:
        """Make sure that new files can be read again and are no worse than the old ones.

        Both are read as they are now, so that what another run has learned meanwhile counts.
        """
        where = f"kg/{self.domain}"
        known = set(faults(load_kg(before, where)))
        new = [fault for fault in faults(load_kg(after, where)) if fault not in known]
        if new:
            told = "; ".join(new)
            raise KnowledgeError(
                f"this cannot be kept beside what {where} holds now: {told}. Nothing was changed; "
                f"{hint}."
            )

    @contextmanager
    def _put_back(self, repo: Repo, old: Mapping[str, bytes]) -> Iterator[None]:
        """Give files their old contents again if what is done here fails before a commit."""
        head = repo.head()
        try:
            yield
        except BaseException:
            if repo.head() == head:
                write_files(self.root, old)
            raise

    def _edited(self, files: dict[str, bytes], deltas: list[Delta]) -> Iterator[tuple[str, bytes]]:
        change = net(deltas)
        for name in ("attributes.ttl", "state.ttl", "actions.ttl"):
            old = files[name].decode("utf-8")
            here = [t for t in sorted(change.removed) if self._file_of(t) == name]
            new = [t for t in sorted(change.added) if self._file_of(t) == name]
            text = patch(old, here, new, f"kg/{self.domain}/{name}") if here or new else old
            yield name, b"" if text == old else text.encode("utf-8")

    def _file_of(self, triple: Triple) -> str:
        _, predicate, value = triple
        if predicate in _ACTION_TERMS or (predicate == RDF.type and value == AB.Action):
            return "actions.ttl"
        return "state.ttl" if self.kg.home_of(predicate) == STATES else "attributes.ttl"


def _message(turn: Keep, origin: Origin) -> str:
    title = turn.lessons[0].sentence
    more = len(turn.lessons) - 1
    subject = f"learn: {title}" + (f" (and {more} more)" if more else "")
    facts = "\n".join(f"  {lesson.sentence}" for lesson in turn.lessons)
    trailers = [f"Task: {turn.task.name}", f"Planner: {origin.planner}"]
    trailers += [f"Transcript: {origin.transcript}"] if origin.transcript else []
    for number, lesson in enumerate(turn.lessons, start=1):
        trailers += list(_provenance(number, lesson))
    return f"{_one_line(subject)}\n\n{facts}\n\n" + "\n".join(map(_one_line, trailers)) + "\n"


def _provenance(number: int, lesson: Lesson) -> Iterator[str]:
    yield f"Question-{number}: {lesson.question.text}"
    said = " ".join(part for part in (lesson.answer.value, _by(lesson)) if part)
    yield f"Answer-{number}: {said}"
    for sign, triples in (("-", lesson.delta.removed), ("+", lesson.delta.added)):
        for triple in sorted(triples):
            yield f"Fact-{number}: {sign} {' '.join(local(node) for node in triple)}"


def _by(lesson: Lesson) -> str:
    by, at = lesson.answer.by, lesson.answer.at
    return f"({', '.join(part for part in (by, at) if part)})" if by or at else ""


def _one_line(text: str) -> str:
    return " ".join(text.split())
