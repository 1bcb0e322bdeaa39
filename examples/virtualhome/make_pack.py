"""Make a workspace with the domain `virtualhome` and the home of one task of the package.

    python make_pack.py 1073_1 --workspace W

Writes W/kg/virtualhome: what the robot can do (the table below: the simulator's rules as far as a
robot must know them, written by hand after reading its executors), and the things, their state and
the task's goal, which are read from the installed package. A plan for the task is put into the
workspace's plan library: that of `--plan FILE`, or else the package's own steps.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from scene import ROBOT, STATES, Fact, Task

DOMAIN = "virtualhome"

_HEAD = """\
@prefix ab: <urn:adaptbot:> .
@prefix ex: <http://example.org/> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .

"""

_DOMAIN = """\
ab:virtualhome a ab:Domain ;
    rdfs:label "virtualhome" ;
    rdfs:comment "A household of VirtualHome's graph simulator." ;
    ab:namespace "http://example.org/" ;
    ab:agent ex:robot ;
    ab:purpose "household tasks" ;
    ab:wordField "noun.artifact", "noun.object", "noun.food", "noun.substance", "noun.body",
        "noun.communication" ;
    ab:verbField "verb.contact", "verb.motion", "verb.change", "verb.perception" ;
    ab:filler "a", "an", "the", "please", "some", "with", "in", "on", "to", "by", "up" .

ex:item a rdfs:Class ; rdfs:label "thing or room" .
ex:room a rdfs:Class ; rdfs:subClassOf ex:item ; rdfs:label "room" ; ab:nameProperty ex:name .
ex:thing a rdfs:Class ; rdfs:subClassOf ex:item ; rdfs:label "thing" ; ab:nameProperty ex:name ;
    ab:kindOrder 1 ; ab:prompted true .
ex:agent a rdfs:Class ; rdfs:subClassOf ex:item ; rdfs:label "robot" .

ex:name a rdf:Property ; rdfs:label "name" ; ab:graph ab:attribute ;
    rdfs:domain ex:item ; rdfs:range xsd:string ; ab:functional true .
"""

TRAITS = {
    "GRABBABLE": "Can {name} be taken into the hand?",
    "CAN_OPEN": "Can {name} be opened?",
    "HAS_SWITCH": "Has {name} a switch?",
    "HAS_PLUG": "Has {name} a plug?",
    "SITTABLE": "Can one sit on {name}?",
    "LIEABLE": "Can one lie on {name}?",
    "CLOTHES": "Is {name} something to wear?",
    "READABLE": "Can {name} be read?",
    "DRINKABLE": "Can {name} be drunk?",
    "POURABLE": "Can {name} be poured?",
    "RECIPIENT": "Can something be poured into {name}?",
    "LOOKABLE": "Can {name} be watched?",
    "MOVABLE": "Can {name} be moved?",
    "EATABLE": "Can {name} be eaten?",
    "CUTTABLE": "Can {name} be cut?",
    "BODY_PART": "Is {name} a part of the body?",
}
"""The simulator's properties that decide what can be done with a thing, as questions."""

ALSO = {
    "GRABBABLE": {"water", "child"},
    "CAN_OPEN": {"desk", "window"},
    "MOVABLE": {"chair", "curtain"},
    "RECIPIENT": {"hands_both", "sponge", "face"},
}
"""Classes that its executors let pass without the property."""

_PROPERTIES = {
    "is_open": ("thing", "boolean", "open"),
    "is_on": ("thing", "boolean", "switched on"),
    "plugged_in": ("thing", "boolean", "plugged in"),
    "clean": ("item", "boolean", "clean"),
    "sitting": ("agent", "boolean", "sitting"),
    "lying": ("agent", "boolean", "lying"),
    "on": ("thing", "thing", "on"),
    "inside": ("thing", "thing", "inside"),
    "in_room": ("item", "room", "in room"),
    "close_to": ("thing", "thing", "close to"),
    "looks_at": ("thing", "thing", "is turned to"),
    "worn": ("thing", "agent", "worn by"),
    "near": ("agent", "item", "near"),
    "faces": ("agent", "item", "faces"),
    "rests_on": ("agent", "thing", "rests on"),
    "holds_rh": ("agent", "thing", "holds in its right hand"),
    "holds_lh": ("agent", "thing", "holds in its left hand"),
    "done_to": ("item", "string", "has been done"),
    "did": ("agent", "string", "did"),
}
"""The states: of what, what they say of it, and the label."""


