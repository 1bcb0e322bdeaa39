"""What a taught action leaves in a home: kept, told where it is from, undone without a trace."""

import shutil
from pathlib import Path

import pytest

from adaptbot_cli.session import change
from adaptbot_cli.session.home import Home as Known
from adaptbot_cli.workspace import Workspace
from tests.cli.command import Home
from tests.loopback import scripted

PLAN = """\
peel("carrot", "knife")
crisp_up("carrot", "pan", 5)
activate("stove")
put_down_obj("carrot", "bowl")
put_down_rec("bowl", "table")
"""
ANSWERS = """\
peel: {existence: exists, like: slice}
crisp_up: {existence: exists, like: none, changes: ["obj: fried"], requires: ["rec: for frying"]}
activate: {existence: fixed, which: switch, part: state, state: "on"}
"""
ACTIONS = "kg/kitchen/actions.ttl"


TAUGHT = ("peel", "crisp_up", "activate")
TRACES = ("peel_needs", "crisp_up", "activate")


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Home:
    """Return a home where two actions and a name for one with a fixed argument were taught."""
    home = Home(tmp_path_factory.mktemp("once"))
    told = home.write("told.yaml", ANSWERS)
    with scripted(PLAN) as model:
        run = ("run", "make a snack", "--replans", "0", "--answers", told)
        ended = home.adaptbot(*run, **model.environment())
        assert ended.code == 3 and "✗ executable" in ended.said
    return home


@pytest.fixture
def taught(once: Home, tmp_path: Path) -> Home:
    """Return a copy of it."""
    shutil.copytree(once.folder, tmp_path, dirs_exist_ok=True)
    return Home(tmp_path)


def known(home: Home) -> Known:
    return Known(Workspace(home.workspace), "kitchen")


def undone(home: Home) -> bool:
    """Tell whether nothing is left of what was taught, in any file."""
    texts = [path.read_text(encoding="utf-8") for path in (home.workspace / "kg").rglob("*.ttl")]
    return not any(word in text for text in texts for word in TRACES)


def test_it_is_kept_whole(taught: Home) -> None:
    assert taught.adaptbot("domain", "check", "kitchen").code == 0
    assert taught.adaptbot("kg", "validate").code == 0
    told = taught.adaptbot("check", taught.write("again", PLAN), "--json").json()
    assert ["switch", "stove", "on"] in [step["call"] for step in told["steps"]]
    assert told["findings"] == []
    assert (taught.workspace / ACTIONS).read_text(encoding="utf-8").count("crisp_up_number") == 2


def test_why_tells_the_answer(once: Home) -> None:
    for name, told in zip(TAUGHT, once.adaptbots([["kg", "why", n] for n in TAUGHT]), strict=True):
        assert told.code == 0 and "make a snack" in told.said
        assert ("switch, always with state on" in told.said) == (name == "activate")


def test_the_difference_is_told_in_words_and_whole_to_programs(once: Home) -> None:
    said = once.adaptbot("kg", "diff", "HEAD~1", "HEAD").said
    assert "refused where" in said and "explained as" in said
    assert "DELETE" not in said and "_needs_1" not in said
    plain = once.adaptbot("kg", "diff", "HEAD~1", "HEAD", "--json").out
    assert "DELETE" in plain and "_needs_1" in plain


def test_the_log_tells_the_answers_and_no_entry_besides(once: Home) -> None:
    told = once.adaptbot("kg", "log", "-n", "1").said
    assert "activate is switch with state on" in told and "switch changed" not in told


def test_the_commit_is_undone_without_a_trace(taught: Home) -> None:
    ended = taught.adaptbot("kg", "revert", "HEAD", "--yes")
    assert ended.code == 0, ended.said
    assert undone(taught)
    assert taught.adaptbot("domain", "check", "kitchen").code == 0


def test_one_answer_after_the_other_is_undone(taught: Home) -> None:
    head = taught.adaptbot("kg", "log", "-n", "1").said.split()[0]
    rest = ((3, "activate", "crisp_up"), (2, "crisp_up", "peel"), (1, "peel", "ab:calledAs"))
    for n, gone, kept in rest:
        home = known(taught)
        change.commit(home, change.revert_answer(home, f"{head}.{n}"))
        text = (taught.workspace / ACTIONS).read_text(encoding="utf-8")
        assert gone not in text and kept in text
    assert undone(taught)


def test_each_is_retracted_with_its_parts(taught: Home) -> None:
    for name in TAUGHT:
        change.commit(known(taught), change.retract(known(taught), name))
        assert name not in (taught.workspace / ACTIONS).read_text(encoding="utf-8")
        assert taught.adaptbot("domain", "check", "kitchen").code == 0
    assert undone(taught)


def test_an_action_on_which_another_name_rests_is_not_retracted(once: Home) -> None:
    refused = once.adaptbot("kg", "retract", "switch", "--yes")
    assert refused.code == 2 and "actions.ttl" in refused.said


def test_show_and_why_tell_in_words_what_it_needs_and_does(once: Home) -> None:
    said = once.adaptbot("kg", "show", "crisp_up").said
    assert "not possible if rec is not for frying afterwards obj: fried" in said
    said += once.adaptbot("kg", "why", "crisp_up").said
    said += once.adaptbot("kg", "why", "activate").said
    assert "activate, state always true" in said
    assert not any(word in said for word in ("DELETE", "ASK", "?obj", "_needs_1", "_as_"))
    pack = once.adaptbot("kg", "why", "slice")
    assert "nobody taught it" in pack.said and "afterwards obj: sliced" in pack.said
    told = once.adaptbot("kg", "why", "slice", "--json").json()
    assert told["facts"] == [] and told["action"]["afterwards"] == ["obj: sliced"]


def test_the_robot_is_shown_by_its_name(once: Home) -> None:
    assert once.adaptbot("kg", "show", "robot", "--json").json()["class"] == "agent"
    assert "came with the kitchen pack" in once.adaptbot("kg", "why", "robot").said
