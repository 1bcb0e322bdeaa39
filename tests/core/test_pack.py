"""What can be wrong with a domain pack: each error names the file, the entry and what to do."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from rdflib import Literal, URIRef, Variable

from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.graph.sparql import template
from adaptbot_cli.core.graph.terms import TERMS, TRUE
from adaptbot_cli.errors import KnowledgeError, PackError
from tests.worlds import ACTIONS, FILES, PREFIXES, W, replaced, workshop


def problem(file: str, old: str, new: str) -> str:
    """What is said when one passage of the workshop's pack is changed."""
    with pytest.raises(PackError) as caught:
        replaced(file, old, new)
    return str(caught.value)


DOMAIN_ERRORS = [
    ("ab:workshop a ab:Domain", "ab:workshop a ab:Something", "needs exactly one entry typed ab:"),
    ('rdfs:label "workshop" ;', "", "entry workshop: lacks rdfs:label; add it"),
    ("ab:agent w:arm ;", "", "entry workshop: needs an IRI as ab:agent"),
    ("ab:agent w:arm ;", 'ab:agent "arm" ;', "entry workshop: needs an IRI as ab:agent"),
    ("ab:agent w:arm ;", "ab:agent w:arm, w:leg ;", "entry workshop: has 2 values for ab:agent"),
    (
        'ab:namespace "http://example.org/workshop#" ;',
        "",
        "entry workshop: lacks ab:namespace; add it",
    ),
    (
        "ab:graph ab:state ; rdfs:domain w:tool",
        "ab:graph ab:both ; rdfs:domain w:tool",
        "entry charged: ab:graph must be ab:attribute or ab:state",
    ),
    (
        "w:charged a rdf:Property ; ab:graph ab:state ; rdfs:domain w:tool ;",
        "w:charged a rdf:Property ; ab:graph ab:state ;",
        "entry charged: needs an IRI as rdfs:domain",
    ),
    ("ab:kindOrder 3", 'ab:kindOrder "third"', "entry furniture: needs a whole number as ab:kind"),
    ("ab:equals true ; ", "", "entry drillable: an ab:impliedBy needs ab:equals and ab:value"),
    (
        "[ ab:property w:dry ; ab:value false ]",
        "[ ab:property w:dry ]",
        "entry part: an ab:starts lacks ab:value",
    ),
    (
        'ab:ask "ASK { ?item w:in w:bench }" ;',
        "",
        "entry workshop: a goal needs either ab:ask or ab:select",
    ),
    (
        'ab:ask "ASK { ?item w:in w:bench }" ;',
        'ab:ask "ASK { ?item w:in }" ;',
        "entry workshop: ab:ask is no valid SPARQL",
    ),
    (
        'ab:select "SELECT ?item WHERE { ?item w:on true }"',
        'ab:select "ASK { ?item w:on true }"',
        "entry workshop: ab:select must be a SPARQL SELECT",
    ),
    (
        '"{item} does not end on the bench"',
        '"{part} does not end on the bench"',
        'the message "{part} does not end on the bench" names {part}; it may name {item}',
    ),
    ('"{item} is left on"', '"{item is left on"', "has a brace too many"),
    (
        '"the hand is not empty at the end"',
        '"{item} is not empty"',
        "names {item}; it may name no parameter",
    ),
    (
        "ab:stateWord",
        "ab:statesWord",
        "entry drilled: there is no ab:statesWord; the nearest is ab:s",
    ),
    (
        "ab:when w:drillable",
        "ab:whenn w:drillable",
        "entry part: there is no ab:whenn; the nearest is ab:when",
    ),
    (
        "w:holds a rdf:Property ; ab:graph ab:state",
        "w:holds a rdf:Property ; ab:graph ab:stat",
        "entry holds: ab:graph must be ab:attribute or ab:state",
    ),
    (
        'ab:select "SELECT ?item WHERE { ?item w:on true }"',
        'ab:select "SELECT ?it WHERE { ?it w:on true . ?item w:on true }"',
        "entry workshop: ab:select must give ?item, but gives ?it",
    ),
    (
        'ab:select "SELECT ?item WHERE { ?item w:on true }"',
        'ab:select "select distinct * where { ?item w:on true }"',
        "entry workshop: ab:select must name the variables that it gives, not *",
    ),
    (
        '"Can one drill {name}?"',
        '"Can one drill {part}?"',
        "entry drillable: the message",
    ),
]

