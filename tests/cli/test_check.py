"""`adaptbot check`, from the outside."""

import json
import random

import pytest

from tests.cli.command import Home, mapped
from tests.cli.shape import is_summary
from tests.evaluation.shared import published

TEA = """\
pick_up_rec("pot")
put_down_rec("pot", "stove")
pick_up_obj("water")
pour_contents("water", "pot")
switch("stove", "on")
boil("water", "pot")
pick_up_obj("tea")
put_down_obj("tea", "pot")
switch("stove", "off")
pick_up_rec("cup")
put_down_rec("cup", "table")
pour_contents("pot", "cup")
"""

ANSWER = """\
Sure! Here is how I would do it. First, fetch the egg (and only the egg):

```python
# the plan
pick_up_obj("egg")   # carefully
put_down_obj("egg", "sofa")
```

Let me know if you need anything else.
"""

HOME = """\
@prefix ex: <http://example.org/> .
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .

# a graph in one file, as the paper's authors publish them
ex:kitchen rdf:type ex:room ; ex:room_name "kitchen" .
ex:sofa rdf:type ex:imreceptacle ; ex:rec_name "sofa" ; ex:imrec_location ex:kitchen ;
    ex:open_rec true .
ex:egg rdf:type ex:object ; ex:obj_name "egg" ; ex:obj_location ex:sofa ; ex:IsBig false .
"""


def test_a_plan_that_fits(home: Home) -> None:
    ended = home.adaptbot("check", home.write("tea.plan", TEA), "--task", "make tea", "--json")
    told = ended.json()
    assert ended.code == 0 and is_summary(told)
    assert (told["task"], told["planner"], told["outcome"]) == ("make tea", "text", "executable")
    assert told["goal"]["met"] and told["findings"] == []
    assert told["kg"]["before"] is None and told["kg"]["after"] is None
    assert home.files() == {"tea.plan"}


def test_prose_and_fences_around_a_plan_from_stdin(home: Home) -> None:
    ended = home.adaptbot("check", "-", "--json", stdin=ANSWER.encode())
    told = ended.json()
    assert ended.code == 3 and is_summary(told)
    written = [step["call"] for step in told["steps"] if step["source"] is not None]
    assert written == [["pick_up_obj", "egg"], ["put_down_obj", "egg", "sofa"]]
    assert ("E201", "sofa", 2) in mapped(told["findings"], "code", "subject", "step")
    assert home.files() == set()


def test_findings_are_shown_and_nothing_is_dropped(home: Home) -> None:
    plan = home.write("p", 'pick_up_obj("moonstone")\nlevitate("egg")\nslice("egg")\n')
    ended = home.adaptbot("check", plan)
    assert (ended.code, ended.err) == (3, "")
    for told in ("moonstone", "levitate", "E201", "E101"):
        assert told in ended.said
    assert "dropped" not in ended.said


def test_without_repair_a_plan_is_judged_as_it_is(home: Home) -> None:
    plan = home.write("p", 'put_down_obj("egg", "pan")\nput_down_obj("spud", "pan")\n')
    mended = home.adaptbot("check", plan, "--json").json()
    told = home.adaptbot("check", plan, "--no-repair", "--json").json()
    assert ("inserted",) in mapped(mended["steps"], "status")
    assert mapped(told["steps"], "source", "status") == [
        ('put_down_obj("egg", "pan")', "finding"),
        ('put_down_obj("spud", "pan")', "finding"),
    ]
    assert mapped(told["findings"], "code", "step")[:2] == [("E401", 1), ("E201", 2)]


def test_a_plan_that_needs_no_repair_is_the_same_without(home: Home) -> None:
    plan = home.write("tea.plan", TEA)
    asked = ("check", plan, "--task", "make tea", "--json")
    repaired = home.adaptbot(*asked).json()["steps"]
    whole = home.write("whole", "\n".join(map(_line, repaired)))
    told = home.adaptbot(*asked[:1], whole, *asked[2:], "--no-repair").json()
    assert told["goal"]["met"]
    assert mapped(told["steps"], "call") == mapped(repaired, "call")


def _line(step: dict) -> str:
    action, *args = step["call"]
    return f"{action}({', '.join(map(json.dumps, args))})"