def _near(what: str) -> str:
    """When the robot is near a thing: the simulator's rule, with its loose part."""
    return f"""{{ ?agent ex:near ?{what} }} UNION {{ ?{what} ex:body_part true }} UNION {{
              ?{what} ex:close_to|ex:on ?by . ?agent ex:near ?by }}"""


_UP = "FILTER NOT EXISTS { ?agent ex:sitting|ex:lying true }"
_HELD = "?agent ex:holds_rh|ex:holds_lh ?{} "
_FREE = "FILTER(!EXISTS { ?agent ex:holds_rh ?r } || !EXISTS { ?agent ex:holds_lh ?l })"
_OUT = "FILTER NOT EXISTS { ?obj ex:inside ?box . ?box ex:is_open false }"

CONDITIONS = {
    "up": (_UP, "the robot must stand to go to {obj}"),
    "down": ("?agent ex:sitting|ex:lying true", "the robot must sit or lie"),
    "near": (_near("obj"), "the robot must be near {obj}"),
    "near place": (_near("place"), "the robot must be near {place}"),
    "near or up": (f"{_near('obj')} UNION {{ {_UP} }}", "the robot must be near {obj}, or stand"),
    "held": (_HELD.format("obj"), "{obj} must be in the hand"),
    "not held": (
        "FILTER NOT EXISTS { ?agent ex:holds_rh|ex:holds_lh ?obj }",
        "{obj} must not be in the hand already",
    ),
    "something held": (_HELD.format("any"), "something must be in the hand"),
    "knife": (
        _HELD.format("knife") + '. ?knife ex:name ?called FILTER(CONTAINS(?called, "knife"))',
        "a knife must be in the hand",
    ),
    "hand": (_FREE, "a hand must be free"),
    "out": (_OUT, "{obj} must not be inside something closed"),
    "closed": ("?obj ex:is_open false", "{obj} must be closed"),
    "opened": ("?obj ex:is_open true", "{obj} must be open"),
    "place opened": (
        "FILTER(!EXISTS { ?place ex:can_open true } || EXISTS { ?place ex:is_open true })",
        "{place} must be open",
    ),
    "off": ("?obj ex:is_on false", "{obj} must be switched off"),
    "not on": ("FILTER NOT EXISTS { ?obj ex:is_on true }", "{obj} must not be switched on"),
    "on": ("?obj ex:is_on true", "{obj} must be switched on"),
    "power": ("FILTER NOT EXISTS { ?obj ex:plugged_in false }", "{obj} must be plugged in"),
    "plugged": ("?obj ex:plugged_in true", "{obj} must be plugged in"),
    "unplugged": ("?obj ex:plugged_in false", "{obj} must be unplugged"),
    "not sitting": ("FILTER NOT EXISTS { ?agent ex:sitting true }", "the robot must not sit"),
    "not lying": ("FILTER NOT EXISTS { ?agent ex:lying true }", "the robot must not lie"),
    "faced": (
        "{ ?agent ex:faces ?obj } UNION { ?agent ex:faces ?by . ?by ex:looks_at ?obj }",
        "the robot must face {obj}",
    ),
    "same room": ("?agent ex:in_room ?room . ?obj ex:in_room ?room", "{obj} must be in the room"),
    "worn": ("?obj ex:worn ?agent", "{obj} must be worn"),
    "drinkable": ("?obj ex:drinkable|ex:recipient true", "{obj} must be drinkable, or a vessel"),
    "pourable": ("?obj ex:pourable|ex:drinkable true", "{obj} must be something to pour"),
    "eatable": (
        "{ ?obj ex:eatable true } UNION { ?food ex:on ?obj . ?food ex:eatable true }",
        "{obj} must be eatable, or hold what is",
    ),
}
"""What a step needs: the body of an ASK, and the sentence where it does not hold."""

