"""Small readings of a pack's SPARQL, and the graph that is asked with it."""

import pytest
from rdflib import RDF, Graph, Literal, URIRef, Variable

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.sparql import (
    bindable,
    form_of,
    in_order,
    is_plain,
    mentions,
    prefixed,
    reaches_out,
    split_update,
    template,
    unknown_prefixes,
    variables,
)
from adaptbot_cli.core.graph.terms import Triple
from tests.worlds import PREFIXES, W, facts, workshop

PREFIX = f"PREFIX w: <{W}> "
STRING = URIRef("http://www.w3.org/2001/XMLSchema#string")


def w(name: str) -> URIRef:
    return URIRef(W + name)


@pytest.mark.parametrize(
    ("text", "form"),
    [
        ("DELETE WHERE { ?s ?p ?o }", "update"),
        ("# SELECT\nprefix x: <urn:x#> BASE <urn:y> insert data { x:a x:b x:c }", "update"),
        ("PREFIX : <urn:x> ASK { ?delete :insert 'DELETE' }", "query"),
        ("describe <urn:x>", "query"),
        ("?x", ""),
        ("", ""),
    ],
)
def test_what_a_text_begins_as(text: str, form: str) -> None:
    assert form_of(text) == form


@pytest.mark.parametrize(
    ("text", "unknown"),
    [
        ("ASK { ?s foo:a ?o ; w:b bar:c, foo:d }", ["foo", "bar"]),
        ("PREFIX foo: <x:y> ASK { ?s foo:a 'no:pe' . _:b w:c <a:b> } # so:so", []),
        ("ASK { ?s :a ?o }", [""]),
        ("PREFIX : <x:y> ASK { ?s :a ?o }", []),
    ],
)
def test_unknown_prefixes(text: str, unknown: list[str]) -> None:
    assert unknown_prefixes(text, {"w"}) == unknown


@pytest.mark.parametrize(
    ("query", "named"),
    [
        ("SELECT * { ?z w:p ?a . ?a w:p ?b }", "SELECT  ?z ?a ?b  { ?z w:p ?a . ?a w:p ?b }"),
        ("select distinct *{ ?b w:p ?a }", "select distinct  ?b ?a { ?b w:p ?a }"),
        ("SELECT ?a { { SELECT * { ?z w:p ?a } } }", ""),
        ("SELECT (COUNT(*) AS ?a) { ?z w:p ?b }", ""),
    ],
)
def test_columns_stand_in_the_order_of_the_query(query: str, named: str) -> None:
    assert in_order(query, variables(query)) == (named or query)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("DELETE { a } INSERT { b } WHERE { c }", ("a", "b", "c")),
        ("insert { b } where { c }", ("", "b", "c")),
        ("DELETE { a } WHERE { c }", ("a", "", "c")),
        ("DELETE { a }\nINSERT{b}WHERE{ { c } UNION { d } }", ("a", "b", "{ c } UNION { d }")),
        ("INSERT { a '}' } WHERE {}", ("", "a '}'", "")),
        ('INSERT { a """ } { """ } WHERE {}', ("", 'a """ } { """', "")),
        ("INSERT { a } # not this: }\nWHERE { <x}y> }", ("", "a", "<x}y>")),
    ],
)
def test_an_update_is_split_into_its_groups(text: str, parts: tuple[str, str, str]) -> None:
    assert split_update(text) == parts


@pytest.mark.parametrize(
    "text",
    [
        "",
        "INSERT DATA { a }",
        "INSERT { a }",
        "WHERE { a }",
        "DELETE WHERE { a }",
        "DROP ALL",
        "INSERT { a } WHERE { b",
        "INSERT { a } USING { g } WHERE { b }",
    ],
)
def test_another_form_of_update_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"m(ust|ay)"):
        split_update(text)


def test_only_the_prefixes_that_a_query_uses_are_put_before_it() -> None:
    graph = Graph(bind_namespaces="none").parse(data=PREFIXES, format="turtle")
    assert prefixed(graph, "ASK { ?a w:in 'ab:no' } # rdf:no") == PREFIX


