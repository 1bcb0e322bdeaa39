"""`adaptbot kg`, from the outside."""

from typing import Any

import pytest

from adaptbot_cli.session import sources
from adaptbot_cli.workspace import Workspace
from tests.cli.command import Ended, Home
from tests.cli.shape import THING, misfits

COMMANDS = {
    "all": ["show"],
    "all, json": ["show", "--json"],
    "item": ["show", "egg"],
    "item, json": ["show", "egg", "--json"],
    "class": ["show", "tool"],
    "class, json": ["show", "tools", "--json"],
    "place": ["show", "fridge"],
    "place, json": ["show", "Fridge", "--json"],
    "unknown": ["show", "eg"],
    "like nothing": ["show", "qqqqqq", "--json"],
    "hostile": ["show", "[red]\x1b[31m> . <x> <y"],
    "stats": ["stats"],
    "stats, json": ["stats", "--json"],
    "no revision": ["show", "egg", "--at", "HEAD"],
}


NOT_THERE = {
    ("show", "gerlic"): "called gerlic; near it: garlic",
    ("show", "make omelete"): "called make omelete; near it: omelette",
    ("show", "vesel"): "no thing, class, action or task is called vesel",
    ("show", "vessel"): "near it: vessel or container",
    ("show", "fecth"): "near it: fetch",
    ("why", "gerlic"): "nothing is called gerlic; near it: garlic",
    ("why", "pick_upp"): "near it: pick, pick_up, pick_up_obj",
    ("why", "omelete"): "nothing is called omelete",
    ("why", "make omelette"): "make omelette is a task, as tasks.ttl has it",
    ("why", "tools"): "tools is a class, as domain.ttl has it",
}
"""A name that nothing bears, or something that nobody teaches: one sentence says so."""


@pytest.fixture(scope="module")
def said(used: Home) -> dict[str, Ended]:
    """Run all commands in a home that has no workspace: the bundled kitchen is shown."""
    ended = used.adaptbots([["kg", *arguments] for arguments in COMMANDS.values()])
    return dict(zip(COMMANDS, ended, strict=True))


@pytest.mark.parametrize("name", ["all", "item", "class", "place", "stats"])
def test_what_is_read_is_shown(said: dict[str, Ended], name: str) -> None:
    assert said[name].code == 0 and said[name].err == ""
    assert said[name].out.strip()


def test_reading_writes_nothing(used: Home, said: dict[str, Ended]) -> None:
    assert used.files() == set()


def test_everything(said: dict[str, Ended]) -> None:
    told = said["all, json"].json()
    assert told.keys() == {"domain", "nodes", "edges", "things"}
    assert [m for thing in told["things"] for m in misfits(thing, THING)] == []
    assert {"egg", "fridge", "knife", "pan"} <= {thing["name"] for thing in told["things"]}
    for name in ("egg", "fridge", "knife", "pan"):
        assert name in said["all"].out


def test_an_item(said: dict[str, Ended]) -> None:
    told = said["item, json"].json()
    assert misfits(told, THING) == []
    assert (told["name"], told["class"], told["place"]) == ("egg", "object", "fridge")
    assert told["attributes"]["IsLiquid"] is False
    assert told["states"]["obj_location"] == "fridge"
    assert "fridge" in said["item"].out and "boilable" in said["item"].out


def test_a_class_by_its_singular_or_plural(said: dict[str, Ended]) -> None:
    told = said["class, json"].json()
    assert [m for thing in told for m in misfits(thing, THING)] == []
    assert {thing["class"] for thing in told} == {"tool"}
    assert all(
        thing["name"].replace("_", " ") in said["class"].said.replace("_", " ") for thing in told
    )


def test_a_place_with_what_is_there(said: dict[str, Ended]) -> None:
    told = said["place, json"].json()
    assert told["name"] == "fridge" and "egg" in told["holds"]
    assert "egg" in said["place"].out
    assert "fixed place" in said["place"].out and "imreceptacle" not in said["place"].out


def test_an_unknown_name(said: dict[str, Ended]) -> None:
    assert said["unknown"].code == 2 and "egg" in said["unknown"].err
    assert said["like nothing"].code == 2
    assert said["like nothing"].json()["error"]["code"] == "usage"
    assert said["hostile"].code == 2 and "\x1b" not in said["hostile"].err


def test_stats_count_what_is_there(said: dict[str, Ended], used: Home) -> None:
    told = said["stats, json"].json()
    kg = sources.load(Workspace(used.workspace), "kitchen")
    assert (told["nodes"], told["edges"]) == kg.size()
    assert told["actions"] == len(kg.domain.actions) and told["tasks"] == len(kg.domain.tasks)
    assert (
        misfits(
            told,
            {
                "domain": str,
                "nodes": int,
                "edges": int,
                "classes": dict,
                "actions": int,
                "tasks": int,
            },
        )
        == []
    )
    assert sum(told["classes"].values()) == _things(said["all, json"].json())
    assert str(told["edges"]) in said["stats"].out


def _things(told: Any) -> int:
    return len(told["things"])


def test_a_revision_that_is_not_there(said: dict[str, Ended]) -> None:
    assert said["no revision"].code == 4
    assert "HEAD" in said["no revision"].err


def test_a_name_that_nothing_bears(used: Home) -> None:
    ended = used.adaptbots([["kg", *arguments] for arguments in NOT_THERE])
    for one, told in zip(ended, NOT_THERE.values(), strict=True):
        assert (one.code, one.out, one.err.count("\n")) == (2, "", 1)
        assert told in one.err


def test_a_request_shows_its_task_and_another_name_its_action(used: Home) -> None:
    task, action = used.adaptbots(
        [["kg", "show", "make an omelette"], ["kg", "why", "pick_up", "--json"]]
    )
    assert task.out.startswith("omelette  task")
    assert action.json()["name"] == "pick_up_obj"
