"""Several robots in one home: each has its own hand and place, and what one holds is not free."""

from collections.abc import Mapping
from itertools import islice
from pathlib import Path

import pytest
from rdflib import URIRef
from rdflib.term import Node

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import check_files, load_kg
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.robots import acting_as, held_by_another
from adaptbot_cli.core.graph.terms import STATES, Triple
from adaptbot_cli.core.graph.validate import faults, new_faults
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Ask
from adaptbot_cli.core.world import fact_of
from adaptbot_cli.errors import UsageError
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.replay import check
from tests.driving import Script, drive
from tests.packs import EX, HOUSEHOLD, KITCHEN, Pack

SECOND = """
ex:robot2 rdf:type ex:agent ; ex:has_hand ex:robot2_arm .
ex:robot2_arm rdf:type ex:hand ; ex:rec_name "robot2_arm" .
"""
KINDS = {"obj": EX.object, "rec": EX.mreceptacle, "tool": EX.tool}
ALONE = "ex:robot rdf:type ex:agent ;\n    ex:has_hand ex:robot_arm ;\n."


def files(folder: Path, attributes: str = SECOND) -> dict[str, bytes]:
    """Return a pack's files with more of what there is."""
    found = dict(read_files(folder))
    return {**found, "attributes.ttl": found["attributes.ttl"] + attributes.encode()}


def home(pack: Pack = KITCHEN, attributes: str = SECOND) -> Kg:
    return load_kg(files(pack.folder, attributes), f"kg/{pack.name}")


def holding(what: str, kg: Kg | None = None, robot: str = "robot") -> Kg:
    """Return a kitchen in which a robot holds a thing."""
    kg = kg or home()
    kind = next(k for k in ("obj", "rec", "tool") if kg.is_a(EX[what], [KINDS[k]]))
    where = EX["mrec_location" if kind == "rec" else f"{kind}_location"]
    old = frozenset(kg.facts.triples((EX[what], where, None)))
    new = {(EX[what], where, EX[f"{robot}_arm"]), (EX[robot], EX[f"{kind}_in_hand"], EX[what])}
    kg.learn(Delta(old, frozenset(new)))
    return kg


def checked(kg: Kg, *calls: str, task: str = "x") -> Result:
    return check("\n".join(calls), Task(task), kg)


def changes(result: Result) -> list[Delta]:
    assert result.outcome is not None, result.report.findings
    return list(result.outcome.deltas)


def codes(result: Result) -> list[tuple[str, str]]:
    return [(finding.code, finding.message) for finding in result.report.findings]


def renamed(deltas: list[Delta], names: Mapping[Node, Node]) -> list[Delta]:
    def facts(triples: frozenset[Triple]) -> frozenset[Triple]:
        return frozenset((names.get(s, s), p, names.get(o, o)) for s, p, o in triples)

    return [Delta(facts(delta.removed), facts(delta.added)) for delta in deltas]


SWAPPED = {EX.robot: EX.robot2, EX.robot_arm: EX.robot2_arm}


@pytest.mark.parametrize(
    ("pack", "name"),
    [(pack, name) for pack in (KITCHEN, HOUSEHOLD) for name in islice(sorted(pack.library()), 12)],
    ids=lambda value: getattr(value, "name", value),
)
def test_each_plan_is_that_of_the_other_with_another_hand(pack: Pack, name: str) -> None:
    """Alone, beside an idle one and as the other: the same steps, findings and changes."""
    plan = pack.library()[name]
    text = plan.render(name, list(plan.ingredients))
    alone, both, others = home(pack, ""), home(pack), home(pack)
    stands = others.facts.triples((EX.robot, None, None))
    stood = {(EX.robot2, p, o) for _, p, o in stands if others.home_of(p) == STATES}
    others.learn(Delta(added=frozenset(stood)))
    assert acting_as(alone, "robot") is alone and acting_as(both, "") is both
    first, beside, other = (
        check(text, Task(name, plan.ingredients), kg)
        for kg in (alone, both, acting_as(others, "robot2"))
    )
    assert first == check(text, Task(name, plan.ingredients), acting_as(alone, "robot"))
    for result in (beside, other):
        assert result.report.steps == first.report.steps
        assert result.report.findings == first.report.findings
        assert result.goal_met == first.goal_met
    if first.outcome is not None:
        assert changes(beside) == changes(first)
        assert changes(other) == renamed(changes(first), SWAPPED)


