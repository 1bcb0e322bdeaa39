"""Plans changed by hand, and what the method makes of that."""

import pytest

from adaptbot_cli.core.ask.edit import Edit, edited, lines
from adaptbot_cli.core.ask.questions import Answer, Question, back
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.turns import Amend, Executed
from adaptbot_cli.errors import UsageError
from tests.driving import Script, drive
from tests.worlds import GOOD, scene, workshop

PLAN = 'take_part("board")\nput("board", "bench")\ndrill_hole("board", "drill")\n'


def checked(text: str) -> Report:
    return examine(parse(text), text, scene(workshop(), "board"))


def after(text: str, edit: Edit) -> list[str]:
    return edited(edit, checked(text), parse).splitlines()


def test_only_what_the_plan_writes_can_be_edited_by_the_numbers_on_the_screen() -> None:
    report = checked(PLAN)
    assert [step.status for step in report.steps] == [
        "inserted", "ok", "ok", "inserted", "ok",
    ]  # fmt: skip
    assert [line.number for line in lines(report)] == [2, 3, 5]


@pytest.mark.parametrize(
    ("edit", "wanted"),
    [
        (Edit("drop", 3), ['take_part("board")', 'drill_hole("board", "drill")']),
        (
            Edit("replace", 3, text="put(board, cupboard)"),
            ['take_part("board")', 'put("board", "cupboard")', 'drill_hole("board", "drill")'],
        ),
        (
            Edit("insert", 1, text="open(cupboard)"),
            ['open("cupboard")', *PLAN.splitlines()],
        ),
        (Edit("insert", 6, text="wait(5)"), [*PLAN.splitlines(), "wait(5)"]),
        (
            Edit("move", 5, 2),
            ['drill_hole("board", "drill")', 'take_part("board")', 'put("board", "bench")'],
        ),
        (
            Edit("move", 2, 6),
            ['put("board", "bench")', 'drill_hole("board", "drill")', 'take_part("board")'],
        ),
        (Edit("move", 3, 4), PLAN.splitlines()),
    ],
)
def test_an_edit_gives_a_new_plan(edit: Edit, wanted: list[str]) -> None:
    assert after(PLAN, edit) == wanted


def test_what_is_not_touched_stays_as_it_was_written() -> None:
    text = 'take_part("the boards")\nbore("board")\nwait("ten minutes")'
    [last] = [n for n, step in enumerate(checked(text).steps, 1) if step.call.action == "wait"]
    assert after(text, Edit("drop", last)) == ['take_part("the boards")', 'bore("board")']


def test_one_of_several_steps_that_a_call_stands_for_can_be_edited() -> None:
    text = "open(cupboard)\ntake_part(all)"
    report = examine(parse(text), text, scene(workshop(), "board", "plank"))
    several = [n for n, s in enumerate(report.steps, 1) if s.place == 1]
    assert len(several) == 2
    new = edited(Edit("drop", several[0]), report, parse)
    assert len(new.splitlines()) == 2 and "all" not in new


@pytest.mark.parametrize(
    "edit",
    [
        Edit("drop", 1),  # inserted
        Edit("drop", 9),
        Edit("move", 2, 0),
        Edit("insert", 99, text="wait(5)"),
        Edit("replace", 2, text="just do it"),
        Edit("replace", 2, text=""),
        Edit("reject", text="no"),
    ],
)
def test_an_edit_that_cannot_be_made_is_refused(edit: Edit) -> None:
    with pytest.raises(UsageError):
        after(PLAN, edit)


STUCK = "take_part(board)\nput(board, bench)\nsell(board)"


def story(texts: list[str], edits: list[Edit], **answers: str) -> tuple[Script, str]:
    script = Script(texts, {k.replace("__", " "): v for k, v in answers.items()}, edits=edits)
    result = drive(Task("work", ("board",)), workshop(), script, replans=0, parse=parse)
    return script, result.verdict


def test_findings_that_no_question_solves_can_be_edited_away() -> None:
    step = 4
    script, verdict = story([STUCK], [Edit("drop", step)])
    whys = [turn.why for turn in script.seen if isinstance(turn, Amend)]
    assert whys == ["open", "ready"]
    assert verdict == "executable"


def test_a_plan_with_nothing_open_is_offered_before_its_execution_only() -> None:
    script, _ = story([GOOD], [])
    assert [turn.why for turn in script.seen if isinstance(turn, Amend)] == ["ready"]


def test_an_edit_may_raise_new_questions() -> None:
    edit = Edit("replace", 4, text="press(slab, 3)")
    script, verdict = story([STUCK], [edit], existence__slab="is board")
    assert script.story.count("ask existence slab") == 1
    assert verdict == "executable"


def test_a_rejected_plan_is_not_carried_out_where_there_is_no_other() -> None:
    script, verdict = story([GOOD, GOOD], [Edit("reject", text="not today")])
    assert verdict == "findings"
    assert not any(isinstance(turn, Executed) for turn in script.seen)


def test_a_new_plan_that_loses_a_required_item_is_refused_after_a_rejection_too() -> None:
    script, _ = story([STUCK, "wait(5)"], [Edit("reject", text="no")])
    last = [turn.report for turn in script.seen if isinstance(turn, Amend)][-1]
    assert "E502" in {finding.code for finding in last.findings}
    assert last.text == STUCK


class Returning(Script):
    """Edits the plan instead of answering about the plank, then goes back to the slab."""

    about_plank = 0

    def answer(self, question: Question) -> Answer:
        if question.about != "plank":
            return Answer("is board" if not self.about_plank else "is anvil")
        self.about_plank += 1
        slab = ("existence", "slab", "", "item")
        return [Answer("edit"), back(slab), Answer("yes")][self.about_plank - 1]


def test_an_edit_stands_when_the_person_goes_back_to_an_earlier_question() -> None:
    plan = "press(slab, 3)\nsell(board)\ndrill_hole(plank)"
    script = Returning([plan], edits=[Edit("drop", 2)])
    result = drive(Task("work"), workshop(), script, replans=0, parse=parse)
    assert "sell" not in result.report.text
    assert script.story.count("propose 0") == 1
    assert [lesson.sentence for lesson in result.lessons] == [
        "slab is another name for anvil",
        "plank: drillable yes",
    ]
