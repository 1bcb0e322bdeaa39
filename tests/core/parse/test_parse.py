"""The parser: one small text per behaviour, its properties, and the published recordings."""

import json
import keyword
import os
import re
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adaptbot_cli.core.findings import CODES
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Call, Parsed, keyworded

_DEFAULT = Path(__file__).parents[4] / "shared" / "published"
PUBLISHED = Path(os.environ.get("ADAPTBOT_PUBLISHED", _DEFAULT)) / "plans.dev.jsonl"

PLAN = """pick_up_obj("egg", "initial_onto.ttl") # get the egg
put_down_obj("egg", "pan")
switch("stove", "updated_onto.ttl")
wait(5)
switch("stove", "updated_onto.ttl")
put_down_obj("egg", "plate")
"""


def lines(text: str) -> list[str]:
    """The calls in a text as plan lines."""
    return [written.call.render() for written in parse(text).calls]


def codes(text: str) -> list[str]:
    return [finding.code for finding in parse(text).findings]


def message(text: str, code: str) -> str:
    found = [f.message for f in parse(text).findings if f.code == code]
    assert len(found) == 1, parse(text).findings
    return found[0]


def assert_sound(text: str) -> Parsed:
    """Check what holds of every text, and return the parse."""
    parsed = parse(text)
    rows = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    places = [(w.line, w.column) for w in parsed.calls]
    assert places == sorted(places)
    for finding in parsed.findings:
        assert finding.code in CODES
        assert finding.line is not None
        assert finding.column is not None
        assert finding.message.isprintable()
        places.append((finding.line, finding.column))
    for line, column in places:
        assert 1 <= line <= len(rows)
        assert 1 <= column <= len(rows[line - 1]) + 1
    assert parsed.calls or "P101" in [finding.code for finding in parsed.findings]
    return parsed


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('wait(5)\nclean("pan")', ["wait(5)", 'clean("pan")']),
        ('12. `pick_up_obj("egg")` # the egg', ['pick_up_obj("egg")']),
        ('3) clean("pan")', ['clean("pan")']),
        ("- wait(5)", ["wait(5)"]),
        ("* **wait(5)**", ["wait(5)"]),
        ("**Step 2:** wait(5)", ["wait(5)"]),
        ("> wait(5)", ["wait(5)"]),
        ("Next, wait(5) minutes.", ["wait(5)"]),
        ("'wait(5)',", ["wait(5)"]),
        ('pick-up("egg")', ['pick-up("egg")']),
        ("| 2 | wait(5) | boil |", ["wait(5)"]),
        ("<action>wait(5)</action>", ["wait(5)"]),
        ('### 1. `clean("pan")`', ['clean("pan")']),
        ('pick\\_up\\_obj("egg")', ['pick_up_obj("egg")']),
        ('clean("pan") // the pan', ['clean("pan")']),
        ('clean("pan"); wait(5);', ['clean("pan")', "wait(5)"]),
        ('clean("pan"), then wait(5) and fry("egg")', ['clean("pan")', "wait(5)", 'fry("egg")']),
        ("clean(pan) -> a clean pan", ['clean("pan")']),
        ("mix()", ["mix()"]),
        ('slice(\n  "egg",  # boiled\n\t"knife",\n)', ['slice("egg", "knife")']),
        ('robot.pick_up("egg")', ['pick_up("egg")']),
        ('egg = get_egg("fridge")', ['get_egg("fridge")']),
        ('slice ( "egg", "knife" )', ['slice("egg", "knife")']),
        ('\tclean("a")\r\nclean("b")\rclean("c")', ['clean("a")', 'clean("b")', 'clean("c")']),
        ('# clean("pan")\nwait(1) # then clean("pot")', ["wait(1)"]),
    ],
)  # fmt: skip
def test_reads_calls_in_markdown_and_code(text: str, expected: list[str]) -> None:
    assert lines(text) == expected
    assert not parse(text).findings


@pytest.mark.parametrize(
    ("text", "args"),
    [
        ("fry('egg')", ("egg",)),
        ("fry(“egg”)", ("egg",)),
        ("fry(‘egg’)", ("egg",)),
        ("fry(`egg`)", ("egg",)),
        ("fry(egg)", ("egg",)),
        ("fry(Egg on bread, pan)", ("Egg on bread", "pan")),
        ("fry('baker's egg')", ("baker's egg",)),
        (r'fry("the \"good\" egg")', ('the "good" egg',)),
        (r'fry("caf\u00e9 \ud83c\udf73")', ("café 🍳",)),
        (r'fry("a\q\\b")', ("a\\q\\b",)),
        ('fry(" egg ", "", , )', ("egg",)),
        ("fry(true, 2.5, -1)", ("true", "2.5", "-1")),
        ('fry("egg, (raw) # [x]")', ("egg, (raw) # [x]",)),
        ('fry("egg", "updated_onto.ttl")', ("egg",)),
        ('fry("egg", ".llm_kg_humanupdated_onto.ttl")', ("egg",)),
        ('fry("egg", onto=initial_onto.TTL)', ("egg",)),
        ('fry("egg", "on")', ("egg", "on")),
    ],
)
def test_reads_arguments_as_written(text: str, args: tuple[str, ...]) -> None:
    assert [written.call for written in parse(text).calls] == [Call("fry", args)]
    assert not parse(text).findings


