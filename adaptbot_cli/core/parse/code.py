"""Code around calls: the blocks that lines form, and the steps that they come to.

A function is its steps where it is called, a loop over what is written out is its steps turn by
turn, and a name is what it was given to mean. Whatever depends on more is told as a condition.
"""

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from adaptbot_cli.core.english import REPETITIONS, TIMES, count_of
from adaptbot_cli.core.parse.calls import (
    LEFT_OUT,
    WRAPPERS,
    Item,
    conditional,
    ends_line,
    fault,
    shown,
    swallow,
)
from adaptbot_cli.core.plan import keyworded

Value = str | tuple["Value", ...] | dict[str, "Value"] | None
"""What a name stands for: a text, values in order or by name; None if that is not known."""

BIND, RETURN, JUMP, PROSE, GAP = "bind", "return", "jump", "prose", "gap"
"""Codes of items that are no calls: a name given a value, the end of a function, a way out of a
loop, a line of prose, and what stands between calls."""

_MOST_STEPS = 500
_LONGEST = 5_000
_DEPTH = 20

# A function without arguments, and what starts it, rule nothing: the body is the plan.
_FUNCTION = re.compile(
    r"(?:(?:async|export|public|static|void)\s+)*(?:def|function|void)\s+(\w+)\s*\(([^()\n]{0,300})\)"
    r"[^:{(\n]{0,60}[:{]"
)
_FRAME = re.compile(
    r"if\s+__name__\s*==\s*[\"']__main__[\"']\s*:|class\s+\w+[^:{\n]{0,100}[:{]|with\s[^:\n]{0,100}:"
)
_FOR = re.compile(
    r"for\s+(?P<to>[\w\s,()]{1,80}?)\s+in\s+(?P<of>[^\n]{1,4000}?):\s*(?=\#|\Z|\w)"
    r"|for\s*\(\s*(?:const|let|var)\s+(?P<js>\w+)\s+of\s+(?P<list>[^\n]{1,4000}?)\)\s*\{"
)
_BINDING = re.compile(
    r"(?:(?:const|let|var)\s+)?([^\W\d]\w*)\s*(?::\s*\w[\w\[\], ]*)?="
    r"\s*(?=[\[\"'({]|[\d.]+\s*(?:[;\#]|\Z|\n))"
)
_RETURN = re.compile(r"return\b")
_JUMP = re.compile(r"(?:break|continue)\b\s*;?\s*(?:#|\Z)")

_WORD = re.compile(
    r"(?:\}\s*)?(if|elif|else|unless|otherwise|for|while|repeat|try|except|finally)\b"
    r"(?=[\s:,({]|\Z)",
    re.IGNORECASE,
)
_TIMES = re.compile(
    rf"(?:(?:(?:repeat|loop|do|perform|for)\b[^\n:({{\d]{{0,40}}?[\s(])?({TIMES}|\d{{1,3}}\.times)"
    r"|(?:repeat|loop)\s*\(?(\d{1,3}))\)?\s*(?:[:{][\s*_]*|\bdo\b|\Z)"
    rf"|({TIMES})\s+(?=\w)|[^\n:(){{]{{0,80}}?[\s(,](?:\w+\s)?({TIMES})\)?[\s*_]*[:{{][\s*_]*\Z",
    re.IGNORECASE,
)
"""A head that says how often the steps below are done: "Repeat twice:", "do this 3 times {"."""
_KEYED = re.compile(
    rf"(?:{'|'.join(REPETITIONS)}|for_?each|while|until|if|unless):"
    r"[ ]+(\S[^\n]*)"
)
"""A key of a structure that says how often, or when, the steps beside it are done."""
_LOOP = re.compile(
    r"\s*(?:\w+\s*:?=|\w+(?:\s*,\s*\w+)*\s+in\b|each\b|every\b|all\b|\()", re.IGNORECASE
)
_THEN = re.compile(r"\bthen\b:?", re.IGNORECASE)
_MARKS = re.compile(r"\"[^\"]*+\"|(?<!\w)'[^']*+'|[()\[\]:,]")
_SENTENCE_END = re.compile(r"[.!?]\s+(?=[A-Z`])")
_ENGLISH = ("unless", "otherwise", "repeat")
_BRANCHES = ("if", "elif", "else", "unless", "otherwise")


