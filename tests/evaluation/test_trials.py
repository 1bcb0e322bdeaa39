"""Trials in the workshop: what each arm makes of the same answer, and what is measured."""

from pathlib import Path

import pytest

from adaptbot_cli.adapters.planner.library import Library
from adaptbot_cli.core.turns import Propose
from adaptbot_cli.evaluation.measures import Trial
from adaptbot_cli.evaluation.trial import Basis, Rules, perform, task_of
from adaptbot_cli.resources import bundled
from adaptbot_cli.workspace import Workspace
from tests.evaluation.shared import row, world

GOOD = 'take_part("board")\nput("board", "bench")\ndrill_hole("board", "drill")'
PEG = 'take_part("peg")\nput("peg", "bench")\ndrill_hole("peg", "drill")'
ARMS = ("llm", "llm+kg", "llm+kg+human")


def trial(
    arm: str, *answers: str, required: tuple[str, ...] = ("board",), **rules: object
) -> Trial:
    found, _ = perform(row(*answers, required=required), arm, world(), Rules(**rules))  # type: ignore[arg-type]
    return found


@pytest.mark.parametrize("arm", ARMS)
def test_a_good_plan_is_good_in_each_arm(arm: str) -> None:
    found = trial(arm, GOOD)
    assert (found.executable, found.goal_met) == (True, True)
    assert (found.overlap, found.effective_overlap, found.required_lost) == (1, 1, 0)
    assert (found.model_calls, found.questions, found.prompts) == (1, 0, 0)
    assert found.prompt_tokens > 100 and found.completion_tokens > 10


@pytest.mark.parametrize(
    "name", ["work", "bord", "xyzzy now", "work without glitter", "work without a plank"]
)
@pytest.mark.parametrize("arm", ARMS)
def test_a_name_that_the_domain_does_not_list_is_no_finding(arm: str, name: str) -> None:
    found, _ = perform(row(GOOD, task=name), arm, world(), Rules())
    assert (found.goal_met, found.findings, found.questions) == (True, {}, 0)
    assert (found.task, found.required) == (name, ("board",))


def test_several_tasks_in_one_row_are_all_judged() -> None:
    kitchen = Basis(Workspace(Path("nowhere")).files("kitchen"), "kitchen")
    library = Library((bundled("prompts") / "library" / "kitchen",), kitchen.domain)
    tea, salad = (
        library.propose(Propose(task_of(row(task=name, required=()), kitchen.fresh()))).text
        for name in ("tea", "fruit salad")
    )

    def met(*plans: str) -> bool:
        asked = row("\n".join(plans), task="tea and fruit salad", required=())
        return perform(asked, "llm+kg", kitchen, Rules(replans=0))[0].goal_met

    assert (met(tea, salad), met(tea), met(salad)) == (True, False, False)


def test_the_model_alone_is_taken_at_its_word() -> None:
    alone, refined = trial("llm", 'bore("board")'), trial("llm+kg", 'bore("board")')
    assert not alone.executable and alone.findings == {"E101": 1}
    assert refined.executable and refined.substitutions[0]["to"] == "drill_hole"
    assert not alone.substitutions


def test_the_model_alone_is_told_its_error_and_asked_again() -> None:
    found = trial("llm", 'bore("board")', GOOD)
    assert found.executable and found.model_calls == 2
    assert trial("llm", 'bore("board")', GOOD, replans=0).model_calls == 1
    assert trial("llm", 'bore("board")').model_calls == 4, "a recording that has run out goes on"


def test_execution_alone_stops_at_the_first_error() -> None:
    found = trial(
        "llm", f'{GOOD}\ndrill_hole("vase")\ntake_part("plank")', required=("board", "plank")
    )
    assert not found.executable
    assert (found.overlap, found.unused) == (0.5, ("plank",))
    assert found.required_lost == 0, "the plan still names the plank: nothing hides"


def test_a_name_is_not_enough_where_the_text_holds_no_plan() -> None:
    found = trial("llm", "I am sorry.")
    assert found.outcome == "no_plan" and found.lost == ("board",)
    assert found.findings == {"E501": 1, "P101": 1}


def test_only_the_person_knows_the_peg() -> None:
    alone = trial("llm+kg", PEG, required=("peg",))
    helped = trial("llm+kg+human", PEG, required=("peg",))
    assert not alone.executable and alone.overlap == 0
    assert helped.goal_met and helped.effective_overlap == 1
    assert helped.questions == 1 and helped.prompts >= 3 and helped.person_seconds > 3
    assert {entry["about"] for entry in helped.asked} == {"peg"}
    assert helped.nodes[1] == helped.nodes[0] + 1
    assert helped.edges[1] - helped.edges[0] == len(helped.taught)


def test_another_name_for_an_action_is_told() -> None:
    found = trial("llm+kg+human", 'take_part("board")\nput("board")\nperforate("board", "drill")')
    assert found.goal_met
    assert {
        "about": "perforate",
        "kind": "existence",
        "prop": "",
        "answer": "is drill_hole",
    } in found.asked
    assert found.nodes[0] == found.nodes[1], "another name is no node"


def test_fetching_is_no_use() -> None:
    found = trial("llm+kg", 'take_part("board")\nput("board", "bench")')
    assert (found.executable, found.overlap, found.effective_overlap) == (True, 1, 0)
    assert found.unworked == ("board",)


def test_setting_down_where_the_task_wants_it_is_use() -> None:
    found = trial(
        "llm+kg", 'take_part("plank")\nput("plank", "stove")', required=("plank", "stove")
    )
    assert found.effective_overlap == 1


def test_a_hidden_tool_counts_as_used() -> None:
    found = trial("llm+kg", 'drill_hole("board")', required=("board", "drill"))
    assert found.effective_overlap == 1


def test_an_item_dropped_by_a_new_plan_is_lost_alone_but_guarded_with_the_graph() -> None:
    answers = ('take_part("board")\ndrill_hole("vase")', 'take_part("plank")')
    alone = trial("llm", *answers, replans=1)
    assert alone.findings.get("E501") == 1, "we see it; the model alone would not"
    assert (alone.lost, alone.required_lost) == (("board",), 1)
    assert trial("llm+kg", *answers, replans=1).findings.get("E502") == 1


def test_each_trial_starts_from_the_same_graph() -> None:
    shared, rules = world(), Rules()
    first = [
        perform(row(PEG, required=("peg",)), "llm+kg+human", shared, rules)[0] for _ in range(2)
    ]
    assert first[0].taught == first[1].taught and first[0].questions == first[1].questions == 1


def test_knowledge_carried_over_is_not_asked_again() -> None:
    shared, rules = world(), Rules()
    _, lessons = perform(row(PEG, required=("peg",)), "llm+kg+human", shared, rules)
    later, more = perform(row(PEG, required=("peg",)), "llm+kg+human", shared, rules, lessons)
    assert later.goal_met and (later.questions, more) == (0, ())


def test_an_erring_person_is_reproducible() -> None:
    wrong = trial("llm+kg+human", PEG, required=("peg",), human_error=1.0)
    assert not wrong.goal_met and wrong.asked[0]["answer"] == "absent"
    some = [
        trial("llm+kg+human", PEG, required=("peg",), human_error=0.5, seed=4) for _ in range(2)
    ]
    assert some[0].asked == some[1].asked


def test_no_required_item_no_overlap() -> None:
    found = trial("llm+kg", 'take_part("plank")\nput("plank")', required=())
    assert (found.overlap, found.effective_overlap, found.lost) == (None, None, ())
