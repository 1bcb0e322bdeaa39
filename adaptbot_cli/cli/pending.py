"""`adaptbot pending`: the questions that runs have left open, and their answers."""

from typing import TYPE_CHECKING, Any

import typer

from adaptbot_cli.cli.common import (
    ANYWHERE,
    FINDINGS,
    AnswersOption,
    JsonOption,
    Place,
    console,
    print_json,
    terminal,
)
from adaptbot_cli.cli.help import Group
from adaptbot_cli.cli.kg.sharing import plain_question, show_conflicts

if TYPE_CHECKING:
    from adaptbot_cli.core.ask.pending import Pending, Sitting
    from adaptbot_cli.session.open_questions import Open

app = typer.Typer(
    cls=Group, help="The questions that runs have left open.", invoke_without_command=True
)


@app.callback()
def pending(
    context: typer.Context,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> None:
    """List the open questions, with the tasks and steps that wait for each, most useful first."""
    if context.invoked_subcommand is not None:
        return
    from adaptbot_cli.adapters.display.sittings import listing
    from adaptbot_cli.session.open_questions import find_open
    from adaptbot_cli.session.sync import disputes

    home = place.home()
    found = find_open(home.workspace, home.domain)
    remote, conflicts = disputes(home.workspace, home.domain)
    if json:
        record = {"domain": found.kg.domain.name, "questions": _questions(found.pending)}
        plain = [plain_question(question) for question in conflicts]
        print_json(record | ({"remote": remote, "conflicts": plain} if conflicts else {}))
        return
    out = console()
    if found.pending:
        out.print(listing(found.pending))
    if conflicts:
        show_conflicts(conflicts, f"adaptbot kg sync {remote}")
    _show(found)


def _show(found: "Open") -> None:
    """Say how much waits, here and in other domains, and how to answer it."""
    from rich.text import Text

    name = found.kg.domain.name
    tasks = {task for each in found.pending for task in each.tasks}
    text = f"{name}: no question is open"
    if found.pending:
        text = f"{name}: {len(found.pending)} open, {len(tasks)} waiting: "
        text += f"adaptbot pending answer --domain {name}"
    others = [f"{other} ({count})" for other, count in sorted(found.others.items())]
    text += f"; see --domain for {', '.join(others)}" if others else ""
    console().print(Text(text, "dim"))


def _questions(pending: "list[Pending] | Any") -> list[dict[str, Any]]:
    return [
        {
            "about": each.question.about,
            "kind": each.question.kind,
            "prop": each.question.prop or None,
            "subject": each.question.subject,
            "text": each.question.text,
            "answers": [choice.value for choice in each.question.choices],
            "tasks": list(each.tasks),
            "steps": each.steps,
        }
        for each in pending
    ]


@app.command("answer")
def answer_pending(
    answers: AnswersOption = None,
    place: Place = ANYWHERE,
    json: JsonOption = False,
) -> int:
    """Answer the open questions in one sitting, and see which tasks can be done then."""
    from adaptbot_cli.adapters.display.sittings import SittingScreen, came_of
    from adaptbot_cli.errors import Interrupted, UsageError
    from adaptbot_cli.session.open_questions import answer, find_open, sit_down

    home = place.home()
    prompts = terminal()
    if answers is None and prompts is None:
        raise UsageError("nobody is at a terminal to answer; give --answers FILE")
    found = find_open(home.workspace, home.domain)
    if not found.pending:
        print_json({"learned": [], "tasks": [], "still": []}) if json else _show(found)
        return 0
    screen = SittingScreen(console(stderr=json))
    with sit_down(found, home.workspace, answers, prompts, [screen]) as ports:
        try:
            came = answer(found, ports)
        except KeyboardInterrupt:
            text = "interrupted; nothing was committed. To go on: adaptbot pending answer"
            raise Interrupted(text) from None
    if json:
        print_json(_summary(came))
    else:
        out = console()
        out.print()
        out.print(came_of(came))
    return 0 if all(result.goal_met for result in came.results) else FINDINGS


def _summary(came: "Sitting") -> dict[str, Any]:
    return {
        "answered": came.answered,
        "learned": [lesson.sentence for lesson in came.lessons],
        "revision": came.revision,
        "tasks": [
            {
                "task": result.report.task.name,
                "outcome": result.verdict,
                "goal": result.goal_met,
                "waits": sum(result.report.task.name in each.tasks for each in came.still),
            }
            for result in came.results
        ],
        "still": _questions(came.still),
    }
