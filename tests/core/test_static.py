"""What can be said of one call without running it."""

from rdflib import Literal, URIRef

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.refine.grounding import Sound, understand
from adaptbot_cli.core.scene import Scene
from tests.worlds import W, call, replaced, scene, workshop


def sound(text: str, kg: Kg | None = None) -> Sound:
    return understand(call(text), scene(kg))


def codes(text: str, kg: Kg | None = None) -> list[str]:
    return [finding.code for finding in sound(text, kg).findings]


def messages(text: str, kg: Kg | None = None) -> list[str]:
    return [finding.message for finding in sound(text, kg).findings]


def rendered(text: str, kg: Kg | None = None) -> str:
    understood = sound(text, kg)
    assert understood.ground is not None, understood.findings
    return understood.call.render()


def value(text: str, parameter: str, kg: Kg | None = None) -> object:
    understood = sound(text, kg)
    assert understood.ground is not None, understood.findings
    return understood.ground.values.get(parameter)


def test_a_call_that_says_everything_is_bound() -> None:
    assert value("take_part(board)", "part") == URIRef(W + "board")
    assert not sound("take_part(board)").changes


def test_too_many_arguments() -> None:
    assert messages("open(bench, stove)") == ["open takes at most 1, not 2", "bench has no door"]


def test_a_number_for_an_action_that_takes_none_is_left_out_if_nothing_lacks() -> None:
    understood = sound("put(board, 10 min)")
    assert understood.call.render() == 'put("board")'
    assert [change.target for change in understood.changes] == ["left out"]
    assert codes("press(board, 3, 4)") == ["E102"]
    assert codes("take_part(5)") == ["E201"]
    assert codes("put(board, 2 benches)") == ["E201"]


def test_too_few_arguments_say_which() -> None:
    assert messages("press()") == ["press needs part and kilos as well"]


def test_a_parameter_with_a_default_may_be_left_out() -> None:
    assert rendered("put(board)") == 'put("board")'


def test_a_hidden_parameter_cannot_be_written() -> None:
    assert codes("dry_part(board, stove)") == ["E102"]


def test_an_unknown_action_still_tells_of_unknown_arguments() -> None:
    assert codes("polish(gadget, 5, board)") == ["E101", "E201"]


def test_a_thing_of_the_wrong_kind_says_what_it_is_and_what_is_wanted() -> None:
    [finding] = sound("take_part(bench)").findings
    assert (finding.code, finding.subject) == ("E202", "bench")
    assert finding.message == "bench is a piece of furniture, not a part"


def test_the_action_of_the_family_that_takes_this_kind_is_used() -> None:
    understood = sound("take_part(saw)")
    assert understood.call.render() == 'take_tool("saw")'
    [change] = understood.changes
    assert (change.source, change.target, change.by) == ("take_part", "take_tool", "kind")
    assert change.evidence == "saw is a tool"


def test_an_alias_and_the_kind_are_both_told() -> None:
    assert [change.by for change in sound("grab(saw)").changes] == ["alias", "kind"]


def test_an_action_without_a_family_is_not_exchanged() -> None:
    assert codes("drill_hole(saw)") == ["E202"]


def test_an_optional_parameter_is_skipped_where_an_argument_does_not_fit() -> None:
    assert value("drill_hole(board, bench)", "spot") == URIRef(W + "bench")
    assert value("drill_hole(board, bench)", "tool") is None


def test_a_skipped_parameter_leaves_no_empty_argument() -> None:
    assert rendered("drill_hole(board, bench)") == 'drill_hole("board", "bench")'


def test_a_rendered_call_is_understood_the_same_way() -> None:
    for text in ("drill_hole(board, bench)", "switch(stove, off)", "put(board)", "wait(35)"):
        once = sound(text)
        again = understand(once.call, scene())
        assert again.ground == once.ground
        assert again.call == once.call


def test_an_argument_that_fits_no_parameter_is_a_finding_of_the_first() -> None:
    assert messages("drill_hole(board, candle)") == ["candle is a part, not a tool"]


def test_a_required_parameter_is_not_skipped() -> None:
    assert codes("press(3, board)") == ["E201", "E103"]


def test_a_number_may_have_a_unit() -> None:
    for written in ("35", "35min", "35 minutes", "35.0", "35 min."):
        assert float(str(value(f"wait({written})", "minutes"))) == 35, written


