"""`adaptbot replay`: play transcripts again and report where they differ."""

from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import WorkspaceOption, console, workspace

DIFFERS = 3


def replay(
    files: Annotated[list[Path], typer.Argument(metavar="FILE…", help="Transcripts.")],
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Replay transcripts: no key, no network; fails at the first turn that differs."""
    from rich.text import Text

    from adaptbot_cli import session
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.errors import ReplayError

    home = workspace(workspace_dir)
    out = console()
    failed = 0
    for path in files:
        try:
            result = session.replay(path, home)
        except ReplayError as error:
            failed += 1
            out.print(Text("✗ ", "red") + Text(visible(str(error))), soft_wrap=True)
            continue
        goal = "goal met" if result.goal_met else "goal not met"
        out.print(Text("✓ ", "green") + Text(f"{path}: {result.verdict}, {goal}"), soft_wrap=True)
    return DIFFERS if failed else 0