def test_tells_where_and_how_a_call_is_written() -> None:
    (written,) = parse("Plan:\n\n 2. `fry( 'egg' )`;  # now").calls
    assert (written.source, written.line, written.column) == ("fry( 'egg' )", 3, 6)


def test_reads_several_fences_and_the_prose_between() -> None:
    text = (
        '```python\nwait(1)\n```\nThen fry:\n  ~~~\n  fry("egg")\n  ~~~\n```\nwait(2)\n```\nDone.'
    )
    assert lines(text) == ["wait(1)", 'fry("egg")', "wait(2)"]
    assert not parse(text).findings


def test_a_forgotten_closing_fence_does_no_harm() -> None:
    assert lines("```python\nwait(1)\n\n```python\nwait(2)\n```\nThat is all of it, folks") == [
        "wait(1)",
        "wait(2)",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "The pan (if clean) goes on the stove.",
        "Take the slice(s) of bread and the egg(s).",
        "- egg(s)",
        "slice(s) of bread",
        "### Chain of Thought (COT):",
        "COT(Chain of Thought): first the egg",
        "We use `mix_contents` instead of `mash_contents`.",
        "I will use the item specified (`mop_cloth`).",
        "If the pan is dirty, clean it first.",
        "For the salad:",
        'The ingredients are ["egg", "bread"].',
        "Ingredients: egg(2), bread(1) and so on",
    ],
)
def test_prose_is_no_call(text: str) -> None:
    assert codes(text) == ["P101"]
    assert codes(f"{text}\nwait(1)") == []
    assert lines(f"{text}\nwait(1)") == ["wait(1)"]


def test_prose_may_hold_calls_in_backticks_quotes_or_with_an_underscore() -> None:
    text = 'First `wait(5)` a bit, use clean("pan") and turn_on(stove) now.'
    assert lines(text) == ["wait(5)", 'clean("pan")', 'turn_on("stove")']


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('put_down(pick_up("egg"))', "a call inside the call"),
        ('fry("egg"', "parenthesis is never closed"),
        ("fry(egg", "parenthesis is never closed"),
        ('fry("egg)', "quote is never closed"),
        ('fry("egg" "pan")', "a comma is missing"),
        ('mix(["egg", "milk"])', "a list or an object"),
        ('pick_up_obj "egg"', "arguments in parentheses"),
        ("pick_up_obj[egg]", "arguments in parentheses"),
        ('```\naction "egg" "plate"\n```', "not a call"),
        ("```\ntime = 5\n```", "nothing makes use of it"),
    ],
)
def test_an_attempt_that_cannot_be_read_is_a_finding(text: str, why: str) -> None:
    assert why in message(text, "P102")
    (finding,) = (f for f in parse(f"wait(1)\n  {text}\nwait(2)").findings if f.code == "P102")
    assert finding.line == 2 + text.startswith("```")
    assert finding.column == (1 if text.startswith("```") else 3)
    assert lines(f"wait(1)\n  {text}\nwait(2)") == ["wait(1)", "wait(2)"]


def test_a_message_shows_no_control_characters_and_shortens_the_source() -> None:
    text = 'pick_up_obj("\x1b[31m\x00' + "x" * 200
    assert "`pick_up_obj(" in message(text, "P102")
    assert message(text, "P102").isprintable()
    assert len(message(text, "P102")) < 150


def test_an_unclosed_call_does_not_take_the_next_line_with_it() -> None:
    assert lines('fry("egg",\nwait(5)\n') == ["wait(5)"]
    assert codes('fry("egg",\nwait(5)\n') == ["P102"]


@pytest.mark.parametrize(
    ("text", "condition"),
    [
        ('if is_full("sink"):\n    empty("sink")', 'if is_full("sink")'),
        ('```python\nif dirty:\n\n    empty("sink")\n```', "if dirty"),
        ('if dirty: empty("sink")', "if dirty"),
        ('if dirty:\nempty("sink")', "if dirty"),
        ('if (dirty) empty("sink");', "if (dirty)"),
        ('if (dirty) {\n  empty("sink");\n}', "if (dirty)"),
        ('IF dirty THEN empty("sink")', "IF dirty"),
        ('else:\n    empty("sink")', "else"),
        ('for toy in toys:\n    empty("sink")', "for toy in toys"),
        ('for toy in ("a", "b"):\n    if toy:\n        empty("sink")', "if toy"),
        ('for toy in range(10**9):\n    empty("sink")', "for toy in range(10**9)"),
        ('for toy in range(1000):\n    empty("sink")', "for toy in range(1000)"),
        ('For each toy:\n- empty("sink")', "For each toy"),
        ('while is_full("sink"):\n    empty("sink")', 'while is_full("sink")'),
        ('try:\n    empty("sink")', "try"),
        ('- If the sink is full:\n  - empty("sink")', "If the sink is full"),
        ('If the sink is full, `empty("sink")` first. Then wait.', "If the sink is full"),
        ('If the sink is full:\n\n```\nempty("sink")\n```\n', "If the sink is full"),
        ('Otherwise, empty("sink").', "Otherwise"),
        ('empty("sink") if full else None', "if full else None"),
        ('[{"action": "empty", "args": ["sink"], "condition": "if full"}]', "if full"),
    ],
)
def test_a_call_under_a_condition_is_a_finding(text: str, condition: str) -> None:
    text += "\n\nwait(1)"
    assert lines(text) == ["wait(1)"]
    assert codes(text) == ["P103"]
    assert "empty" in message(text, "P103")
    assert condition in message(text, "P103")


