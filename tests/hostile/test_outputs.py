"""What a stranger's text does in an output, and what a full disk or an old file does to a run."""

import json
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from rdflib import Graph

from adaptbot_cli.adapters.handbook import sparql
from adaptbot_cli.adapters.store.engine import write_graph
from adaptbot_cli.cli.common import escaped
from adaptbot_cli.errors import KnowledgeError
from tests.cli.command import Home

ODD = "C1 \x9b31m, a turn \u202e, a mark \u200b, a tag \U000e0041, a surrogate \ud800, é, 火"


def test_json_escapes_what_a_terminal_acts_on_or_hides() -> None:
    shown = escaped(json.dumps({"name": ODD}, ensure_ascii=False, indent=2))
    assert json.loads(shown) == {"name": ODD}
    assert "é, 火" in shown and shown.replace("\n", "").isprintable()


def test_json_of_a_command(home: Home) -> None:
    update = 'INSERT DATA { ex:onion ab:alias "a\\u009bb\\u202Ec" }'
    assert home.adaptbot("kg", "query", update, "--update", "--yes").code == 0
    for query in ("SELECT ?n { ex:onion ab:alias ?n }", "CONSTRUCT WHERE { ex:onion ab:alias ?n }"):
        ended = home.adaptbot("kg", "query", query, "--json")
        assert "\\u009b" in ended.out and "\u202e" not in ended.out


def test_a_control_character_is_not_written_as_xml() -> None:
    graph = Graph().parse(data='<x:a> <x:name> "a\\u0001b" .', format="turtle")
    with pytest.raises(KnowledgeError, match=r"U\+0001, which XML cannot hold"):
        write_graph(graph, "xml", {})
    assert b"\\u0001" in write_graph(graph, "nt", {}).lower() or write_graph(graph, "nt", {})


def test_a_fence_is_longer_than_any_in_the_query() -> None:
    lines = sparql("ASK {\n````\n# out?\n}").splitlines()
    assert lines[0] == "`````sparql" and lines[-1] == "`````" and "`````" not in lines[1:-1]


def test_record_writes_over_nothing_unasked(home: Home) -> None:
    path = home.write("thesis.yaml", "the only copy\n")
    run = ("run", "make tea", "--no-human", "--record", path)
    ended = home.adaptbot(*run)
    assert ended.code == 2 and "--force writes over it" in ended.said
    assert Path(path).read_text(encoding="utf-8") == "the only copy\n"
    assert home.adaptbot(*run, "--force").code == 0


def test_an_import_of_which_nothing_is_taken_fails(home: Home) -> None:
    path = home.write("none.ttl", "<x:a> <x:p> 1 .")
    ended = home.adaptbot("kg", "import", path, "--yes")
    assert ended.code == 4 and "nothing of none.ttl was taken" in ended.said
    assert home.adaptbot("kg", "import", path, "--replace", "--yes").code == 4


def test_a_dry_run_judges_as_the_real_one(home: Home) -> None:
    wrong = "INSERT DATA { ex:onion ex:obj_location 7 }"
    real = home.adaptbot("kg", "query", wrong, "--update", "--yes")
    tried = home.adaptbot("kg", "query", wrong, "--update", "--dry-run")
    assert (tried.code, tried.err) == (real.code, real.err) and real.code == 4


def test_a_name_in_a_language_is_a_name(home: Home) -> None:
    leek = 'INSERT DATA { ex:leek a ex:object ; ex:obj_name "leek"@en ; ex:obj_location ex:fridge }'
    ended = home.adaptbot("kg", "query", leek, "--update", "--yes")
    assert ended.code == 0, ended.said
    assert home.adaptbot("kg", "show", "leek").code == 0


@pytest.mark.skipif(sys.platform == "win32", reason="no limits there")
def test_a_full_disk_leaves_no_empty_transcript(home: Home) -> None:
    assert home.adaptbot("run", "make tea", "--no-human", "--dry-run").code == 0
    path = home.folder / "full.yaml"
    run = ["run", "make tea", "--no-human", "--dry-run", "--record", str(path)]
    ended = subprocess.run(
        [sys.executable, "-m", "adaptbot_cli", *run],
        env=home.environment(PYTHONDONTWRITEBYTECODE="1"),
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (10, 10)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 4 and "Traceback" not in ended.stderr
    assert f"cannot write the transcript {path}: File too large" in " ".join(ended.stderr.split())
    assert not path.exists()
