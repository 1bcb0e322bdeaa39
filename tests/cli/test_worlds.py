"""Plans carried out outside: a simulated home, real processes, and what can go wrong with them."""

import json
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from rdflib import Graph, URIRef

from adaptbot_cli.adapters.transcript.memory import Memory
from tests.cli.attended import CTRL_C, Tty, tty
from tests.cli.command import ROOT, SECOND, Ended, Home

WORLD = (ROOT / "examples" / "kitchen.ttl").read_text("utf-8")
ANSWERS = "pan: {mrec_location: sink}\negg: {obj_location: drawer}\n"

RUDE = """
import json, os, subprocess, sys, time

how = sys.argv[1]
log = open(sys.argv[2], "a")
if how == "leaves a child":
    child = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(600)"
    log.write(str(subprocess.Popen([sys.executable, "-c", child]).pid) + "\\n")
for line in sys.stdin:
    said = json.loads(line)
    log.write(line)
    log.flush()
    n = said.get("act")
    if "hello" in said:
        if how == "never ready":
            time.sleep(60)
        told = {"ready": True}
    elif "stop" in said:
        told = {"stopped": True}
        if how == "no goal":
            told = {"stopped": True, "goal": False, "reason": "the tea is cold"}
        if how == "no boolean":
            told = {"stopped": True, "goal": "no"}
        if how == "last words":
            sys.stdout.write("bye\\n")
    else:
        told = {"done": n}
        if n == 3 and how == "silent":
            time.sleep(60)
        if n == 3 and how == "late":
            time.sleep(1)
        if n == 3 and how == "dies":
            sys.stderr.write("motor 4 burnt out")
            sys.stderr.flush()
            os._exit(7)
        if n == 3 and how == "nonsense":
            sys.stdout.buffer.write(b"\\xff\\x00{{{ [red]\\n42\\n")
        if n == 3 and how == "unknown things":
            told["observed"] = [["unicorn", "obj_location", "fridge"], ["egg", "colour", "red"], 7]
        if n == 3 and how == "what a thing is":
            told["observed"] = [["tea", "has_dairy", True]]
        if how == "milk slips in" and said["action"] == "stir_contents":
            told["observed"] = [["milk", "obj_location", said["args"][0]]]
        if how == "fails what is seen" and said["expects"]["added"]:
            told = {"failed": n, "reason": "no echo", "observed": said["expects"]["added"]}
        if n == 3 and how == "contradicts itself":
            told["observed"] = [["cup", "mrec_location", "table"], ["cup", "mrec_location", "sink"]]
        if n == 3 and how == "floods":
            for _ in range(100000):
                sys.stdout.write("{}\\n")
        if n == 3 and how == "wrong step":
            sys.stdout.write(json.dumps({"done": 1}) + "\\n")
        if n == 3 and how == "closes its output":
            os.close(1)
            time.sleep(60)
        if n == 3 and how == "done and failed":
            told = {"done": 3, "failed": 3, "reason": "it is both"}
        if n == 3 and how == "says null":
            told = {"done": None, "failed": 3, "reason": "it is null"}
        if n == 1 and how == "no number":
            told = {"done": True}
        if n == 3 and how == "no character":
            told = {"failed": 3, "reason": "a \\ud800 b", "observed": [["\\udc80", 1, 2]]}
        if n == 3 and how == "what cannot be":
            told["observed"] = [["fridge", "mrec_location", "sink"], ["pot", "near", "sink"]]
        if n == 1 and how == "says it all at once":
            for ahead in range(2, 30):
                sys.stdout.write(json.dumps({"done": ahead}) + "\\n")
        if n == 3 and how == "says it all at once":
            told = {"failed": 3, "reason": "it was asked only now"}
        if n == 3 and how == "long line":
            sys.stdout.write("x" * 3000000 + "\\n")
        second = how == "holds the second step 4" and open(sys.argv[2]).read().count("hello") == 2
        if n == 4 and (how == "holds step 4" or second):
            while not os.path.exists(sys.argv[3]):
                time.sleep(0.02)
    sys.stdout.write(json.dumps(told) + "\\n")
    sys.stdout.flush()
    if "stop" in said:
        break
"""


def rude(
    home: Home, how: str, *more: str, seconds: float = 20, task: str = "make tea", **env: str
) -> Ended:
    """Have tea made by a process that behaves in some way."""
    return home.adaptbot(
        *("run", task, "--no-human", "--world", command(home, how)),
        *("--act-timeout", str(seconds), *more),
        **env,
    )


