"""A new domain in a workspace: another pack under a new name, never over anything that is there."""

from collections.abc import Iterator, Mapping
from datetime import datetime
from itertools import pairwise
from pathlib import Path

from rdflib import RDFS, URIRef

from adaptbot_cli.adapters.store.committing import Change, commit, recovered
from adaptbot_cli.adapters.store.files import lock
from adaptbot_cli.adapters.store.reading import parse
from adaptbot_cli.adapters.store.turtle.lexer import Place, Token, statements, tokens
from adaptbot_cli.errors import UsageError


def renamed(files: Mapping[str, bytes], domain: URIRef, new: URIRef, name: str) -> dict[str, bytes]:
    """Return a pack's valid Turtle files with the domain under another IRI and rdfs:label.

    Everything else in them, comments and order too, stays as it is.
    """
    return {
        file: _renamed(data.decode("utf-8"), file, domain, new, name).encode("utf-8")
        for file, data in files.items()
    }


def _renamed(text: str, file: str, domain: URIRef, new: URIRef, name: str) -> str:
    spaces = dict(parse(text.encode("utf-8"), file).namespaces())
    written = {f"<{domain}>": f"<{new}>"}
    for prefix, space in spaces.items():
        if domain.startswith(space):
            written[f"{prefix}:{domain[len(space) :]}"] = f"{prefix}:{new[len(space) :]}"
    labels = {f"<{RDFS.label}>"} | {
        f"{p}:label" for p, iri in spaces.items() if str(iri) == str(RDFS)
    }
    edits = []
    for place in statements(text):
        for token in tokens(text, place.start, place.end):
            if token.text in written:
                edits.append((token.start, token.end, written[token.text]))
        if place.head in written:
            edits += [(t.start, t.end, f'"{name}"') for t in _values(text, place, labels)]
    for start, end, now in sorted(edits, reverse=True):
        text = text[:start] + now + text[end:]
    return text


def _values(text: str, place: Place, predicates: set[str]) -> Iterator[Token]:
    """The strings that directly follow some predicates in a statement."""
    found = list(tokens(text, place.start, place.end))
    for before, token in pairwise(found):
        if before.text in predicates and token.kind == "string":
            yield token


def create(root: Path, files: Mapping[str, bytes], more: Mapping[str, bytes], message: str) -> str:
    """Write and commit new files; return the revision. `more` are written only where missing.

    Raises:
        UsageError: one of `files` is there already; nothing is written then.
        KnowledgeError: the workspace cannot be written.
    """
    made = not root.is_dir() or not any(root.iterdir())
    with lock(root):
        repo = recovered(root, own=made)
        there = sorted(path for path in files if (root / path).exists())
        if there:
            raise UsageError(f"{root / there[0]} is there already, and nothing is overwritten")
        new = {**files, **{p: data for p, data in more.items() if not (root / p).exists()}}
        return commit(root, repo, Change(new, sorted(new)), message, datetime.now().astimezone())
