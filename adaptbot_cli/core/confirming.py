"""What a person confirms before a plan is made: how the request is read, what its goal is."""

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

from adaptbot_cli.core import teach
from adaptbot_cli.core.learning import Lesson, alias
from adaptbot_cli.core.names import nearest, normal, sentence_list
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.questions import LATER, NO, SAME, YES, Answer, Choice, Question
from adaptbot_cli.core.request import Reading
from adaptbot_cli.core.run import Run
from adaptbot_cli.core.turns import Ask, Learned, Turn

Asked = list[tuple[Question, Answer]]

_MOST_NAMES = 100


def confirmed(
    text: str, read: Callable[[str], Reading]
) -> Generator[Turn, Any, tuple[Reading, Asked]]:
    """Read a request; have the person confirm the reading if something in it is in doubt.

    Another task can be named instead: what the request excludes holds for that one too. Whoever
    says that the reading is wrong is taken at their word: nothing is done.
    """
    reading = read(text)
    if not reading.doubts:
        return reading, []
    names = [name.replace("_", " ") for name in reading.names]
    question = Question(
        "reading",
        normal(text),
        f"Do you mean this: {reading.meant}?",
        choices=(
            Choice(YES, "yes, that is all I mean", key="y"),
            Choice(SAME, "no, another task", key="a"),
            Choice(NO, "no, do nothing", key="n"),
            Choice(LATER.value, "ask me later", "the goal stays open", "l"),
        ),
        known=tuple(nearest(text, names, _MOST_NAMES, floor=0.0)),
        notes=reading.doubts,
    )
    answer: Answer = yield Ask(question)
    asked = [(question, answer)]
    if answer.value == YES:
        return reading.confirmed(), asked
    if answer.value == NO:
        return replace(reading, tasks=(), refused=reading.meant), asked
    if answer.same_as:
        return _instead(reading, read(answer.same_as)), asked
    return reading, asked


def _instead(reading: Reading, other: Reading) -> Reading:
    """Another task in place of the one that was read, with all that was excluded."""
    first, others = reading.tasks[:1], reading.tasks[1:]
    tasks = list(other.tasks)
    for old in first:
        for n, task in enumerate(tasks):
            out = {
                "excluded": tuple(dict.fromkeys((*old.excluded, *task.excluded))),
                "barred": old.barred | task.barred,
                "rules": tuple(dict.fromkeys((*old.rules, *task.rules))),
                "refused": tuple(dict.fromkeys((*old.refused, *task.refused))),
                "amount": max(old.amount, task.amount),
            }
            kept = tuple(name for name in task.required if normal(name) not in old.barred)
            tasks[n] = replace(task, required=kept, **out)  # type: ignore[arg-type]
    return replace(reading, tasks=(*tasks, *others)).confirmed()


def judged(run: Run) -> Generator[Turn, Any, None]:
    """Have the person say by what goal a task is judged that none is known for, and keep that.

    What is offered are the goals of a class of tasks that word knowledge relates it to.
    """
    task = run.task
    likely = [run.kg.domain.task_classes[name] for name in task.like]
    if not task.thin or not likely:
        return
    other = likely[0]
    needs = tuple(goal.message.replace("{item}", "something") for goal in other.goals)
    question = Question(
        "goal",
        normal(task.name),
        f'I know no goal for "{task.name}". Shall I judge it as I judge {other.name}?',
        choices=(
            Choice(YES, f"yes, as {other.name}", "I remember it", "y"),
            Choice(NO, "no", "the goal stays unknown", "n"),
            Choice(LATER.value, "ask me later", key="l"),
        ),
        notes=(f"{other.name} fails where {sentence_list(needs)}",),
    )
    answer: Answer = yield Ask(replace(question, answered=tuple(run.asked.values())))
    run.asked[question.key] = (question, answer)
    if answer.value == LATER.value:
        return
    run.usage = replace(run.usage, questions=run.usage.questions + 1)
    if answer.value == YES and other.iri is not None:
        lesson = Lesson(
            alias(run.kg, task.name, other.iri),
            question,
            answer,
            f"{task.name} is judged as {other.name}",
        )
        teach.take(lesson, run.scene)
        run.lessons.append(lesson)
        yield Learned(lesson)
        run.task = run.scene.task = judged_as(task, other)


def judged_as(task: Task, other: Task) -> Task:
    """Return a task with the goals of a class of tasks."""
    return replace(task, goals=other.goals, iri=other.iri, judged_by=other.name, thin=False)
