"""Shares a home's knowledge by git: fetch, merge by facts, settle conflicts, push."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.merger import Dispute, Merger
from adaptbot_cli.adapters.store.trailers import of_lessons
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Question
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.merge import Conflict, Side, side_of
from adaptbot_cli.core.turns import Human
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.author import now, person
from adaptbot_cli.session.change import commit_edits, signed
from adaptbot_cli.session.home import Home
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
class Table:
    """Puts conflicts to a person, each once, and remembers what was said."""

    human: Human
    said: dict[tuple[str, Conflict], tuple[Side | None, Lesson]] = field(default_factory=dict)

    def settle(self, domain: str, conflict: Conflict, asked: Callable[[], Question]) -> Side | None:
        """Return which side of a conflict stands; None where that is to stay open."""
        if (domain, conflict) not in self.said:
            question = asked()
            answer = self.human.ask(question)
            side = side_of(answer, question)
            change = Delta(conflict.theirs - conflict.ours, conflict.ours - conflict.theirs)
            text = next((c.label for c in question.choices if c.value == answer.value), "")
            lesson = Lesson(
                change.inverse if side == "theirs" else change,
                question,
                replace(answer, by=answer.by or person()),
                f"{question.about}: {question.label} {text}",
            )
            self.said[domain, conflict] = side, lesson
        return self.said[domain, conflict][0]

    @property
    def settled(self) -> tuple[Lesson, ...]:
        """What was settled."""
        return tuple(lesson for side, lesson in self.said.values() if side)


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
    table, before = Table(human), repo.head()

    def settle(dispute: Dispute) -> Side | None:
        return table.settle(dispute.domain, dispute.conflict, lambda: dispute.question)

    notes: tuple[str, ...] = ()
    for _ in range(TRIES):
        branch, theirs = link.fetch()
        ours = repo.head()
        if theirs is not None and not (ours and repo.leads_to(theirs, ours)):
            merger = Merger(repo, link.name, ours, theirs, settle)
            contents = merger.contents()
            if merger.open:
                return Synced(before, ours, open=tuple(each.question for each in merger.open))
            trailers = [("Source", "sync"), ("Remote", link.name), *of_lessons(table.settled)]
            message = signed(f"sync: {link.name}", *trailers)
            with repo.writing():
                if repo.head() != ours:
                    continue
                if dirty := repo.dirty(list(contents)):
                    raise KnowledgeError(
                        f"{dirty[0]} is edited and not committed, and {link.name} has changed it "
                        "too; commit it with git, or take the edit back, and try again"
                    )
                repo.commit(contents, message, now(), merging=theirs)
            notes = tuple(merger.notes)
        head = repo.head()
        if head is None or head == theirs or link.push(branch, head, theirs):
            return Synced(before, head, head not in (None, theirs), (), table.settled, notes)
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
    return last[0], [each.question for each in merger.open if each.domain == domain]
