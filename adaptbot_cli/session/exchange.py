"""A home's knowledge on a SPARQL server: pulled before it is used, pushed when it is learned.

The workspace stays a whole home of its own. What was learned is committed here first; so a server
that goes away loses nothing, and a later push sends it.
"""

import os
import random
import re
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from rdflib import RDF
from rdflib.term import Node

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Held
from adaptbot_cli.adapters.store.merger import agreed
from adaptbot_cli.adapters.store.reading import fact_files
from adaptbot_cli.adapters.store.trailers import answers, compose, in_short, of_answers
from adaptbot_cli.adapters.store.versions import Versions, facts_of
from adaptbot_cli.core.ask.questions import Question
from adaptbot_cli.core.graph.delta import Delta, net
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.merge import Conflict, Facts, Merge, Side, question
from adaptbot_cli.core.names import normal, variants
from adaptbot_cli.core.turns import Human, Planner, Proposal, Propose
from adaptbot_cli.core.view.provenance import Told
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.session.change import held_by, keeper
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.sync import Table

if TYPE_CHECKING:
    from adaptbot_cli.adapters.store.shared import Fetched, Shadow, SharedGraph

TRIES = 30
"""How often a push is made anew because somebody else was quicker."""
_MOST = 400
"""Facts in one update, more only where they are about one thing."""
_LONGEST = 4
"""Words in a name that is looked for in a request or a plan."""
_NONE: Facts = frozenset()


