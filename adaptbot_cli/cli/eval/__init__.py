"""`adaptbot eval`: run the paper's experiment, compare two of them, read the published ones."""

from typing import Any

import typer
from typer.core import TyperGroup

from adaptbot_cli.cli.eval import compare, run


class _RunByDefault(TyperGroup):
    """Takes `eval FILE` for `eval run FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, "-h", "--help"):
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