@dataclass(slots=True)
class Block:
    """Lines that stand under a head, told by indentation: a frame, function, loop or condition.

    `often` tells that the head only says how often or when, so that it needs steps of its own;
    `listed` that a list may stand below the head in the same column.
    """

    indent: int
    kind: str = "frame"
    head: str = ""
    start: int = 0
    name: str = ""
    params: tuple[str, ...] = ()
    over: str = ""
    often: bool = False
    listed: bool = False
    body: list["Item | Block"] = field(default_factory=list)

    def items(self) -> Iterator[Item]:
        """Yield all items within, in the order written."""
        for entry in self.body:
            if isinstance(entry, Block):
                yield from entry.items()
            else:
                yield entry


Head = tuple[Block, int, int, bool]
"""A head in a line: its block, where what it rules begins and ends in the line, and whether the
lines below are ruled too."""


def read_header(text: str, start: int, end: int, indent: int, fenced: bool) -> Head | None:
    """Read the head that a line's content, from `start` to `end`, begins with, if any.

    "If the pan is dirty, clean it" is one as well; "For the salad:" and "While it boils:" are not.
    """
    function = _FUNCTION.match(text, start, end)
    frame = function or _FRAME.match(text, start, end)
    head = text[start:end].rstrip(" :,{\t")[:200]
    if frame is not None:
        block = Block(indent, "function" if function else "frame", head, start)
        if function:
            block.name = function[1]
            block.params = tuple(re.findall(r"(?:\A|,)\s*\*{0,2}(\w+)", function[2]))
        return block, frame.end(), end, True
    counted = _TIMES.match(text, start, end) or _KEYED.match(text, start, end)
    if counted is not None:
        often = count_of(next(filter(None, counted.groups()), "").replace(".", " "))
        keyed = counted.re is _KEYED
        body = end if keyed else counted.end()
        head = text[start:body].rstrip(" :{\t*_")
        # What stands beside a key is in its column, what stands below a sentence is deeper.
        indent = start - text.rfind("\n", 0, start) - 2 if keyed else indent
        block = Block(indent, "loop" if often else "condition", head, start, over=f"range({often})")
        block.often = True
        return block, body, end, not text[body:end].strip(" {*_`\t")
    word = _WORD.match(text, start, end)
    if word is None or (text[word.end() : word.end() + 1] == "(" and ends_line(text, word.end())):
        return None
    loop = _FOR.match(text, start, end)
    if loop is not None:
        block = Block(indent, "loop", text[start : loop.end()].rstrip(" :{"), start)
        block.name, block.over = loop["to"] or loop["js"], loop["of"] or loop["list"]
        return block, loop.end(), end, True
    return _condition(text, word, end, indent, fenced)


def _condition(text: str, match: re.Match[str], end: int, indent: int, fenced: bool) -> Head | None:
    word = match[1].lower()
    # In prose the condition ends with its sentence.
    sentence = None if fenced else _SENTENCE_END.search(text, match.end(), end)
    until = sentence.start() if sentence else end
    colon, comma = _separators(text, match.end(), until)
    if word == "for" and not _LOOP.match(text, match.end(), end):
        return None
    if word in _ENGLISH and text[match.end() : match.end() + 1] == "(":
        return None
    # "While it boils:" is prose, and "repeat this until it is clean" rules no line below.
    code = fenced or match[1].islower() or word == "for"
    braced = "{" in text[match.end() : end] or text[match.end() : end].rstrip().endswith(" do")
    if word not in _BRANCHES and (not code or (colon < 0 and not braced)):
        return None
    comma = -1 if fenced else comma
    body = _body(text, match, until, colon, comma)
    # "If it is dirty, clean it first:" has said its piece; the lines below are the plan again.
    alone = until == end and not text[body:end].strip(" {*_`\t")
    opens = alone and not 0 <= comma < max(body, colon)
    head = text[match.start(1) : body].rstrip(" :,{\t") or match[1]
    return Block(indent, "condition", head, match.start(1)), body, until, opens


