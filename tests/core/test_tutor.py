"""The method as a whole, driven by scripted replies: who is asked what, in which order."""

import pytest
from rdflib import URIRef

from adaptbot_cli.core.ask.questions import LATER
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Checked, Executed, Keep, Learned, LookUp, Propose, Review
from adaptbot_cli.core.tutor import Policy
from tests.driving import Answers, Script, drive
from tests.worlds import GOOD, W, facts, related, workshop

BOARD = Task("work", ("board",))
SLAB = Task("work", ("slab",))
FETCH = "take({0})\nput({0}, bench)"
GADGET = FETCH.format("board") + "\ntake(gadget)"
"""A plan with an unknown thing that the task does not require."""


def run(
    script: Script, task: Task = BOARD, policy: Policy = "tutor", replans: int = 3
) -> tuple[Result, list[str]]:
    result = drive(task, workshop(), script, policy, replans)
    return result, script.story


def story(
    texts: list[str],
    answers: Answers,
    task: Task = BOARD,
    policy: Policy = "tutor",
    replans: int = 3,
) -> list[str]:
    return run(Script(texts, answers), task, policy, replans)[1]


def told(script: Script, attempt: int) -> tuple[str, ...]:
    """The codes of the findings that the model was told at an attempt."""
    turn = next(t for t in script.seen if isinstance(t, Propose) and t.attempt == attempt)
    return tuple(finding.code for finding in turn.findings)


def numbered(plan: str, times: int) -> list[str]:
    """Texts that differ, with different findings, so that nothing ends the re-prompting."""
    return [f"{plan}\nput(gadget_{n})" for n in range(times)]


