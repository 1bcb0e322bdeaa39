"""The open corpus: each form in which people and models write steps, and what is no step."""

from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml

from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_kg
from adaptbot_cli.core.parse import Vocabulary, parse
from adaptbot_cli.resources import bundled

CASES = yaml.safe_load(Path(__file__).with_name("corpus.yaml").read_text("utf-8"))


@cache
def words(domain: str) -> Vocabulary:
    return Vocabulary.of(load_kg(read_files(bundled("kg") / domain), domain))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["text"][:40])
def test_a_text_is_read_as_its_steps(case: dict[str, Any]) -> None:
    parsed = parse(case["text"], words(case.get("domain", "kitchen")))
    assert [written.call.render() for written in parsed.calls] == case["calls"]
    found = [f"{f.code} {f.line}{'!' if f.blocking else ''}" for f in parsed.findings]
    assert found == case.get("findings", [])


def test_the_corpus_is_wide_enough() -> None:
    assert len(CASES) >= 150
    assert sum(not case["calls"] for case in CASES) >= 10