@pytest.mark.parametrize(
    "text",
    [
        "```python\ndef make():\n    wait(1)\n    mix()\n    return True\n\nmake()\n```",
        'def make():\n    wait(1)\n    mix()\n\nif __name__ == "__main__":\n    make()',
        "async def make(self) -> None:\n    wait(1)\n    mix()",
        "```js\nfunction make() {\n  wait(1);\n  mix();\n}\nmake();\n```",
        "def make(): wait(1)\nmake()\nmix()",
    ],
)
def test_the_body_of_a_function_is_the_plan(text: str) -> None:
    assert lines(text) == ["wait(1)", "mix()"]
    assert not parse(text).findings


def test_a_function_is_its_steps_where_it_is_called() -> None:
    make = "def make(x, n=1):\n    wait(1)\n    mix(x)\n    return\n    wait(9)\n"
    assert lines(f'{make}make("a")\nwait(2)\nmake("b")') == [
        "wait(1)", 'mix("a")', "wait(2)", "wait(1)", 'mix("b")',
    ]  # fmt: skip
    assert lines(f'{make}def do_all():\n    make(x="c")\ndo_all()') == ["wait(1)", 'mix("c")']
    assert codes("def make():\n    wait(1)\nfor i in a:\n    make()") == ["P101", "P103"]
    assert codes("def make():\n    wait(1)\nmake(2)") == ["P101", "P102"]


@pytest.mark.parametrize(
    "text",
    ["wait(1)\nif a:\n    def make():\n        mix()", "def make(x):\n    mix(x)\n\nwait(1)"],
)
def test_a_function_that_is_never_called_is_left_out_aloud(text: str) -> None:
    assert lines(text) == ["wait(1)"]
    assert codes(text) == ["P105"]
    assert "never called" in message(text, "P105")


@pytest.mark.parametrize(
    "line",
    [
        "3. Slice the egg: slice(egg, knife)",
        "- **Slice it:** `slice(egg, knife)`.",
        "Now this: slice(egg, knife)  # thin",
    ],
)
def test_a_line_that_ends_with_a_call_behind_a_colon_is_a_call(line: str) -> None:
    text = f'wait(1)\n{line}\nfry("egg")'
    assert lines(text) == ["wait(1)", 'slice("egg", "knife")', 'fry("egg")']
    assert lines(f"wait(1)\n{line}") == ["wait(1)", 'slice("egg", "knife")']
    assert not parse(text).findings


@pytest.mark.parametrize(
    "line", ['Then slice(egg (boiled), "knife") it', 'So pick_up(egg (the "big" one)) is done']
)
def test_what_looks_like_a_call_is_never_passed_over(line: str) -> None:
    assert codes(f"wait(1)\n{line}") == ["P102"]


@pytest.mark.parametrize(
    "mark",
    ["1.2. ", "1.2 ", "a. ", "b) ", "(a) ", "ii. ", "- [ ] ", "- [x] ", "[1] ", "✅ ", "1️⃣ ", "◦ ",
     "→ ", "$ ", "第1步：", "await ", "Step 1.1: "],
)  # fmt: skip
def test_any_mark_of_a_list_may_lead_a_call(mark: str) -> None:
    assert lines(f"wait(1)\n{mark}slice(apple)\nwait(2)")[1:2] == ['slice("apple")']
    assert not parse(f"{mark}slice(apple)").findings


@pytest.mark.parametrize(
    "text",
    [
        "put（apple，bowl）",
        "put(“apple”，“bowl”）。",
        "3、放入：put(「apple」，「bowl」)；",
        "\u200bput(apple\u200b, bowl)",
    ],
)
def test_calls_in_the_punctuation_of_other_keyboards_are_read(text: str) -> None:
    assert lines(text) == ['put("apple", "bowl")']
    assert lines("1. 拿起苹果（从冰箱）\n2. 走") == []


