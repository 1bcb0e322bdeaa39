"""The dialogue in which an action is taught, and what comes of it."""

from collections.abc import Iterable

import pytest
from rdflib import RDF, BNode, Graph, URIRef
from rdflib.collection import Collection

from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.adapters.store.turtle import rewrite
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.new_action import draft as passages
from adaptbot_cli.core.ask.new_action.draft import Draft, from_action, written
from adaptbot_cli.core.ask.new_action.parts import changes, needs, taking
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import AB
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.core.plan import Call, Task
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Ask
from tests.driving import Script, drive
from tests.packs import PACKS, Pack
from tests.worlds import FILES, PREFIXES, W, workshop

LIKE = {"existence sand": "exists", "action sand like": "drill_hole", "action sand means": "yes"}


def taught(plan: str, answers: dict[str, str], kg: Kg | None = None) -> tuple[Result, Script]:
    """Run a plan in which an action is not known."""
    script = Script([plan], answers)
    return drive(Task("work"), kg or workshop(), script, replans=0), script


def lesson(result: Result) -> Lesson:
    [only] = result.lessons
    return only


def asked(script: Script) -> list[str]:
    return [turn.question.prop for turn in script.seen if isinstance(turn, Ask)]


def words(offers: Iterable[object]) -> set[str]:
    return {offer.words for offer in offers}  # type: ignore[attr-defined]


def test_an_action_like_a_known_one_needs_three_answers() -> None:
    result, script = taught("sand(board, drill)", LIKE)
    assert asked(script) == ["", "like", "means"]
    action = lesson(result).action
    assert action is not None and action.effect is not None
    assert [p.name for p in action.parameters] == ["part", "tool", "spot"]
    assert [need.message for need in action.attributes] == [
        "{part} cannot be drilled",
        "{tool} does not drill",
    ]
    assert [c.message for c in action.conditions] == ["{tool} must be charged"]
    assert [step.call.render() for step in result.report.live] == [
        'charge("drill")',
        'sand("board", "drill")',
    ]


def test_what_it_means_is_shown_with_the_things_of_the_plan() -> None:
    _, script = taught("sand(board, drill)", LIKE)
    [hub] = [t.question for t in script.seen if isinstance(t, Ask) and t.question.prop == "means"]
    assert hub.notes == (
        "sand(part, tool?, spot?), much like drill_hole",
        "requires: board: drillable; drill: drills; drill must be charged",
        "changes: board: drilled",
    )


def test_an_effect_may_stay_unknown_and_that_is_said() -> None:
    answers = {
        **LIKE,
        "action sand like": "none",
        "action sand changes_1": "unknown",
        "action sand requires_1": "done",
    }
    result, _ = taught("sand(board, 5)", answers)
    told = lesson(result)
    assert told.sentence == "sand is possible; its effect is not known"
    assert told.action is not None and told.action.effect is None
    assert [p.name for p in told.action.parameters] == ["part", "number"]
    assert result.verdict == "executable"


def test_what_it_takes_requires_and_changes_can_be_put_right() -> None:
    answers = {
        **LIKE,
        "action sand means": "takes",
        "action sand takes_1": "not spot",
        "action sand takes_2": "also tool_2",
        "action sand takes_3": "done",
        "action sand means_2": "requires",
        "action sand requires_1": "tool must be charged",
        "action sand requires_2": "done",
        "action sand means_3": "changes",
        "action sand changes_1": "part: dry",
        "action sand changes_2": "done",
        "action sand means_4": "yes",
    }
    result, _ = taught("sand(board, drill, bench)", answers)
    action = lesson(result).action
    assert action is not None and action.effect is not None
    assert [p.name for p in action.parameters] == ["part", "tool", "tool_2"]
    assert action.conditions == ()
    changed = {str(predicate).removeprefix(W) for _, predicate, _ in action.effect.inserts}
    assert changed == {"drilled", "dry"}


@pytest.mark.parametrize("stop", ["like", "means"])
def test_a_dialogue_that_is_left_teaches_nothing(stop: str) -> None:
    result, _ = taught("sand(board, drill)", {**LIKE, f"action sand {stop}": "later"})
    assert result.lessons == ()


def test_a_refused_action_is_forgotten() -> None:
    kg = workshop()
    script = Script(["sand(board, drill)"], LIKE, accept=False)
    drive(Task("work"), kg, script, replans=0)
    assert "sand" not in kg.domain.actions


FIXED = {
    "existence toggle": "fixed",
    "action toggle which": "switch",
    "action toggle part_1": "state",
    "action toggle state": "on",
}


def test_a_refused_name_for_a_known_action_leaves_the_action_as_it_was() -> None:
    kg = workshop()
    before = kg.domain.actions["switch"]
    drive(Task("work"), kg, Script(["toggle(stove)"], FIXED, accept=False), replans=0)
    assert kg.domain.actions["switch"] == before


def test_several_arguments_can_be_fixed_and_come_before_those_of_the_plan() -> None:
    answers = {
        "existence shelve": "fixed",
        "action shelve which": "put",
        "action shelve part_1": "thing",
        "action shelve thing": "board",
        "action shelve part_2": "spot",
        "action shelve spot": "cupboard",
    }
    result, _ = taught("take_part(board)\nshelve()", answers)
    assert result.report.live[-1].call.render() == 'put("board", "cupboard")'


