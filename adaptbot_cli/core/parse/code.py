"""Code around calls: the blocks that lines form, and the steps that they come to.

A function is its steps where it is called, a loop over what is written out is its steps turn by
turn, and a name is what it was given to mean. Whatever depends on more is told as a condition.
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any

from adaptbot_cli.core.english import REPETITIONS, TIMES, count_of
from adaptbot_cli.core.parse import calls
from adaptbot_cli.core.parse.calls import BIND, JUMP, LEFT_OUT, RETURN, Item, Line, shown
from adaptbot_cli.core.parse.tree import read_literal
from adaptbot_cli.core.plan import keyworded

_MOST_STEPS = 500
_LONGEST = 5_000
_DEPTH = 20

# A function without arguments, and what starts it, rule nothing: the body is the plan.
_CODE = re.compile(
    r"(?:(?:async|export|public|static|void)\s+)*(?:def|function|void)\s+(?P<name>\w+)\s*"
    r"\((?P<params>[^()\n]{0,300})\)[^:{(\n]{0,60}[:{]"
    r"|if\s+__name__\s*==\s*[\"']__main__[\"']\s*:|class\s+\w+[^:{\n]{0,100}[:{]|with\s[^:\n]{0,100}:"
    r"|for\s*(?:\(\s*(?:const|let|var)\s+)?(?P<to>[\w\s,()]{1,80}?)\s+(?:in|of)\s+"
    r"(?P<over>[^\n]{1,4000}?)(?:\)\s*\{|:\s*(?=\#|\Z|\w))"
)
_BINDING = re.compile(
    r"(?:(?:const|let|var)\s+)?([^\W\d]\w*)\s*(?::\s*\w[\w\[\], ]*)?="
    r"\s*(?=[\[\"'({]|[\d.]+\s*(?:[;\#]|\Z|\n))"
)
_LEAVES = re.compile(r"(return\b(?![^\n]*\()[^\n]*)|(?:break|continue)\b\s*;?\s*(?:#|\Z)")
_WORD = calls.worded(
    r"(?:\}\s*)?(if|elif|else|unless|otherwise|for|while|repeat|try|except|finally|match|case)\b"
    r"(?=[\s:,({]|\Z)"
)
_TIMES = calls.worded(
    rf"(?:(?:(?:repeat|loop|do|perform|for)\b[^\n:({{\d]{{0,40}}?[\s(])?({TIMES}|\d{{1,3}}\.times)"
    r"|(?:repeat|loop)\s*\(?(\d{1,3}))\)?\s*(?:[:{][\s*_]*|\bdo\b|\Z)"
    rf"|({TIMES})\s+(?=\w)|[^\n:(){{]{{0,80}}?[\s(,](?:\w+\s)?({TIMES})\)?[\s*_]*[:{{][\s*_]*\Z"
)
"""A head that says how often the steps below are done: "Repeat twice:", "do this 3 times {"."""
_CHOICE = calls.worded(
    r"[*_]*(?:(?:(?:option|alternative|variant|approach|method)\s+(?:[2-9b-f]|two|three|four)"
    r"|plan\s+[b-f]|alternative\s+(?:plan|steps|sequence|approach))\b[^:\n]{0,40}:|alternatively\b[,:]?"
    rf"|(?P<brief>{calls.FORBIDDING}|(?:for )?examples?"
    r"|(?:(?:first|rough|initial) )?draft)[\s*_]*:)"
    r"[\s*_]*"
)
"""A head of what may be done in place of what stands before, only shows how, or never is done:
"Option 2:", "Example:", "Avoid:"."""
_KEYED = re.compile(rf"(?:{'|'.join(REPETITIONS)}|for_?each|while|until|if|unless):[ ]+(\S[^\n]*)")
"""A key of a structure that says how often, or when, the steps beside it are done."""
_LOOP = calls.worded(r"\s*(?:\w+\s*:?=|\w+(?:\s*,\s*\w+)* in\b|(?:each|every|all)\b|\()")
_THEN = calls.worded(r"\bthen\b:?")
_MARKS = re.compile(
    r"\"[^\"]*+\"|(?<!\w)'[^']*+'|\((?:[^()\n]|\([^()\n]*+\))*+\)|\[(?:[^\[\]\n]|\[[^\[\]\n]*+\])*+\]|([:,])"
)
"""A colon or a comma, unless it stands in quotes or brackets."""
_SENTENCE_END = re.compile(r"[.!?]\s+(?=[A-Z`])")


def is_step(item: Item) -> bool:
    """Tell whether an item is a call or may be a step in words."""
    return item.call is not None or item.code in (calls.PROSE, calls.SAID)


@dataclass(slots=True)
class Block:
    """Lines that stand under a head, told by indentation: a frame, function, loop or condition.

    `often` tells that the head only says how often or when, so that it needs steps of its own;
    `listed` that a list may stand below the head in the same column; `brief` that the next blank
    line or heading ends what it rules.
    """

    indent: int
    kind: str = "frame"
    head: str = ""
    start: int = 0
    name: str = ""
    params: tuple[str, ...] = ()
    over: str = ""
    often: bool = False
    brief: bool = False
    listed: bool = False
    line: Line = field(default_factory=Line)
    body: list["Item | Block"] = field(default_factory=list)

    def items(self) -> Iterator[Item]:
        """Yield all items within, in the order written."""
        for entry in self.body:
            yield from entry.items() if isinstance(entry, Block) else (entry,)

    def steps(self) -> int:
        """Count the calls and the lines that may be steps in words."""
        return sum(map(is_step, self.items()))


Head = tuple[Block, int, int, bool]
"""A head in a line: its block, where what it rules begins and ends in the line, and whether the
lines below are ruled too."""


def read_head(text: str, start: int, end: int, indent: int, fenced: bool) -> Head | None:
    """Read the head that a line's content, from `start` to `end`, begins with, if any.

    "If the pan is dirty, clean it" is one as well; "For the salad:" and "While it boils:" are not.
    """
    code = _CODE.match(text, start, end)
    if code is not None:
        kind = "function" if code["name"] else "loop" if code["over"] else "frame"
        params = tuple(re.findall(r"(?:\A|,)\s*\*{0,2}(\w+)", code["params"] or ""))
        head = text[start : end if kind == "frame" else code.end()].rstrip(" :,{\t")[:200]
        name = code["name"] or code["to"] or ""
        block = Block(indent, kind, head, start, name, params, code["over"] or "")
        return block, code.end(), end, True
    counted = _TIMES.match(text, start, end) or _KEYED.match(text, start, end)
    if counted is not None:
        often = count_of(next(filter(None, counted.groups()), "").replace(".", " "))
        keyed = counted.re is _KEYED
        body = end if keyed else counted.end()
        # What stands beside a key is in its column, what stands below a sentence is deeper.
        indent = start - text.rfind("\n", 0, start) - 2 if keyed else indent
        block = Block(indent, "loop" if often else "condition", text[start:body].rstrip(" :{\t*_"),
                      start, over=f"range({often})", often=True)  # fmt: skip
        return block, body, end, not text[body:end].strip(" {*_`\t")
    choice = _CHOICE.match(text, start, end)
    if choice is not None:
        head, opens = choice[0].strip(" :,*_\t"), not text[choice.end() : end].strip(" {*_`\t")
        # Their steps need not be deeper: of two ways the second goes on to the end.
        brief = choice["brief"] is not None
        in_list = start - text.rfind("\n", 0, start) - 1 > indent
        indent -= opens and not (brief and in_list)
        block = Block(indent, "condition", head, start, brief=brief)
        return block, choice.end(), end, opens
    word = _WORD.match(text, start, end)
    at = word.end() if word else end
    calls_it = text[at : at + 1] == "(" and calls.ends_line(text, at)
    return _condition(text, word, end, indent, fenced) if word and not calls_it else None


def _condition(text: str, match: re.Match[str], end: int, indent: int, fenced: bool) -> Head | None:
    """Read the head that begins with a word such as "if", unless that is prose."""
    word, behind = match[1].lower(), match.end()
    # In prose the condition ends with its sentence.
    sentence = None if fenced else _SENTENCE_END.search(text, behind, end)
    until = sentence.start() if sentence else end
    rest = text[behind:until]
    marks = [mark for mark in _MARKS.finditer(text, behind, until) if mark[1]]
    colon = next((mark for mark in marks if mark[1] == ":"), None)
    comma = next((mark for mark in marks if mark[1] == ","), None)
    # "While it boils:" is prose, and "repeat this until it is clean" rules no line below.
    code = fenced or match[1].islower() or word == "for"
    opens = colon or "{" in rest or rest.rstrip().endswith(" do")
    branch = word in ("if", "elif", "else", "unless", "otherwise")
    loops = word != "for" or _LOOP.match(text, behind, end)
    if not loops or not (branch or (code and opens)):
        return None
    comma = None if fenced else comma
    body = behind if "(" in rest else until
    ends = [mark for mark in (colon, _THEN.search(text, behind, until), comma) if mark]
    first = min(ends, key=lambda mark: mark.start(), default=None)
    if word in ("else", "try", "finally") and not colon:
        body = behind
    elif first:
        body = first.end()
    elif rest.lstrip().startswith("("):
        body = calls.swallow(text, text.index("(", behind) + 1)
    # "If it is dirty, clean it first:" has said its piece; the lines below are the plan again.
    alone = until == end and not text[body:end].strip(" {*_`\t")
    said = comma and comma.start() < max(body, colon.start() if colon else 0)
    head = text[match.start(1) : body].rstrip(" :,{\t")
    return Block(indent, "condition", head, match.start(1)), body, until, alone and not said


def read_statement(text: str, start: int, end: int, fenced: bool) -> tuple[Item | None, int]:
    """Read a line that is code, but neither head nor call: a constant, `return`, `break`.

    Returns it, if it is one, and where the value that it gives a name ends, 0 without a value.
    """
    leaves = _LEAVES.match(text, start, end)
    if leaves is not None:
        return Item(start, text[start:end], code=RETURN if leaves[1] else JUMP), 0
    bound = _BINDING.match(text, start, end)
    if bound is None:
        return None, 0
    value, after = bound.end(), end
    if text[value] in "[({":
        after = max(read_literal(text, value)[0].end, value)
    written = text[value:after]
    if _value_of(written, {}) is None:
        return None, after
    marks = (bound[1], "c" * fenced)
    return Item(start, text[start:end].rstrip(), code=BIND, message=written, written=marks), after


def steps_of(root: Block) -> list[Item]:
    """Work out the steps of a text's blocks, in the order in which they are done."""
    steps = _Steps()
    steps.define(root)
    steps.run(root.body, {}, "")
    steps.run_uncalled()
    return [*steps.out, *(i.fault("nothing makes use of it") for i in steps.unused.values())]


