"""Graphs in and out: queries, updates, exports, imports."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from adaptbot_cli.adapters.store.engine import Answered, ask, read_graph, write_graph
from adaptbot_cli.adapters.store.engine import update as updated
from adaptbot_cli.adapters.store.turtle import KNOWN_PREFIXES
from adaptbot_cli.core.graph.clock import LONGEST, within
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.imports import Parcel, accept, merged, replaced
from adaptbot_cli.core.graph.sparql import form_of, one_newline, reaches_out
from adaptbot_cli.core.graph.terms import ATTRIBUTES, SCHEMA, STATES
from adaptbot_cli.core.names import sentence_list
from adaptbot_cli.errors import UsageError
from adaptbot_cli.session.change import ProposedChange, after
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.sources import load

_SECONDS = 60.0
"""How long a query of a person may take."""


def prefixes(home: Home) -> dict[str, str]:
    """Return the prefixes that a query need not declare; ex is the domain's own namespace."""
    return {**KNOWN_PREFIXES, "ex": home.kg.domain.namespace}


def query(home: Home, text: str, files: Sequence[Path] = ()) -> Answered:
    """Answer a SPARQL query over G_k, G_s and the classes; with `files` over their facts.

    Raises:
        UsageError: it is no valid query, is an update, or would reach the network.
    """
    text = _kept_in(text)
    kg = load(home.workspace, home.domain, files) if files else home.kg
    if form_of(text) == "update":
        raise UsageError("this is an update, which would change the graph: --update makes it")
    return within(lambda: ask(kg.engine, text, prefixes(home)), "this query", _SECONDS)


def update(home: Home, text: str) -> ProposedChange:
    """Propose what a SPARQL update would change.

    Raises:
        UsageError: it is no valid update, or would reach the network or change the classes.
    """
    text = _kept_in(text)
    if form_of(text) == "query":
        raise UsageError("this is a query, which changes nothing: ask it without --update")
    schema, known = home.kg.graph(SCHEMA), prefixes(home)
    now = within(lambda: updated(home.facts, schema, text, known), "this update", _SECONDS)
    delta = Delta(home.facts - now, now - home.facts)
    line = " ".join(text.split())
    subject = f"update: {line[:60]}" + ("…" if len(line) > 60 else "")
    return ProposedChange(delta, subject, (("Source", "update"), ("Update", line[:2000])))


def _kept_in(text: str) -> str:
    """Return a query's text as it may be asked. Raises UsageError."""
    text = one_newline(text)
    if len(text) > LONGEST:
        raise UsageError(f"the query has more than {LONGEST:,} characters; import takes a graph in")
    try:
        word = reaches_out(text)
    except ValueError as problem:
        raise UsageError(str(problem)) from None
    if word:
        raise UsageError(f"{word} would reach the network; a query asks this graph alone")
    return text


def exported(home: Home, form: str, part: str, at: str | None = None) -> bytes:
    """Return a domain's facts written in a format: G_k ("attribute"), G_s ("state") or both.

    Raises:
        KnowledgeError, UsageError: there is no such revision or domain.
    """
    kg = load(home.workspace, home.domain, at=at)
    names = {"attribute": [ATTRIBUTES], "state": [STATES]}.get(part, [ATTRIBUTES, STATES])
    triples = {triple for name in names for triple in kg.graph(name)}
    return write_graph(triples, form, prefixes(home))


def imported(home: Home, files: Sequence[Path], replace: bool) -> tuple[Parcel, ProposedChange]:
    """Propose to take in graphs; with `replace` they become all that is known.

    Raises:
        KnowledgeError: a file cannot be read, or is not valid.
    """
    given, prefixes = read_graph(files)
    base = frozenset({*home.kg.graph(ATTRIBUTES), *home.kg.graph(STATES)})
    parcel = accept(given, home.kg.domain, frozenset() if replace else base, prefixes)
    delta = replaced(parcel, base) if replace else merged(parcel, home.kg.domain, base)
    names = ", ".join(path.name for path in files)
    notes = _unmet(home, delta) if delta else ()
    trailers = (("Source", "import"), *(("File", path.name) for path in files))
    return parcel, ProposedChange(delta, f"import: {names}", trailers, notes)


def _unmet(home: Home, delta: Delta) -> tuple[str, ...]:
    """Say which tasks would need what is not here any more."""
    if not delta.removed:
        return ()
    now = after(home, delta)
    tasks = [
        task.name
        for task in home.kg.domain.tasks
        if any(home.kg.find(item) and not now.find(item) for item in task.required)
    ]
    text = sentence_list(tasks)
    return (f"{len(tasks)} tasks would need what is not here any more: {text}",) if tasks else ()


def plain_parcel(parcel: Parcel) -> dict[str, Any]:
    """Return what became of a graph from outside as a plain object."""
    left = [{"fact": list(map(str, t)), "why": why} for t, why in parcel.left_out.items()]
    return {
        "accepted": len(parcel.accepted),
        "declarations": len(parcel.declarations),
        "left_out": left,
        "oddities": list(parcel.oddities),
    }