ACTION_ERRORS = [
    ('rdfs:label "open" ;', "", "entry open: lacks rdfs:label; add it"),
    ('ab:explain "open a door" ;', "", "entry open: lacks ab:explain; add it"),
    ("ab:order 4 ;\n", 'ab:order "four" ;\n', "entry open: needs a whole number as ab:order"),
    (
        'ab:name "kilos"',
        'ab:name "Kilos of it"',
        'entry press: parameter "Kilos of it": a name has small letters, digits and underscores',
    ),
    (
        'ab:name "kilos" ; ab:datatype xsd:decimal',
        'ab:name "kilos"',
        'entry press: parameter "kilos" needs either ab:class or ab:datatype',
    ),
    (
        'ab:name "kilos" ; ab:datatype xsd:decimal',
        'ab:name "kilos" ; ab:datatype xsd:decimal ; ab:class w:part',
        'entry press: parameter "kilos" needs either ab:class or ab:datatype',
    ),
    (
        '"SELECT (5 AS ?minutes) WHERE {}"',
        '"SELECT (5 AS ?minutes WHERE {}"',
        'entry wait: ab:default of parameter "minutes" is no valid SPARQL',
    ),
    (
        '"SELECT (5 AS ?minutes) WHERE {}"',
        '"5"',
        'entry wait: ab:default of parameter "minutes" must be a SPARQL SELECT',
    ),
    (
        '"ASK { ?agent w:holds ?thing }"',
        '"ASK { ?agent w:holds }"',
        "entry put: ab:ask is no valid SPARQL",
    ),
    (
        '"ASK { ?agent w:holds ?thing }"',
        '"ASK { ?agent robot:holds ?thing }"',
        "entry put: ab:ask is no valid SPARQL",
    ),
    (
        'ab:ask "ASK { ?agent w:holds ?thing }" ;',
        "",
        "entry put: lacks ab:ask; add it",
    ),
    (
        '"ASK { ?agent w:holds ?thing }"',
        '"ASK { ?agent w:holds $thing }"',
        "entry put: ab:ask writes $thing; write ?thing",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { $thing w:on true } WHERE {}"',
        "entry light: ab:effect writes $thing; write ?thing",
    ),
    (
        '"SELECT (5 AS ?minutes) WHERE {}"',
        '"SELECT (5 AS ?time) WHERE {}"',
        'entry wait: ab:default of parameter "minutes" must give ?minutes, but gives ?time',
    ),
    (
        "\"SELECT ?spot WHERE { ?spot a w:furniture ; w:called 'bench' }\"",
        '"SELECT * WHERE { ?spot a w:furniture }"',
        'ab:default of parameter "spot" must name the variables that it gives, not *',
    ),
    (
        'rdfs:label "take_tool"',
        'rdfs:label "open"',
        'entry open: "open" is the rdfs:label of take_',
    ),
    (
        'ab:family "take" ;\n    ab:explain "take a tool"',
        'ab:fetchs true ;\n    ab:explain "take a tool"',
        "entry take_tool: there is no ab:fetchs; the nearest is ab:fetches",
    ),
    ("w:open a ab:Action", "w:open a ab:Acton", "entry open: there is no ab:Acton; the nearest is"),
    (
        "ab:ifUnknown ab:holds",
        "ab:ifUnknown ab:hold",
        "entry take_part: there is no ab:hold; the ne",
    ),
    (
        'ab:message "{spot} has no door"',
        'ab:message "{place} has no door"',
        'entry open: the message "{place} has no door" names {place}; it may name {spot}',
    ),
    ('ab:message "{spot} has no door"', 'ab:message "{spot has no door"', "has a brace too many"),
    (
        'ab:explain "open a door" ;',
        'ab:explain "open a door" ; ab:purpose [ ab:ask "ASK {}" ; ab:message "{x} is open" ] ;',
        "names {x}; it may name {spot}",
    ),
    (
        'ab:of "spot" ; ab:attribute w:hasDoor',
        'ab:of "place" ; ab:attribute w:hasDoor',
        'entry open: ab:of "place" is none of its parameters',
    ),
    (
        "ab:attribute w:hasDoor",
        "ab:attribute w:hasLid",
        "entry open: ab:attribute hasLid is not declared in domain.ttl",
    ),
    (
        "ab:attribute w:hasDoor ; ab:value true ;",
        "ab:attribute w:hasDoor ;",
        "entry open: an ab:requires with ab:attribute needs ab:value",
    ),
    (
        'ab:alias "turn_on" ; ab:parameter "state"',
        'ab:alias "turn_on" ; ab:parameter "mode"',
        'entry switch: ab:parameter "mode" is none of its parameters',
    ),
    (
        'ab:alias "turn_on" ; ab:parameter "state" ; ab:value true',
        'ab:alias "turn_on" ; ab:parameter "state"',
        "entry switch: an ab:calledAs needs ab:value",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT DATA { w:x w:on true }"',
        'entry light: ab:effect has "INSERT DATA" where only DELETE, INSERT or WHERE may stand; '
        "write DELETE {…} INSERT {…} WHERE {…}",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { ?thing w:on } WHERE {}"',
        "entry light: ab:effect is no valid SPARQL",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { ?thing w:on true } WHERE { ?thing }"',
        "entry light: ab:effect is no valid SPARQL",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { [] w:on true } WHERE {}"',
        "entry light: ab:effect is no valid SPARQL: a group of triples may hold no blank node",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { ?thing w:lit true } WHERE {}"',
        "entry light: ab:effect: lit is not declared in domain.ttl",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { ?thing a w:tool } WHERE {}"',
        "entry light: ab:effect changes type, which says what a thing is",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        "\"INSERT { ?thing w:called 'lamp' } WHERE {}\"",
        "entry light: ab:effect changes called, which says what a thing is",
    ),
    (
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"DROP GRAPH w:x"',
        "entry light: ab:effect must be a SPARQL update",
    ),
]

