"""Several processes that learn at once lose nothing, and the later of two that differ is told."""

import itertools
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session import sources
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import ORIGIN, begun, ex, files, item, keeper, learned
from tests.adapters.store.kills import at_one

pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs fork")
PROCESSES, COMMITS, TURNS = 8, 25, 8
PLACES = ["fridge", "table", "sink", "stove", "oven", "cabinet", "rack", "countertop"]


def in_processes(work: Callable[[int], Any], count: int) -> list[Any]:
    """Let forked processes work at once; return what each of them came to."""
    begin, go = os.pipe()
    pipes = []
    for number in range(count):
        listen, tell = os.pipe()
        if os.fork() == 0:
            try:
                os.close(go)
                os.read(begin, 1)  # until all of them are there
                os.write(tell, json.dumps(work(number)).encode())
            finally:
                os._exit(0)
        os.close(tell)
        pipes.append(listen)
    os.close(begin)
    os.close(go)
    found = []
    for listen in pipes:
        with os.fdopen(listen, "rb") as pipe:
            found.append(json.loads(pipe.read() or b'"died"'))
    for _ in range(count):
        os.wait()
    return found


def test_eight_processes_with_25_commits_each(tmp_path: Path) -> None:
    """200 commits, no lost fact, no corrupt file; one place of the shared thing, seven told."""
    root = tmp_path / "home"
    shared = item("shared", "fridge").lessons[0].delta.added
    keeper(root).keep(learned(*shared - {(ex("shared"), ex("obj_location"), ex("fridge"))}))
    repo = Repo.open_or_init(root)
    before = sum(1 for _ in repo.log())

    def work(number: int) -> list[str]:
        one = Keeper(root, "kitchen", ORIGIN)
        told = []
        for turn in range(COMMITS):
            one.keep(item(f"thing_{number}_{turn}", PLACES[turn % len(PLACES)]))
            if turn == COMMITS // 2:
                try:
                    one.keep(learned((ex("shared"), ex("obj_location"), ex(PLACES[number]))))
                    told.append("kept")
                except KnowledgeError as error:
                    told.append(str(error))
        return told

    results = [said for [said] in in_processes(work, PROCESSES)]
    start = begun(root)
    names = [f"thing_{p}_{t}" for p in range(PROCESSES) for t in range(COMMITS)]
    assert [name for name in names if not start.kg.find(name)] == []
    assert all(
        (ex(f"thing_{p}_{t}"), ex("obj_location"), ex(PLACES[t % len(PLACES)])) in start.kg.facts
        for p in range(PROCESSES)
        for t in range(COMMITS)
    )
    commits = list(repo.log())
    assert len(commits) == before + PROCESSES * COMMITS + 1
    told = {value for c in commits for key, value in c.trailers if key.startswith("Fact")}
    assert {f"+ {name} obj_name {name}" for name in names} <= told
    assert start.edited == () and faults(start.kg) == []
    [place] = start.kg.facts.objects(ex("shared"), ex("obj_location"))
    assert results.count("kept") == 1
    refused = [said for said in results if said != "kept"]
    assert all("shared: place (obj_location) has 2 values" in said for said in refused)
    assert all(str(place).rsplit("/", 1)[-1] in said for said in refused)
    if shutil.which("git"):
        subprocess.run(["git", "fsck", "--strict"], cwd=root, check=True, capture_output=True)


@pytest.mark.skipif(shutil.which("git") is None, reason="there is no git binary here")
def test_writers_beside_plain_git_commits_lose_nothing(tmp_path: Path) -> None:
    """Two that learn, two people at `git commit`: all of it is there, and index, files and HEAD
    say the same in the end."""
    root = tmp_path / "home"
    keeper(root)
    before = len(list(Repo.open_or_init(root).log()))

    def git(*args: str) -> bool:
        named = ["git", "-c", "user.name=User", "-c", "user.email=user@example.org", *args]
        return subprocess.run(named, cwd=root, capture_output=True).returncode == 0

    def work(number: int) -> str:
        if number < 2:
            one = Keeper(root, "kitchen", ORIGIN)
            for turn in range(TURNS):
                one.keep(item(f"thing_{number}_{turn}", "fridge"))
            return "learned"
        for turn in range(TURNS):
            note = f"note_{number}_{turn}"
            (root / note).write_text(note)
            tries = iter(range(1_000))  # git does not wait for a lock
            while not (git("add", note) and git("commit", "-q", "-m", note, "--", note)):
                next(tries)
        return "committed"

    assert in_processes(work, 4) == ["learned"] * 2 + ["committed"] * 2
    kg, repo = begun(root).kg, Repo.open_or_init(root)
    turns = range(TURNS)
    assert all(kg.find(f"thing_{number}_{turn}") for number in (0, 1) for turn in turns)
    notes = [f"note_{number}_{turn}" for number in (2, 3) for turn in turns]
    assert [note for note in notes if repo.read(note, "HEAD") != note.encode()] == []
    assert len(list(repo.log())) == before + 4 * TURNS
    assert at_one(root)
    status = subprocess.run(["git", "status", "--porcelain"], cwd=root, capture_output=True)
    assert status.stdout == b""
    assert git("fsck", "--strict")


