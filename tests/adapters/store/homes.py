"""A kitchen's workspace, and small things to learn in it."""

from datetime import UTC, datetime
from functools import partial
from pathlib import Path

from rdflib import RDF, Literal, URIRef

from adaptbot_cli.adapters.store.keeper import CommitSource, Keeper, WorkspaceStart, start
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Answer, Question
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Keep
from adaptbot_cli.workspace import Workspace

EX = "http://example.org/"
ORIGIN = CommitSource("plan library", "t.yaml", lambda: datetime(2025, 1, 1, tzinfo=UTC))


def ex(name: str) -> URIRef:
    return URIRef(EX + name)


def begun(root: Path) -> WorkspaceStart:
    """Begin a run."""
    first = partial(Workspace(root).first_files, "kitchen")
    return start(root, "kitchen", first, ORIGIN.now)


def keeper(root: Path) -> Keeper:
    """Return the keeper of a run that has begun."""
    begun(root)
    return Keeper(root, "kitchen", ORIGIN)


def learned(*triples: Triple, removed: frozenset[Triple] = frozenset()) -> Keep:
    """Return the turn that keeps these facts."""
    question = Question("existence", "leek", "Is there leek?")
    delta = Delta(removed, frozenset(triples))
    lesson = Lesson(delta, question, Answer("exists"), "there is leek")
    return Keep(Task("soup", ()), (lesson,))


def item(name: str, place: str, kind: str = "object") -> Keep:
    """Return the turn that keeps a new item."""
    return learned(
        (ex(name), RDF.type, ex(kind)),
        (ex(name), ex("obj_name" if kind == "object" else "tool_name"), Literal(name)),
        (ex(name), ex("obj_location"), ex(place)),
    )


def leek(place: str, kind: str = "object") -> Keep:
    """Return the turn that keeps the leek."""
    return item("leek", place, kind)


def files(root: Path) -> dict[str, bytes]:
    """Read the kitchen's files."""
    return {path.name: path.read_bytes() for path in (root / "kg" / "kitchen").iterdir()}