def command(home: Home, how: str) -> str:
    script = home.write("rude.py", RUDE)
    log, go_on = home.folder / "log", home.folder / "go on"
    return f"exec:'{sys.executable}' -IS '{script}' '{how}' '{log}' '{go_on}'"


def heard(home: Home) -> list[dict[str, Any]]:
    lines = (home.folder / "log").read_text().splitlines()
    return [json.loads(line) for line in lines if line.startswith("{")]


def test_a_home_that_differs_is_learned_and_the_goal_is_met_in_it(home: Home) -> None:
    run = ("run", "make omelette", "--world", home.write("world.ttl", WORLD))
    ended = home.adaptbot(*run, "--answers", home.write("answers.yaml", ANSWERS), "--json")
    assert ended.code == 0, ended.said
    told = ended.json()
    assert told["goal"]["met"] and told["world"] == {
        "failed": 2,
        "recovered": 1,
        "kind": str(home.folder / "world.ttl"),
    }
    failed = [(s["call"][0], s["message"]) for s in told["steps"] if s["done"] == "failed"]
    assert failed == [
        ("pick_up_obj", "egg is not at fridge"),
        ("switch", "the knob slipped"),
    ]
    assert {step["done"] for step in told["steps"]} == {"done", "failed"}
    assert [fact[:3] for fact in told["learned"]] == [
        ["pan", "mrec_location", "sink"],
        ["egg", "obj_location", "drawer"],
    ]
    egg = home.adaptbot("kg", "show", "egg", "--json").json()
    assert egg["place"] == "plate" and egg["states"]["IsFried"] is True
    why = home.adaptbot("kg", "why", "egg")
    assert "the robot's step 20" in why.said
    assert home.replays()
    (progress,) = (home.adaptbot("progress", "--json").json()["lines"][:1],)
    assert progress[0]["start"] == "fridge"


def test_nobody_to_ask_is_as_far_as_it_comes(home: Home) -> None:
    run = ("run", "make omelette", "--no-human", "--world", home.write("world.ttl", WORLD))
    ended = home.adaptbot(*run, "--json")
    told = ended.json()
    assert ended.code == 3 and not told["goal"]["met"] and told["outcome"] == "findings"
    assert [s["done"] for s in told["steps"]][:4] == ["done", "done", "failed", "not tried"]
    assert "E601" in {finding["code"] for finding in told["findings"]}
    assert home.adaptbot("kg", "show", "egg", "--json").json()["place"] is None
    undone = home.adaptbot("undo", "--yes")
    assert undone.code == 2 and "is no answer: adaptbot kg revert" in undone.said


def test_a_whole_home_is_taken_as_it_is_and_what_it_does_not_name_is_not_there(home: Home) -> None:
    graph = Graph()
    for name in ("attributes.ttl", "state.ttl"):
        graph.parse(ROOT / "kg" / "kitchen" / name)
    graph.remove((URIRef("http://example.org/egg"), None, None))
    whole = home.write("whole.ttl", graph.serialize())
    ended = home.adaptbot("run", "make omelette", "--no-human", "--world", whole, "--json")
    assert "where things are is all from this file" in ended.said
    told = ended.json()
    assert ended.code == 3
    assert [s["message"] for s in told["steps"] if s["done"] == "failed"] == [
        "there is no egg here"
    ]


def test_steps_slip_by_chance_and_seed_and_are_tried_again(home: Home) -> None:
    world = home.write("world.ttl", WORLD.partition("ex:egg")[0])
    noisy = ("--world", world, "--world-noise", "0.2", "--seed", "3", "--dry-run", "--json")
    first, second = (home.adaptbot("run", "make tea", "--no-human", *noisy).json() for _ in "ab")
    assert first["steps"] == second["steps"] and first["world"]["failed"] > 0
    assert first["world"]["recovered"] == first["world"]["failed"] and first["goal"]["met"]


