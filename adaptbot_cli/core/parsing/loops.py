"""Python around calls that says beforehand what it does: constants, and loops over them.

`for toy in ["toy_1", "toy_2"]:` over plain calls is two steps for each call. Whatever depends on
more than what is written, such as a test or a function's answer, is left to be told as a condition.
"""

import ast
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from adaptbot_cli.core.parsing.literals import read_literal

Value = str | tuple["Value", ...]
"""What a name stands for: a text, or values in order."""

_MOST_STEPS = 500
_LONGEST = 5_000
_BINDING = re.compile(r"([^\W\d]\w*)\s*=\s*(?=([\[\"'(]|[\d.]+\s*(?:\#|\Z|\n)))")


@dataclass(frozen=True, slots=True)
class Binding:
    """A name that is given a value, up to the offset `end` of the text."""

    name: str
    value: Value
    end: int


@dataclass(frozen=True, slots=True)
class Turn:
    """A call of a loop in one of its turns: where it stands in the block, and its arguments."""

    line: int
    source: str
    action: str
    args: tuple[tuple[str, str], ...]


class _UnknownError(Exception):
    """Something is not known beforehand; never leaves this module."""


def binds(text: str, start: int, end: int) -> bool:
    """Tell whether a line looks as if it bound a constant."""
    return _BINDING.match(text, start, end) is not None


def read_binding(text: str, start: int, end: int) -> Binding | None:
    """Read `toys = ["toy_1", "toy_2"]`; a list may go on over several lines."""
    match = _BINDING.match(text, start, end)
    if match is None:
        return None
    after = read_literal(text, match.end())[0].end if match[2] == "[" else end
    try:
        # The parser of Python recurses; what no person writes out is not given to it.
        tree = ast.parse(
            text[match.end() : min(after, match.end() + _LONGEST)].strip(), mode="eval"
        )
        return Binding(match[1], _value(tree.body, {}), after)
    except (SyntaxError, ValueError, RecursionError, MemoryError, _UnknownError):
        return None


def unroll(block: str, names: Mapping[str, Value]) -> tuple[list[Turn], set[str]] | None:
    """Return the calls of a loop turn by turn and the names it uses; None if it is no such loop."""
    used: set[str] = set()
    try:
        body = _statements(textwrap.dedent(block))
        found = _turns(body, dict(names), used, block.splitlines())
        turns = list(islice(found, _MOST_STEPS + 1))
    except (SyntaxError, ValueError, RecursionError, MemoryError, _UnknownError):
        return None
    return (turns, used) if 0 < len(turns) <= _MOST_STEPS else None


def _statements(code: str) -> list[ast.stmt]:
    """Parse what a person could have written: Python's parser warns of escapes, and recurses."""
    if "\\" in code or len(code) > _LONGEST:
        raise _UnknownError
    return ast.parse(code).body


def _turns(
    body: list[ast.stmt], names: dict[str, Value], used: set[str], lines: list[str]
) -> Iterator[Turn]:
    for statement in body:
        if isinstance(statement, ast.For) and not statement.orelse:
            for value in _values(statement.iter, names, used):
                inner = {**names, **_bound(statement.target, value)}
                yield from _turns(statement.body, inner, used, lines)
        elif isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
            if not _prints(statement.value):
                yield _turn(statement.value, names, used, lines)
        elif not isinstance(statement, ast.Pass):
            raise _UnknownError


def _turn(call: ast.Call, names: dict[str, Value], used: set[str], lines: list[str]) -> Turn:
    action = call.func.attr if isinstance(call.func, ast.Attribute) else ast.unparse(call.func)
    if not action.isidentifier():
        raise _UnknownError
    named = [("", arg) for arg in call.args] + [(k.arg or "", k.value) for k in call.keywords]
    args = tuple((name, _text(arg, names, used)) for name, arg in named)
    return Turn(call.lineno - 1, lines[call.lineno - 1].strip(), action, args)


def _prints(call: ast.Call) -> bool:
    return isinstance(call.func, ast.Name) and call.func.id == "print"


def _values(node: ast.expr, names: dict[str, Value], used: set[str]) -> tuple[Value, ...]:
    """Return what a loop goes through, in order."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        if node.func.id == "enumerate" and node.args:
            rest = [*node.args[1:], *(k.value for k in node.keywords), ast.Constant(0)]
            first, values = _value(rest[0], names), _values(node.args[0], names, used)
            if isinstance(first, str):
                return tuple((str(n), value) for n, value in enumerate(values, int(first)))
        numbers = [_value(arg, names) for arg in node.args]
        if node.func.id != "range" or node.keywords or not 1 <= len(numbers) <= 3:
            raise _UnknownError
        turns = range(*(int(number) for number in numbers if isinstance(number, str)))
        return tuple(map(str, turns[: _MOST_STEPS + 1]))
    if isinstance(node, ast.Name):
        used.add(node.id)
    value = _value(node, names)
    if isinstance(value, str):
        raise _UnknownError
    return value


def _bound(target: ast.expr, value: Value) -> dict[str, Value]:
    if isinstance(target, ast.Name):
        return {target.id: value}
    if not isinstance(target, ast.Tuple) or len(target.elts) != len(value):
        raise _UnknownError
    pairs = zip(target.elts, value, strict=True)
    return {name.id: part for name, part in pairs if isinstance(name, ast.Name)}


def _text(node: ast.expr, names: dict[str, Value], used: set[str]) -> str:
    """Return an argument as text. A name that stands for nothing known is an item's."""
    if isinstance(node, ast.Name) and node.id not in names:
        return node.id
    if isinstance(node, ast.Name):
        used.add(node.id)
    return _string(node, names)


def _string(node: ast.expr, names: Mapping[str, Value]) -> str:
    value = _value(node, names)
    if not isinstance(value, str):
        raise _UnknownError
    return value


def _value(node: ast.expr, names: Mapping[str, Value]) -> Value:
    if isinstance(node, ast.Constant) and isinstance(node.value, str | int | float):
        return str(node.value)
    if isinstance(node, ast.List | ast.Tuple):
        return tuple(_value(item, names) for item in node.elts)
    if isinstance(node, ast.Name) and node.id in names:
        return names[node.id]
    if isinstance(node, ast.JoinedStr):
        return "".join(_part(part, names) for part in node.values)
    raise _UnknownError


def _part(node: ast.expr, names: Mapping[str, Value]) -> str:
    plain = node
    if isinstance(node, ast.FormattedValue) and node.conversion < 0 and not node.format_spec:
        plain = node.value
    return _string(plain, names)
