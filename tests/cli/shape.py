"""The form of `--json`, as docs and programs rely on it, and a strict check against it.

A shape is a type, None, a set of texts, a tuple of alternatives, a list of one shape for each
entry, or a dictionary whose keys are all there and no others; `key?` may be left out.
"""

from typing import Any

COUNTS = [int]

SUMMARY: dict[str, Any] = {
    "task": (str, None),
    "domain": str,
    "planner": str,
    "request": {
        "tasks": [str],
        "required": [str],
        "excluded": [str],
        "amount": (int, None),
        "unread": [str],
    },
    "outcome": {"executable", "findings", "no_plan"},
    "goal": {"met": bool, "missing": [str]},
    "steps": [
        {
            "n": int,
            "source": (str, None),
            "call": [str],
            "status": {"ok", "changed", "inserted", "dropped", "finding"},
            "codes": [str],
            "message": str,
            "changes": [
                {
                    "from": str,
                    "to": str,
                    "by": str,
                    "evidence": str,
                    "approved": {"rule", "human"},
                }
            ],
            "done": ({"done", "failed", "not tried"}, None),
        }
    ],
    "findings": [
        {
            "code": str,
            "step": (int, None),
            "steps": [int],
            "subject": str,
            "message": str,
            "candidates": [str],
            "line?": int,
            "column?": (int, None),
        }
    ],
    "questions": [{"about": str, "kind": str, "answer": (str, bool, None)}],
    "learned": [[str]],
    "observed": [[(str, bool, int, float)]],
    "world": ({"kind": str, "failed": int, "recovered": int}, None),
    "kg": {"before": (str, None), "after": (str, None), "nodes": COUNTS, "edges": COUNTS},
    "usage": {
        "model_calls": int,
        "prompt_tokens": int,
        "completion_tokens": int,
        "cost_usd": (float, None),
        "questions": int,
        "seconds": float,
    },
}

THING: dict[str, Any] = {
    "name": str,
    "class": str,
    "place": (str, None),
    "aliases": [str],
    "attributes": dict,
    "states": dict,
    "holds": [str],
}


def misfits(value: Any, shape: Any, where: str = "$") -> list[str]:
    """Return where a value is not of a shape."""
    if isinstance(shape, dict) and isinstance(value, dict):
        return _object(value, shape, where)
    if isinstance(shape, list) and isinstance(value, list):
        numbered = enumerate(value)
        return [m for n, entry in numbered for m in misfits(entry, shape[0], f"{where}[{n}]")]
    if isinstance(shape, tuple):
        fits = any(not misfits(value, one, where) for one in shape)
    elif isinstance(shape, set):
        fits = isinstance(value, str) and value in shape
    else:
        fits = value is None if shape is None else type(value) is shape
    return [] if fits else [f"{where} is {value!r}"]


def _object(value: dict[str, Any], shape: dict[str, Any], where: str) -> list[str]:
    wanted = {key.removesuffix("?"): part for key, part in shape.items()}
    needed = {key for key in shape if not key.endswith("?")}
    found = [f"{where} lacks {key}" for key in sorted(needed - value.keys())]
    found += [f"{where} has {key}" for key in sorted(value.keys() - wanted.keys())]
    for key in value.keys() & wanted.keys():
        found += misfits(value[key], wanted[key], f"{where}.{key}")
    return found


def is_summary(told: Any) -> bool:
    """Check a summary's form, and what its parts promise to each other."""
    assert misfits(told, SUMMARY) == []
    assert [step["n"] for step in told["steps"]] == [*range(1, len(told["steps"]) + 1)]
    assert all(step["call"] for step in told["steps"])
    assert all((step["source"] is None) == (step["status"] == "inserted") for step in told["steps"])
    assert all(len(fact) == 4 and fact[3] in ("attribute", "state") for fact in told["learned"])
    assert len(told["kg"]["nodes"]) == len(told["kg"]["edges"]) == 2
    assert told["goal"]["met"] <= (told["outcome"] == "executable")
    return True