def _body(text: str, word: re.Match[str], end: int, colon: int, comma: int) -> int:
    """Find where the condition ends and what it rules begins."""
    call_before_colon = comma >= 0 and text.find("(", comma, colon) >= 0
    if colon >= 0 and not call_before_colon:
        return colon + 1
    then = _THEN.search(text, word.end(), end)
    if then and not 0 <= comma < then.start() - 1:
        return then.end()
    if word[1].lower() in ("else", "try", "finally"):
        return word.end()
    if text[word.end() : end].lstrip().startswith("("):
        return swallow(text, text.index("(", word.end()) + 1)
    if comma >= 0:
        return comma + 1
    return end if text.find("(", word.end(), end) < 0 else word.end()


def _separators(text: str, start: int, end: int) -> tuple[int, int]:
    """Find the first colon and the first comma outside quotes and brackets, -1 if there is none."""
    depth = 0
    comma = -1
    for mark in _MARKS.finditer(text, start, end):
        char = mark[0]
        if char in "([":
            depth += 1
        elif char in ")]":
            depth -= 1
        elif depth == 0 and char == ",":
            comma = mark.start() if comma < 0 else comma
        elif depth == 0 and char == ":":
            return mark.start(), comma
    return -1, comma


def read_statement(text: str, start: int, end: int, after: int, fenced: bool) -> Item | None:
    """Read a line that is code, but neither head nor call: a constant, `return`, `break`.

    `after` is where the list or map that a binding opens in the line is closed.
    """
    if _RETURN.match(text, start, end) and "(" not in text[start:end]:
        return Item(start, text[start:end], code=RETURN)
    if _JUMP.match(text, start, end):
        return Item(start, text[start:end], code=JUMP)
    bound = _BINDING.match(text, start, end)
    if bound is None or _value_of(text[bound.end() : after], {}) is None:
        return None
    source = text[start:end].rstrip()
    return Item(
        start,
        source,
        code=BIND,
        message=text[bound.end() : after],
        written=(bound[1], "c" * fenced),
    )


def binds(text: str, start: int, end: int) -> int:
    """Return where the value begins that a line gives a name to, 0 if it does not."""
    bound = _BINDING.match(text, start, end)
    return bound.end() if bound else 0


