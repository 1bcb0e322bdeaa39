"""Actions and tasks for the terminal."""

from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from adaptbot_cli.adapters.tables.words import cell, count, indented

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
    """Show an action: what it takes, what must hold, what it changes."""
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
    changes = record["changes"]
    rows = [(Text("-", "red"), cell(line, "dim")) for line in changes["removes"]]
    rows += [(Text("+", "green"), cell(line, "dim")) for line in changes["adds"]]
    parts += _part("changes", rows)
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


def task(record: Plain, missing: Sequence[str]) -> RenderableType:
    """Show a task: what it needs, what of that is not here, when it is not done."""
    parts: list[RenderableType] = [Text.assemble(cell(record["task"], "bold"), ("  task", "dim"))]
    if record["also_called"]:
        parts.append(cell(f"also called {', '.join(record['also_called'])}"))
    parts += _part("needs", [(cell(", ".join(record["needs"])),)])
    if missing:
        parts.append(cell(f"! {count(len(missing), 'thing')} not known here: {', '.join(missing)}"))
    parts += _part("not done if", [(cell(goal),) for goal in record["done_unless"]])
    command = f'adaptbot run "{record["task"]}"'
    return Group(*parts, cell(f"do it: {command}", "dim"))
