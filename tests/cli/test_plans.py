"""Plans that are kept: agreed to after a run, first for their task, checked anew each time."""

from pathlib import Path

import pytest

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner.kept import KeptFirst, find, kept_plans, plan_file
from adaptbot_cli.adapters.planner.prompts import Prompts
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import Answer, Question
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.plan import Finding, KeptPlan, Task
from adaptbot_cli.core.request.understand import understand
from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.resources import bundled
from tests.cli.attended import ENTER, tty
from tests.cli.command import Home
from tests.loopback import scripted
from tests.packs import KITCHEN

MILK = """pick_up_rec("glass")
put_down_rec("glass", "table")
pour_contents("milk", "glass")"""
KEEP = "glass of milk: {plan: yes}\n"
KEPT = """\
---
names: [boiled egg]
ingredients: [egg]
asked: {{task: [boiled, egg], requires: [egg]}}
kept: {{why: changed by hand, by: ann, at: '2026-11-30T10:00:00+00:00'}}
---
{}
"""


def keep(home: Home, text: str, name: str = "boiled_egg") -> None:
    home.write(f"robot/plans/kitchen/{name}.plan", KEPT.format(text))


def calls(home: Home, *arguments: str) -> list[list[str]]:
    told = home.adaptbot("run", *arguments, "--json").json()
    return [step["call"] for step in told["steps"] if step["status"] != "dropped"]


def test_a_plan_that_was_changed_is_kept_comes_first_and_can_be_taken_back(home: Home) -> None:
    usual = calls(home, "boiled egg", "--dry-run")
    ready, drop = "The plan is ready. Shall it change?", "Drop which step?"
    with tty(home, "run", "boiled egg", "--edit") as opened:
        opened.answers((ready, "d"), (drop, "17" + ENTER), (ready, "d"), (drop, "16" + ENTER))
        opened.answers((ready, "l"), ('Shall I keep this plan for "boiled egg"?', "y"))
        assert opened.ends() == 0
    assert home.subjects()[-1] == 'learn: the plan for "boiled egg" is kept (14 steps)'
    assert home.trailers()["Answer-1"] == ["yes"]
    listed = home.adaptbot("plans", "--json").json()["plans"]
    assert [plan["request"] for plan in listed] == ["boiled egg"]
    name = listed[0]["name"]
    assert listed[0]["kept"]["why"] == "changed by hand"
    shown = home.adaptbot("plans", "show", "boil")
    assert shown.code == 0 and "executable, goal met" in shown.said and "run 2" in shown.said
    ended = home.adaptbot("run", "boil an egg")
    assert "the plan that is kept for this task (changed by hand" in ended.said
    assert calls(home, "boiled egg") == usual[:-2]
    assert home.replays()
    path = home.workspace / "plans" / "kitchen" / f"{name}.plan"
    path.write_text(path.read_text() + "wait(1)\n")
    assert home.adaptbot("undo", "--yes").code == 4  # it was edited since
    assert f"{name}.plan" in home.adaptbot("kg", "status").said
    assert "brings it back" in home.adaptbot("plans", "drop", name, "--yes").said
    assert home.subjects()[-2:] == [f"hand edit: {name}.plan", f'drop the plan "{name}"']
    assert f"put back {name}.plan" in home.adaptbot("undo", "--yes").said
    assert calls(home, "boiled egg")[-1] == ["wait", "1"]
    assert home.adaptbot("plans", "drop", name, "--yes").code == 0
    assert calls(home, "boiled egg") == usual
    assert home.adaptbot("undo", "--yes").code == 0
    assert home.adaptbot("undo", "--yes").code == 2


def test_a_plan_of_a_model_is_kept_once_it_has_met_its_goal_in_the_world(home: Home) -> None:
    answers, world = ("--answers", home.write("answers.yaml", KEEP)), home.write("world.ttl", "")
    with scripted(MILK) as model:
        env = model.environment()
        first = home.adaptbot("run", "glass of milk", *answers, **env)
        assert "was not asked for" in first.said  # a rehearsal proves nothing
        ended = home.adaptbot("run", "glass of milk", *answers, "--world", world, **env)
        assert ended.code == 0, ended.said
        asked = len(model.prompts)
        again = home.adaptbot("run", "glass of milk", "--no-human", **env)
        assert asked == 2 and len(model.prompts) == asked
    assert "kept for this task (met its goal in the world" in again.said
    assert home.adaptbot("plans", "show", "glass of milk").code == 0


def test_a_kept_plan_that_no_longer_serves_gives_way_to_the_planner(home: Home) -> None:
    usual = calls(home, "boiled egg")
    keep(home, 'pick_up_obj("unicorn")\nboil("egg", "pot")')
    assert calls(home, "boiled egg", "--no-human") == usual
    with scripted(MILK) as model:
        home.adaptbot("run", "boiled egg", "--no-human", "--replans", "1", **model.environment())
        assert "unicorn" in model.prompts[0]  # it is asked to mend the kept plan


def test_a_kept_plan_serves_that_very_request_and_is_no_template(home: Home) -> None:
    usual = calls(home, "boiled egg without salt", "--dry-run")
    keep(home, 'wait(1)\n{% for x in items %}\nboil("{{ x }}", "pot")\n{% endfor %}')
    assert calls(home, "boiled egg without salt") == usual
    assert calls(home, "two boiled eggs") != [["wait", "1"]]
    shown = home.adaptbot("plans", "show", "boiled egg", "--json").json()
    assert "{% for x in items %}" in shown["steps"]


