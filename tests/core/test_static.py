"""What can be said of one call without running it."""

import pytest
from rdflib import Literal, URIRef

from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.refine.grounding import Sound, understand
from tests.worlds import W, call, replaced, scene, workshop


def sound(text: str, kg: Kg | None = None) -> Sound:
    return understand(call(text), scene(kg))


def codes(text: str, kg: Kg | None = None) -> list[str]:
    return [finding.code for finding in sound(text, kg).findings]


def value(text: str, parameter: str) -> object:
    understood = sound(text)
    assert understood.ground is not None, understood.findings
    return understood.ground.values.get(parameter)


@pytest.mark.parametrize(
    ("text", "rendered", "by"),
    [
        ("take_part(board)", 'take_part("board")', []),
        ("put(board)", 'put("board")', []),  # its place has a default
        ("put(board, 10 min)", 'put("board")', ["left out"]),
        ("take_part(saw)", 'take_tool("saw")', ["take_tool"]),  # of the family, for this kind
        ("grab(saw)", 'take_tool("saw")', ["take_part", "take_tool"]),
        ("drill_hole(board)", 'drill_hole("board")', []),  # no attribute of what is left out
        ("drill_hole(board, bench)", 'drill_hole("board", "bench")', []),  # the tool is skipped
        ("switch(stove, OFF)", 'switch("stove", "off")', []),
        ("wait(35)", "wait(35)", []),
        ("turn_on(stove)", 'switch("stove", "on")', ["switch"]),
        ("turn_off(stove)", 'switch("stove", "off")', ["switch"]),
    ],
)
def test_a_call_is_understood_and_read_the_same_again(
    text: str, rendered: str, by: list[str]
) -> None:
    understood = sound(text)
    assert understood.ground is not None and understood.call.render() == rendered
    assert [change.target for change in understood.changes] == by
    again = understand(understood.call, scene())
    assert (again.ground, again.call) == (understood.ground, understood.call)


@pytest.mark.parametrize(
    ("text", "parameter", "meant"),
    [
        ("take_part(board)", "part", URIRef(W + "board")),
        ("drill_hole(board, bench)", "spot", URIRef(W + "bench")),
        ("drill_hole(board, bench)", "tool", None),
        ("switch(stove, ON)", "state", Literal(True)),
        ("switch(stove, off)", "state", Literal(False)),
    ],
)
def test_what_an_argument_is_taken_for(text: str, parameter: str, meant: object) -> None:
    assert value(text, parameter) == meant


@pytest.mark.parametrize(
    ("written", "minutes"),
    [
        *[(same, 35) for same in ("35", "35min", "35 minutes", "35.0", "35 min.")],
        ("2 hours", 120),
    ],
)
def test_a_number_may_have_a_unit(written: str, minutes: int) -> None:
    assert float(str(value(f"wait({written})", "minutes"))) == minutes


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("open(bench, stove)", ["E102 open takes at most 1, not 2", "E302 bench has no door"]),
        ("press(board, 3, 4)", ["E102 "]),
        ("dry_part(board, stove)", ["E102 "]),  # a hidden parameter cannot be written
        ("press()", ["E102 press needs part and kilos as well"]),
        ("take_part(5)", ["E201 "]),
        ("put(board, 2 benches)", ["E201 "]),
        ("take_part(-)", ["E201 "]),
        ("polish(gadget, 5, board)", ["E101 ", "E201 "]),
        ("polish(gadget, gadget)", ["E101 ", "E201 "]),
        ("take_part(bench)", ["E202 bench is a piece of furniture, not a part"]),
        ("drill_hole(saw)", ["E202 "]),  # an action without a family is not exchanged
        ("drill_hole(board, candle)", ["E202 candle is a part, not a tool"]),
        ("press(3, board)", ["E201 ", "E103 "]),  # a required parameter is not skipped
        ("wait(2 moons)", ["E103 "]),
        ("wait(10 to 15 minutes)", ["E103 "]),
        ("press(board, hard)", ['E103 "hard" is not a number of kilos']),
        ("press(board, ٣)", ["E103 "]),
        ("press(board, 1.2.3)", ["E103 "]),
        ("switch(stove, slowly)", ['E103 "slowly" is not on or off']),
        ("drill_hole(plank)", ["E301 it is not known whether plank is drillable"]),
        ("take_part(board)", []),  # an attribute may be taken to hold while it is unknown
        ("take_part(anvil)", ["E302 anvil is too heavy"]),
        ("drill_hole(vase)", ["E302 vase cannot be drilled"]),  # it follows from another fact
        ("drill_hole(plank, saw, gadget)", ["E201 ", "E301 ", "E302 "]),
    ],
)
def test_what_is_wrong_with_a_call(text: str, found: list[str]) -> None:
    told = [f"{finding.code} {finding.message}" for finding in sound(text).findings]
    assert len(told) == len(found)
    for line, start in zip(told, found, strict=True):
        assert line == start if not start.endswith(" ") else line.startswith(start)


def test_a_finding_names_what_it_is_about_and_what_would_do() -> None:
    for text, about in (
        ("take_part(bench)", ("bench", "", ())),
        ("drill_hole(plank)", ("plank", "drillable", ())),
        ("switch(stove, slowly)", ("slowly", "", ("on", "off"))),
    ):
        [finding] = sound(text).findings
        assert (finding.subject, finding.prop, finding.candidates) == about


def test_a_kind_is_told_with_its_evidence_and_after_the_alias() -> None:
    alias, kind = sound("grab(saw)").changes
    assert (alias.by, kind.by, kind.evidence) == ("alias", "kind", "saw is a tool")
    waits = sound("wait(until it is dry)")
    assert waits.call.render() == "wait(5)"
    assert [change.by for change in waits.changes] == ["default"]


def test_a_stated_attribute_beats_one_that_would_follow() -> None:
    kg = workshop(attributes="w:vase w:drillable true .")
    assert codes("drill_hole(vase)", kg) == []


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


@pytest.mark.parametrize(
    ("text", "required", "drop", "dropped"),
    [
        ("take(gadget)", (), True, "gadget"),
        ("take(gadget)", ("gadget",), True, ""),
        ("take(gadget)", (), False, ""),
        ("polish(board)", (), True, "polish"),
        ("polish(board)", ("board",), True, ""),
    ],
)
def test_what_is_set_aside_drops_its_step_unless_something_of_it_is_required(
    text: str, required: tuple[str, ...], drop: bool, dropped: str
) -> None:
    at = scene(workshop(), *required)
    at.aside, at.drop = frozenset({"gadget", "polish"}), drop
    assert understand(call(text), at).dropped == dropped
