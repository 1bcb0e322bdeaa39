"""`adaptbot runs`, `replay`, `progress`, `resume`: what was run here."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    FINDINGS,
    UNLIMITED,
    JsonOption,
    LimitOptions,
    WorkspaceOption,
    console,
    domain_name,
    note,
    opened,
    print_json,
    workspace,
    write_out,
)
from adaptbot_cli.cli.help import Group, output_option
from adaptbot_cli.cli.run import pursue

if TYPE_CHECKING:
    from rich.console import RenderableType

    from adaptbot_cli.session.past_runs import PastRun, RunDetails


class _ListByDefault(Group):
    """Takes `runs WORDS` for `runs list WORDS`."""

    default = "list"


app = typer.Typer(cls=_ListByDefault, help="What was run in this home, newest first.")

RunArgument = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help="A run by the beginning of its id or task, or a transcript's file.",
        autocompletion=completion.runs,
    ),
]


@app.command("list")
def list_runs(
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

    `adaptbot runs WORDS` is `adaptbot runs list WORDS`. Wherever a run is named, its id will do, or
    as much of the beginning of it as no other has.
    """
    from adaptbot_cli.session.past_runs import found_runs

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


@app.command("show")
def show_run(
    run: RunArgument, json: JsonOption = False, workspace_dir: WorkspaceOption = None
) -> None:
    """Show one run: its plan as it was checked, what was asked, and what was learned."""
    from adaptbot_cli.session.past_runs import details, find_run

    home = workspace(workspace_dir)
    found = details(home, find_run(home, run))
    if json:
        print_json(found.as_json())
    else:
        console().print(_sheet([found]))