def test_a_finding_names_all_the_steps_that_the_table_marks(home: Home) -> None:
    lines = (published() / "plans.dev.jsonl").read_text().splitlines()
    row = next(r for r in map(json.loads, lines) if r["id"] == "gpt-3.5/cooking/16")
    plan = home.write("samosa", row["trials"]["llm"]["answers"][0])
    command = ["check", plan, "--domain", "kitchen", "--task", "make samosa"]
    told = home.adaptbot(*command, "--json").json()
    assert is_summary(told)
    for code in ("E202", "E302", "W603"):
        marked = [step["n"] for step in told["steps"] if code in step["codes"]]
        found = [finding for finding in told["findings"] if finding["code"] == code]
        assert sorted({n for finding in found for n in finding["steps"]}) == marked
        assert all(finding["step"] == finding["steps"][0] for finding in found)
    of_kind = next(f["steps"] for f in told["findings"] if f["code"] == "E202")
    shown = home.adaptbot(*command, COLUMNS="80")
    first, second, *rest = of_kind
    assert f"E202  steps {first}, {second} and {len(rest)} more  countertop" in shown.out
    assert len(rest) > 2 and "2 findings open" in shown.out


def test_no_plan(home: Home) -> None:
    texts = ("", "  \n\t\n", "I am sorry, I cannot help with that.")
    plans = [home.write(f"{n}.plan", text) for n, text in enumerate(texts)]
    for ended in home.adaptbots([["check", plan, "--json"] for plan in plans]):
        assert ended.code == 3 and is_summary(ended.json())
        assert (ended.json()["outcome"], ended.json()["steps"]) == ("no_plan", [])
        assert ("P101", None) in mapped(ended.json()["findings"], "code", "step")


def test_a_megabyte_of_junk(home: Home) -> None:
    junk = random.Random(7).randbytes(1_000_000) + b'\x00\x1b[31mpick_up_obj("egg")\x1b]0;x\x07'
    ended = home.adaptbot("check", "-", stdin=junk)
    assert ended.code == 3
    assert "\x1b" not in ended.out and "\x00" not in ended.out
    assert "Traceback" not in ended.err


def test_another_graph_and_required_items(home: Home) -> None:
    graph = home.write("home.ttl", HOME)
    plan = home.write("p", 'pick_up_obj("egg")\npick_up_obj("salt")\n')
    ended = home.adaptbot("check", plan, "--json", "--kg", graph, "--requires", "egg, flour")
    told = ended.json()
    assert ended.code == 3 and is_summary(told)
    assert (told["kg"]["nodes"], told["kg"]["edges"]) == ([3, 3], [10, 10])
    assert told["goal"]["missing"] == ["flour"]
    unknown = {f["subject"] for f in told["findings"] if f["code"] == "E201"}
    assert unknown == {"salt", "flour"}  # required and not known here: to be asked about
    assert "--kg" not in ended.err and home.files() == {"home.ttl", "p"}


GOAL = """
@prefix ab: <urn:adaptbot:> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
ab:task_hold_it a ab:Task ; rdfs:label "{}" ;
    ab:goal [ ab:ask "ASK {{ ex:egg ex:obj_location ex:robot_arm }}" ;
        ab:message "no egg is held" ] .
"""


@pytest.mark.parametrize("name", ["hold the egg", "make omelette"])
def test_a_graph_brings_its_own_tasks(home: Home, name: str) -> None:
    graph = home.write("home.ttl", HOME + GOAL.format(name))
    plan = home.write("p", 'pick_up_obj("egg")\n')
    asked = ("check", plan, "--json", "--task", name, "--kg", graph)
    ended = home.adaptbot(*asked)
    assert not any(f["code"] == "W606" for f in ended.json()["findings"])
    assert "no egg is held" not in ended.out, ended.out
    assert "no egg is held" in home.adaptbot("check", "-", *asked[2:], stdin=b"wait(1)").out
    wrong = home.write("wrong.ttl", HOME + GOAL.format(name).replace("ASK {", "TELL {"))
    refused = home.adaptbot(*asked[:-1], wrong)
    assert refused.code == 4 and "entry task_hold_it" in refused.err


def test_without_a_plan_stdin_is_named(home: Home) -> None:
    ended = home.adaptbot("check")
    assert (ended.code, ended.out) == (2, "") and "- to read it from stdin" in ended.err
