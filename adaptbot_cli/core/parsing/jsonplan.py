"""Plans that are written as JSON or as tool calls: the steps in a value."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from adaptbot_cli.core.parsing.literals import Node, read_literal
from adaptbot_cli.core.parsing.scan import (
    LEFT_OUT,
    Item,
    conditional,
    kept,
    read_args,
    shown,
)
from adaptbot_cli.core.plan import keyworded

Reader = Callable[[str], Sequence[Item]]
"""Reads the calls in a plain text; a string of a JSON plan may hold some."""

Args = list[tuple[str, str]]

_KEYWORD = re.compile(r"[^\W\d]\w{0,80}")

_NAMED = ("action", "function", "action_name", "function_name", "tool_name", "primitive", "skill")
_NAMED_WITH_ARGS = ("name", "tool", "call", "command", "operation", "step")
_ARGS = (
    "args", "arguments", "parameters", "params", "kwargs", "argument", "input", "inputs",
    "action_input",
)  # fmt: skip
_PLANS = {
    "plan", "steps", "actions", "action_sequence", "actionsequence", "sequence", "calls",
    "commands", "tool_calls", "toolcalls", "function_calls", "task_plan", "plan_steps",
}  # fmt: skip
_TEXTS = {"content", "text", "answer", "output", "response", "result"}
_CONDITIONS = ("if", "condition", "unless", "while")
REMARKS = {
    "step", "id", "index", "number", "type", "thought", "reason", "reasoning", "comment",
    "comments", "description", "note", "notes", "explanation", "order", "purpose", "status",
    *_CONDITIONS,
}  # fmt: skip
_EMPTY = {"", "null", "none", "false", "true"}
_NO_ACTIONS = {*_PLANS, *_TEXTS, *REMARKS, *_NAMED, *_NAMED_WITH_ARGS, *_ARGS}
_LOOKED_AT = 50


def read_json(text: str, pos: int, read: Reader) -> tuple[list[Item], int]:
    """Read the list or map at `pos` as a plan; returns its items and where the reading ended.

    No items: it is no plan, however well-formed it may be.
    """
    node, end = read_literal(text, pos)
    items = list(_steps(node, text, read, planned=False))
    if node.end < 0 and items and not items[-1].code:
        message = f"The JSON breaks off at {_rest(text, end)}."
        items.append(Item(end, "", code="P102", message=message))
    return items, end


def _steps(node: Node, text: str, read: Reader, planned: bool) -> Iterator[Item]:
    """Yield the steps in a value. In a list of steps, whatever is none is told of."""
    if node.kind == "map":
        yield from _map_steps(node, text, read)
        return
    planned = planned or any(_is_step(item, read) for item in node.items[:_LOOKED_AT])
    if node.kind != "list":
        yield from _moved(read(node.text), node, text) if planned else ()
        return
    called = planned or all(_is_called(item, read) for item in node.items[:_LOOKED_AT])
    for item in node.items:
        if called and not _is_step(item, read) and _is_called(item, read):
            yield from _step_of(item.keys[0], item.items[0], item, text)
            continue
        found = list(_steps(item, text, read, planned))
        yield from found
        if not found and planned and not (item.kind == "list" and not item.items):
            yield _unread(item, text, "this is not a step")


def _map_steps(node: Node, text: str, read: Reader) -> Iterator[Item]:
    if _is_step(node, read):
        yield from _step(node, text, read)
        return
    for key, value in node.entries():
        told = key in _PLANS or (value.kind == "string" and key in _TEXTS)
        if told or value.kind in ("list", "map"):
            yield from _steps(value, text, read, planned=told)


def _is_step(node: Node, read: Reader) -> bool:
    if node.kind == "string":
        return "(" in node.text and bool(read(node.text))
    if node.kind != "map" or any(key in _PLANS for key, _ in node.entries()):
        return False
    name = _name(node)
    if name is None:
        return False
    if name.kind == "map":
        return _is_step(name, read) or _name(name) is not None
    named = node.get(*_NAMED) is not None or node.get(*_ARGS) is not None
    return name.kind in ("string", "word") and (named or "(" in name.text)


def _is_called(node: Node, read: Reader) -> bool:
    """Tell whether a map is an action's name with its arguments: `{"wait": {"t": 5}}`."""
    if node.kind != "map" or node.end < 0 or len(node.keys) != 1 or not node.items:
        return False
    key, value = node.keys[0], node.items[0]
    plain = all(n.kind in ("string", "word") and not _is_step(n, read) for n in value.items)
    if key.lower() in _NO_ACTIONS or not _KEYWORD.fullmatch(key) or not plain:
        return False
    return value.kind in ("list", "map") or (value.kind == "string" and "_" in key)