FAULTS = {
    "late": (0, ""),
    "silent": (3, "it did not answer within"),
    "dies": (6, 'the process has ended with code 7 (it wrote: "motor 4 burnt out")'),
    "nonsense": (0, "no JSON object"),
    "unknown things": (0, 'there is no "unicorn" in this home'),
    "contradicts itself": (0, "several values of cup mrec_location"),
    "floods": (6, "its answers never end"),
    "wrong step": (0, "what was not asked for"),
    "long line": (0, "no JSON object"),
    "closes its output": (6, "it has closed its output"),
    "done and failed": (0, "it is both"),
    "says null": (0, "): it is null"),
    "no number": (0, 'what was not asked for: {"done": true}'),
    "no character": (0, "a ? b"),
    "what cannot be": (0, "it says what cannot be: fridge:"),
    "says it all at once": (0, "): it was asked only now"),
    "no goal": (3, "the world says that the goal is not met: the tea is cold"),
    "no boolean": (3, 'its goal is neither true nor false: "no"'),
    "last words": (0, "no JSON object"),
    "what a thing is": (0, "is for a person to say: tea has_dairy True"),
    "fails what is seen": (0, "): no echo"),
}
"""What a process does, the exit code, and what is said of it. A step that failed is tried again."""


SLOW = {"closes its output"}
"""A process that is given up only after all that is waited for; one that "dies" closes it, too."""


@pytest.mark.parametrize(
    "how", [pytest.param(how, marks=[pytest.mark.slow] * (how in SLOW)) for how in FAULTS]
)
def test_whatever_a_process_does_is_told_and_nothing_breaks(home: Home, how: str) -> None:
    code, told = FAULTS[how]
    ended = rude(home, how, seconds=2 if how in ("silent", "no number") else 30)
    assert ended.code == code, ended.said
    assert told in ended.said and "Traceback" not in ended.said
    if code == 0:
        assert "goal met" in ended.said
    acts = [said["act"] for said in heard(home) if "act" in said]
    assert acts == sorted(set(acts)) and acts[0] == 1
    assert home.replays()


def test_no_goal_is_met_against_what_the_world_says_that_a_thing_is_like(home: Home) -> None:
    ended = rude(home, "what a thing is", task="dairy-free tea")
    assert ended.code == 3 and "the world says otherwise: tea" in ended.said, ended.said
    assert home.replays()


def test_no_goal_is_met_with_what_the_request_excludes_in_the_dish(home: Home) -> None:
    ended = rude(home, "milk slips in", task="tea without milk")
    assert ended.code == 3 and "the request excludes milk, and it is in the cup" in ended.said
    assert home.replays()


def test_nothing_that_a_process_has_started_is_left_behind_or_waited_for(home: Home) -> None:
    assert rude(home, "leaves a child").code == 0
    child = int((home.folder / "log").read_text().splitlines()[0])
    wait_for(lambda: not Path(f"/proc/{child}/cmdline").is_file() or not cmdline(child))


def cmdline(process: int) -> str:
    """What a process runs, "" if it has ended."""
    return Path(f"/proc/{process}/cmdline").read_text()


def test_every_task_of_a_request_is_carried_out(home: Home) -> None:
    run = ("run", "make tea and omelette", "--no-human", "--world", command(home, "polite"))
    ended = home.adaptbot(*run)
    assert ended.code == 0, ended.said
    assert sum("hello" in said for said in heard(home)) == 2
    done = {said["action"] for said in heard(home) if "act" in said}
    assert {"boil", "fry"} <= done


MISTAKES = (
    ("ex:egg ex:obj_location ex:onion .", "egg: place (obj_location)"),
    ("ex:unicorn ex:obj_location ex:fridge .", "unicorn: nothing says what it is"),
    ("ex:egg ex:colour 'red' .", 'there is no property "colour"'),
    ("ex:pot ex:mrec_location ex:pot .", "is in itself"),
    ("ex:pot ex:mrec_location ex:sink, ex:rack .", "has 2 values"),
    ("ex:stove ab:fails [ ab:action 'swich' ] .", 'cannot fail to "swich"'),
    ("ex:stove ab:fails [ ab:action 'switch' ; ab:times 'many' ] .", "a whole number from 1"),
)


def test_mistakes_of_a_home_are_told_before_anything_is_done(home: Home) -> None:
    known = WORLD.partition("ex:egg")[0]
    worlds = [home.write(f"{n}.ttl", known + facts) for n, (facts, _) in enumerate(MISTAKES)]
    run = ["run", "make tea", "--no-human", "--world"]
    for (_, told), ended in zip(
        MISTAKES, home.adaptbots([[*run, world] for world in worlds]), strict=True
    ):
        assert ended.code == 6 and "Traceback" not in ended.said
        assert told in ended.said


