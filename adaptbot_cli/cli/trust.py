"""`adaptbot trust`: obey what a workspace or a transcript says of model, server and limits."""

from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import (
    JsonOption,
    WorkspaceOption,
    agreed,
    console,
    print_json,
    workspace,
)


def trust(
    file: Annotated[
        Path | None, typer.Argument(help="A transcript; without it, the workspace's adaptbot.toml.")
    ] = None,
    revoke: Annotated[bool, typer.Option("--revoke", help="Trust it no longer.")] = False,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Obey the model, the server and the limits that a file names, until the file changes.

    Of a transcript the answers count then too, as of a run of yours.
    """
    from rich.text import Text

    from adaptbot_cli import trust as trusting
    from adaptbot_cli.adapters.display.cells import GOOD, noted
    from adaptbot_cli.core.visible import visible

    path, content, settings = _transcript(file) if file else _workspace(workspace_dir)
    out = console(stderr=json)
    if revoke:
        was = trusting.revoke(path, content)
        text = "is trusted no longer" if was else "was not trusted"
        out.print(Text(visible(f"{path} {text}")), soft_wrap=True)
    else:
        out.print(Text(visible(str(path)), "bold"), soft_wrap=True)
        for name, value in settings.items():
            out.print(Text(visible(f"  {name} = {value!r}")), soft_wrap=True)
        if not settings:
            out.print(Text("  names no model, no server and no limits", "dim"))
        if not (yes or agreed(out, "Trust this?")):
            out.print(Text("nothing was changed", "dim"))
            return 0
        trusting.trust(path, content)
        out.print(noted(GOOD, "trusted, until it changes"))
    if json:
        shown = {name: str(value) for name, value in settings.items()}
        print_json({"file": str(path), "settings": shown, "trusted": not revoke})
    return 0


def _workspace(option: Path | None) -> tuple[Path, bytes, dict[str, object]]:
    """The adaptbot.toml that is meant, its content, and what of it needs trust."""
    from adaptbot_cli import bounded
    from adaptbot_cli.trust import GUARDED
    from adaptbot_cli.workspace import CONFIG, settings_of

    path = workspace(option).root / CONFIG
    content = bounded.read_bytes(path, bounded.SETTINGS)
    held, ignored = settings_of(path)
    return path, content, {n: v for n, v in {**held, **ignored}.items() if n in GUARDED}


def _transcript(path: Path) -> tuple[Path, bytes, dict[str, object]]:
    from adaptbot_cli.adapters.transcript.loading import header_of
    from adaptbot_cli.session import past_runs

    header = header_of(path)
    return path, past_runs.content_of(header), past_runs.guarded(header)
