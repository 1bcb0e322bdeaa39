"""Arguments that are written with their names, in whatever order."""

import pytest

from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.refine.check import examine
from tests.worlds import scene


@pytest.mark.parametrize(
    "call",
    [
        'put(spot="cupboard", thing="board")',
        'put(SPOT="cupboard", Thing="board")',
        'put(spot="cupboard", "board")',
        'put("board", spot="cupboard")',
        'put(what="board", onto="cupboard")',
        'put(a="board", spot="cupboard")',
    ],
)
def test_named_arguments_are_read_by_name(call: str) -> None:
    report = examine(parse(call), call, scene())
    (step,) = (step for step in report.steps if step.source)
    assert step.call.render() == 'put("board", "cupboard")'
    assert not report.findings


@pytest.mark.parametrize("name", ["drillHole", "DrillHole", "drill-hole", "drill_Hole"])
def test_an_action_in_camel_case_is_the_one_with_underscores(name: str) -> None:
    call = f'{name}(thing="board")'
    report = examine(parse(call), call, scene())
    step = next(step for step in report.steps if step.source)
    assert step.call.render() == 'drill_hole("board")'
    assert not report.findings


def test_camel_case_is_told_as_a_change() -> None:
    report = examine(parse('drillHole("board")'), "", scene())
    (change,) = next(step for step in report.steps if step.source).changes
    assert (change.source, change.target, change.by) == ("drillHole", "drill_hole", "normalisation")
