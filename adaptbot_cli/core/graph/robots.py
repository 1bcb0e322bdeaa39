"""The robots of a home: which one acts, what each has for a hand, and what each holds.

A robot is what is of the class of the domain's own (`ab:agent`). A property that leads from it to a
class of hands (`ab:hand`) says which hands are whose; what it holds is what can be moved and stands
in a relation to it that the effect of some action makes.
"""

from collections.abc import Iterator
from dataclasses import replace

from rdflib import RDF, URIRef, Variable
from rdflib.term import Node

from adaptbot_cli.core.domain import Property
from adaptbot_cli.core.graph.faults import Fault, fault_of
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import STATES, Triple, local
from adaptbot_cli.core.names import a, normal, sentence_list
from adaptbot_cli.errors import UsageError


def acting_as(kg: Kg, name: str) -> Kg:
    """Let the robot of a name act on a graph, so that it is `?agent` in every query; return it.

    "" is the domain's own robot.

    Raises:
        UsageError: there is no such robot, or nothing says what is its hand.
    """
    if not name:
        return kg
    robot = robot_called(kg, name)
    if robot is None:
        raise UsageError(_no_robot(kg, name))
    if robot == kg.domain.agent:
        return kg
    wrong = next(hand_faults(kg, robot), None)
    if wrong is not None:
        raise UsageError(f"{kg.name(robot)} {wrong.problem}; {wrong.remedy} (docs/sharing.md)")
    if not hand_properties(kg, robot) and any(k.hand for k in kg.domain.classes.values()):
        raise UsageError(
            f"the {kg.domain.name} pack does not say whose each hand is, so it has one robot only; "
            "docs/domains.md shows how it is said"
        )
    kg.domain = replace(kg.domain, agent=robot, robot=kg.name(robot))
    return kg


def robot_called(kg: Kg, name: str) -> URIRef | None:
    """Return the robot that bears a name, or another name that was taught for it."""
    own = (robot for robot in kg.robots if normal(kg.name(robot)) == normal(name))
    return next(own, None) or next((r for r in kg.find(name) if r in kg.robots), None)


def _no_robot(kg: Kg, name: str) -> str:
    """That a name is no robot's, which robots there are, and where another is added."""
    known, found = kg.find(name), [kg.name(robot) for robot in kg.robots]
    what = f"{name} is {a(kg.kind_label(known[0]))}, no robot" if known else ""
    what = what or f'there is no robot "{name}"'
    there = f"there {'are' if found[1:] else 'is'} {sentence_list(found, len(found))}"
    remedy = f"another is added to kg/{kg.domain.name}/attributes.ttl (docs/sharing.md)"
    return f"{what}; {there}; {remedy}"


def hand_properties(kg: Kg, robot: Node) -> list[Property]:
    """Return the properties that say which hands are a robot's."""
    kinds = kg.domain.classes
    found = (p for p in kg.domain.properties.values() if p.range in kinds and kinds[p.range].hand)
    return [prop for prop in found if kg.is_a(robot, [prop.domain])]


def hand_faults(kg: Kg, robot: Node) -> Iterator[Fault]:
    """Give what is wrong with a robot's hands.

    Where no robot is said to have any, as in the published graphs, the pack knows that of its own.
    """
    for prop in hand_properties(kg, robot):
        named = f"{prop.label} ({local(prop.iri)})"
        hands = kg.objects(robot, prop.iri)
        facts = [t for p in (RDF.type, prop.iri) for t in kg.facts.triples((robot, p, None))]
        if not hands and (robot != kg.domain.agent or next(kg.facts.subjects(prop.iri), None)):
            remedy = f"give it {a(kg.domain.classes[prop.range].label)} of its own"
            yield fault_of(kg, robot, f"has no {named}", remedy, facts)
        for hand in hands:
            others = sorted(kg.name(s) for s in kg.facts.subjects(prop.iri, hand) if s != robot)
            if others:
                text = f"has the {named} {kg.name(hand)}, which is that of {others[0]} too"
                yield fault_of(kg, robot, text, "give each its own", facts)


def held_by_another(kg: Kg, thing: Node) -> Triple | None:
    """Return the fact that another robot holds a thing or what it is in, None if none does."""
    held = held_by_others(kg)
    return next((f for f in held if thing == f[2] or kg.is_within(thing, f[2])), None)


def held_by_others(kg: Kg) -> list[Triple]:
    """Return the facts that robots hold something, other than the one that acts."""
    others = (robot for robot in kg.robots if robot != kg.domain.agent)
    facts = (fact for robot in others for fact in kg.facts.triples((robot, None, None)))
    found = [fact for fact in facts if kg.home_of(fact[1]) == STATES and kg.can_move(fact[2])]
    if not found:
        return []
    effects = [action.effect for action in kg.domain.actions.values() if action.effect]
    related = {p for e in effects for s, p, _ in e.inserts if s == Variable("agent")}
    return sorted(fact for fact in found if fact[1] in related)
