"""Keeps what was learned: edits the workspace's Turtle files and commits them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from adaptbot_cli.adapters.store.committing import commit, recovered
from adaptbot_cli.adapters.store.files import lock
from adaptbot_cli.adapters.store.handedits import plan
from adaptbot_cli.adapters.store.held import Held
from adaptbot_cli.adapters.store.origins import origin_of
from adaptbot_cli.adapters.store.telling import Origin, lessons_message, refusal, state_message
from adaptbot_cli.core.delta import Delta, net
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.turns import Keep, Kept
from adaptbot_cli.errors import KnowledgeError

__all__ = ["Keeper", "Origin"]


@dataclass(slots=True)
class Keeper:
    """The store of a domain in a workspace that `start` has made ready.

    Whatever is committed is judged on the files as they are at that moment, not on the graph that
    the run started from; they are read again only if they have changed.
    """

    root: Path
    domain: str
    origin: Origin
    _held: Held | None = None

    @property
    def _where(self) -> str:
        return f"kg/{self.domain}"

    def keep(self, turn: Keep) -> Kept:
        """Commit lessons, with the question and answer behind every fact (DESIGN, 7).

        Raises:
            KnowledgeError: the files cannot be written or committed, no longer make a domain, or
                would hold what the domain does not allow; nothing has changed then.
        """
        told = f" {self.origin.transcript}" if self.origin.transcript else ""
        hint = f"the answers are in the transcript{told}"
        change = net(lesson.delta for lesson in turn.lessons)
        return Kept(self.change(change, lessons_message(turn, self.origin), turn.lessons, hint))

    def trace(self, fact: str) -> str:
        """Return where a fact such as `onion IsLiquid true` comes from. Raises KnowledgeError."""
        return origin_of(self.root, self.domain, fact)

    def apply(self, task: str, deltas: Iterable[Delta]) -> str | None:
        """Commit the state that an executed plan leaves. Raises KnowledgeError as `keep` does."""
        message = state_message(task, self.origin)
        return self.change(net(deltas), message, hint="what was learned has been kept")

    def change(
        self, change: Delta, message: str, lessons: Sequence[Lesson] = (), hint: str = ""
    ) -> str | None:
        """Commit a change of facts if the files, as they are now, allow it; return the revision.

        A change that is there already makes no commit. `lessons` are what it comes from, named
        where it is refused; `hint` ends the refusal.

        Raises:
            KnowledgeError: as `keep` does.
        """
        with lock(self.root):
            repo = recovered(self.root)
            held = self._held = Held.read(self.root / self._where, self._where, self._held)
            files = held.after(change)
            broken = held.new_faults(change, files) if files else []
            if broken:
                raise KnowledgeError(refusal(self._where, broken, lessons, hint))
            if not files:
                return repo.head()
            planned, edits = plan(repo, held, change, files)
            message += "".join(f"Hand-edited: {path}\n" for path in edits)
            revision = commit(self.root, repo, planned, message, self.origin.now())
            held.learn(change, files)
            return revision
