"""What was run here, and the last thing learned taken back."""

from tests.cli.command import Home

CHIVES = "chives: {existence: exists, kind: object, obj_location: fridge}\n"


def test_runs_are_listed_newest_first_and_by_their_words(home: Home) -> None:
    assert home.adaptbot("runs").code == 0
    assert home.adaptbot("runs", "--json").json() == {"runs": []}
    home.adaptbot("run", "make tea", "--no-human")
    home.adaptbot("run", "make omelette", "--no-human", "--without", "egg")
    home.write("robot/transcripts/notes.yaml", "not: a run\n")
    told = home.adaptbot("runs", "--json").json()["runs"]
    assert [(run["task"], run["goal_met"]) for run in told] == [
        ("make omelette", False),
        ("make tea", True),
    ]
    only = home.adaptbot("runs", "tea", "--json").json()["runs"]
    assert only == told[1:] == home.adaptbot("runs", "tea", "--last", "1", "--json").json()["runs"]
    shown = home.adaptbot("runs")
    assert "goal met" in shown.out and told[0]["short"] in shown.out
    assert home.adaptbot("progress", told[1]["id"].partition("-")[0]).code == 0


def test_undo_takes_back_the_last_thing_learned_then_the_one_before(home: Home) -> None:
    answers = home.write("answers.yaml", CHIVES)
    assert home.adaptbot("run", "make omelette", "--answers", answers).code == 0
    leek = ("kg", "add", "leek", "--answers", home.write("a.yaml", LEEK))
    assert home.adaptbot(*leek).code == 2  # what it teaches is seen first, and nobody is there
    assert "leek" in home.adaptbot(*leek, "--dry-run").said
    assert home.adaptbot(*leek, "--yes").code == 0
    assert home.adaptbot("undo").code == 2  # it is shown first, and nobody is there to say yes
    assert "leek" in home.adaptbot("undo", "--dry-run").said
    assert home.adaptbot("undo", "--yes").code == 0
    assert home.adaptbot("kg", "show", "leek").code == 2
    assert home.adaptbot("kg", "show", "chives").code == 0
    assert home.adaptbot("undo", "--yes").code == 0
    assert home.adaptbot("kg", "show", "chives").code == 2
    assert "left to take back" in home.adaptbot("undo", "--yes").err


def test_undo_ends_though_an_old_value_has_come_back(home: Home) -> None:
    moved = [["kg", "set", "egg", "place", place, "--yes"] for place in ("drawer", "fridge")]
    ended = home.adaptbots([*moved, *[["undo", "--yes"]] * 3])
    assert [each.code for each in ended] == [0, 0, 0, 0, 2]


def test_a_run_is_named_by_the_beginning_of_its_id(home: Home) -> None:
    answers = home.write("answers.yaml", CHIVES)
    assert home.adaptbot("run", "make omelette", "--answers", answers).code == 0
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    tea, omelette = (run["short"] for run in home.adaptbot("runs", "--json").json()["runs"])
    assert len(tea) == len(omelette) < 20 and tea in home.adaptbot("runs").out
    for command in ("runs show", "progress", "export", "replay"):
        ended = home.adaptbot(*command.split(), omelette)
        assert ended.code == 0, (command, ended.err)
    assert "has ended" in home.adaptbot("resume", omelette).said
    assert home.adaptbot("kg", "log", tea, "--json").json() == []
    [taught] = home.adaptbot("kg", "log", omelette, "--json").json()
    assert taught["answers"][0]["taught"].startswith("there is chives")
    assert "may mean 2 runs" in home.adaptbot("runs", "show", omelette[:4]).said
    for command in ("runs show", "progress", "export", "replay", "resume", "kg log"):
        ended = home.adaptbot(*command.split(), "20010101T0000")
        assert ended.code == 2 and "no run or file is called" in ended.said, command


def test_two_runs_stand_side_by_side(home: Home) -> None:
    answers = home.write("answers.yaml", CHIVES)
    assert home.adaptbot("run", "make omelette", "--answers", answers).code == 0
    without = ("run", "make omelette", "--no-human", "--without", "chives")
    assert home.adaptbot(*without).code == 0
    second, first = (run["short"] for run in home.adaptbot("runs", "--json").json()["runs"])
    told = home.adaptbot("runs", "compare", first, second, "--json").json()
    assert [step["a"] for step in told["steps"]] == [
        'pick_up_obj("chives")',
        'put_down_obj("chives", "plate")',
    ]
    assert {step["b"] for step in told["steps"]} == {None} and told["b"]["without"] == ["chives"]
    assert "fridge" in told["a"]["questions"].values() and not told["b"]["questions"]
    assert told["a"]["run"]["planner"] == "plan library" and told["a"]["run"]["goal_met"]
    assert told["a"]["learned"] and not told["b"]["learned"]
    shown = home.adaptbot("runs", "compare", first, second)
    assert 'put_down_obj("chives", "plate")' in shown.out and "A fridge" in shown.out
    assert "→ fridge" in home.adaptbot("runs", "show", first).out
    assert home.adaptbot("runs", "compare", first, "--json").json()["error"]["code"] == "usage"


LEEK = "leek: {kind: object, obj_location: fridge}\n"


def test_an_error_is_an_object_where_an_object_is_waited_for(home: Home) -> None:
    ended = home.adaptbot("kg", "show", "unicorn", "--json")
    assert ended.code == 2 and ended.json()["error"]["code"] == "usage"
    assert "unicorn" in ended.json()["error"]["message"]
    ended = home.adaptbot("run", "make tea", "--world", "nowhere.ttl", "--json")
    assert ended.code == 6 and ended.json()["error"]["code"] == "world"