TASK_ERRORS = [
    ('rdfs:label "stool" ;', "", "entry task_stool: lacks rdfs:label; add it"),
    (
        'ab:needs "board" ;\n    ab:goal [',
        "rdfs:seeAlso [",
        "entry task_stool: says neither what it requires nor its goal",
    ),
    ("ASK { w:board w:drilled true }", "ASK { w:board }", "entry task_stool: ab:ask is no valid"),
    ('ab:needs "board" ;', 'ab:need "board" ;', "task_stool: there is no ab:need; the nearest is"),
    ('"the board has no hole"', '"{board} has no hole"', "entry task_stool: the message"),
]


@pytest.mark.parametrize(("old", "new", "said"), DOMAIN_ERRORS)
def test_an_error_in_the_domain(old: str, new: str, said: str) -> None:
    message = problem("domain.ttl", old, new)
    assert message.startswith("workshop/domain.ttl")
    assert said in message


@pytest.mark.parametrize(("old", "new", "said"), ACTION_ERRORS)
def test_an_error_in_an_action(old: str, new: str, said: str) -> None:
    message = problem("actions.ttl", old, new)
    assert message.startswith("workshop/actions.ttl, entry ")
    assert said in message


@pytest.mark.parametrize(("old", "new", "said"), TASK_ERRORS)
def test_an_error_in_a_task(old: str, new: str, said: str) -> None:
    message = problem("tasks.ttl", old, new)
    assert message.startswith("workshop/tasks.ttl, entry ")
    assert said in message


