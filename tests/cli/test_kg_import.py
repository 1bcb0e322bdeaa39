"""Published graphs are taken in as they are: what fits, nothing else, and come out the same."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from rdflib import RDF, RDFS, Graph
from rdflib.compare import isomorphic

from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session import changing, querying
from adaptbot_cli.session.knowing import Home
from adaptbot_cli.workspace import Workspace

_DEFAULT = Path(__file__).parents[3] / "shared" / "published"
GRAPHS = Path(os.environ.get("ADAPTBOT_PUBLISHED", _DEFAULT)) / "kg"
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
    parcel, proposal = querying.imported(here, [path], replace=True)
    assert sorted(parcel.oddities) == sorted(entry["problems"])
    assert len(parcel.declarations) == entry["declaration_triples"]
    if entry["file"].startswith("example.attribute-graph"):
        # It has no robot, on which the pack's actions rest: it can only stand beside what is known.
        with pytest.raises(KnowledgeError, match="robot_arm"):
            changing.commit(here, proposal)
        parcel, proposal = querying.imported(here, [path], replace=False)
        assert changing.commit(here, proposal)
        assert parcel.accepted <= home(tmp_path, entry["file"]).facts
        return
    revision = changing.commit(here, proposal)
    assert revision == home(tmp_path, entry["file"]).needed().head()

    given = without_declarations(path)
    for triple in parcel.left_out:
        assert triple in given
        given.remove(triple)
    assert len(parcel.left_out) <= 3 and len(given) == len(parcel.accepted)
    for form in ("turtle", "nt", "json-ld", "xml"):
        data = querying.exported(here.workspace, here.domain, form, "merged")
        assert isomorphic(Graph().parse(data, format=form), given), form


@needs_graphs
def test_what_is_left_out_is_told_with_its_reason() -> None:
    here = home(Path("nowhere"))
    parcel, _ = querying.imported(here, [GRAPHS / "example.initial.d65fe35.ttl"], replace=True)
    assert sorted(parcel.left_out.values()) == [
        "agent_location is not declared in domain.ttl",
        "cutting_board used_for_slicing has 2 values: false, true",
        "cutting_board used_for_slicing has 2 values: false, true",
    ]


@needs_graphs
def test_beside_what_is_known_only_what_the_file_tells_changes(tmp_path: Path) -> None:
    here = home(tmp_path)
    path = GRAPHS / "cooking.initial.d65fe35.ttl"
    parcel, proposal = querying.imported(here, [path], replace=False)
    changing.commit(here, proposal)
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
        querying.imported(home(tmp_path / "home"), [path], replace=False)
    with pytest.raises(KnowledgeError, match="cannot read"):
        querying.imported(home(tmp_path / "home"), [tmp_path / "none.ttl"], replace=False)


ODD = {
    "unknown predicate": ('ex:egg ex:colour "white" .', "colour is not declared"),
    "unknown class": ("ex:ghost a ex:spirit .", "spirit is no class here"),
    "without a kind": ("ex:ghost ex:obj_location ex:fridge .", "nothing says what ghost is"),
    "without a name": ("ex:ghost a ex:object .", "ghost has no name"),
    "wrong range": ("ex:egg ex:Boilable 7 .", "Boilable must be a boolean"),
    "no such place": ("ex:egg ex:obj_location ex:moon .", "nothing says what moon is"),
    "wrong place": ("ex:egg ex:obj_location ex:onion .", "onion is not"),
    "wrong thing": ("ex:egg ex:deep_rec true .", "deep_rec is for"),
    "another kind": ('ex:egg a ex:tool ; ex:tool_name "egg" .', "egg is an ingredient"),
    "two values": ("ex:egg ex:Boilable true, false .", "has 2 values: false, true"),
    "in itself": ("ex:bowl ex:mrec_location ex:bowl .", "bowl would be in itself"),
    "in a circle": (
        "ex:bowl ex:mrec_location ex:pan . ex:pan ex:mrec_location ex:bowl .",
        "would be in itself",
    ),
    "without an IRI": ("[] a ex:object .", "IRI of its own"),
}


@pytest.mark.parametrize("name", ODD)
def test_what_does_not_fit_is_left_out(tmp_path: Path, name: str) -> None:
    text, told = ODD[name]
    path = tmp_path / "odd.ttl"
    path.write_text(f"@prefix ex: <{EX}> .\n{text}\n", encoding="utf-8")
    parcel, proposal = querying.imported(home(tmp_path / "home"), [path], replace=False)
    assert any(told in reason for reason in parcel.left_out.values()), parcel.left_out
    left = {(s, p) for s, p, _ in parcel.left_out}
    assert not left & {(s, p) for s, p, _ in proposal.delta.added}
