"""`adaptbot run`: pursue a task."""

import os
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from adaptbot_cli.cli import completion
from adaptbot_cli.cli.common import (
    ANYWHERE,
    FINDINGS,
    UNLIMITED,
    ActTimeoutOption,
    AnswersOption,
    ApiBaseOption,
    JsonOption,
    LimitOptions,
    Place,
    RequiresOption,
    RobotOption,
    WithoutOption,
    console,
    domain_name,
    items,
    note,
    opened,
    print_json,
    terminal,
    workspace,
)
from adaptbot_cli.cli.help import model_option, output_option, person_option, world_option
from adaptbot_cli.errors import Interrupted, WorldError

if TYPE_CHECKING:
    from adaptbot_cli.core.report import Result
    from adaptbot_cli.session.build import Request, Session
    from adaptbot_cli.workspace import Workspace

PromptOption = Annotated[
    Literal["auto", "cot", "plain", "schema"],
    model_option(help="How to ask for a plan: reasoning first, calls alone, JSON."),
]


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
    limits: LimitOptions = UNLIMITED,
    temperature: Annotated[
        float | None, model_option(min=0, max=2, help="How freely the model answers (0).")
    ] = None,
    seed: Annotated[
        int | None, model_option(metavar="N", help="The seed of the model's answers (0).")
    ] = None,
    prompt: PromptOption = "auto",
    policy: Annotated[
        Literal["tutor", "paper"] | None,
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
        Literal["each", "irreversible", "none"] | None,
        world_option(help="Which steps to agree to before they are done."),
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
    place: Place = ANYWHERE,
    robot: RobotOption = "",
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
    home = workspace(place.workspace_dir)  # without the graph: the first line waits for nothing
    named = domain_name(place.domain, home)
    screen = console(stderr=json)
    chosen = opened(screen, home, asked, named, model, api_base, robot=robot)
    from adaptbot_cli.session.build import Request  # slow: the first line is there by now

    request = Request(
        task=asked,
        domain=named,
        robot=robot,
        chosen=chosen,
        policy=home.setting("policy", policy),
        replans=home.setting("replans", replans),
        requires=items(requires),
        without=items(without),
        ask=not no_human,
        answers=answers,
        dry_run=dry_run,
        apply=apply,
        record=record,
        **{name: home.setting(name, given) for name, given in asdict(limits).items()},
        temperature=home.setting("temperature", temperature),
        seed=home.setting("seed", seed),
        full=full,
        edit=edit,
        world=home.setting("world", world),
        world_noise=world_noise or 0.0,
        act_timeout=home.setting("act_timeout", act_timeout),
        confirm=home.setting("confirm", confirm),
        prompt=prompt,
    )
    return pursue(request, home, json)


def pursue(request: "Request", home: "Workspace", json: bool) -> int:
    """Pursue what is asked for, in this terminal; return the exit code."""
    from rich.text import Text

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
            from adaptbot_cli.core.view.summary import summary

            planner, world = session.ports.planner.name, session.screen.world
            record = summary(result, session.kg, planner, session.revisions, world)
            record["usage"]["seconds"] = round(time.monotonic() - started, 3)
            print_json(record)
        else:
            session.screen.finish(result, result.revision)
            if not request.dry_run:
                kept = f"state kept as {session.state[:7]} · " if session.state else ""
                screen.print(Text(f"  {kept}knowledge in {home.root}", "dim"))
        if session.stopped:
            note(f"stopped; to go on from here: adaptbot resume{_named(session, home)}", screen)
        for sentence in session.unused():
            note(sentence, screen)
    return exit_code(result)


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
