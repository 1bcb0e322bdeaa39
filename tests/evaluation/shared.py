"""A workshop to evaluate in, and the published recordings where they are at hand."""

from pathlib import Path
from typing import Any

import pytest

from adaptbot_cli.adapters.store.reading import triples
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.evaluation.recordings import Recording
from adaptbot_cli.evaluation.trial import Basis
from tests.packs import PUBLISHED
from tests.worlds import ATTRIBUTES, FILES, PREFIXES, STATES

PEG = """
w:peg a w:part ; w:called "peg" ; w:drillable true ; w:in w:cupboard ; w:drilled false .
w:drill_hole <urn:adaptbot:alias> "perforate" .
"""
TRUTH = PREFIXES + ATTRIBUTES + STATES + PEG


def facts(text: str) -> list[Triple]:
    return triples(text.encode(), "facts")


def world(truth: str = TRUTH) -> Basis:
    """The workshop, which does not know of the peg; the person does."""
    files = {name: (PREFIXES + text).encode() for name, text in FILES.items()}
    return Basis(files, "workshop", None, facts(truth))


def row(*answers: str, required: tuple[str, ...] = ("board",), **more: Any) -> Recording:
    """A recording in which each arm got the same answers."""
    arms = ("llm", "llm+kg", "llm+kg+human")
    told: dict[str, Any] = {"id": "w/1", "task": "work", "model": "gpt-4o", "domain": "workshop"}
    return Recording(**{**told, **more}, required=required, answers=dict.fromkeys(arms, answers))


def published() -> Path:
    """Return the folder with the published recordings, or skip the test."""
    if not (PUBLISHED / "plans.dev.jsonl").is_file():
        pytest.skip("the published recordings are not on this machine")
    return PUBLISHED
