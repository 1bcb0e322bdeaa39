"""Requests as people type them: what is understood, and that nothing else is said to be done."""

from dataclasses import replace
from functools import cache
from itertools import cycle, permutations
from pathlib import Path
from typing import Any

import pytest
import yaml

from adaptbot_cli.adapters.planner.library import Library
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.ask.questions import NO, YES, Answer, Question
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Call
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.request.understand import Reading
from adaptbot_cli.core.turns import Human
from adaptbot_cli.core.tutor import pursue_each
from adaptbot_cli.core.view.summary import asked, findings
from adaptbot_cli.errors import ModelError
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.drive import Nowhere, Ports, drive
from adaptbot_cli.session.sources import load
from adaptbot_cli.workspace import Workspace
from tests.asking import lexicon, reading_of

TABLE: dict[str, list[dict[str, Any]]] = yaml.safe_load(
    (Path(__file__).parent / "data" / "requests.yaml").read_text(encoding="utf-8")
)
ROWS = [(domain, row) for domain, rows in TABLE.items() for row in rows]
NO_PLAN = 5


def kg_of(domain: str) -> Kg:
    """The bundled graph of a domain, fresh: a run changes its state."""
    return load(Workspace(Path("nowhere")), domain)


known = cache(kg_of)
"""The bundled graph of a domain, for what changes nothing."""


@cache
def reading(domain: str, text: str) -> Reading:
    """What a request means on the bundled graph."""
    return reading_of(text, known(domain))


def run(domain: str, text: str, human: Human | None = None) -> Result:
    """Pursue a request with the plan library, in this process."""
    kg = kg_of(domain)
    library = Library((bundled("prompts") / "library" / domain,), kg.domain, kg=kg)
    ports = Ports(library, human or AbsentHuman(), lexicon(), Nowhere())
    turns = pursue_each(text, lambda said: reading_of(said, kg), kg, parse, replans=0)
    return drive(turns, ports)


PARTS = {
    ("kitchen", "make an omelette"): (
        *("without onions", "for two people", "with cheese", "on the table", "before 8"),
        *("this evening", "thank you"),
    ),
    ("household", "charge the phone"): (
        *("without the sponge", "in the living room", "two times", "carefully", "upstairs"),
        *("every day", "for my mother"),
    ),
}


def meaning(domain: str, text: str) -> tuple[Any, ...]:
    """What a request for one task asks for besides its name."""
    [task] = reading(domain, text).tasks
    asked = (task.required, task.excluded, task.unread, (task.place,), (task.amount,))
    return tuple(map(frozenset, asked))


@pytest.mark.parametrize(("domain", "task"), PARTS)
def test_what_a_part_of_a_request_means_does_not_depend_on_the_one_before_it(
    domain: str, task: str
) -> None:
    alone = meaning(domain, task)
    for first, second in permutations(PARTS[domain, task], 2):
        one, other = (meaning(domain, f"{task} {part}") for part in (first, second))
        both = meaning(domain, f"{task} {first} {second}")
        for found, *parts, base in zip(both, one, other, alone, strict=True):
            # what a part leaves as it is without it says nothing
            said = frozenset().union(*(part - base for part in parts))
            assert found - base == said, (first, second)


ERRANDS = {
    "kitchen": ("make an omelette", "hot chocolate", "two pancakes", "boil an egg"),
    "household": ("clean the table", "put the books away", "turn on the lamp", "play music"),
}
BETWEEN = (" and ", ", then ", ". Then ", "; ", " plus ", " as well as ", ", followed by ", " & ")
BEFORE = (
    *("Hey robot, ", "Could you please ", "I'd be glad if you could ", "Your job is to ", "gimme "),
    *("Good morning! ", "When you have time, ", "Please do the following: ", "Go and "),
)


@pytest.mark.parametrize("domain", ERRANDS)
def test_two_tasks_are_those_that_each_is_however_they_are_joined(domain: str) -> None:
    for (one, other), between in zip(permutations(ERRANDS[domain], 2), cycle(BETWEEN)):
        alone = [replace(reading(domain, text).tasks[0], said="") for text in (one, other)]
        both = reading(domain, f"{one}{between}{other}")
        assert [replace(task, said="") for task in both.tasks] == alone, between


@pytest.mark.parametrize("before", BEFORE)
def test_what_only_asks_changes_nothing(before: str) -> None:
    for domain, (errand, *_) in ERRANDS.items():
        plain, polite = (reading(domain, text) for text in (errand, f"{before}{errand}"))
        assert [replace(task, said=errand) for task in polite.tasks] == list(plain.tasks)


def code_of(domain: str, text: str) -> int:
    """The exit code that a run has."""
    try:
        return 0 if run(domain, text).goal_met else 3
    except ModelError:
        return NO_PLAN


def test_the_table_is_as_long_as_it_says() -> None:
    assert len(ROWS) >= 150
    assert len({row["said"] for _, row in ROWS if _ == "kitchen"}) == len(TABLE["kitchen"])


@pytest.mark.parametrize(("domain", "row"), ROWS, ids=[row["said"] for _, row in ROWS])
def test_a_request_is_understood(domain: str, row: dict[str, Any]) -> None:
    read = reading(domain, row["said"])
    told = asked(read.tasks)
    if "is" in row:
        assert told["tasks"] == row["is"]
    assert set(row.get("out", [])) <= set(told["excluded"])
    assert bool(read.doubts) == bool(row.get("doubt")), read.line


