"""One plan in every form that models write: each is read as the same calls, whatever is around it.

One of its actions is known to nobody: it is a step as well, for the checks to find.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.plan import Call
from adaptbot_cli.session.sources import load
from adaptbot_cli.workspace import Workspace

PLAN = (
    Call("pick_up_obj", ("egg",)),
    Call("put_down_obj", ("egg", "bowl")),
    Call("juggle", ("egg",)),
    Call("switch", ("stove", "on")),
    Call("wait", ("5",)),
    Call("pour_contents", ("bowl", "pan")),
)


def quoted(call: Call, quote: str = '"') -> str:
    return f"{call.action}({', '.join(f'{quote}{arg}{quote}' for arg in call.args)})"


def each(line: Callable[[int, Call], str], between: str = "\n") -> Callable[[Sequence[Call]], str]:
    return lambda calls: between.join(line(n, call) for n, call in enumerate(calls, start=1))


def record(action: str, args: str) -> Callable[[int, Call], str]:
    return lambda n, call: json.dumps({action: call.action, args: list(call.args)})


FORMS: dict[str, Callable[[Sequence[Call]], str]] = {
    "calls": each(lambda n, c: quoted(c)),
    "without quotes": each(lambda n, c: quoted(c, "")),
    "numbered": each(lambda n, c: f"{n}. {quoted(c)}"),
    "numbered steps": each(lambda n, c: f"**Step {n}:** {quoted(c, chr(39))}"),
    "items in backticks": each(lambda n, c: f"- `{quoted(c)}`"),
    "with remarks": each(lambda n, c: f"{quoted(c)}  # step {n}"),
    "with reasons": each(lambda n, c: f"{n}. {quoted(c)} - this is needed first"),
    "one line": each(lambda n, c: quoted(c), "; "),
    "arrows": each(lambda n, c: quoted(c), " -> "),
    "code": lambda calls: f"```python\n{FORMS['calls'](calls)}\n```",
    "methods": lambda calls: f"```js\n{each(lambda n, c: f'await robot.{quoted(c)};')(calls)}\n```",
    "a function": lambda calls: (
        f"def plan():\n{each(lambda n, c: f'    {quoted(c)}')(calls)}\n\nplan()\n"
    ),
    "tuples": lambda calls: f"plan = {[(c.action, *c.args) for c in calls]}",
    "JSON": lambda calls: f"[{each(record('action', 'args'), ', ')(calls)}]",
    "JSON below a key": lambda calls: (
        f'{{"plan": [{each(record("name", "parameters"), ",")(calls)}]}}'
    ),
    "JSON a line": each(record("action", "arguments")),
    "JSON strings": lambda calls: json.dumps([quoted(call, "'") for call in calls]),
    "YAML": each(lambda n, c: f"- action: {c.action}\n  args: [{', '.join(c.args)}]"),
    "YAML of calls": lambda calls: f"plan:\n{each(lambda n, c: f'  - {quoted(c)}')(calls)}",
    "a table": lambda calls: (
        f"| step | action |\n|---|---|\n{each(lambda n, c: f'| {n} | {quoted(c)} |')(calls)}"
    ),
    "tags": lambda calls: (
        f"<plan>\n{each(lambda n, c: f'<step>{quoted(c)}</step>')(calls)}\n</plan>"
    ),
    "PDDL": each(lambda n, c: f"({c.action} {' '.join(c.args)})"),
    "a script": each(lambda n, c: f"[{c.action}] {' '.join(f'<{arg}>' for arg in c.args)}"),
}
AROUND = (
    ("", ""),
    ("Sure! Here is the plan:\n\n", "\n\nLet me know if you need anything else!"),
    ("<think>The user wants eggs. Maybe slice them?</think>\n", "\n<|im_end|>"),
    ("# Plan\n\n", "\n\nNote: make sure that the stove is off."),
    ("Thought: there is one hand.\nPLAN:\n", "\n\n**Explanation:** each step is needed.\n"),
    ("Okay, so first I look at what is there.\n\nFinal answer:\n", "\n\nShall I change anything?"),
)


@pytest.mark.parametrize("form", FORMS)
def test_a_plan_is_the_same_in_every_form(form: str) -> None:
    parse = parser(load(Workspace(Path("nowhere")), "kitchen"))
    for before, behind in AROUND:
        parsed = parse(f"{before}{FORMS[form](PLAN)}{behind}")
        assert tuple(written.call for written in parsed.calls) == PLAN, (before, behind)
        assert {finding.code for finding in parsed.findings} <= {"P105"}
