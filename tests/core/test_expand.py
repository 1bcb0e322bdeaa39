"""Words that stand for other items, steps that are not needed, goals reached by missing steps."""

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Step
from adaptbot_cli.core.refine.check import examine
from adaptbot_cli.core.report import Report
from tests.worlds import changed, parsed, replaced, scene, workshop

DRYING = '[ ab:name "part" ; ab:class w:part ]\n        [ ab:name "heater"'


def check(plan: str, kg: Kg | None = None, *required: str) -> Report:
    return examine(parsed(plan), plan, scene(kg, *required))


def told(step: Step) -> str:
    mark = {"inserted": "+ ", "dropped": "- ", "finding": "! "}.get(step.status, "")
    return mark + step.call.render().replace('"', "")


def steps(plan: str, kg: Kg | None = None, *required: str) -> list[str]:
    return [told(step) for step in check(plan, kg, *required).steps]


FETCHES = (
    "actions.ttl",
    'ab:explain "take a part" ;',
    'ab:explain "take a part" ; ab:fetches true ;',
)
SERVES = (
    "actions.ttl",
    'ab:explain "put down what is in the hand" ;',
    'ab:explain "put down what is in the hand" ; ab:purpose'
    ' [ ab:ask "ASK { ?thing w:in ?spot }" ; ab:message "{thing} is there already" ] ;',
)
"""Taking a part only serves a later step; putting serves to have a thing at its place."""


def test_a_word_for_several_items_becomes_a_step_for_each_required_one() -> None:
    report = check("dry_part(all)", None, "plank", "vase")
    assert [told(s) for s in report.steps if s.source] == ["dry_part(plank)", "dry_part(vase)"]
    change = report.steps[1].changes[0]
    assert (change.source, change.target, change.by) == ("all", "plank, vase", "quantifier")


def test_only_those_are_meant_that_the_action_can_be_done_to() -> None:
    assert steps("drill_hole(all)", None, "board", "vase") == [
        "+ charge(drill)",
        "drill_hole(board)",
    ]


def test_what_the_plan_makes_stands_for_what_it_is_made_of() -> None:
    report = check("press(assembly, 3)", None, "board", "plank")
    assert [told(step) for step in report.steps] == ["press(board, 3)", "press(plank, 3)"]
    assert {step.changes[0].by for step in report.steps} == {"product"}


def test_a_product_named_after_one_required_item_is_that_item() -> None:
    assert steps("press(plank_assembly, 3)", None, "board", "plank") == ["press(plank, 3)"]


def test_a_thing_of_that_name_is_no_word_for_others() -> None:
    kg = workshop(attributes='w:all a w:part ; w:called "all" .')
    assert steps("press(assembly, 3)", kg) == ["! press(assembly, 3)"]


def test_one_thing_may_stand_for_others_where_the_domain_says_so() -> None:
    kg = replaced(
        "actions.ttl",
        DRYING,
        '[ ab:name "part" ; ab:class w:part ;'
        ' ab:instead "SELECT ?part WHERE { ?part w:in ?given }" ;'
        ' ab:insteadMeans "stands for what is on it" ]\n        [ ab:name "heater"',
    )
    report = check("dry_part(bench)", kg)
    assert [told(step) for step in report.steps if step.source] == [
        "dry_part(plank)",
        "dry_part(vase)",
    ]
    assert report.steps[1].changes[0].evidence == "bench stands for what is on it"


def test_several_items_cannot_be_fetched_at_once_so_each_is_when_it_is_used() -> None:
    [step] = check("take_part(all)", changed(FETCHES), "plank", "vase").steps
    assert step.status == "dropped"
    assert "each fetched by the step that uses it" in step.reason


def test_a_step_whose_purpose_holds_already_is_not_needed() -> None:
    [step] = check("put(plank, bench)", changed(SERVES)).steps
    assert (step.status, step.reason) == ("dropped", "plank is there already")


def test_what_cannot_be_fetched_need_not_be_for_a_step_that_is_not_needed() -> None:
    plan = "take_part(anvil)\nput(anvil, bench)"
    assert steps(plan, changed(FETCHES, SERVES))[0] == "! take_part(anvil)"
    there = ("state.ttl", "w:saw w:in w:bench .", "w:saw w:in w:bench . w:anvil w:in w:bench .")
    assert steps(plan, changed(FETCHES, SERVES, there)) == [
        "- take_part(anvil)",
        "- put(anvil, bench)",
    ]


def test_a_goal_is_reached_by_missing_steps_where_the_domain_says_what_it_is_about() -> None:
    kg = replaced(
        "domain.ttl",
        'ab:ask "ASK { FILTER NOT EXISTS { ?agent w:holds ?thing } }" ;',
        'ab:ask "ASK { FILTER NOT EXISTS { ?agent w:holds ?thing } }" ;'
        ' ab:about "SELECT ?thing WHERE { ?agent w:holds ?thing }" ;',
    )
    report = check("take_part(plank)", kg)
    assert [told(step) for step in report.steps] == ["take_part(plank)", "+ put(plank, bench)"]
    assert report.steps[1].reason == "the hand is not empty at the end"
    assert report.findings == ()
