"""Teaching a thing without a task: existence is known; kind, place and attributes are asked."""

from collections.abc import Generator
from typing import Any

from adaptbot_cli.core.ask import agenda
from adaptbot_cli.core.ask.dialogue import ask_about, keep
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.journal import GoBack, Journal
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.run import Parse, Run, retract_all
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Turn
from adaptbot_cli.core.view.facts import called

Turns = Generator[Turn, Any, tuple[tuple[Lesson, ...], str | None]]


def teach_thing(name: str, kg: Kg, parse: Parse) -> Turns:
    """Ask what a thing is, where it is kept and what is true of it; return lessons and revision.

    A thing that is known already is asked what is not known of it yet. The person may go back. The
    revision is None if nothing was kept: nothing was answered, or the review was refused.
    """
    task = Task(f"add {normal(name)}")
    journal = Journal()
    while True:
        run = Run(kg, task, parse, Scene(kg, task), full=True)
        try:
            return (yield from journal.play(_teach(name, run)))
        except GoBack as back:
            retract_all(run)
            journal.reopen(back.to)


def _teach(name: str, run: Run) -> Turns:
    report = Report(run.task, "", (), (), (), ())
    if not called(run.kg, name):
        kinds = run.kg.domain.teachable
        report = yield from ask_about(run, report, agenda.what_is(normal(name), kinds, ""))
    for question in agenda.open_questions(normal(name), run.scene):
        if question.key not in run.asked and not run.stopped:
            report = yield from ask_about(run, report, question)
    found = tuple(run.lessons)
    yield from keep(run)
    return (tuple(run.kept) if run.revision else found), run.revision
