"""The authors' folders: a tree in their layout, made from recordings, is read back the same."""

import json
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.published import FOLDERS, MODELS, read_published, write_recordings
from tests.evaluation.shared import published

FEEDBACK = "LLM_feedback_with_error_{}.txt"


def plant(root: Path, rows: list[dict[str, Any]]) -> Path:
    """Write recordings in the layout of the repository, with what an earlier task left behind."""
    names = {model: name for name, model in MODELS.items()}
    left: dict[tuple[str, ...], list[str]] = {}
    for row in sorted(rows, key=lambda row: (row["model"], row["domain"], row["index"])):
        part = root / "code" / names[row["model"]] / f"{row['domain']}_domain"
        for arm, trial in row["trials"].items():
            base = part / FOLDERS[arm] / "experiment_results" / f"results_{row['index']}"
            series = (row["model"], row["domain"], arm)
            texts = list(trial["answers"])
            texts += left.get(series, [])[len(texts) :]
            left[series] = texts
            # The number of the inner folders is not always that of the task.
            outputs = base / f"LLM_outputs_{row['index'] + 12}"
            outputs.mkdir(parents=True)
            for k, text in enumerate(texts):
                raw = f"LLM_updated_orig_output_{k}.txt" if k else "LLM_orig_output.txt"
                (outputs / raw).write_text(text, encoding="utf-8")
            for k, text in enumerate(trial.get("refined", [])):
                name = f"LLM_updated_output_{k}.txt" if k else "LLM_output.txt"
                (outputs / name).write_text(text, encoding="utf-8")
            told = base / f"Feedbacks_{row['index'] + 12}"
            told.mkdir()
            for k, text in enumerate(trial.get("feedback", [])):
                (told / FEEDBACK.format(k)).write_text(text, encoding="utf-8")
            (base / "results.json").write_text(json.dumps(trial["results"]), encoding="utf-8")
    return root


def recording(index: int, *answers: str, task: str = "stool", **changes: Any) -> dict[str, Any]:
    results = {"dish_name": task, "dish_ingd": ["board"], "#token_used": 5}
    trial = {"answers": list(answers), "results": {**results, **changes}}
    return {
        "id": f"gpt-4o/workshop/{index:02d}",
        "model": "gpt-4o",
        "domain": "workshop",
        "index": index,
        "trials": {"llm_kg": trial},
    }


def read(root: Path) -> list[dict[str, Any]]:
    return [row for series in read_published(root) for row in series.rows]


def test_what_an_earlier_task_left_is_dropped(tmp_path: Path) -> None:
    plant(tmp_path, [recording(0, "a", "b", "c"), recording(1, "d", "e"), recording(10, "f")])
    trials = [row["trials"]["llm_kg"] for row in read(tmp_path)]
    assert [trial["answers"] for trial in trials] == [["a", "b", "c"], ["d", "e"], ["f"]]
    assert [trial["left_over_rounds_dropped"] for trial in trials] == [[], [2], [1, 2]]
    assert [trial["feedback_rounds"] for trial in trials] == [2, 1, 0]


def test_the_folder_code_will_do_as_well(tmp_path: Path) -> None:
    plant(tmp_path, [recording(0, "a")])
    assert read(tmp_path) == read(tmp_path / "code")
    [series] = read_published(tmp_path)
    assert (series.model, series.domain) == ("gpt-4o", "workshop")


def test_damaged_results_are_read_field_by_field(tmp_path: Path) -> None:
    plant(tmp_path, [recording(0, "a", ingd_used=["board", "salt"])])
    [path] = tmp_path.rglob("results.json")
    path.write_text(path.read_text("utf-8").replace('"salt"', '"salt'), encoding="utf-8")
    [row] = read(tmp_path)
    assert row["task"] == "stool" and row["ingredients"] == ["board"]
    assert row["trials"]["llm_kg"]["results"]["#token_used"] == 5
    assert "read field by field" in row["notes"][0]


def test_a_trial_of_another_task_is_marked(tmp_path: Path) -> None:
    row = recording(0, "a")
    row["trials"]["llm"] = recording(0, "a")["trials"]["llm_kg"]
    row["trials"]["llm_kg"] = recording(0, "b", task="table")["trials"]["llm_kg"]
    [found] = read(plant(tmp_path, [row]))
    assert found["task"] == "stool" and found["trials"]["llm_kg"]["task_mismatch"]
    assert "another task" in found["notes"][0]


@pytest.mark.parametrize("spoil", ["empty", "no answer", "no results"])
def test_folders_that_are_none(spoil: str, tmp_path: Path) -> None:
    if spoil != "empty":
        plant(tmp_path, [recording(0, "a")])
        name = "LLM_orig_output.txt" if spoil == "no answer" else "results.json"
        next(tmp_path.rglob(name)).unlink()
    with pytest.raises(UsageError) as caught:
        read_published(tmp_path)
    assert str(tmp_path) in str(caught.value)


def test_the_published_rows_come_back_as_they_are(tmp_path: Path) -> None:
    text = (published() / "plans.dev.jsonl").read_text("utf-8")
    rows = {row["id"]: row for row in map(json.loads, text.splitlines())}
    path = tmp_path / "again.jsonl"
    assert write_recordings(read_published(plant(tmp_path, list(rows.values()))), path) == 36
    for line in path.read_text("utf-8").splitlines():
        found = json.loads(line)
        row = rows[found["id"]]
        assert (found["task"], found["ingredients"]) == (row["task"], row["ingredients"])
        for arm, trial in row["trials"].items():
            same = {key: found["trials"][arm][key] for key in ("answers", "feedback", "results")}
            assert same == {key: trial[key] for key in same}, (found["id"], arm)
            assert found["trials"][arm]["feedback_rounds"] == trial["feedback_rounds"]
            assert bool(found["trials"][arm].get("task_mismatch")) == ("task_mismatch" in trial)