@dataclass(slots=True)
class _Steps:
    """Works out the steps of blocks: `out` gets the items, `unused` has the constants, by name."""

    out: list[Item] = field(default_factory=list)
    unused: dict[str, Item] = field(default_factory=dict)
    _functions: dict[str, Block] = field(default_factory=dict)
    _called: set[str] = field(default_factory=set)
    _stack: list[str] = field(default_factory=list)
    _seen: set[tuple[int, str]] = field(default_factory=set)

    def define(self, block: Block) -> None:
        """Note the functions in a block; one without steps, such as a stub, is an action."""
        for entry in block.body:
            if isinstance(entry, Block):
                if entry.kind == "function" and any(item.call for item in entry.items()):
                    self._functions[entry.name] = entry
                self.define(entry)

    def run_uncalled(self) -> None:
        """Leave functions out aloud that are never called, or take the only one for the plan."""
        left = [f for name, f in self._functions.items() if name not in self._called]
        inner = {item.call.action for f in left for item in f.items() if item.call}
        roots = [f for f in left if f.name not in inner]
        roots = [f for f in roots if f.name == "main"] or roots
        if len(roots) == 1 and not any(item.call or item.code == "P103" for item in self.out):
            self._called.add(roots[0].name)
            self.run(roots[0].body, {}, "")
        for function in left:
            if function.name not in self._called:
                why = f"{shown(function.head)} is never called: its steps are left out."
                item = Item(function.start, function.head)
                self._add(item.told(LEFT_OUT, why))

    def _add(self, item: Item) -> None:
        """Add an item; whatever is no call is told but once for its place."""
        key = (item.start, item.code)
        if is_step(item) or key not in self._seen:
            self.out.append(item)
        self._seen.add(key)

    def run(self, body: list[Item | Block], names: dict[str, Any], condition: str) -> bool:
        """Work out the items of a body; tells whether it returned."""
        for n, entry in enumerate(body, start=1):
            if len(self.out) > 20 * _MOST_STEPS and self._stack:
                return True
            if isinstance(entry, Block):
                returned = self._block(entry, names, condition)
                if returned and entry.kind == "frame":
                    return True
                # Behind a branch that returns, the rest is only done otherwise.
                condition = condition or (entry.head if returned else "")
            elif entry.code == RETURN:
                self._never_reached(body[n:], entry)
                return True
            elif entry.code == BIND:
                name, code = entry.written
                names[name] = None if condition else _value_of(entry.message, names)
                if code:
                    self.unused.setdefault(name, entry)
            elif entry.call is not None:
                self._call(entry, names, condition)
            elif is_step(entry) and condition:
                self._add(replace(entry, message=condition))
            elif entry.code != JUMP:
                self._add(entry)
        return False

    def _never_reached(self, body: Sequence[Item | Block], end: Item) -> None:
        """Leave out aloud the steps behind a `return`."""
        for entry in body:
            own = not isinstance(entry, Block) or entry.kind != "function"
            for item in (entry.items() if isinstance(entry, Block) else [entry]) if own else ():
                if item.call:
                    why = f"{shown(item.source)} stands behind {shown(end.source.strip())}"
                    self._add(item.told(LEFT_OUT, f"{why}, so it is not done."))

    def _block(self, block: Block, names: dict[str, Any], condition: str) -> bool:
        if block.often and not block.steps():
            message = f"{shown(block.head)} says how often or when, but not what is to be done."
            self._add(Item(block.start, block.head, code="P103", message=message, line=block.line))
        if block.kind == "function":
            return False
        if block.kind == "frame":
            return self.run(block.body, names, condition)
        targets = re.findall(r"\w+", block.name)
        turns = self._turns(block, names) if block.kind == "loop" and not condition else None
        if turns is None:
            names.update(dict.fromkeys(targets))
            return self.run(block.body, names, block.head) and block.kind == "condition"
        for value in turns:
            parts = value if len(targets) > 1 else (value,)
            if not isinstance(parts, tuple) or len(parts) != len(targets):
                parts = (None,) * len(targets)
            names.update(zip(targets, parts, strict=True))
            if self.run(block.body, names, ""):
                break
        return False

    def _turns(self, block: Block, names: Mapping[str, Any]) -> tuple[Any, ...] | None:
        """Return what a loop goes through, None if that is not written out."""
        if any(item.code == JUMP for item in block.items()):
            return None
        values = _value_of(block.over, names)
        values = tuple(values) if isinstance(values, dict) else values
        for name in re.findall(r"\w+", block.over):
            self.unused.pop(name, None)
        most = _MOST_STEPS // max(block.steps(), 1)
        return values if isinstance(values, tuple) and len(values) <= most else None

    def _call(self, item: Item, names: dict[str, Any], condition: str) -> None:
        """Add a call with what its arguments stand for, or the steps of the function it calls."""
        call = item.call
        if call is None:
            return
        written = item.written or ("",) * len(call.args)
        args = [(name, self._meant(arg, how, names))
                for (name, arg), how in zip(call.named(), written, strict=True)]  # fmt: skip
        receiver = item.source.partition("(")[0].rpartition(".")[0]
        function = self._functions.get(call.action) if receiver in ("", "self") else None
        # `for s in plan: do(s)` only has done what was read before.
        turns = args and all(names.get(arg.lstrip("*"), "") is None for arg in call.args)
        done = turns and call.action.lower() in calls.WRAPPERS and any(map(is_step, self.out))
        if function is not None and call.action not in self._stack and len(self._stack) < _DEPTH:
            self._called.add(call.action)
            bound = _bound(function.params, args)
            if bound is None:
                self._add(item.fault(f"{call.action} is given more arguments than it takes"))
                return
            self._stack.append(call.action)
            self.run(function.body, {**names, **bound}, condition)
            self._stack.pop()
        elif done:
            self._add(item.told(LEFT_OUT))
        elif condition:
            self._add(item.conditional(condition))
        else:
            if len(args) == 1 and isinstance(args[0][1], dict):
                args, written = [(k, _text(v)) for k, v in args[0][1].items()], ()
            if "l" in written:
                self._add(item.fault("an argument is a list or an object"))
            elif not all(isinstance(value, str) for _, value in args):
                self._add(
                    item.told("P103", f"{shown(item.source)}: an argument is not written out.")
                )
            else:
                self._add(replace(item, call=keyworded(call.action, args)))

    def _meant(self, arg: str, how: str, names: Mapping[str, Any]) -> Any:
        """Return what an argument stands for: a name without quotes what it was given to mean."""
        if how == "f":
            return _text(_value_of(f"f{arg!r}", names))
        words = set(re.findall(r"\w+", arg)) & set(names) if how else set()
        for word in words:
            self.unused.pop(word, None)
        return _text(_value_of(arg, names)) if words or how == "l" else arg