def test_what_a_query_mentions_and_its_variables() -> None:
    mentioned = mentions(PREFIX + "ASK { ?a w:in w:bench . FILTER(?a != 'w:no') }")
    assert mentioned == {w("in"), w("bench")}
    assert variables("ASK { ?agent w:holds ?a . ?a a ?class }") == {"agent", "a", "class"}


def test_only_a_plain_query_is_answered_without_the_clock() -> None:
    bound = frozenset({"a"})
    assert is_plain("ASK { FILTER NOT EXISTS { ?a w:in ?b . FILTER(?b != ?a) } }", bound)
    assert not is_plain("ASK { ?a w:in ?b . ?c w:in ?a }", bound), "two may be anything"
    assert not is_plain("ASK { ?a w:in [ w:in ?b ] }", bound), "so may a blank node"
    assert not is_plain("ASK " + "{ " * 20 + "?a w:in ?b" + " }" * 20, bound)
    assert not is_plain("ASK { ?a w:in ?b }" + " " * 2_000, bound)


@pytest.mark.parametrize(
    ("query", "values", "holds"),
    [
        # A variable that stands in a filter alone can be bound, too.
        (
            "ASK { FILTER NOT EXISTS { ?agent w:holds ?thing } }",
            {"agent": "arm"},
            True,
        ),
        ("ASK { FILTER NOT EXISTS { ?thing w:in ?spot } }", {"thing": "plank"}, False),
        ("ASK { FILTER(?a != ?b) }", {"a": "plank", "b": "board"}, True),
        ("ASK { FILTER(?a != ?b) }", {"a": "plank", "b": "plank"}, False),
        # One that is not bound stands for anything, and what a query does not know is left out.
        ("ASK { ?thing w:in ?spot }", {"spot": "bench"}, True),
        ("ASK { ?thing w:in ?spot }", {"spot": "stove"}, False),
        ("ASK { w:plank w:in w:bench }", {}, True),
        ("ASK { w:plank w:in w:bench }", {"other": "board"}, True),
    ],
)
def test_a_query_is_asked_of_the_values_it_is_given(
    query: str, values: dict[str, str], holds: bool
) -> None:
    given = {name: w(value) for name, value in values.items()}
    assert workshop().ask(bindable(PREFIX + query), given) is holds
    if "?" not in query:
        assert bindable(PREFIX + query) == PREFIX + query


@pytest.mark.parametrize("where", ["WHERE ", ""])
def test_a_select_can_be_bound_by_a_variable_that_it_does_not_name(where: str) -> None:
    query = bindable(f"{PREFIX}SELECT ?thing {where}{{ ?thing w:in ?spot }} ORDER BY ?thing")
    rows = workshop().rows(query, {"spot": w("cupboard")})
    assert [row["thing"] for row in rows] == [w("board")]
    assert workshop().first(query, "thing", {"spot": w("cupboard")}) == w("board")


@pytest.mark.parametrize(
    ("text", "triples"),
    [
        (
            "?a w:in ?b ; w:on true",
            [(Variable("a"), w("in"), Variable("b")), (Variable("a"), w("on"), Literal(True))],
        ),
        (" ", []),
        (
            "<urn:x?y> w:called 'who?me'",  # no variable stands in a text or an IRI
            [(URIRef("urn:x?y"), w("called"), Literal("who?me", datatype=STRING))],
        ),
    ],
)
def test_a_template_keeps_its_variables(text: str, triples: list[tuple[object, ...]]) -> None:
    assert list(template(PREFIX, text)) == triples


SAW = (w("saw"), w("in"), w("bench"))
DOOR = (w("cupboard"), w("doorOpen"))


