"""Keeps what was learned: edits the workspace's Turtle files and commits them."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from rdflib import RDF, RDFS

from adaptbot_cli.adapters.store.files import lock, recover, write_files
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import DOMAIN_FILES, FACT_FILES, load_kg, read_files
from adaptbot_cli.adapters.store.turtle import patch
from adaptbot_cli.core.kg import Delta, Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.terms import AB, STATES, Triple, local
from adaptbot_cli.core.turns import Keep, Kept

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
    """The store of a domain in a workspace. `first` are the files that a first use writes."""

    root: Path
    domain: str
    kg: Kg
    origin: Origin
    first: dict[str, bytes]

    def start(self) -> str | None:
        """Write and commit what a first use needs; return the revision that the run starts from.

        A folder that is made here is a repository of its own; one that was there already is
        versioned by the repository that it lies in.

        Raises:
            KnowledgeError: the workspace cannot be written.
        """
        made = not self.root.is_dir() or not any(self.root.iterdir())
        with lock(self.root):
            recover(self.root)
            repo = Repo.open_or_init(self.root, own=made)
            if self.first:
                write_files(self.root, self.first)
            head = repo.head()
            known = {p for p in self._paths() if head and repo.read(p, head) is not None}
            new = sorted({*self.first, *self._paths()} - known)
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
            KnowledgeError: the files cannot be written, or no longer make a domain; nothing has
                changed then.
        """
        deltas = [lesson.delta for lesson in turn.lessons]
        return Kept(self._commit(deltas, _message(turn, self.origin)))

    def apply(self, task: str, deltas: Iterable[Delta]) -> str | None:
        """Commit the state that an executed plan leaves."""
        message = f'state: after "{task}"\n\nTask: {task}\nPlanner: {self.origin.planner}\n'
        return self._commit(list(deltas), message)

    def _commit(self, deltas: list[Delta], message: str) -> str | None:
        with lock(self.root):
            recover(self.root)
            files = read_files(self.root / "kg" / self.domain)
            changed = {name: data for name, data in self._edited(files, deltas) if data}
            load_kg({**files, **changed}, f"kg/{self.domain}")  # what is written can be read again
            paths = {f"kg/{self.domain}/{name}": data for name, data in changed.items()}
            repo = Repo.open_or_init(self.root)
            edited = [path for path in repo.dirty(sorted(paths)) if path in paths]
            if paths:
                write_files(self.root, paths)
            message += "".join(f"Hand-edited: {path}\n" for path in edited)
            return repo.commit(sorted(paths), message, self.origin.now())

    def _edited(self, files: dict[str, bytes], deltas: list[Delta]) -> Iterator[tuple[str, bytes]]:
        removed, added = net(deltas)
        for name in ("attributes.ttl", "state.ttl", "actions.ttl"):
            old = files[name].decode("utf-8")
            here = [t for t in removed if self._file_of(t) == name]
            new = [t for t in added if self._file_of(t) == name]
            text = patch(old, here, new, f"kg/{self.domain}/{name}") if here or new else old
            yield name, b"" if text == old else text.encode("utf-8")

    def _file_of(self, triple: Triple) -> str:
        _, predicate, value = triple
        if predicate in _ACTION_TERMS or (predicate == RDF.type and value == AB.Action):
            return "actions.ttl"
        return "state.ttl" if self.kg.home_of(predicate) == STATES else "attributes.ttl"


def net(deltas: Iterable[Delta]) -> tuple[list[Triple], list[Triple]]:
    """Fold changes made one after the other into what they come to: removed, added."""
    removed: set[Triple] = set()
    added: set[Triple] = set()
    for delta in deltas:
        removed |= delta.removed - added
        added -= delta.removed
        added |= delta.added - removed
        removed -= delta.added
    return sorted(removed), sorted(added)


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