def _bound(params: Sequence[str], args: Sequence[tuple[str, Any]]) -> dict[str, Any] | None:
    """Return what the parameters of a function stand for, None if it is given too much.

    The defaults are not known, and what depends on them is told.
    """
    by_name = {name: value for name, value in args if name}
    values = [value for name, value in args if not name]
    free = [p for p in params if p not in ("self", "robot") and p not in by_name]
    bound = {**dict.fromkeys(params), **dict(zip(free, values, strict=False))}
    return None if len(values) > len(free) else bound | by_name


def _text(value: Any) -> Any:
    return str(value) if isinstance(value, (int, float)) else value


_PURE: Mapping[str, Callable[..., Any]] = {
    "range": lambda *bounds: range(*bounds)[: _MOST_STEPS + 1],
    "enumerate": enumerate, "zip": zip, "list": tuple, "tuple": tuple, "reversed": reversed,
}  # fmt: skip
"""The functions of Python that plans are written with, none of which runs for long."""


def _value_of(code: str, names: Mapping[str, Any]) -> Any:
    """Return what an expression stands for: a text, a number, a tuple or a map of these.

    None if it depends on more than what is written.
    """
    # The parser of Python recurses; what no person writes out is not given to it.
    if len(code) > _LONGEST or "\\" in code:
        return None
    try:
        return _value(ast.parse(code.strip().rstrip(";"), mode="eval").body, names)
    except (SyntaxError, ValueError, RecursionError, MemoryError, LookupError, TypeError,
            AttributeError):  # fmt: skip
        return None


