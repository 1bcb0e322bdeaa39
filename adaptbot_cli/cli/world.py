"""`adaptbot world`: what carries a plan out."""

from typing import Annotated

import typer

from adaptbot_cli.cli.common import (
    ANYWHERE,
    ActTimeoutOption,
    JsonOption,
    Place,
    console,
    print_json,
)
from adaptbot_cli.cli.help import Group

app = typer.Typer(
    cls=Group, no_args_is_help=True, help="What carries a plan out: a robot, a simulator."
)


@app.command("check")
def check(
    world: Annotated[str, typer.Argument(metavar="exec:COMMAND", help="The process to check.")],
    act_timeout: ActTimeoutOption = None,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> int:
    """Check that a process keeps to the protocol of docs/worlds.md. Nothing is made to move."""
    from adaptbot_cli.adapters.display.cells import BAD, GOOD, hanging, noted
    from adaptbot_cli.adapters.world.conformance import conformance
    from adaptbot_cli.adapters.world.process import Process
    from adaptbot_cli.errors import UsageError, WorldError
    from adaptbot_cli.session.build import ACT_SECONDS, EXEC

    if not world.startswith(EXEC):
        raise UsageError(f"say what to start: adaptbot world check '{EXEC}python robot.py'")
    command = world.removeprefix(EXEC).strip()
    process = Process(command, place.home().kg, act_timeout or ACT_SECONDS)
    found = []
    try:
        for each in conformance(process):
            found.append(each)
            if not json:
                text = each.what if each.good else f"{each.what}: {each.seen}"
                console().print(hanging(noted(GOOD if each.good else BAD, text)))
    finally:
        process.close()
    good = all(each.good for each in found)
    if json:
        checks = [{"what": c.what, "good": c.good, "seen": c.seen} for c in found]
        print_json({"world": process.name, "good": good, "checks": checks})
    return 0 if good else WorldError.exit_code
