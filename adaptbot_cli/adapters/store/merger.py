"""Merges a commit from elsewhere into a workspace: facts by facts, all other files by lines.

What comes in is a stranger's: plain files only, and each domain as sound afterwards as what a
person teaches here.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Held, faults_of
from adaptbot_cli.adapters.store.reading import fact_files, graph_of
from adaptbot_cli.adapters.store.versions import Versions, facts_of, read
from adaptbot_cli.core.ask.questions import Question
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.merge import (
    Conflict,
    Facts,
    Key,
    Merge,
    Side,
    conflicts,
    of_faults,
    question,
)
from adaptbot_cli.core.view.provenance import Origin
from adaptbot_cli.errors import KnowledgeError

Files = Mapping[str, bytes]
Tree = Mapping[str, str]
"""The blobs of a commit's files, by path."""
_MOST = 3
"""How many faults are told."""


@dataclass(frozen=True, slots=True)
class Dispute:
    """A conflict in a domain, and the question that it puts, with who gave each side's answer."""

    domain: str
    conflict: Conflict
    question: Question


Settle = Callable[[Dispute], Side | None]


@dataclass(slots=True)
class Merger:
    """Merges the commit `theirs` of a repository that is called `name` into `ours`.

    `settle` is asked which side of a conflict stands, and says None where that is to stay open.
    `open` are those, `notes` sentences about what was not taken.
    """

    repo: Repo
    name: str
    ours: str | None
    theirs: str
    settle: Settle
    open: list[Dispute] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _at: dict[str | None, dict[str, str]] = field(default_factory=dict)
    _one_base: bool = False

    def contents(self) -> dict[str, bytes | None]:
        """Return the files that differ from ours in the merge; None for one that is gone.

        Raises:
            KnowledgeError: what is there is none that can be taken; nothing is to be changed then.
        """
        ours, theirs = self._tree(self.ours), self._tree(self.theirs)
        bases = self.repo.bases(self.ours, self.theirs) if self.ours else []
        # With several, files that are no facts are merged from the first of them.
        base = self._tree(bases[0]) if bases else {}
        self._one_base = len(bases) == 1
        found: dict[str, bytes | None] = {}
        domains = {_domain(p) for p in (*ours, *theirs) if ours.get(p) != theirs.get(p)} - {""}
        for domain in sorted(domains):
            merged = self._merged_domain(domain, base, ours, theirs)
            found |= {f"kg/{domain}/{name}": data for name, data in merged.items()}
        for path in sorted({*ours, *theirs} - found.keys()):
            if not _domain(path):
                found[path] = self._file(path, base, ours, theirs)
        return {p: d for p, d in found.items() if d != self._read(ours.get(p))}

    def _merged_domain(
        self, domain: str, base: Tree, ours: Tree, theirs: Tree
    ) -> dict[str, bytes | None]:
        mine, other = (self._files(domain, side) for side in (ours, theirs))
        where = f"kg/{domain}"
        if not mine or not other:
            if other and not any(path.startswith(f"{where}/") for path in base):
                self._refuse(faults_of(Held.of(other, f"{self.name}: {where}"), None))
                return dict(other)
            return dict(mine)
        held = Held.of(mine, where)
        self._refuse(faults_of(Held.of(other, f"{self.name}: {where}"), held))
        for side, its in ((ours, other), (theirs, mine)):  # who has changed nothing has no say
            if self._one_base and self._files(domain, side) == self._files(domain, base):
                return {**dict.fromkeys(mine), **its}
        texts = {
            name: self._file(f"{where}/{name}", base, ours, theirs)
            for name in sorted({*mine, *other})
            if graph_of(name) is None
        }
        # If one side has divided its files of facts, the merge has them so.
        divided = max(mine, other, key=lambda files: len(fact_files(files)))
        start = {name: divided[name] for name in fact_files(divided)}
        start |= {name: data for name, data in texts.items() if data is not None}
        merge = Merge(self._base(domain, self.ours, self.theirs), _facts(mine), _facts(other))
        return {**dict.fromkeys(mine), **self._settled(domain, Held.of(start, where), held, merge)}

    def _settled(self, domain: str, start: Held, ours: Held, merge: Merge) -> dict[str, bytes]:
        """The files of a domain with the merged facts, once every conflict is settled."""
        versions = Versions(domain, self.repo)

        def who(conflict: Conflict, head: str | None, since: str | None) -> str:
            about = conflict.ours ^ conflict.theirs
            origin = versions.changed(about, head, since) if head and since else Origin("")
            parts = (origin.by or origin.author, (origin.at or origin.when)[:10])
            return ", ".join(part for part in parts if part)

        def ask(conflict: Conflict) -> Side | None:
            mine = who(conflict, self.ours, self.theirs)
            given = mine, who(conflict, self.theirs, self.ours)
            dispute = Dispute(domain, conflict, question(conflict, ours.kg, given))
            side = self.settle(dispute)
            if side is None:
                self.open.append(dispute)
            return side

        facts = agreed(start, merge, ask, self._refuse)
        if facts is None:
            return {}
        files = {**start.files, **start.after(_delta(start, facts))}
        self._refuse(faults_of(Held.of(files, ours.where), ours))
        return files

    def _file(self, path: str, base: Tree, ours: Tree, theirs: Tree) -> bytes | None:
        """A file in the merge, None if it is gone: the side that has changed it, else as git would
        merge it. Of a pack's single facts are no change; one that is no domain's stays as ours
        where git could not merge it.
        """
        blobs = [side.get(path) for side in (base, ours, theirs)]
        is_pack, name = _domain(path), PurePosixPath(path).name
        before, mine, other = (
            read(self.repo.blob(blob), name, path).entries if is_pack and blob else blob
            for blob in blobs
        )
        if other in (before, mine):
            return self._read(blobs[1])
        if mine == before:
            return self._read(blobs[2])
        merged = self.repo.merged(*blobs) if is_pack or (mine and other) else None
        if merged is None and is_pack:
            raise KnowledgeError(
                f"{path} was changed here and at {self.name} in the same lines; merge that file "
                f"with git: `git -C {self.repo.root} merge {self.theirs[:10]}`."
            )
        if merged is None:
            self.notes.append(f"{path} differs at {self.name} and stays as it is here")
            return self._read(blobs[1])
        return merged

    def _base(self, domain: str, one: str | None, other: str) -> Facts:
        """What two commits have in common of a domain's facts: those of the last common commit, of
        several such merged; without one what both began with."""
        bases = self.repo.bases(one, other) if one else []
        if not bases:
            first = (self._first(domain, head) for head in (one, other) if head)
            return frozenset.intersection(*first)
        last, found = bases[0], self._facts_at(domain, bases[0])
        for each in bases[1:]:
            common = self._base(domain, last, each)
            last, found = each, Merge(common, found, self._facts_at(domain, each)).facts
        return found

    def _first(self, domain: str, head: str) -> Facts:
        commits = [commit.sha for commit in self.repo.log([f"kg/{domain}"], head=head)]
        return self._facts_at(domain, commits[-1])

    def _facts_at(self, domain: str, sha: str) -> Facts:
        return _facts(self._files(domain, self._tree(sha)))

    def _tree(self, sha: str | None) -> dict[str, str]:
        if sha not in self._at:
            self._at[sha] = self.repo.plain_files(sha) if sha else {}
        return self._at[sha]

    def _files(self, domain: str, tree: Tree) -> dict[str, bytes]:
        paths = (path for path in tree if _domain(path) == domain)
        below = f"kg/{domain}/"
        return {path.removeprefix(below): self.repo.blob(tree[path]) for path in paths}

    def _read(self, blob: str | None) -> bytes | None:
        return None if blob is None else self.repo.blob(blob)

    def _refuse(self, faults: Iterable[Fault]) -> None:
        lines = [*map(str, faults)]
        if lines:
            more = f"; and {len(lines) - _MOST} more" if len(lines) > _MOST else ""
            raise KnowledgeError(
                f"nothing of {self.name} was taken: {'; '.join(lines[:_MOST])}{more}. Correct it "
                "there, or take it back there, and try again."
            )