_ARRIVE = """
    {{ ?agent ex:near ?old }} UNION {{ ?agent ex:in_room ?left }} UNION {{ ?agent ex:faces ?faced }}
    UNION {{ ?obj a ex:thing BIND(?obj AS ?by) }}
    UNION {{ ?obj ex:on|ex:inside ?by FILTER EXISTS {{ ?by a ex:thing }} }}
    UNION {{ ?by ex:inside ?obj FILTER EXISTS {{ ?obj ex:can_open true }} }}
    UNION {{ ?agent ex:holds_rh|ex:holds_lh ?by }}
    UNION {{ ?obj ex:in_room ?room FILTER NOT EXISTS {{ ?obj a ex:room }} }}
    UNION {{ ?obj a ex:room BIND(?obj AS ?room) }}"""
_WALK = (
    "?agent ex:near ?old ; ex:in_room ?left ; ex:faces ?faced",
    "?agent ex:near ?by ; ex:in_room ?room",
    _ARRIVE.format(),
)
_GRAB = (
    "?obj ex:on ?under ; ex:inside ?box ; ex:close_to ?other ; ex:in_room ?left",
    "?agent ex:near ?obj ; ex:holds_rh ?right ; ex:holds_lh ?left_hand . "
    "?obj ex:in_room ?room ; ex:done_to {name}",
    """{ ?obj ex:on ?under } UNION { ?obj ex:inside ?box } UNION { ?obj ex:close_to ?other }
    UNION { ?obj ex:in_room ?left } UNION { ?agent ex:in_room ?room }
    UNION { ?obj a ex:thing BIND(?obj AS ?right) FILTER NOT EXISTS { ?agent ex:holds_rh ?r } }
    UNION { ?obj a ex:thing BIND(?obj AS ?left_hand) FILTER EXISTS { ?agent ex:holds_rh ?r } }""",
)
_LET_GO = "?agent ex:holds_rh ?obj ; ex:holds_lh ?obj"
_CLEANED = ("?obj ex:clean false", "?obj ex:clean true ; ex:done_to {name}", "")


@dataclass(frozen=True)
class Act:
    """An action: what it takes (`?` before a class: anything), needs and changes."""

    takes: tuple[str, ...]
    needs: tuple[str, ...]
    effect: tuple[str, str, str]
    explain: str
    alias: tuple[str, ...] = ()
    traits: tuple[str, ...] = ()


def _noted(*needs: str, explain: str, traits: tuple[str, ...] = ()) -> Act:
    """An action that changes nothing but that it has been done."""
    return Act(("thing",), needs, ("", "?obj ex:done_to {name}", ""), explain, (), traits)