@pytest.mark.parametrize("between", [" → ", " => ", " -> ", " ⇒ ", "; ", ", followed by ", " & "])
def test_calls_in_a_chain_are_all_read(between: str) -> None:
    assert len(parse(between.join(["PickUp(pot)", "Switch(stove, on)", "Wait(1)"])).calls) == 3


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('for toy in ["a", "b"]:\n    mix(toy)', ['mix("a")', 'mix("b")']),
        ('toys = (\n  "a",\n)\nfor toy in ["a"]:\n    mix(toy)', ['mix("a")']),
        (
            '```python\ntoys = [\n    "a",\n    "b",\n]\n\nfor toy in toys:  # each\n'
            "    robot.mix(toy, box)\n\n    wait(t=1)\nmix()\n```",
            ['mix("a", "box")', "wait(t=1)", 'mix("b", "box")', "wait(t=1)", "mix()"],
        ),
        ('for i in range(1, 3):\n    mix(f"toy_{i}")', ['mix("toy_1")', 'mix("toy_2")']),
        (
            'for a, b in [("x", "y")]:\n    for c in ["u", "v"]:\n        mix(a, b, c)',
            ['mix("x", "y", "u")', 'mix("x", "y", "v")'],
        ),
        (
            'for n, a in enumerate(["x"], start=1):\n    print(f"{n}")\n    mix(a, n)',
            ['mix("x", 1)'],
        ),
        ('for _ in range(2):\n    mix("pan")\n    wait(5)', ['mix("pan")', "wait(5)"] * 2),
        ("def make():\n    for a in ['x']:\n        mix(a)\n    wait(1)", ['mix("x")', "wait(1)"]),
        ('```\npot = "pan"\nmix(pot)\nmix("pot")\n```', ['mix("pan")', 'mix("pot")']),
        ('for a in ["x"]:\n    print(a)\n    mix(a)', ['mix("x")']),
        ("```\nrobot = Robot()\nrobot.mix(pan)\n```", ['mix("pan")']),
        (
            "```\nfrom robot import mix\nmix(pan)\nassert done\npass  # done\n```",
            ['mix("pan")'],
        ),
    ],
)
def test_what_code_says_beforehand_is_read(text: str, expected: list[str]) -> None:
    assert lines(text) == expected
    assert not {"P102", "P103"} & {*codes(text)}


def test_steps_behind_a_return_are_left_out_aloud() -> None:
    text = 'def plan():\n    fetch("egg")\n    return\n    fry("egg")\n\nplan()'
    assert lines(text) == ['fetch("egg")'] and codes(text) == ["P105"]
    assert "stands behind `return`" in message(text, "P105")


def test_a_step_of_a_loop_stands_where_it_is_written() -> None:
    steps = parse('wait(1)\nfor a in ["x", "y"]:\n    wait(2)\n    mix(a)').calls
    assert [(step.line, step.source) for step in steps] == [
        (1, "wait(1)"), (3, "wait(2)"), (4, "mix(a)"), (3, "wait(2)"), (4, "mix(a)"),
    ]  # fmt: skip


def test_printing_is_told_and_stops_nothing() -> None:
    assert codes('```\nwait(1)\nprint("done")\n```') == ["P105"]
    assert codes('```\nwait(1)\nprint(f"done {it}")\nwait(2)\n```') == ["P105"]
    assert codes('```\nwait(1)\nprint(mix("egg"))\n```') == ["P102"]


def test_every_call_of_a_body_is_told_of_and_the_block_ends_with_its_indentation() -> None:
    text = (
        "if a:\n    wait(1)\n    if b:\n        wait(2)\n    wait(3)\nelif c:\n    wait(4)\nwait(5)"
    )
    findings = parse(text).findings
    assert lines(text) == ["wait(5)"]
    assert [(f.code, f.line, f.column) for f in findings] == [
        ("P103", 2, 5),
        ("P103", 4, 9),
        ("P103", 5, 5),
        ("P103", 7, 5),
    ]
    assert "`if b`" in findings[1].message


def test_the_second_of_two_alternatives_is_a_finding() -> None:
    assert lines('clean("pan") or clean("pot")') == ['clean("pan")']
    assert codes('clean("pan") or clean("pot")') == ["P103"]


@pytest.mark.parametrize(
    "text",
    [
        'Do not slice("egg").',
        "**Never** use `slice(egg, pan)`!",
        'Please don\'t call the action slice("egg") here.',
        'Do not put the egg there with slice("egg").',
        'You should not slice("egg") yet.',
        'Instead of slice("egg") it is cooked whole.',
        'Avoid slice("egg"), as it is soft.',
        '- It is eaten without slice("egg").',
        '["Do not slice(\\"egg\\")", "wait(1)"]',
    ],
)
def test_a_call_that_is_not_to_be_run_is_a_finding(text: str) -> None:
    assert codes(f"{text}\nwait(1)") == ["P106"]
    assert lines(f"{text}\nwait(1)")[-1:] == ["wait(1)"]
    assert "slice" in message(f"{text}\nwait(1)", "P106")


