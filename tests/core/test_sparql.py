"""Small readings of a pack's SPARQL, and the graph that is asked with it."""

import pytest
from rdflib import Graph, Literal, URIRef, Variable

from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
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
from tests.worlds import PREFIXES, W, workshop

PREFIX = f"PREFIX w: <{W}> "


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


def test_what_a_query_mentions() -> None:
    assert mentions(PREFIX + "ASK { ?a w:in w:bench . FILTER(?a != 'w:no') }") == {
        w("in"),
        w("bench"),
    }


def test_the_variables_of_a_query() -> None:
    assert variables("ASK { ?agent w:holds ?thing . ?thing a ?class }") == {
        "agent",
        "thing",
        "class",
    }


def ask(query: str, **values: str) -> bool:
    given = {name: w(value) for name, value in values.items()}
    return workshop().ask(bindable(PREFIX + query), given)


def test_only_a_plain_query_is_answered_without_the_clock() -> None:
    bound = frozenset({"a"})
    assert is_plain("ASK { FILTER NOT EXISTS { ?a w:in ?b . FILTER(?b != ?a) } }", bound)
    assert not is_plain("ASK { ?a w:in ?b . ?c w:in ?a }", bound), "two may be anything"
    assert not is_plain("ASK { ?a w:in [ w:in ?b ] }", bound), "so may a blank node"
    assert not is_plain("ASK " + "{ " * 20 + "?a w:in ?b" + " }" * 20, bound)
    assert not is_plain("ASK { ?a w:in ?b }" + " " * 2_000, bound)


def test_a_variable_that_stands_in_a_filter_alone_can_be_bound() -> None:
    query = "ASK { FILTER NOT EXISTS { ?agent w:holds ?thing } }"
    assert ask(query, agent="arm")
    assert not ask("ASK { FILTER NOT EXISTS { ?thing w:in ?spot } }", thing="plank")
    assert ask("ASK { FILTER(?a != ?b) }", a="plank", b="board")
    assert not ask("ASK { FILTER(?a != ?b) }", a="plank", b="plank")


def test_a_variable_that_is_not_bound_stands_for_anything() -> None:
    assert ask("ASK { ?thing w:in ?spot }", spot="bench")
    assert not ask("ASK { ?thing w:in ?spot }", spot="stove")


def test_a_query_without_variables_stays_as_it_is() -> None:
    query = PREFIX + "ASK { w:plank w:in w:bench }"
    assert bindable(query) == query
    assert workshop().ask(query, {})


def test_a_select_can_be_bound_by_a_variable_that_it_does_not_name() -> None:
    query = bindable(PREFIX + "SELECT ?thing WHERE { ?thing w:in ?spot } ORDER BY ?thing")
    rows = workshop().rows(query, {"spot": w("cupboard")})
    assert [row["thing"] for row in rows] == [w("board")]


def test_a_selects_where_may_lack_its_keyword() -> None:
    query = bindable(PREFIX + "SELECT ?thing { ?thing w:in ?spot } ORDER BY ?thing")
    assert workshop().first(query, "thing", {"spot": w("cupboard")}) == w("board")


def test_a_binding_that_a_query_does_not_know_is_left_out() -> None:
    assert workshop().ask(PREFIX + "ASK { w:plank w:in w:bench }", {"other": w("board")})


def test_a_template_keeps_its_variables() -> None:
    assert template(PREFIX, "?a w:in ?b ; w:on true") == (
        (Variable("a"), w("in"), Variable("b")),
        (Variable("a"), w("on"), Literal(True)),
    )


def test_a_template_may_be_empty() -> None:
    assert template(PREFIX, " ") == ()


def test_a_question_mark_in_a_text_or_an_iri_is_no_variable() -> None:
    [triple] = template(PREFIX, "<urn:x?y> w:called 'who?me'")
    assert (str(triple[0]), str(triple[2])) == ("urn:x?y", "who?me")


def delta(kg: Kg, action: str, **values: str) -> Delta:
    given = {"agent": w("arm"), **{name: w(value) for name, value in values.items()}}
    return kg.delta(kg.domain.actions[action].effect, given)


def test_an_effect_says_what_it_would_change_and_changes_nothing() -> None:
    kg = workshop()
    assert delta(kg, "take_tool", tool="saw") == Delta(
        frozenset({(w("saw"), w("in"), w("bench"))}),
        frozenset({(w("arm"), w("holds"), w("saw"))}),
    )
    assert (w("saw"), w("in"), w("bench")) in kg.facts


def test_a_triple_with_a_variable_that_has_no_value_is_left_out() -> None:
    assert not delta(workshop(), "take_tool", tool="gadget").removed


def test_what_holds_already_is_no_change() -> None:
    kg = workshop(state="w:candle w:on true .")
    assert not delta(kg, "light", thing="candle")


def test_an_action_without_an_effect_changes_nothing() -> None:
    assert not delta(workshop(), "wait")


def test_a_functional_value_is_replaced() -> None:
    changed = delta(workshop(), "open", spot="cupboard")
    assert changed.removed == {(w("cupboard"), w("doorOpen"), Literal(False))}
    assert changed.added == {(w("cupboard"), w("doorOpen"), Literal(True))}


def test_names_and_classes_are_worked_out_again_after_a_lesson() -> None:
    kg = workshop()
    assert (kg.find("vise"), kg.name(w("vise")), kg.classes(w("vise"))) == ((), "vise", frozenset())
    facts = {
        (w("vise"), w("called"), Literal("bench_vise")),
        (w("vise"), URIRef("http://www.w3.org/1999/02/22-rdf-syntax-ns#type"), w("tool")),
    }
    kg.learn(Delta(added=frozenset(facts)))
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


@pytest.mark.parametrize("text", OUTSIDE)
def test_what_would_reach_the_network_is_seen(text: str) -> None:
    assert reaches_out(text) in ("SERVICE", "LOAD")


@pytest.mark.parametrize("text", INSIDE)
def test_what_stays_here_is_let_through(text: str) -> None:
    assert reaches_out(text) == ""


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