ACTIONS = {
    "walk": Act(("item",), ("up",), _WALK, "go to a thing or a room", ("go_to", "walk_to", "go")),
    "run": Act(("item",), ("up",), _WALK, "go to a thing or a room in a hurry"),
    "standup": Act((), ("down",), (
        "?agent ex:sitting true ; ex:lying true", "", ""), "get up", ("stand_up", "get_up")),
    "open": Act(("thing",), ("near", "hand", "closed", "not on"), (
        "?obj ex:is_open false", "?obj ex:is_open true", ""), "open a thing", (), ("CAN_OPEN",)),
    "close": Act(("thing",), ("near", "opened"), (
        "?obj ex:is_open true", "?obj ex:is_open false", ""), "close a thing", ("shut",),
        ("CAN_OPEN",)),
    "grab": Act(("thing",), ("not held", "near", "out", "hand"), _GRAB,
        "take a thing into a free hand", ("take", "pick_up", "get"), ("GRABBABLE",)),
    "putback": Act(("thing", "thing"), ("held", "near place"), (
        _LET_GO, "?obj ex:on ?place ; ex:close_to ?place . ?agent ex:near ?place", ""),
        "put a thing that is held onto another", ("put", "put_down", "place")),
    "putin": Act(("thing", "thing"), ("held", "near place", "place opened"), (
        _LET_GO, "?obj ex:inside ?place ; ex:close_to ?place . ?agent ex:near ?place", ""),
        "put a thing that is held into another", ("put_in",)),
    "drop": Act(("thing",), ("held",), (_LET_GO, "?obj ex:done_to {name}", ""), "let a thing fall",
        ("release",)),
    "plugin": Act(("thing",), ("near", "hand", "unplugged"), (
        "?obj ex:plugged_in false", "?obj ex:plugged_in true", ""), "plug a thing in",
        ("plug_in",), ("HAS_PLUG",)),
    "plugout": Act(("thing",), ("near", "hand", "plugged"), (
        "?obj ex:plugged_in true", "?obj ex:plugged_in false", ""), "unplug a thing",
        ("plug_out", "unplug"), ("HAS_PLUG",)),
    "switchon": Act(("thing",), ("near", "off", "power"), (
        "?obj ex:is_on false", "?obj ex:is_on true", ""), "switch a thing on",
        ("switch_on", "turn_on"), ("HAS_SWITCH",)),
    "switchoff": Act(("thing",), ("near", "on"), (
        "?obj ex:is_on true", "?obj ex:is_on false ; ex:done_to {name}", ""), "switch a thing off",
        ("switch_off", "turn_off"), ("HAS_SWITCH",)),
    "sit": Act(("thing",), ("near", "not sitting"), (
        "?agent ex:lying true", "?agent ex:sitting true ; ex:rests_on ?obj ; ex:faces ?seen",
        "{ } UNION { ?obj ex:looks_at ?seen }"), "sit down on a thing", ("sit_down",),
        ("SITTABLE",)),
    "lie": Act(("thing",), ("near", "not lying"), (
        "?agent ex:sitting true", "?agent ex:lying true ; ex:rests_on ?obj", ""),
        "lie down on a thing", ("lie_down",), ("LIEABLE",)),
    "turnto": Act(("item",), (), (
        "?agent ex:faces ?faced", "?agent ex:faces ?obj", "{ } UNION { ?agent ex:faces ?faced }"),
        "turn to a thing", ("turn_to", "face")),
    "find": Act(("item",), ("near or up",), (
        "?agent ex:near ?old ; ex:in_room ?left ; ex:faces ?faced",
        "?agent ex:near ?by ; ex:in_room ?room", f"""{{ ?agent ex:faces ?faced }}
    UNION {{ ?obj ex:name ?called BIND(?obj AS ?by) }}
    UNION {{ FILTER NOT EXISTS {{ {_near("obj")} }} {{ {_ARRIVE.format()} }} }}"""),
        "find a thing: go to it where the robot is not near it", ("locate",)),
    "wipe": Act(("thing",), ("near", "something held"), _CLEANED, "wipe a thing"),
    "wash": Act(("thing",), ("near",), _CLEANED, "wash a thing"),
    "rinse": Act(("thing",), ("near",), _CLEANED, "rinse a thing"),
    "scrub": Act(("thing",), ("near",), _CLEANED, "scrub a thing"),
    "puton": Act(("thing",), ("held",), (_LET_GO, "?obj ex:worn ?agent", ""),
        "put clothes on", ("wear", "dress"), ("CLOTHES",)),
    "putoff": Act(("thing",), ("worn",), ("?obj ex:worn ?agent", "?obj ex:done_to {name}", ""),
        "take clothes off", ("take_off",), ("CLOTHES",)),
    "pour": Act(("thing", "thing"), ("held", "pourable", "near place"), (
        "", "?obj ex:inside ?place ; ex:done_to {name}", ""), "pour a thing into another", (),
        ("place RECIPIENT",)),
    "lookat": _noted("faced", explain="look at a thing"),
    "pointat": _noted("faced", explain="point at a thing"),
    "watch": _noted("same room", "faced", "out", explain="watch a thing", traits=("LOOKABLE",)),
    "drink": _noted("held", "drinkable", explain="drink a thing, or from it"),
    "read": _noted("held", explain="read a thing", traits=("READABLE",)),
    "touch": _noted("near", "out", explain="touch a thing"),
    "type": _noted("near", explain="type on a thing"),
    "push": _noted("near", "out", "hand", explain="push a thing"),
    "pull": _noted("near", "out", "hand", explain="pull a thing", traits=("MOVABLE",)),
    "move": _noted("near", "out", "hand", explain="move a thing", traits=("MOVABLE",)),
    "squeeze": _noted("near", "hand", explain="squeeze a thing"),
    "cut": _noted("hand", "near", "knife", explain="cut a thing", traits=("EATABLE", "CUTTABLE")),
    "eat": _noted("near", "eatable", explain="eat a thing"),
    "sleep": Act((), ("down",), ("", "?agent ex:did {name}", ""), "sleep"),
    "wakeup": Act((), ("down",), ("", "?agent ex:did {name}", ""), "wake up", ("wake_up",)),
}  # fmt: skip
"""What the simulator can do, by the names of its scripts; those first that missing steps use."""


