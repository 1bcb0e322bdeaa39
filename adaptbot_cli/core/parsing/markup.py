"""Tool calls in tags, `<invoke name="wait"><parameter name="t">5</parameter>…`, and as in ReAct."""

import html
import re

from adaptbot_cli.core.parsing.jsonplan import REMARKS, flattened
from adaptbot_cli.core.parsing.literals import read_literal
from adaptbot_cli.core.parsing.scan import Item, kept, read_args, shown
from adaptbot_cli.core.plan import keyworded

_LONGEST = 4_000
_OPEN = re.compile(
    r"<(invoke|function_call|function|tool_call|tool_use|tool|call|action|step)\b"
    r"(?:=([\w.]+)|([^<>]*?))\s*(/?)>",
    re.IGNORECASE,
)
_LEAF = re.compile(
    r"<(\w+)(?:=(\w+)|[^<>]*?\bname\s*=\s*[\"'](\w+)[\"'][^<>]*|[^<>]*)>([^<]*)</\1\s*>"
)
_SAID = re.compile(r"\s*([^\W\d]\w*)\s*(?=<)")
_ATTRIBUTE = re.compile(r"(\w+)\s*=\s*[\"']([^\"'<>]*)[\"']")
_REACT = re.compile(
    r"[\s>*_]*action[ \t]*\d*[*_]*:[*_ \t]*`?([a-zA-Z]\w*)`?"
    r"(?:\[([^\[\]\n]*)\]|[*_ \t]*\n[\s>*_]*action[ ]input[ \t]*\d*[*_]*:[*_ \t`]*)",
    re.IGNORECASE,
)
_NAMES = ("action", "name", "tool_name", "function_name", "function", "tool")
_LISTS = ("args", "arguments", "parameters", "params", "input")


def read_markup(text: str, start: int, end: int) -> tuple[Item, int] | None:
    """Read the tool call whose tag opens in a line; returns it and where it ends, None if none."""
    opened = _OPEN.search(text, start, end)
    if opened is None or "(" in text[start : opened.start()]:
        return None
    attributes = dict(_ATTRIBUTE.findall(opened[3] or ""))
    closing = re.compile(rf"</{opened[1]}\s*>", re.IGNORECASE)
    closed = closing.search(text, opened.end(), opened.end() + _LONGEST)
    body = text[opened.end() : closed.start()] if closed and not opened[4] else ""
    leaves = _leaves(body)
    said = _SAID.match(body)
    names = [opened[2] or "", *_found(attributes), *_found(dict(leaves)), said[1] if said else ""]
    name = next((n.strip().rpartition(".")[2] for n in names if n), "")
    if not name.isidentifier():
        return None
    after = opened.end() if opened[4] else closed.end() if closed else end
    source = " ".join(text[opened.start() : after].split())
    if not opened[4] and closed is None:
        message = f"{shown(source)} cannot be read: its tag is never closed."
        return Item(opened.start(), source, code="P102", message=message), after
    given = [(k, v) for k, v in (*attributes.items(), *leaves) if k not in {*_NAMES, *REMARKS}]
    args = [arg for key, value in given for arg in _args(key, html.unescape(value).strip())]
    return Item(opened.start(), source[:_LONGEST], keyworded(name, kept(args))), after


def read_react(text: str, start: int, end: int) -> tuple[Item, int] | None:
    """Read `Action: wait` with `Action Input: …` in the next line, or `Action 1: wait[5]`.

    Returns it and where it ends, None if the line begins no such call.
    """
    match = _REACT.match(text, start)
    if match is None or match.start(1) > end:
        return None
    said, after = match[2], match.end()
    if said is None:
        opened = match.end()
        node = read_literal(text, opened)[0] if text[opened : opened + 1] in ("{", "[") else None
        after = node.end if node and node.end >= 0 else text.find("\n", opened)
        after = len(text) if after < 0 else after
        said = text[opened : min(after, opened + _LONGEST)]
    call = keyworded(match[1], kept(_args("input", said.strip().strip("`"))))
    return Item(match.start(1), " ".join(text[match.start(1) : after].split()), call), after


def _found(said: dict[str, str]) -> list[str]:
    return [said[name].strip() for name in _NAMES if name in said]


def _leaves(body: str) -> list[tuple[str, str]]:
    """Return the innermost elements by their names; `<arg_key>` names the `<arg_value>` behind."""
    leaves = [(m[2] or m[3] or m[1], m[4]) for m in _LEAF.finditer(body)]
    keys = ["", *(value.strip() if key == "arg_key" else "" for key, value in leaves)]
    pairs = zip(keys, leaves, strict=False)
    return [(key or name, value) for key, (name, value) in pairs if name != "arg_key"]


def _args(key: str, value: str) -> list[tuple[str, str]]:
    if key.lower() not in _LISTS:
        return [(key, value)]
    if value.startswith(("{", "[")):
        node, _ = read_literal(value, 0)
        return flattened(node) or []
    reading = read_args(f"{value})", 0)
    return list(reading.named()) if not reading.error else [("", value)]