def _step_of(action: str, value: Node, node: Node, text: str) -> Iterator[Item]:
    args = flattened(value)
    if args is None:
        yield _unread(node, text, "an argument is an object")
    else:
        yield Item(node.start, _source(node, text), keyworded(action, kept(args)))


def _name(node: Node) -> Node | None:
    return node.get(*_NAMED, *_NAMED_WITH_ARGS)


def _step(node: Node, text: str, read: Reader) -> Iterator[Item]:
    name = _name(node)
    if name is None or node.end < 0:
        yield _unread(node, text, "it breaks off")
        return
    if name.kind == "map":
        yield from _step(name, text, read)
        return
    condition = next((c for key, c in node.entries() if key in _CONDITIONS), None)
    if condition is not None and condition.text.lower() not in _EMPTY:
        yield conditional(node.start, _source(node, text), condition.text)
        return
    values = node.get(*_ARGS)
    if "(" in name.text:
        found = _moved(read(name.text), node, text)
        yield from found or [_unread(node, text, "its action cannot be read")]
        return
    args = _rest_args(node, name) if values is None else flattened(values)
    action = name.text.strip().rpartition(".")[2]
    if args is None:
        yield _unread(node, text, "an argument is an object")
    elif not action or (values is None and not action.isidentifier()):
        yield _unread(node, text, "its action is not a name")
    else:
        yield Item(node.start, _source(node, text), keyworded(action, kept(args)))


def _rest_args(node: Node, name: Node) -> Args | None:
    """Take as arguments what a step says besides its action, remarks aside."""
    said = [(k, v) for k, v in node.entries() if v is not name and k not in REMARKS]
    keys, values = [k for k, _ in said], [v for _, v in said]
    return flattened(Node("map", node.start, node.end, items=values, keys=keys))


def flattened(node: Node) -> Args | None:
    """Flatten a value to arguments behind their names; None if an object stands where an argument
    should."""
    if node.kind == "string" and node.text.strip()[:1] in ("{", "["):
        inner, _ = read_literal(node.text.strip(), 0)
        return flattened(inner) if inner.end >= 0 else None
    if node.kind == "string" and "," in node.text:
        reading = read_args(node.text + ")", 0)
        return None if reading.error else list(reading.named())
    if node.kind in ("string", "word"):
        null = node.kind == "word" and node.text.lower() in ("null", "none")
        return [] if null else [("", node.text.strip())]
    args: Args = []
    for key, item in zip(node.keys or [""] * len(node.items), node.items, strict=False):
        if item.kind == "map":
            return None
        nested = [("", item.text.strip())] if item.kind == "string" else flattened(item)
        if nested is None:
            return None
        named = len(nested) == 1 and _KEYWORD.fullmatch(key)
        args += [(key, nested[0][1])] if named else nested
    return args


def _moved(items: Sequence[Item], node: Node, text: str) -> list[Item]:
    """Place what a string holds where the string stands."""
    source = _source(node, text)
    return [
        replace(item, start=node.start, source=item.source if item.code == LEFT_OUT else source)
        for item in items
    ]


def _unread(node: Node, text: str, why: str) -> Item:
    message = f"The step {_quoted(node, text)} cannot be read: {why}."
    return Item(node.start, _source(node, text), code="P102", message=message)


def _source(node: Node, text: str) -> str:
    return _quoted(node, text)[1:-1]


def _quoted(node: Node, text: str) -> str:
    end = node.end if node.end >= 0 else node.start + 200
    return shown(text[node.start : end])


def _rest(text: str, end: int) -> str:
    rest = text[end : end + 200].strip()
    return shown(rest) if rest else "the end of the text"
