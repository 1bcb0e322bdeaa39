"""`adaptbot eval`: run the paper's experiment, compare two of them, read the published ones."""

import typer

from adaptbot_cli.cli.eval import compare, run
from adaptbot_cli.cli.help import Group


class _RunByDefault(Group):
    """Takes `eval FILE` for `eval run FILE`."""

    default = "run"


app = typer.Typer(
    cls=_RunByDefault,
    help="Evaluate as the paper does: three arms, linked trials. "
    "`adaptbot eval FILE` is `adaptbot eval run FILE`; see `adaptbot eval run --help`.",
)
app.command("run")(run.run)
app.command("published")(run.published)
app.command("compare")(compare.compare)