def test_a_fixed_number_that_is_none_is_asked_for_again() -> None:
    answers = {
        "existence flatten": "fixed",
        "action flatten which": "press",
        "action flatten part_1": "kilos",
        "action flatten kilos": "a lot",
        "action flatten kilos_2": "12.5",
    }
    result, _ = taught("flatten(board)", answers)
    assert result.report.live[-1].call.render() == 'press("board", 12.5)'


@pytest.mark.parametrize("name", ["sand", "board", "egg> . <x> <y", "größe", "1st", "?x }"])
def test_any_name_gives_facts_that_can_be_written_and_read_again(name: str) -> None:
    kg = workshop()
    draft = from_action(name, kg.domain.actions["drill_hole"], kg.domain)
    action, delta = written(draft, kg)
    old = PREFIXES + FILES["actions.ttl"]
    again = rewrite(old, [], sorted(delta.added), "actions.ttl")
    files = {"actions.ttl": again.removeprefix(PREFIXES)}
    assert again.startswith(PREFIXES)
    reloaded = workshop_with(files)
    assert faults(reloaded) == faults(kg)
    assert reloaded.domain.actions[action.name] == action


def workshop_with(files: dict[str, str]) -> Kg:
    return load_kg({n: (PREFIXES + t).encode() for n, t in {**FILES, **files}.items()}, "workshop")


def shape(graph: Graph, node: URIRef) -> set[tuple[object, ...]]:
    """What a file says of an action, however its parts are named."""
    found: set[tuple[object, ...]] = set()
    for predicate, value in graph.predicate_objects(node):
        parts = [value]
        if predicate == AB.parameters:
            parts, predicate = list(Collection(graph, value)), AB.parameter
        for part in parts:
            inside = graph.predicate_objects(part)
            told = frozenset((p, " ".join(str(o).split())) for p, o in inside if p != AB.order)
            plain = "" if told else " ".join(str(part).split())
            assert told or not isinstance(part, BNode)
            found.add((predicate, plain, told))
    return found


def test_a_copied_action_has_the_form_of_the_hand_written_one() -> None:
    kg = workshop()
    _, delta = written(from_action("sand", kg.domain.actions["drill_hole"], kg.domain), kg)
    graph = Graph().parse(data=PREFIXES + FILES["actions.ttl"], format="turtle")
    theirs = shape(graph, URIRef(W + "drill_hole"))
    new = Graph()
    for triple in delta.added:
        new.add(triple)
    ours = shape(new, URIRef(W + "sand"))
    differ = {entry[0] for entry in ours ^ theirs}
    assert {str(predicate).rsplit(":", 1)[-1] for predicate in differ} <= {
        ["http", "//www.w3.org/2000/01/rdf-schema#label"][-1],
        "explain",
        "alias",
        "order",
    }
    assert (RDF.type, str(AB.Action), frozenset()) in ours


@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.name)
def test_every_offer_makes_an_action_that_the_domain_allows(pack: Pack) -> None:
    kg = pack.kg()
    kinds = [kg.name(kg.instances([kind.iri])[0]) for kind in kg.domain.teachable]
    base = taking(Draft("frobnicate"), Call("frobnicate", tuple(kinds)), kg)
    for need in needs(base, kg.domain):
        for change in changes(base, kg.domain):
            assert checked(base.toggled_need(need).toggled_change(change), kg)
            break
    for change in changes(base, kg.domain):
        assert checked(base.toggled_change(change), kg)


@pytest.mark.parametrize("pack", PACKS, ids=lambda pack: pack.name)
def test_every_action_can_be_copied(pack: Pack) -> None:
    kg = pack.kg()
    for action in kg.domain.actions.values():
        copy, _ = written(from_action("frobnicate", action, kg.domain), kg)
        assert copy.required == () or [p.name for p in copy.required] == [
            p.name for p in action.required
        ]
        assert len(copy.conditions) == len(action.conditions)
        if action.effect is not None and copy.effect is not None:
            assert copy.effect.inserts == action.effect.inserts
            assert copy.effect.predicates == action.effect.predicates


def checked(draft: Draft, kg: Kg) -> bool:
    """Write an action; it must be one, with its effect."""
    action, _ = written(draft, kg)
    return action.effect is not None and bool(draft.changes)


def test_changes_of_one_state_exclude_each_other() -> None:
    kg = workshop()
    draft = taking(Draft("sand"), Call("sand", ("board",)), kg)
    offers = {change.words: change for change in changes(draft, kg.domain)}
    draft = draft.toggled_change(offers["{part}: dry"]).toggled_change(offers["{part}: not dry"])
    assert words(draft.changes) == {"{part}: not dry"}


def test_several_changes_happen_together() -> None:
    one = "DELETE { ?a ex:p ?old } INSERT { ?a ex:p true } WHERE { OPTIONAL { ?a ex:p ?old } }"
    two = "INSERT { ?b ex:q ?old } WHERE { ?b ex:r ?old . }"
    assert passages.together([one, two], ["a", "b"]) == (
        "DELETE { ?a ex:p ?old } INSERT { ?a ex:p true . ?b ex:q ?old_2 } "
        "WHERE { OPTIONAL { ?a ex:p ?old } ?b ex:r ?old_2 }"
    )


def test_a_query_s_own_variable_never_becomes_a_parameter() -> None:
    ask = 'ASK { ?x ex:p ?held . # the tool\n FILTER(?held != "?x") }'
    adapted = passages.adapted(ask, {"x": "held"}, ["held"])
    assert adapted == 'ASK { ?held ex:p ?held_2 . FILTER(?held_2 != "?x") }'