def _value(node: ast.expr | None, names: Mapping[str, Any]) -> Any:
    """Return what a node stands for. Raises ValueError and the like where that is not known."""
    match node:
        case ast.Constant(value=str() | int() | float() as value):
            return value
        case ast.Name(id=name) if names.get(name) is not None:
            return names[name]
        case ast.List(elts=parts) | ast.Tuple(elts=parts):
            return tuple(_value(part, names) for part in parts)
        case ast.Dict(keys=keys, values=values):
            pairs = zip(keys, values, strict=True)
            return {_joined([key], names): _value(value, names) for key, value in pairs}
        case ast.JoinedStr(values=parts):
            return _joined(parts, names)
        case ast.FormattedValue(value=inner, conversion=-1, format_spec=None):
            return _value(inner, names)
        case ast.BinOp(op=ast.Add(), left=left, right=right):
            return _joined([left, right], names)
        case ast.Subscript(value=of, slice=at):
            held = _value(of, names)
            return held[_joined([at], names) if isinstance(held, dict) else _value(at, names)]
        case ast.Call(func=ast.Attribute(value=of, attr="items" | "keys" | "values" as view)):
            return tuple(getattr(_value(of, names), view)())
        case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords) if name in _PURE:
            given = [_value(arg, names) for arg in (*args, *(k.value for k in keywords))]
            return tuple(islice(_PURE[name](*given), _MOST_STEPS + 1))
    raise ValueError


def _joined(nodes: list[Any], names: Mapping[str, Any]) -> str:
    """Return texts and numbers in one text. Raises TypeError for others, and where it grows."""
    parts = [_text(_value(node, names)) for node in nodes]
    if not all(isinstance(part, str) for part in parts) or sum(map(len, parts)) > _LONGEST:
        raise TypeError
    return "".join(parts)