TAUGHT = {"existence slab": "exists", "kind slab": "part", "place slab": "bench"}
ABOUT_SLAB = ["ask existence slab", "ask kind slab", "ask place slab"]
ABOUT_GADGET = ["ask existence gadget", "execute"]
STORIES: dict[str, tuple[list[str], Answers, Task, Policy, int, list[str]]] = {
    "what is required is asked about before any re-prompt": (
        [FETCH.format("slab")], TAUGHT, SLAB, "tutor", 3,
        ["propose 0", *ABOUT_SLAB, "execute", "review", "keep"],
    ),
    "for what is not, the model is asked again first": (
        [GADGET, GOOD], LATER, BOARD, "tutor", 3, ["propose 0", "propose 1", "execute"],
    ),
    "no re-prompt at all": ([GADGET], LATER, BOARD, "tutor", 0, ["propose 0", *ABOUT_GADGET]),
    "nor in the paper": ([GADGET], LATER, BOARD, "paper", 0, ["propose 0", *ABOUT_GADGET]),
    "the same text again ends the re-prompting": (
        [GADGET], LATER, BOARD, "tutor", 3, ["propose 0", "propose 1", *ABOUT_GADGET],
    ),
    "so do the same findings": (
        [GADGET, GADGET + "\nwait(5)"], LATER, BOARD, "tutor", 3,
        ["propose 0", "propose 1", *ABOUT_GADGET],
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", STORIES)
def test_who_is_asked_what_in_which_order(what: str) -> None:
    *given, wanted = STORIES[what]
    assert story(*given) == wanted  # type: ignore[arg-type]


def test_the_number_of_reprompts_is_bounded() -> None:
    told_story = story(numbered(FETCH.format("board"), 9), LATER, replans=2)
    assert told_story[:3] == ["propose 0", "propose 1", "propose 2"]
    assert "propose 3" not in told_story


def test_the_model_is_told_the_findings_and_its_previous_text() -> None:
    script = Script([GADGET, GOOD], LATER)
    run(script)
    turn = next(t for t in script.seen if isinstance(t, Propose) and t.attempt == 1)
    assert turn.previous == GADGET
    assert [finding.subject for finding in turn.findings] == ["gadget"]


def test_a_new_plan_that_lost_a_required_item_is_refused() -> None:
    script = Script([GADGET, "take(plank)\nput(plank)", GOOD], LATER)
    result, _ = run(script)
    assert told(script, 1) == ("E201",)
    assert told(script, 2) == ("E201", "E502")
    assert result.report.text == GOOD


def test_the_refused_plan_is_not_executed_when_the_tries_are_used_up() -> None:
    result, _ = run(Script([GADGET, "take(plank)\nput(plank)"], LATER), replans=1)
    assert result.report.text == GADGET
    assert result.goal_met


def test_the_paper_takes_a_plan_that_lost_a_required_item() -> None:
    lossy = "take(plank)\nput(plank)"
    result, _ = run(Script([GADGET, lossy], LATER), policy="paper", replans=1)
    assert result.report.text == lossy
    assert result.report.missing == ("board",)
    assert not result.goal_met


def test_a_required_item_under_another_name_is_not_lost() -> None:
    script = Script([GADGET, FETCH.format("Boards")], LATER)
    result, _ = run(script)
    assert result.report.text == FETCH.format("Boards")


def test_without_a_human_what_nobody_needs_is_dropped_and_the_goal_is_met() -> None:
    result, _ = run(Script([GADGET], LATER), replans=0)
    assert [step.status for step in result.report.steps][-1] == "dropped"
    assert (result.verdict, result.goal_met) == ("executable", True)
    assert result.usage.questions == 0


def test_without_a_human_a_required_unknown_stays_a_finding() -> None:
    result, told_story = run(Script([FETCH.format("slab")], LATER), SLAB, replans=0)
    assert told_story == ["propose 0", "ask existence slab"]
    assert [finding.code for finding in result.report.findings] == ["E201"]
    assert (result.verdict, result.goal_met, result.outcome) == ("findings", False, None)


def test_the_open_questions_are_kept_with_the_result() -> None:
    result, _ = run(Script([GADGET], LATER), replans=0)
    [(question, answer)] = result.questions
    assert (question.about, answer) == ("gadget", LATER)


def test_an_answer_is_never_asked_for_again() -> None:
    texts = [GADGET + "\ndry_part(gadget)", GADGET + "\npress(gadget, 1)"]
    asked = [part for part in story(texts, LATER) if part.startswith("ask")]
    assert asked == ["ask existence gadget"]


def test_an_absent_item_that_nobody_needs_is_dropped() -> None:
    result, told_story = run(Script([GADGET], {"existence gadget": "absent"}), replans=0)
    assert told_story[-3:] == ["execute", "review", "keep"]
    assert result.report.steps[-1].status == "dropped"
    assert result.goal_met


def test_a_taught_thing_is_used_at_once_even_if_its_place_is_not_known() -> None:
    result, _ = run(Script([FETCH.format("slab")], {**TAUGHT, "place slab": "unknown"}), SLAB)
    assert result.goal_met


def test_an_attribute_is_asked_where_a_step_needs_it() -> None:
    plan = GOOD + "\ndrill_hole(plank)"
    script = Script([plan], {"attribute plank drillable": "yes"})
    result, told_story = run(script, replans=0)
    assert told_story[:2] == ["propose 0", "ask attribute plank"]
    assert result.goal_met


def test_dont_know_leaves_the_finding() -> None:
    plan = GOOD + "\ndrill_hole(plank)"
    result, _ = run(Script([plan], {"attribute plank drillable": "unknown"}), replans=0)
    assert [finding.code for finding in result.report.findings] == ["E301"]
    assert result.verdict == "findings"
    assert result.usage.questions == 1


def test_words_are_looked_up_once_nouns_and_verbs_apart() -> None:
    plan = FETCH.format("lumber") + "\npolish(lumber)"
    script = Script([plan], LATER, words={"lumber": (related("board", "synonym"),)})
    run(script, Task("work"))
    looked = [turn for turn in script.seen if isinstance(turn, LookUp)]
    # The last asks whether what the lumber may be leads back to it.
    assert [turn.words for turn in looked] == [("lumber",), ("polish",), ("board",)]
    assert looked[0].fields == {"noun.artifact"}
    assert looked[1].fields == {"verb.contact"}


def test_a_refused_review_keeps_nothing() -> None:
    script = Script([FETCH.format("slab")], {"existence slab": "is board"}, accept=False)
    result, told_story = run(script, SLAB)
    assert told_story[-1] == "review"
    assert (result.lessons, result.revision) == ((), None)
    assert result.sizes[0] == result.sizes[1]


def test_what_is_reviewed_is_what_is_kept_and_told() -> None:
    script = Script([FETCH.format("slab")], TAUGHT)
    result, _ = run(script, SLAB)
    reviewed = next(turn.lessons for turn in script.seen if isinstance(turn, Review))
    kept = next(turn for turn in script.seen if isinstance(turn, Keep))
    learned = tuple(turn.lesson for turn in script.seen if isinstance(turn, Learned))
    assert result.lessons == reviewed == kept.lessons == learned
    assert len(learned) == 2
    assert kept.task == SLAB
    assert result.revision == "r1"
    assert result.lessons[0].answer.by == "tester"


def test_the_sizes_before_and_after_count_what_was_learned() -> None:
    result, _ = run(Script([FETCH.format("slab")], TAUGHT), SLAB)
    (nodes, edges), (nodes_after, edges_after) = result.sizes
    assert (nodes_after - nodes, edges_after - edges) == (1, 4)


def test_nothing_learned_is_not_reviewed() -> None:
    assert "review" not in story([GADGET], LATER)


def test_usage_counts_calls_tokens_and_answered_questions() -> None:
    answers = {"existence slab": "is board"}
    result, _ = run(Script([FETCH.format("slab")], answers), SLAB, policy="paper", replans=1)
    used = result.usage
    assert (used.model_calls, used.prompt_tokens, used.completion_tokens) == (2, 20, 10)
    assert (used.questions, used.cost_usd) == (1, None)


def test_a_text_without_a_plan_is_no_plan() -> None:
    result, told_story = run(Script(["I would rather not."], LATER), Task("work"))
    assert result.verdict == "no_plan"
    assert not result.goal_met
    assert "execute" not in told_story


def test_a_plan_that_misses_its_goal_is_executable_and_the_goal_is_not_met() -> None:
    result, _ = run(Script(["take(board)\nput(board, cupboard)"], LATER), replans=0)
    assert (result.verdict, result.goal_met) == ("executable", False)
    assert result.report.missing == ("board",)


def test_a_plan_of_dropped_steps_alone_is_not_executed() -> None:
    result, told_story = run(Script(["take(gadget)"], LATER), Task("work"), replans=0)
    assert told_story == ["propose 0", "ask existence gadget"]
    assert result.verdict == "findings"


def test_every_plan_is_checked_again_after_every_lesson() -> None:
    answers = {"existence slab": "is board"}
    script = Script([FETCH.format("slab")], answers)
    run(script, SLAB)
    assert sum(isinstance(turn, Checked) for turn in script.seen) == 2


def test_only_lessons_change_the_graph() -> None:
    kg = workshop()
    before = facts(kg)
    drive(BOARD, kg, Script([GADGET, GOOD], LATER))
    assert facts(kg) == before
    drive(SLAB, kg, Script([FETCH.format("slab")], {"existence slab": "is board"}))
    assert {s for s, _, _ in facts(kg) - before} == {URIRef(W + "board")}


def test_the_plan_that_is_executed_is_the_one_that_was_checked_last() -> None:
    script = Script([GADGET], LATER)
    run(script)
    executed = next(turn.report for turn in script.seen if isinstance(turn, Executed))
    checked = [turn.report for turn in script.seen if isinstance(turn, Checked)]
    assert executed == checked[-1]
