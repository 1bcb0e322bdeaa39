"""The questions that several plans wait for: found, ranked, answered in one sitting."""

from collections.abc import Generator
from typing import Any

from adaptbot_cli.core.ask.pending import Pending, Sitting, Waiting, listed, sitting
from adaptbot_cli.core.ask.questions import STOP, Answer
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Ask
from tests.driving import Script, played
from tests.worlds import facts, workshop

SLAB = Waiting(Task("one", ("slab",)), "press(slab, 3)\ndrill_hole(plank)")
BOTH = Waiting(Task("two"), "press(slab, 3)\npress(slab, 4)\npolish(board)\nwait(5)")
HOME = {"existence slab": "exists", "place slab": "bench"}
REST = {"attribute plank drillable": "yes", "existence polish": "absent"}


def run(turns: Generator[Any, Any, Any], kg: Kg, script: Script) -> Any:
    return played(turns, lambda turn: script.reply(turn, kg))


def pending(*waiting: Waiting, kg: Kg | None = None) -> list[Pending]:
    there = kg or workshop()
    found: list[Pending] = run(listed(waiting, there, parse), there, Script([]))
    return found


def sat(kg: Kg, answers: Any, *waiting: Waiting, accept: bool = True) -> tuple[Sitting, Script]:
    script = Script([], answers, accept=accept)
    return run(sitting(waiting, kg, parse), kg, script), script


def test_what_most_tasks_and_steps_wait_for_comes_first() -> None:
    found = pending(SLAB, BOTH)
    told = [(each.question.about, each.tasks, each.steps) for each in found]
    assert told == [
        ("slab", ("one", "two"), 3),
        ("plank", ("one",), 1),
        ("polish", ("two",), 1),
    ]
    assert "edit" not in {choice.value for choice in found[0].question.choices}


def test_what_the_graph_knows_by_now_is_not_open() -> None:
    known = workshop(attributes='w:slab a w:part ; w:called "slab" .')
    assert "slab" not in {each.question.about for each in pending(SLAB, BOTH, kg=known)}


def test_what_nobody_could_say_is_not_open() -> None:
    key = ("attribute", "plank", "drillable", "item")
    waiting = Waiting(SLAB.task, SLAB.plan, frozenset({key}))
    assert [each.question.about for each in pending(waiting)] == ["slab"]


def test_one_answer_serves_every_task_that_waits_for_it() -> None:
    kg = workshop()
    came, script = sat(kg, {**HOME, **REST}, SLAB, BOTH)
    asked = [turn.question.about for turn in script.seen if isinstance(turn, Ask)]
    assert asked == ["slab", "slab", "plank", "polish"]
    assert came.still == ()
    assert came.revision == "r1"
    assert [result.verdict for result in came.results] == ["executable", "executable"]


def test_a_sitting_that_is_stopped_keeps_what_was_answered() -> None:
    class Stopping(Script):
        def answer(self, question: Any) -> Answer:
            return STOP if question.about == "plank" else super().answer(question)

    kg = workshop()
    script = Stopping([], {**HOME, **REST})
    came = run(sitting((SLAB, BOTH), kg, parse), kg, script)
    assert {lesson.question.about for lesson in came.lessons} == {"slab"}
    assert {each.question.about for each in came.still} == {"plank", "polish"}
    assert came.revision == "r1"


def test_what_is_put_off_stays_open_and_what_is_not_known_does_not() -> None:
    kg = workshop()
    answers = {**HOME, "attribute plank drillable": "unknown", "existence polish": "later"}
    came, _ = sat(kg, answers, SLAB, BOTH)
    assert [each.question.about for each in came.still] == ["polish"]


def test_refused_answers_change_nothing() -> None:
    kg = workshop()
    before = facts(kg)
    came, _ = sat(kg, {**HOME, **REST}, SLAB, BOTH, accept=False)
    assert facts(kg) == before
    assert came.lessons == () and came.revision is None
    assert len(came.still) == 3
