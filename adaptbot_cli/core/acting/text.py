"""Passages of the domain's own SPARQL, put together anew. Nothing a person wrote comes here."""

import re
from collections.abc import Collection, Mapping, Sequence

from rdflib import URIRef

from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.sparql import SKIP, prefixes_of, split_update, variables

_PART = re.compile(rf"({SKIP})|\?(\w+)|(\s+)", re.DOTALL)
_PURPOSE = re.compile(r"(.*\bmust\b.*?) (?:to|before) .*", re.DOTALL)


def renamed(text: str, names: Mapping[str, str]) -> str:
    """Return a query on one line, its variables renamed and its comments left out."""

    def part(match: re.Match[str]) -> str:
        if match[1]:
            return "" if match[1].startswith("#") else match[1]
        return f"?{names.get(match[2], match[2])}" if match[2] else " "

    return re.sub(r" +", " ", _PART.sub(part, text)).strip()


def adapted(text: str, names: Mapping[str, str], taken: Collection[str]) -> str:
    """Return a query with its parameters renamed; its own variables never become parameters.

    `taken` are the names that its own variables must not have.
    """
    own = variables(text) - names.keys() - {"agent"}
    used = {*taken, *names.values(), *own}
    clear = dict(names)
    for name in sorted(own & {*taken, *names.values()}):
        free = (f"{name}_{n}" for n in range(2, 10_000))
        clear[name] = next(new for new in free if new not in used)
        used.add(clear[name])
    return renamed(text, clear)


def together(updates: Sequence[str], parameters: Collection[str]) -> str:
    """Return one update that does what several do.

    Each has variables of its own, all but the parameters and the robot.
    """
    groups: list[tuple[str, str, str]] = []
    taken: set[str] = set()
    shared = {name: name for name in parameters}
    for update in updates:
        clear = adapted(update, shared, taken)
        taken |= variables(clear) - {*parameters, "agent"}
        groups.append(split_update(clear))
    deletes, inserts, where = zip(*groups, strict=True)
    parts = [_group("DELETE", deletes, " . "), _group("INSERT", inserts, " . ")]
    return " ".join([*filter(None, parts), _group("WHERE", where, " ") or "WHERE {}"])


def _group(keyword: str, groups: Sequence[str], between: str) -> str:
    inside = between.join(g.strip().removesuffix(".").strip() for g in groups if g.strip())
    return f"{keyword} {{ {inside} }}" if inside else ""


def unprefixed(query: str) -> str:
    """Return a query as the domain's files have it: without the PREFIX lines added on reading."""
    return re.sub(r"^(?:PREFIX\s+\w*:\s*<[^>]*>\s*)+", "", query)


def prefixes(domain: Domain) -> dict[str, str]:
    """Return the prefixes that the queries of the domain's actions use."""
    texts = [c.query for action in domain.actions.values() for c in action.conditions]
    texts += [a.effect.select for a in domain.actions.values() if a.effect]
    texts += [p.default for a in domain.actions.values() for p in a.parameters]
    return {name: iri for text in texts for name, iri in prefixes_of(text).items()}


def short(iri: URIRef, spaces: Mapping[str, str]) -> str:
    """Return an IRI as a query has it: by a prefix, where one fits."""
    for prefix, space in sorted(spaces.items()):
        end = iri.removeprefix(space)
        if iri.startswith(space) and re.fullmatch(r"\w+", end):
            return f"{prefix}:{end}"
    return iri.n3()


def clause(message: str) -> str:
    """Return what a message says must be, without what it must be for: that is another action."""
    found = _PURPOSE.fullmatch(message)
    return found[1] if found else message
