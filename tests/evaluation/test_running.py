"""Experiments: order, several processes, going on after an interruption, figures."""

from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.experiment import Experiment, Results, Setup
from adaptbot_cli.evaluation.figures import report
from adaptbot_cli.evaluation.trial import Rules
from tests.evaluation.shared import row, world
from tests.evaluation.test_trials import GOOD, PEG

ROWS = [
    row(PEG, required=("peg",), id="w/1", index=1),
    row(GOOD, id="w/2", index=2),
    row(PEG, required=("peg",), id="w/3", index=3),
]


def experiment(**changes: Any) -> Experiment:
    setup = Setup("workshop", **changes)
    return Experiment(setup, list(ROWS), world())


def run(told: Experiment, path: Path) -> list[dict[str, Any]]:
    results = Results(path, told.key())
    results.start()
    with told.workers(results) as pool:
        trials = told.run(results, pool=pool)
    results.close(keep=True)
    return trials


def plain(trials: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Trials without what differs from run to run."""
    return [{k: v for k, v in trial.items() if k != "seconds"} for trial in trials]


def test_every_task_in_every_arm_in_order(tmp_path: Path) -> None:
    trials = run(experiment(), tmp_path / "r.jsonl")
    assert [(t["id"], t["arm"]) for t in trials][:4] == [
        ("w/1", "llm"),
        ("w/1", "llm+kg"),
        ("w/1", "llm+kg+human"),
        ("w/2", "llm"),
    ]
    assert [t["questions"] for t in trials if "human" in t["arm"]] == [1, 0, 1]


def test_several_processes_find_the_same(tmp_path: Path) -> None:
    one = run(experiment(), tmp_path / "1.jsonl")
    two = run(experiment(jobs=2), tmp_path / "2.jsonl")
    assert plain(one) == plain(two)


@pytest.mark.parametrize("jobs", [1, 2])
def test_knowledge_carried_over(jobs: int, tmp_path: Path) -> None:
    told = experiment(cumulative=True, jobs=jobs)
    trials = run(told, tmp_path / "r.jsonl")
    helped = [t for t in trials if "human" in t["arm"]]
    assert [t["questions"] for t in helped] == [1, 0, 0]
    assert [t["goal_met"] for t in helped] == [True, True, True]
    found = report(told.setup.as_json(), trials)["arms"]
    nodes, edges = found["llm+kg+human"]["nodes"], found["llm+kg+human"]["edges"]
    assert found["llm+kg"]["nodes"] == [nodes[0], nodes[0]]
    assert edges[1] == helped[-1]["edges"][1] > edges[0]


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    path, told = tmp_path / "r.jsonl", experiment()
    whole = run(told, path)
    lines = path.read_text("utf-8").splitlines()
    assert len(lines) == 1 + 9
    path.write_text("\n".join(lines[:5]) + '\n{"trial": {"id": "w/2", "ar', encoding="utf-8")
    results = Results(path, told.key())
    results.start()
    assert told.left(results) == 5
    again: list[str] = []
    trials = told.run(results, lambda trial: again.append(trial["id"]))
    results.close(keep=True)
    assert len(again) == 5 and plain(trials) == plain(whole)
    assert len(path.read_text("utf-8").splitlines()) == 10


def test_a_chain_that_was_broken_off_starts_again(tmp_path: Path) -> None:
    path, told = tmp_path / "r.jsonl", experiment(cumulative=True, arms=("llm+kg+human",))
    whole = run(told, path)
    path.write_text("\n".join(path.read_text("utf-8").splitlines()[:2]) + "\n", encoding="utf-8")
    results = Results(path, told.key())
    results.start()
    assert told.left(results) == 3, "what was learned is needed again"
    assert plain(told.run(results)) == plain(whole)
    results.close(keep=False)
    assert not path.exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('{"adaptbot_eval": 1, "key": "other"}\n', "another experiment"),
        ("a plan\nof mine\n", "no valid JSON"),
        ('{"a": 1}\n', "holds no results"),
    ],
)
def test_the_results_of_something_else_are_left_alone(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "r.jsonl"
    path.write_text(text)
    with pytest.raises(UsageError, match=told):
        Results(path, "mine").start()
    assert path.read_text() == text


def test_what_makes_experiments_differ() -> None:
    keys = {
        experiment().key(),
        experiment(rules=Rules(replans=1)).key(),
        experiment(rules=Rules(human_error=0.5)).key(),
        Experiment(Setup("workshop"), list(ROWS[:2]), world()).key(),
    }
    assert len(keys) == 4
    assert experiment().key() == experiment(jobs=2).key()


def test_the_figures_of_an_arm(tmp_path: Path) -> None:
    told = experiment()
    found = report(told.setup.as_json(), run(told, tmp_path / "r.jsonl"))
    helped, alone = found["arms"]["llm+kg+human"], found["arms"]["llm+kg"]
    assert (helped["n"], helped["goal_met"], alone["goal_met"]) == (3, 1, 1 / 3)
    assert helped["questions"] == 2 / 3
    assert (
        helped["intervals"]["goal_met"][1] == 1 and 0.4 < helped["intervals"]["goal_met"][0] < 0.5
    )
    assert helped["nodes"][1] - helped["nodes"][0] == 1, "one peg, taught twice"
    assert helped["edges"][1] - helped["edges"][0] == len(found["trials"][2]["taught"])
    assert alone["findings"]["E201"] == 2
    [group] = found["groups"]
    assert (group["model"], group["domain"], group["paper"]) == ("gpt-4o", "workshop", None)
