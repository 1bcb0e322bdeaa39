"""How a workspace stands, what is wrong with it, what a query gave, what a file brought."""

from collections.abc import Mapping, Sequence

from rdflib import URIRef
from rdflib.term import Node
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.text import Text

from adaptbot_cli.adapters.display.cells import (
    BAD,
    GOOD,
    WARNING,
    Mark,
    cell,
    count,
    indented,
    noted,
    table,
)
from adaptbot_cli.adapters.display.origins import difference
from adaptbot_cli.core.graph.faults import Fault
from adaptbot_cli.core.graph.imports import Parcel
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.view.changes import Status, Words

_MOST_ROWS = 12


def status(standing: Status, words: Words | None) -> RenderableType:
    """Show how a workspace stands: revision, edits with what they change, open runs."""
    revision = f"{standing.revision[:7]}  {standing.subject}" if standing.revision else "none yet"
    rows = [
        (Text("workspace", "dim"), cell(str(standing.root))),
        (Text("domain", "dim"), cell(standing.domain)),
        (Text("revision", "dim"), cell(revision)),
    ]
    parts: list[RenderableType] = [Padding(indented(rows), 0)]
    if standing.revision is None:
        parts.append(
            Text(f"nothing is kept here yet: the {standing.domain} is the bundled one", "dim")
        )
    elif standing.edited:
        parts.append(cell(f"edited by hand, not committed: {', '.join(standing.edited)}", "yellow"))
        if standing.problem:
            parts.append(noted(BAD, standing.problem))
        elif standing.changes and words:
            parts.append(Padding(difference(standing.changes, words, _MOST_ROWS), (0, 0, 0, 2)))
        else:
            parts.append(Text("  only comments or layout: no fact differs", "dim"))
        parts += [noted(BAD, str(fault)) for fault in standing.faults]
        if not standing.faults and not standing.problem:
            parts.append(Text('commit them with: adaptbot kg commit -m "…"', "dim"))
    else:
        parts.append(Text("no edits: the files are as committed", "dim"))
    if standing.waiting:
        parts.append(Text(f"{count(len(standing.waiting), 'run')} not ended:", "yellow"))
        parts.append(indented((cell(path.name),) for path in standing.waiting))
    return Group(*parts)


def faults(found: Sequence[Fault]) -> RenderableType:
    """Show everything that is wrong: where, why, what to do."""
    if not found:
        return noted(GOOD, "nothing is wrong")
    parts: list[RenderableType] = []
    for fault in found:
        parts.append(noted(WARNING if fault.hint else BAD, fault.message))
        rows = [("in", fault.file), ("from", fault.cause), ("do", fault.remedy)]
        parts.append(indented((Text(key, "dim"), cell(value)) for key, value in rows if value))
    hints = sum(fault.hint for fault in found)
    counted = ((len(found) - hints, "fault"), (hints, "hint"))
    parts.append(Text(", ".join(count(n, what) for n, what in counted if n), "dim"))
    return Group(*parts)


def rows(
    names: Sequence[str], found: Sequence[Sequence[Node | None]], prefixes: Mapping[str, str]
) -> RenderableType:
    """Show the solutions of a query."""
    solutions = table()
    for name in names:
        solutions.add_column(cell(name, "bold not dim"), overflow="fold")
    for row in found:
        solutions.add_row(*(_cell(value, prefixes) for value in row))
    return Group(solutions, Text(count(len(found), "row"), "dim"))


def _cell(value: Node | None, prefixes: Mapping[str, str]) -> Text:
    for name, space in prefixes.items():
        if isinstance(value, URIRef) and value.startswith(space) and len(value) > len(space):
            return cell(f"{name}:{value.removeprefix(space)}")
    return cell("" if value is None else str(value))


def parcel(found: Parcel) -> RenderableType:
    """Show what became of a graph from outside: taken in, left out and why, what is odd in it."""
    lines = [f"{count(len(found.accepted), 'fact')} accepted", f"{len(found.left_out)} left out"]
    if found.declarations:
        lines.append(f"{len(found.declarations)} declarations passed over (domain.ttl has its own)")
    parts: list[RenderableType] = [Text(", ".join(lines))]
    reasons: dict[str, list[str]] = {}
    for triple, reason in found.left_out.items():
        reasons.setdefault(reason, []).append(" ".join(map(local, triple)))
    for reason, facts in reasons.items():
        parts.append(noted(Mark("-", "red"), reason))
        shown = [*facts[:4], *([f"… {len(facts) - 4} more"] if len(facts) > 4 else [])]
        parts.append(indented((cell(fact, "dim"),) for fact in shown))
    if found.oddities:
        parts.append(Text(f"{count(len(found.oddities), 'oddity', 'oddities')} of the files:"))
        parts.append(indented((cell(oddity, "dim"),) for oddity in found.oddities))
    return Group(*parts)