def test_names_that_mean_none_or_several_are_told(home: Home) -> None:
    assert home.adaptbot("plans").said == "no plan is kept for a task of the kitchen"
    assert home.adaptbot("plans", "show", "x").code == 2
    keep(home, "wait(1)")
    keep(home, "wait(2)", "boiled_egg_amount_2")
    ended = home.adaptbot("plans", "drop", "boil", "--yes")
    assert ended.code == 2 and "boiled_egg, boiled_egg_amount_2" in ended.said
    assert home.adaptbot("plans", "drop", "boiled_egg").code == 2  # nobody is there to agree
    assert home.adaptbot("plans", "drop", "boiled_egg_amount_2", "--yes").code == 0
    assert [plan["name"] for plan in home.adaptbot("plans", "--json").json()["plans"]] == [
        "boiled_egg"
    ]
    keep(home, "wait(1)", "odd")
    path = home.workspace / "plans" / "kitchen" / "odd.plan"
    path.write_text("no front matter")
    ended = home.adaptbot("plans")
    assert ended.code == 0 and "odd.plan: has no front matter" in ended.said
    assert "left out: " in home.adaptbot("run", "omelette", "--no-human").said
    assert home.adaptbot("plans", "show", "odd").code == 4
    assert home.adaptbot("plans", "drop", "odd", "--yes").code == 0
    assert [plan["name"] for plan in home.adaptbot("plans", "--json").json()["plans"]] == [
        "boiled_egg"
    ]


GARBLED = [
    ("requires: [egg]", "without: 5"),
    ("asked: {", "asked: 3 #"),
    ("kept: {", "kept: 3 #"),
    ("names: [boiled egg]", "names: 3"),
    ("---", ""),
]


def test_garbled_plans_are_told_and_stop_nothing(home: Home) -> None:
    for n, (old, new) in enumerate(GARBLED):
        text = KEPT.format("wait(1)").replace(old, new)
        home.write(f"robot/plans/kitchen/boiled_egg_{n}.plan", text)
    ended = home.adaptbot("plans", "--json")
    assert ended.code == 0 and len(ended.json()["broken"]) == len(GARBLED)
    assert home.adaptbot("run", "boiled egg", "--no-human").code == 0


def test_a_plan_behind_a_link_is_not_read(home: Home, tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text(KEPT.format("wait(1)"))
    folder = home.workspace / "plans" / "kitchen"
    folder.mkdir(parents=True)
    (folder / "boiled_egg.plan").symlink_to(secret)
    ended = home.adaptbot("plans", "--json")
    assert ended.json()["plans"] == [] and "symbolic link" in str(ended.json()["broken"])


@pytest.fixture(scope="module")
def kitchen():  # type: ignore[no-untyped-def]
    return KITCHEN.kg()


@pytest.mark.parametrize(
    "request_text",
    ["omelette", "omelette without onion", "two vegan sandwiches", "milk to the table"],
)
def test_what_is_kept_serves_the_same_request_again(kitchen, tmp_path, request_text) -> None:  # type: ignore[no-untyped-def]
    def task(text: str) -> Task:
        return understand(text, kitchen, WordNet()).tasks[0]

    question = Question("plan", "it", "Shall I?", "changed by hand")
    answer, plan = Answer("yes", "ann", "2026-11-30"), KeptPlan(task(request_text), "wait(1)")
    lesson = Lesson(Delta(), question, answer, "kept", plan=plan)
    name, data = plan_file(lesson, "library", "")
    (tmp_path / name).write_bytes(data)
    plans, _ = kept_plans(tmp_path)
    assert find(task(request_text), plans) is plans[0]
    others = ("mushroom omelette with cheese", f"{request_text} with a smile on top")
    assert all(find(task(other), plans) is None for other in others)
    assert find(task(plans[0].kept["request"]), plans) is plans[0]


def test_a_kept_plan_is_an_example_for_a_model(kitchen, tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "a.plan").write_text(
        KEPT.format('pick_up_obj("egg")\nboil("egg", "pot")').replace("boiled egg", "egg in a cup")
    )
    prompts = Prompts(bundled("prompts"), kitchen, kept=tuple(kept_plans(tmp_path)[0]))
    turn = Propose(Task("egg in a big cup"))
    assert 'boil("egg", "pot")' in str(prompts.messages(turn))


def test_the_other_planner_is_asked_once_afresh_if_it_listens_to_no_findings(tmp_path) -> None:  # type: ignore[no-untyped-def]
    class Other:
        name = "other"

        def __init__(self) -> None:
            self.turns: list[Propose] = []

        def propose(self, turn: Propose) -> Proposal:
            self.turns.append(turn)
            return Proposal("own", calls=0)

    (tmp_path / "a.plan").write_text(KEPT.format("wait(1)"))
    other, task = Other(), Task("boiled egg", required=("egg",))
    planner = KeptFirst(kept_plans(tmp_path)[0], other, listens=False)
    first = planner.propose(Propose(task))
    assert first.text == "wait(1)" and first.source
    findings = (Finding("E401", "no"),)
    assert planner.propose(Propose(task, 1, first.text, findings)).text == "own"
    assert planner.propose(Propose(task, 2, "own", findings)).text == "own"
    assert [(turn.attempt, turn.findings) for turn in other.turns] == [(0, ())]