@pytest.mark.parametrize(
    ("world", "code", "told"),
    [
        ("exec:no-such-program-here", 6, 'there is no program "no-such-program-here"'),
        ("exec:", 6, "exec: needs a command"),
        ("exec:'", 6, "cannot be read as a command"),
        ("nowhere.ttl", 6, "cannot read nowhere.ttl"),
        ("exec:cat", 6, "it did not say that it is ready"),
    ],
)
def test_a_world_that_is_none_is_an_error_with_what_to_do(
    home: Home, world: str, code: int, told: str
) -> None:
    ended = home.adaptbot("run", "make tea", "--no-human", "--world", world, "--act-timeout", "1")
    assert ended.code == code and "Traceback" not in ended.said
    assert told in ended.said or "it did not answer within 1 seconds" in ended.said


def test_what_is_said_to_the_process_is_as_the_protocol_has_it(home: Home) -> None:
    assert rude(home, "polite").code == 0
    hello, *acts, stop = heard(home)
    assert hello["hello"] == 1 and hello["task"] == "make tea" and hello["domain"] == "kitchen"
    assert "robot" not in hello
    assert {"name": "move", "parameters": ["place"]} in hello["actions"]
    assert acts[1] == {
        "act": 2,
        "action": "put_down_rec",
        "args": ["pot", "stove"],
        "arguments": {"rec": "pot", "loc": "stove"},
        "expects": {
            "added": [["pot", "mrec_location", "stove"], ["robot", "agent_near", "stove"]],
            "removed": [
                ["pot", "mrec_location", "robot_arm"],
                ["robot", "agent_near", "cabinet"],
                ["robot", "rec_in_hand", "pot"],
            ],
        },
    }
    assert stop == {"stop": "goal met"}


def interrupted(home: Home, terminal: Tty) -> None:
    """Press Ctrl-C while a step is held, let it go on, and see that the run ends."""
    terminal.process.send(CTRL_C)
    terminal.process.expect_exact("^C")  # it has come, and is only noted
    (home.folder / "go on").touch()
    assert terminal.ends() == 130


def test_ctrl_c_stops_after_the_step_at_hand_and_resume_goes_on_from_there(home: Home) -> None:
    run = ["run", "make tea", "--no-human", "--world", command(home, "holds step 4")]
    with tty(home, *run) as terminal:
        terminal.process.expect_exact(" 3 pick_up_obj")
        wait_for(lambda: any(said.get("act") == 4 for said in heard(home)))
        interrupted(home, terminal)
        assert "stopped; to go on from here: adaptbot resume" in terminal.said
    said = [message["act"] for message in heard(home) if "act" in message]
    assert said == [1, 2, 3, 4]
    assert home.adaptbot("kg", "show", "water", "--json").json()["place"] == "pot"
    ended = home.adaptbot("resume")
    assert ended.code == 0 and "goal met" in ended.said
    calls = [(m["action"], *m["args"]) for m in heard(home) if "act" in m]
    assert len(calls) == len(set(calls)), "a step was done twice"


def test_a_process_is_told_which_robot_acts_and_resume_acts_as_it(home: Home) -> None:
    assert home.adaptbot("kg", "query", "--update", SECOND, "--yes").code == 0
    run = ["run", "make tea", "--robot", "robot2", "--world", command(home, "holds step 4")]
    with tty(home, *run, "--no-human") as terminal:
        wait_for(lambda: any(said.get("act") == 4 for said in heard_so_far(home)))
        interrupted(home, terminal)
    assert home.trailers()["Robot"] == ["robot2"]
    ended = home.adaptbot("resume")
    assert ended.code == 0 and "kitchen as robot2" in ended.said
    said = heard(home)
    assert [m["robot"] for m in said if "hello" in m] == ["robot2", "robot2"]
    added = [fact for m in said if "act" in m for fact in m["expects"]["added"]]
    assert ["pot", "mrec_location", "robot2_arm"] in added
    assert not [fact for fact in added if "robot" in fact or "robot_arm" in fact]
    assert home.replays()


