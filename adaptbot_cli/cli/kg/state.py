"""`adaptbot kg status`, `validate`, `commit`, `split`: how the files stand, and edits by hand."""

from typing import Annotated

import typer

from adaptbot_cli.cli.common import (
    DomainOption,
    JsonOption,
    KgOption,
    WorkspaceOption,
    console,
    domain_name,
    home_of,
    print_json,
    workspace,
)

FAULTS = 3


def status(
    domain: DomainOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Tell where the knowledge is, its revision, edits not yet committed, runs not ended."""
    from adaptbot_cli.adapters.display.standing import status as table
    from adaptbot_cli.core.changes import as_json
    from adaptbot_cli.session import validation

    home = home_of(workspace_dir, domain)
    told = validation.status(home)
    words = validation.words_for(home, told.changes) if told.changes else None
    if not json:
        console().print(table(told, words))
        return
    print_json(
        {
            "workspace": str(told.root),
            "domain": told.domain,
            "revision": told.revision,
            "last": told.subject,
            "edited": list(told.edited),
            "changes": as_json(told.changes, words) if told.changes and words else None,
            "problem": told.problem,
            "faults": list(told.faults),
            "waiting": [path.name for path in told.waiting],
        }
    )


def validate(
    domain: DomainOption = None,
    kg: KgOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Tell everything that is wrong with the knowledge, where, and what to do; 3 if anything is."""
    from adaptbot_cli.adapters.display.standing import faults as table
    from adaptbot_cli.session.validation import validate as found_faults

    found = workspace(workspace_dir)
    faults = found_faults(found, domain_name(domain, found), kg or ())
    if json:
        print_json([fault.as_json() for fault in faults])
    else:
        console().print(table(faults))
    return FAULTS if any(not fault.hint for fault in faults) else 0


def commit(
    message: Annotated[
        str, typer.Option("-m", "--message", metavar="TEXT", help="What was edited, and why.")
    ] = "",
    domain: DomainOption = None,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Commit what was edited by hand, once it is as sound as what a person teaches."""
    from rich.text import Text

    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session import change

    home = home_of(workspace_dir, domain)
    if not message.strip():
        raise UsageError('say what was edited: adaptbot kg commit -m "the kettle has moved"')
    revision = change.commit_edits(home, message)
    if revision is None:
        console().print(Text("nothing was edited by hand; there is nothing to commit", "dim"))
    else:
        console().print(Text("✓ ", "green") + Text(f"committed as {revision[:7]}"))


def split(domain: DomainOption = None, workspace_dir: WorkspaceOption = None) -> None:
    """Divide a large home's files of facts into many, by class or as its domain.ttl says."""
    from rich.text import Text

    from adaptbot_cli.session import change

    home = home_of(workspace_dir, domain)
    revision = change.split_files(home)
    if revision is None:
        console().print(Text("the files are divided so already; there is nothing to do", "dim"))
    else:
        console().print(Text("✓ ", "green") + Text(f"committed as {revision[:7]}"))
