"""Tables of things, actions and tasks."""

import shlex
from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from adaptbot_cli.adapters.display.cells import cell, count, indented
from adaptbot_cli.core.domain import ItemClass
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.view.facts import Thing

Plain = dict[str, Any]


def everything(kg: Kg, groups: list[tuple[ItemClass, list[Thing]]]) -> RenderableType:
    """Show every thing under its class: where it is, what is true of it, its state."""
    nodes, edges = kg.size()
    parts: list[RenderableType] = []
    for kind, things in groups:
        parts += [_heading(kind.label, len(things)), _listing(kg, things), Text()]
    parts.append(Text(f"{kg.domain.name}: {nodes} nodes, {edges} edges", "dim"))
    return Group(*parts)


def members(kg: Kg, kind: ItemClass, things: list[Thing], about: dict[str, Any]) -> RenderableType:
    """Show the things of one class, and what is asked of a new one."""
    parts: list[RenderableType] = [_heading(kind.label, len(things)), _listing(kg, things)]
    if about["about"]:
        parts.insert(1, Text(about["about"], "dim"))
    if about["asked"]:
        asked = ", ".join(entry["label"] for entry in about["asked"])
        parts.append(Text.assemble(("asked of a new one  ", "dim"), asked))
    return Group(*parts)


def _heading(title: str, number: int) -> Text:
    return Text.assemble((title, "bold"), (f"  {number}", "dim"))


def _listing(kg: Kg, things: list[Thing]) -> Table:
    table = _table()
    table.add_column("name", no_wrap=True, max_width=32, overflow="ellipsis")
    table.add_column("place", no_wrap=True, max_width=20, overflow="ellipsis")
    table.add_column("is")
    table.add_column("now", style="green")
    for thing in things:
        is_so, now = (
            ", ".join(_label(kg, name) for name, value in facts.items() if value is True)
            for facts in (thing.attributes, thing.states)
        )
        table.add_row(cell(thing.name), cell(thing.place), cell(is_so), cell(now))
    return table


def _table(*headers: str, titled: bool = True) -> Table:
    padding = (0, 2, 0, 2)
    return Table(
        *headers, box=None, header_style="dim", padding=padding, pad_edge=False, show_header=titled
    )


def _label(kg: Kg, name: str) -> str:
    found = (p.label for p in kg.domain.properties.values() if p.iri.endswith(f"/{name}"))
    return next(found, name)


def one(kg: Kg, thing: Thing) -> RenderableType:
    """Show one thing with all its facts, and what is in or on it."""
    labels = {local(kind.iri): kind.label for kind in kg.domain.classes.values()}
    kinds = ", ".join(labels.get(name, name) for name in thing.kind.split(", "))
    title = Text.assemble(cell(thing.name, "bold"), (f"  {kinds}", "dim"))
    parts: list[RenderableType] = [title, *_also_called(thing.aliases)]
    table = _table("fact", "value", "predicate")
    for heading, facts in (("what it is", thing.attributes), ("how it is now", thing.states)):
        if facts:
            table.add_row(Text(heading, "bold"))
        for name, value in facts.items():
            table.add_row(Text(_label(kg, name)), _value(value), Text(name, "dim"))
    parts.append(table)
    if thing.holds:
        parts.append(Text.assemble(("holds  ", "dim"), cell(", ".join(thing.holds))))
    return Group(*parts)


def _also_called(names: Sequence[str]) -> list[Text]:
    return [cell(f"also called {', '.join(names)}")] if names else []


def _value(value: Any) -> Text:
    if isinstance(value, bool):
        return Text("yes", "green") if value else Text("no", "dim")
    return cell(str(value))


def stats(kg: Kg, record: dict[str, Any]) -> RenderableType:
    """Show the counts of a graph."""
    table = _table("", "")
    table.show_header = False
    table.columns[1].justify = "right"
    for name in ("nodes", "edges", "actions", "tasks"):
        table.add_row(Text(name, "bold"), Text(str(record[name])))
    labels = {local(kind.iri): kind.label for kind in kg.domain.classes.values()}
    for name, number in record["classes"].items():
        table.add_row(Text(labels.get(name, name)), Text(str(number)))
    return Group(Text(kg.domain.name, "bold"), table)


def listing(tasks: Sequence[Plain], actions: Sequence[Plain]) -> RenderableType:
    """List tasks with what they need, and actions with what they take."""
    parts: list[RenderableType] = []
    for title, rows in (
        ("tasks", [(task["task"], ", ".join(task["needs"])) for task in tasks]),
        ("actions", [(_call(action), action["explain"]) for action in actions]),
    ):
        if rows:
            parts.append(_heading(title, len(rows)))
            parts.append(indented((cell(name), cell(text, "dim")) for name, text in rows))
    return Group(*(parts or [Text("none are known", "dim")]))


def action(record: Plain) -> RenderableType:
    """Show an action: what it takes, what must hold, what is different afterwards."""
    parts: list[RenderableType] = [
        Text.assemble(cell(_call(record), "bold"), "  action"),
        cell(record["explain"]),
        *_also_called(record["also_called"]),
    ]
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
    title = Text.assemble(cell(record["task"], "bold"), ("  task", "dim"))
    parts: list[RenderableType] = [title, *_also_called(record["also_called"])]
    parts += _part("needs", [(cell(", ".join(record["needs"])),)])
    if missing:
        parts.append(cell(f"! {count(len(missing), 'thing')} not known here: {', '.join(missing)}"))
    parts += _part("not done if", [(cell(goal),) for goal in record["done_unless"]])
    command = f"adaptbot run {shlex.quote(record['task'])} --domain {domain}"
    return Group(*parts, cell(f"do it: {command}", "dim"))
