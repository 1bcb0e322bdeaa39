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
    assert "goal met" in shown.out and told[0]["id"].partition("-")[0] in shown.out
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


LEEK = "leek: {kind: object, obj_location: fridge}\n"


def test_an_error_is_an_object_where_an_object_is_waited_for(home: Home) -> None:
    ended = home.adaptbot("kg", "show", "unicorn", "--json")
    assert ended.code == 2 and ended.json()["error"]["code"] == "usage"
    assert "unicorn" in ended.json()["error"]["message"]
    ended = home.adaptbot("run", "make tea", "--world", "nowhere.ttl", "--json")
    assert ended.code == 6 and ended.json()["error"]["code"] == "world"
