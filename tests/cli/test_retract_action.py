"""Actions that were taught are taken back whole, and names with a fixed argument too."""

from tests.cli.command import Home
from tests.modelserver import scripted_model

TEXT = """peel("carrot", "knife")
activate("stove")
put_down_obj("carrot", "bowl")
put_down_rec("bowl", "table")
"""
TOLD = """peel: {existence: exists, like: slice}
activate: {existence: fixed, which: switch, part: state, state: "on"}
"""


def test_a_taught_action_is_taken_back_with_its_parts(home: Home) -> None:
    told = home.write("told.yaml", TOLD)
    with scripted_model(TEXT) as model:
        home.adaptbot("run", "make a snack", "--answers", told, **model.environment())
    actions = home.workspace / "kg/kitchen/actions.ttl"
    taught = actions.read_text(encoding="utf-8")
    assert "peel_needs_1" in taught and "switch_as_activate" in taught

    why = home.adaptbot("kg", "why", "activate")
    assert why.code == 0 and "switch, always with state on" in why.said
    refused = home.adaptbot("kg", "retract", "switch", "--yes")
    assert refused.code == 2 and "actions.ttl" in refused.said

    retracted = home.adaptbot("kg", "retract", "activate", "--yes")
    assert retracted.code == 0, retracted.said
    assert "activate" not in actions.read_text(encoding="utf-8")

    retracted = home.adaptbot("kg", "retract", "peel", "--yes")
    assert retracted.code == 0, retracted.said
    assert "peel" not in actions.read_text(encoding="utf-8")
    assert home.adaptbot("kg", "validate").code == 0