@dataclass(slots=True)
class Exchange:
    """What came of a pull or push: the change here, the facts sent, questions that are open."""

    came: Delta = field(default_factory=Delta)
    sent: Delta = field(default_factory=Delta)
    open: list[Question] = field(default_factory=list)
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class Served:
    """A home with a graph on a server. `table` settles what only one side can be right about."""

    home: Home
    shared: "SharedGraph"
    shadow: "Shadow"
    table: Table

    @classmethod
    def of(cls, home: Home, human: Human) -> "Served":
        """Return a home's graph on the server that settings or environment name.

        Raises:
            UsageError: they name none.
        """
        from adaptbot_cli.adapters.store.endpoint import endpoint_of
        from adaptbot_cli.adapters.store.shared import Shadow, SharedGraph

        endpoint = endpoint_of(home.workspace.settings, os.environ)
        if endpoint is None:
            raise UsageError(
                "no shared graph is configured: set ADAPTBOT_KG_ENDPOINT, or endpoint below [kg] "
                "in adaptbot.toml (docs/sharing.md)"
            )
        keeper(home)
        shared = SharedGraph.of(endpoint, home.kg.domain, home.workspace.settings)
        repo = Repo.open_or_init(home.workspace.root)
        return cls(home, shared, Shadow.of(repo, shared), Table(human))

    # ------------------------------------------------------------------------------------- pull

    def pull(self, texts: Iterable[str] = (), everything: bool = False) -> Exchange:
        """Fetch what texts name, or everything there is, and merge it into the workspace.

        The first time it is everything, as only then it is known what is not there.

        Raises:
            KnowledgeError: the server cannot be used; nothing has changed then.
        """
        if everything or self.shadow.facts is None:
            return self._merge(self.shared.everything())
        named = sorted({name for text in texts for name in _named(text)})
        kg = self.home.kg
        things: set[Node] = {thing for name in named for thing in kg.find(name)}
        things.update(kg.robots)  # what another one holds is not free
        own = {kind for robot in kg.robots for kind in kg.facts.objects(robot, RDF.type)}
        kinds = [
            k.iri
            for k in kg.domain.classes.values()
            if k.hand or k.iri in own or normal(k.label) in named
        ]
        return self._merge(self.shared.about(things, named, kinds))

    def _merge(self, fetched: "Fetched") -> Exchange:
        held = held_by(self.home)
        here, theirs = self._facts(held), fetched.facts
        ours, base = here, self._base(fetched)
        if fetched.scope is not None:
            ours, base = (_within(facts, fetched.scope) for facts in (ours, base))
        for triple in sorted(fetched.doubled - ours):
            base = frozenset(t for t in base if t[:2] != triple[:2])
            if not any(t[:2] == triple[:2] for t in theirs):
                theirs |= {triple}
        came = Exchange(notes=fetched.notes)

        def ask(conflict: Conflict) -> Side | None:
            domain = self.home.domain
            side = self.table.settle(
                domain, conflict, lambda: question(conflict, held.kg, self._givers(conflict))
            )
            if side is None:
                came.open.append(self.table.said[domain, conflict][1].question)
            return side

        rest = here - ours
        facts = agreed(held, Merge(base | rest, ours | rest, theirs | rest), ask, _refuse)
        if facts is None:
            return came
        came.came = Delta(here - facts, facts - here)
        if came.came:
            found = _last(self.shared.behind(came.came), came.came)
            trailers = [("Source", "pull"), ("Remote", self.shared.endpoint.url)]
            trailers += of_answers(found)
            keeper(self.home).change(came.came, compose("pull: the shared graph", trailers))
            self.home = Home(self.home.workspace, self.home.domain)
        known = self.shadow.facts or _NONE
        known = _NONE if fetched.scope is None else known - _within(known, fetched.scope)
        whole = known | fetched.facts | fetched.doubled
        self.shadow.keep(self.shared, whole, self.shadow.head)
        return came

    def _givers(self, conflict: Conflict) -> tuple[str, str]:
        """Who gave the answers of a conflict, here and there, and when."""
        sides = []
        for delta, given in (
            (Delta(added=conflict.ours), self._since()),
            (Delta(added=conflict.theirs), self.shared.behind(Delta(added=conflict.theirs))),
        ):
            [told] = _last(given, delta)[:1] or [Told(0, "", "")]
            sides.append(", ".join(filter(None, (told.by, told.at[:10]))))
        return sides[0], sides[1] or "the shared graph"

    def _base(self, fetched: "Fetched") -> Facts:
        """What both sides have in common. At first: what the workspace began with, unless the
        server is empty still."""
        if self.shadow.facts is not None:
            return self.shadow.facts
        if not fetched.facts:
            return _NONE
        versions = Versions(self.home.domain, self.shadow.repo)
        first = [commit.sha for commit in self.shadow.repo.log([versions.folder])][-1]
        return self._facts(Held.of(versions.files(first), versions.folder))

    # ------------------------------------------------------------------------------------- push

    def push(self) -> Exchange:
        """Send what was learned here as one update, which is made only if what it rests on is as
        it was; else that is fetched and merged first.

        Raises:
            KnowledgeError: the server cannot be used; what was learned stays in the workspace.
        """
        came, sent, misses = Delta(), Delta(), 0
        while misses < TRIES:
            delta = self._unsent()
            if not self.shadow.facts:
                fetched = self.pull(everything=True)
            else:
                touched = {node for s, _, o in delta.removed | delta.added for node in (s, o)}
                both = self._facts(held_by(self.home)) | self.shadow.facts
                things = touched & {s for s, _, _ in both} - {*self.home.kg.domain.classes}
                fetched = self._merge(self.shared.about(things)) if delta else Exchange()
            if fetched.open:
                return fetched
            came, delta = net([came, fetched.came]), self._unsent()
            if not delta:
                if sent:
                    known = self.shadow.facts or _NONE
                    self.shadow.keep(self.shared, known, self.shadow.repo.head())
                return Exchange(came, sent)
            known = self.shadow.facts or _NONE
            if self.shared.write(delta, known, of_answers(_last(self._since(), delta))):
                known = (known - delta.removed) | delta.added
                self.shadow.keep(self.shared, known, self.shadow.head)
                sent = net([sent, delta])
            else:
                misses += 1
                time.sleep(random.uniform(0, 0.05 * misses))
        raise KnowledgeError(
            "the shared graph has changed each time before this could be sent; it is committed in "
            "the workspace: adaptbot kg push sends it"
        )

    def _unsent(self) -> Delta:
        """What the server does not know yet; of much the first things, as servers bear no update
        of any length."""
        ours, known = self._facts(held_by(self.home)), self.shadow.facts or _NONE
        last = sorted(ours ^ known)[:_MOST][-1:]
        now = {t for t in ours ^ known if (t[0],) <= (last[0][0],)} if last else set()
        return Delta(known & now, ours & now)

    def _since(self) -> list[Told]:
        """The answers of the commits that the server does not know, the oldest first; a commit
        without any is told by its subject."""
        versions = Versions(self.home.domain, self.shadow.repo)
        found: list[Told] = []
        for commit in self.shadow.repo.log([versions.folder], self.shadow.head):
            own = answers(commit.trailers)
            if not own and dict(commit.trailers).get("Source") != "pull":
                taught = versions.taught_by(commit)
                if taught.first:  # the pack as it came is nobody's answer
                    continue
                one = versions.chapter(taught)
                facts = in_short(one.changes.delta)
                own = (Told(0, commit.subject, "", one.by(), one.origin.when, facts),)
            found = [*own, *found]
        return found

    def _facts(self, held: Held) -> Facts:
        return facts_of({name: held.files[name] for name in fact_files(held.files)})


