"""Files of strangers: each is refused in one sentence, soon, and takes nothing with it."""

import os
import shutil
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from adaptbot_cli import bounded
from adaptbot_cli.adapters.planner.library import read_plan
from adaptbot_cli.errors import AdaptbotError, KnowledgeError, PackError, UsageError
from tests.cli.command import ROOT, Ended, Home
from tests.hostile import bombs
from tests.loopback import serving

HERE = Path(__file__).parent
CONDITIONS = sorted((HERE / "conditions").glob("*.rq"))
QUERIES = sorted((HERE / "queries").glob("*.rq"))
PLANS = sorted((HERE / "plans").glob("*.plan"))
GRAPHS = sorted((HERE / "graphs").iterdir())
TRANSCRIPTS = sorted((HERE / "transcripts").glob("*.yaml"))


def refused(ended: Ended, code: int) -> None:
    """Make sure that a command has ended with one sentence."""
    assert ended.code == code, ended.said[-500:]
    sentences = [line for line in ended.err.splitlines() if line.startswith("error: ")]
    assert len(sentences) == 1 and "Traceback" not in ended.err


def add_action(home: Home, query: str) -> None:
    """Make a workspace with a pack whose action `odd` has a condition."""
    pack = home.workspace / "kg" / "kitchen"
    shutil.copytree(ROOT / "kg" / "kitchen", pack)
    told = query.replace("\\", "\\\\").replace("\r", "\\r")
    with (pack / "actions.ttl").open("a", encoding="utf-8") as file:
        file.write(
            'ex:Odd a ab:Action ; rdfs:label "odd" ; ab:explain "odd" ; ab:order 99 ; '
            f'ab:requires [ ab:order 1 ; ab:message "m" ; ab:ask """{told}""" ] .\n'
        )


def test_a_condition_that_never_ends(home: Home) -> None:
    """Its patterns share no variable; it ends when the plan has the action, by the clock."""
    patterns = " ".join(f"?s{i} ?p{i} ?o{i} ." for i in range(8))
    add_action(home, f"ASK {{ {patterns} FILTER(?o0 = ?o1 && ?o2 = ?o3 && ?o7 = ?none) }}")
    ended = home.adaptbot("check", "-", stdin=b"odd()")
    refused(ended, 4)
    assert "did not end in 10 s" in ended.said


CLOCK = "endless-without-a-graph"  # its ten seconds pass in `test_a_condition_that_never_ends`, too


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=[pytest.mark.slow] * (p.stem == CLOCK), id=p.stem) for p in CONDITIONS],
)
def test_a_condition_of_a_pack(home: Home, path: Path) -> None:
    """It is seen when the pack is read; the server that it names is never asked."""
    with serving() as at:
        port = str(at.server_address[1])
        add_action(home, path.read_bytes().decode().replace("PORT", port))
        ended = home.adaptbot("check", "-", stdin=b'pick_up_obj("egg")')
        assert at.asked == []
    refused(ended, 4)
    assert "entry Odd: ab:ask" in ended.said


@pytest.mark.parametrize("name", bombs.PACK)
def test_a_domain(home: Home, name: str) -> None:
    shutil.copytree(ROOT / "kg" / "kitchen", home.workspace / "kg" / "kitchen")
    with (home.workspace / "kg/kitchen/domain.ttl").open("a", encoding="utf-8") as file:
        file.write(bombs.PACK[name])
    refused(home.adaptbot("check", "-", stdin=b'pick_up_obj("egg")'), 4)


@pytest.mark.parametrize("path", QUERIES, ids=lambda path: path.stem)
def test_a_query_to_paste(used: Home, path: Path) -> None:
    with serving() as at:
        port = str(at.server_address[1])
        query = path.read_bytes().decode().replace("PORT", port).encode()
        ended = used.adaptbot("kg", "query", "-", stdin=query)
        assert at.asked == []
    refused(ended, 2)


@pytest.mark.parametrize("path", PLANS, ids=lambda path: path.stem)
def test_a_plan_template(path: Path) -> None:
    with pytest.raises(PackError, match=f"{path.name}.*; correct the template there"):
        read_plan(path).render("make x", ["egg", "oil", "salt"] * 3)


