"""A tiny home to test in: a workshop. No Python knows it, as none knows the kitchen."""

from collections.abc import Iterable

from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.core.plan import Call, Parsed, Task, Written
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.words import Related, Relation

PREFIXES = """
@prefix ab: <urn:adaptbot:> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@prefix w: <http://example.org/workshop#> .
"""

W = "http://example.org/workshop#"

DOMAIN = """
ab:workshop a ab:Domain ;
    rdfs:label "workshop" ;
    ab:namespace "http://example.org/workshop#" ;
    ab:agent w:arm ;
    ab:wordField "noun.artifact" ;
    ab:verbField "verb.contact" ;
    ab:filler "build", "make", "a", "the" ;
    ab:quantifier "everything", "all" ;
    ab:partWord "contents", "surface" ;
    ab:product "assembly" ;
    ab:goal
        [ ab:order 1 ; ab:class w:part ; ab:ask "ASK { ?item w:in w:bench }" ;
          ab:message "{item} does not end on the bench" ] ,
        [ ab:order 2 ; ab:ask "ASK { FILTER NOT EXISTS { ?agent w:holds ?thing } }" ;
          ab:message "the hand is not empty at the end" ] ;
    ab:advice
        [ ab:order 1 ; ab:select "SELECT ?item WHERE { ?item w:on true }" ;
          ab:message "{item} is left on" ] .

w:thing a rdfs:Class ; rdfs:label "thing" ; ab:nameProperty w:called .
w:furniture a rdfs:Class ; rdfs:subClassOf w:thing ; rdfs:label "piece of furniture" ;
    ab:nameProperty w:called ; ab:kindOrder 3 .
w:part a rdfs:Class ; rdfs:subClassOf w:thing ; rdfs:label "part" ; rdfs:comment "worked on" ;
    ab:nameProperty w:called ; ab:locationProperty w:in ; ab:kindOrder 1 ;
    ab:asks ( w:in w:drillable ) ;
    ab:starts [ ab:property w:dry ; ab:value false ] ,
              [ ab:property w:drilled ; ab:value false ; ab:when w:drillable ] .
w:tool a rdfs:Class ; rdfs:subClassOf w:thing ; rdfs:label "tool" ;
    ab:nameProperty w:called ; ab:locationProperty w:in ; ab:kindOrder 2 .

w:called a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:thing ; rdfs:range xsd:string ;
    ab:functional true .
w:hasDoor a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:furniture ;
    rdfs:range xsd:boolean ; rdfs:label "closed by a door" ; ab:functional true ;
    ab:question "Has {name} a door?" .
w:drills a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:tool ; rdfs:range xsd:boolean ;
    ab:functional true .
w:battery a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:tool ; rdfs:range xsd:boolean ;
    rdfs:label "run by a battery" ; ab:functional true ; ab:question "Has {name} a battery?" .
w:heats a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:thing ; rdfs:range xsd:boolean .
w:switchable a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:thing ; rdfs:range xsd:boolean ;
    rdfs:label "switchable" ; ab:functional true ; ab:question "Can {name} be switched?" .
w:heavy a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:part ; rdfs:range xsd:boolean ;
    rdfs:label "too heavy" ; ab:functional true .
w:glass a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:part ; rdfs:range xsd:boolean ;
    rdfs:label "made of glass" ; ab:functional true .
w:drillable a rdf:Property ; ab:graph ab:attribute ; rdfs:domain w:part ;
    rdfs:range xsd:boolean ; rdfs:label "drillable" ; ab:functional true ;
    ab:question "Can one drill {name}?" ;
    ab:impliedBy [ ab:property w:glass ; ab:equals true ; ab:value false ] .

w:in a rdf:Property ; ab:graph ab:state ; rdfs:domain w:thing ; rdfs:range w:furniture ;
    rdfs:label "place" ; ab:functional true ; ab:question "Where is {name} kept?" .
w:holds a rdf:Property ; ab:graph ab:state ; rdfs:domain w:agent ; rdfs:range w:thing .
w:doorOpen a rdf:Property ; ab:graph ab:state ; rdfs:domain w:furniture ; rdfs:range xsd:boolean ;
    rdfs:label "open" ; ab:functional true .
w:on a rdf:Property ; ab:graph ab:state ; rdfs:domain w:thing ; rdfs:range xsd:boolean ;
    rdfs:label "on" ; ab:functional true .
w:charged a rdf:Property ; ab:graph ab:state ; rdfs:domain w:tool ; rdfs:range xsd:boolean ;
    rdfs:label "charged" ; ab:functional true .
w:drilled a rdf:Property ; ab:graph ab:state ; rdfs:domain w:part ; rdfs:range xsd:boolean ;
    rdfs:label "drilled" ; ab:functional true ; ab:stateWord "drilled", "bored" .
w:dry a rdf:Property ; ab:graph ab:state ; rdfs:domain w:part ; rdfs:range xsd:boolean ;
    rdfs:label "dry" ; ab:functional true ; ab:stateWord "dried" .
w:blessed a rdf:Property ; ab:graph ab:state ; rdfs:domain w:part ; rdfs:range xsd:boolean ;
    rdfs:label "blessed" ; ab:functional true .
"""