@pytest.mark.parametrize(("domain", "row"), ROWS, ids=[row["said"] for _, row in ROWS])
def test_a_run_ends_as_honestly(domain: str, row: dict[str, Any]) -> None:
    code = code_of(domain, row["said"])
    assert code == row["exit"]
    assert code or not reading(domain, row["said"]).doubts


def used(result: Result) -> set[str]:
    """The names in the steps of every plan of a result."""
    calls: list[Call] = [step.call for r in result.runs or (result,) for step in r.report.live]
    return {arg for call in calls for arg in call.args}


@pytest.mark.parametrize(
    ("text", "never"),
    [
        ("make a tea without milk", {"milk"}),
        ("omelette without eggs", {"egg"}),
        ("cheese sandwich without butter", {"butter", "peanut_butter"}),
        ("egg-free pancakes", {"egg", "mayonnaise", "brioche"}),
        ("tea, dairy-free, and a fruit salad", {"milk", "butter", "cheese", "yogurt"}),
        ("nut-free cookies", {"peanut_butter", "chocolate"}),
        ("vegan soup", {"chicken", "beef", "ham", "butter", "honey", "egg"}),
    ],
)
def test_what_is_excluded_is_in_no_step(text: str, never: set[str]) -> None:
    assert not used(run("kitchen", text)) & never


class Confirming:
    """A person who says the same to every question about the reading, and nothing else."""

    def __init__(self, value: str) -> None:
        self.value = value
        self.asked: list[Question] = []

    def ask(self, question: Question) -> Answer:
        """Answer a question about the reading."""
        self.asked.append(question)
        return Answer(self.value if question.kind == "reading" else "later", by="tester")

    def review(self, lessons: tuple[object, ...]) -> bool:
        """Keep what was learned."""
        return True


def test_an_uncertain_reading_is_one_question() -> None:
    person = Confirming(YES)
    result = run("kitchen", "mkae omlette", person)
    first, *others = person.asked
    assert first.kind == "reading" and "omelette" in first.text and result.goal_met
    assert "reading" not in {question.kind for question in others}


def test_a_reading_that_is_wrong_is_not_carried_out() -> None:
    result = run("kitchen", "make a sandwhich", Confirming(NO))
    assert result.verdict == "no_plan" and not used(result)


def test_another_task_keeps_what_was_excluded() -> None:
    result = run("kitchen", "omlete without salt", Confirming("is omelette"))
    assert result.goal_met and "salt" not in used(result)


def test_an_excluded_item_of_a_written_plan_blocks() -> None:
    from adaptbot_cli.session.replay import check

    kg = kg_of("kitchen")
    [task] = reading_of("tea without milk", kg).tasks
    plan = 'pick_up_obj("milk")\nput_down_obj("milk", "cup")'
    with_it = check(plan, task, kg)
    assert "E505" in {f.code for f in findings(with_it)} and with_it.verdict == "findings"
    [plain] = reading_of("tea", kg).tasks
    assert "E505" not in {f.code for f in findings(check(plan, plain, kg))}


@pytest.mark.parametrize(
    ("text", "step"),
    [
        ("tomato soup but don't boil it", "boil"),
        ("salad, don't slice the tomato", "slice"),
        ("egg sandwich but don't fry the egg", "fry"),
    ],
)
def test_a_step_that_is_refused_is_named(text: str, step: str) -> None:
    result = run("kitchen", text)
    assert result.verdict == "findings"
    assert {f.subject for f in findings(result) if f.code == "E505"} == {step}


@pytest.mark.parametrize(
    ("requires", "without", "refused", "unread"),
    [
        ((), ("boiling", "cut"), {"boil", "slice"}, ()),
        ((), ("the heat",), set(), ("without the_heat",)),
        (("2 sugars",), (), set(), ("2_sugars",)),
        (("milk",), ("sugar",), set(), ()),
    ],
)
def test_an_option_says_a_step_or_a_thing_or_is_not_understood(
    requires: tuple[str, ...], without: tuple[str, ...], refused: set[str], unread: tuple[str, ...]
) -> None:
    [task] = reading_of("make tea", kg_of("kitchen"), requires, without).tasks
    assert {action for action, _ in task.refused} == refused and task.unread == unread


def test_an_item_of_a_named_dish_is_in_it() -> None:
    assert {"rice"} <= used(run("kitchen", "rice salad"))
    assert {"macaroni"} <= used(run("kitchen", "pasta salad"))


def test_what_is_not_known_to_be_safe_is_asked_and_not_used() -> None:
    person = Confirming("later")
    result = run("kitchen", "gluten-free ham sandwich", person)
    about = {(question.about, question.prop) for question in person.asked}
    assert ("ham", "has_gluten") in about and not result.goal_met


def test_several_tasks_have_a_plan_and_a_verdict_each() -> None:
    result = run("kitchen", "make omelette and tea")
    assert [each.report.task.name for each in result.runs] == ["omelette", "tea"]
    first, second = (used(each) for each in result.runs)
    assert "tea" not in first and "egg" not in second
