"""`adaptbot runs`, `replay`, `progress`, `resume`: what was run here."""

from pathlib import Path
from typing import Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    JsonOption,
    MaxCostOption,
    MaxTokensOption,
    TimeoutOption,
    WorkspaceOption,
    console,
    domain_name,
    note,
    opened,
    print_json,
    workspace,
)
from adaptbot_cli.cli.help import OUTPUT
from adaptbot_cli.cli.run import pursue


def runs(
    task: Annotated[
        str, typer.Argument(metavar="[TASK]", help="Only runs whose task has these words.")
    ] = "",
    last: Annotated[
        int, typer.Option("--last", min=1, metavar="N", help="So many, the newest (20).")
    ] = 20,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """List the runs of this home: when, what, by whom planned, and what it came to.

    The id is what `resume`, `progress`, `export` and `replay` take, or the beginning of it.
    """
    from adaptbot_cli.session.runs import found_runs

    home = workspace(workspace_dir)
    found = found_runs(home, task, last)
    if json:
        print_json({"runs": [run.as_json() for run in found]})
        return
    if not found:
        text = f"no run of {task}" if task else "no run"
        typer.echo(f"{text} is recorded in {home.root}", err=True)
        return
    console().print(_table(found))


def _table(found: Any) -> Any:
    from adaptbot_cli.adapters.display.words import columns, plain_text

    table = columns(None, None, None, None)
    table.columns[0].no_wrap = True
    for run in found:
        style = "green" if run.goal_met else "" if run.outcome else "yellow"
        table.add_row(
            plain_text(run.id.partition("-")[0], "dim"),
            plain_text(run.task),
            plain_text(run.planner, "dim"),
            plain_text(run.told, style),
        )
    return table


DIFFERS = 3


def replay(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE…", help="Transcripts.", autocompletion=completion.runs),
    ],
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Replay transcripts: no key, no network; fails at the first turn that differs."""
    from rich.text import Text

    from adaptbot_cli import session
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.errors import ReplayError

    home = workspace(workspace_dir)
    out = console()
    failed = 0
    for path in files:
        try:
            result = session.replay(path, home)
        except ReplayError as error:
            failed += 1
            out.print(Text("✗ ", "red") + Text(visible(str(error))), soft_wrap=True)
            continue
        goal = "goal met" if result.goal_met else "goal not met"
        out.print(Text("✓ ", "green") + Text(f"{path}: {result.verdict}, {goal}"), soft_wrap=True)
    return DIFFERS if failed else 0


def progress(
    run: Annotated[
        str | None,
        typer.Argument(
            metavar="[RUN|TRANSCRIPT]",
            help="A run by the beginning of its name or task, or a file; else the latest run.",
            autocompletion=completion.runs,
        ),
    ] = None,
    svg: Annotated[
        Path | None,
        typer.Option(metavar="FILE", rich_help_panel=OUTPUT, help="Write the lines as a picture."),
    ] = None,
    mermaid: Annotated[
        bool,
        typer.Option(
            "--mermaid", rich_help_panel=OUTPUT, help="Print the lines as a Mermaid flowchart."
        ),
    ] = False,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Show what became of each thing: its places, its states, what it was combined with."""
    from adaptbot_cli.adapters import progress as pictures
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session.runs import find_run, retrace

    if json and mermaid:
        raise UsageError("--json and --mermaid both want stdout: give one of them")
    home = workspace(workspace_dir)
    lines = retrace(find_run(home, run), home)
    if svg is not None:
        try:
            svg.write_text(pictures.svg(lines), encoding="utf-8")
        except OSError as error:
            raise UsageError(f"cannot write {svg}: {error.strerror}") from error
        console(stderr=True).print(f"written to {svg}", markup=False, soft_wrap=True)
    if json:
        print_json(lines.as_json())
    elif mermaid:
        typer.echo(pictures.mermaid(lines), nl=False)
    elif svg is None:
        out = console()
        out.print(pictures.progress_lines(lines, out.width))


_ORIGIN = "the interrupted run"
"""Where the model comes from, unless that run did not tell it."""


def resume(
    run: Annotated[
        str,
        typer.Argument(
            metavar="[ID]",
            help="A transcript; without it, the latest cut off.",
            autocompletion=completion.runs,
        ),
    ] = "",
    timeout: TimeoutOption = None,
    max_tokens: MaxTokensOption = None,
    max_cost: MaxCostOption = None,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Go on with a run that was cut off, from the answers it had.

    Its limits hold on, and what it has spent of tokens and dollars counts.
    """
    from rich.text import Text

    from adaptbot_cli import session
    from adaptbot_cli.core.visible import visible

    home = workspace(workspace_dir)
    path = session.cut_off(home, run)
    header = session.header_of(path)
    domain = domain_name(_text(header, "domain") or None, home)
    screen = console(stderr=json)
    screen.print(Text(visible(f"going on with {path.stem}"), "dim"), soft_wrap=True)
    record = session.guarded(header)
    own = session.is_own(path, header)
    if not own:
        its = ", ".join(["answers", *record])
        note(f"{path} is of no run of yours: its {its} ignored until `adaptbot trust {path}`")
        record = {"model": "library"} if record.get("model") == "library" else {}
    model, base = _text(record, "model") or None, _text(record, "api_base") or None
    chosen = opened(screen, home, _text(header, "task"), domain, model, base, _ORIGIN)
    limits = {**home.settings, **record} if not own else record
    request = session.Request(
        task=_text(header, "task"),
        domain=domain,
        chosen=chosen,
        policy=header.get("policy", "tutor"),
        replans=min(header.get("replans", 3), 20),
        requires=tuple(header.get("requires") or ()),
        without=tuple(header.get("without") or ()),
        apply=own and header.get("apply") is True,
        timeout=timeout if timeout is not None else limits.get("timeout"),
        max_tokens=max_tokens if max_tokens is not None else limits.get("max_tokens"),
        max_cost=max_cost if max_cost is not None else limits.get("max_cost"),
        temperature=header.get("temperature", 0.0),
        seed=header.get("seed", 0),
        full=header.get("full") is True,
        edit=header.get("edit") is True,
        resumes=path,
        world=record.get("world"),
        noise=header.get("world_noise", 0.0),
        act_timeout=header.get("act_timeout", 60.0),
        confirm=header.get("confirm", "none"),
        prompt=_text(header, "prompt") or "auto",
    )
    return pursue(request, home, json)


def _text(header: Any, key: str) -> str:
    return str(header.get(key) or "")
