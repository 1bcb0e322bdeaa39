"""What a command does not need, it does not import: starting takes no time that it need not."""

import pytest

from tests.cli.command import Home

SLOW = {"litellm", "nltk", "rdflib", "prompt_toolkit"}
_TELL = """
import sys
from adaptbot_cli.cli.main import main
try:
    main()
finally:
    print(*sorted({name.partition(".")[0] for name in sys.modules}), file=sys.stderr)
"""


def imported(home: Home, *arguments: str, stdin: bytes = b"") -> set[str]:
    """Return the packages that a command has imported when it ends."""
    return set(home.python("-c", _TELL, *arguments, stdin=stdin).err.splitlines()[-1].split())


@pytest.mark.parametrize("arguments", [["--help"], ["--version"], ["run", "--help"]])
def test_help_needs_nothing_slow(used: Home, arguments: list[str]) -> None:
    found = imported(used, *arguments)
    assert found & SLOW == set()
    assert "typer" in found


def test_a_run_with_the_library_needs_no_model_and_asks_for_a_word_once(home: Home) -> None:
    found = imported(home, "run", "make omelette", "--dry-run")
    assert {"rdflib", "nltk"} <= found  # the skillet is looked up
    assert found & {"litellm", "openai", "prompt_toolkit", "scipy"} == set()
    assert "nltk" not in imported(home, "run", "make omelette", "--dry-run")


def test_words_are_looked_up_only_where_one_is_unknown(used: Home) -> None:
    found = imported(used, "check", "-", stdin=b'pick_up_obj("egg")\nput_down_obj("egg", "bowl")\n')
    assert "rdflib" in found
    assert found & {"litellm", "nltk", "prompt_toolkit", "pygit2"} == set()


def test_looking_at_the_graph_needs_the_graph_only(used: Home) -> None:
    found = imported(used, "kg", "show", "egg")
    assert "rdflib" in found
    assert found & {"litellm", "nltk", "prompt_toolkit", "pygit2", "jinja2"} == set()
