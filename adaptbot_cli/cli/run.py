"""`adaptbot run`: pursue a task."""

import os
import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ActTimeoutOption,
    AnswersOption,
    ApiBaseOption,
    DomainOption,
    JsonOption,
    MaxCostOption,
    MaxTokensOption,
    RequiresOption,
    RobotOption,
    TimeoutOption,
    WithoutOption,
    WorkspaceOption,
    console,
    domain_name,
    items,
    opened,
    print_json,
    terminal,
    workspace,
)
from adaptbot_cli.cli.help import model_option, output_option, person_option, world_option
from adaptbot_cli.errors import Interrupted, WorldError

if TYPE_CHECKING:
    from rich.console import Console

    from adaptbot_cli.core.report import Result
    from adaptbot_cli.session.build import Request, Session
    from adaptbot_cli.workspace import Workspace

FINDINGS = 3


class PolicyName(StrEnum):
    """When the person is asked: early, or after all re-prompts as in the paper."""

    tutor = "tutor"
    paper = "paper"


class PromptName(StrEnum):
    """How a model is asked for a plan: after a chain of thought, alone, or as JSON of a schema."""

    auto = "auto"
    cot = "cot"
    plain = "plain"
    schema = "schema"


PromptOption = Annotated[
    PromptName, model_option(help="How to ask for a plan: reasoning first, calls alone, JSON.")
]


class ConfirmName(StrEnum):
    """Which steps the person agrees to before they are carried out in a world outside."""

    each = "each"
    irreversible = "irreversible"
    none = "none"


def run(
    task: Annotated[
        list[str],
        typer.Argument(
            help='What to do, such as "make omelette".', autocompletion=completion.tasks
        ),
    ],
    requires: RequiresOption = None,
    without: WithoutOption = None,
    model: Annotated[
        str | None,
        model_option(metavar="NAME", help="Any litellm model; `local`: on board; `library`: none."),
    ] = None,
    api_base: ApiBaseOption = None,
    timeout: TimeoutOption = None,
    max_tokens: MaxTokensOption = None,
    max_cost: MaxCostOption = None,
    temperature: Annotated[
        float | None, model_option(min=0, max=2, help="How freely the model answers (0).")
    ] = None,
    seed: Annotated[
        int | None, model_option(metavar="N", help="The seed of the model's answers (0).")
    ] = None,
    prompt: PromptOption = PromptName.auto,
    policy: Annotated[
        PolicyName | None,
        person_option(help="Ask about required items first, or re-prompt first as in the paper."),
    ] = None,
    replans: Annotated[
        int | None,
        model_option(min=0, max=20, metavar="N", help="How often to re-prompt at most (F_max)."),
    ] = None,
    no_human: Annotated[bool, person_option("--no-human", help="Ask nobody.")] = False,
    answers: AnswersOption = None,
    full: Annotated[
        bool, person_option("--full", help="Ask all there is to know of a new thing.")
    ] = False,
    edit: Annotated[
        bool, person_option("--edit", help="Offer the plan for editing before it is executed.")
    ] = False,
    world: Annotated[
        str | None,
        world_option(
            metavar="WORLD",
            help="What carries the plan out: rehearsal, a Turtle FILE, or exec:COMMAND.",
        ),
    ] = None,
    world_noise: Annotated[
        float | None,
        world_option(min=0, max=1, metavar="P", help="How likely a step slips in a Turtle world."),
    ] = None,
    act_timeout: ActTimeoutOption = None,
    confirm: Annotated[
        ConfirmName | None, world_option(help="Which steps to agree to before they are done.")
    ] = None,
    dry_run: Annotated[bool, output_option("--dry-run", help="Write nothing.")] = False,
    apply: Annotated[
        bool, output_option("--apply", help="Commit the state that the executed plan leaves.")
    ] = False,
    record: Annotated[
        Path | None, output_option(metavar="FILE", help="Write the transcript here.")
    ] = None,
    force: Annotated[
        bool, output_option("--force", help="Let --record write over a file.")
    ] = False,
    json: JsonOption = False,
    domain: DomainOption = None,
    robot: RobotOption = "",
    workspace_dir: WorkspaceOption = None,
) -> int:
    """Plan a task, check it against this home, ask what is not known, and learn it."""
    from adaptbot_cli.errors import UsageError

    asked = " ".join(task)
    if not asked.strip():
        raise UsageError('say what to do: adaptbot run "make omelette"')
    if record is not None and record.is_file() and not force:
        raise UsageError(f"{record} is there already; --force writes over it")
    if edit and (answers is not None or no_human or terminal() is None):
        raise UsageError(
            "--edit offers the plan to a person at a terminal, and here nobody is asked; leave out "
            "--edit, or --answers and --no-human"
        )
    home = workspace(workspace_dir)
    named = domain_name(domain, home)
    screen = console(stderr=json)
    chosen = opened(screen, home, asked, named, model, api_base, robot=robot)
    from adaptbot_cli.session.build import Request  # slow: the first line is there by now

    request = Request(
        task=asked,
        domain=named,
        robot=robot,
        chosen=chosen,
        policy=str(home.setting("policy", policy)),  # type: ignore[arg-type]
        replans=home.setting("replans", replans),
        requires=items(requires),
        without=items(without),
        ask=not no_human,
        answers=answers,
        dry_run=dry_run,
        apply=apply,
        record=record,
        timeout=home.setting("timeout", timeout),
        max_tokens=home.setting("max_tokens", max_tokens),
        max_cost=home.setting("max_cost", max_cost),
        temperature=home.setting("temperature", temperature),
        seed=home.setting("seed", seed),
        full=full,
        edit=edit,
        world=home.setting("world", world),
        noise=world_noise or 0.0,
        act_timeout=home.setting("act_timeout", act_timeout),
        confirm=str(home.setting("confirm", confirm)),  # type: ignore[arg-type]
        prompt=prompt.value,
    )
    return pursue(request, home, json)