def test_who_waits_for_a_commit_under_way_says_so_and_not_for_ever(tmp_path: Path) -> None:
    keeper(tmp_path)
    repo, intent = Repo.open_or_init(tmp_path), tmp_path / ".git/adaptbot/intent.json"
    with repo.writing():
        intent.write_bytes(b"{}")
        command = [sys.executable, "-m", "adaptbot_cli", "kg", "show", "--workspace", tmp_path]
        reader = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert reader.stderr and b"another adaptbot is writing" in reader.stderr.readline().lower()
        intent.unlink()
        with pytest.raises(KnowledgeError, match="stopped"), repo.writing(timeout=0):
            pass
    assert b"egg" in reader.communicate()[0] and reader.returncode == 0


def test_a_run_that_started_before_another_learned_keeps_what_both_learned(tmp_path: Path) -> None:
    root = tmp_path / "home"
    one, two = keeper(root), keeper(root)
    one.keep(item("leek", "fridge"))
    two.keep(item("chard", "fridge"))
    one.keep(item("okra", "fridge"))
    kg = begun(root).kg
    assert all(kg.find(name) for name in ("leek", "chard", "okra"))


def test_who_waits_comes_before_who_lets_go_and_wants_it_again(tmp_path: Path) -> None:
    repo = Repo.open_or_init(tmp_path)
    turns = tmp_path / "turns"
    turns.write_text("")

    def work(number: int) -> None:
        for _ in range(90):
            with repo.writing():
                turns.write_text(f"{turns.read_text()}{number}")
                time.sleep(0.002)

    in_processes(work, 3)
    assert sorted(turns.read_text()) == sorted("012" * 90)
    first = turns.read_text()[:135]
    assert max(len(list(run)) for _, run in itertools.groupby(first)) < 60


def test_a_reader_never_sees_half_of_a_change(tmp_path: Path) -> None:
    """What is read while others write is one revision: never a thing without its place."""
    root = tmp_path / "home"
    keeper(root)

    def work(number: int) -> str:
        if number == 0:
            one = Keeper(root, "kitchen", ORIGIN)
            for turn in range(40):
                one.keep(item(f"thing_{turn}", "fridge"))
            return "wrote"
        for _ in range(60):
            kg = sources.load(Workspace(root), "kitchen")
            for turn in range(40):
                known = bool(kg.find(f"thing_{turn}"))
                if known != ((ex(f"thing_{turn}"), ex("obj_location"), ex("fridge")) in kg.facts):
                    return f"half of thing_{turn}"
        return "whole"

    assert in_processes(work, 2) == ["wrote", "whole"]


def test_the_same_facts_are_the_same_bytes_whatever_the_hash_seed(tmp_path: Path) -> None:
    """Processes with other orders of their sets write the same files, trees and commits."""
    script = (
        "import sys; from pathlib import Path\n"
        "from rdflib import Literal\n"
        "from tests.adapters.store.homes import *\n"
        "one = keeper(Path(sys.argv[1]))\n"
        "one.keep(item('leek', 'fridge'))\n"
        "both = item('okra', 'fridge'), item('chard', 'table')\n"
        "facts = {t for turn in both for t in turn.lessons[0].delta.added}\n"
        "one.keep(learned(*facts, (ex('leek'), ex('IsBig'), Literal(True))))\n"
    )
    top = Path(__file__).parents[3]
    found = []
    for seed in ("0", "1", "4711"):
        root = tmp_path / seed
        environment = {**os.environ, "PYTHONHASHSEED": seed, "GIT_CONFIG_GLOBAL": os.devnull}
        subprocess.run(
            [sys.executable, "-c", script, str(root)], cwd=top, env=environment, check=True
        )
        found.append((files(root), Repo.open_or_init(root).head()))
    assert found[0] == found[1] == found[2]
    assert b"ex:chard" in found[0][0]["attributes.ttl"]
