"""Published graphs are taken in as they are: what fits, nothing else, and come out the same."""

import json
from pathlib import Path
from typing import Any

import pytest
from rdflib import RDF, RDFS, Graph
from rdflib.compare import isomorphic

from adaptbot_cli.core.graph.terms import DATATYPES, local
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.session import change, packs, queries
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.validation import validate
from adaptbot_cli.workspace import Workspace
from tests.packs import PUBLISHED

GRAPHS = PUBLISHED / "kg"
INDEX: list[dict[str, Any]] = (
    json.loads((GRAPHS / "kg-index.json").read_text(encoding="utf-8")) if GRAPHS.is_dir() else []
)
needs_graphs = pytest.mark.skipif(not INDEX, reason="no published graphs (ADAPTBOT_PUBLISHED)")
EX = "http://example.org/"


def home(root: Path, file: str = "") -> Home:
    return Home(Workspace(root), "household" if file.startswith("cleaning") else "kitchen")


def without_declarations(path: Path) -> Graph:
    """Return what a published graph says of things, read by rdflib alone."""
    graph = Graph().parse(path, format="turtle")
    for kind in (RDFS.Class, RDF.Property):
        for subject in list(graph.subjects(RDF.type, kind)):
            graph.remove((subject, None, None))
    return graph


@needs_graphs
@pytest.mark.parametrize("entry", INDEX, ids=lambda entry: str(entry["file"]))
def test_a_published_graph_comes_out_as_it_was_taken_in(
    tmp_path: Path, entry: dict[str, Any]
) -> None:
    path = GRAPHS / entry["file"]
    here = home(tmp_path, entry["file"])
    parcel, proposal = queries.imported(here, [path], replace=True)
    assert sorted(parcel.oddities) == sorted(entry["problems"])
    assert len(parcel.declarations) == entry["declaration_triples"]
    if entry["file"].startswith("example.attribute-graph"):
        # It has no robot, on which the pack's actions rest: it can only stand beside what is known.
        with pytest.raises(KnowledgeError, match="robot_arm"):
            change.commit(here, proposal)
        parcel, proposal = queries.imported(here, [path], replace=False)
        assert change.commit(here, proposal)
        assert parcel.accepted <= home(tmp_path, entry["file"]).facts
        return
    revision = change.commit(here, proposal)
    assert revision == home(tmp_path, entry["file"]).needed().repo.head()

    given = without_declarations(path)
    for triple in parcel.left_out:
        assert triple in given
        given.remove(triple)
    assert len(parcel.left_out) <= 3 and len(given) == len(parcel.accepted)
    for form in ("turtle", "nt", "json-ld", "xml"):
        data = queries.exported(here, form, "merged")
        assert isomorphic(Graph().parse(data, format=form), given), form


@needs_graphs
def test_what_is_left_out_is_told_with_its_reason() -> None:
    here = home(Path("nowhere"))
    parcel, _ = queries.imported(here, [GRAPHS / "example.initial.d65fe35.ttl"], replace=True)
    assert sorted(parcel.left_out.values()) == [
        "agent_location is not declared in domain.ttl",
        "slicing board (used_for_slicing) has 2 values: false and true",
        "slicing board (used_for_slicing) has 2 values: false and true",
    ]


@needs_graphs
def test_beside_what_is_known_only_what_the_file_tells_changes(tmp_path: Path) -> None:
    here = home(tmp_path)
    path = GRAPHS / "cooking.initial.d65fe35.ttl"
    parcel, proposal = queries.imported(here, [path], replace=False)
    change.commit(here, proposal)
    now = home(tmp_path)
    assert parcel.accepted <= now.facts
    told = {(s, p) for s, p, _ in parcel.accepted}
    assert all((s, p) in told for s, p, _ in here.facts - now.facts)
    assert now.kg.find("egg") and "robot_arm is a hand here" in str(parcel.left_out.values())


