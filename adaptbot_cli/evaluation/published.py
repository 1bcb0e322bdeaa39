"""The authors' own result folders, as they lie in their public repository (docs/evaluation.md).

code/<MODEL>/<domain>_domain/initial_onto.ttl              the graph before any answer
code/<MODEL>/<domain>_domain/LLM_KG_Human/initial_onto.ttl the graph after the people's answers
code/<MODEL>/<domain>_domain/<ARM>/experiment_results/results_<i>/
    results.json
    LLM_outputs_<j>/LLM_orig_output.txt, LLM_updated_orig_output_<k>.txt     what the model said
    LLM_outputs_<j>/LLM_output.txt, LLM_updated_output_<k>.txt      what their refinement made
    Feedbacks_<j>/LLM_feedback_with_error_<k-1>.txt                    what it was told
"""

import json
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.recordings import read_text

Json = dict[str, Any]

MODELS = {"GPT4": "gpt-4o", "GPT3.5": "gpt-3.5"}
"""The models by their folders; the paper names them so."""

FOLDERS = {"llm": "LLM_only", "llm_kg": "LLM_KG", "llm_kg_human": "LLM_KG_Human"}


@dataclass(frozen=True, slots=True)
class Series:
    """The recorded runs of one model in one domain, in the order of their tasks, with the graphs
    before the first and after the last."""

    model: str
    domain: str
    rows: tuple[Json, ...]
    initial: Path
    after: Path


def read_published(folder: Path) -> list[Series]:
    """Read every series of the repository, or of its folder `code`.

    Answers that an earlier task left behind are dropped: the authors' program emptied its feedback
    folder only when it started.

    Raises:
        UsageError: there are no result folders, or a file of theirs cannot be read.
    """
    code = folder / "code" if (folder / "code").is_dir() else folder
    found = [
        _series(part, model, part.name.removesuffix("_domain"))
        for name, model in sorted(MODELS.items())
        for part in sorted((code / name).glob("*_domain"))
        if any(part.glob("*/experiment_results/results_*"))
    ]
    if not found:
        raise UsageError(
            f"{folder} holds no result folders such as code/GPT4/cooking_domain/LLM_KG/"
            "experiment_results; name a checkout of the authors' repository at commit d65fe35"
        )
    return found


def _series(part: Path, model: str, domain: str) -> Series:
    tasks: dict[int, Json] = {}
    for arm, name in FOLDERS.items():
        before: list[str] = []
        for index, folder in _results(part / name / "experiment_results"):
            trial, raw, results = _trial(folder, before)
            before = raw
            row = tasks.setdefault(index, _row(model, domain, index, results))
            _take(row, arm, trial, results)
    after = part / FOLDERS["llm_kg_human"] / "initial_onto.ttl"
    rows = tuple(tasks[index] for index in sorted(tasks) if tasks[index]["trials"])
    return Series(model, domain, rows, part / "initial_onto.ttl", after)


def _results(folder: Path) -> list[tuple[int, Path]]:
    """The result folders in the order in which they were made."""
    numbered = ((p.name.removeprefix("results_"), p) for p in folder.glob("results_*"))
    return sorted((int(number), path) for number, path in numbered if number.isdigit())


def _row(model: str, domain: str, index: int, results: Json) -> Json:
    return {
        "id": f"{model}/{domain}/{index:02d}",
        "model": model,
        "domain": domain,
        "index": index,
        "task": str(results.get("dish_name", "")).strip(),
        "ingredients": results.get("dish_ingd", []),
        "trials": {},
        "notes": [],
    }


def _take(row: Json, arm: str, trial: Json, results: Json) -> None:
    task = str(results.get("dish_name", "")).strip()
    if task != row["task"]:
        trial["task_mismatch"] = True
        row["notes"].append(f"{arm}: recorded for another task, {task!r}")
    if results.pop("damaged", False):
        row["notes"].append(f"{arm}: results.json is no valid JSON; read field by field")
    row["trials"][arm] = trial


def _trial(folder: Path, before: list[str]) -> tuple[Json, list[str], Json]:
    """Read one trial; `before` are the files of the task before, as they lie there."""
    outputs = _numbered(folder, "LLM_outputs_")
    raw = list(_texts(outputs, "LLM_orig_output.txt", "LLM_updated_orig_output_{}.txt"))
    if not raw:
        raise UsageError(f"{outputs} lacks LLM_orig_output.txt, the model's first answer")
    refined = list(_texts(outputs, "LLM_output.txt", "LLM_updated_output_{}.txt"))
    left_over = [k for k in range(1, len(raw)) if k < len(before) and raw[k] == before[k]]
    kept = [k for k in range(len(raw)) if k not in left_over]
    name = "LLM_feedback_with_error_{}.txt"
    feedback = _texts(_numbered(folder, "Feedbacks_"), name.format(0), name)
    record = dict(enumerate(feedback, start=1))
    results = _fields(folder / "results.json")
    trial = {
        "answers": [raw[k] for k in kept],
        "feedback": [record[k] for k in kept if k in record],
        "refined": [refined[k] for k in kept if k < len(refined)],
        "results": {key: value for key, value in results.items() if key != "damaged"},
        "feedback_rounds": len(kept) - 1,
        "left_over_rounds_dropped": left_over,
    }
    return trial, raw, results


def _numbered(folder: Path, prefix: str) -> Path:
    """The one folder of a kind; its number is not always that of the task."""
    return next(iter(sorted(folder.glob(f"{prefix}*"))), folder / prefix)


def _texts(folder: Path, first: str, later: str) -> Iterator[str]:
    names = [first, *(later.format(k) for k in range(1, 100))]
    for name in names:
        if not (folder / name).is_file():
            return
        yield read_text(folder / name)


def _fields(path: Path) -> Json:
    """Read a results file; one that is no valid JSON (one is not) field by field."""
    text = read_text(path)
    try:
        reply = bounded.parse_json(text, path, UsageError)
    except UsageError:
        return {**_by_field(text), "damaged": True}
    if not isinstance(reply, dict):
        raise UsageError(f"{path} must hold one JSON object")
    return reply


def _by_field(text: str) -> Json:
    found: Json = {}
    for name, value in re.findall(r'"([#\w]+)"\s*:\s*(-?[\d.]+|"[^"\n]*"|\[[^\]]*\])', text):
        if value[0] == "[":
            parts = (part.strip().strip('"') for part in value[1:-1].split(","))
            found[name] = [part for part in parts if part]
        else:
            found[name] = json.loads(value)
    return found


def write_recordings(series: Iterable[Series], path: Path) -> int:
    """Write the runs as recordings, one JSON object a line; returns how many. Raises UsageError."""
    lines = [json.dumps(row, ensure_ascii=False) for each in series for row in each.rows]
    try:
        path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error.strerror}") from error
    return len(lines)