def domain() -> Iterator[str]:
    """Write domain.ttl."""
    yield _DOMAIN
    for trait, question in TRAITS.items():
        label = trait.lower().replace("_", " ")
        yield (
            f'\nex:{trait.lower()} a rdf:Property ; rdfs:label "{label}" ;\n'
            "    ab:graph ab:attribute ; rdfs:domain ex:thing ; rdfs:range xsd:boolean ;\n"
            f'    ab:functional true ; ab:question "{question}" .\n'
        )
    for name, (of, range_, label) in _PROPERTIES.items():
        kind = f"ex:{range_}" if range_ in ("thing", "room", "item", "agent") else f"xsd:{range_}"
        one = " ; ab:functional true" if range_ == "boolean" else ""
        yield (
            f'\nex:{name} a rdf:Property ; rdfs:label "{label}" ;\n'
            f"    ab:graph ab:state ; rdfs:domain ex:{of} ; rdfs:range {kind}{one} .\n"
        )


def actions() -> Iterator[str]:
    """Write actions.ttl."""
    for order, (name, act) in enumerate(ACTIONS.items(), start=1):
        taken = zip(("obj", "place"), act.takes, strict=False)
        parameters = " ".join(f'[ ab:name "{of}" ; ab:class ex:{kind} ]' for of, kind in taken)
        lines = [f'ex:Do_{name} a ab:Action ; rdfs:label "{name}" ; ab:order {order}']
        lines.append(f'    ab:explain "{act.explain}"')
        if act.alias:
            lines.append(f"    ab:alias {', '.join(map(json.dumps, act.alias))}")
        lines.append(f"    ab:parameters ( {parameters} )")
        needs = [*map(_trait, act.traits), *(_condition(*CONDITIONS[n]) for n in act.needs)]
        if needs:
            told = (f"[ ab:order {n} ; {what} ]" for n, what in enumerate(needs, start=1))
            lines.append("    ab:requires\n        " + " ,\n        ".join(told))
        deletes, inserts, where = (part.replace("{name}", f'"{name}"') for part in act.effect)
        lines.append(
            f'    ab:effect """\n        DELETE {{ {deletes} }}\n        INSERT {{ {inserts} }}\n'
            f'        WHERE {{ {where} }}"""'
        )
        yield " ;\n".join(lines) + " .\n\n"


def _trait(told: str) -> str:
    *of, trait = told.split()
    name = of[0] if of else "obj"
    message = TRAITS[trait].format(name=f"{{{name}}}").removesuffix("?")
    return (
        f'ab:of "{name}" ; ab:attribute ex:{trait.lower()} ; ab:value true ; '
        f'ab:message "it is not so: {message}"'
    )


def _condition(body: str, message: str) -> str:
    return f'ab:ask """ASK {{ {body} }}""" ; ab:message "{message}"'


def attributes(task: Task) -> Iterator[str]:
    """Write attributes.ttl: what things there are and what can be done with them."""
    for number, node in sorted(task.known.items()):
        name = task.names[number]
        if number == ROBOT:
            continue
        yield f'ex:{name} a ex:{"room" if task.is_room(number) else "thing"} ; ex:name "{name}"'
        for trait in TRAITS if not task.is_room(number) else ():
            has = trait in node["properties"] or node["class_name"] in ALSO.get(trait, ())
            yield f" ;\n    ex:{trait.lower()} {str(has).lower()}"
        yield " .\n"
    yield "ex:robot a ex:agent .\n"


