"""The documentation's links lead somewhere, and the files that it names are there."""

import importlib
import re
from pathlib import Path

import pytest

from adaptbot_cli.core.ask.questions import KINDS

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("examples/**/*.md")])
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")
NAMED = re.compile(
    r"`((?:adaptbot_cli|core|session|adapters|cli|evaluation|docs|tests|tools)/[\w./-]+\.\w+)`"
)
BASES = (ROOT, ROOT / "adaptbot_cli", ROOT / "adaptbot_cli" / "core", ROOT / "docs")


def anchors(page: Path) -> set[str]:
    """The anchors that a page's headings make, as GitHub spells them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_named_files_of_a_page_exist(page: Path) -> None:
    text = FENCE.sub("", page.read_text())
    broken = []
    for link in LINK.findall(text):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            broken.append(link)
    if page.name != "CHANGELOG.md":  # which tells of files that were there once
        broken += [n for n in NAMED.findall(text) if not any((b / n).exists() for b in BASES)]
    assert not broken


def test_the_kinds_of_questions_are_those_of_the_table() -> None:
    rows = re.findall(r"^\| `(\w+)` \| (.+?) \| .+? \| (.+) \|$",
                      (ROOT / "docs" / "questions.md").read_text(), re.MULTILINE)  # fmt: skip
    assert [kind for kind, _, _ in rows] == list(KINDS)
    for kind, raised, teaches in rows:
        spec = KINDS[kind]  # type: ignore[index]
        assert raised.startswith(spec.raised) and teaches == spec.teaches
        assert set(spec.codes) == set(re.findall(r"E\d+", raised))


@pytest.mark.parametrize(
    "path", sorted((ROOT / "tests" / "bench").glob("*.py")), ids=lambda p: p.name
)
def test_what_measures_can_be_started(path: Path) -> None:
    assert importlib.import_module(f"tests.bench.{path.stem}")
