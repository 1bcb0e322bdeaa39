"""What is known of a home, by whom it was taught, and how it changed: reading only."""

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.adapters.store.turtle import engine_term
from adaptbot_cli.adapters.store.versions import (
    PACK,
    UNCOMMITTED,
    CommitDelta,
    facts_of,
)
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, Triple, local
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.view import descriptions
from adaptbot_cli.core.view import facts as view
from adaptbot_cli.core.view.changes import Changes, Words
from adaptbot_cli.core.view.provenance import Chapter, Origin, Turnover
from adaptbot_cli.errors import UsageError
from adaptbot_cli.session.home import Home

WORKING = "the files"
"""How the version on disk is called, which may hold edits that are not committed."""


def differences(home: Home, a: str | None, b: str | None) -> tuple[Changes, str, str, Words]:
    """Return what changed from one version to another, how both are called, and words for it.

    Without `a` and `b`: from the last commit to the files if they are edited, else what the last
    commit changed. With `a` alone: from it to the files.

    Raises:
        KnowledgeError: there is no such version.
    """
    versions = home.needed()
    files_a: Mapping[str, bytes]
    last = next(versions.repo.log([versions.folder]), None)
    if a is None and last is not None and not versions.edited():
        a, b = f"{last.sha[:7]}~1", last.sha[:7]
        files_a = versions.files(last.parents[0]) if last.parents else {}
    else:
        a = a or "HEAD"
        files_a = versions.files(a)
    files_b = versions.files(b)
    changes = versions.between(files_a, files_b)
    words = home.words
    nodes = {node for t in changes.delta.removed | changes.delta.added for node in (t[0], t[2])}
    nodes -= {home.kg.domain.iri, *home.kg.domain.classes}
    if any(node not in words.names for node in nodes if isinstance(node, URIRef)):
        words = words.also(facts_of(files_a)).also(facts_of(files_b))
    return changes, a, b or WORKING, words


_RUN = re.compile(r"\d{8}T\d")
"""How the id of a run begins, and no thing's name."""


def chapters(home: Home, name: str | None) -> Iterator[Chapter]:
    """Give the commits that taught something, newest first; those about a thing or of a run, if one
    is named.

    Raises:
        UsageError: nothing is or was ever called so.
    """
    versions = home.versions
    if versions is None:
        return
    if name is None or _RUN.match(name):
        from adaptbot_cli.session.past_runs import find_run

        run = find_run(home.workspace, name).stem if name else None
        every = map(versions.chapter, versions.taught())
        yield from (each for each in every if run in (None, Path(each.origin.transcript).stem))
        return
    wanted = known_as(home, name)
    # What is gone by now is found by the name it had.
    label = str(engine_term(Literal(normal(name))))
    named = versions.taught(label)
    wanted |= {t[0] for taught in named for t in _triples(taught) if concerns(t, frozenset(), name)}
    wanted -= {home.kg.domain.iri}
    found = [
        taught
        for taught in versions.taught(label, name, *map(str, wanted))
        if any(concerns(triple, wanted, name) for triple in _triples(taught))
        or any(entry.name == name for entry in taught.changes.entries)
    ]
    if not found and not wanted:
        raise UsageError(f"nothing is or was called {name}{near_it(home.kg, name)}")
    yield from map(versions.chapter, found)


def _triples(taught: CommitDelta) -> frozenset[Triple]:
    delta = taught.changes.delta
    return delta.removed | delta.added


def known_as(home: Home, name: str) -> frozenset[Node]:
    """Return the things and actions that bear a name now."""
    found: set[Node] = set(view.called(home.kg, name))
    action = home.kg.domain.actions.get(normal(name))
    return frozenset(found | ({action.iri} if action else set()))


def concerns(triple: Triple, wanted: frozenset[Node], name: str) -> bool:
    """Tell whether a fact is about one of some things, names one, or holds a name itself."""
    subject, _, value = triple
    if subject in wanted or value in wanted:
        return True
    return isinstance(value, Literal) and str(value) == normal(name)


@dataclass(frozen=True, slots=True)
class Why:
    """Where the facts about something come from; `history` of one property, newest first."""

    name: str
    facts: Mapping[Triple, Origin]
    history: Sequence[Turnover] = ()


def why(home: Home, name: str, prop: str = "") -> Why:
    """Return where the facts about a thing, an action or an absence come from.

    With `prop` (a predicate's short name or label) only that property's, with all that came and
    went of it.

    Raises:
        UsageError: nothing is called so, or has no such property.
    """
    wanted = known_as(home, name)
    facts = {t for thing in wanted for t in home.matching(thing)} or _facts_said_of(home, name)
    if not facts and not wanted:
        for cut in [n for n, char in enumerate(name) if char == " " and not prop]:
            if known_as(home, name[:cut]):
                return why(home, name[:cut], name[cut:].strip())
        action = descriptions.action_called(home.kg, name)
        if action is not None:
            return why(home, action.name, prop)
        raise UsageError(_not_taught(home, name))
    if prop:
        facts = {t for t in facts if called(prop, t[1], home.words)}
    pairs = {(t[0], t[1]) for t in facts}
    if prop and not pairs:
        pairs = {
            (s, p) for s in wanted for p in home.kg.domain.properties if called(prop, p, home.words)
        }
        if not pairs:
            there = sorted({local(p) for thing in wanted for _, p, _ in home.matching(thing)})
            has = ", ".join(there) or "none yet"
            raise UsageError(f"there is no property {prop}; {name} has {has}")
    if home.versions is None:
        return Why(name, {t: PACK if t in home.pack else UNCOMMITTED for t in facts})
    past = [t for pair in (sorted(pairs) if prop else ())
            for t in home.versions.history(*pair, home.pack)]  # fmt: skip
    return Why(name, home.versions.origins(facts, home.pack), past)


def _facts_said_of(home: Home, name: str) -> set[Triple]:
    """The facts by which a name was said to be not here, not possible, or an action's with an
    argument that is always the same."""
    entries = (
        t for p in (AB.absentItem, AB.absentAction, AB.alias) for t in home.matching(None, p)
    )
    found = {t for t in entries if str(t[2]) == normal(name)}
    parts = {t[0] for t in found if t[1] == AB.alias}
    return found | {t for t in home.facts if t[0] in parts or t[2] in parts} if parts else found


def called(prop: str, predicate: Node, words: Words) -> bool:
    """Tell whether a predicate bears a name: its short name or its label."""
    return normal(prop) in (normal(local(predicate)), normal(words.label(predicate)))


def _not_taught(home: Home, name: str) -> str:
    """Say that nobody taught anything of that name: it is something else, or nothing."""
    task = descriptions.task_called(home.kg, name)
    kind = view.kind_called(home.kg, name)
    if task is None and kind is None:
        return f"nothing is called {name}{near_it(home.kg, name)}"
    what, file = ("task", "tasks.ttl") if task is not None else ("class", "domain.ttl")
    return f"{name} is a {what}, as {file} has it; see adaptbot kg show {shlex.quote(name)}"


def near_it(kg: Kg, name: str) -> str:
    """Return a hint that names what a name may have been meant for, "" if nothing is near."""
    near = view.near(kg, name)
    return f"; near it: {', '.join(near)}" if near else ""
