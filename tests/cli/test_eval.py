"""`adaptbot eval`, from the outside."""

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from tests.cli.command import Home
from tests.cli.test_check import HOME, TEA
from tests.evaluation.test_published import plant, recording
from tests.loopback import scripted

ARMS = ["llm", "llm+kg", "llm+kg+human"]
M = {
    "n": int,
    "executable": float,
    "goal_met": float,
    "overlap": float,
    "effective_overlap": float,
    "required_lost": int,
    "model_calls": float,
    "prompt_tokens": float,
    "completion_tokens": float,
    "questions": float,
    "prompts": float,
    "nodes": list,
    "edges": list,
    "seconds": float,
}
"""What the design promises of an arm's figures."""


def rows(n: int, *answers: str) -> str:
    told = {
        "model": "gpt-4o",
        "domain": "cooking",
        "task": "make tea",
        "ingredients": ["tea", "water"],
        "trials": {"llm": {"answers": list(answers or (TEA,))}},
    }
    lines = (json.dumps({**told, "id": f"t/{k:03d}", "index": k}) for k in range(n))
    return "\n".join(lines)


def test_the_contract(used: Home) -> None:
    path = used.write("two.jsonl", rows(2, TEA.replace("boil", "simmer"), TEA))
    ended = used.adaptbot("eval", path, "--domain", "kitchen", "--json")
    assert (ended.code, ended.err) == (0, "")
    told = ended.json()
    assert list(told["arms"]) == ARMS
    for figures in told["arms"].values():
        assert figures["n"] == 2
        for name, kind in M.items():
            assert isinstance(figures[name], int if kind is int else (kind, int)), name
    assert [(t["id"], t["arm"]) for t in told["trials"]] == [
        (f"t/{k:03d}", arm) for k in range(2) for arm in ARMS
    ]
    assert told["arms"]["llm"]["model_calls"] == 2 and told["arms"]["llm+kg"]["model_calls"] == 1
    assert told["arms"]["llm+kg"]["goal_met"] == 1


def test_the_table(used: Home) -> None:
    path = used.write("one.jsonl", rows(1))
    ended = used.adaptbot("eval", path, "--domain", "kitchen", COLUMNS="80")
    assert ended.code == 0
    assert ended.err.startswith("kitchen: trials start from ")
    assert ended.err.endswith("/kg/kitchen; the simulated person knows the same\n")
    assert ended.out.startswith("kitchen: trials start from ")
    assert "goal met, %" in ended.out and "LLM + KG + Human" in ended.out
    assert "paper, 30 recipes" in ended.out
    assert max(map(len, ended.out.splitlines())) <= 80
    lines = ended.out.splitlines()
    title = next(n for n, line in enumerate(lines) if "scored by people" in line)
    assert "91.1" in ended.out and all("91.1" not in line for line in lines[:title])


def test_the_graphs_that_it_runs_on_are_said(used: Home) -> None:
    path = used.write("one.jsonl", rows(1))
    base, truth = (used.write(name, HOME) for name in ("base.ttl", "truth.ttl"))
    command = ["eval", path, "--domain", "kitchen", "--kg", base, "--jobs", "1"]
    alone, known, as_json = used.adaptbots(
        [
            [*command, "--arms", "llm", "--truth", truth],
            [*command, "--truth", truth],
            [*command, "--json"],
        ]
    )
    assert alone.err.splitlines()[0] == f"kitchen: trials start from {base}"
    told = f"kitchen: trials start from {base}; the simulated person knows {truth}"
    assert known.err.splitlines()[0] == told
    settings = as_json.json()["settings"]
    assert (as_json.err, settings["kg"], settings["truth"]) == ("", [base], [base])