ACTIONS = """
w:take_part a ab:Action ; rdfs:label "take_part" ; ab:order 1 ; ab:family "take" ;
    ab:explain "take a part" ; ab:alias "take", "grab" ;
    ab:parameters ( [ ab:name "part" ; ab:class w:part ] ) ;
    ab:requires
        [ ab:order 1 ; ab:of "part" ; ab:attribute w:heavy ; ab:value false ;
          ab:ifUnknown ab:holds ; ab:message "{part} is too heavy" ] ,
        [ ab:order 2 ; ab:ask \"\"\"ASK { FILTER NOT EXISTS { ?agent w:holds ?held .
                                               FILTER(?held != ?part) } }\"\"\" ;
          ab:message "the hand must be free to take {part}" ] ,
        [ ab:order 3 ; ab:ask \"\"\"ASK { FILTER NOT EXISTS {
                                  ?part w:in ?spot . ?spot w:hasDoor true .
                                  FILTER NOT EXISTS { ?spot w:doorOpen true } } }\"\"\" ;
          ab:message "the door must be open to take {part} out" ] ;
    ab:effect \"\"\"DELETE { ?part w:in ?spot } INSERT { ?agent w:holds ?part }
                 WHERE { OPTIONAL { ?part w:in ?spot } }\"\"\" .

w:take_tool a ab:Action ; rdfs:label "take_tool" ; ab:order 2 ; ab:family "take" ;
    ab:explain "take a tool" ;
    ab:parameters ( [ ab:name "tool" ; ab:class w:tool ] ) ;
    ab:requires
        [ ab:order 1 ; ab:ask \"\"\"ASK { FILTER NOT EXISTS { ?agent w:holds ?held .
                                               FILTER(?held != ?tool) } }\"\"\" ;
          ab:message "the hand must be free to take {tool}" ] ,
        [ ab:order 2 ; ab:ask \"\"\"ASK { FILTER NOT EXISTS {
                                  ?tool w:in ?spot . ?spot w:hasDoor true .
                                  FILTER NOT EXISTS { ?spot w:doorOpen true } } }\"\"\" ;
          ab:message "the door must be open to take {tool} out" ] ;
    ab:effect \"\"\"DELETE { ?tool w:in ?spot } INSERT { ?agent w:holds ?tool }
                 WHERE { OPTIONAL { ?tool w:in ?spot } }\"\"\" .

w:put a ab:Action ; rdfs:label "put" ; ab:order 3 ;
    ab:explain "put down what is in the hand" ;
    ab:parameters (
        [ ab:name "thing" ; ab:class w:part, w:tool ]
        [ ab:name "spot" ; ab:class w:furniture ;
          ab:default "SELECT ?spot WHERE { ?spot a w:furniture ; w:called 'bench' }" ] ) ;
    ab:requires
        [ ab:order 1 ; ab:ask "ASK { ?agent w:holds ?thing }" ;
          ab:message "{thing} must be in the hand" ] ;
    ab:effect \"\"\"DELETE { ?agent w:holds ?thing } INSERT { ?thing w:in ?spot } WHERE {}\"\"\" .

w:open a ab:Action ; rdfs:label "open" ; ab:order 4 ;
    ab:explain "open a door" ;
    ab:parameters ( [ ab:name "spot" ; ab:class w:furniture ] ) ;
    ab:requires
        [ ab:order 1 ; ab:of "spot" ; ab:attribute w:hasDoor ; ab:value true ;
          ab:message "{spot} has no door" ] ;
    ab:effect \"\"\"DELETE { ?spot w:doorOpen ?was } INSERT { ?spot w:doorOpen true }
                 WHERE { OPTIONAL { ?spot w:doorOpen ?was } }\"\"\" .

w:charge a ab:Action ; rdfs:label "charge" ; ab:order 5 ;
    ab:explain "charge a tool" ;
    ab:parameters ( [ ab:name "tool" ; ab:class w:tool ] ) ;
    ab:requires
        [ ab:order 1 ; ab:of "tool" ; ab:attribute w:battery ; ab:value true ;
          ab:message "{tool} has no battery" ] ;
    ab:advises
        [ ab:order 1 ; ab:ask "ASK { FILTER NOT EXISTS { ?tool w:charged true } }" ;
          ab:message "{tool} is charged already" ] ;
    ab:effect \"\"\"DELETE { ?tool w:charged ?was } INSERT { ?tool w:charged true }
                 WHERE { OPTIONAL { ?tool w:charged ?was } }\"\"\" .

w:drill_hole a ab:Action ; rdfs:label "drill_hole" ; ab:order 6 ;
    ab:explain "drill a hole" ; ab:alias "bore" ;
    ab:parameters (
        [ ab:name "part" ; ab:class w:part ]
        [ ab:name "tool" ; ab:class w:tool ; ab:optional true ;
          ab:default "SELECT ?tool WHERE { ?tool w:drills true } ORDER BY ?tool" ]
        [ ab:name "spot" ; ab:class w:furniture ; ab:optional true ] ) ;
    ab:requires
        [ ab:order 1 ; ab:of "part" ; ab:attribute w:drillable ; ab:value true ;
          ab:message "{part} cannot be drilled" ] ,
        [ ab:order 2 ; ab:of "tool" ; ab:attribute w:drills ; ab:value true ;
          ab:message "{tool} does not drill" ] ,
        [ ab:order 3 ; ab:ask \"\"\"ASK { FILTER NOT EXISTS { ?tool w:battery true ;
                                                      w:charged false } }\"\"\" ;
          ab:message "{tool} must be charged" ] ;
    ab:effect \"\"\"DELETE { ?part w:drilled ?was } INSERT { ?part w:drilled true }
                 WHERE { OPTIONAL { ?part w:drilled ?was } }\"\"\" .

w:dry_part a ab:Action ; rdfs:label "dry_part" ; ab:order 7 ; ab:verb "dry" ;
    ab:explain "dry a part by heat" ;
    ab:parameters (
        [ ab:name "part" ; ab:class w:part ]
        [ ab:name "heater" ; ab:class w:furniture ; ab:optional true ; ab:hidden true ;
          ab:default "SELECT ?heater WHERE { ?heater w:heats true } ORDER BY ?heater" ] ) ;
    ab:requires
        [ ab:order 1 ; ab:ask "ASK { ?heater w:on true }" ; ab:message "{heater} must be on" ] ;
    ab:effect \"\"\"DELETE { ?part w:dry ?was } INSERT { ?part w:dry true }
                 WHERE { OPTIONAL { ?part w:dry ?was } }\"\"\" .

w:switch a ab:Action ; rdfs:label "switch" ; ab:order 8 ;
    ab:explain "switch a thing on or off" ;
    ab:calledAs [ ab:alias "turn_on" ; ab:parameter "state" ; ab:value true ] ,
                [ ab:alias "turn_off" ; ab:parameter "state" ; ab:value false ] ;
    ab:parameters (
        [ ab:name "thing" ; ab:class w:thing ]
        [ ab:name "state" ; ab:datatype xsd:boolean ; ab:trueWord "on" ; ab:falseWord "off" ;
          ab:optional true ] ) ;
    ab:requires
        [ ab:order 1 ; ab:of "thing" ; ab:attribute w:switchable ; ab:value true ;
          ab:message "{thing} cannot be switched" ] ;
    ab:effect \"\"\"DELETE { ?thing w:on ?was } INSERT { ?thing w:on ?new }
                 WHERE { OPTIONAL { ?thing w:on ?was }
                         BIND(COALESCE(?state, !COALESCE(?was, false)) AS ?new) }\"\"\" .

w:light a ab:Action ; rdfs:label "light" ; ab:order 9 ;
    ab:explain "light a thing that burns" ;
    ab:parameters ( [ ab:name "thing" ; ab:class w:part ] ) ;
    ab:effect "INSERT { ?thing w:on true } WHERE {}" .

w:wait a ab:Action ; rdfs:label "wait" ; ab:order 10 ;
    ab:explain "wait for some minutes" ;
    ab:parameters ( [ ab:name "minutes" ; ab:datatype xsd:decimal ;
                      ab:unit "min=1", "minutes=1", "hours=60" ;
                      ab:default "SELECT (5 AS ?minutes) WHERE {}" ] ) .

w:press a ab:Action ; rdfs:label "press" ; ab:order 11 ;
    ab:explain "press a part with a weight" ;
    ab:parameters ( [ ab:name "part" ; ab:class w:part ]
                    [ ab:name "kilos" ; ab:datatype xsd:decimal ; ab:unit "kg=1" ] ) .

w:sell a ab:Action ; rdfs:label "sell" ; ab:order 12 ;
    ab:explain "sell a blessed part; nothing here can bless one" ;
    ab:parameters ( [ ab:name "part" ; ab:class w:part ] ) ;
    ab:requires [ ab:ask "ASK { ?part w:blessed true }" ; ab:message "{part} must be blessed" ] .

w:stretch a ab:Action ; rdfs:label "stretch" ; ab:order 13 ;
    ab:explain "stretch a part between two places; no plan gets it there" ;
    ab:parameters ( [ ab:name "part" ; ab:class w:part ] ) ;
    ab:requires
        [ ab:ask "ASK { ?part w:in ?one, ?other . FILTER(?one != ?other) }" ;
          ab:message "{part} must be in two places" ] .
"""

