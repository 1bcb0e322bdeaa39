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

AGENT = "ab:agent w:arm ;"
ADVICE = 'ab:select "SELECT ?item WHERE { ?item w:on true }"'
MINUTES = '"SELECT (5 AS ?minutes) WHERE {}"'
HOLDS = '"ASK { ?agent w:holds ?thing }"'
LIGHT = '"INSERT { ?thing w:on true } WHERE {}"'
SPOT = "\"SELECT ?spot WHERE { ?spot a w:furniture ; w:called 'bench' }\""
KILOS = 'ab:name "kilos" ; ab:datatype xsd:decimal'
HAS_DOOR = "ab:attribute w:hasDoor ; ab:value true ;"
NO_DOOR = 'ab:message "{spot} has no door"'
TURN_ON = 'ab:alias "turn_on" ; ab:parameter "state"'

ERRORS = {
    "domain.ttl": [
        ('rdfs:label "workshop" ;', "", "workshop: lacks rdfs:label; add it"),
        (AGENT, "", "workshop: needs an IRI as ab:agent"),
        (AGENT, 'ab:agent "arm" ;', "workshop: needs an IRI as ab:agent"),
        (AGENT, "ab:agent w:arm, w:leg ;", "workshop: has 2 values for ab:agent"),
        ('ab:namespace "http://example.org/workshop#" ;', "", "workshop: lacks ab:namespace"),
        ("rdfs:domain w:agent ;", "", "holds: needs an IRI as rdfs:domain"),
        ("ab:equals true ; ", "", "drillable: an ab:impliedBy needs ab:equals and ab:value"),
        ("dry ; ab:value false ]", "dry ]", "part: an ab:starts lacks ab:value"),
        ("?item w:in w:bench", "?item w:in", "workshop: ab:ask is no valid SPARQL"),
        (ADVICE, 'ab:select "ASK {}"', "workshop: ab:select must be a SPARQL SELECT"),
        ("{item} does not", "{part} does not", "names {part}; it may name {item}"),
        ("the hand is", "{item} is", "names {item}; it may name no parameter"),
        ("ab:when w:", "ab:whenn w:", "part: there is no ab:whenn; the nearest is ab:when"),
        (ADVICE, ADVICE.replace("?item WHERE", "?it WHERE"), "must give ?item, but gives ?it"),
        (
            ADVICE,
            'ab:select "select distinct * where { ?item w:on true }"',
            "workshop: ab:select must name the variables that it gives, not *",
        ),
    ],
    "actions.ttl": [
        ('ab:explain "open a door" ;', "", "open: lacks ab:explain; add it"),
        ("ab:order 4 ;", 'ab:order "four" ;', "open: needs a whole number as ab:order"),
        (
            'ab:name "kilos"',
            'ab:name "Kilos of it"',
            'press: parameter "Kilos of it": a name has small letters, digits and underscores',
        ),
        (KILOS, f"{KILOS} ; ab:class w:part", 'parameter "kilos" needs either ab:class or ab:data'),
        (MINUTES, '"SELECT (5 AS"', 'wait: ab:default of parameter "minutes" is no valid SPARQL'),
        (MINUTES, '"5"', 'wait: ab:default of parameter "minutes" must be a SPARQL SELECT'),
        (HOLDS, '"ASK { ?agent w:holds }"', "put: ab:ask is no valid SPARQL"),
        (f"ab:ask {HOLDS} ;", "", "put: lacks ab:ask; add it"),
        (HOLDS, HOLDS.replace("?thing", "$thing"), "put: ab:ask writes $thing; write ?thing"),
        (LIGHT, LIGHT.replace("?thing", "$thing"), "light: ab:effect writes $thing; write ?thing"),
        (SPOT, '"SELECT * WHERE { ?spot a w:furniture }"', "name the variables that it gives, not"),
        ("w:open a ab:Action", "w:open a ab:Acton", "open: there is no ab:Acton; the nearest is"),
        ("ab:ifUnknown ab:holds", "ab:ifUnknown ab:hold", "take_part: there is no ab:hold; the ne"),
        (NO_DOOR, 'ab:message "{spot has no door"', "has a brace too many"),
        (
            'ab:explain "open a door" ;',
            'ab:explain "open" ; ab:purpose [ ab:ask "ASK {}" ; ab:message "{x} is open" ] ;',
            "names {x}; it may name {spot}",
        ),
        (HAS_DOOR, HAS_DOOR[:25], "open: an ab:requires with ab:attribute needs ab:value"),
        (TURN_ON, TURN_ON.replace("state", "mode"), 'ab:parameter "mode" is none of its parameter'),
        (f"{TURN_ON} ; ab:value true", TURN_ON, "switch: an ab:calledAs needs ab:value"),
        (LIGHT, LIGHT.replace("{}", "{ ?thing }"), "light: ab:effect is no valid SPARQL"),
        (LIGHT, LIGHT.replace("?thing", "[]"), "a group of triples may hold no blank node"),
        (LIGHT, LIGHT.replace("w:on true", "a w:tool"), "effect changes type, which says what"),
        (LIGHT, LIGHT.replace("w:on true", "w:called 'l'"), "effect changes called, which says"),
        (LIGHT, '"DROP GRAPH w:x"', "light: ab:effect must be a SPARQL update"),
    ],
    "tasks.ttl": [
        ('rdfs:label "stool" ;', "", "task_stool: lacks rdfs:label; add it"),
        ("ASK { w:board w:drilled true }", "ASK { w:board }", "task_stool: ab:ask is no valid"),
        ('"the board has no hole"', '"{board} has no hole"', "task_stool: the message"),
    ],
}
"""What stops a pack from being loaded, with what is said of it; `domain check` has the others."""


@pytest.mark.parametrize(
    ("file", "old", "new", "said"), [(file, *row) for file in ERRORS for row in ERRORS[file]]
)
def test_the_first_error_is_raised_with_its_file(file: str, old: str, new: str, said: str) -> None:
    with pytest.raises(PackError) as caught:
        replaced(file, old, new)
    assert str(caught.value).startswith(f"workshop/{file}, entry ") and said in str(caught.value)


def test_two_domains_in_one_pack() -> None:
    with pytest.raises(PackError, match="needs exactly one entry typed ab:Domain, has 2"):
        workshop(domain='ab:other a ab:Domain ; rdfs:label "other" .')


def test_a_missing_file_is_named() -> None:
    with pytest.raises(KnowledgeError, match=r"here lacks domain\.ttl"):
        load_kg({}, "here")


@pytest.mark.parametrize(
    ("state", "said"),
    [
        (
            f"{PREFIXES}w:plank w:in w:bench\nw:vase w:in .".encode(),
            r", line \d+: this is no valid",
        ),
        (b"\xff\xfe\x00", ""),
    ],
)
def test_no_valid_turtle_is_told_with_its_file(state: bytes, said: str) -> None:
    files = {name: (PREFIXES + text).encode() for name, text in FILES.items()}
    with pytest.raises(KnowledgeError, match=rf"here/state\.ttl{said}"):
        load_kg({**files, "state.ttl": state}, "here")


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
        ("actions.ttl", HOLDS, HOLDS.replace("ASK", "ask")),
        ("actions.ttl", MINUTES, '"  select (5 as ?minutes) where { ?x w:on ?y }"'),
        (
            "domain.ttl",
            ADVICE,
            'ab:select "Select ?item ?where where { ?item w:on true } group by ?item ?where"',
        ),
        ("actions.ttl", SPOT, "\"SELECT ?spot { ?spot a w:furniture FILTER('$x' != '') }\""),
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
