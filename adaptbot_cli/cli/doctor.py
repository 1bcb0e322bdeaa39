"""`adaptbot doctor`: whether all that adaptbot needs is there, and what to do where it is not."""

import os
from dataclasses import asdict
from typing import TYPE_CHECKING

from adaptbot_cli.cli.common import JsonOption, WorkspaceOption, console, print_json
from adaptbot_cli.errors import KnowledgeError

if TYPE_CHECKING:
    from adaptbot_cli.cli.health import Check


def doctor(json: JsonOption = False, workspace_dir: WorkspaceOption = None) -> int:
    """Look at Python, packages, lexicon, workspace and models, and say what to do about each."""
    from adaptbot_cli.cli.health import checks

    found = list(checks(workspace_dir, os.environ))
    if json:
        print_json({"ok": all(map(_fine, found)), "checks": [asdict(check) for check in found]})
    else:
        _show(found)
    return 0 if all(map(_fine, found)) else KnowledgeError.exit_code


def _fine(check: "Check") -> bool:
    return check.state != "broken"


def _show(found: "list[Check]") -> None:
    from rich.table import Table
    from rich.text import Text

    from adaptbot_cli.core.visible import visible

    marks = {"ok": ("✓", "green"), "hint": ("·", "dim"), "broken": ("✗", "red")}
    table = Table.grid(padding=(0, 2, 0, 0), pad_edge=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in found:
        text = Text(visible(check.found), "dim" if check.state == "hint" else "")
        if check.remedy:
            text.append(f"\n→ {visible(check.remedy)}", "cyan" if check.state == "hint" else "bold")
        table.add_row(Text(*marks[check.state]), Text(visible(check.name)), text)
    out = console()
    out.print(table)
    broken = sum(not _fine(check) for check in found)
    if broken:
        thing = "thing is" if broken == 1 else "things are"
        out.print(Text(f"\n{broken} {thing} broken; all else is well.", "bold red"))
    else:
        out.print(Text("\nNothing that adaptbot needs is broken.", "bold"))
