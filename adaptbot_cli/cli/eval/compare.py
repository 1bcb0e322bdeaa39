"""`adaptbot eval compare A B`: what changed from one experiment to another."""

from pathlib import Path
from typing import Annotated

import typer

from adaptbot_cli.cli.common import JsonOption, console, print_json

REGRESSION = 3


def compare(
    before: Annotated[Path, typer.Argument(metavar="A", help="What `eval --json` printed.")],
    after: Annotated[Path, typer.Argument(metavar="B", help="The same, later.")],
    tolerance: Annotated[
        float, typer.Option(min=0, help="How much worse a quality may get, as a share.")
    ] = 0.0,
    cost: Annotated[
        float, typer.Option("--cost-tolerance", min=0, help="How much a cost may rise, as a share.")
    ] = 0.05,
    json: JsonOption = False,
) -> int:
    """Compare two experiments, task by task; exit 3 if the second is worse."""
    from adaptbot_cli.evaluation import comparison

    old, new = comparison.read_report(before), comparison.read_report(after)
    found = comparison.compare(old, new, tolerance, cost)
    worse = [difference for difference in found if difference.regression]
    for text in comparison.only_in_one(old, new):
        typer.echo(f"{text}: left out", err=True)
    settings = comparison.other_settings(old, new)
    if json:
        printed = {
            "regression": bool(worse),
            "settings": {name: list(values) for name, values in settings.items()},
            "differences": [change.as_json() for change in found],
        }
        print_json(printed)
    else:
        from adaptbot_cli.evaluation.comparison import contrast

        console().print(contrast(found, settings))
    return REGRESSION if worse else 0
