"""`adaptbot check`: check a plan's text, without model or human."""

import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import (
    ANYWHERE,
    JsonOption,
    KgOption,
    Place,
    RequiresOption,
    RobotOption,
    TaskOption,
    WithoutOption,
    console,
    items,
    print_json,
)
from adaptbot_cli.cli.run import exit_code


def check(
    plan: Annotated[
        str, typer.Argument(metavar="PLAN", help="A file with a plan, or - for stdin.")
    ] = "",
    place: Place = ANYWHERE,
    robot: RobotOption = "",
    kg: KgOption = None,
    requires: RequiresOption = None,
    without: WithoutOption = None,
    task: TaskOption = "",
    no_repair: Annotated[
        bool,
        typer.Option(
            "--no-repair", help="Judge the plan as it is: put nothing in, leave none out."
        ),
    ] = False,
    json: JsonOption = False,
) -> int:
    """Check a plan against this home: what does not fit, and what would mend it."""
    from adaptbot_cli.session import replay, sources

    home = place.home()
    text = read_plan(plan)
    started = time.monotonic()
    graph = sources.load(home.workspace, home.domain, kg or (), robot=robot)
    wanted, banned = items(requires), items(without)
    result = replay.check_request(text, task, home.workspace, graph, wanted, banned, not no_repair)
    if json:
        from adaptbot_cli.core.view.summary import summary

        record = summary(result, graph, "text", (None, None))
        record["usage"]["seconds"] = round(time.monotonic() - started, 3)
        print_json(record)
    else:
        from adaptbot_cli.adapters.display.screen import Screen

        Screen(console(), graph).finish(result, None)
    return exit_code(result)


def read_plan(name: str) -> str:
    """Read a plan's text from a file or stdin; bytes that are no UTF-8 are shown as such."""
    from adaptbot_cli import bounded
    from adaptbot_cli.errors import UsageError

    if not name:
        raise UsageError("say which plan to check: a file, or - to read it from stdin")
    if name == "-":
        if sys.stdin is None:
            raise UsageError("cannot read the plan from stdin: it is closed")
        data = sys.stdin.buffer.read(bounded.PLAN + 1)
    else:
        data = bounded.read_bytes(Path(name), bounded.PLAN, UsageError, piped=True)
    if len(data) > bounded.PLAN:
        raise UsageError(
            "the plan has more than two million characters: so long a text is not read"
        )
    return data.decode("utf-8", errors="replace")
