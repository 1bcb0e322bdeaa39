"""No name breaks anything: it is stored and found again, or refused with a sentence."""

import io
import json
import re
from dataclasses import dataclass
from typing import Any

import pytest
from rich.console import Console

from adaptbot_cli import session
from adaptbot_cli.adapters.answers import AnswersHuman
from adaptbot_cli.adapters.display import Screen
from adaptbot_cli.adapters.tables import changes as change_tables
from adaptbot_cli.adapters.tables import history, things
from adaptbot_cli.core import view
from adaptbot_cli.core.execute import Rehearsal
from adaptbot_cli.core.kg import Kg, net
from adaptbot_cli.core.learning import Lesson, is_absent
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.parsing import parse
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.static import number
from adaptbot_cli.core.summary import summary
from adaptbot_cli.core.turns import Proposal, Propose, Review
from adaptbot_cli.core.tutor import pursue
from adaptbot_cli.core.visible import visible
from adaptbot_cli.core.words import Related
from adaptbot_cli.errors import AdaptbotError
from adaptbot_cli.session import changing, knowing, querying
from adaptbot_cli.session.driving import Nowhere, Ports, perform
from adaptbot_cli.workspace import Workspace
from tests.cli.command import Home
from tests.hostile_names import NAMES

_CONTROLS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
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

    home: knowing.Home

    def lessons(self, name: str, answers: dict[str, str]) -> list[Lesson]:
        """Run a plan that names a thing; return what the answers about it taught."""
        learned: list[Lesson] = []
        plan = f"pick_up_obj({json.dumps(name)})\n"
        human = AnswersHuman({normal(name): answers}, "tester")
        ports = Ports(Says(plan), human, Rehearsal(self.home.kg), NoWords(), Nowhere())
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
        return changing.after(self.home, net(lesson.delta for lesson in lessons))


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
    return Teaching(knowing.Home(Workspace(root), "kitchen"))


@EACH_NAME
def test_from_a_model_it_is_checked(teaching: Teaching, name: str) -> None:
    kg = teaching.home.kg
    for text in (f"pick_up_obj({json.dumps(name)})", f'pick_up_obj("{name}")', f'{name}("egg")'):
        result = session.check(text, Task("fetch it"), kg)
        out = Console(file=io.StringIO(), width=80, no_color=True, highlight=False)
        Screen(out, kg, result.report.task, "").finish(result, None)
        told = out.file.getvalue()  # type: ignore[attr-defined]
        assert told.strip() and not _CONTROLS.search(told)
        json.dumps(summary(result, kg, "text", (None, None)))


OUTCOMES = {
    "taught": {"existence": "exists", "kind": "object", "obj_location": "fridge"},
    "an alias": {"existence": "is egg"},
    "absent": {"existence": "absent"},
}


@pytest.mark.parametrize("outcome", OUTCOMES)
@EACH_NAME
def test_from_a_person_it_is_kept_or_refused(teaching: Teaching, name: str, outcome: str) -> None:
    try:
        lessons = teaching.lessons(name, OUTCOMES[outcome])
        if not lessons:  # no name, a number, or a thing that is known: nothing is asked about it
            known = teaching.home.kg.find(name)
            assert known or not normal(name) or number(name) or name in QUIET
            return
        kg = teaching.after(lessons)
    except AdaptbotError as error:
        refused(error)
        assert name in UNWRITABLE
        return
    if outcome == "absent":
        assert is_absent(kg, name, "item")
    elif outcome == "an alias":
        [egg] = kg.find("egg")
        assert egg in kg.find(name) and normal(name) in kg.aliases(egg)
    else:
        [entity] = kg.find(name)
        assert kg.name(entity) == normal(name)
        assert re.fullmatch(r"http://example\.org/[A-Za-z][A-Za-z0-9_]{0,65}", entity)
        shown(things.one(kg, view.thing(kg, entity)))
