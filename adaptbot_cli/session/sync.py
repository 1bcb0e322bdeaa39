"""Shares a home's knowledge by git: fetch, merge by facts, settle conflicts, push."""

from contextlib import suppress
from dataclasses import dataclass, field, replace

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.merger import Dispute, Merger
from adaptbot_cli.adapters.store.trailers import of_lessons
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.merging import Side, question, side_of
from adaptbot_cli.core.provenance import Origin
from adaptbot_cli.core.questions import Question
from adaptbot_cli.core.turns import Human
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.build import person, started
from adaptbot_cli.session.change import commit_edits, signed
from adaptbot_cli.session.knowledge import Home
from adaptbot_cli.workspace import Workspace

TRIES = 10
"""How often a merge is made anew because somebody else was quicker."""


@dataclass(frozen=True, slots=True)
class Synced:
    """What came of a sync: the revision `before` and now, whether anything was sent, what was
    settled; or the questions that are open, and then nothing has changed."""

    before: str | None
    revision: str | None
    sent: bool = False
    open: tuple[Question, ...] = ()
    settled: tuple[Lesson, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class _Table:
    """Puts conflicts to a person, each once, and remembers what was said."""

    human: Human
    lessons: dict[tuple[object, ...], tuple[Side | None, Lesson]] = field(default_factory=dict)

    def settle(self, dispute: Dispute) -> Side | None:
        conflict = dispute.conflict
        key = (dispute.domain, *conflict.key, conflict.ours, conflict.theirs)
        if key not in self.lessons:
            asked = asked_of(dispute)
            answer = self.human.ask(asked)
            side = side_of(answer, asked)
            stands, falls = conflict.ours, conflict.theirs
            if side == "theirs":
                stands, falls = falls, stands
            text = next((c.label for c in asked.choices if c.value == answer.value), "")
            lesson = Lesson(
                Delta(falls - stands, stands - falls),
                asked,
                replace(answer, by=answer.by or person()),
                f"{asked.about}: {asked.label} {text}",
            )
            self.lessons[key] = side, lesson
        return self.lessons[key][0]


def asked_of(dispute: Dispute) -> Question:
    """Return the question that a dispute puts, with who gave each answer."""
    return question(dispute.conflict, dispute.held.kg, (_who(dispute.ours), _who(dispute.theirs)))


def _who(origin: Origin) -> str:
    parts = (origin.by or origin.author, (origin.at or origin.when)[:10])
    return ", ".join(part for part in parts if part)


def sync(workspace: Workspace, remote: str, human: Human) -> Synced:
    """Merge what a repository elsewhere knows with what is known here, and send the result there.

    `human` settles what only one side can be right about; where one conflict stays open nothing is
    changed on either side.

    Raises:
        UsageError: the repository is named in a way that is not taken.
        KnowledgeError: it cannot be reached, or holds what cannot be taken; nothing has changed.
    """
    from adaptbot_cli.adapters.store.remote import Remote

    repo = Repo.open_or_init(workspace.root)
    link = Remote.of(repo, remote)
    for domain in workspace.domains():
        if repo.head() and workspace.has(domain):  # hand edits first, as every writer does
            commit_edits(Home(workspace, domain), f"hand edit: before a sync, {domain}")
    table, before = _Table(human), repo.head()
    notes: tuple[str, ...] = ()
    for _ in range(TRIES):
        branch, theirs = link.fetch()
        ours = repo.head()
        if theirs is not None and not (ours and repo.leads_to(theirs, ours)):
            merger = Merger(repo, link.name, ours, theirs, table.settle)
            contents = merger.contents()
            if merger.open:
                return Synced(before, ours, open=tuple(map(asked_of, merger.open)))
            settled = [lesson for side, lesson in table.lessons.values() if side]
            trailers = [("Source", "sync"), ("Remote", link.name), *of_lessons(settled)]
            message = signed(f"sync: {link.name}", *trailers)
            with repo.writing():
                if repo.head() != ours:
                    continue
                if dirty := repo.dirty(list(contents)):
                    raise KnowledgeError(
                        f"{dirty[0]} is edited and not committed, and {link.name} has changed it "
                        "too; commit it with git, or take the edit back, and try again"
                    )
                repo.commit(contents, message, started(), merging=theirs)
            notes = tuple(merger.notes)
        head = repo.head()
        if head is None or head == theirs or link.push(branch, head, theirs):
            lessons = tuple(lesson for side, lesson in table.lessons.values() if side)
            return Synced(before, head, head not in (None, theirs), (), lessons, notes)
    raise KnowledgeError(
        f"{link.name} has changed each time before the merge could be sent; what it knew is "
        "merged here, the rest is sent by the next `kg sync`"
    )


def disputes(workspace: Workspace, domain: str) -> tuple[str, list[Question]]:
    """Return the remote that was last fetched and the questions of a domain that its merge waits
    for. Raises KnowledgeError."""
    from adaptbot_cli.adapters.store.remote import last_fetched

    repo = Repo.open(workspace.root) if workspace.root.is_dir() else None
    last = last_fetched(repo) if repo is not None else None
    head = repo.head() if repo is not None else None
    if repo is None or last is None or head is None or repo.leads_to(last[1], head):
        return "", []
    merger = Merger(repo, last[0], head, last[1], lambda dispute: None)
    with suppress(KnowledgeError):  # what cannot be taken has no question; the next sync says why
        merger.contents()
    return last[0], [asked_of(each) for each in merger.open if each.domain == domain]
