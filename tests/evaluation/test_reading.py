"""Recordings and lists of tasks, well and badly formed."""

import json
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.recordings import read_recordings, read_tasks

TOLD: dict[str, Any] = {
    "id": "m/1",
    "model": "m",
    "domain": "workshop",
    "index": 3,
    "task": "wooden_stool",
    "ingredients": ["board"],
    "trials": {
        "llm": {
            "answers": ["a", "b"],
            "results": {"percentage_ingd_used": 50, "#token_used": 7, "#human_involvement": 0},
        },
        "llm_kg": {"answers": ["of another task", "c"], "task_mismatch": True},
        "llm_kg_human": {"answers": ["a", "d", "e"]},
    },
}


def write(path: Path, *lines: Any) -> Path:
    texts = (line if isinstance(line, str) else json.dumps(line) for line in lines)
    path.write_text("\n".join(texts), encoding="utf-8")
    return path


def test_a_recording(tmp_path: Path) -> None:
    [row] = read_recordings(write(tmp_path / "r.jsonl", TOLD, ""))
    assert (row.id, row.task, row.required, row.index) == ("m/1", "wooden stool", ("board",), 3)
    assert row.replies("llm") == ("a", "b")
    assert row.replies("llm+kg+human") == ("a", "d", "e")
    assert row.recorded["llm"] == {"overlap": 0.5, "prompt_tokens": 7, "questions": 0}


def test_all_arms_start_from_one_answer(tmp_path: Path) -> None:
    [row] = read_recordings(write(tmp_path / "r.jsonl", TOLD))
    assert row.replies("llm+kg") == ("a",), "a trial of another task tells nothing more"
    alone = {**TOLD, "trials": {"llm": TOLD["trials"]["llm"]}}
    [row] = read_recordings(write(tmp_path / "r.jsonl", alone))
    assert row.replies("llm+kg+human") == ("a",)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("{not json", "line 2: this is no valid JSON"),
        ("[1]", "line 2: this must be one JSON object"),
        ({**TOLD, "task": ""}, "line 2: `task` must be a text"),
        ({**TOLD, "ingredients": "board"}, "line 2: `ingredients` must be a list of names"),
        ({**TOLD, "index": "3"}, "line 2: `index`"),
        ({**TOLD, "trials": {}}, "line 2: `trials` must hold"),
        ({**TOLD, "trials": {"gpt": {"answers": ["a"]}}}, 'line 2: "gpt" is no arm'),
        ({**TOLD, "trials": {"llm": {"answers": []}}}, "line 2: `trials.llm.answers`"),
        ({**TOLD, "trials": {"llm": None}}, "line 2: `trials.llm.answers`"),
        (TOLD, 'two recordings have the id "m/1"'),
    ],
)
def test_a_bad_line_is_named(line: Any, told: str, tmp_path: Path) -> None:
    path = write(tmp_path / "r.jsonl", TOLD, line)
    with pytest.raises(UsageError) as caught:
        read_recordings(path)
    assert told in str(caught.value) and str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("content", "told"),
    [(b"", "holds no recordings"), (b"\xff\xfe\x00", "no UTF-8"), (b'{"task": "x"}', "--model")],
)
def test_a_file_that_is_none(content: bytes, told: str, tmp_path: Path) -> None:
    path = tmp_path / "r.jsonl"
    path.write_bytes(content)
    with pytest.raises(UsageError, match=told):
        read_recordings(path)
    with pytest.raises(UsageError, match="cannot read"):
        read_recordings(tmp_path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("t.txt", "# tasks\nstool: board, peg\n\nmake a table # later\n"),
        ("t.yaml", "- 'stool: board, peg'\n- task: make a table\n"),
        ("t.yml", "- stool: [board, peg]\n- make a table\n"),
        ("t.yaml", "- stool: board, peg\n- {task: make a table, requires: []}\n"),
        ("t.jsonl", '{"task": "stool", "requires": ["board", "peg"]}\n{"task": "make a table"}\n'),
    ],
)
def test_lists_of_tasks(name: str, content: str, tmp_path: Path) -> None:
    rows = read_tasks(write(tmp_path / name, content), "workshop")
    assert [(row.task, row.required) for row in rows] == [
        ("stool", ("board", "peg")),
        ("make a table", ()),
    ]
    assert [row.id for row in rows] == ["workshop/00", "workshop/01"]


def test_the_tasks_of_recordings(tmp_path: Path) -> None:
    [row] = read_tasks(write(tmp_path / "r.jsonl", TOLD), "workshop")
    assert (row.task, row.required, row.answers) == ("wooden stool", ("board",), {})


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("t.txt", "# nothing", "lists no task"),
        ("t.txt", "a\n: board", "line 2: a task must be"),
        ("t.yaml", "a: [", "no valid YAML"),
        ("t.yaml", "just text", "must hold a list"),
        ("t.yaml", "- 3", "entry 1: a task must be"),
        ("t.yaml", "- {task: a, requires: 3}", "entry 1: `requires`"),
        ("t.jsonl", '{"requires": []}', "line 1: a task must be"),
    ],
)
def test_bad_lists_of_tasks(name: str, content: str, told: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=told):
        read_tasks(write(tmp_path / name, content), "workshop")
