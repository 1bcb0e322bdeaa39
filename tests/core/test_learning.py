"""From an answer to facts: what each outcome of a question teaches, and what is asked next."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import RDF, Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.ask import agenda, learning, teach
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Answer, Key, Question
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB, FALSE, TRUE, Triple
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Call, Parsed, Written
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from tests.hostile_names import NAMES
from tests.properties import examples
from tests.worlds import W, facts, parsed, replaced, scene, workshop

PART, TOOL = URIRef(W + "part"), URIRef(W + "tool")


def checked(plan: str, at: Scene) -> Report:
    return examine(parsed(plan), plan, at)


class Lessons:
    """A conversation about one plan, without the rest of the method."""

    def __init__(self, plan: str, kg: Kg | None = None, *required: str) -> None:
        self.plan = plan
        self.scene = scene(kg, *required)
        self.asked: dict[Key, tuple[Question, Answer]] = {}

    @property
    def report(self) -> Report:
        return checked(self.plan, self.scene)

    @property
    def question(self) -> Question | None:
        return agenda.next_question(self.report, self.scene, self.asked)

    def say(self, value: str) -> Lesson | None:
        """Answer the next question and take what it teaches."""
        report, question, answer = self.report, self.question, Answer(value)
        assert question is not None
        self.asked[question.key] = (question, answer)
        lesson = teach.learn(question, answer, report, self.scene, self.asked)
        if lesson is not None:
            teach.accept(lesson, self.scene)
        return lesson

    @property
    def codes(self) -> list[str]:
        return [finding.code for finding in self.report.findings]


def test_an_unknown_item_is_asked_about_with_the_nearest_names_first() -> None:
    question = Lessons("take_tool(dril)").question
    assert question is not None
    assert (question.kind, question.about, question.subject) == ("existence", "dril", "item")
    assert question.text == 'I do not know "dril". Is there such a thing in this workshop?'
    assert question.known[0] == "drill"
    assert set(question.known) >= {"board", "bench", "saw"}
    assert question.context == "take_tool(dril)"
    assert [choice.value for choice in question.choices] == [
        "is",
        "instead",
        "absent",
        "exists",
        "edit",
        "later",
    ]


SLAB, PLANK = URIRef(W + "slab"), URIRef(W + "plank")
DRILLABLE = URIRef(W + "drillable")
WORKSHOP = workshop().domain.iri
TAUGHT: dict[str, tuple[str, str, set[Triple] | None, list[str], str]] = {
    "mistaken for another, of which no place is asked": (
        "press(slab, 3)", "is candle",
        {(URIRef(W + "candle"), AB.alias, Literal("slab"))}, [], "",
    ),
    "mistaken for something unknown": ("press(slab, 3)", "is gadget", None, ["E201"], ""),
    "not here": ("press(slab, 3)", "absent", {(WORKSHOP, AB.absentItem, Literal("slab"))}, [], ""),
    "it exists, and only one kind fits": (
        "press(slab, 3)", "exists",
        {(SLAB, RDF.type, PART), (SLAB, URIRef(W + "called"), Literal("slab")),
         (SLAB, URIRef(W + "dry"), FALSE)}, [], "place",
    ),
    "it exists, and two kinds fit": ("put(slab)", "exists", None, ["E201"], "kind"),
    "yes, with the state that starts": (
        "drill_hole(plank)", "yes",
        {(PLANK, DRILLABLE, TRUE), (PLANK, URIRef(W + "drilled"), FALSE)}, [], "",
    ),
    "no": ("drill_hole(plank)", "no", {(PLANK, DRILLABLE, FALSE)}, ["E302"], ""),
    "not known": ("drill_hole(plank)", "unknown", None, ["E301"], ""),
    "an action by another name": (
        "puncture(board)", "is drill_hole",
        {(URIRef(W + "drill_hole"), AB.alias, Literal("puncture"))}, [], "",
    ),
    "an action that is not possible": (
        "polish(board)", "absent", {(WORKSHOP, AB.absentAction, Literal("polish"))}, [], "",
    ),
}  # fmt: skip
"""A plan, an answer, what it teaches, what is found then, and what is asked next."""


@pytest.mark.parametrize("what", TAUGHT)
def test_what_an_answer_teaches(what: str) -> None:
    plan, answer, added, codes, then = TAUGHT[what]
    talk = Lessons(plan)
    before = facts(talk.scene.kg)
    lesson = talk.say(answer)
    assert (lesson.delta.added if lesson else None) == added
    assert len(facts(talk.scene.kg) - before) == len(added or ())
    assert talk.codes == codes and (talk.question.kind if talk.question else "") == then


@pytest.mark.parametrize("plan", ["press(slab, 3)", "polish(board)"])
def test_what_is_not_here_is_never_asked_about_again_and_its_step_dropped(plan: str) -> None:
    talk = Lessons(plan)
    talk.say("absent")
    talk.asked.clear()
    assert talk.question is None
    assert [step.status for step in talk.report.steps] == ["dropped"]


def test_another_name_is_told_and_understood() -> None:
    talk = Lessons("puncture(slab)")
    told = {getattr(talk.say(name), "sentence", "") for name in ("is drill_hole", "is board")}
    assert "slab is another name for board" in told
    assert talk.report.steps[-1].call.render() == 'drill_hole("board")'


def test_a_required_item_that_is_not_here_stays_a_finding_without_a_question() -> None:
    talk = Lessons("press(slab, 3)", None, "slab")
    talk.say("absent")
    talk.asked.clear()
    assert talk.codes == ["E201"]
    assert talk.question is None


def test_where_two_kinds_fit_the_kind_is_asked_in_the_domains_words() -> None:
    talk = Lessons("put(slab)")
    talk.say("exists")
    question = talk.question
    assert question is not None and question.text == 'What is "slab"?'
    assert [(c.value, c.label, c.then) for c in question.choices] == [
        ("part", "part", "worked on"),
        ("tool", "tool", ""),
    ]
    talk.say("tool")
    assert talk.scene.kg.is_a(SLAB, [TOOL])


def test_two_steps_with_a_name_narrow_its_kind() -> None:
    talk = Lessons("put(slab)\npress(slab, 3)")
    talk.say("exists")
    assert talk.scene.kg.is_a(URIRef(W + "slab"), [PART])


def test_the_place_is_asked_after_existence_and_becomes_a_state() -> None:
    talk = Lessons("press(slab, 3)")
    talk.say("exists")
    question = talk.question
    assert question is not None
    assert (question.kind, question.text) == ("place", 'Where is "slab" kept?')
    # Where most things are kept comes first; not to know is an answer.
    assert [choice.value for choice in question.choices] == [
        "bench", "cupboard", "stove", "unknown"
    ]  # fmt: skip
    lesson = talk.say("cupboard")
    assert lesson is not None
    assert lesson.delta.added == {(URIRef(W + "slab"), URIRef(W + "in"), URIRef(W + "cupboard"))}
    assert talk.question is None


def test_furniture_is_not_asked_for_a_place() -> None:
    talk = Lessons("take_part(board)\nput(board, rack)")
    talk.say("exists")
    assert talk.question is None
    assert talk.codes == []


def test_an_unknown_attribute_is_asked_in_the_domains_words() -> None:
    question = Lessons("drill_hole(plank)").question
    assert question is not None
    assert (question.kind, question.about, question.prop) == ("attribute", "plank", "drillable")
    assert question.text == 'Can one drill "plank"?'
    assert [choice.value for choice in question.choices] == ["yes", "no", "unknown"]


def test_an_attribute_without_a_wording_is_asked_by_its_name() -> None:
    talk = Lessons("drill_hole(board, saw)", replaced("attributes.ttl", "w:drills false ; ", ""))
    question = talk.question
    assert question is not None
    assert question.text == 'Is "saw" drills?'


@pytest.mark.parametrize(
    ("prop", "value", "removed", "added"),
    [
        ("drillable", TRUE, None, TRUE),  # a state that is known is not started again
        ("in", URIRef(W + "cupboard"), URIRef(W + "bench"), URIRef(W + "cupboard")),
        ("in", URIRef(W + "bench"), None, None),
    ],
)
def test_a_value_replaces_the_old_one_and_what_is_known_is_no_change(
    prop: str, value: Node, removed: Node | None, added: Node | None
) -> None:
    kg = workshop(state="w:plank w:drilled true .")
    delta = learning.attribute(kg, PLANK, kg.domain.properties[URIRef(W + prop)], value)  # type: ignore[arg-type]
    assert [o for _, _, o in delta.removed] == [v for v in (removed,) if v is not None]
    assert [o for _, _, o in delta.added] == [v for v in (added,) if v is not None]


def test_an_unknown_action_is_asked_about_with_the_actions_there_are() -> None:
    question = Lessons("polish(board)").question
    assert question is not None
    assert (question.kind, question.about, question.subject) == ("existence", "polish", "action")
    assert "press" in question.known


def test_an_item_and_an_action_of_one_name_are_two_questions() -> None:
    talk = Lessons("weld(weld)")
    first = talk.question
    assert first is not None
    talk.say("later")
    second = talk.question
    assert second is not None
    assert {first.subject, second.subject} == {"item", "action"}


def test_the_answer_about_an_action_is_not_one_about_the_item_of_that_name() -> None:
    talk = Lessons("weld(weld)")
    talk.say("exists")
    assert talk.question is not None and talk.question.kind == "action"
    talk.say("later")
    assert talk.question is not None and talk.question.kind == "existence"


def test_nothing_is_asked_twice() -> None:
    talk = Lessons("press(slab, 3)\ndry_part(slab)\npolish(slab)\npolish(board)")
    asked = []
    while talk.question is not None:
        asked.append(talk.question.key)
        talk.say("later")
    assert len(asked) == len(set(asked)) == 2


def test_only_required_items_are_asked_about_where_that_is_wanted() -> None:
    talk = Lessons("press(gadget, 3)\npress(slab, 3)", None, "slab")
    question = agenda.next_question(talk.report, talk.scene, talk.asked, required_only=True)
    assert question is not None
    assert question.about == "slab"


@examples(60)
@given(st.lists(st.text(max_size=40), min_size=1, max_size=4))
def test_different_names_get_different_iris(names: list[str]) -> None:
    kg = SHARED
    with kg.rehearsal():
        iris = []
        for name in names:
            delta = learning.existence(kg, name, kg.domain.classes[PART])
            iris.append(next(iter(delta.added))[0])
            kg.apply(delta)
        assert len(set(iris)) == len(names)


SHARED = workshop()


@pytest.mark.parametrize("name", ["board", "Board", "part", "in", "switch", "arm"])
def test_an_iri_that_is_taken_is_not_used_again(name: str) -> None:
    # By a thing, a class, a property, an action, the robot.
    kg = workshop()
    assert learning.entity_iri(kg, name) == URIRef(f"{W}{name.lower()}_2")


@pytest.mark.parametrize("way", list(NAMES))
def test_every_unknown_action_that_is_asked_about_is_in_the_plan(way: str) -> None:
    name = NAMES[way]
    calls = (Call("take_part", ("board",)), Call(name, ("board",)), Call(name, ("board", "saw")))
    plan = Parsed(tuple(Written(each, each.render(), n, 1) for n, each in enumerate(calls, 1)))
    report = examine(plan, "", scene())
    for finding in (each for each in report.findings if each.code == "E101"):
        found = agenda.unknown_action(normal(finding.subject), report)
        assert normal(found.call.action) == found.name == normal(name)
