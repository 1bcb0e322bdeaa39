"""Lists of tasks for a live experiment: plain lines, YAML, or one JSON object a line."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from adaptbot_cli import bounded
from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.recordings import Row, read_lines, read_recordings, read_text

Entry = tuple[str, Any]
"""Where an entry stands, and what it says."""


def read_tasks(path: Path, domain: str) -> list[Row]:
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
        entries: Iterable[Entry] = ((f"{path}, line {n}", told) for n, told in lines)
    elif path.suffix in (".yaml", ".yml"):
        entries = _yaml(path)
    else:
        entries = _plain(path)
    rows = [_row(told, where, n, domain) for n, (where, told) in enumerate(entries)]
    if not rows:
        raise UsageError(f"{path} lists no task: write one a line, such as `omelette: egg, oil`")
    return [replace(row, id=f"{domain}/{row.index:02d}") for row in rows]


def _plain(path: Path) -> list[Entry]:
    lines = enumerate(read_text(path).splitlines(), start=1)
    kept = ((n, line.partition("#")[0].strip()) for n, line in lines)
    return [(f"{path}, line {n}", line) for n, line in kept if line]


def _yaml(path: Path) -> list[Entry]:
    [told, *more] = bounded.parse_yaml(read_text(path), path) or [None]
    if more or not isinstance(told, list):
        raise UsageError(f"{path} must hold a list of tasks: `- omelette: egg, oil` or objects")
    return [(f"{path}, entry {n}", entry) for n, entry in enumerate(told, start=1)]


def _row(told: Any, where: str, index: int, domain: str) -> Row:
    task, items = _parts(told)
    if not isinstance(task, str) or not task.strip():
        raise UsageError(f"{where}: a task must be a text or an object with `task`")
    if not isinstance(items, list) or not all(isinstance(item, str) for item in items):
        raise UsageError(f"{where}: `requires` must be a list of names")
    return Row("", task.strip(), tuple(map(str.strip, items)), "", domain, index)


def _parts(told: Any) -> tuple[Any, Any]:
    """The task of an entry and what it requires, in whichever form it is written."""
    if isinstance(told, str):
        name, _, rest = told.partition(":")
        return name, _split(rest)
    if not isinstance(told, dict):
        return None, None
    if len(told) == 1 and not told.keys() & {"task", "requires", "ingredients"}:
        [(task, items)] = told.items()
    else:
        task, items = told.get("task"), told.get("requires", told.get("ingredients", []))
    return task, _split(items) if isinstance(items, str) else items


def _split(items: str) -> list[str]:
    return [item for item in items.split(",") if item.strip()]