class Steps:
    """Works out the steps of blocks: `out` gets the items, in the order in which they are done."""

    def __init__(self, root: Block) -> None:
        self.out: list[Item] = []
        self._functions: dict[str, Block] = {}
        self._called: set[str] = set()
        self._stack: list[str] = []
        self._unused: dict[str, Item] = {}
        self._seen: set[tuple[int, str]] = set()
        self._define(root)
        self._run(root.body, {}, "")
        self._uncalled(root)
        for item in self._unused.values():
            self.out.append(fault(item.start, item.source, "nothing makes use of it"))

    def _define(self, block: Block) -> None:
        for entry in block.body:
            if isinstance(entry, Block):
                # A function without steps, such as a stub, is an action of the robot.
                if entry.kind == "function" and any(item.call for item in entry.items()):
                    self._functions[entry.name] = entry
                self._define(entry)

    def _uncalled(self, root: Block) -> None:
        """Leave functions out aloud that are never called, or take the only one for the plan."""
        left = [f for name, f in self._functions.items() if name not in self._called]
        inner = {item.call.action for f in left for item in f.items() if item.call}
        roots = [f for f in left if f.name not in inner or f.name in self._called]
        if len(roots) > 1:
            roots = [f for f in roots if f.name == "main"] or roots
        if len(roots) == 1 and not any(item.call or item.code == "P103" for item in self.out):
            self._run(roots[0].body, {}, "")
            left = [f for f in left if f is not roots[0] and f.name not in self._called]
        for function in left:
            why = f"{shown(function.head)} is never called: its steps are left out."
            self._add(Item(function.start, function.head, code=LEFT_OUT, message=why))

    def _add(self, item: Item) -> None:
        """Add an item; whatever is no call is told but once for its place."""
        key = (item.start, item.code)
        if item.call is not None or item.code == PROSE or key not in self._seen:
            self.out.append(item)
        self._seen.add(key)

    def _run(self, body: list[Item | Block], names: dict[str, Value], condition: str) -> bool:
        """Work out the items of a body; tells whether it returned."""
        for entry in body:
            if len(self.out) > 20 * _MOST_STEPS and self._stack:
                return True
            if isinstance(entry, Block):
                returned = self._block(entry, names, condition)
                if returned and entry.kind != "frame":
                    condition = condition or entry.head  # what follows is only done otherwise
                elif returned:
                    return True
            elif entry.code == RETURN:
                return True
            elif entry.code == BIND:
                name, code = entry.written
                known = None if condition else _value_of(entry.message, names)
                names[name] = known
                if code:
                    self._unused.setdefault(name, entry)
            elif entry.call is not None:
                self._call(entry, names, condition)
            elif entry.code == PROSE and condition:
                self._add(replace(entry, message=condition))
            elif entry.code != JUMP:
                self._add(entry)
        return False

    def _block(self, block: Block, names: dict[str, Value], condition: str) -> bool:
        if block.often and not any(item.call or item.code == PROSE for item in block.items()):
            message = f"{shown(block.head)} says how often or when, but not what is to be done."
            self._add(Item(block.start, block.head, code="P103", message=message))
        if block.kind == "function":
            return False
        if block.kind == "frame":
            return self._run(block.body, names, condition)
        targets = re.findall(r"\w+", block.name)
        turns = self._turns(block, names) if block.kind == "loop" and not condition else None
        if turns is None:
            names.update(dict.fromkeys(targets))
            return self._run(block.body, names, block.head) and block.kind == "condition"
        for value in turns:
            parts = value if len(targets) > 1 else (value,)
            if not isinstance(parts, tuple) or len(parts) != len(targets):
                parts = (None,) * len(targets)
            names.update(zip(targets, parts, strict=True))
            if self._run(block.body, names, ""):
                return False
        return False

    def _turns(self, block: Block, names: Mapping[str, Value]) -> tuple[Value, ...] | None:
        """Return what a loop goes through, None if that is not written out."""
        if any(item.code == JUMP for item in block.items()):
            return None
        values = _value_of(block.over, names)
        if isinstance(values, dict):
            values = tuple(values)
        self._unused = {
            k: v for k, v in self._unused.items() if not re.search(rf"\b{k}\b", block.over)
        }
        steps = sum(item.call is not None or item.code == PROSE for item in block.items())
        if not isinstance(values, tuple) or len(values) * max(steps, 1) > _MOST_STEPS:
            return None
        return values

    def _call(self, item: Item, names: dict[str, Value], condition: str) -> None:
        call = item.call
        if call is None:
            return
        args: list[tuple[str, Value]] = []
        for (name, arg), how in zip(
            call.named(), item.written or ("",) * len(call.args), strict=True
        ):
            args.append((name, self._meant(arg, how, names)))
        receiver = item.source.partition("(")[0].rpartition(".")[0]
        function = self._functions.get(call.action) if receiver in ("", "self") else None
        if function is not None and call.action not in self._stack and len(self._stack) < _DEPTH:
            self._enter(function, item, args, names, condition)
        elif self._executes(item, names):
            self._add(Item(item.start, item.source, code=LEFT_OUT))
        elif condition:
            self._add(conditional(item.start, item.source, condition))
        elif "l" in item.written and not self._object(args):
            self._add(fault(item.start, item.source, "an argument is a list or an object"))
        elif any(value is None or not isinstance(value, str) for _, value in args):
            why = "an argument is not written out"
            self._add(
                Item(item.start, item.source, code="P103", message=f"{shown(item.source)}: {why}.")
            )
        else:
            plain = [(name, value) for name, value in args if isinstance(value, str)]
            self._add(replace(item, call=keyworded(call.action, plain)))

    def _executes(self, item: Item, names: Mapping[str, Value]) -> bool:
        """Tell whether a call only has done what was read before: `for s in plan: do(s)`."""
        call = item.call
        if call is None or call.action.lower() not in WRAPPERS or not call.args:
            return False
        turns = all(names.get(arg.lstrip("*"), "") is None for arg in call.args)
        return turns and any(i.call or i.code == PROSE for i in self.out)

    def _object(self, args: list[tuple[str, Value]]) -> bool:
        """Take the entries of an object that is the only argument for the arguments."""
        if len(args) != 1 or not isinstance(args[0][1], dict):
            return False
        args[:] = args[0][1].items()
        return True

    def _enter(
        self,
        function: Block,
        item: Item,
        args: list[tuple[str, Value]],
        names: dict[str, Value],
        condition: str,
    ) -> None:
        """Work out the steps of a function where it is called."""
        self._called.add(function.name)
        params = [p for p in function.params if p not in ("self", "robot")]
        if function.params and not args:
            params = []  # the defaults are not known, and what depends on them is told
        by_name = {name: value for name, value in args if name}
        values = iter([value for name, value in args if not name])
        inner: dict[str, Value] = {**names, **dict.fromkeys(function.params)}
        inner |= {p: by_name[p] if p in by_name else next(values, None) for p in params}
        if next(values, item) is not item:
            why = f"{function.name} takes {len(params) or 'no'} arguments"
            self._add(fault(item.start, item.source, why))
            return
        self._stack.append(function.name)
        self._run(function.body, inner, condition)
        self._stack.pop()

    def _meant(self, arg: str, how: str, names: Mapping[str, Value]) -> Value:
        """Return what an argument stands for: a name without quotes what it was given to mean."""
        if how == "f":
            return _value_of(f"f{arg!r}", names)
        words = set(re.findall(r"\w+", arg)) & set(names) if how else set()
        if not words and how != "l":
            return arg
        for word in words:
            self._unused.pop(word, None)
        return _value_of(arg, names)