def test_two_domains_in_one_pack() -> None:
    with pytest.raises(PackError, match="needs exactly one entry typed ab:Domain, has 2"):
        workshop(domain='ab:other a ab:Domain ; rdfs:label "other" .')


def test_a_missing_file_is_named() -> None:
    with pytest.raises(KnowledgeError, match=r"here lacks domain\.ttl"):
        load_kg({}, "here")


def test_no_valid_turtle_is_told_with_file_and_line() -> None:
    files = {name: (PREFIXES + text).encode() for name, text in FILES.items()}
    files["state.ttl"] = PREFIXES.encode() + b"w:plank w:in w:bench\nw:vase w:in ."
    with pytest.raises(KnowledgeError, match=r"here/state\.ttl, line \d+: this is no valid Turtle"):
        load_kg(files, "here")


def test_bytes_that_are_no_text_are_no_valid_turtle() -> None:
    files = {name: (PREFIXES + text).encode() for name, text in FILES.items()}
    files["state.ttl"] = b"\xff\xfe\x00"
    with pytest.raises(KnowledgeError, match=r"here/state\.ttl"):
        load_kg(files, "here")


def test_actions_stand_in_their_order_whatever_the_order_of_the_file() -> None:
    blocks = ACTIONS.strip().split("\n\n")
    files = {**FILES, "actions.ttl": "\n\n".join(reversed(blocks))}
    kg = load_kg({name: (PREFIXES + text).encode() for name, text in files.items()}, "here")
    assert list(kg.domain.actions) == list(workshop().domain.actions)


def test_an_action_without_an_order_stands_last() -> None:
    kg = replaced("actions.ttl", 'rdfs:label "open" ; ab:order 4 ;', 'rdfs:label "open" ;')
    assert list(kg.domain.actions)[-1] == "open"


TIES = """
w:tied a ab:Action ; rdfs:label "tied" ; ab:order 90 ; ab:explain "tied" ;
    ab:parameter w:tied_b , w:tied_a , w:tied_c ; ab:calledAs
        [ ab:alias "one" ; ab:parameter "a" ; ab:value w:bench ; ab:unit [] ] ,
        [ ab:alias "two" ; ab:parameter "a" ; ab:value w:bench ; ab:unit [] ] ,
        [ ab:alias "three" ; ab:parameter "a" ; ab:value w:bench ; ab:unit [] ] .
w:tied_a ab:name "a" ; ab:class w:part ; ab:trueWord "z" .
w:tied_b ab:name "b" ; ab:class w:part .
w:tied_c ab:name "c" ; ab:class w:part ; ab:order 1 ; ab:trueWord "a" .
w:same_b a ab:Action ; rdfs:label "same_b" ; ab:order 90 ; ab:explain "a" ; ab:advises
    [ ab:ask "ASK {}" ; ab:message "a" ] .
w:same_a a ab:Action ; rdfs:label "same_a" ; ab:order 90 ; ab:explain "z" ; ab:advises
    [ ab:ask "ASK {}" ; ab:message "z" ] .
"""
_TELL = """
from tests.core.test_pack import TIES
from tests.worlds import workshop
actions = workshop(actions=TIES).domain.actions
tied = actions["tied"]
print(*list(actions)[-3:], *(p.name for p in tied.parameters), *(c.names for c in tied.called_as))
"""


