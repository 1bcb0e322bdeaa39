"""A second robot: how it comes into a home, acts there, and is named in what is kept of it."""

from pathlib import Path

import pytest

from tests.cli.command import SECOND, Home

HOLDS = (
    "DELETE { ex:egg ex:obj_location ?x } INSERT { ex:egg ex:obj_location ex:robot_arm . "
    "ex:robot ex:obj_in_hand ex:egg } WHERE { ex:egg ex:obj_location ?x }"
)


def updated(home: Home, text: str) -> None:
    ended = home.adaptbot("kg", "query", "--update", text, "--yes")
    assert ended.code == 0, ended.said


@pytest.fixture(scope="module")
def two(used: Home) -> Home:
    """A home that a second robot has come into."""
    updated(used, SECOND)
    return used


def test_who_is_not_there_is_told_and_nothing_is_done(home: Home) -> None:
    ended = home.adaptbot("run", "make tea", "--robot", "robot2", "--no-human")
    assert ended.code == 2 and 'no robot "robot2"; there is robot; another is added' in ended.said
    ended = home.adaptbot("check", "-", "--robot", "egg", "--json", stdin=b"wait(5)")
    assert ended.code == 2
    assert ended.json()["error"]["remedy"].startswith("another is added to kg/kitchen/attributes")


def test_a_second_robot_is_shown_and_is_right(two: Home) -> None:
    shown = two.adaptbot("kg", "show", "robot2", "--json").json()
    assert shown["class"] == "agent" and shown["attributes"] == {"has_hand": "robot2_arm"}
    assert two.adaptbot("kg", "validate").code == 0
    none = two.write("none.yaml", "{}")
    assert (
        "nothing was learned"
        in two.adaptbot("kg", "add", "robot2", "--answers", none, "--yes").said
    )
    ended = two.adaptbot("kg", "query", "--update", "INSERT DATA { ex:r3 a ex:agent }", "--yes")
    assert ended.code == 4 and "r3: has no hand (has_hand)" in ended.said


def test_what_is_kept_of_a_run_says_which_robot_acted(two: Home) -> None:
    command = ("run", "make tea", "--no-human", "--apply", "--json")
    ended = two.adaptbot(*command, "--robot", "robot2")
    assert ended.code == 0 and ended.json()["robot"] == "robot2"
    assert two.trailers()["Robot"] == ["robot2"]
    shown = two.adaptbot("kg", "show", "robot2", "--json").json()
    assert shown["states"]["agent_near"] and "obj_in_hand" not in shown["states"]
    path = two.transcript
    assert "\nrobot: robot2\n" in path.read_text("utf-8")
    assert two.adaptbot("replay", str(path)).code == 0
    assert "robot2_arm" in two.adaptbot("progress", str(path), "--json").out
    assert "robot2" in two.adaptbot("runs", "show", path.stem).said
    assert two.adaptbot("runs", "--json").json()["runs"][0]["robot"] == "robot2"
    exported = two.adaptbot("export", str(path))
    assert exported.code == 0 and "<http://example.org/robot2>" in exported.out
    assert '"robot_arm"' not in exported.out
    stranger = two.write(
        "stranger.yaml", path.read_text("utf-8").replace("robot: robot2", "robot: r9")
    )
    ended = two.adaptbot("replay", stranger)
    assert ended.code == 2 and 'no robot "r9"; there are robot and robot2' in ended.said
    other = two.adaptbot("kg", "why", "robot2", "--json")
    assert '"robot": "robot2"' in other.out


def test_the_domain_s_own_robot_is_the_default_by_whatever_name(home: Home) -> None:
    run = ("run", "make tea", "--no-human", "--apply", "--json")
    homes = [Home(home.folder / name) for name in ("plain", "named")]
    told = []
    for each, more in zip(homes, ((), ("--robot", "robot")), strict=True):
        each.folder.mkdir()
        record = each.adaptbot(*run, *more).json()
        assert "robot" not in record and "Robot" not in each.trailers()
        for key in ("before", "after"):
            record["kg"].pop(key)
        record["usage"].pop("seconds")
        path = each.transcript
        text = path.read_text("utf-8").splitlines()
        kept = [n for n in text if not n.startswith(("graph:", "  revision:", "revision:"))]
        told.append((record, kept, files(each.workspace)))
    assert told[0] == told[1]


def files(workspace: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in (workspace / "kg" / "kitchen").iterdir()}


def test_what_the_other_holds_is_found_and_can_be_put_right(home: Home) -> None:
    updated(home, SECOND)
    updated(home, HOLDS)
    plan = b'pick_up("egg")\nput_down("egg", "bowl")\n'
    ended = home.adaptbot("check", "-", "--robot", "robot2", stdin=plan)
    assert ended.code == 3 and "E402 steps 1 and 2 robot holds egg" in ended.said
    assert home.adaptbot("check", "-", stdin=b'put_down("egg", "bowl")').code == 0
    ended = home.adaptbot("run", "make omelette", "--robot", "robot2", "--no-human", "--json")
    assert ended.code == 3
    assert ("E402", "robot holds egg") in {
        (f["code"], f["message"]) for f in ended.json()["findings"]
    }
    answers = home.write(
        "answers.yaml", "egg: {obj_location: drawer}\nchives: {existence: absent}\n"
    )
    run = ("run", "make omelette", "--robot", "robot2", "--answers", answers, "--json")
    ended = home.adaptbot(*run)
    assert ended.code == 0 and ended.json()["questions"][0]["about"] == "egg"
    assert home.trailers()["Fact-1"][:2] == [
        "- egg obj_location robot_arm",
        "- robot obj_in_hand egg",
    ]
    assert home.replays()
    updated(home, HOLDS)
    assert home.adaptbot("kg", "set", "egg", "place", "fridge", "--yes").code == 0
    assert home.adaptbot("kg", "show", "robot", "--json").json()["states"].keys() == {"agent_near"}
    assert home.adaptbot("run", "make omelette", "--robot", "robot2", "--no-human").code == 0


def test_a_session_goes_on_as_another_robot(two: Home) -> None:
    lines = b"robot robot9\nrobot robot2\nplan make tea\ndomain household\nquit\n"
    ended = two.adaptbot(stdin=lines, ADAPTBOT_PLAIN="1")
    assert ended.code == 0, ended.err
    assert "kitchen as robot2>" in ended.said and "household>" in ended.said
    assert "kitchen as robot2 ·" in ended.said and 'no robot "robot9"' in ended.said
