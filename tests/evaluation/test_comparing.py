import io
from typing import Any

import pytest
from rich.console import Console

from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.comparison import (
    Difference,
    compare,
    contrast,
    only_in_one,
    other_settings,
    read_report,
    verdict,
)

GOOD: dict[str, Any] = {
    "arm": "llm+kg",
    "executable": True,
    "goal_met": True,
    "overlap": 1.0,
    "effective_overlap": 1.0,
    "required_lost": 0,
    "model_calls": 2,
    "prompt_tokens": 1000,
    "completion_tokens": 100,
    "questions": 1,
    "prompts": 3,
    "person_seconds": 10.0,
}


def report(*changes: dict[str, Any]) -> dict[str, Any]:
    return {"trials": [{**GOOD, "id": f"t{n}", **change} for n, change in enumerate(changes)]}


def worse(before: Any, after: Any, tolerance: float = 0, cost: float = 0.05) -> set[str]:
    return {d.measure for d in compare(before, after, tolerance, cost) if d.regression}


def test_the_same_is_no_regression() -> None:
    assert worse(report({}, {}), report({}, {})) == set()


@pytest.mark.parametrize(
    "change",
    [
        {"executable": False},
        {"goal_met": False},
        {"overlap": 0.5},
        {"required_lost": 1},
        {"model_calls": 3},
    ],
)
def test_each_loss_is_a_regression(change: dict[str, Any]) -> None:
    assert worse(report({}, {}), report({}, change)) == set(change)
    assert worse(report({}, change), report({}, {})) == set(), "a gain is none"


def test_tolerances() -> None:
    assert worse(report({}, {}), report({}, {"goal_met": False}), tolerance=0.5) == set()
    assert worse(report({}, {}), report({}, {"prompt_tokens": 1040})) == set()
    assert worse(report({}, {}), report({}, {"prompt_tokens": 1040}), cost=0.01) == {
        "prompt_tokens"
    }


def test_pairs_that_changed_are_counted() -> None:
    before = report({"goal_met": False}, {}, {"goal_met": False}, {"goal_met": False})
    after = report({}, {"goal_met": False}, {}, {})
    [found] = [d for d in compare(before, after, 0, 0) if d.measure == "goal_met"]
    assert isinstance(found, Difference)
    assert (found.better, found.worse, found.before, found.after) == (3, 1, 0.25, 0.75)
    assert found.p == pytest.approx(2 * (1 + 4) / 16)
    assert found.interval[0] < 0.5 < found.interval[1]


def test_only_trials_of_both_count() -> None:
    before, after = report({}, {}), report({})
    assert {d.n for d in compare(before, after, 0, 0)} == {1}
    assert list(only_in_one(before, after)) == ["1 trials are only in the first"]
    other = {"trials": [{**GOOD, "id": "x"}]}
    with pytest.raises(UsageError, match="no trial in common"):
        compare(before, other, 0, 0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "no valid JSON"),
        ("[]", "lacks `trials`"),
        ('{"trials": [{"id": 1}]}', "trial 1 lacks `arm`"),
    ],
)
def test_bad_reports(text: str, told: str, tmp_path: Any) -> None:
    path = tmp_path / "r.json"
    path.write_text(text)
    with pytest.raises(UsageError, match=told):
        read_report(path)


LARGE = {"prompt_tokens": 23456, "person_seconds": 1234.5, "prompts": 17, "goal_met": False}
SETTINGS = {"policy": "tutor", "cumulative": False, "kg": [], "seed": 0}
OTHERS = {"policy": "paper", "cumulative": True, "kg": ["[b]\x1b.ttl"], "seed": 0, "new": 1}


def shown(before: Any, after: Any, width: int) -> str:
    out = io.StringIO()
    settings = other_settings(before, after)
    Console(file=out, width=width).print(contrast(compare(before, after, 0, 0.05), settings))
    return out.getvalue()


@pytest.mark.parametrize("width", [80, 140])
def test_the_verdict_is_never_cut(width: int) -> None:
    before = {**report(*[{}] * 9), "settings": SETTINGS}
    after = {**report(*[LARGE] * 8, {}), "settings": OTHERS}
    lines = shown(before, after, width).splitlines()
    table = [line.rstrip() for line in lines if "…" in line]
    assert table == [] and max(map(len, lines)) <= width
    marked = [line for line in lines if line.startswith("worse  ")]
    assert len(marked) == 4, lines
    assert any("goal met" in line and "0, 8" in line for line in marked)
    told = " ".join(line.strip() for line in lines if line.strip())
    assert "B is worse than A: LLM + KG in goal met, prompt tokens" in told


def test_settings_that_differ_are_named() -> None:
    before, after = ({**report({}), "settings": given} for given in (SETTINGS, OTHERS))
    assert set(other_settings(before, after)) == {"policy", "cumulative", "kg"}
    text = shown(before, after, 80)
    assert "tutor" in text and "paper" in text and "seed" not in text
    assert "[b]" in text and "\x1b" not in text
    assert "settings" not in shown(before, before, 80)
    for odd in (None, [], "text"):
        assert other_settings({**report({}), "settings": odd}, after) == {}


def test_a_verdict_is_a_sentence() -> None:
    same, better = report({}), report({"model_calls": 1, "prompts": 2})
    assert verdict(compare(same, same, 0, 0)) == "B is not worse than A: nothing changed."
    told = verdict(compare(same, better, 0, 0))
    assert told.startswith("B is not worse than A: 2 figures changed, none for the worse")