def test_what_one_holds_is_in_its_hand_alone_and_the_other_s_is_free() -> None:
    kg = holding("egg")
    # The first one's hand is full: it must put the egg down.
    steps = checked(kg, 'pick_up_tool("knife")').report.steps
    assert [step.call.action for step in steps][:2] == ["put_down_obj", "pick_up_tool"]
    two = checked(acting_as(kg, "robot2"), 'pick_up_tool("knife")')
    assert two.report.executable
    first, *_ = changes(two)
    assert (EX.knife, EX.tool_location, EX.robot2_arm) in first.added
    assert (EX.robot2, EX.tool_in_hand, EX.knife) in first.added


@pytest.mark.parametrize(
    ("held", "plan", "told"),
    [
        ("egg", ('pick_up_obj("egg")', 'put_down_obj("egg", "bowl")'), "robot holds egg"),
        ("bowl", ('pick_up_obj("salt")', 'put_down_obj("salt", "bowl")'), "robot holds bowl"),
        ("bowl", ('slice("onion", "knife")',), "robot holds bowl, and onion is in it"),
    ],
)
def test_the_other_cannot_use_what_one_holds_and_is_told_who(
    held: str, plan: tuple[str, ...], told: str
) -> None:
    kg = home()
    where = frozenset(kg.facts.triples((EX.onion, EX.obj_location, None)))
    kg.learn(Delta(where, frozenset({(EX.onion, EX.obj_location, EX.bowl)})))
    kg = holding(held, kg)
    assert "E402" not in dict(codes(checked(kg, *plan)))
    result = checked(acting_as(kg, "robot2"), *plan)
    assert not result.report.executable
    assert ("E402", told) in codes(result)


def test_a_default_is_a_thing_that_is_free() -> None:
    """The knife is what one slices with; where the other has it, it is another that slices."""
    more = """
ex:cleaver rdf:type ex:tool ; ex:tool_name "cleaver" ; ex:IsSlicingTool true .
"""
    kg = holding("knife", home(attributes=SECOND + more))
    used = [
        checked(acting_as(kg, name), 'slice("onion")').report.grounded[-1].values["tool"]  # type: ignore[union-attr]
        for name in ("robot", "robot2")
    ]
    assert used[0] == EX.knife
    assert used[1] != EX.knife and not held_by_another(acting_as(kg, "robot2"), used[1])


def test_a_graph_that_says_nothing_of_hands_has_the_hand_of_the_pack() -> None:
    """As the published graphs: no link, and the hand is among the vessels."""
    given = files(KITCHEN.folder, "")
    text = given["attributes.ttl"].decode()
    assert ALONE in text and "ex:robot_arm rdf:type ex:hand" in text
    text = text.replace(ALONE, "ex:robot rdf:type rdfs:agent .")
    text = text.replace("ex:robot_arm rdf:type ex:hand", "ex:robot_arm rdf:type ex:mreceptacle")
    kg = load_kg({**given, "attributes.ttl": text.encode()}, "kg/kitchen")
    plan = ('pick_up_obj("egg")', 'put_down_obj("egg", "bowl")')
    assert changes(checked(kg, *plan)) == changes(checked(home(attributes=""), *plan))
    assert not faults(kg)


def test_a_robot_without_a_hand_of_its_own_is_told_and_does_not_act() -> None:
    assert not faults(home())
    lame = home(attributes="ex:robot2 rdf:type ex:agent .\n")
    [fault] = faults(lame)
    assert str(fault) == (
        "attributes.ttl, entry robot2: has no hand (has_hand); give it a hand of its own"
    )
    with pytest.raises(UsageError, match=r"robot2 has no hand \(has_hand\); give it a hand"):
        acting_as(lame, "robot2")
    shared = home(attributes="ex:robot2 rdf:type ex:agent ; ex:has_hand ex:robot_arm .\n")
    assert {fault.entries for fault in faults(shared)} == {("robot",), ("robot2",)}
    with pytest.raises(UsageError, match="robot_arm, which is that of robot too"):
        acting_as(shared, "robot2")
    assert check_files(files(KITCHEN.folder, "ex:robot2 rdf:type ex:agent .\n"))[1] == [fault]


