"""Tables of things, actions and tasks for the terminal, and the cells all tables share."""

import shlex
from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from adaptbot_cli.core.domain import Kind
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.terms import local
from adaptbot_cli.core.view import Thing
from adaptbot_cli.core.visible import visible


def everything(kg: Kg, groups: list[tuple[Kind, list[Thing]]]) -> RenderableType:
    """Show every thing under its class: where it is, what is true of it, its state."""
    nodes, edges = kg.size()
    parts: list[RenderableType] = []
    for kind, things in groups:
        parts += [_heading(kind, len(things)), _listing(kg, things), Text()]
    parts.append(Text(f"{kg.domain.name}: {nodes} nodes, {edges} edges", "dim"))
    return Group(*parts)


def members(kg: Kg, kind: Kind, things: list[Thing], about: dict[str, Any]) -> RenderableType:
    """Show the things of one class, and what is asked of a new one."""
    parts: list[RenderableType] = [_heading(kind, len(things)), _listing(kg, things)]
    if about["about"]:
        parts.insert(1, Text(about["about"], "dim"))
    if about["asked"]:
        asked = ", ".join(entry["label"] for entry in about["asked"])
        parts.append(Text.assemble(("asked of a new one  ", "dim"), asked))
    return Group(*parts)


def _heading(kind: Kind, count: int) -> Text:
    return Text.assemble((kind.label, "bold"), (f"  {count}", "dim"))


def _listing(kg: Kg, things: list[Thing]) -> Table:
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 2), pad_edge=False)
    table.add_column("name", no_wrap=True, max_width=32, overflow="ellipsis")
    table.add_column("place", no_wrap=True, max_width=20, overflow="ellipsis")
    table.add_column("is")
    table.add_column("now")
    for thing in things:
        table.add_row(
            Text(visible(thing.name)),
            Text(visible(thing.place)),
            Text(", ".join(_true(kg, thing.attributes))),
            Text(", ".join(_true(kg, thing.states)), "green"),
        )
    return table


def _true(kg: Kg, facts: dict[str, Any]) -> list[str]:
    return [_label(kg, name) for name, value in facts.items() if value is True]


def _label(kg: Kg, name: str) -> str:
    found = (p.label for p in kg.domain.properties.values() if p.iri.endswith(f"/{name}"))
    return next(found, name)


def one(kg: Kg, thing: Thing) -> RenderableType:
    """Show one thing with all its facts, and what is in or on it."""
    title = Text.assemble((visible(thing.name), "bold"), (f"  {_kinds(kg, thing)}", "dim"))
    parts: list[RenderableType] = [title]
    if thing.aliases:
        names = ", ".join(map(visible, thing.aliases))
        parts.append(Text(f"also called {names}"))
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 2), pad_edge=False)
    for column in ("fact", "value", "predicate"):
        table.add_column(column)
    for heading, facts in (("what it is", thing.attributes), ("how it is now", thing.states)):
        if facts:
            table.add_row(Text(heading, "bold"))
        for name, value in facts.items():
            table.add_row(Text(_label(kg, name)), _value(value), Text(name, "dim"))
    parts.append(table)
    if thing.holds:
        parts.append(Text.assemble(("holds  ", "dim"), ", ".join(map(visible, thing.holds))))
    return Group(*parts)


def _kinds(kg: Kg, thing: Thing) -> str:
    labels = {local(kind.iri): kind.label for kind in kg.domain.kinds.values()}
    return ", ".join(labels.get(name, name) for name in thing.kind.split(", "))


def _value(value: Any) -> Text:
    if isinstance(value, bool):
        return Text("yes", "green") if value else Text("no", "dim")
    return Text(visible(str(value)))


def stats(kg: Kg, record: dict[str, Any]) -> RenderableType:
    """Show the counts of a graph."""
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 2), pad_edge=False)
    table.add_column(justify="left")
    table.add_column(justify="right")
    for name in ("nodes", "edges", "actions", "tasks"):
        table.add_row(Text(name, "bold"), Text(str(record[name])))
    labels = {kind.iri.rsplit("/", 1)[-1]: kind.label for kind in kg.domain.kinds.values()}
    for name, count in record["classes"].items():
        table.add_row(Text(labels.get(name, name)), Text(str(count)))
    return Group(Text(kg.domain.name, "bold"), table)


