"""The offer to change a plan, in a run: agreed to by itself, edited, gone back on."""

from collections.abc import Generator

import pytest

from adaptbot_cli.adapters.transcript.memory import Memory, RememberingHuman
from adaptbot_cli.core.ask.edit import Edit
from adaptbot_cli.core.ask.questions import EDIT, YES, Answer, Choice, Question, back
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.journal import Journal
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.turns import Ask, Given, Turn
from tests.core.test_mend import LIME_WATER
from tests.driving import Script, drive
from tests.packs import KITCHEN

TASK = Task("lime_water", ("lime", "water"))


@pytest.fixture
def kitchen() -> Kg:
    return KITCHEN.kg()


def offer(plan: str) -> Question:
    return Question("mend", "lime_water", "Shall I?", plan, choices=(Choice(YES, "yes"),))


def asking(question: Question) -> Generator[Turn, Answer, str]:
    return (yield Ask(question)).value


def test_who_agreed_to_one_change_is_asked_about_another_after_going_back() -> None:
    journal = Journal()
    turns = journal.play(asking(offer("stir_contents(glass)")))
    assert isinstance(next(turns), Ask)
    with pytest.raises(StopIteration):
        turns.send(Answer(YES))
    assert isinstance(next(journal.play(asking(offer("stir_contents(glass)")))), Given)
    assert isinstance(next(journal.play(asking(offer("fry(lime, pan)")))), Ask)


def test_so_is_who_agreed_to_it_before_the_run_was_cut_off() -> None:
    asked = {"turn": "ask", "kind": "mend", "about": "lime_water", "prop": "a()", "answer": "yes"}
    memory = Memory()
    memory.take([{"turn": "propose", "reply": "b()"}, {"turn": "checked"}, asked])
    assert memory.plan == "b()"
    memory.take([{"turn": "checked"}])
    assert memory.plan == "a()"  # what an edit after it is an edit of

    class Never:
        def ask(self, question: Question) -> Answer:
            return Answer("no")

    human = RememberingHuman(memory, Never())  # type: ignore[arg-type]
    assert human.ask(offer("c()")).value == "no"
    assert human.ask(offer("a()")).value == YES


def test_what_the_person_goes_back_to_is_not_answered_from_memory() -> None:
    offered = {"turn": "offer", "about": "leek", "answers": {"soft": "yes", "hot": "no"}}
    memory = Memory()
    memory.take([offered, {"turn": "ask", "kind": "kind", "about": "pot", "answer": "tool"}])
    soft, hot = (Question("attribute", "leek", f"{prop}?", prop) for prop in ("soft", "hot"))
    crate, pot = Question("kind", "crate", "What is crate?"), Question("kind", "pot", "What?")

    class Back:
        def ask(self, question: Question) -> Answer:
            return back(hot.key if question == crate else pot.key)

        def offer(self, questions: tuple[Question, ...]) -> tuple[Answer, ...]:
            return tuple(Answer("by hand") for _ in questions)

        review = amend = ask

    human = RememberingHuman(memory, Back())  # type: ignore[arg-type]
    assert [answer.value for answer in human.offer((soft, hot))] == [YES, "no"]
    assert human.ask(crate) == back(hot.key)
    assert [answer.value for answer in human.offer((hot,))] == ["by hand"]
    assert human.ask(pot).value == "tool"  # a later one may be
    memory.take([{"turn": "ask", "kind": "kind", "about": "pot", "answer": "tool"}])
    human.ask(Question("kind", "lid", "What?"))
    assert human.ask(pot) == back(pot.key)


def test_what_an_edit_instead_of_the_offer_brings_up_is_asked(kitchen: Kg) -> None:
    script = Script(
        [LIME_WATER],
        {"mend lime_water": EDIT, "existence moonstone": "later"},
        edits=[Edit("insert", 1, text='pick_up_obj("moonstone")')],
    )
    drive(TASK, kitchen, script, replans=0, parse=parse)
    assert script.story[:3] == ["propose 0", "ask mend lime_water", "ask existence moonstone"]


def test_an_edit_of_a_mended_plan_is_kept_when_the_person_goes_back(kitchen: Kg) -> None:
    from adaptbot_cli.core.ask.dialogue import mend
    from adaptbot_cli.core.run import Run, look_at
    from adaptbot_cli.core.scene import Scene

    run = Run(kitchen, TASK, parse, Scene(kitchen, TASK))

    def pursued(question_seen: list[Question]) -> str:
        def turns() -> Generator[Turn, object, str]:
            report = yield from look_at(run, LIME_WATER)
            return (yield from mend(run, report)).text

        going, reply = turns(), None
        while True:
            try:
                turn = going.send(reply)
            except StopIteration as stop:
                return str(stop.value)
            reply = Answer(YES) if isinstance(turn, Ask) else None
            if isinstance(turn, Ask):
                question_seen.append(turn.question)

    seen: list[Question] = []
    mended = pursued(seen)
    assert [question.prop for question in seen] == [mended]
    run.asked.clear()
    run.edits[mended] = f'{mended}\npick_up_obj("salt")'
    assert pursued(seen) == run.edits[mended]
