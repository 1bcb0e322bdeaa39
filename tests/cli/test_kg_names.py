"""No name breaks anything: it is stored and found again, or refused with a sentence."""

import io
import json
import re
from dataclasses import dataclass
from typing import Any

import pytest
from rich.console import Console

from adaptbot_cli.adapters.answers import AnswersHuman
from adaptbot_cli.adapters.display import origins, things
from adaptbot_cli.adapters.display.screen import Screen
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.ask.learning import Lesson, absence, alias, existence, is_absent
from adaptbot_cli.core.ask.questions import Answer, Question
from adaptbot_cli.core.graph.delta import net
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.refine.grounding import number
from adaptbot_cli.core.turns import Keep, Proposal, Propose, Review
from adaptbot_cli.core.tutor import inspect, pursue
from adaptbot_cli.core.view import facts as view
from adaptbot_cli.core.view.summary import summary
from adaptbot_cli.core.visible import visible
from adaptbot_cli.core.words import Related
from adaptbot_cli.errors import AdaptbotError
from adaptbot_cli.session import change, knowledge, queries
from adaptbot_cli.session.drive import Nowhere, Ports, drive, perform
from adaptbot_cli.session.home import Home
from adaptbot_cli.workspace import Workspace
from tests.hostile_names import NAMES