def test_a_step_that_is_answered_late_is_told_once_and_counts(home: Home) -> None:
    run = ["run", "make tea", "--no-human", "--world", command(home, "holds step 4")]
    with tty(home, *run, "--act-timeout", "3") as terminal:
        terminal.process.expect_exact("it did not answer within 3 seconds")
        (home.folder / "go on").touch()
        assert terminal.ends() == 0
    acts = [message["act"] for message in heard(home) if "act" in message]
    assert acts.count(4) == 1 and 5 not in acts
    calls = [(m["action"], *m["args"]) for m in heard(home) if "act" in m]
    assert len(calls) == len(set(calls)), "a step was told twice"
    assert home.replays()


def test_resume_does_not_take_up_a_task_again_that_has_come_to_its_end(home: Home) -> None:
    run = ["run", "make an omelette and tea", "--no-human"]
    with tty(home, *run, "--world", command(home, "holds the second step 4")) as terminal:
        wait_for(lambda: [m.get("act") for m in heard_so_far(home)].count(4) == 2)
        interrupted(home, terminal)
    ended = home.adaptbot("resume")
    assert ended.code == 0 and "goal met" in ended.said
    actions = [said["action"] for said in heard(home) if "act" in said]
    assert (actions.count("fry"), actions.count("boil")) == (1, 1)
    assert home.replays()


def heard_so_far(home: Home) -> list[dict[str, Any]]:
    return heard(home) if (home.folder / "log").is_file() else []


def wait_for(is_so: Any, seconds: float = 60) -> None:
    until = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < until
        time.sleep(0.02)


def test_steps_are_confirmed_at_the_terminal(home: Home) -> None:
    world = f"exec:'{sys.executable}' '{ROOT / 'examples' / 'robot.py'}'"
    run = ["run", "make tea", "--world", world, "--confirm", "each"]
    with tty(home, *run) as terminal:
        terminal.answers(
            ('Shall the robot do pick_up_rec("pot")?', "y"),
            ('Shall the robot do put_down_rec("pot", "stove")?', "n"),
        )
        assert terminal.ends() == 3 and "stopped after 1 step" in terminal.said


def test_the_example_keeps_to_the_protocol_and_others_are_told_where_they_do_not(
    home: Home,
) -> None:
    example = f"exec:'{sys.executable}' '{ROOT / 'examples' / 'robot.py'}'"
    good = home.adaptbot("world", "check", example, "--json")
    assert good.code == 0 and good.json()["good"]
    bad = home.adaptbot("world", "check", command(home, "polite"), "--act-timeout", "5")
    assert bad.code == 6 and "it said that it is done" in bad.said
    dead = home.adaptbot("world", "check", "exec:false")
    assert dead.code == 6 and "the process has ended with code 1" in dead.said
    assert home.adaptbot("world", "check", "robot.py").code == 2


def test_a_workspace_starts_no_process_before_it_is_trusted(home: Home, tmp_path: Path) -> None:
    assert home.adaptbot("run", "make tea", "--no-human").code == 0
    mark = tmp_path / "started"
    settings = home.workspace / "adaptbot.toml"
    settings.write_text(f"world = \"exec:touch '{mark}'\"\n")
    ended = home.adaptbot("run", "make tea", "--no-human")
    assert ended.code == 0 and "world ignored until" in ended.said and not mark.exists()
    assert home.adaptbot("trust", "--yes").code == 0
    assert home.adaptbot("run", "make tea", "--no-human").code == 6 and mark.exists()


def test_a_place_where_a_thing_was_seen_not_to_be_is_offered_last(home: Home) -> None:
    world = str(ROOT / "examples" / "kitchen.ttl")
    with tty(home, "run", "boiled egg", "--world", world) as terminal:
        terminal.waits('Where is "egg" kept?').sees("baking tray").types("\x03")
        listed = terminal.plain.rpartition('Where is "egg" kept?')[2].split()
        assert "cabinet" in listed and "fridge" not in listed  # beyond the first twelve


def test_what_was_kept_while_the_robot_acted_is_not_answered_again_by_a_resumed_run() -> None:
    asked = {"turn": "ask", "kind": "place", "prop": "obj_location", "answer": "sink"}
    turns: list[dict[str, Any]] = [
        {**asked, "about": "leek"},
        {"turn": "keep"},
        {"turn": "begin"},
        {**asked, "about": "egg"},
        {"turn": "keep"},
        {**asked, "about": "onion"},
    ]
    memory = Memory()
    memory.take(turns)
    assert {about for _, about, *_ in memory.answers} == {"leek", "onion"}