def test_a_change_that_gives_away_a_hand_is_refused() -> None:
    kg = home()
    taken = Delta(
        frozenset({(EX.robot2, EX.has_hand, EX.robot2_arm)}),
        frozenset({(EX.robot2, EX.has_hand, EX.robot_arm)}),
    )
    assert [fault.entries for fault in new_faults(kg, taken)] == [("robot2",)]
    assert not new_faults(kg, Delta(added=frozenset({(EX.robot2, EX.agent_near, EX.sink)})))


def test_who_is_no_robot_is_told_with_the_robots_that_there_are() -> None:
    kg = home()
    with pytest.raises(UsageError, match=r'no robot "robot3"; there are robot and robot2; another'):
        acting_as(kg, "robot3")
    with pytest.raises(UsageError, match="egg is an ingredient or object, no robot; there are"):
        acting_as(kg, "egg")
    assert acting_as(kg, "Robot2").domain.robot == "robot2"
    again = acting_as(acting_as(kg, "robot2"), "robot2")
    assert (again.domain.agent, again.domain.robot) == (EX.robot2, "robot2")


def test_a_pack_that_gives_hands_to_nobody_has_one_robot() -> None:
    """A workspace's pack of before there were several robots: its actions name the one hand."""
    given = files(KITCHEN.folder, "ex:robot2 rdf:type ex:agent .\n")
    given["attributes.ttl"] = given["attributes.ttl"].replace(
        b"    ex:has_hand ex:robot_arm ;\n", b""
    )
    before, _, rest = given["domain.ttl"].partition(b"ex:has_hand a rdf:Property")
    given["domain.ttl"] = before + rest.partition(b".\n")[2]
    given["actions.ttl"] = given["actions.ttl"].replace(b"ex:has_hand", b"ex:agent_near")
    kg = load_kg(given, "kg/kitchen")
    assert not faults(kg)
    with pytest.raises(UsageError, match="does not say whose each hand is"):
        acting_as(kg, "robot2")


def test_a_pack_without_hands_needs_none() -> None:
    """What `adaptbot domain new` makes: a robot holds, and has no hand that is a thing."""
    folder = bundled("starter")
    given = dict(read_files(folder))
    given["attributes.ttl"] += b"ex:robot2 rdf:type ex:agent .\n"
    state = given["state.ttl"].replace(b"ex:vase ex:lies_in ex:shelf ;", b"ex:vase")
    given["state.ttl"] = state + b"ex:robot ex:holds ex:vase .\n"
    kg = load_kg(given, "starter")
    assert not faults(kg)
    two = acting_as(kg, "robot2")
    assert ("E402", "robot holds vase") in codes(checked(two, 'put_down("vase", "crate")'))
    first, *_ = changes(checked(two, 'pick_up("book")'))
    assert first.added == {(EX.robot2, EX.holds, EX.book)}


def test_a_world_tells_of_every_robot_by_its_name() -> None:
    kg = acting_as(home(), "robot2")
    for name in ("robot", "robot2"):
        assert fact_of([name, "obj_in_hand", "egg"], kg)[0] == URIRef(EX[name])


@pytest.mark.parametrize(("said", "met"), [("fridge", True), ("unknown", False)])
def test_where_a_thing_is_that_another_is_said_to_hold_is_asked(said: str, met: bool) -> None:
    """What the graph says may be long past: the person is told it, and may know better."""
    kg = acting_as(holding("egg"), "robot2")
    plan = "pick_up_obj(egg)\nput_down_obj(egg, plate)"
    script = Script([plan], {"place egg obj_location": said})
    result = drive(Task("egg"), kg, script, replans=0)
    [asked] = [turn.question for turn in script.seen if isinstance(turn, Ask)]
    assert asked.notes[0] == "the graph says: robot: holds egg"
    assert "robot_arm" not in {choice.value for choice in asked.choices}
    assert (result.verdict == "executable") is met
    assert ((EX.robot, EX.obj_in_hand, EX.egg) not in kg.facts) is met
