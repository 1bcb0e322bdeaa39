"""The dialogue as a whole: back, corrections, interruptions, reviews in part, contradictions."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import Literal, URIRef

from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import (
    LATER,
    NEW,
    OLD,
    STOP,
    UNKNOWN,
    Answer,
    Key,
    Question,
    Reviewed,
    back,
)
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import (
    Ask,
    Checked,
    Given,
    Keep,
    Kept,
    Learned,
    LookUp,
    Offer,
    Proposal,
    Propose,
    Review,
    Trace,
    Turn,
)
from adaptbot_cli.core.tutor import Policy, pursue
from tests.driving import played
from tests.properties import examples
from tests.worlds import W, changed, facts, parsed, workshop

PLAN = """\
take(slab)
put(slab)
drill_hole(slab)
take(widget)
put(widget)
drill_hole(plank)
"""
TASK = Task("work", ("slab",))

STRAIGHT = {
    "existence slab": "exists",
    "in slab": "bench",
    "drillable slab": "yes",
    "existence widget": "is board",
    "drillable plank": "no",
}


def name(question: Question) -> str:
    return f"{question.prop or question.kind} {question.about}"


@dataclass
class Person:
    """Answers by question; on the way it goes back, and may stop.

    `ways` are the steps of the way: at each question the next one is taken; a number goes back to
    that one of the questions answered so far. `told` are wrong answers, given at first.
    """

    final: Mapping[str, str]
    ways: list[int | None] = field(default_factory=list)
    told: dict[str, str] = field(default_factory=dict)
    left_out: frozenset[Key] = frozenset()
    review_back: list[Key] = field(default_factory=list)
    accept: bool = True
    plan: str = PLAN
    seen: list[Turn] = field(default_factory=list)
    live: list[Key] = field(default_factory=list)

    def reply(self, turn: Turn, kg: Kg) -> Any:
        self.seen.append(turn)
        match turn:
            case Propose():
                return Proposal(self.plan, prompt_tokens=10)
            case LookUp():
                return {}
            case Ask():
                return self.answer(turn.question)
            case Offer():
                return tuple(self.volunteered(question) for question in turn.questions)
            case Review():
                if self.review_back:
                    return Reviewed(back=self.review_back.pop())
                return Reviewed(self.left_out) if self.left_out else self.accept
            case Keep():
                return Kept("r1")
            case Trace():
                return tuple("told by ann" for _ in turn.facts)
        return None

    def answer(self, question: Question) -> Answer:
        way = self.ways.pop(0) if self.ways else None
        if way is not None and question.answered:
            return back(question.answered[way % len(question.answered)][0].key)
        self.live.append(question.key)
        value = self.final.get(name(question))
        assert value is not None, f"nobody knows {name(question)}"
        return STOP if value == "stop" else Answer(value, "ann")

    def volunteered(self, question: Question) -> Answer:
        value = self.final.get(name(question))
        return LATER if value is None else Answer(value, "ann")


def drive(
    person: Person,
    kg: Kg | None = None,
    task: Task = TASK,
    full: bool = False,
    policy: Policy = "tutor",
) -> tuple[Result, Kg]:
    kg = kg or workshop()
    turns = pursue(task, kg, parsed, policy, replans=0, full=full)
    return played(turns, lambda turn: person.reply(turn, kg)), kg


@cache
def straight(told: frozenset[tuple[str, str]] = frozenset(STRAIGHT.items())) -> tuple[Result, Kg]:
    """A run in which each answer is the last one at once; nobody may change its graph."""
    return drive(Person(dict(told)))


def answers(result: Result) -> dict[str, str]:
    return {name(question): answer.value for question, answer in result.questions}


class Fickle(Person):
    """Gives wrong answers first, and comes back to correct each of them before the end."""

    def answer(self, question: Question) -> Answer:
        wrong = self.told.pop(name(question), None)
        if wrong is None:
            return super().answer(question)
        self.review_back.append(question.key)
        self.live.append(question.key)
        return Answer(wrong, "ann")


class Leaving(Person):
    """Says with one answer that it is the last one."""

    def answer(self, question: Question) -> Answer:
        return replace(super().answer(question), last=name(question) == "in slab")


def test_after_the_last_answer_nothing_is_asked_or_planned_any_more() -> None:
    person = Leaving(STRAIGHT)
    result, _ = drive(person)
    assert person.live[-1] == ("place", "slab", "in", "item")
    assert sum(isinstance(turn, Propose) for turn in person.seen) == 1
    assert any("bench" in lesson.sentence for lesson in result.lessons)


def test_what_is_used_instead_is_used_in_this_run_and_forgotten() -> None:
    before = facts(workshop())
    person = Person({"existence slab": "instead board", "existence widget": "is board",
                     "drillable plank": "yes"})  # fmt: skip
    result, kg = drive(person)
    assert result.verdict == "executable" and result.goal_met
    [evidence] = {change.evidence for step in result.report.steps for change in step.changes
                  if change.source == "slab"}  # fmt: skip
    assert "board is used instead, this time only" in evidence
    kept = [lesson.sentence for turn in person.seen if isinstance(turn, Keep)
            for lesson in turn.lessons]  # fmt: skip
    assert kept == ["widget is another name for board", "plank: drillable yes"]
    assert not any("slab" in str(fact) for fact in facts(kg) - before)
    assert drive(Person({**STRAIGHT, "existence slab": "stop"}), kg)[0].verdict != "executable"


WRONG = {
    "existence slab": ["exists", "absent", "is board", "later"],
    "in slab": ["cupboard", "stove", "new rack", UNKNOWN],
    "drillable slab": ["no", UNKNOWN, "yes"],
    "existence widget": ["absent", "exists", "later", "is plank"],
    "drillable plank": ["yes", UNKNOWN],
}


@examples(25)
@given(ways=st.lists(st.none() | st.integers(0, 9), max_size=12))
def test_any_way_back_leads_where_the_answers_lead(ways: list[int | None]) -> None:
    first, expected = straight()
    result, kg = drive(Person(STRAIGHT, ways))
    assert facts(kg) == facts(expected)
    assert answers(result) == answers(first)
    assert result.usage.prompt_tokens == first.usage.prompt_tokens
    assert [lesson.sentence for lesson in result.lessons] == [
        lesson.sentence for lesson in first.lessons
    ]


@examples(25)
@given(
    first=st.fixed_dictionaries({}, optional={k: st.sampled_from(v) for k, v in WRONG.items()}),
    ways=st.lists(st.none() | st.integers(0, 9), max_size=6),
)
def test_corrected_answers_lead_where_the_right_ones_lead(
    first: dict[str, str], ways: list[int | None]
) -> None:
    every = {**STRAIGHT, "kind widget": "part", "in widget": "bench", "kind rack": "furniture"}
    person = Fickle(every, ways, dict(first))
    result, kg = drive(person)
    first_run, expected = straight(frozenset({**every, **answers(result)}.items()))
    assert facts(kg) == facts(expected)
    assert answers(result) == answers(first_run)


@examples(15)
@given(ways=st.lists(st.none() | st.integers(0, 9), max_size=8))
def test_an_answered_question_never_recurs(ways: list[int | None]) -> None:
    person = Person(STRAIGHT, ways)
    drive(person)
    returned = [turn for turn in person.seen if isinstance(turn, Ask)]
    again = [key for key in set(person.live) if person.live.count(key) > 1]
    backs = len(returned) - len(person.live)
    assert len(person.live) - len(set(person.live)) <= backs
    assert not again or backs


@pytest.mark.parametrize("at", list(STRAIGHT))
def test_a_run_that_is_stopped_keeps_what_was_told_before(at: str) -> None:
    order = list(STRAIGHT)
    told = {key: STRAIGHT[key] for key in order[: order.index(at)]}
    result, kg = drive(Person({**told, **dict.fromkeys(order[order.index(at) :], "stop")}))
    assert {k: v for k, v in answers(result).items() if v != LATER.value} == told
    _, expected = drive(Person({**told, **dict.fromkeys(order[order.index(at) :], "later")}))
    assert facts(kg) == facts(expected)


def test_what_is_known_of_one_thing_is_asked_together() -> None:
    person = Person(STRAIGHT)
    drive(person)
    place = next(t.question for t in person.seen if isinstance(t, Ask) and t.question.prop == "in")
    assert [question.prop for question in place.together] == ["drillable"]


def test_after_a_correction_nobody_is_told_again_what_went_before() -> None:
    key = ("existence", "widget", "", "item")
    person = Person(STRAIGHT, review_back=[key])
    drive(person)
    start = next(n for n, turn in enumerate(person.seen) if isinstance(turn, Review))
    again = person.seen[start + 1 :]
    assert isinstance(again[0], Ask) and again[0].question.key == key
    assert again[0].question.suggested is not None
    assert again[0].question.suggested.value == "is board"
    assert [t.question.about for t in again if isinstance(t, Given)] == ["plank"]
    assert not any(isinstance(turn, Propose) for turn in again)


def test_a_line_that_is_gone_back_to_comes_with_the_others_as_they_were_answered() -> None:
    key = ("place", "slab", "in", "item")
    person = Person(STRAIGHT, review_back=[key])
    drive(person)
    start = next(n for n, turn in enumerate(person.seen) if isinstance(turn, Review))
    again = person.seen[start + 1]
    assert isinstance(again, Ask) and again.question.key == key
    assert again.question.suggested is not None and again.question.given == ""
    assert again.question.suggested.value == "bench"
    assert [(q.prop, q.given) for q in again.question.together] == [("drillable", "yes")]
    assert person.live.count(("attribute", "slab", "drillable", "item")) == 1


def test_everything_is_asked_where_it_is_wanted() -> None:
    plan = "take(slab)\nput(slab)"
    told = {**STRAIGHT, "kind slab": "part"}
    few = {key: value for key, value in told.items() if "drill" not in key}
    result, _ = drive(Person(few, plan=plan))
    assert list(answers(result)) == ["existence slab", "kind slab", "in slab"]
    result, _ = drive(Person(told, plan=plan), full=True)
    assert list(answers(result))[-1] == "drillable slab"


def test_what_nothing_needs_is_offered_once_and_learned_if_told() -> None:
    person = Person({**STRAIGHT, "kind slab": "part"}, plan="take(slab)\nput(slab)")
    result, _ = drive(person)
    offers = [turn for turn in person.seen if isinstance(turn, Offer)]
    assert [[question.prop for question in turn.questions] for turn in offers] == [["drillable"]]
    assert "slab: drillable yes" in [lesson.sentence for lesson in result.lessons]


def test_a_new_place_is_taught_on_the_spot() -> None:
    told = {**STRAIGHT, "in slab": "new rack"}
    result, kg = drive(Person(told))
    sentences = [lesson.sentence for lesson in result.lessons]
    assert sentences[:3] == [
        "there is slab (part)",
        "there is rack (piece of furniture)",
        "slab: place rack",
    ]
    assert kg.name(next(iter(kg.find("rack")))) == "rack"


def keys_of(lessons: tuple[Lesson, ...], *names: str) -> frozenset[Key]:
    return frozenset(lesson.question.key for lesson in lessons if name(lesson.question) in names)


def test_what_rests_on_a_lesson_that_is_left_out_goes_with_it() -> None:
    lessons = straight()[0].lessons
    out = keys_of(lessons, "existence slab")
    person = Person(STRAIGHT, left_out=out)
    result, kg = drive(person)
    assert [lesson.question.about for lesson in result.lessons] == ["widget", "plank"]
    kept = next(turn for turn in person.seen if isinstance(turn, Keep))
    assert kept.lessons == result.lessons
    assert not kg.find("slab")
    assert result.verdict == "findings"


def test_a_part_that_nothing_rests_on_is_left_out_alone() -> None:
    lessons = straight()[0].lessons
    result, kg = drive(Person(STRAIGHT, left_out=keys_of(lessons, "drillable slab")))
    assert len(result.lessons) == len(lessons) - 1
    assert kg.find("slab")


def test_a_new_thing_goes_with_its_place_and_the_plan_is_judged_without_it() -> None:
    lessons = straight()[0].lessons
    result, kg = drive(Person(STRAIGHT, left_out=keys_of(lessons, "in slab")))
    assert [lesson.question.about for lesson in result.lessons] == ["widget", "plank"]
    assert not kg.find("slab") and result.verdict == "findings" and not result.goal_met


GLASS = ("domain.ttl", "ab:asks ( w:in w:drillable )", "ab:asks ( w:in w:drillable w:glass )")


def contradiction(stands: str) -> tuple[Person, Result, Kg]:
    """The person says that slab can be drilled, and then that it is of glass."""
    kg = changed(GLASS)
    told = {**STRAIGHT, "glass slab": "yes", "drillable slab": stands}
    person = Contrary(told)
    result, kg = drive(person, kg)
    return person, result, kg


class Contrary(Person):
    """Answers the question which of two facts stands by NEW or OLD."""

    def answer(self, question: Question) -> Answer:
        if question.kind == "contradiction":
            self.live.append(question.key)
            return Answer(self.final["drillable slab"], "ann")
        if name(question) == "drillable slab":
            return Answer("yes", "ann")
        return super().answer(question)


@pytest.mark.parametrize(("stands", "drillable", "glass"), [(NEW, False, True), (OLD, True, None)])
def test_of_two_answers_that_contradict_each_other_one_stands(
    stands: str, drillable: bool, glass: bool | None
) -> None:
    person, _, kg = contradiction(stands)
    asked = [t.question for t in person.seen if isinstance(t, Ask)]
    clash = next(question for question in asked if question.kind == "contradiction")
    assert clash.text == "slab: made of glass yes, but slab: drillable yes. Which is right?"
    assert "you said so in this run" in clash.context
    [slab] = kg.find("slab")
    assert kg.value(slab, URIRef(W + "drillable")) == Literal(drillable)
    assert kg.value(slab, URIRef(W + "glass")) == (glass and Literal(glass))


def test_what_follows_is_not_asked() -> None:
    kg = changed(
        ("domain.ttl", "ab:asks ( w:in w:drillable )", "ab:asks ( w:in w:glass w:drillable )")
    )
    told = {**STRAIGHT, "kind slab": "part", "glass slab": "yes"}
    person = Person(told, plan="take(slab)\nput(slab)")
    result, _ = drive(person, kg)
    assert "drillable slab" not in answers(result)
    assert answers(result)["glass slab"] == "yes"


def test_what_followed_from_an_answer_that_is_corrected_is_asked_anew() -> None:
    kg = changed(
        ("domain.ttl", "ab:asks ( w:in w:drillable )", "ab:asks ( w:in w:glass w:drillable )")
    )
    told = {**STRAIGHT, "kind slab": "part", "glass slab": "no"}
    del told["drillable slab"]
    at_first = {"glass slab": "yes", "drillable slab": "no"}  # a form fills in what follows
    offered: list[list[str]] = []

    class Hasty(Person):
        def volunteered(self, question: Question) -> Answer:
            offered[-1].append(name(question))
            known = at_first if len(offered) == 1 else told
            return Answer(known.get(name(question), LATER.value), "ann")

        def reply(self, turn: Turn, kg: Kg) -> Any:
            if isinstance(turn, Offer):
                offered.append([])
            return super().reply(turn, kg)

    glass: Key = ("attribute", "slab", "glass", "item")
    person = Hasty(told, plan="take(slab)\nput(slab)", review_back=[glass])
    result, _ = drive(person, kg)
    assert offered == [["glass slab", "drillable slab"]] * 2
    assert "drillable slab" not in answers(result)
    assert answers(result)["glass slab"] == "no"


def test_checks_are_told_only_when_all_is_said_of_a_thing() -> None:
    person = Person(STRAIGHT)
    drive(person)
    story = [type(t).__name__ for t in person.seen if isinstance(t, Ask | Checked | Learned)]
    first = story.index("Learned")
    assert story[first : first + 6] == ["Learned", "Ask", "Learned", "Ask", "Learned", "Checked"]


UNFIT = (
    "attributes.ttl",
    'w:called "board" ; w:drillable true',
    'w:called "board" ; w:drillable false',
)


def doubted(answer: str, policy: Policy = "tutor") -> tuple[Person, Result, Kg]:
    """A plan drills the board, of which the graph says that it cannot be drilled."""
    kg = changed(UNFIT)
    person = Person({"drillable board": answer}, plan="take(board)\nput(board)\ndrill_hole(board)")
    result, kg = drive(person, kg, Task("work", ("board",)), policy=policy)
    return person, result, kg


@pytest.mark.parametrize(("answer", "drillable"), [("yes", True), ("no", False), (UNKNOWN, False)])
def test_a_required_item_that_only_a_known_attribute_rules_out_is_asked_about_once(
    answer: str, drillable: bool
) -> None:
    person, result, kg = doubted(answer)
    [question] = [turn.question for turn in person.seen if isinstance(turn, Ask)]
    assert question.notes == ("the graph says: board: drillable no (told by ann)",)
    [board] = kg.find("board")
    assert kg.value(board, URIRef(W + "drillable")) == Literal(drillable)
    assert len(result.lessons) == drillable
    assert result.verdict == ("executable" if drillable else "findings")


def test_the_paper_asks_nothing_that_is_known() -> None:
    person, result, _ = doubted("yes", "paper")
    assert not [turn for turn in person.seen if isinstance(turn, Ask)]
    assert result.verdict == "findings"


def test_what_is_known_is_not_doubted_where_another_thing_will_do() -> None:
    person = Person({}, plan="take(board)\nput(board)\ndrill_hole(board)")
    fit = ("attributes.ttl", 'w:called "plank" .', 'w:called "plank" ; w:drillable true .')
    result, _ = drive(person, changed(UNFIT, fit), Task("work"))
    assert not [turn for turn in person.seen if isinstance(turn, Ask)]
    assert result.verdict == "findings"


@pytest.mark.parametrize("answer", ["yes", "no"])
def test_the_only_thing_that_bears_the_name_of_what_a_step_finds_by_itself_is_asked_about(
    answer: str,
) -> None:
    kg = changed(
        ("actions.ttl", "heater", "stove"), ("attributes.ttl", "w:heats true", "w:heats false")
    )
    person = Person({"heats stove": answer}, plan="take(board)\nput(board)\ndry(board)")
    result, kg = drive(person, kg, Task("work", ("board",)))
    [question] = [turn.question for turn in person.seen if isinstance(turn, Ask)]
    assert question.notes == ("the graph says: stove: heats no (told by ann)",)
    [stove] = kg.find("stove")
    assert kg.value(stove, URIRef(W + "heats")) == Literal(answer == "yes")
    assert result.verdict == ("executable" if answer == "yes" else "findings")