def agreed(
    start: Held,
    merge: Merge,
    ask: Callable[[Conflict], Side | None],
    refuse: Callable[[list[Fault]], None],
) -> Facts | None:
    """Return the merged facts when every conflict is settled, None where one stays open.

    `start` are the files that they are to be written into. All conflicts of a round are asked;
    `refuse` is called where what was chosen cannot stand beside the rest.
    """
    facts, asked = merge.facts, set[Key]()
    new: Sequence[Conflict] = conflicts(merge, start.kg.domain)
    while True:
        sides: list[Side | None] = []
        for conflict in new:
            if conflict.key in asked:
                name = start.kg.name(conflict.about)
                refuse([Fault(f"what was chosen of {name} cannot stand beside the rest")])
            asked.add(conflict.key)
            sides.append(ask(conflict))
            facts = conflict.settled(facts, sides[-1] or "ours")
        if None in sides:
            return None
        delta = _delta(start, facts)
        new = of_faults(start.new_faults(delta, start.after(delta)), merge)
        if not new:
            return facts


def _delta(held: Held, facts: Facts) -> Delta:
    now = _facts(held.files)
    return Delta(now - facts, facts - now)


def _facts(files: Files) -> Facts:
    names = (*fact_files(files), *({"actions.ttl"} & files.keys()))
    return facts_of({name: files[name] for name in names})


def _domain(path: str) -> str:
    """The domain whose file this is, "" if it is none's."""
    parts = PurePosixPath(path).parts
    inside = len(parts) == 3 or (len(parts) == 4 and graph_of("/".join(parts[2:])) is not None)
    return parts[1] if inside and parts[0] == "kg" and path.endswith(".ttl") else ""
