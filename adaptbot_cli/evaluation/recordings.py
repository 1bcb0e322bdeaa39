"""Recorded runs to evaluate on: one JSON object a line (docs/evaluation.md, "Recordings")."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.errors import UsageError

ARMS = ("llm", "llm+kg", "llm+kg+human")
"""The three configurations of the paper (IV-A2), by the names that the command line gives them."""


@dataclass(frozen=True, slots=True)
class Recording:
    """One task: what was asked, what it needs, and what a model answered.

    `answers` holds, for each arm, the answers in the order given: the first is the same for all,
    as trials are linked; the others answered the feedback of the recorded run. `recorded` are the
    figures that the recorded run itself had, by arm. `series` rows follow each other by `index`.
    """

    id: str
    task: str
    required: tuple[str, ...]
    model: str = ""
    domain: str = ""
    index: int = 0
    answers: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    recorded: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def series(self) -> tuple[str, str]:
        """What a row belongs to: knowledge is carried over within one model and domain."""
        return (self.model, self.domain)

    def replies(self, arm: str) -> tuple[str, ...]:
        """Return what the model said in one arm, the first answer alone if no more is known."""
        return self.answers.get(arm) or next(iter(self.answers.values()), ())[:1]


def read_recordings(path: Path) -> list[Recording]:
    """Read a file of recordings.

    Raises:
        UsageError: the file cannot be read or a line has another form; names file and line.
    """
    lines = read_lines(path)
    if lines and "trials" not in lines[0][1]:
        raise UsageError(f"{path} holds no answers, only tasks: name who plans them with --model")
    rows = [row_of(record, f"{path}, line {n}") for n, record in lines]
    if not rows:
        raise UsageError(f"{path} holds no recordings: it needs one JSON object a line")
    seen: dict[str, int] = {}
    for n, row in enumerate(rows, start=1):
        if row.id in seen:
            raise UsageError(f'{path}: two recordings have the id "{row.id}"; give each its own')
        seen[row.id] = n
    return rows


def read_lines(path: Path) -> list[tuple[int, dict[str, Any]]]:
    """Read a file of JSON objects, one a line, with their line numbers. Raises UsageError."""
    found = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip():
            continue
        reply = bounded.parse_json(line, f"{path}, line {number}: this", UsageError)
        if not isinstance(reply, dict):
            raise UsageError(f"{path}, line {number}: this must be one JSON object: {{…}}")
        found.append((number, reply))
    return found


def read_text(path: Path) -> str:
    """Read a text file. Raises UsageError."""
    return bounded.read_text(path, bounded.JSON, UsageError)


def row_of(record: Mapping[str, Any], where: str) -> Recording:
    """Return one recording as a row; `where` it stands is said in errors. Raises UsageError."""
    task = _text(record, "task", where)
    trials = record.get("trials")
    if not isinstance(trials, dict) or not trials:
        raise UsageError(f"{where}: `trials` must hold what the model said in at least one arm")
    answered = {_arm(name, where): _trial(trial, name, where) for name, trial in trials.items()}
    first = next((answered[arm][0] for arm in ARMS if arm in answered), ())[:1]
    answers = {arm: (*first, *found[1:]) for arm, (found, _) in answered.items()}
    index = record.get("index", 0)
    if type(index) is not int:
        raise UsageError(f"{where}: `index`, the place in the order of tasks, must be a number")
    return Recording(
        id=str(record.get("id") or task),
        task=task.replace("_", " "),
        required=_names(record.get("ingredients", []), "ingredients", where),
        model=str(record.get("model", "")),
        domain=str(record.get("domain", "")),
        index=index,
        answers=answers,
        recorded={arm: figures for arm, (_, figures) in answered.items() if figures},
    )


def _arm(name: str, where: str) -> str:
    arm = str(name).replace("_", "+")
    if arm not in ARMS:
        raise UsageError(f'{where}: "{name}" is no arm; there is llm, llm_kg and llm_kg_human')
    return arm


def _trial(trial: Any, name: str, where: str) -> tuple[tuple[str, ...], dict[str, float]]:
    """What was said in one arm; a trial that was recorded for another task only says the first."""
    answers = trial.get("answers") if isinstance(trial, dict) else None
    if not isinstance(answers, list) or not answers or not _all_text(answers):
        raise UsageError(f"{where}: `trials.{name}.answers` must be a list of texts, not empty")
    if trial.get("task_mismatch"):
        return (answers[0],), {}
    return tuple(answers), _figures(trial.get("results"))


def _figures(results: Any) -> dict[str, float]:
    """The recorded figures that have a measure of ours beside them."""
    names = {"percentage_ingd_used": "overlap", "#token_used": "prompt_tokens"}
    names |= {"#human_involvement": "questions"}
    record = results if isinstance(results, dict) else {}
    found = {
        new: record[old] for old, new in names.items() if isinstance(record.get(old), int | float)
    }
    if "overlap" in found:
        found["overlap"] /= 100
    return found


def _text(record: Mapping[str, Any], key: str, where: str) -> str:
    value = record.get(key)
    if not isinstance(value, str) or not value.strip():
        raise UsageError(f"{where}: `{key}` must be a text, not empty")
    return value


def _names(value: Any, key: str, where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not _all_text(value):
        raise UsageError(f"{where}: `{key}` must be a list of names")
    return tuple(value)


def _all_text(values: Iterable[Any]) -> bool:
    return all(isinstance(value, str) for value in values)


Entry = tuple[str, Any]
"""Where an entry stands, and what it says."""


def read_tasks(path: Path, domain: str) -> list[Recording]:
    """Read a list of tasks of a domain; of recordings, take the tasks and not the answers.

    Plain lines are `task: item, item`; YAML and JSON entries are a text or an object with `task`
    and, if the listed or told items are not meant, `requires`.

    Raises:
        UsageError: the file cannot be read or an entry has another form; names file and place.
    """
    if path.suffix == ".jsonl":
        lines = read_lines(path)
        if lines and "trials" in lines[0][1]:
            return [replace(row, answers={}, recorded={}) for row in read_recordings(path)]
        entries: Iterable[Entry] = ((f"{path}, line {n}", reply) for n, reply in lines)
    elif path.suffix in (".yaml", ".yml"):
        entries = _yaml(path)
    else:
        entries = _plain(path)
    rows = [_row(reply, where, n, domain) for n, (where, reply) in enumerate(entries)]
    if not rows:
        raise UsageError(f"{path} lists no task: write one a line, such as `omelette: egg, oil`")
    return [replace(row, id=f"{domain}/{row.index:02d}") for row in rows]


def _plain(path: Path) -> list[Entry]:
    lines = enumerate(read_text(path).splitlines(), start=1)
    kept = ((n, line.partition("#")[0].strip()) for n, line in lines)
    return [(f"{path}, line {n}", line) for n, line in kept if line]


def _yaml(path: Path) -> list[Entry]:
    [reply, *more] = bounded.parse_yaml(read_text(path), path) or [None]
    if more or not isinstance(reply, list):
        raise UsageError(f"{path} must hold a list of tasks: `- omelette: egg, oil` or objects")
    return [(f"{path}, entry {n}", entry) for n, entry in enumerate(reply, start=1)]


def _row(reply: Any, where: str, index: int, domain: str) -> Recording:
    task, items = _parts(reply)
    if not isinstance(task, str) or not task.strip():
        raise UsageError(f"{where}: a task must be a text or an object with `task`")
    if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
        raise UsageError(f"{where}: `requires` must be a list of names")
    return Recording("", task.strip(), tuple(map(str.strip, items)), "", domain, index)


def _parts(reply: Any) -> tuple[Any, Any]:
    """The task of an entry and what it requires, in whichever form it is written."""
    if isinstance(reply, str):
        name, _, rest = reply.partition(":")
        return name, _split(rest)
    if not isinstance(reply, dict):
        return None, None
    if len(reply) == 1 and not reply.keys() & {"task", "requires", "ingredients"}:
        [(task, items)] = reply.items()
    else:
        task, items = reply.get("task"), reply.get("requires", reply.get("ingredients", []))
    return task, _split(items) if isinstance(items, str) else items


def _split(items: str) -> list[str]:
    return [item for item in items.split(",") if item.strip()]
