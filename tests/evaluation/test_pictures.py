"""What pictures say: colours of one meaning, a legend in each panel, growth by its name."""

import re
from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.evaluation import plots
from adaptbot_cli.evaluation.figures import report
from adaptbot_cli.evaluation.plots import questions_and_growth
from adaptbot_cli.evaluation.recordings import ARMS

SERIES = [(m, d) for m in ("gpt-3.5", "gpt-4o") for d in ("cooking", "cleaning")]


def trial(arm: str, model: str, domain: str, index: int) -> dict[str, Any]:
    counts = dict.fromkeys(("model_calls", "prompt_tokens", "completion_tokens", "questions"), 2)
    facts = [f"s{n} p o" for n in range(index + 1)] if "human" in arm else []
    told = {"arm": arm, "model": model, "domain": domain, "index": index, "id": f"{model}/{index}"}
    shares = {"executable": True, "goal_met": False, "overlap": 0.5, "effective_overlap": 0.25}
    more = {"prompts": 4, "person_seconds": 9.0, "required_lost": 0, "seconds": 0.1}
    sizes = {"nodes": [9, 9], "edges": [90, 90 + len(facts)]}
    return {**told, **counts, **shares, **more, **sizes, "findings": {}, "taught": facts} | {
        "recorded": {}
    }


def made(series: list[tuple[str, str]], cumulative: bool) -> dict[str, Any]:
    settings = {"cumulative": cumulative, "policy": "tutor"}
    return report(settings, [trial(arm, *s, n) for s in series for n in range(3) for arm in ARMS])


def test_no_colour_means_two_things() -> None:
    colours = [*plots.COLOURS.values(), *plots.SERIES]
    assert len(set(colours)) == len(colours)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_each_panel_has_its_legend(n: int, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    plots.draw(made(SERIES[:n], False), tmp_path / "a.svg")
    said = re.findall(r"<!-- (.*?) -->", (tmp_path / "a.svg").read_text())
    assert said.count("LLM + KG + Human") == n, "once in the legend of each panel of bars"
    for model, domain in SERIES[:n]:
        assert said.count(f"{model}, {domain}") == 2, "in the legends of questions and of growth"


def test_growth_says_what_it_counts() -> None:
    said, growth = questions_and_growth(made(SERIES[:1], True))
    said_alone, alone = questions_and_growth(made(SERIES[:1], False))
    assert growth.title == "Growth of the knowledge graph"
    assert "since before task 1" in growth.note
    assert "none carried over" in alone.note and "Growth" not in alone.title
    assert said.note != said_alone.note
    assert [*growth.series.values()] == [*alone.series.values()] == [[1, 2, 3]]
