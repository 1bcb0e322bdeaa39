"""A domain of PDDL as a pack: its verdicts are those of a plan validator that nobody here wrote."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest

from adaptbot_cli.adapters.pddl import packed
from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Task
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.session.replay import check
from tests.cli.command import Home

up = pytest.importorskip("unified_planning.shortcuts")
plans = pytest.importorskip("unified_planning.plans")
up_io = pytest.importorskip("unified_planning.io")

DATA: Final = Path(__file__).parents[1] / "data" / "pddl"
GOLD: Final = {
    "gripper": """
        (pick ball-1 kitchen left) (pick ball-2 kitchen right) (move kitchen hall)
        (drop ball-1 hall left) (drop ball-2 hall right)""",
    "blocks": """
        (unstack red green) (stack red blue) (pick-up green) (stack green red)""",
    "briefcase": """
        (put-in dictionary home) (carry home office) (take-out dictionary) (carry office home)""",
    "laundry": """
        (walk bathroom) (open-door machine) (take shirt hamper) (put shirt machine)
        (close-door machine) (wash machine) (stop machine) (open-door machine)
        (take shirt machine) (walk balcony) (hang shirt)""",
}

Step = tuple[str, ...]


@dataclass(frozen=True)
class World:
    """A problem as it is here and as the validator has it."""

    kg: Kg
    task: Task
    problem: Any

    def here(self, plan: list[Step]) -> bool:
        """Tell whether a plan, as it is written, is executable and meets the goal here."""
        text = "\n".join(f"({' '.join(step)})" for step in plan)
        return check(text, self.task, self.kg, repair=False).goal_met

    def there(self, plan: list[Step]) -> bool:
        """Tell whether the validator accepts a plan."""
        steps = [
            plans.ActionInstance(self.problem.action(name), tuple(map(self._object, given)))
            for name, *given in plan
        ]
        with up.PlanValidator(problem_kind=self.problem.kind) as validator:
            told = validator.validate(self.problem, plans.SequentialPlan(steps))
        return bool(told)

    def _object(self, name: str) -> Any:
        return up.ObjectExp(self.problem.object(name))


@pytest.fixture(scope="module", params=GOLD)
def world(request: pytest.FixtureRequest) -> tuple[World, list[Step]]:
    """Return each problem with a plan that solves it."""
    name = request.param
    files = DATA / f"{name}.pddl", DATA / f"{name}-problem.pddl"
    up.get_environment().credits_stream = None
    kg = load_kg(packed(*files, name), name)
    problem = up_io.PDDLReader().parse_problem(*map(str, files))
    gold = [tuple(step.strip("( \n").split()) for step in GOLD[name].split(")")]
    return World(kg, kg.domain.tasks[0], problem), [step for step in gold if step]


def mutants(plan: list[Step], problem: Any) -> Iterator[list[Step]]:
    """Every plan that is one step away: left out, said twice, swapped, with another thing."""
    for at, step in enumerate(plan):
        yield plan[:at] + plan[at + 1 :]
        yield [*plan[: at + 1], *plan[at:]]
        if at:
            yield [*plan[: at - 1], step, plan[at - 1], *plan[at + 1 :]]
        parameters = problem.action(step[0]).parameters
        for place, parameter in enumerate(parameters, start=1):
            for thing in problem.objects(parameter.type):
                if thing.name != step[place]:
                    other = (*step[:place], thing.name, *step[place + 1 :])
                    yield [*plan[:at], other, *plan[at + 1 :]]


def test_a_plan_that_solves_it_does(world: tuple[World, list[Step]]) -> None:
    known, gold = world
    assert known.here(gold) and known.there(gold)


def test_every_plan_one_step_away_is_judged_as_the_validator_judges(
    world: tuple[World, list[Step]],
) -> None:
    known, gold = world
    mutated = list(mutants(gold, known.problem))
    assert len(mutated) >= 20
    differ = [plan for plan in mutated if known.here(plan) != known.there(plan)]
    assert differ == []


def test_a_domain_is_brought_by_one_command_and_its_plans_are_repaired(home: Home) -> None:
    files = [str(DATA / name) for name in ("laundry.pddl", "laundry-problem.pddl")]
    ended = home.adaptbot("domain", "import", *files)
    assert ended.code == 0 and "8 actions, 1 task" in ended.said
    assert home.subjects()[-1].startswith("domain: import laundry")
    assert home.adaptbot("domain", "check", "laundry").code == 0
    without_a_step = GOLD["laundry"].replace("(walk bathroom)", "")
    plan = home.write("laundry.plan", without_a_step)
    asked = ("check", plan, "--domain", "laundry", "--task", "wash and hang")
    told = home.adaptbot(*asked, "--json")
    assert told.code == 0 and told.json()["goal"]["met"]
    added = [step["call"] for step in told.json()["steps"] if step["status"] == "inserted"]
    assert added == [["walk", "bathroom"]]
    assert home.adaptbot(*asked, "--no-repair").code == 3


REFUSED: Final = {
    "three things": (
        "(:predicates (between ?a ?b ?c))",
        r"is said of 3 things.*between-a \?it \?a",
    ),
    "numbers": ("(:functions (level ?a))", "the number level"),
    "no end": ("(:predicates (on ?a ?b)", "no PDDL that can be read"),
    "no text": ("\0\xff", "no PDDL that can be read"),
    "depth": ("(" * 30_000 + ")" * 30_000, "nested more than 100 deep"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_graph_cannot_hold_is_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    text, told = REFUSED[name]
    path = tmp_path / "domain.pddl"
    path.write_text(f"(define (domain odd) {text})", encoding="utf-8")
    with pytest.raises(KnowledgeError, match=told):
        packed(path, None, "odd")
    with pytest.raises(UsageError):
        packed(tmp_path / "none.pddl", None, "odd")


def test_an_action_may_be_called_as_a_predicate_is(home: Home) -> None:
    text = """(define (domain doors) (:predicates (open ?d) (door ?d))
      (:action open :parameters (?d) :precondition (not (open ?d)) :effect (open ?d)))"""
    ended = home.adaptbot("domain", "import", home.write("doors.pddl", text))
    assert ended.code == 0 and ended.err == ""
    assert home.adaptbot("domain", "check", "doors").code == 0


def test_the_name_of_a_file_is_text_and_names_that_are_one_here_are_refused(tmp_path: Path) -> None:
    path = tmp_path / 'gripper" . ex:x ex:y "\\.pddl'
    path.write_text((DATA / "gripper.pddl").read_text(encoding="utf-8"), encoding="utf-8")
    domain = load_kg(packed(path, None, "gripper"), "gripper").domain
    assert path.stem in domain.comment
    alike = (DATA / "gripper-problem.pddl").read_text(encoding="utf-8").replace("ball-2", "ball_1")
    (tmp_path / "problem.pddl").write_text(alike, encoding="utf-8")
    with pytest.raises(KnowledgeError, match="called ball_1 alike"):
        packed(DATA / "gripper.pddl", tmp_path / "problem.pddl", "gripper")
