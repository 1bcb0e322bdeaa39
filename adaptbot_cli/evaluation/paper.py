"""The figures that the paper prints (arXiv 2502.02067, tables 1 and 2)."""

import json
from functools import cache
from pathlib import Path
from typing import Any

Json = dict[str, Any]


@cache
def _all() -> Json:
    found: Json = json.loads(Path(__file__).with_name("paper.json").read_text(encoding="utf-8"))
    return found


def paper_figures(model: str, domain: str) -> Json | None:
    """Return the paper's figures for a model and domain: `tasks`, and those of each arm."""
    found: Json | None = _all().get(domain, {}).get(model)
    return found