def _last(answers: Sequence[Told], delta: Delta) -> list[Told]:
    """The answers behind a change: of each fact the last that tells of it."""
    left, found = set(in_short(delta)), list[Told]()
    for told in reversed(answers):
        if facts := tuple(fact for fact in told.facts if fact in left):
            left.difference_update(facts)
            found.append(replace(told, facts=facts))
    return found


def _within(facts: Facts, scope: frozenset[Node]) -> Facts:
    """Facts about the things of a scope, and that something is absent."""
    return frozenset(t for t in facts if t[0] in scope)


def _named(text: str) -> set[str]:
    """What may be names in a text: its words and what several make together, as singulars too."""
    words = re.findall(r"[^\W_]+", text.lower())
    several = (
        "_".join(words[n : n + m]) for m in range(1, _LONGEST + 1) for n in range(len(words))
    )
    return {variant for name in several for variant in (name, *variants(name))}


def _refuse(faults: Iterable[Fault]) -> None:
    text = "; ".join(map(str, faults))
    raise KnowledgeError(f"nothing of the shared graph was taken: {text}")


@dataclass(slots=True)
class Sharing:
    """A run on a home that is shared: what its request and plans name is fetched before it is
    used, what was learned is sent at the end. A server that is away is told once by `tell`; the run
    goes on with what is known here. It is a planner around the run's own.
    """

    served: Served
    tell: Callable[[str], None]
    inner: Planner | None = None
    learn: Callable[[Delta], None] | None = None
    away: bool = False

    @property
    def name(self) -> str:
        """The name of the run's own planner."""
        return self.inner.name if self.inner else ""

    def propose(self, turn: Propose) -> Proposal:
        """Return the plan of the run's own planner, with what it names fetched."""
        assert self.inner is not None
        proposal = self.inner.propose(turn)
        came = self.fetch(proposal.text)
        if self.learn is not None and came:
            self.learn(came)
        return proposal

    def fetch(self, text: str) -> Delta:
        """Pull what a text names; return what that changed here."""
        found = self._unless_away(lambda: self.served.pull([text]))
        return found.came if found else Delta()

    def send(self) -> None:
        """Push what was learned."""
        found = self._unless_away(self.served.push)
        if found and found.open:
            self.tell(
                "another answer is in the shared graph; adaptbot kg push settles which stands"
            )

    def _unless_away(self, work: Callable[[], Exchange]) -> Exchange | None:
        if self.away:
            return None
        try:
            return work()
        except KnowledgeError as error:
            self.away = True
            self.tell(
                f"{error}. What is known and learned here stays here: adaptbot kg push sends it"
            )
            return None
