"""`adaptbot eval compare A B`: what changed from one experiment to another."""

from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import JsonOption


def compare(
    before: Annotated[Path, typer.Argument(metavar="A", help="What `eval --json` printed.")],
    after: Annotated[Path, typer.Argument(metavar="B", help="The same, later.")],
    json: JsonOption = False,
) -> int:
    """Compare two experiments; exit 3 if the second is worse."""
    return 0
