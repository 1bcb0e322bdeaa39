"""`adaptbot kg status`, `validate`, `commit`, `split`: how the files stand, and edits by hand."""

from typing import Annotated

import typer

from adaptbot_cli.cli.common import (
    ANYWHERE,
    FINDINGS,
    JsonOption,
    KgOption,
    Place,
    console,
    print_json,
)


def status(
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> None:
    """Tell where the knowledge is, its revision, edits not yet committed, runs not ended."""
    from adaptbot_cli.adapters.display.standing import status as table
    from adaptbot_cli.core.view.changes import as_json
    from adaptbot_cli.session import validation

    home = place.home()
    found = validation.status(home)
    words = validation.words_for(home, found.changes) if found.changes else None
    if not json:
        console().print(table(found, words))
        return
    print_json(
        {
            "workspace": str(found.root),
            "domain": found.domain,
            "revision": found.revision,
            "last": found.subject,
            "edited": list(found.edited),
            "changes": as_json(found.changes, words) if found.changes and words else None,
            "problem": found.problem,
            "faults": [*map(str, found.faults)],
            "waiting": [path.name for path in found.waiting],
        }
    )


def validate(
    place: Place = ANYWHERE,
    kg: KgOption = None,
    json: JsonOption = False,
) -> int:
    """Tell everything that is wrong with the knowledge, where, and what to do; 3 if anything is."""
    from adaptbot_cli.adapters.display.standing import faults as table
    from adaptbot_cli.session.validation import validate as found_faults

    home = place.home()
    faults = found_faults(home.workspace, home.domain, kg or ())
    if json:
        print_json([fault.as_json() for fault in faults])
    else:
        console().print(table(faults))
    return FINDINGS if any(not fault.hint for fault in faults) else 0


def commit(
    message: Annotated[
        str, typer.Option("-m", "--message", metavar="TEXT", help="What was edited, and why.")
    ] = "",
    place: Place = ANYWHERE,
) -> None:
    """Commit what was edited by hand, once it is as sound as what a person teaches."""
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import change

    home = place.home()
    if not message.strip():
        raise UsageError('say what was edited: adaptbot kg commit -m "the kettle has moved"')
    revision = change.commit_edits(home, message)
    _committed(revision, "nothing was edited by hand; there is nothing to commit")


def split(place: Place = ANYWHERE) -> None:
    """Divide a large home's files of facts into many, by class or as its domain.ttl says."""
    from adaptbot_cli.session import change

    revision = change.split_files(place.home())
    _committed(revision, "the files are divided so already; there is nothing to do")


def _committed(revision: str | None, otherwise: str) -> None:
    from adaptbot_cli.adapters.display.cells import GOOD, noted, plain_text

    done = revision and noted(GOOD, f"committed as {revision[:7]}")
    console().print(done or plain_text(otherwise, "dim"))