BROKEN = {
    "no turtle": ("ex:egg ex:place", "no valid graph"),
    "no text": ("\x00\x01", "no valid graph"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_no_graph_is_refused(tmp_path: Path, name: str) -> None:
    text, told = BROKEN[name]
    path = tmp_path / "odd.ttl"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(KnowledgeError, match=told):
        queries.imported(home(tmp_path / "home"), [path], replace=False)
    with pytest.raises(KnowledgeError, match="cannot read"):
        queries.imported(home(tmp_path / "home"), [tmp_path / "none.ttl"], replace=False)


ODD = {
    "unknown predicate": ('ex:egg ex:colour "white" .', "colour is not declared"),
    "unknown class": ("ex:ghost a ex:spirit .", "spirit is no class of domain.ttl"),
    "without a kind": ("ex:ghost ex:obj_location ex:fridge .", "nothing says what it is"),
    "without a name": ("ex:ghost a ex:object .", "lacks its name"),
    "wrong range": ("ex:egg ex:Boilable 7 .", "Boilable) must be a boolean"),
    "no such place": ("ex:egg ex:obj_location ex:moon .", "is moon, which is nothing known"),
    "wrong place": ("ex:egg ex:obj_location ex:onion .", "onion is not"),
    "wrong thing": ("ex:egg ex:deep_rec true .", "deep_rec) is for"),
    "another kind": ('ex:egg a ex:tool ; ex:tool_name "egg" .', "egg is an ingredient"),
    "two values": ("ex:egg ex:Boilable true, false .", "has 2 values: false and true"),
    "in itself": ("ex:bowl ex:mrec_location ex:bowl .", "is in itself: bowl in bowl"),
    "in a circle": (
        "ex:bowl ex:mrec_location ex:pan . ex:pan ex:mrec_location ex:bowl .",
        "is in itself: bowl in pan in bowl",
    ),
    "without an IRI": ("[] a ex:object .", "IRI of its own"),
}


@pytest.mark.parametrize("name", ODD)
def test_what_does_not_fit_is_left_out(tmp_path: Path, name: str) -> None:
    text, told = ODD[name]
    path = tmp_path / "odd.ttl"
    path.write_text(f"@prefix ex: <{EX}> .\n{text}\n", encoding="utf-8")
    parcel, proposal = queries.imported(home(tmp_path / "home"), [path], replace=False)
    assert any(told in reason for reason in parcel.left_out.values()), parcel.left_out
    left = {(s, p) for s, p, _ in parcel.left_out}
    assert not left & {(s, p) for s, p, _ in proposal.delta.added}


VALUES = {
    "boolean": "true",
    "string": "heavy",
    "integer": "3",
    "decimal": "1.75",
    "double": "1.5e0",
    "float": "1.5",
    "date": "2024-05-31",
    "dateTime": "2024-05-31T12:00:00Z",
}


@pytest.mark.parametrize("datatype", [local(iri) for iri in DATATYPES])
def test_a_value_of_any_datatype_comes_back(tmp_path: Path, datatype: str) -> None:
    workspace = Workspace(tmp_path / "robot")
    packs.start(workspace, "starting")
    pack = workspace.root / "kg" / "starting"
    value = f'"{VALUES[datatype]}"^^xsd:{datatype}'
    for file, more in (
        ("domain.ttl", f"rdfs:domain ex:thing ; rdfs:range xsd:{datatype} ; ab:graph ab:attribute"),
        ("attributes.ttl", ""),
    ):
        said = f"ex:extra a rdf:Property ; {more} ." if more else f"ex:vase ex:extra {value} ."
        with (pack / file).open("a", encoding="utf-8") as out:
            out.write(f"\n@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n{said}\n")
    assert validate(workspace, "starting") == []
    here = Home(workspace, "starting")
    path = tmp_path / "all.ttl"
    path.write_bytes(queries.exported(here, "turtle", "merged"))
    parcel, proposal = queries.imported(here, [path], replace=True)
    assert not parcel.left_out and not proposal.delta


@needs_graphs
def test_what_tasks_name_and_an_import_leaves_out_is_a_hint_each_thing_once(
    tmp_path: Path,
) -> None:
    here = home(tmp_path)
    path = GRAPHS / "cooking.initial.head.ttl"
    _, proposal = queries.imported(here, [path], replace=True)
    assert change.commit(here, proposal)
    told = validate(here.workspace, "kitchen")
    assert told and all(wrong.hint and wrong.file.endswith("tasks.ttl") for wrong in told)
    things = [wrong.message.split(" is not in ")[0] for wrong in told]
    assert len(things) == len(set(things)) and {"egg", "rice"} <= set(things)
    assert not any("brioche" in wrong.remedy for wrong in told)


@pytest.mark.parametrize(
    ("text", "update", "told"),
    [
        ("DELETE WHERE { ex:egg ?p ?o }", False, "this is an update, .*--update makes it"),
        ("ASK { ex:egg ?p ?o }", True, "this is a query"),
        (
            "ASK { ex:egg foo:p ?o }",
            False,
            "prefix foo: is not known; .* ab:, ex:, rdf:, rdfs: and",
        ),
        ("INSERT DATA { ex:egg foo:p 1 }", True, "prefix foo: is not known"),
    ],
)
def test_a_query_of_the_wrong_form_is_told(
    tmp_path: Path, text: str, update: bool, told: str
) -> None:
    with pytest.raises(UsageError, match=told):
        (queries.update if update else queries.query)(home(tmp_path), text)


def test_columns_stand_as_in_the_query(tmp_path: Path) -> None:
    text = "SELECT * { ?z ex:obj_name ?b FILTER(?b = 'egg') OPTIONAL { ?z ex:obj_location ?a } }"
    found = queries.query(home(tmp_path), text)
    assert found.variables == ("z", "b", "a")
    assert json.loads(found.json)["head"]["vars"] == ["z", "b", "a"]
    assert [str(value) for value in found.rows[0]] == [f"{EX}egg", "egg", f"{EX}fridge"]