_LONGEST = 400
_INDENT = (0, 0, 0, 2)


def cell(text: str, style: str = "", longest: int = _LONGEST) -> Text:
    """Return text from outside: never markup, never an escape code, cut to a bearable length."""
    shown = Text(visible(text), style, overflow="fold")
    shown.truncate(longest, overflow="ellipsis")
    return shown


def joined(parts: Iterable[str], style: str = "dim") -> Text:
    """Return what is told of something in one line, what is empty left out."""
    return cell(" · ".join(part for part in parts if part), style)


def minute(when: str) -> str:
    """Return an ISO time to the minute, as people write it."""
    return when[:16].replace("T", " ")


def indented(rows: Iterable[tuple[Text, ...]]) -> Padding:
    """Return rows as columns, indented; the last column wraps."""
    table = Table.grid(padding=(0, 2, 0, 0), pad_edge=False)
    for row in rows:
        while len(table.columns) < len(row):
            table.add_column(overflow="fold")
        table.add_row(*row)
    return Padding(table, _INDENT)


def count(number: int, one: str, many: str = "") -> str:
    """Say how many there are: "1 fact", "2 facts"."""
    return f"{number} {one if number == 1 else many or one + 's'}"


Plain = dict[str, Any]


def listing(tasks: Sequence[Plain], actions: Sequence[Plain]) -> RenderableType:
    """List tasks with what they need, and actions with what they take."""
    parts: list[RenderableType] = []
    if tasks:
        parts.append(Text.assemble(("tasks", "bold"), (f"  {len(tasks)}", "dim")))
        parts.append(
            indented((cell(task["task"]), cell(", ".join(task["needs"]), "dim")) for task in tasks)
        )
    if actions:
        parts.append(Text.assemble(("actions", "bold"), (f"  {len(actions)}", "dim")))
        parts.append(indented((cell(_call(a)), cell(a["explain"], "dim")) for a in actions))
    if not parts:
        parts.append(Text("none are known", "dim"))
    return Group(*parts)


def action(record: Plain) -> RenderableType:
    """Show an action: what it takes, what must hold, what is different afterwards."""
    parts: list[RenderableType] = [
        Text.assemble(cell(_call(record), "bold"), "  action"),
        cell(record["explain"]),
    ]
    if record["also_called"]:
        parts.append(cell(f"also called {', '.join(record['also_called'])}"))
    takes = [(cell(p["name"]), cell(_takes(p), "dim")) for p in record["parameters"]]
    parts += _part("takes", takes)
    parts += _part("not possible if", [(cell(need["if_not"]),) for need in record["requires"]])
    parts += _part("warns", [(cell(advice),) for advice in record["advises"]])
    parts += _part("afterwards", [(cell(sentence),) for sentence in record["afterwards"]])
    if not record["effect_known"]:
        parts.append(Text("what it changes is not known", "yellow"))
    return Group(*parts)


def _call(record: Plain) -> str:
    shown = [p for p in record["parameters"] if not p["hidden"]]
    names = [f"[{p['name']}]" if p["optional"] else p["name"] for p in shown]
    return f"{record['action']}({', '.join(names)})"


def _takes(parameter: Plain) -> str:
    notes = [word for word in ("optional", "hidden") if parameter[word]]
    text = " or ".join(parameter["takes"]) or "anything"
    return f"{text} ({', '.join(notes)})" if notes else text


def _part(title: str, rows: Sequence[tuple[Text, ...]]) -> list[RenderableType]:
    return [Text(title, "dim"), indented(rows)] if rows else []


def task(record: Plain, missing: Sequence[str], domain: str) -> RenderableType:
    """Show a task: what it needs, what of that is not here, when it is not done."""
    parts: list[RenderableType] = [Text.assemble(cell(record["task"], "bold"), ("  task", "dim"))]
    if record["also_called"]:
        parts.append(cell(f"also called {', '.join(record['also_called'])}"))
    parts += _part("needs", [(cell(", ".join(record["needs"])),)])
    if missing:
        parts.append(cell(f"! {count(len(missing), 'thing')} not known here: {', '.join(missing)}"))
    parts += _part("not done if", [(cell(goal),) for goal in record["done_unless"]])
    command = f"adaptbot run {shlex.quote(record['task'])} --domain {domain}"
    return Group(*parts, cell(f"do it: {command}", "dim"))
