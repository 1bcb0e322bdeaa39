"""`adaptbot eval`: run the paper's experiment, compare two of them, read the published ones."""

from pathlib import Path
from typing import Any

import typer

from adaptbot_cli.cli.eval import compare, run
from adaptbot_cli.cli.help import Group


class _RunByDefault(Group):
    """Takes `eval FILE` for `eval run FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        first = args[0] if args else "-h"
        misspelt = self.nearest(first) and not Path(first).exists()
        if first not in (*self.commands, "-h", "--help") and not misspelt:
            args = ["run", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_RunByDefault,
    help="Evaluate as the paper does: three arms, linked trials. "
    "`adaptbot eval FILE` is `adaptbot eval run FILE`; see `adaptbot eval run --help`.",
    no_args_is_help=True,
)
app.command("run")(run.run)
app.command("published")(run.published)
app.command("compare")(compare.compare)