def test_a_unit_is_reckoned_and_one_that_is_not_known_is_a_finding() -> None:
    assert float(str(value("wait(2 hours)", "minutes"))) == 120
    assert codes("wait(2 moons)") == ["E103"]
    assert codes("wait(10 to 15 minutes)") == ["E103"]


def test_a_text_without_a_number_is_a_placeholder_for_the_default() -> None:
    understood = sound("wait(until it is dry)")
    assert understood.call.render() == "wait(5)"
    [change] = understood.changes
    assert change.by == "default"


def test_without_a_default_a_text_is_no_number() -> None:
    assert messages("press(board, hard)") == ['"hard" is not a number of kilos']


def test_foreign_digits_and_two_dots_are_no_number() -> None:
    assert codes("press(board, ٣)") == ["E103"]
    assert codes("press(board, 1.2.3)") == ["E103"]


def test_a_word_that_stands_for_a_value() -> None:
    assert value("switch(stove, ON)", "state") == Literal(True)
    assert value("switch(stove, off)", "state") == Literal(False)
    assert rendered("switch(stove, OFF)") == 'switch("stove", "off")'


def test_a_word_that_stands_for_no_value_says_which_do() -> None:
    [finding] = sound("switch(stove, slowly)").findings
    assert (finding.code, finding.message) == ("E103", '"slowly" is not on or off')
    assert finding.candidates == ("on", "off")


def test_a_name_that_fixes_an_argument_is_rendered_with_it() -> None:
    assert rendered("turn_on(stove)") == 'switch("stove", "on")'
    assert rendered("turn_off(stove)") == 'switch("stove", "off")'


def test_an_attribute_that_is_unknown_is_a_question_and_not_a_no() -> None:
    [finding] = sound("drill_hole(plank)").findings
    assert (finding.code, finding.subject) == ("E301", "plank")
    assert finding.message == "it is not known whether plank is drillable"
    assert (finding.prop, finding.candidates) == ("drillable", ())


def test_an_attribute_that_is_false_rules_it_out_in_the_domains_words() -> None:
    assert messages("open(bench)") == ["bench has no door"]


def test_an_attribute_may_be_taken_to_hold_while_it_is_unknown() -> None:
    assert codes("take_part(board)") == []
    assert messages("take_part(anvil)") == ["anvil is too heavy"]


def test_an_attribute_that_follows_from_another_fact_is_known() -> None:
    assert messages("drill_hole(vase)") == ["vase cannot be drilled"]


def test_a_stated_attribute_beats_one_that_would_follow() -> None:
    kg = workshop(attributes="w:vase w:drillable true .")
    assert codes("drill_hole(vase)", kg) == []


def test_an_attribute_of_a_parameter_left_out_is_not_asked_for() -> None:
    assert codes("drill_hole(board)") == []


def test_all_arguments_are_checked() -> None:
    assert codes("drill_hole(plank, saw, gadget)") == ["E201", "E301", "E302"]


def test_a_finding_is_told_once_though_two_arguments_raise_it() -> None:
    assert codes("polish(gadget, gadget)") == ["E101", "E201"]


def test_a_change_is_told_once_though_two_arguments_need_it() -> None:
    kg = replaced(
        "actions.ttl",
        '[ ab:name "kilos" ; ab:datatype xsd:decimal ; ab:unit "kg=1" ]',
        '[ ab:name "other" ; ab:class w:part ]',
    )
    assert len(sound("press(Board, Board)", kg).changes) == 1


def test_a_state_word_asks_for_the_state() -> None:
    board, drilled = URIRef(W + "board"), URIRef(W + "drilled")
    assert sound("take_part(drilled_board)").states == ((board, drilled),)


def test_an_argument_of_no_letters_is_unknown() -> None:
    assert codes("take_part(-)") == ["E201"]


def test_a_step_with_what_is_set_aside_is_dropped() -> None:
    at = scene()
    at.aside = frozenset({"gadget"})
    assert understand(call("take(gadget)"), at).dropped == "gadget"


def test_a_required_item_is_never_set_aside() -> None:
    at: Scene = scene(workshop(), "gadget")
    at.aside = frozenset({"gadget"})
    assert not understand(call("take(gadget)"), at).dropped


def test_nothing_is_set_aside_where_dropping_is_not_allowed() -> None:
    at = scene()
    at.aside, at.drop = frozenset({"gadget"}), False
    assert not understand(call("take(gadget)"), at).dropped