@pytest.mark.parametrize(
    "text",
    [
        'Do not fry it. slice("egg")',
        'Do not forget to slice("egg")!',
        'The egg is not sliced, so slice("egg").',
        'The pan is not used then slice("egg")',
        'Instead of frying it use slice("egg").',
        'Do not wait: slice("egg")',
    ],
)
def test_a_negation_of_something_else_lets_a_call_be(text: str) -> None:
    assert lines(text) == ['slice("egg")']
    assert not parse(text).findings


def test_a_negation_goes_on_over_and_but_not_over_but() -> None:
    text = 'Never slice("egg") or fry("egg"), but boil("egg") and wait(5).'
    assert lines(text) == ['boil("egg")', "wait(5)"]
    assert codes(text) == ["P106", "P106"]


@pytest.mark.parametrize(
    "text",
    [
        '<think>\nslice("egg")?\n```\nmix()\n```\n</think>\nwait(1)',
        'I slice("egg") ...\n</think>\nwait(1)',
        'wait(1)\n<Thinking>\nor slice("egg")',
        '<!-- slice("egg") -->\nwait(1)',
        'wait(1)\n<!--\nslice("egg")\n',
        '~~slice("egg")~~ wait(1)',
    ],
)
def test_what_a_text_takes_back_is_left_out(text: str) -> None:
    assert lines(text) == ["wait(1)"]
    assert codes(text) == ["P105"]
    assert '`slice("egg")` is left out: the text takes it back' in message(text, "P105")


def test_marks_of_taking_back_in_code_and_strings_are_none() -> None:
    text = 'say("<think>", "~~a~~", "<!--")\n```\nsay("</think>")\n# <!-- so\nwait(1)\n```\nmix()'
    assert len(lines(text)) == 4
    assert parse("<think>Hm (yes).</think>\nwait(1)").findings == ()


@pytest.mark.parametrize(
    "text",
    [
        '[{"action": "slice", "args": ["onion", "knife"]}, {"action": "wait", "args": [5]}]',
        '{"plan": [{"name": "slice", "arguments": {"obj": "onion", "tool": "knife"}}, "wait(5)"]}',
        'Here\'s it:\n```json\n{"steps": ["slice(onion, knife)", "wait(5)"]}\n```\nEnjoy!',
        r'{"tool_calls": [{"type": "function", "function": {"name": "slice", "arguments":'
        r' "{\"obj\": \"onion\", \"tool\": \"knife\"}"}}, {"function": {"name": "wait",'
        r' "arguments": "{\"t\": 5}"}}]}',
        '<tool_call>{"name": "slice", "arguments": {"a": "onion", "b": "knife"}}</tool_call>\n'
        '<tool_call>\n{"name": "wait", "arguments": {"t": 5}}\n</tool_call>',
        '{"action": "slice", "args": "onion, knife"}\n{"action": "wait", "args": 5}',
        "plan = [\n  {'action': 'slice', 'args': ['onion', 'knife', 'updated_onto.ttl']},\n"
        "  {'action': 'wait', 'args': [5, None]},\n]",
        '[{"step": 1, "action": "slice", "object": "onion", "tool": "knife", "comment": "thin"},'
        ' {"step": 2, "action": "wait(5)"}]',
        'plan = [\n    slice("onion", "knife"),\n    wait(5),\n]',
        '[{"slice": ["onion", "knife"]}, {"wait": {"t": 5}}]',
        '{"plan": [{"slice": {"obj": "onion", "tool": "knife"}}, {"wait": [5]}]}',
    ],
)
def test_reads_json_and_tool_calls(text: str) -> None:
    calls = [written.call for written in parse(text).calls]
    assert [(c.action, c.args) for c in calls] == [("slice", ("onion", "knife")), ("wait", ("5",))]
    assert not parse(text).findings


@pytest.mark.parametrize(
    "text",
    [
        'put(loc="bowl", obj="apple", tidy=2)',
        "put(loc = bowl, onto=initial_onto.ttl, obj: 'apple', tidy=2)",
        '[{"action": "put", "args": {"loc": "bowl", "obj": "apple", "tidy": 2}}]',
        '[{"action": "put", "loc": ["bowl"], "obj": "apple", "tidy": "2", "note": "so"}]',
        r'{"name": "put", "arguments": "{\"loc\": \"bowl\", \"obj\": \"apple\", \"tidy\": 2}"}',
        '{"action": "put", "args": "loc=bowl, obj=apple, tidy=2"}',
    ],
)
def test_the_names_of_arguments_are_kept(text: str) -> None:
    (call,) = (written.call for written in parse(text).calls)
    assert call == Call("put", ("bowl", "apple", "2"), ("loc", "obj", "tidy"))
    assert lines(call.render()) == ['put(loc="bowl", obj="apple", tidy=2)']
    assert not parse(text).findings


