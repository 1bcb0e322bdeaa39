"""`adaptbot kg`: the knowledge of this home, where it comes from, and how it is changed."""

import typer

from adaptbot_cli.cli.help import Group
from adaptbot_cli.cli.kg import edits, graphs, history, sharing, show, state

app = typer.Typer(cls=Group, help="The knowledge graph of this home.", no_args_is_help=True)
_LOOK, _VERSIONS, _CHANGE, _SHARE = "Look", "Versions", "Change", "Share"

app.command(rich_help_panel=_LOOK)(show.show)
app.command(rich_help_panel=_LOOK)(show.stats)
app.command(rich_help_panel=_LOOK)(history.why)
app.command(rich_help_panel=_LOOK)(graphs.query)
app.command(rich_help_panel=_LOOK)(graphs.export)
app.command(rich_help_panel=_VERSIONS)(state.status)
app.command(rich_help_panel=_VERSIONS)(state.validate)
app.command(rich_help_panel=_VERSIONS)(history.log)
app.command(rich_help_panel=_VERSIONS)(history.diff)
app.command(rich_help_panel=_VERSIONS)(state.commit)
app.command(rich_help_panel=_VERSIONS)(state.split)
app.command(rich_help_panel=_CHANGE)(edits.add)
app.command("set", rich_help_panel=_CHANGE)(edits.put)
app.command(rich_help_panel=_CHANGE)(edits.retract)
app.command(rich_help_panel=_CHANGE)(edits.revert)
app.command("import", rich_help_panel=_CHANGE)(graphs.import_)
app.command(rich_help_panel=_SHARE)(sharing.sync)
app.command(rich_help_panel=_SHARE)(sharing.pull)
app.command(rich_help_panel=_SHARE)(sharing.push)