TASKS = """
ab:task_stool a ab:Task ; rdfs:label "stool" ; ab:alias "wooden stool" ; ab:needs "board" ;
    ab:goal [ ab:ask "ASK { w:board w:drilled true }" ; ab:message "the board has no hole" ] .
"""

ATTRIBUTES = """
w:arm a w:agent .
w:bench a w:furniture ; w:called "bench" ; w:hasDoor false .
w:cupboard a w:furniture ; w:called "cupboard" ; w:hasDoor true .
w:stove a w:furniture ; w:called "stove" ; w:heats true ; w:switchable true ; w:hasDoor false .
w:board a w:part ; w:called "board" ; w:drillable true .
w:plank a w:part ; w:called "plank" .
w:vase a w:part ; w:called "vase" ; w:glass true .
w:anvil a w:part ; w:called "anvil" ; w:heavy true .
w:candle a w:part ; w:called "candle" ; w:switchable false .
w:drill a w:tool ; w:called "drill" ; w:drills true ; w:battery true .
w:saw a w:tool ; w:called "saw" ; w:drills false ; w:battery false .
"""

STATES = """
w:board w:in w:cupboard ; w:drilled false ; w:dry false .
w:plank w:in w:bench .
w:vase w:in w:bench .
w:drill w:in w:bench ; w:charged false .
w:saw w:in w:bench .
w:cupboard w:doorOpen false .
w:stove w:on false .
"""

