"""A checked plan in the forms that a robot's own executive reads (docs/export.md)."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import pyoxigraph
from rdflib import Literal, URIRef
from rdflib.term import Node

from adaptbot_cli.core.domain import Action
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.sparql import SKIP, prefixes_of
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.plan import Goal, Task
from adaptbot_cli.core.refine.grounding import render, sentence
from adaptbot_cli.core.report import GroundAction, Report
from adaptbot_cli.core.world import Named, named, plain

VERSION = 1
"""The version of the forms, written into the JSON."""


@dataclass(frozen=True, slots=True)
class Guard:
    """What must hold: a SPARQL ASK about the state, and what is so where it does not, in words.

    `given` are terms for variables of the ASK, in N-Triples: none where the ASK is ground.
    """

    ask: str
    given: Mapping[str, str]
    otherwise: str


@dataclass(frozen=True, slots=True)
class GroundStep:
    """A step with what it takes, needs and brings about, all by the home's own names.

    `arguments` are plain values by parameter, in order, `things` those parameters that name a
    thing; `spoken` is a name of the action that fixes a parameter (`turn_on` for `switch`
    with state on), with the parameters `left`.
    """

    number: int
    call: str
    action: Action
    arguments: Mapping[str, Any]
    things: frozenset[str]
    spoken: str
    left: tuple[str, ...]
    guards: tuple[Guard, ...]
    added: tuple[Named, ...]
    removed: tuple[Named, ...]
    inserted: bool


@dataclass(frozen=True, slots=True)
class GroundPlan:
    """A plan that is ready to be handed over. `words` are names as a PDDL file spells them."""

    task: str
    domain: str
    steps: tuple[GroundStep, ...]
    goals: tuple[Guard, ...]
    words: Mapping[str, str]


def grounded(
    reports: Sequence[Report], kg: Kg, words: Mapping[str, str] | None = None
) -> GroundPlan:
    """Return the executable plans of a request, one after the other, as one ground plan."""
    found: list[GroundStep] = []
    goals: list[Guard] = []
    for report in reports:
        for step, ground, delta in zip(report.steps, report.grounded, report.deltas, strict=True):
            if ground is None or step.status in ("dropped", "finding"):
                continue
            names = (p.name for p in ground.action.parameters if p.name in ground.values)
            values = {name: ground.values[name] for name in names}
            fixed = next(
                (c for c in ground.action.called_as if values.get(c.parameter) == c.value), None
            )
            found.append(
                GroundStep(
                    number=len(found) + 1,
                    call=render(ground, kg).render(),
                    action=ground.action,
                    arguments={name: plain(value, kg) for name, value in values.items()},
                    things=frozenset(n for n, v in values.items() if isinstance(v, URIRef)),
                    spoken=fixed.names[0] if fixed else ground.action.name,
                    left=tuple(n for n in values if not fixed or n != fixed.parameter),
                    guards=tuple(_guards(ground, kg)),
                    added=tuple(named(fact, kg) for fact in sorted(delta.added)),
                    removed=tuple(named(fact, kg) for fact in sorted(delta.removed)),
                    inserted=step.status == "inserted",
                )
            )
        goals += _goals(report.task, kg)
    name = " then ".join(r.task.said or r.task.name.replace("_", " ") for r in reports)
    return GroundPlan(name or "plan", kg.domain.name, tuple(found), tuple(goals), words or {})


def _guards(ground: GroundAction, kg: Kg) -> Iterator[Guard]:
    """What a step needs, attributes first, in the words of the pack."""
    for need in ground.action.attributes:
        thing = ground.values.get(need.of)
        if isinstance(thing, URIRef):
            fact = f"{thing.n3()} {URIRef(str(need.prop)).n3()}"
            body = f"{fact} {_n3(need.value)}"
            if need.assume:  # what is unknown is taken to hold
                body = f"FILTER NOT EXISTS {{ {fact} ?value FILTER(?value != {_n3(need.value)}) }}"
            yield Guard(f"ASK {{ {body} }}", {}, sentence(need.message, ground, kg))
    for condition in ground.action.conditions:
        values = {"agent": kg.domain.agent, **ground.values}
        otherwise = sentence(condition.message, ground, kg)
        yield _guard(condition.query, condition.source, otherwise, values)


def _goals(task: Task, kg: Kg) -> Iterator[Guard]:
    """What must hold at the end, of the domain and of the task; of each item where it is of one."""
    for goal in (*kg.domain.goals, *task.goals):
        if goal.places:
            continue  # any of several places will do: that is no single ASK
        for item in _items(goal, task, kg):
            values = {"agent": kg.domain.agent, **({} if item is None else {"item": item})}
            otherwise = goal.message.format(item=kg.name(item) if item is not None else "")
            yield _guard(goal.query, goal.source, otherwise, values)


def _items(goal: Goal, task: Task, kg: Kg) -> Iterable[URIRef | None]:
    if not goal.classes:
        return (None,)
    classes = [URIRef(iri) for iri in goal.classes]
    found = (e for name in goal.items or task.required for e in kg.find(name)[:1])
    return [entity for entity in found if kg.is_a(entity, classes)]


def _guard(query: str, source: str, otherwise: str, values: Mapping[str, Node]) -> Guard:
    """An ASK with its variables replaced, where that leaves a valid one, else with their values."""
    prologue = "".join(f"PREFIX {p}: <{iri}> " for p, iri in prefixes_of(query).items())
    ask = prologue + (source.strip() or query)
    terms = {name: _n3(value) for name, value in values.items() if re.search(rf"\?{name}\b", ask)}

    def term(match: re.Match[str]) -> str:
        return match[0] if match[1] else terms.get(match[2], match[0])

    ground = re.sub(rf"({SKIP})|\?(\w+)", term, ask, flags=re.DOTALL)
    try:
        pyoxigraph.Store().query(ground)
    except (SyntaxError, ValueError, RuntimeError):  # such as BOUND(?thing), or SELECT ?thing
        return Guard(ask, terms, otherwise)
    return Guard(ground, {}, otherwise)


def _n3(node: Node) -> str:
    return node.n3() if isinstance(node, URIRef | Literal) else str(node)


def as_json(plan: GroundPlan) -> str:
    """Write a plan with all that is known of it: conditions, and what each step changes."""
    record = {
        "adaptbot": VERSION,
        "task": plan.task,
        "domain": plan.domain,
        "steps": [
            {
                "n": step.number,
                "action": step.action.name,
                "arguments": dict(step.arguments),
                "call": step.call,
                "inserted": step.inserted,
                "conditions": [*map(asdict, step.guards)],
                "expects": {"added": step.added, "removed": step.removed},
            }
            for step in plan.steps
        ],
        "goal": [*map(asdict, plan.goals)],
    }
    return json.dumps(record, indent=2, ensure_ascii=False) + "\n"


def as_script(plan: GroundPlan) -> str:
    """Write a plan as a script of VirtualHome: `[GRAB] <cup_12> (12)` is written `<cup> (12)`."""
    return "".join(f"{_script_line(step)}\n" for step in plan.steps)


def _script_line(step: GroundStep) -> str:
    words = [f"[{step.spoken.upper()}]"]
    rest = []
    for name in step.left:
        value = step.arguments[name]
        if name not in step.things:
            rest.append(f"{name}={json.dumps(value)}")  # a script has things alone: a note for it
            continue
        thing, number = re.fullmatch(r"(.*?)(?:_(\d+))?", value, re.DOTALL).groups()  # type: ignore[union-attr]
        words.append(f"<{thing}> ({number or 1})")
    return " ".join([*words, *(["#", *rest] if rest else [])])


def as_pddl(plan: GroundPlan) -> str:
    """Write a plan as the planning competitions do: `(pick-up ball-1 left)`.

    Names are those of the PDDL that the pack was made of, if it was made of any.
    """
    lines = [f"; {' '.join(plan.task.split())}: a plan for the domain {plan.domain}"]
    for step in plan.steps:
        given = (re.sub(r"[^\w.-]", "_", _text(value)) for value in step.arguments.values())
        words = (step.action.name, *given)
        lines.append(f"({' '.join(plan.words.get(normal(word), word) for word in words)})")
    return "\n".join(lines) + "\n"


def spellings(texts: Iterable[str]) -> dict[str, str]:
    """Return how PDDL files spell each name that they have, by its normal form."""
    found = (word for text in texts for word in re.findall(r"[\w-]+", re.sub(";.*", "", text)))
    return {normal(word): word for word in found}


_RESERVED = frozenset({"id", "name", "step", "call"})
"""What an attribute of a node in a tree is called already."""


def as_bt(plan: GroundPlan) -> str:
    """Write a plan as a tree of BehaviorTree.CPP 4.

    A step is done if its conditions hold (`Holds`); where one does not, or the step fails, the
    executive may `Recover`. The last are the conditions of the goal.
    """
    identity = _id(f"plan {plan.task}", "plan")  # no name of an action
    root = ET.Element("root", BTCPP_format="4", main_tree_to_execute=identity)
    tree = ET.SubElement(root, "BehaviorTree", ID=identity)
    whole = ET.SubElement(tree, "Sequence", name=plan.task)
    for step in plan.steps:
        either = ET.SubElement(whole, "Fallback", name=f"{step.number}. {step.call}")
        guarded = ET.SubElement(either, "Sequence", name=step.call)
        for guard in step.guards:
            _holds(guarded, guard)
        given = {_port(name): _text(value) for name, value in step.arguments.items()}
        called = {"ID": _id(step.action.name, "Do"), "name": step.call}
        ET.SubElement(guarded, "Action", called | given)
        ET.SubElement(either, "Action", ID="Recover", step=str(step.number), call=step.call)
    for guard in plan.goals:
        _holds(whole, guard)
    _models(root, plan)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _holds(parent: ET.Element, guard: Guard) -> None:
    given = " ".join(f"?{name}={term}" for name, term in guard.given.items())
    ports = {"ID": "Holds", "ask": guard.ask, "otherwise": guard.otherwise}
    ET.SubElement(parent, "Condition", ports | ({"given": given} if given else {}))


def _models(root: ET.Element, plan: GroundPlan) -> None:
    """What each node of the tree takes, for editors of trees and as what is to be implemented."""
    model = ET.SubElement(root, "TreeNodesModel")
    nodes: list[tuple[str, str, Mapping[str, str]]] = [
        ("Condition", "Holds", _HOLDS),
        ("Action", "Recover", {"step": "which step, from 1", "call": "the step itself"}),
    ]
    for action in {step.action.name: step.action for step in plan.steps}.values():
        takes = {_port(p.name): f"{p.name} of {action.name}" for p in action.parameters}
        nodes.append(("Action", _id(action.name, "Do"), takes))
    for kind, identity, ports in nodes:
        node = ET.SubElement(model, kind, ID=identity)
        for name, about in ports.items():
            port = {"name": name, "type": "int" if name == "step" else "std::string"}
            port |= {"default": ""} if kind == "Condition" else {}
            ET.SubElement(node, "input_port", port).text = about


_HOLDS = {
    "ask": "SPARQL ASK about the state",
    "otherwise": "what is so where it does not hold",
    "given": "values of its variables, where it has any",
}


def _port(name: str) -> str:
    """A parameter's name as one of a port: letters, digits, no word that a node has already."""
    clean = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return f"arg_{clean}" if clean.lower() in _RESERVED or not clean[:1].isalpha() else clean


def _id(name: str, fallback: str) -> str:
    """A name as the ID of a node or tree, none of those that BehaviorTree.CPP has itself."""
    clean = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
    if not clean[:1].isalpha() or clean[:1].isupper() or clean in ("root", "include"):
        return f"{fallback}_{clean}" if clean else fallback
    return clean


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


FORMS: Mapping[str, Callable[[GroundPlan], str]] = {
    "json": as_json,
    "script": as_script,
    "pddl": as_pddl,
    "bt": as_bt,
}
"""How each form is written."""