def test_ties_are_in_the_same_order_in_every_process() -> None:
    root = Path(__file__).parents[2]
    told = set()
    for seed in ("0", "1", "2"):
        env = {**os.environ, "PYTHONPATH": str(root), "PYTHONHASHSEED": seed}
        command = [sys.executable, "-c", _TELL]
        ended = subprocess.run(command, env=env, text=True, capture_output=True, check=True)
        told.add(ended.stdout.strip())
    assert told == {"same_a same_b tied c a b ('one',) ('three',) ('two',)"}


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("actions.ttl", '"ASK { ?agent w:holds ?thing }"', '"ask { ?agent w:holds ?thing }"'),
        (
            "actions.ttl",
            '"SELECT (5 AS ?minutes) WHERE {}"',
            '"  select (5 as ?minutes) where { ?x w:on ?y }"',
        ),
        (
            "domain.ttl",
            '"SELECT ?item WHERE { ?item w:on true }"',
            '"Select ?item ?where where { ?item w:on true } group by ?item ?where"',
        ),
        (
            "actions.ttl",
            '"SELECT ?tool WHERE { ?tool w:drills true } ORDER BY ?tool"',
            "\"SELECT ?tool { ?tool w:drills true FILTER('$x' != '') } ORDER BY ?tool\"",
        ),
    ],
)
def test_queries_may_be_written_as_sparql_allows(file: str, old: str, new: str) -> None:
    assert replaced(file, old, new).domain.actions


def test_a_query_in_small_letters_asks_the_same() -> None:
    kg = replaced(
        "domain.ttl", "SELECT ?item WHERE { ?item w:on", "select ?item where { ?item w:on"
    )
    assert kg.rows(kg.domain.advice[0].query, {}) == workshop().rows(
        workshop().domain.advice[0].query, {}
    )


def test_every_term_that_the_tool_reads_is_a_known_one() -> None:
    folder = Path(__file__).parents[2] / "adaptbot_cli"
    text = "".join(path.read_text(encoding="utf-8") for path in folder.rglob("*.py"))
    read = {a or b for a, b in re.findall(r'\bAB(?:\.(\w+)|\["(\w+)"\])', text)}
    log = {"at", "answers"}  # of a shared graph's log, not of packs
    assert read - {"schema"} - log <= TERMS
    assert {"fetches", "class"} <= read


def test_a_kinds_superclasses_start_with_itself() -> None:
    part = workshop().domain.classes[URIRef(W + "part")]
    assert part.superclasses == (URIRef(W + "part"), URIRef(W + "thing"))


def test_an_effect_is_read_into_a_query_and_two_templates() -> None:
    effect = workshop().domain.actions["open"].effect
    assert effect is not None
    spot, door = Variable("spot"), URIRef(W + "doorOpen")
    assert effect.deletes == ((spot, door, Variable("was")),)
    assert effect.inserts == ((spot, door, TRUE),)
    assert effect.predicates == {door}


def test_a_template_may_use_everything_that_turtle_has() -> None:
    text = "?thing w:on true, false ; w:on 'who? me', 'a.b' ."
    inserts = template(f"PREFIX w: <{W}> ", text)
    assert {str(value) for _, _, value in inserts} == {"true", "false", "who? me", "a.b"}
    kg = replaced(
        "actions.ttl",
        '"INSERT { ?thing w:on true } WHERE {}"',
        '"INSERT { ?thing w:on true, false . } WHERE { }"',
    )
    effect = kg.domain.actions["light"].effect
    assert effect is not None
    assert len(kg.delta(effect, {"thing": URIRef(W + "plank")}).added) == 2


def test_a_task_is_known_by_all_its_names() -> None:
    names = workshop().domain.task_names
    assert names["stool"] is names["wooden_stool"]
    assert names["stool"].known


def test_teachable_kinds_stand_in_the_domains_order() -> None:
    assert [kind.label for kind in workshop().domain.teachable] == [
        "part",
        "tool",
        "piece of furniture",
    ]


def test_parameters_say_what_a_plan_may_and_must_write() -> None:
    actions = workshop().domain.actions
    assert [p.name for p in actions["dry_part"].visible] == ["part"]
    assert [p.name for p in actions["drill_hole"].required] == ["part"]
    assert actions["switch"].parameters[1].words["off"] == Literal(False)
