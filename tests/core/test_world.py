"""A plan in a world that disagrees: what fails and surprises, who is asked, what is done again."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import Literal, URIRef

from adaptbot_cli.core.ask.questions import LATER, Reviewed
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.request.understand import Reading
from adaptbot_cli.core.turns import Act, Ask, Begin, Believe, Propose, Stop, Turn
from adaptbot_cli.core.tutor import Confirm, Policy, Turns, pursue, pursue_each
from adaptbot_cli.core.world import (
    Seen,
    believe,
    fact_of,
    is_irreversible,
    named,
    possible,
)
from tests.driving import Answers, Script, played
from tests.worlds import GOOD, W, facts, workshop

STOOL = Task("stool", ("board",), workshop().domain.tasks[0].goals)
DONE = [
    'open("cupboard")',
    'take_part("board")',
    'put("board", "bench")',
    'charge("drill")',
    'drill_hole("board", "drill")',
]
"""The steps of GOOD with those that the tool inserts, as they are carried out."""

Says = Callable[[Act], Seen]


def fact(subject: str, predicate: str, value: object) -> tuple[URIRef, URIRef, Any]:
    node = URIRef(W + value) if isinstance(value, str) else Literal(value)
    return URIRef(W + subject), URIRef(W + predicate), node


def refuses(call: str, times: int = 1, reason: str = "it slipped", **seen: Any) -> Says:
    """A world that refuses a call so often, and does everything else."""
    left = [times]

    def says(turn: Act) -> Seen:
        if turn.step.call.render() == call and left[0]:
            left[0] -= 1
            return Seen(reason, **seen)
        return Seen()

    return says


@dataclass
class Played:
    """A run in a world, with everything that was tried, asked and kept."""

    result: Result
    script: Script
    kg: Kg
    turns: list[Turn] = field(default_factory=list)

    @property
    def tried(self) -> list[str]:
        return [turn.step.call.render() for turn in self.turns if isinstance(turn, Act)]

    @property
    def asked(self) -> list[str]:
        asked = (turn.question for turn in self.turns if isinstance(turn, Ask))
        return [f"{question.kind} {question.about}" for question in asked]

    @property
    def done(self) -> list[str | None]:
        return [step.done for step in self.result.report.steps]


def play(
    says: Says,
    texts: Sequence[str] = (GOOD,),
    answers: Answers = LATER,
    policy: Policy = "tutor",
    replans: int = 0,
    confirm: Confirm = "none",
    task: Task = STOOL,
    begin: Seen | None = None,
    stop: Seen | None = None,
    accept: Any = True,
) -> Played:
    kg = workshop()
    script = Script(texts, answers, accept=accept)
    turns: list[Turn] = []

    def reply(turn: Turn) -> Any:
        turns.append(turn)
        told = script.reply(turn, kg)
        match turn:
            case Begin():
                return begin or Seen()
            case Act():
                return says(turn)
            case Stop():
                return stop or Seen()
        return told

    run = pursue(task, kg, parser(kg), policy, replans, world=confirm)
    return Played(played(run, reply), script, kg, turns)


def play_each(run: Turns) -> Result:
    """Play a run whose plans are good, in a rehearsal."""
    script = Script([GOOD, GOOD], LATER)
    return played(run, lambda turn: script.reply(turn, workshop()))


def test_a_world_that_does_as_expected_is_believed_and_kept_step_by_step() -> None:
    played = play(lambda turn: Seen())
    assert played.tried == DONE and played.done == ["done"] * 5
    outside = played.result.outside
    assert outside is not None and (outside.failed, outside.surprise) == (0, Delta())
    assert played.result.goal_met
    assert fact("board", "drilled", True) in played.kg.facts
    kept = [turn for turn in played.turns if isinstance(turn, Believe)]
    assert [turn.step.partition(". ")[2] for turn in kept] == DONE


def test_a_step_that_fails_once_is_tried_again_and_nothing_done_is_done_twice() -> None:
    played = play(refuses(DONE[2]))
    assert played.tried == [*DONE[:3], *DONE[2:]]
    assert played.done == ["done", "done", "failed", "done", "done", "done"]
    assert played.result.goal_met and not played.asked
    outside = played.result.outside
    assert outside is not None and (outside.failed, outside.recovered) == (1, 1)


def test_a_step_that_fails_again_is_told_to_the_model_with_what_was_done() -> None:
    played = play(refuses(DONE[4], 3), [GOOD, "drill_hole(board, drill)"], replans=1)
    again = next(t for t in played.turns if isinstance(t, Propose) and t.attempt)
    assert again.done == ('take_part("board")', 'put("board", "bench")')
    assert [f.code for f in again.findings] == ["E601"]
    assert played.tried == [*DONE, *[DONE[4]] * 3] and played.result.goal_met


def test_a_model_that_sends_the_whole_plan_again_does_not_repeat_what_is_done() -> None:
    played = play(refuses(DONE[3], 3), [GOOD, GOOD + "\nwait(1)"], replans=1)
    assert played.tried == [*DONE[:4], *[DONE[3]] * 2, *DONE[3:], "wait(1)"]


@pytest.mark.parametrize(
    ("answer", "then"),
    [
        ("again", [DONE[4]]),
        ("done", []),
        ("skip", []),
        ("later", []),
    ],
)
def test_the_person_is_asked_about_a_step_that_fails_again(answer: str, then: list[str]) -> None:
    played = play(refuses(DONE[4], 3), answers={"failed board": answer})
    assert played.asked == ["failed board"]
    assert played.tried == [*DONE, *[DONE[4]] * 2, *then]
    assert played.result.goal_met is (answer in ("again", "done"))
    assert (fact("board", "drilled", True) in played.kg.facts) is (answer in ("again", "done"))


def test_what_the_person_has_done_by_hand_is_not_recovered_from() -> None:
    played = play(refuses(DONE[2], 3), answers={"failed board": "done"})
    outside = played.result.outside
    assert played.result.goal_met
    assert outside is not None and (outside.failed, outside.recovered) == (3, 0)


def test_after_help_with_the_last_step_a_new_plan_brings_about_what_is_left() -> None:
    """The board was moved while the robot tried: nothing has been tried since the person helped."""
    left = [4]

    def says(turn: Act) -> Seen:
        if turn.step.call.render() != DONE[4] or not left[0]:
            return Seen()
        left[0] -= 1
        moved = frozenset({fact("board", "in", "stove")}) if left[0] == 3 else frozenset()
        return Seen("it slipped", observed=moved)

    texts = [GOOD, GOOD, "take(board)\nput(board, bench)"]
    played = play(says, texts, {"failed board": "done"}, replans=4)
    assert played.asked == ["failed board"] and played.result.goal_met
    assert played.tried[-2:] == ['take_part("board")', 'put("board", "bench")']


def test_what_is_not_as_it_must_be_is_offered_as_it_is_learned() -> None:
    played = play(refuses(DONE[4], 3), answers={"failed board": "not drillable board"})
    (question,) = (turn.question for turn in played.turns if isinstance(turn, Ask))
    assert {lesson.sentence for lesson in played.result.lessons} < {
        choice.label for choice in question.choices
    }


def test_the_person_says_that_a_thing_is_not_as_the_step_needs_it() -> None:
    played = play(refuses(DONE[4], 3), answers={"failed board": "not drillable board"})
    assert fact("board", "drillable", False) in played.kg.facts
    assert [lesson.sentence for lesson in played.result.lessons] == ["board: drillable no"]
    assert played.result.verdict == "findings"


def test_what_a_condition_asks_of_an_attribute_may_be_known_wrongly() -> None:
    played = play(refuses(DONE[4], 3), answers={"failed board": "not battery drill"})
    assert fact("drill", "battery", False) in played.kg.facts
    assert played.result.verdict == "executable"


def test_where_a_thing_is_that_is_missed_is_asked_and_it_is_fetched_from_there() -> None:
    missed = frozenset({fact("board", "in", "cupboard")})
    says = refuses(DONE[1], reason="the board is not in the cupboard", gone=missed)
    played = play(says, answers={"place board": "stove"})
    assert played.asked == ["place board"]
    assert played.tried == [*DONE[:2], *DONE[1:]] and played.result.goal_met
    assert [lesson.sentence for lesson in played.result.lessons] == ["board: place stove"]
    outside = played.result.outside
    assert outside is not None and (outside.failed, outside.recovered) == (1, 0)


def test_what_is_seen_elsewhere_is_believed_without_a_word() -> None:
    """The board lies on the bench: the door need not be opened for it, nor it be put there."""
    seen = Seen(observed=frozenset({fact("board", "in", "bench")}))
    played = play(lambda turn: Seen(), begin=seen)
    assert not played.asked and played.result.goal_met
    assert DONE[0] not in played.tried


def test_what_is_put_right_by_the_world_is_not_done_again() -> None:
    """The cupboard falls shut after it was opened: it is opened once more."""

    def says(turn: Act) -> Seen:
        shut = frozenset({fact("cupboard", "doorOpen", False)})
        return Seen(observed=shut) if turn.number == 1 else Seen()

    played = play(says)
    assert played.tried == [DONE[0], *DONE] and played.result.goal_met


def test_attributes_are_not_taken_from_what_is_seen() -> None:
    heavy = frozenset({fact("board", "heavy", True)})
    played = play(lambda turn: Seen(observed=heavy))
    assert fact("board", "heavy", True) not in played.kg.facts and played.result.goal_met


def test_the_last_word_on_the_goal_is_the_worlds() -> None:
    played = play(lambda turn: Seen(), stop=Seen("the hole is too small", goal=False))
    assert played.result.verdict == "executable" and not played.result.goal_met
    assert [f.message for f in played.result.outcome.unmet] == [  # type: ignore[union-attr]
        "the world says that the goal is not met: the hole is too small"
    ]
    undone = Seen(observed=frozenset({fact("board", "drilled", False)}))
    played = play(lambda turn: Seen(), stop=undone)
    assert not played.result.goal_met


@pytest.mark.parametrize("over", ["stopped", "lost"])
def test_a_run_that_is_stopped_keeps_what_was_done(over: str) -> None:
    def says(turn: Act) -> Seen:
        dead = "dead" if over == "lost" else ""
        return Seen(dead, over=over) if turn.number == 2 else Seen()

    played = play(says)
    assert len(played.tried) == 2 and not played.result.goal_met
    error = played.result.outcome.error  # type: ignore[union-attr]
    assert error is not None and error.code == {"stopped": "E604", "lost": "E602"}[over]
    assert fact("cupboard", "doorOpen", True) in played.kg.facts


@pytest.mark.parametrize(
    ("confirm", "asked"),
    [("none", []), ("each", DONE), ("irreversible", [DONE[0], DONE[3], DONE[4]])],
)
def test_steps_are_confirmed_as_asked_for(confirm: Confirm, asked: list[str]) -> None:
    answers = {f"confirm {call}": "yes" for call in DONE}
    played = play(lambda turn: Seen(), answers=answers, confirm=confirm)
    assert played.asked == [f"confirm {call}" for call in asked]
    assert played.result.goal_met
    refused = play(lambda turn: Seen(), answers=LATER, confirm=confirm)
    assert refused.tried == (DONE[: DONE.index(asked[0])] if asked else DONE)


def test_after_all_of_it_nothing_is_confirmed_any_more() -> None:
    played = play(lambda turn: Seen(), answers={f"confirm {DONE[0]}": "all"}, confirm="each")
    assert played.asked == [f"confirm {DONE[0]}"] and played.tried == DONE


def test_who_goes_back_from_the_review_of_a_place_is_asked_again() -> None:
    """What is done cannot be gone back on: the question comes again, and nothing else."""
    missed = frozenset({fact("board", "in", "cupboard")})
    says = refuses(DONE[1], reason="it is not there", gone=missed)
    back = Reviewed(back=("place", "board", "in", "item"))
    played = play(says, answers={"place board": "stove"}, accept=[back, True])
    assert played.asked == ["place board"] * 2 and played.result.goal_met
    assert [lesson.sentence for lesson in played.result.lessons] == ["board: place stove"]


def test_which_actions_cannot_be_undone_follows_from_the_effects() -> None:
    domain = workshop().domain
    found = {name for name, action in domain.actions.items() if is_irreversible(action, domain)}
    assert found == {"open", "charge", "drill_hole", "dry_part"}


def test_a_world_that_undoes_everything_ends() -> None:
    def says(turn: Act) -> Seen:
        return Seen(observed=frozenset({fact("cupboard", "doorOpen", False)}))

    played = play(says, replans=3)
    assert not played.result.goal_met and len(played.tried) < 20


def test_what_a_world_undoes_with_success_again_and_again_is_asked_about() -> None:
    """The board slips back each time, and the door falls shut."""

    def says(turn: Act) -> Seen:
        if turn.step.call.action != "take_part":
            return Seen()
        back = {fact("cupboard", "doorOpen", False), fact("board", "in", "cupboard")}
        return Seen(observed=frozenset(back), gone=frozenset({fact("arm", "holds", "board")}))

    played = play(says)
    assert played.tried == [*DONE[:2] * 2, DONE[0]] and played.asked == ["failed cupboard"]
    assert played.result.outcome is not None and played.result.outcome.error is not None
    assert "does not last" in played.result.outcome.error.message


def test_a_task_that_missed_its_goal_before_the_interruption_is_not_forgotten() -> None:
    kg = workshop()

    def resumed(why: str) -> Result:
        reading = Reading("", (replace(STOOL, name="shelf"), STOOL))
        return play_each(pursue_each("", lambda _: reading, kg, parser(kg), over=[("shelf", why)]))

    assert resumed("goal met").goal_met
    missed = resumed("drill_hole failed: it slipped")
    assert missed.verdict == "executable" and not missed.goal_met


# The paper's policy ------------------------------------------------------------- Algorithm 1


def story(played: Played) -> list[str]:
    """The prompts, acts and questions, in order."""
    told = []
    for turn in played.turns:
        if isinstance(turn, Propose):
            told.append(f"LLM {turn.attempt}")
        elif isinstance(turn, Act):
            told.append(turn.step.call.action)
        elif isinstance(turn, Ask):
            told.append(f"human {turn.question.kind}")
    return told


def test_paper_lines_3_to_7_a_plan_without_errors_is_executed() -> None:
    played = play(lambda turn: Seen(), policy="paper", replans=2)
    assert story(played) == ["LLM 0", "open", "take_part", "put", "charge", "drill_hole"]


def test_paper_lines_8_to_13_unknown_items_are_fed_back_until_f_max() -> None:
    unknown = "take(gadget)"
    played = play(lambda turn: Seen(), [unknown, unknown, GOOD], policy="paper", replans=2)
    assert story(played)[:3] == ["LLM 0", "LLM 1", "LLM 2"] and played.result.goal_met


def test_paper_lines_14_to_17_at_f_max_the_human_is_asked_and_it_is_executed() -> None:
    slab = GOOD.replace("board", "slab")
    played = play(
        lambda turn: Seen(),
        [slab],
        {"existence slab": "is board"},
        policy="paper",
        replans=1,
    )
    assert story(played)[:4] == ["LLM 0", "LLM 1", "human existence", "open"]
    assert played.result.goal_met


def test_paper_lines_19_to_25_an_error_of_execution_is_fed_back_and_executed_again() -> None:
    """The same plan again is executed again, from the state after the failure."""
    played = play(refuses(DONE[2]), [GOOD, GOOD], policy="paper", replans=1)
    assert story(played) == [
        *("LLM 0", "open", "take_part", "put"),
        *("LLM 1", "put", "charge", "drill_hole"),
    ]
    assert played.result.goal_met


def test_paper_an_error_that_persists_beyond_f_max_is_asked_about() -> None:
    played = play(
        refuses(DONE[2], 2), [GOOD, GOOD], {"failed board": "again"}, policy="paper", replans=1
    )
    assert story(played)[4:] == ["LLM 1", "put", "human failed", "put", "charge", "drill_hole"]
    assert played.result.goal_met


def test_paper_the_counter_is_one_for_both_kinds_of_errors() -> None:
    played = play(refuses(DONE[2], 5), ["take(gadget)", GOOD], policy="paper", replans=1)
    assert story(played)[:5] == ["LLM 0", "LLM 1", "open", "take_part", "put"]
    assert "LLM 2" not in story(played)


# Beliefs ------------------------------------------------------------------------------------

SPOTS = ("bench", "cupboard", "stove")
PARTS = ("board", "plank", "drill")
PLACES = st.frozensets(
    st.tuples(st.sampled_from(PARTS), st.sampled_from(SPOTS)).map(lambda p: fact(p[0], "in", p[1]))
)


@given(PLACES, PLACES, PLACES)
def test_what_is_seen_goes_before_what_is_expected(expected: Any, observed: Any, gone: Any) -> None:
    one_each = {triple[:2]: triple for triple in sorted(observed)}
    observed = frozenset(one_each.values())
    kg = workshop()
    before = facts(kg)
    whole, _ = believe(kg, Delta(added=expected - before), Seen("", observed, gone - observed))
    after = facts(kg)
    assert observed <= after
    assert not (gone - observed) & after
    assert after == (before - whole.removed) | whole.added


def test_what_the_domain_does_not_allow_is_not_seen() -> None:
    """Neither what is of the wrong kind nor what would be in itself; the rest is."""
    good = frozenset({fact("board", "in", "stove"), fact("cupboard", "doorOpen", True)})
    bad = frozenset({fact("drill", "in", "board"), fact("bench", "in", "bench")})
    seen, wrong = possible(workshop(), Delta(), Seen("", good | bad))
    assert seen.observed == good and len(wrong) == 2
    assert possible(workshop(), Delta(), Seen("", good)) == (Seen("", good), ())


def test_facts_are_told_by_names_and_read_back() -> None:
    kg = workshop()
    for triple in facts(kg):
        if kg.domain.properties.get(triple[1]) and not isinstance(triple[2], str):  # type: ignore[call-overload]
            assert fact_of(list(named(triple, kg)), kg) == triple
    for nonsense in ("x", [1, 2], ["board", "in"], ["board", "color", "red"], ["x", "in", "bench"]):
        with pytest.raises(ValueError, match="."):
            fact_of(nonsense, kg)
