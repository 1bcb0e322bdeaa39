"""`adaptbot config`: what holds of each setting here, and who says so."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import JsonOption, WorkspaceOption, console, print_json, workspace

if TYPE_CHECKING:
    from rich.console import RenderableType

    from adaptbot_cli.workspace import Workspace


def config(
    key: Annotated[
        str,
        typer.Argument(
            metavar="[KEY]", help="Only this setting.", autocompletion=completion.settings
        ),
    ] = "",
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Show each setting, what holds of it here, and where that comes from; secrets by name only.

    A command's own options go before all of them.
    """
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.workspace import SETTINGS, meant

    home = workspace(workspace_dir)
    if key and key not in SETTINGS:
        raise UsageError(f"there is no setting {key!r}; {meant(key)}")
    rows = [_setting(home, name, os.environ) for name in ([key] if key else SETTINGS)]
    if key and json:
        print_json(rows[0])
    elif json:
        where = {"root": str(home.root), "named_by": home.named_by}
        print_json({"workspace": where, "settings": rows, "secrets": _secrets(os.environ)})
    else:
        console().print(_table(home, rows, {} if key else _secrets(os.environ)))


def _setting(home: "Workspace", name: str, environ: Mapping[str, str]) -> dict[str, Any]:
    """A setting as a plain object. `source` is default, environment, own file or workspace."""
    from adaptbot_cli import trust
    from adaptbot_cli.workspace import CONFIG, SETTINGS

    value, where = home.origin(name, environ)
    mine = str(trust.own_settings_file())
    sources = {SETTINGS[name].variable: "environment", mine: "own file", "": "default"}
    record = {"name": name, "value": _shown(value), "source": sources.get(where, "workspace")}
    record |= {"where": where or None, "ignored": None}
    if name in home.ignored:
        file = str(home.root / CONFIG)
        record["ignored"] = {"value": _shown(home.ignored[name]), "where": file}
    return record


def _shown(value: Any) -> Any:
    """A value without what looks like a secret in it: an address may have a password."""
    from adaptbot_cli.adapters.planner.scrub import secrets

    return secrets(os.environ, value).detail(value) if isinstance(value, str) else value


def _secrets(environ: Mapping[str, str]) -> dict[str, bool]:
    """The secrets that the environment may hold, by name, and whether each is set."""
    from adaptbot_cli.adapters.planner.choice import KEYS

    known = [*(key for key, _ in KEYS), "ADAPTBOT_KG_PASSWORD", "ADAPTBOT_KG_TOKEN"]
    others = sorted(name for name in environ if name.endswith("_API_KEY") and name not in known)
    return {name: bool(environ.get(name)) for name in (*known, *others)}


def _table(
    home: "Workspace", rows: list[dict[str, Any]], secrets: dict[str, bool]
) -> "RenderableType":
    from rich.console import Group
    from rich.text import Text

    from adaptbot_cli import trust
    from adaptbot_cli.adapters.display.cells import columns, plain_text
    from adaptbot_cli.adapters.planner.budget import SECONDS
    from adaptbot_cli.workspace import CONFIG

    absent = {
        "model": "a provider's key, Ollama, the model on board, else the plan library",
        "timeout": f"{SECONDS:g}",
        "world": "rehearsal",
        "max_tokens": "no limit",
        "max_cost": "no limit",
    }
    mine, here = str(trust.own_settings_file()), str(home.root / CONFIG)
    called = {mine: "your own file", here: "workspace file", None: "default"}
    table = columns(None, None, None)
    for row in rows:
        value, quiet = row["value"], "dim" if row["where"] is None else ""
        text = absent.get(row["name"], "not set") if value is None else _plain(value)
        where = plain_text(called.get(row["where"], row["where"]), "dim")
        table.add_row(plain_text(row["name"], quiet), plain_text(text, quiet), where)
        if row["ignored"]:
            text = f"! {_plain(row['ignored']['value'])} is ignored until `adaptbot trust`"
            table.add_row("", plain_text(text, "yellow"), plain_text("workspace file", "dim"))
    if len(rows) == 1:
        return table
    places = columns(None, None)
    for name, text in (
        ("workspace", f"{home.root} ({home.named_by})"),
        ("workspace file", here if Path(here).is_file() else f"{here}, not there yet"),
        ("your own file", mine if Path(mine).is_file() else f"{mine}, not there yet"),
        ("secrets set", ", ".join(n for n, there in secrets.items() if there) or "none"),
        ("not set", ", ".join(n for n, there in secrets.items() if not there)),
    ):
        places.add_row(plain_text(name, "dim"), plain_text(text, "", 400))
    return Group(table, Text(), places)


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