FILES = {
    "domain.ttl": DOMAIN,
    "actions.ttl": ACTIONS,
    "tasks.ttl": TASKS,
    "attributes.ttl": ATTRIBUTES,
    "state.ttl": STATES,
}

GOOD = "take_part(board)\nput(board, bench)\ndrill_hole(board, drill)"
"""A plan for a stool, with nothing wrong that the tool cannot mend from the graph alone."""


def workshop(**extra: str) -> Kg:
    """Load the workshop; `attributes="…"` adds Turtle to that file."""
    return load_kg(
        {
            name: (PREFIXES + text + extra.get(name.removesuffix(".ttl"), "")).encode()
            for name, text in FILES.items()
        },
        "workshop",
    )


def replaced(file: str, old: str, new: str) -> Kg:
    """Load the workshop with one passage of one file changed."""
    return changed((file, old, new))


def changed(*changes: tuple[str, str, str]) -> Kg:
    """Load the workshop with passages of its files changed: file, old text, new text."""
    files = dict(FILES)
    for file, old, new in changes:
        assert old in files[file], f"{old!r} is not in {file}"
        files[file] = files[file].replace(old, new)
    return load_kg({name: (PREFIXES + text).encode() for name, text in files.items()}, "workshop")


def call(text: str) -> Call:
    """Read `action(a, b)`."""
    name, _, rest = text.strip().partition("(")
    args = (arg.strip() for arg in rest.rstrip().removesuffix(")").split(","))
    return Call(name, tuple(arg for arg in args if arg))


def parsed(text: str) -> Parsed:
    """Read a plan of plain lines; the parser of models' texts has tests of its own."""
    lines = [(n, line) for n, line in enumerate(text.splitlines(), start=1) if "(" in line]
    return Parsed(tuple(Written(call(line), line.strip(), n, 1) for n, line in lines))


def scene(kg: Kg | None = None, *required: str, **known: tuple[Related, ...]) -> Scene:
    """A scene with required items and word knowledge."""
    return Scene(kg or workshop(), Task("work", required), dict(known))


def related(word: str, relation: Relation, distance: int = 0, sense: int = 1) -> Related:
    """What a lexicon would say."""
    return Related(word, relation, distance, sense, "noun.artifact", "")


def facts(kg: Kg) -> set[Triple]:
    """Everything that the graph says, to tell whether it has changed."""
    return set(kg.facts.triples((None, None, None)))


def named(items: Iterable[str]) -> set[str]:
    """IRIs of the workshop, from their last parts."""
    return {W + item for item in items}
