"""Who taught each fact, read from the workspace's commits."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from rdflib.term import Node

from adaptbot_cli.adapters.store.git import Commit
from adaptbot_cli.adapters.store.versions import Taught, Versions
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.provenance import (
    Chapter,
    Origin,
    Turnover,
    answer_id,
    answers,
    of_answer,
    short,
    trailer,
)
from adaptbot_cli.core.terms import Triple
from adaptbot_cli.errors import KnowledgeError

PACK = Origin("pack")
UNCOMMITTED = Origin("uncommitted")


def origins(
    versions: Versions, facts: Iterable[Triple], pack: frozenset[Triple]
) -> dict[Triple, Origin]:
    """Return where facts of the working files come from: the last commit that added each.

    `pack` are the facts that the bundled domain came with. Raises KnowledgeError.
    """
    wanted = set(facts)
    found: dict[Triple, Origin] = {}
    head = versions.head()
    kept = versions.facts(versions.files(head)) if head else frozenset()
    found |= dict.fromkeys(wanted - kept, UNCOMMITTED)
    wanted &= kept
    for taught in versions.taught() if wanted else ():
        here = wanted & taught.changes.delta.added
        found |= {triple: origin(taught, "+", triple, pack) for triple in here}
        wanted -= here
        if not wanted:
            break
    return found | {triple: Origin("start") for triple in wanted}


def history(
    versions: Versions, subject: Node, predicate: Node, pack: frozenset[Triple]
) -> Iterator[Turnover]:
    """Give what came and went of one predicate of one thing, newest first."""
    for taught in versions.taught():
        delta = taught.changes.delta
        for sign, triples in (("+", delta.added), ("-", delta.removed)):
            for triple in sorted(t for t in triples if t[:2] == (subject, predicate)):
                yield Turnover(sign, triple, origin(taught, sign, triple, pack))


def origin(taught: Taught, sign: str, triple: Triple, pack: frozenset[Triple]) -> Origin:
    """Return why a commit added or removed a fact."""
    commit = taught.commit
    about = of_commit(commit)
    for told in answers(commit.trailers):
        if short(sign, triple) in told.facts:
            return replace(
                about,
                source="answer",
                answer=answer_id(commit.sha, told.number),
                question=told.question,
                said=told.said,
                by=told.by or about.by,
                at=told.at,
            )
    if taught.first and not commit.trailers:
        return PACK if triple in pack else replace(about, source="start")
    if about.source == "answer":
        # A run takes along what was edited by hand meanwhile; no answer tells it.
        return replace(about, source="hand edit", task="", planner="", transcript="")
    return about


def of_commit(commit: Commit) -> Origin:
    """Return what a commit tells of itself: who, when, for which task, with which model."""
    source = trailer(commit.trailers, "Source")
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
        trailer(commit.trailers, "Task"),
        trailer(commit.trailers, "Planner"),
        trailer(commit.trailers, "Transcript"),
        by=trailer(commit.trailers, "By"),
    )


def answered(versions: Versions, name: str) -> tuple[Taught, Delta, str]:
    """Return the commit of an answer's id such as `3fa2b1c.2`, what it taught, its question.

    Raises:
        KnowledgeError: there is no such answer.
    """
    revision, _, number = name.rpartition(".")
    try:
        taught = commit_of(versions, revision) if number.isdecimal() else None
    except KnowledgeError:
        taught = None
    if taught is not None:
        for told in answers(taught.commit.trailers):
            if told.number == int(number):
                return taught, of_answer(told, taught.changes.delta), told.question
    raise KnowledgeError(f'there is no answer "{name}"; `adaptbot kg log` tells their ids')


def commit_of(versions: Versions, revision: str) -> Taught | None:
    """Return a commit with what it changed; None if it changed nothing of this domain.

    Raises:
        KnowledgeError: there is no such revision.
    """
    sha = versions.repo.resolve(revision)
    return next((taught for taught in versions.taught() if taught.commit.sha == sha), None)


def chapter(taught: Taught) -> Chapter:
    """Return what a commit taught as people read it."""
    commit = taught.commit
    told = answers(commit.trailers)
    lines = [line.strip() for line in commit.body.splitlines() if line.strip()]
    if len(lines) != len(told):
        lines = ["; ".join(answer.facts) for answer in told]
    start = bool(taught.first) and not commit.trailers
    return Chapter(of_commit(commit), told, tuple(lines), taught.changes, start)