@pytest.mark.parametrize(
    ("action", "values", "removed", "added"),
    [
        ("take_tool", {"tool": "saw"}, {SAW}, {(w("arm"), w("holds"), w("saw"))}),
        # A triple with a variable that has no value is left out.
        ("take_tool", {"tool": "gadget"}, set(), {(w("arm"), w("holds"), w("gadget"))}),
        ("open", {"spot": "cupboard"}, {(*DOOR, Literal(False))}, {(*DOOR, Literal(True))}),
        ("light", {"thing": "candle"}, set(), set()),  # it is lit already
        ("wait", {}, set(), set()),
    ],
)
def test_an_effect_says_what_it_would_change_and_changes_nothing(
    action: str, values: dict[str, str], removed: set[Triple], added: set[Triple]
) -> None:
    kg = workshop(state="w:candle w:on true .")
    before = facts(kg)
    given = {"agent": w("arm"), **{name: w(value) for name, value in values.items()}}
    changed = kg.delta(kg.domain.actions[action].effect, given)
    assert (changed.removed, changed.added) == (removed, added)
    assert facts(kg) == before


def test_names_and_classes_are_worked_out_again_after_a_lesson() -> None:
    kg = workshop()
    assert (kg.find("vise"), kg.name(w("vise")), kg.classes(w("vise"))) == ((), "vise", frozenset())
    taught = {(w("vise"), w("called"), Literal("bench_vise")), (w("vise"), RDF.type, w("tool"))}
    kg.learn(Delta(added=frozenset(taught)))
    assert kg.find("bench vise") == (w("vise"),)
    assert kg.name(w("vise")) == "bench_vise"
    assert kg.is_a(w("vise"), [w("thing")])


def test_things_of_a_class_include_those_of_its_subclasses() -> None:
    kg = workshop()
    assert w("saw") in kg.instances([w("thing")])
    assert w("saw") not in kg.instances([w("part")])


def test_the_size_counts_things_and_facts_but_nothing_of_the_tools_own() -> None:
    kg = workshop()
    nodes, edges = kg.size()
    kg.learn(Delta(added=frozenset({(w("plank"), URIRef("urn:adaptbot:alias"), Literal("slab"))})))
    assert kg.size() == (nodes, edges) == (11, 44)


OUTSIDE = (
    "SELECT * { SERVICE <http://x/> { ?s ?p ?o } }",
    "SELECT * { service silent<http://x/> {} }",
    "SELECT * { SERVICE # a comment\n <http://x/> {} }",
    "SELECT * { SERVICE SILENT ex:there {} }",
    "SELECT * { SERVICE ?where {} }",
    "SELECT * { \\u0053ERVICE <http://x/> {} }",
    "SELECT * { BIND(''' ' ''' AS ?x) SERVICE <http://x/> {} } # '",
    "LOAD <http://x/>",
    "DELETE WHERE { ?s ?p ?o } ; LOAD SILENT <http://x/> INTO GRAPH <x:y>",
    "SELECT * { ?s ?p ?o FILTER(?s<?o)SERVICE ex:there#>\n{} }",
    "SELECT * { ?s ?p ?o FILTER NOT EXISTS { SERVICE \u10300:there {} } }",
    "DELETE {} INSERT { ?a ?b ?c } WHERE { SERVICE <http://x/> { ?a ?b ?c } }",
)
INSIDE = (
    "SELECT ?service WHERE { ?service ex:load ?load }",
    'SELECT * { ?s ex:obj_name "service" }',
    "SELECT * { ?s ex:service <http://x/> }",
    "ASK { ?s ?p ex:load }",
    "SELECT * { ?s :service ?o }",
    "SELECT * { ?from ex:loaded 'SERVICE <http://x/> {}' } # FROM <http://x/>",
)


@pytest.mark.parametrize("text", [*OUTSIDE, *INSIDE])
def test_what_would_reach_the_network_is_seen_and_nothing_else(text: str) -> None:
    assert (reaches_out(text) in ("SERVICE", "LOAD")) == (text in OUTSIDE)
    assert (reaches_out(text) == "") == (text in INSIDE)


@pytest.mark.parametrize(
    "text",
    [
        "SELECT * { ?s ?p trueSERVICE<http://x/>{} }",
        "SELECT * { SERVICEex:there {} }",
        "SELECT * { SERVICE",
    ],
)
def test_what_cannot_be_parsed_is_not_trusted(text: str) -> None:
    """The engine reads the first two as SERVICE."""
    with pytest.raises(ValueError, match="no valid SPARQL"):
        reaches_out(text)