_CONTROLS = re.compile(
    "[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)
UNWRITABLE: set[str] = set()
QUIET: set[str] = set()
EACH_NAME = pytest.mark.parametrize("name", list(NAMES.values()), ids=list(NAMES))


def shown(*tables: object) -> str:
    """Render tables as on a terminal, whose colours are off; nothing in them may control it."""
    out = Console(file=io.StringIO(), width=80, no_color=True, highlight=False)
    for table in tables:
        out.print(table)
    text = out.file.getvalue()  # type: ignore[attr-defined]
    assert not _CONTROLS.search(text), repr(text)
    return str(text)


def refused(error: AdaptbotError) -> None:
    """Tell that an error is a sentence: it says something, and what it quotes can be shown."""
    assert str(error).strip() and "Traceback" not in str(error)
    assert not _CONTROLS.search(visible(str(error)))


def test_there_are_enough_of_them() -> None:
    assert len(NAMES) >= 100 and len(set(NAMES.values())) == len(NAMES)


@dataclass
class Teaching:
    """A kitchen in which one name after the other is taught, and taken back."""

    home: Home

    def lessons(self, name: str, answers: dict[str, str]) -> list[Lesson]:
        """Run a plan that names a thing; return what the answers about it taught."""
        learned: list[Lesson] = []
        plan = f"pick_up_obj({json.dumps(name)})\n"
        human = AnswersHuman({normal(name): answers}, "tester")
        ports = Ports(Says(plan), human, NoWords(), Nowhere())
        turns = pursue(Task("fetch it"), self.home.kg, parse, "paper", 0)
        reply: Any = None
        while True:
            try:
                turn = turns.send(reply)
            except StopIteration:
                return learned
            if isinstance(turn, Review):
                learned += turn.lessons
                reply = False  # the next name finds the kitchen as it was
            else:
                reply = perform(turn, ports)

    def after(self, lessons: list[Lesson]) -> Kg:
        """Return the graph that the files make once the lessons are written into them."""
        return change.after(self.home, net(lesson.delta for lesson in lessons))


class Says:
    """A model that says one thing."""

    name = "model"

    def __init__(self, text: str) -> None:
        self.text = text

    def propose(self, turn: Propose) -> Proposal:
        return Proposal(self.text)


class NoWords:
    """A lexicon that knows nothing."""

    def related(self, word: str, fields: frozenset[str]) -> tuple[Related, ...]:
        return ()


@pytest.fixture(scope="module")
def teaching(tmp_path_factory: pytest.TempPathFactory) -> Teaching:
    root = tmp_path_factory.mktemp("names")
    return Teaching(Home(Workspace(root), "kitchen"))


@EACH_NAME
def test_from_a_model_it_is_checked(teaching: Teaching, name: str) -> None:
    """As JSON writes it, as it stands, and as an action."""
    kg = teaching.home.kg
    text = f'pick_up_obj({json.dumps(name)})\npick_up_obj("{name}")\n{name}("egg")\n'
    ports = Ports(Says(text), AbsentHuman(), NoWords(), Nowhere())
    result = drive(inspect(Task("fetch it"), kg, parse, text), ports)
    out = Console(file=io.StringIO(), width=80, no_color=True, highlight=False)
    Screen(out, kg).finish(result, None)
    told = out.file.getvalue()  # type: ignore[attr-defined]
    assert told.strip() and not _CONTROLS.search(told)
    json.dumps(summary(result, kg, "text", (None, None)))


OUTCOMES = {
    "taught": {"existence": "exists", "kind": "object", "obj_location": "fridge"},
    "an alias": {"existence": "is egg"},
    "absent": {"existence": "absent"},
}


@EACH_NAME
def test_from_a_person_it_is_learned(teaching: Teaching, name: str) -> None:
    """Every third name is taught, is an alias, is absent; all of each are written further down."""
    outcome = list(OUTCOMES)[list(NAMES.values()).index(name) % len(OUTCOMES)]
    lessons = teaching.lessons(name, OUTCOMES[outcome])
    if not lessons:  # no name, a number, or a thing that is known: nothing is asked about it
        assert teaching.home.kg.find(name) or not normal(name) or number(name)
    assert all(lesson.question.about == normal(name) for lesson in lessons)


@pytest.mark.parametrize("outcome", ["an alias", "absent"])
def test_other_names_and_absences_are_written_and_read_again(
    teaching: Teaching, outcome: str
) -> None:
    kg = teaching.home.kg
    [egg] = kg.find("egg")
    new = [name for name in NAMES.values() if normal(name) and not kg.find(name)]
    if outcome == "absent":
        delta = net(absence(kg.domain, name, "item") for name in new)
        after = change.after(teaching.home, delta)
        assert all(is_absent(after, name, "item") for name in new)
    else:
        delta = net(alias(name, egg) for name in new)
        after = change.after(teaching.home, delta)
        assert all(egg in after.find(name) for name in new)
        assert {normal(name) for name in new} <= set(after.aliases(egg))
        shown(things.one(after, view.thing(after, egg)))


@EACH_NAME
def test_every_command_takes_it_as_a_word(teaching: Teaching, kept: Home, name: str) -> None:
    """What cannot be meant is refused with a sentence; nothing is written, nothing is raised."""
    home = kept
    head = home.needed().repo.head()
    calls = (
        lambda: origins.why(name, knowledge.why(home, name).facts, (), home.words),
        lambda: origins.why("egg", knowledge.why(home, "egg", name).facts, (), home.words),
        lambda: origins.log(list(knowledge.chapters(home, name)), home.words, True),
        lambda: preview(change.retract(home, name), home),
        lambda: preview(change.retract(home, "egg", name), home),
        lambda: preview(change.retract(home, "egg", "place", name), home),
        lambda: preview(change.revert_answer(home, name), home),
        lambda: preview(change.revert(home, name), home),
        lambda: origins.difference(knowledge.differences(home, name, None)[0], home.words),
        lambda: preview(queries.update(home, name), home),
        lambda: str(queries.query(home, name)),
        lambda: str(queries.query(home, f"ASK {{ ?x ex:obj_name {json.dumps(name)} }}").truth),
    )
    for call in calls:
        try:
            shown(call())
        except AdaptbotError as error:
            refused(error)
    assert home.needed().repo.head() == head


def preview(proposal: change.ProposedChange, home: Home) -> object:
    """Return a proposed change as it is shown."""
    delta = proposal.delta
    return origins.preview(proposal.changes, home.words.also(delta.added).also(delta.removed))


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """Return a home with all the names taught in one commit, each by an answer of its own."""
    home = Home(Workspace(tmp_path_factory.mktemp("kept")), "kitchen")
    kg, lessons = home.kg, []
    [kind] = [kind for kind in kg.domain.teachable if kind.label.startswith("ingredient")]
    for name in NAMES.values():
        if normal(name) and not kg.find(name):
            question = Question("kind", normal(name), f"What is {name}?")
            delta = existence(kg, name, kind)
            kg.learn(delta)
            lessons.append(
                Lesson(delta, question, Answer("object", name, name), f"there is {name}")
            )
    change.keeper(home).keep(Keep(Task("all of them"), tuple(lessons)))
    return Home(home.workspace, "kitchen")


def test_all_of_them_in_one_commit_each_with_its_answer(kept: Home) -> None:
    [learned, _] = list(knowledge.chapters(kept, None))
    shown(origins.log([learned], kept.words, False))
    for told in learned.answers:
        taught = kept.needed().answered(f"{learned.origin.revision[:7]}.{told.number}")[1]
        assert taught.added and taught.removed == frozenset()
    names = {normal(name) for name in NAMES.values()} - {""}
    for name in names:
        [entity, *_] = kept.kg.find(name)
        assert re.fullmatch(r"http://example\.org/[A-Za-z][A-Za-z0-9_]{0,65}", entity)
        shown(things.one(kept.kg, view.thing(kept.kg, entity)))
    facts = {t for t in kept.facts if t not in kept.pack}
    assert {o.source for o in kept.needed().origins(facts, kept.pack).values()} == {"answer"}