@pytest.mark.parametrize(
    "text",
    [
        '<function_calls>\n<invoke name="put">\n<parameter name="obj">egg</parameter>\n'
        '<parameter name="loc">pan</parameter>\n</invoke>\n</function_calls>',
        "<tool_call>\n<function=put>\n<parameter=obj>\negg\n</parameter>\n<parameter=loc>\npan\n"
        "</parameter>\n</function>\n</tool_call>",
        "<tool_call>put\n<arg_key>obj</arg_key>\n<arg_value>egg</arg_value>\n"
        "<arg_key>loc</arg_key>\n<arg_value>pan</arg_value>\n</tool_call>",
        '1. <step id="1"><action>put</action><args>obj="egg", loc="pan"</args></step>',
        '<step action="put" obj="egg" loc="pan"/>',
        '<call><name>robot.put</name><parameters>{"obj": "egg", "loc": "pan"}</parameters></call>',
        "<tool_use><tool_name>put</tool_name><reason>it fries</reason>"
        "<obj>egg</obj><loc>pan</loc></tool_use>",
    ],
)
def test_reads_tool_calls_in_tags(text: str) -> None:
    parsed = parse(f"First:\n{text}\nwait(1)")
    assert [step.call.action for step in parsed.calls] == ["put", "wait"]
    assert parsed.calls[0].call.named() == (("obj", "egg"), ("loc", "pan"))
    assert not parsed.findings


@pytest.mark.parametrize(
    "text",
    [
        'Action: put\nAction Input: {"obj": "egg", "loc": "pan"}\nObservation: done',
        "**Action:** `put`\n**Action Input:** egg, pan",
        "Action 1: put[egg, pan]",
    ],
)
def test_reads_the_calls_of_react(text: str) -> None:
    parsed = parse(f"Thought: first the egg.\n{text}\nThought: then wait.\nAction 2: wait[1]")
    assert [(s.call.action, s.call.args) for s in parsed.calls] == [
        ("put", ("egg", "pan")),
        ("wait", ("1",)),
    ]
    assert "P102" not in codes(text)


def test_a_tag_that_is_never_closed_is_a_finding() -> None:
    assert codes('wait(1)\n<invoke name="put"><parameter name="obj">egg') == ["P102"]
    assert lines('<action>put("egg")</action>\n<step>wait(1)</step>') == ['put("egg")', "wait(1)"]


def test_a_map_of_one_list_in_prose_is_no_step() -> None:
    assert codes('[{"note": ["a"]}, {"steps": []}]') == ["P101"]
    assert lines('[{"pick_up": "egg"}, {"thought": "well"}, "wait(5)"]')[-1] == "wait(5)"


def test_an_argument_may_have_a_name_among_others_that_have_none() -> None:
    assert lines('put("apple", loc="bowl")') == ['put("apple", loc="bowl")']
    assert lines('[{"action": "mix", "args": {"of": ["a", "b"], "the bowl": "c"}}]') == [
        'mix("a", "b", "c")'
    ]


def test_a_call_with_one_argument_of_two_named_is_told_from_the_others() -> None:
    assert lines('mix("a", t=1)\nmix(t=1)') == ['mix("a", t=1)', "mix(t=1)"]


def test_a_recap_with_the_named_arguments_in_another_order_is_a_recap() -> None:
    plan = "\n".join(f'put(obj="{n}", loc="a")\nwait({n})' for n in range(3))
    again = "\n".join(f'put(loc="a", obj="{n}")\nwait({n})' for n in range(3))
    assert len(parse(f"{plan}\nIn short:\n{again}").calls) == 6
    other = again.replace("loc", "x").replace("obj", "loc").replace("x=", "obj=")
    assert len(parse(f"{plan}\nIn short:\n{other}").calls) == 12


def test_a_json_step_has_its_own_line_and_snippet() -> None:
    text = '[\n  {"action": "slice", "args": ["onion"]},\n  {"action": "wait", "args": [5]}\n]'
    second = parse(text).calls[1]
    assert (second.line, second.column) == (3, 3)
    assert second.source == '{"action": "wait", "args": [5]}'


@pytest.mark.parametrize(
    ("text", "expected", "why"),
    [
        ('[{"action": "wait", "args": [5]}, {"action": "fry", "args": ["e', ["wait(5)"], "breaks"),
        ('[{"action": "wait", "args": [5]} {"x": 1}]', ["wait(5)"], "breaks off"),
        ('["wait(5)", "then fry"]', ["wait(5)"], "not a step"),
        ('{"plan": [{"action": "Fry the egg"}, "wait(5)"]}', ["wait(5)"], "not a name"),
        ('[{"action": "wait", "args": [{"t": 5}]}]', [], "an argument is an object"),
    ],
)
def test_json_that_cannot_be_read_is_a_finding(text: str, expected: list[str], why: str) -> None:
    assert lines(text) == expected
    assert why in message(text, "P102")


def test_prose_that_stands_among_the_calls_is_left_out_with_a_word_about_it() -> None:
    text = '1. take("tea")\n2. Pour some tea\n# a remark\n3. wait(5)\nThen rest.\nwait(5)\n'
    assert lines(text) == ['take("tea")', "wait(5)", "wait(5)"]
    (found,) = parse(text).findings
    assert (found.code, found.line, found.column) == ("P105", 2, 4)
    assert "`Pour some tea` is no call" in found.message and "in line 5." in found.message

    many = "wait(5)\nOn.\n" * 9 + "wait(5)"
    assert message(many, "P105").endswith("in line 4, 6, 8, 10, 12 and on.")