def _value_of(code: str, names: Mapping[str, Value]) -> Value:
    """Return the value of an expression, None if it depends on more than what is written."""
    # The parser of Python recurses; what no person writes out is not given to it.
    if len(code) > _LONGEST or "\\" in code:
        return None
    try:
        return _value(ast.parse(code.strip().rstrip(";"), mode="eval").body, names)
    except (SyntaxError, ValueError, RecursionError, MemoryError, KeyError, TypeError, IndexError):
        return None


def _value(node: ast.expr | None, names: Mapping[str, Value]) -> Value:
    """Return what a node stands for. Raises ValueError and the like where that is not known."""
    match node:
        case ast.Constant(value=str() | int() | float() as value):
            return str(value)
        case ast.Name(id=name) if names.get(name) is not None:
            return names[name]
        case ast.List(elts=parts) | ast.Tuple(elts=parts):
            return tuple(_value(part, names) for part in parts)
        case ast.Dict(keys=keys, values=values):
            return {_text(k, names): _value(v, names) for k, v in zip(keys, values, strict=True)}
        case ast.JoinedStr(values=parts):
            return "".join(_text(part, names) for part in parts)
        case ast.FormattedValue(value=inner, conversion=-1, format_spec=None):
            return _text(inner, names)
        case ast.BinOp(op=ast.Add(), left=left, right=right):
            return _text(left, names) + _text(right, names)
        case ast.Subscript(value=of, slice=at):
            held, key = _value(of, names), _text(at, names)
            return held[key] if isinstance(held, dict) else tuple(held or ())[int(key)]
        case ast.Call(func=ast.Attribute(value=of, attr=view), args=[]):
            held = _value(of, names)
            if isinstance(held, dict) and view in ("items", "keys", "values"):
                return tuple(held.items() if view == "items" else getattr(held, view)())
        case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords):
            return _counted(name, [*args, *(k.value for k in keywords)], names)
    raise ValueError


def _counted(name: str, nodes: list[ast.expr], names: Mapping[str, Value]) -> Value:
    """Return the values of `range`, `enumerate`, `zip`, `reversed`, `list` and `tuple`."""
    args = [_value(node, names) for node in nodes]
    lists = [arg for arg in args if isinstance(arg, tuple)]
    numbers = [int(arg) for arg in args if isinstance(arg, str)]
    if name == "range" and 1 <= len(numbers) == len(args) <= 3:
        return tuple(map(str, range(*numbers)[: _MOST_STEPS + 1]))
    if name == "enumerate" and len(lists) == 1:
        return tuple((str(n), value) for n, value in enumerate(lists[0], *numbers))
    if name == "zip" and len(lists) == len(args):
        return tuple(zip(*lists, strict=False))
    if name in ("list", "tuple", "reversed") and len(lists) == len(args) == 1:
        return lists[0][::-1] if name == "reversed" else lists[0]
    raise ValueError


def _text(node: ast.expr | None, names: Mapping[str, Value]) -> str:
    value = _value(node, names)
    if not isinstance(value, str):
        raise TypeError
    return value