def pursue(request: "Request", home: "Workspace", json: bool) -> int:
    """Pursue what is asked for, in this terminal; return the exit code."""
    from adaptbot_cli.session.build import build

    screen = console(stderr=json)
    prompts = terminal()
    started = time.monotonic()
    with build(request, home, os.environ, screen, prompts) as session:
        try:
            result = session.run()
        except KeyboardInterrupt:
            raise Interrupted(_interrupted(session, home)) from None
        if json:
            from adaptbot_cli.core.summary import summary

            revisions = tuple(session.revisions)
            record = summary(result, session.kg, session.planner, revisions, session.screen.world)  # type: ignore[arg-type]
            record["usage"]["seconds"] = round(time.monotonic() - started, 3)
            print_json(record)
        else:
            session.screen.finish(result, result.revision)
            if not request.dry_run:
                _show_where(screen, session, home.root)
        if session.stopped:
            _note(screen, f"stopped; to go on from here: adaptbot resume{_named(session, home)}")
        for sentence in session.unused():
            _note(screen, sentence)
    return exit_code(result)


def _note(screen: "Console", text: str) -> None:
    from rich.text import Text

    from adaptbot_cli.core.visible import visible

    screen.print(Text(f"! {visible(text)}", "yellow"), soft_wrap=True)


def _interrupted(session: "Session", home: "Workspace") -> str:
    """What becomes of the answers that were given, and how to go on with them."""
    kept = "nothing was committed"
    if session.acted:
        kept = "what was kept until then, done or seen, stays"
    if session.transcript is None:
        return f"interrupted; {kept}"
    return f"interrupted; {kept}. To go on: adaptbot resume{_named(session, home)}"


def _named(session: "Session", home: "Workspace") -> str:
    """The run's transcript as an argument, unless it is where it is looked for."""
    path = session.transcript
    return "" if path is None or path.parent == home.transcripts else f" {path}"


def _show_where(screen: "Console", session: "Session", root: Path) -> None:
    """Say where the knowledge is kept, and whether the state was kept too."""
    from rich.text import Text

    kept = f"state kept as {session.state[:7]} · " if session.state else ""
    screen.print(Text(f"  {kept}knowledge in {root}", "dim"))


def exit_code(result: "Result") -> int:
    """Return 0 if the plan is executable and meets its goal, 3 if findings remain.

    A run whose robot was stopped by Ctrl-C ends with 130, one whose world was lost with 6.
    """
    if result.goal_met:
        return 0
    from adaptbot_cli.session.build import is_stopped

    errors = [r.outcome.error for r in result.runs or (result,) if r.outcome and r.outcome.error]
    if any(error.code == "E602" for error in errors):
        return WorldError.exit_code
    return Interrupted.exit_code if any(map(is_stopped, errors)) else FINDINGS