def test_a_call_left_out_of_a_line_of_calls_is_told() -> None:
    text = "wait(1) and, as the recipe goes, Simmer(soup, low heat) for long\nwait(2)"
    assert lines(text) == ["wait(1)", "wait(2)"]
    assert "Simmer(soup, low heat)" in message(text, "P105")


@pytest.mark.parametrize(
    "text",
    [
        "wait(1)\n2. **Serve**\n   wait(2)",
        "1. wait(1)\n2. Serve\n   a. wait(2)",
        "- wait(1)\n- Serve\n  - wait(2)",
    ],
)
def test_what_heads_deeper_items_is_no_prose_among_the_calls(text: str) -> None:
    assert not parse(text).findings


def test_an_error_that_is_quoted_is_no_step() -> None:
    assert lines("wait(5)\n\nRuntimeError: switch(pan, on)\n") == ["wait(5)"]


def test_prose_in_a_string_of_json_is_told_by_itself() -> None:
    text = '{"steps": ["take(1)\\nThen rest\\nwait(5)"]}'
    assert "`Then rest` is no call" in message(text, "P105")


@pytest.mark.parametrize("prose", ["", "# on", "Next:", "**Next**", "## Next", "\nOn.", "On.\n"])
def test_headings_remarks_and_paragraphs_are_no_prose_among_the_calls(prose: str) -> None:
    assert parse(f"wait(5)\n{prose}\nwait(5)").findings == ()


def test_a_recap_is_dropped_once_told() -> None:
    text = f"```\n{PLAN}```\n\n### Action Sequence Recap:\n\n```\n{PLAN}```\n"
    assert len(parse(text).calls) == 6
    assert [w.line for w in parse(text).calls] == list(range(2, 8))
    assert "repeated from line 13: run once" in message(text, "P104")
    assert "lines 13 to 18" in message(text, "P104")


def test_the_ontology_argument_and_remarks_make_no_difference_to_a_recap() -> None:
    again = PLAN.replace("initial_onto", "updated_onto").replace('", "pan"', '", "Pan"')
    assert len(parse(f"{PLAN}\nIn short, once more.\n\n{again}").calls) == 6


def test_a_recap_that_leaves_out_or_adds_a_call_is_dropped_with_a_word_about_it() -> None:
    again = PLAN.replace("wait(5)\n", "") + 'clean("pan")\n'
    text = f"{PLAN}\nHere is the complete action sequence:\n{again}"
    assert lines(text) == lines(PLAN)
    assert 'adds `clean("pan")`' in message(text, "P104")
    assert "lacks 1 of the calls" in message(text, "P104")


def test_the_fuller_telling_is_kept() -> None:
    text = f'{PLAN}\n## Summary\n{PLAN}clean("pan")\n'
    assert lines(text) == [*lines(PLAN), 'clean("pan")']
    assert "lines 1 to 6" in message(text, "P104")


@pytest.mark.parametrize(
    "text",
    [
        PLAN + PLAN,
        f"{PLAN}\n### Final steps\n\n{PLAN.partition('switch')[0]}",
        'clean("pan")\n\nAgain:\n\nclean("pan")\n',
        f"{PLAN}\nNow the second egg:\n\n{PLAN.replace('egg', 'egg_2')}",
    ],
)
def test_what_a_plan_does_twice_is_kept(text: str) -> None:
    assert len(parse(text).calls) == text.count("(")
    assert not parse(text).findings


@pytest.mark.parametrize("text", ["", " \n\t\n", "\x00\x01\ud800\x7f", "Just fry it.", "()", "```"])
def test_a_text_without_a_call_says_so(text: str) -> None:
    parsed = assert_sound(text)
    assert not parsed.calls
    assert codes(text) == ["P101"]


def test_a_text_far_too_long_for_a_plan_is_read_up_to_a_point_that_is_named() -> None:
    parsed = parse('clean("pan")\n' * 50_000)
    assert len(parsed.calls) > 5_000
    assert "not read on from here" in parsed.findings[-1].message
    assert parsed.findings[-1].line in (parsed.calls[-1].line, parsed.calls[-1].line + 1)