def test_options_that_cannot_be_meant(used: Home) -> None:
    path = used.write("one.jsonl", rows(1))
    bad = used.write("bad.jsonl", rows(1) + "\n{")
    tasks = used.write("tasks.jsonl", '{"task": "make tea"}')
    kitchen = ["--domain", "kitchen"]
    wrong = [
        (["eval", path, *kitchen, "--arms", "llm,gpt"], 2, '"gpt" is no arm'),
        (["eval", path, *kitchen, "--arms", ","], 2, "is no arm"),
        (["eval", path, *kitchen, "--plot", "x.bmp"], 2, "must end in .svg"),
        (["eval", path, *kitchen, "--select", "z*"], 2, 'id matches "z*"'),
        (["eval", path, "--domain", "household"], 2, "there are some of cooking"),
        (["eval", path, "--domain", "garden"], 2, 'no domain "garden"'),
        (["eval", bad, *kitchen], 2, "bad.jsonl, line 2"),
        (["eval", tasks, *kitchen], 2, "name who plans them with --model"),
        (["eval", "none.jsonl", *kitchen], 2, "cannot read none.jsonl"),
        (["eval", path, *kitchen, "--kg", "none.ttl"], 4, "cannot read none.ttl"),
        (["eval", path, *kitchen, "--truth", bad], 4, "no valid Turtle"),
        (["eval", path, *kitchen, "--results", bad], 2, "holds no results"),
        (["eval", path, *kitchen, "--results", "."], 2, "for results"),
        (["eval", "published", "."], 2, "no result folders"),
        (["eval", "compare", bad, bad], 2, "no valid JSON"),
    ]
    for (command, code, said), ended in zip(
        wrong, used.adaptbots([command for command, _, _ in wrong]), strict=True
    ):
        assert (ended.code, said in ended.said) == (code, True), (command, ended)
        assert "Traceback" not in ended.err


def test_live_with_the_library(used: Home) -> None:
    path = used.write("tasks.txt", "make tea\nomelette: egg, milk\n")
    command = ["eval", path, "--domain", "kitchen", "--model", "library", "--json"]
    ended = used.adaptbot(*command)
    told = ended.json()
    assert told["arms"]["llm+kg"]["goal_met"] == 1
    assert told["arms"]["llm+kg"]["model_calls"] == 0, "the library is no model"
    assert [t["required"] for t in told["trials"][3:4]] == [["egg", "milk"]]
    assert told["trials"][0]["answers"][0].startswith("pick_up")


def test_live_with_a_server_of_ones_own(used: Home) -> None:
    path = used.write("tasks.txt", "make tea: tea\n")
    kept = f"{path}.kept"
    with scripted('pick_up_obj("tea")') as model:
        ended = used.adaptbot(
            "eval", path, "--domain", "kitchen", "--model", "openai/planner",
            "--api-base", model.url, "--replans", "0", "--json", "--answers", kept,
            OPENAI_API_KEY="none",
        )  # fmt: skip
        again = used.adaptbot(
            "eval", path, "--domain", "kitchen", "--model", "openai/planner", "--jobs", "1",
            "--api-base", model.url, "--replans", "0", "--json", "--answers", kept,
            "--arms", "llm", OPENAI_API_KEY="none",
        )  # fmt: skip
        assert len(model.prompts) == 1, "what was answered is not asked again"
    assert again.json()["trials"][0]["answers"] == ['pick_up_obj("tea")']
    assert model.prompts and "tea" in model.prompts[0]
    assert {t["answers"][0] for t in ended.json()["trials"]} == {'pick_up_obj("tea")'}
    wrong = used.adaptbot("eval", path, "--model", "openai/x", "--api-base", "here")
    assert wrong.code == 2 and "http://" in wrong.said


def test_a_model_that_is_not_there(used: Home) -> None:
    path = used.write("tasks.txt", "make tea\n")
    ended = used.adaptbot("eval", path, "--domain", "kitchen", "--model", "gpt-4o")
    assert ended.code == 5 and "OPENAI_API_KEY" in ended.said