@app.command("compare")
def compare_runs(
    before: Annotated[str, typer.Argument(metavar="A", autocompletion=completion.runs)],
    after: Annotated[str, typer.Argument(metavar="B", autocompletion=completion.runs)],
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Compare two runs: planner, outcome, the steps that differ, what was asked and learned."""
    from adaptbot_cli.session.past_runs import details, differing_steps, find_run

    home = workspace(workspace_dir)
    found = [details(home, find_run(home, name)) for name in (before, after)]
    if json:
        steps = [{"n": list(n), "a": a, "b": b} for n, a, b in differing_steps(*found)]
        print_json({"a": found[0].as_json(), "b": found[1].as_json(), "steps": steps})
    else:
        console().print(_sheet(found))


def _table(found: "list[PastRun]") -> "RenderableType":
    from adaptbot_cli.adapters.display.cells import columns, plain_text

    table = columns(None, None, None, None)
    table.columns[0].no_wrap = True
    for run in found:
        table.add_row(
            plain_text(run.short, "dim"),
            plain_text(run.task),
            plain_text(run.planner, "dim"),
            plain_text(run.told, "green" if run.goal_met else "" if run.outcome else "yellow"),
        )
    return table


def _sheet(found: "list[RunDetails]") -> "RenderableType":
    """One run, or two side by side: of two only the steps that differ."""
    from rich.console import Group
    from rich.text import Text

    from adaptbot_cli.adapters.display.cells import count

    names = ["A", "B"] if len(found) > 1 else [""]
    runs = [each.run for each in found]
    head = [
        ("run", [f"{name} {run.short}".strip() for name, run in zip(names, runs, strict=True)]),
        ("task", [run.task for run in runs]),
        ("domain", [run.domain for run in runs]),
        ("robot", [run.robot for run in runs]),
        ("planner", [run.planner for run in runs]),
        ("policy", [each.policy for each in found]),
        ("without", [", ".join(each.without) for each in found]),
        ("requires", [", ".join(each.requires) for each in found]),
        ("world", [run.world for run in runs]),
        ("tokens", [str(each.tokens or "") for each in found]),
        ("outcome", [run.told for run in runs]),
        ("plan", [count(len(each.steps), "step") for each in found]),
    ]
    questions = dict.fromkeys(text for each in found for text in each.questions)
    asked = []
    for text in questions:
        answers = [each.questions.get(text, "not asked") for each in found]
        told = " · ".join(f"{n} {a}".strip() for n, a in zip(names, answers, strict=True))
        asked += [("", text), ("", f"→ {told}")]
    lessons = dict.fromkeys(text for each in found for text in each.learned)
    learned = [
        (" ".join(n for n, each in zip(names, found, strict=True) if text in each.learned), text)
        for text in lessons
    ]
    parts = [_rows([(name, *values) for name, values in head if any(values)])]
    for title, rows in (
        ("steps" if len(found) == 1 else "steps that differ", _steps(found)),
        ("asked", asked),
        ("learned", learned),
    ):
        parts += [Text(), Text(title, "bold"), _rows(rows)] if rows else []
    return Group(*parts)


def _steps(found: "list[RunDetails]") -> list[tuple[str, ...]]:
    from adaptbot_cli.session.past_runs import differing_steps

    if len(found) > 1:
        return [
            (f"{m or '-':>3} {n or '-':>3}", a or "-", b or "-")
            for (m, n), a, b in differing_steps(*found)
        ]
    parted = [step.partition(": ") for step in found[0].steps]
    return [
        (f"{n:>3}", call if how == "ok" else f"{call}  ({how})")
        for n, (how, _, call) in enumerate(parted, start=1)
    ]


def _rows(rows: Sequence[tuple[str, ...]]) -> Any:
    """Rows of which the first cell is a label; the others share what there is of the width."""
    from adaptbot_cli.adapters.display.cells import Wrapped, columns, plain_text

    table = columns(*([None] * max(map(len, rows))))
    table.columns[0].no_wrap, table.columns[0].min_width = True, 7
    for name, *values in rows:
        cells = [Wrapped(plain_text(value, "", 300)) for value in values]
        table.add_row(plain_text(name, "dim"), *cells)
    return table


def replay(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="RUN|FILE…",
            help="Runs by the beginning of their id, or transcripts.",
            autocompletion=completion.runs,
        ),
    ],
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Replay transcripts: no key, no network; fails at the first turn that differs."""
    from adaptbot_cli.adapters.display.cells import BAD, GOOD, noted
    from adaptbot_cli.errors import ReplayError
    from adaptbot_cli.session import replay
    from adaptbot_cli.session.past_runs import find_run

    home = workspace(workspace_dir)
    out = console()
    failed = 0
    for name in files:
        path = Path(name) if Path(name).suffix else find_run(home, name)
        try:
            result = replay.replay(path, home)
        except ReplayError as error:
            failed += 1
            out.print(noted(BAD, str(error), longest=len(str(error))), soft_wrap=True)
            continue
        goal = "goal met" if result.goal_met else "goal not met"
        out.print(noted(GOOD, f"{path}: {result.verdict}, {goal}"), soft_wrap=True)
    return FINDINGS if failed else 0


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
        Path | None, output_option(metavar="FILE", help="Write the lines as a picture.")
    ] = None,
    mermaid: Annotated[
        bool, output_option("--mermaid", help="Print the lines as a Mermaid flowchart.")
    ] = False,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> None:
    """Show what became of each thing: its places, its states, what it was combined with."""
    from adaptbot_cli.adapters.display import progress_lines as pictures
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.session.past_runs import find_run, retrace

    if json and mermaid:
        raise UsageError("--json and --mermaid both want stdout: give one of them")
    home = workspace(workspace_dir)
    lines = retrace(find_run(home, run), home)
    if svg is not None:
        write_out(svg, pictures.svg(lines))
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
    given: LimitOptions = UNLIMITED,
    json: JsonOption = False,
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Go on with a run that was cut off, from the answers it had.

    Its limits hold on, and what it has spent of tokens and dollars counts.
    """
    from rich.text import Text

    from adaptbot_cli.adapters.transcript.loading import header_of
    from adaptbot_cli.core.visible import visible
    from adaptbot_cli.session import build, past_runs
    from adaptbot_cli.session.sources import robot_of

    home = workspace(workspace_dir)
    path = past_runs.cut_off(home, run)
    header = header_of(path)
    domain = domain_name(_text(header, "domain") or None, home)
    screen = console(stderr=json)
    screen.print(Text(visible(f"going on with {path.stem}"), "dim"), soft_wrap=True)
    record = past_runs.guarded(header)
    own = past_runs.is_own(path, header)
    if not own:
        its = ", ".join(["answers", *record])
        if record != {"model": "library"} or past_runs.answered(path):
            note(f"{path} is of no run of yours: its {its} ignored until `adaptbot trust {path}`")
        record = {"model": "library"} if record.get("model") == "library" else {}
    model, base = _text(record, "model") or None, _text(record, "api_base") or None
    task, robot = _text(header, "task"), robot_of(header)
    chosen = opened(screen, home, task, domain, model, base, _ORIGIN, robot)
    limits = {**home.settings, **record} if not own else record
    options = build.recorded(header, own) | {
        name: limits.get(name) if value is None else value for name, value in asdict(given).items()
    }
    request = build.Request(
        task=task,
        domain=domain,
        robot=robot,
        chosen=chosen,
        replans=min(header.get("replans", 3), 20),
        requires=tuple(header.get("requires") or ()),
        without=tuple(header.get("without") or ()),
        resumes=path,
        world=record.get("world"),
        **options,
    )
    return pursue(request, home, json)


def _text(header: Any, key: str) -> str:
    return str(header.get(key) or "")