def test_a_graph_to_import(used: Home, tmp_path: Path) -> None:
    files = [*GRAPHS, *(tmp_path / name for name in bombs.GRAPHS)]
    for name, text in bombs.GRAPHS.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    for ended in used.adaptbots([["kg", "import", str(file), "--dry-run"] for file in files]):
        refused(ended, 4)


def test_a_graph_to_check_on(used: Home) -> None:
    paths = [used.write(f"{name}.ttl", text) for name, text in bombs.TURTLE.items()]
    plan = used.write("plan.txt", 'pick_up_obj("egg")')
    for ended in used.adaptbots([["check", plan, "--kg", path] for path in paths]):
        refused(ended, 4)


def test_a_transcript_to_replay(used: Home) -> None:
    bombed = [used.write(f"{name}.yaml", text) for name, text in bombs.YAML.items()]
    paths = [*map(str, TRANSCRIPTS), *bombed]
    for ended in used.adaptbots([["replay", path] for path in paths]):
        refused(ended, 2) if ended.code != 4 else refused(ended, 4)
    assert not (used.folder / "planted").exists()


def test_answers(used: Home) -> None:
    for name, text in bombs.YAML.items():
        if name == "task":
            continue
        with pytest.raises(AdaptbotError):
            bounded.parse_yaml(text.replace("adaptbot: 1\n", ""), name)
    path = used.write("answers.yaml", bombs.YAML["block"])
    refused(used.adaptbot("run", "make tea", "--answers", path, "--dry-run"), 2)


def test_transcripts_that_lie_in_the_folder_are_passed_over(home: Home, seeded: Home) -> None:
    shutil.copytree(seeded.workspace, home.workspace)
    for path in TRANSCRIPTS:
        home.write(f"robot/transcripts/2026-{path.name}", path.read_bytes().decode())
    for name in ("block", "large", "base sixty", "task"):
        home.write(f"robot/transcripts/{name}.yaml", bombs.YAML[name])
    os.mkfifo(home.workspace / "transcripts" / "pipe.yaml")
    assert home.adaptbot("pending").code == 0
    ended = home.adaptbot("resume")
    assert "negative-cost" in ended.said or "nothing to resume" in ended.said
    assert "Traceback" not in ended.err


@pytest.mark.parametrize("name", bombs.TOML)
def test_settings(used: Home, name: str) -> None:
    used.write("robot/adaptbot.toml", bombs.TOML[name])
    refused(used.adaptbot("kg", "stats"), 4)
    (used.workspace / "adaptbot.toml").unlink()


def test_recordings(used: Home) -> None:
    paths = [used.write(f"{name}.jsonl", text) for name, text in bombs.JSON.items()]
    for ended in used.adaptbots([["eval", path] for path in paths]):
        refused(ended, 2)


@pytest.mark.parametrize("name", bombs.PLANS)
def test_the_text_of_a_plan(used: Home, name: str) -> None:
    ended = used.adaptbot("check", "-", stdin=bombs.PLANS[name].encode())
    assert ended.code in (2, 3) and "Traceback" not in ended.err


def test_a_file_without_an_end(used: Home) -> None:
    with pytest.raises(UsageError, match="larger than 2 MB"):
        bounded.read_bytes(Path("/dev/zero"), bounded.PLAN, UsageError, piped=True)
    pipe = used.folder / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(KnowledgeError, match="no regular file"):
        bounded.read_bytes(pipe, bounded.YAML)


def test_who_waits_for_a_pipe_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    os.mkfifo(tmp_path / "pipe")
    with ThreadPoolExecutor() as pool:
        reading = pool.submit(bounded.read_bytes, tmp_path / "pipe", bounded.PLAN, piped=True)
        while "waiting for somebody to write" not in caplog.text:
            time.sleep(0.01)
        (tmp_path / "pipe").write_bytes(b"walk(table)")
        assert reading.result() == b"walk(table)"


def test_the_bundled_packs_and_transcripts_are_within_the_limits() -> None:
    for path in (ROOT / "kg").glob("*/*.ttl"):
        bounded.check_graph(path.read_bytes(), path)
    for path in (ROOT / "transcripts").glob("*.yaml"):
        assert bounded.parse_yaml(bounded.read_text(path, bounded.YAML), path)