def state(task: Task) -> Iterator[str]:
    """Write state.ttl: where things are and how they are now."""
    for fact in sorted(task.facts(task.graph), key=str):
        yield triple(fact) + " .\n"


def triple(fact: Fact) -> str:
    """Write a fact."""
    subject, prop, value = fact
    told = str(value).lower() if isinstance(value, bool) else f"ex:{value}"
    return f"ex:{subject} ex:{prop} {told}"


MUST = {
    "ON": "be on",
    "INSIDE": "be inside",
    "CLOSE": "be close to",
    "FACING": "face",
    "HOLDS_RH": "hold in its right hand",
    "HOLDS_LH": "hold in its left hand",
}
"""What a relation in a goal asks for, in words."""


def tasks(task: Task, asked: str) -> Iterator[str]:
    """Write tasks.ttl: the goal of the task, in the words of the pack."""
    states, done = task.wanted
    told = []
    for goal in states:
        if "state" in goal:
            fact: Fact = (task.names[goal["id"]], *STATES[goal["state"]])
            about = {fact[0]}
            must = f"be {goal['state'].lower()}"
        else:
            named = {"relation_type": goal["relation_type"].upper(), **goal}
            (fact,) = task.facts({"nodes": [], "edges": [named]})
            about = {fact[0], fact[2]}
            must = f"{MUST[goal['relation_type'].upper()]} {fact[2]}"
        told.append((triple(fact), about - {"robot"}, f"{fact[0]} must {must}".replace("_", " ")))
    for options in done:
        names = [option.strip().lower() for option in options.split("|")]
        values = ", ".join(f'"{name}"' for name in names)
        ask = f"?x ex:done_to|ex:did ?done FILTER(?done IN ({values}))"
        told.append((ask, set(), f"{' or '.join(names)} must be done"))
    yield f'ab:task_{task.number} a ab:Task ; rdfs:label "{asked}" ;\n    ab:goal\n'
    goals = []
    for order, (ask, about, message) in enumerate(told, start=1):
        named = [f"?x{n}" for n, _ in enumerate(about)]
        rows = " ".join(
            f"VALUES {x} {{ ex:{name} }}" for x, name in zip(named, sorted(about), strict=True)
        )
        select = f' ; ab:about "SELECT {" ".join(named)} WHERE {{ {rows} }}"' if about else ""
        goals.append(
            f"    [ ab:order {order} ; ab:ask '''ASK {{ {ask} }}'''{select} ;\n"
            f'      ab:message "{message}" ]'
        )
    yield " ,\n".join(goals) + " .\n"


def asked_for(task: Task) -> str:
    """Return the words by which the task is asked for."""
    return task.kind.lower()


def write(task: Task, workspace: Path, plan: str) -> None:
    """Write the domain and a plan for its task into a workspace."""
    asked = asked_for(task)
    folder = workspace / "kg" / DOMAIN
    library = workspace / "prompts" / "library" / DOMAIN
    for path in (folder, library):
        path.mkdir(parents=True, exist_ok=True)
    for name, lines in (
        ("domain", domain()),
        ("actions", actions()),
        ("attributes", attributes(task)),
        ("state", state(task)),
        ("tasks", tasks(task, asked)),
    ):
        (folder / f"{name}.ttl").write_text(_HEAD + "".join(lines))
    head = json.dumps({"names": [asked], "ingredients": [], "base": []})
    (library / "task.plan").write_text(f"---\n{head}\n---\n{plan}")


def main() -> None:
    """Make a workspace."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("task", help="the number of a task of the package, such as 1073_1")
    parser.add_argument("--workspace", type=Path, required=True)
    parser.add_argument("--plan", type=Path, help="a plan, one step a line")
    given = parser.parse_args()
    task = Task(given.task)
    own = "\n".join(map(task.call, task.script)) + "\n"
    write(task, given.workspace, given.plan.read_text() if given.plan else own)
    bridge = f"exec:python {Path(__file__).with_name('bridge.py')} {task.number}"
    sys.stdout.write(
        f'adaptbot run "{asked_for(task)}" --model library --domain {DOMAIN} '
        f"--workspace {given.workspace} --world '{bridge}'\n"
    )


if __name__ == "__main__":
    main()