NAMES = st.from_regex(r"\A[^\W\d]\w{0,12}\Z").filter(
    lambda name: (
        name.isidentifier() and not keyword.iskeyword(name.lower()) and name.lower() != "print"
    )
)
ARGS = st.text(min_size=1, max_size=20).filter(
    lambda arg: arg.isprintable() and arg == arg.strip() and not arg.lower().endswith(".ttl")
) | st.sampled_from(['"', "\\", '\\"', "a, b", "f(x)", "# x", "```", "if a:", "[", "{", "5", "1.5"])
CALL = st.builds(keyworded, NAMES, st.lists(st.tuples(NAMES | st.just(""), ARGS), max_size=4))
CALLS = st.lists(CALL, max_size=8)
FORMS = {
    "lines": lambda rows: "\n".join(rows),
    "fence": lambda rows: "```python\n" + "\n".join(rows) + "\n```",
    "numbers": lambda rows: "\n".join(f"{i}. {row}" for i, row in enumerate(rows, 1)),
    "bullets": lambda rows: "\n".join(f"- {row}" for row in rows),
    "backticks": lambda rows: "\n".join(f"* `{row}`  # so" for row in rows),
    "semicolons": lambda rows: "; ".join(rows),
    "strings": lambda rows: json.dumps({"plan": rows}, indent=1),
}
NASTY = st.text(alphabet="ab_(){}[]\"'`“”‘’,;:.#/\\\n\r \t=<>|*-0") | st.lists(
    st.sampled_from(
        ["if x:", "else:", "a_b(", '"', "'", ")", "\n", "  ", "```", '{"action":', "[", "]", "}",
         ",", "wait(5)", 'fry("egg")', "# ", "// ", "<think>", "</think>", "<!--", "-->", "~~",
         "do not ", " if ", "for i in x:", "recap:\n", "\ud800"]
    )
).map("".join)  # fmt: skip


@given(CALLS, st.sampled_from(sorted(FORMS)))
def test_reads_back_what_is_rendered(calls: list[Call], form: str) -> None:
    text = FORMS[form]([call.render() for call in calls])
    parsed = assert_sound(text)
    assert [written.call for written in parsed.calls] == calls
    assert {finding.code for finding in parsed.findings} <= {"P101"}


@given(st.lists(CALL, min_size=1), st.booleans())
def test_reads_back_what_is_json(calls: list[Call], by_name: bool) -> None:
    by_name = by_name and all(all(c.names) and len(set(c.names)) == len(c.args) for c in calls)
    steps = [{"action": c.action, "args": dict(c.named()) if by_name else c.args} for c in calls]
    found = [written.call for written in assert_sound(json.dumps(steps)).calls]
    assert found == [c if by_name else Call(c.action, c.args) for c in calls]


@settings(max_examples=300)
@given(st.text() | NASTY)
def test_no_text_raises(text: str) -> None:
    assert_sound(text)
    assert parse(text) == parse(text)


@pytest.mark.parametrize(
    "unit",
    ["(", '"', "'", "`", "#", "{", "[", "{\n", "[\n", "if ", "if \n", "if a:\n ", "x", "\n", "a(",
     "a(\n", "a(#", "a_b(“)", 'a_b("x"\n', "a(b,", "a(b) ", '["a(b)",', '{"action":"x"}\n', "[1,",
     '{"a":', "* ", "****a(", "\\", "_", "```\n", "<!--", "<think>", "</think>",
     "~~a", "a~~b~~", "do not ", "not a(\"b\") or ",
     "do not ____ ", "wait(5)\n\nfinal plan:\n", "\x00", "\ud800",
     "x = [\n", "1.1", "<step>\n", "<step><a>", "action:\n", "Action: a\nAction Input: {",
     '<invoke name="a">', "[x] ", "→ ",
     'for x in ["a"]:\n a(x)\n'],
)  # fmt: skip
def test_a_megabyte_takes_seconds_and_not_minutes(unit: str) -> None:
    text = unit * (1_000_000 // len(unit))
    # Not the clock on the wall: other tests may be running.
    start = time.process_time()
    parse(text)
    assert time.process_time() - start < 5


def recorded() -> list[str]:
    """Every answer of the published recordings, first answers first."""
    if not PUBLISHED.exists():
        pytest.skip(f"no recordings at {PUBLISHED} (set ADAPTBOT_PUBLISHED)")
    runs = [json.loads(row) for row in PUBLISHED.read_text("utf-8").splitlines()]
    answers = [trial["answers"] for run in runs for trial in run["trials"].values()]
    return list(dict.fromkeys(text for rounds in answers for text in rounds))


_CALLISH = re.compile(r"\b[a-z_]+\([^()]*\)")
_LEFT_OUT = re.compile(r"leaving out lines? (\d+)(?: to (\d+))?")


def test_no_call_of_the_recordings_is_lost() -> None:
    for text in recorded():
        parsed = assert_sound(text)
        told = {w.line for w in parsed.calls} | {f.line for f in parsed.findings}
        for finding in parsed.findings:
            dropped = _LEFT_OUT.search(finding.message)
            if dropped:
                told |= set(range(int(dropped[1]), int(dropped[2] or dropped[1]) + 1))
        for number, row in enumerate(text.split("\n"), 1):
            assert number in told or not _CALLISH.search(row.partition("#")[0]), row


def test_the_first_answers_hold_as_many_calls_as_counted_by_hand() -> None:
    recorded()
    for row in PUBLISHED.read_text("utf-8").splitlines():
        for trial in json.loads(row)["trials"].values():
            assert 3 <= len(parse(trial["answers"][0]).calls) <= 80