def test_compare(used: Home) -> None:
    good, bad = used.write("a.jsonl", rows(2)), used.write("b.jsonl", rows(2, "boil(tea)"))
    reports = []
    for path in (good, bad):
        told = used.adaptbot("eval", path, "--domain", "kitchen", "--replans", "0", "--json")
        reports.append(used.write(f"{Path(path).stem}.json", told.out))
    same, worse, as_json = used.adaptbots(
        [
            ["eval", "compare", reports[0], reports[0]],
            ["eval", "compare", *reports],
            ["eval", "compare", *reports, "--json"],
        ]
    )
    assert (same.code, same.out.strip()) == (0, "B is not worse than A: nothing changed.")
    assert worse.code == 3 and "B is worse than A: " in worse.out
    assert "settings" not in worse.out
    told = as_json.json()
    assert told["settings"] == {}
    assert as_json.code == 3 and told["regression"] is True
    lost = {(d["arm"], d["measure"]) for d in told["differences"] if d["regression"]}
    assert ("llm+kg", "goal_met") in lost


def test_published(used: Home, tmp_path: Path) -> None:
    runs: list[dict[str, Any]] = []
    for k in range(2):
        row = recording(k, TEA, "again", task="make_tea", dish_ingd=["tea", "water"])
        runs.append({**row, "domain": "cooking"})
    root = plant(tmp_path / "repo", runs)
    part = root / "code" / "GPT4" / "cooking_domain"
    for place in (part, part / "LLM_KG_Human"):
        place.mkdir(exist_ok=True)
        graph = b"".join(
            (Path("kg/kitchen") / f).read_bytes() for f in ("attributes.ttl", "state.ttl")
        )
        (place / "initial_onto.ttl").write_bytes(graph)
    written = used.adaptbot("eval", "published", str(root), "--write", str(tmp_path / "r.jsonl"))
    assert written.code == 0 and "2 recordings written" in written.err
    ended = used.adaptbot("eval", "published", str(root), "--json")
    assert ended.code == 0, ended.err
    told = ended.json()
    assert told["settings"]["domain"] == ["kitchen"]
    assert told["settings"]["kg"] == [[str(part / "initial_onto.ttl")]]
    assert told["settings"]["truth"] == [[str(part / "LLM_KG_Human" / "initial_onto.ttl")]]
    assert told["arms"]["llm+kg"]["goal_met"] == 1 and told["arms"]["llm+kg"]["n"] == 2


def test_pictures(used: Home) -> None:
    pytest.importorskip("matplotlib")
    command = ["eval", used.write("one.jsonl", rows(2)), "--domain", "kitchen", "--json", "--jobs"]
    drawn = [used.folder / name for name in ("a.svg", "b.svg", "a.png", "b.png")]
    for ended in used.adaptbots([[*command, "1", "--plot", str(path)] for path in drawn]):
        assert ended.code == 0, ended.err
    svg, again, png, png_again = (path.read_bytes() for path in drawn)
    assert (svg, png) == (again, png_again), "the same report gives the same bytes"
    assert svg.startswith(b"<?xml") and png.startswith(b"\x89PNG")


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_ctrl_c_loses_no_trial(jobs: str, home: Home) -> None:
    path = home.write("many.jsonl", rows(25))
    results = home.folder / "trials.jsonl"
    command = ["eval", path, "--domain", "kitchen", "--jobs", jobs, "--results", str(results)]
    with home.begun(*command) as running:
        while not (results.exists() and results.read_text().count("\n") > 4):
            assert running.process.runs, "it ended too early"
            time.sleep(0.02)
        running.process.kill(signal.SIGINT)
        interrupted = running.ends()
    assert interrupted.code == 130
    kept = results.read_text().splitlines()
    assert f"{len(kept) - 1} of 75 trials are kept: the same command goes on" in interrupted.err
    before = {json.loads(line)["trial"]["id"] for line in kept[1:]}
    assert before
    ended = home.adaptbot(*command, "--json")
    assert ended.code == 0 and ended.json()["arms"]["llm"]["n"] == 25
    after = results.read_text().splitlines()
    assert after[: len(kept)] == kept, "what was done stands as it was"
    assert len(after) == 76
