"""Plans in structures: JSON, tuples, tags, fields such as YAML's, tables, scripts and PDDL plans.

Each is read into the same values (`Node`), and what a value says as a step is decided in one place.
"""

import html
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from adaptbot_cli.core.english import REPETITIONS, TIMES, count_of
from adaptbot_cli.core.parse import calls
from adaptbot_cli.core.parse.calls import LEFT_OUT, PROSE, SAID, Item, Line, line_end, shown
from adaptbot_cli.core.parse.phrases import Vocabulary
from adaptbot_cli.core.plan import keyworded

Kind = Literal["string", "word", "list", "map"]
Args = list[tuple[str, str]]

_DEPTH = 40
_TOKENS = 50_000
_LONGEST = 4_000
_LOOKED_AT = 50
_FEW = 2
"""How many spaces make a text more than an argument."""

_TOKEN = re.compile(
    r"(?:\s++|//[^\n]*+|\#[^\n]*+)*(?:"
    r"([\[{(])|([\]})])|([,:])"
    r"|\"([^\"\\\n]*+(?:\\.[^\"\\\n]*+)*)\"|'([^'\\\n]*+(?:\\.[^'\\\n]*+)*)'"
    r"|([-+\w.]++))"
)
_JSON = re.compile(
    r"[^\[{\"'(]*+(?:(?<=\w)'(?=\w)[^\[{\"'(]*+)*(?:\[[A-Z_]+\]\s*(?=[\[{]))?([\[{]|(?<!\w)\()\s*(?:[\[{\"'\]}(]|\w+\s*:|\Z)"
)
_PAIRS = {"[": "]", "{": "}", "(": ")"}
_KEYWORD = re.compile(r"[^\W\d]\w{0,80}")
_BEFORE_MAP = re.compile(r"([^\W\d]\w*):?[ ]?\Z")
_NUMBERED = re.compile(r"(?:step|action)?[\s_#-]*\d{1,3}", re.IGNORECASE)
_SHAPED = re.compile(r"[^\W\d]\w*(?:[_-]|(?<=[a-z])(?=[A-Z]))\w+|[A-Z]{3,}")

_NAMED = (
    "action", "function", "action_name", "function_name", "tool_name", "primitive", "skill", "verb",
)  # fmt: skip
_NAMED_WITH_ARGS = ("name", "tool", "call", "command", "operation", "op", "step")
_ARGS = (
    "args", "arguments", "parameters", "params", "kwargs", "argument", "input", "inputs",
    "action_input", "tool_input", "tool_args", "arg", "param", "value", "objects", "items",
    "targets",
)  # fmt: skip
_PLANS = {
    "plan", "steps", "actions", "action_sequence", "actionsequence", "sequence", "calls",
    "commands", "do", "body", "then", "substeps", "tool_calls", "toolcalls", "function_calls",
    "task_plan", "plan_steps", "tasks",
}  # fmt: skip
_TEXTS = {"content", "text", "answer", "output", "response", "result"}
_LEADING = (*_NAMED, "tool", "command")
"""Keys that name an action where they begin a line or head a column."""
_CONDITIONS = ("if", "condition", "unless", "while", "until", "for_each", "foreach")
_DESCRIBED = ("step", "instruction", "description", "task", "text", "name")
_REMARKS = {
    "step", "id", "index", "number", "type", "thought", "reason", "reasoning", "comment", "#", "no",
    "comments", "description", "note", "notes", "explanation", "order", "purpose", "status",
    *_CONDITIONS,
}  # fmt: skip
_EMPTY = {"", "null", "none", "false", "true", "-", "–", "—", "n/a"}
_NO_ACTIONS = {*_PLANS, *_TEXTS, *_REMARKS, *REPETITIONS, *_NAMED, *_NAMED_WITH_ARGS, *_ARGS}


@dataclass(slots=True)
class Node:
    """A value at the offsets `start` to `end`: a list's `items`, a map's under their `keys`.

    `end` is -1 while a list or map has not been closed; the items read so far are there.
    """

    kind: Kind
    start: int
    end: int = -1
    text: str = ""
    items: list["Node"] = field(default_factory=list)
    keys: list[str] = field(default_factory=list)

    def entries(self) -> Iterator[tuple[str, "Node"]]:
        """Yield a map's keys, in lower case, and values in the order written."""
        return ((key.lower(), item) for key, item in zip(self.keys, self.items, strict=False))

    def get(self, *keys: str) -> "Node | None":
        """Find the value under the first of some keys that the map has."""
        found = dict(self.entries())
        return next((found[key] for key in keys if key in found), None)


@dataclass(slots=True)
class _Frame:
    node: Node
    closing: str
    wants: Literal["item", "colon", "comma"] = "item"


def read_literal(text: str, pos: int) -> tuple[Node, int]:
    """Read the list, tuple or map that opens at `pos`: JSON as models write it, Python's too.

    Returns it and where the reading ended. Where the text is no such value the reading ends there,
    and the values not yet closed stay open.
    """
    root = Node("map" if text[pos] == "{" else "list", pos)
    stack = [_Frame(root, _PAIRS[text[pos]])]
    pos += 1
    for _ in range(_TOKENS):
        match = _TOKEN.match(text, pos)
        if match is None or not _take(stack, match):
            break
        pos = match.end()
        if not stack:
            break
    return root, pos


def _take(stack: list[_Frame], match: re.Match[str]) -> bool:
    """Add a token to the innermost open value; tells whether it fits there."""
    frame = stack[-1]
    node = frame.node
    kind = match.lastindex or 0
    written = match[kind]
    wants_key = node.kind == "map" and len(node.keys) == len(node.items)
    if kind == 3:
        fits = frame.wants == ("comma" if written == "," else "colon")
        frame.wants = "item"
        return fits
    if kind == 2:
        if written != frame.closing or (node.kind == "map" and not wants_key):
            return False
        node.end = match.end()
        stack.pop()
        return True
    if frame.wants != "item" or (kind == 1 and (wants_key or len(stack) >= _DEPTH)):
        return False
    frame.wants = "comma"
    if kind == 1:
        inner = Node("map" if written == "{" else "list", match.start(kind))
        node.items.append(inner)
        stack.append(_Frame(inner, _PAIRS[written]))
        return True
    plain = written if kind == 6 else calls.unescape(written)
    if wants_key:
        node.keys.append(plain)
        frame.wants = "colon"
        return True
    start = match.start(kind) - (kind != 6)
    node.items.append(Node("word" if kind == 6 else "string", start, match.end(), plain))
    return True


class Structures:
    """Reads the steps in the structures of a text; `read` reads a plain text that stands in one."""

    def __init__(
        self,
        text: str,
        read: Callable[[str], Sequence[Item]],
        words: Vocabulary,
        spend: Callable[[int], None],
    ) -> None:
        self.listed = self._scripted = False
        self._text = text
        self._string_items = read
        self._words = words
        self._spend = spend
        self._no_json_before = self._no_table_before = 0

    def read(
        self, start: int, content: int, end: int, line: Line
    ) -> tuple[Sequence[Item], int] | None:
        """Read the structure that begins in a line by the first form that fits, if one does.

        Returns its items and where it ends; `content` is where the marks of a list end.
        """
        match = _JSON.match(self._text, start, end) if start >= self._no_json_before else None
        if match is not None and not self._text[start : match.start(1)].rstrip().endswith("plan("):
            items, after = self.json(match.start(1))
            self._spend(2 + (after - match.start(1)) // 16)
            if items:
                self.listed |= line.marked
                return items, after
            self._no_json_before = after
        found = self.tag(start, end)
        if found is not None:
            return [found[0]], found[1]
        fields = self.fields(start, end, line.fenced) or (
            self.table(start, end) if "|" in self._text[start:end] else None
        )
        if fields is not None:
            return fields
        script = self.script(start, content, end, line.fenced)
        return (script, end) if script else None

    def json(self, pos: int) -> tuple[list[Item], int]:
        """Read the value at `pos` as a plan; returns its items and where the reading ended.

        No items: it is no plan, however well-formed it may be.
        """
        node, end = read_literal(self._text, pos)
        named = _BEFORE_MAP.search(self._text, max(0, pos - _LOOKED_AT), pos)
        if named and node.kind == "map" and node.end >= 0 and self._is_action(named[1]):
            return list(self._called(named[1], node, node)), end
        if self._text[pos] == "(" and (node.end < 0 or not self._naming(node)):
            return [], pos + 1
        items = list(self._steps(node, planned=False))
        if node.end < 0 and items and not items[-1].code:
            rest = self._text[end : end + 200].strip()
            text = shown(rest) if rest else "the end of the text"
            message = f"The JSON breaks off at {text}."
            items.append(Item(end, "", code="P102", message=message))
        return items, end

    def _steps(self, node: Node, planned: bool) -> Iterator[Item]:
        """Yield the steps in a value, as often as it says and unless under a condition."""
        plans = any(key in _PLANS for key, _ in node.entries())
        rules = plans or self._is_step(node) or self._naming(node)
        yield from self._ruled(node if rules else Node("map", 0), self._once(node, planned))

    def _ruled(self, node: Node, steps: Iterator[Item]) -> Iterator[Item]:
        """Yield the steps of a map as often as it says, none under a condition."""
        often = 1
        action = node.get(*_NAMED, *_NAMED_WITH_ARGS) or Node("word", 0)
        for key, value in node.entries():
            plain = value.kind in ("string", "word")
            counts = plain and key in REPETITIONS and not self._words.takes(action.text, key)
            if not (counts or key in _CONDITIONS) or (plain and value.text.lower() in _EMPTY):
                continue
            often = count_of(value.text) if counts else 0
            if not often:
                text = value.text or self._quoted(value)[1:-1]
                yield Item(node.start, self._quoted(node)[1:-1]).conditional(f"{key} {text}")
                return
        yield from list(steps) * min(often, _LOOKED_AT)

    def _once(self, node: Node, planned: bool) -> Iterator[Item]:
        """Yield the steps in a value. In a list of steps, whatever is none is told of."""
        if node.kind in ("string", "word"):
            yield from self._string(node) if planned else ()
        elif self._is_step(node):
            yield from self._step(node)
        elif named := self._naming(node):
            yield from self._called(*named, node)
        elif node.kind == "map":
            yield from self._map_steps(node, planned)
        else:
            yield from self._list_steps(node, planned)

    def _list_steps(self, node: Node, planned: bool) -> Iterator[Item]:
        heads = node.items[:_LOOKED_AT]
        rows = any(item.kind == "list" and self._naming(item) for item in heads)
        planned = planned or rows or any(map(self._is_step, heads))
        maps = planned or all(i.kind == "map" and self._naming(i, among=True) for i in heads)
        for item in node.items:
            named = self._naming(item, among=rows if item.kind == "list" else maps)
            if named and not self._is_step(item):
                yield from self._ruled(item, self._called(*named, item))
                continue
            found = list(self._steps(item, planned))
            yield from found
            if not found and planned and self._words.ordered(item.text):
                yield Item(item.start, item.text, code=SAID)
            elif not found and planned and (said := item.get(*_TEXTS)):
                yield Item(said.start, said.text, code=LEFT_OUT)
            elif not found and planned and (item.kind != "list" or item.items):
                yield self._unread(item, "this is not a step")

    def _map_steps(self, node: Node, planned: bool) -> Iterator[Item]:
        found = [value for key, value in node.entries() if planned and key in _DESCRIBED]
        said = next((value for value in found if self._words.begins(value.text)), None)
        if said is not None:
            yield from self._string(said)
            return
        numbered = all(_NUMBERED.fullmatch(key) for key in node.keys)
        for key, value in node.entries():
            plan = numbered or key in _PLANS or (value.kind == "string" and key in _TEXTS)
            if plan or value.kind in ("list", "map"):
                yield from self._steps(value, planned=plan)

    def _string(self, node: Node) -> list[Item]:
        """Read what a string holds, placed where the string stands."""
        source, items = self._quoted(node)[1:-1], self._string_items(node.text)
        if all(item.code in (PROSE, SAID) for item in items) and not self._words.begins(node.text):
            return []
        return [
            Item(node.start, item.source, code=SAID)
            if item.code in (PROSE, SAID)
            else replace(
                item, start=node.start, source=item.source if item.code == LEFT_OUT else source
            )
            for item in items
        ]

    def _holds_calls(self, text: str) -> bool:
        return "(" in text and any(
            item.code not in (PROSE, SAID) for item in self._string_items(text)
        )

    def _is_action(self, name: str) -> bool:
        return bool(_SHAPED.fullmatch(name)) or self._words.knows(name)

    def _naming(self, node: Node, among: bool = False) -> tuple[str, Node] | None:
        """Return the action and the arguments of a value that is no more than these, if it is.

        `("move", ["fridge"])`, `[1, "move", "fridge"]` and `{"move": {"place": "fridge"}}` are;
        `among` others of the kind a name need not look like an action's.
        """
        if node.end < 0 or not node.items:
            return None
        if node.kind == "list":
            first, *rest = node.items[node.items[0].text.isdigit() :] or node.items
            name, value = first.text, Node("list", node.start, node.end, items=rest)
            flat = [inner for item in rest for inner in item.items or [item]]
            known = self._is_action(name) and (bool(flat) or self._words.knows(name))
            plain = all(i.kind != "map" and "(" not in i.text for i in flat) and not any(
                self._words.knows(item.text) for item in flat
            )
            fits = (known and plain) if first.kind == "string" else False
            return (name, value) if fits or (among and _KEYWORD.fullmatch(name)) else None
        own = [n for n, (key, _) in enumerate(node.entries())
               if key not in REPETITIONS and key not in _CONDITIONS]  # fmt: skip
        at = own[0] if own else 0
        name, value = node.keys[at], node.items[at]
        plain = all(n.kind in ("string", "word") and not self._is_step(n) for n in value.items)
        if len(own or node.keys) > 1 or name.lower() in _NO_ACTIONS or not _KEYWORD.fullmatch(name):
            return None
        fits = self._is_action(name) or (among and value.text.count(" ") < _FEW)
        return (name, value) if plain and fits else None

    def _is_step(self, node: Node) -> bool:
        if node.kind == "string":
            return self._words.begins(node.text) or self._holds_calls(node.text)
        if node.kind != "map" or any(key in _PLANS for key, _ in node.entries()):
            return False
        name = node.get(*_NAMED, *_NAMED_WITH_ARGS)
        if name is None:
            return False
        if name.kind == "map":
            return self._is_step(name) or name.get(*_NAMED, *_NAMED_WITH_ARGS) is not None
        named = node.get(*_NAMED) is not None or node.get(*_ARGS) is not None
        return name.kind in ("string", "word") and (named or "(" in name.text)

    def _called(self, action: str, value: Node, node: Node) -> Iterator[Item]:
        args = flattened(value)
        if args is None:
            yield self._unread(node, "an argument is an object")
        else:
            yield Item(node.start, self._quoted(node)[1:-1], keyworded(action, calls.kept(args)))

    def _step(self, node: Node) -> Iterator[Item]:
        name = node.get(*_NAMED, *_NAMED_WITH_ARGS)
        if name is None or node.end < 0:
            yield self._unread(node, "it breaks off")
            return
        if name.kind == "map":
            yield from self._step(name)
            return
        values = node.get(*_ARGS)
        if "(" in name.text:
            source = self._quoted(node)[1:-1]
            found = [
                replace(item, start=node.start, source=source)
                for item in self._string_items(name.text)
            ]
            yield from found or [self._unread(node, "its action cannot be read")]
            return
        counting = [key for key in REPETITIONS if not self._words.takes(name.text, key)]
        args = _rest_args(node, name, counting) if values is None else flattened(values)
        action = name.text.strip().rpartition(".")[2]
        joined = re.sub(r"[\s-]+", "_", action)
        if args is None:
            yield self._unread(node, "an argument is an object")
        elif action.isidentifier() or (action and values is not None) or self._words.knows(joined):
            action = joined if self._words.knows(joined) else action
            yield Item(node.start, self._quoted(node)[1:-1], keyworded(action, calls.kept(args)))
        elif self._words.begins(action) or self._words.ordered(action):
            yield from self._string(name) or [Item(name.start, action, code=SAID)]
            other = [arg for _, arg in args if arg.lower() not in action.lower()]
            if other:
                message = f"`{', '.join(other)}` beside {shown(action)} is left out."
                yield Item(name.start, action, code=LEFT_OUT, message=message)
        else:
            yield self._unread(node, "its action is not a name")

    def _unread(self, node: Node, why: str) -> Item:
        message = f"The step {self._quoted(node)} cannot be read: {why}."
        return Item(node.start, self._quoted(node)[1:-1], code="P102", message=message)

    def _quoted(self, node: Node) -> str:
        end = node.end if node.end >= 0 else node.start + 200
        return shown(self._text[node.start : end])

    def tag(self, start: int, end: int) -> tuple[Item, int] | None:
        """Read the tool call whose tag opens in a line; returns it and where it ends."""
        text = self._text
        opened = _OPEN.search(text, start, end) or next(
            (tag for tag in _ANY_TAG.finditer(text, start, end) if self._words.knows(tag[1])), None
        )
        if opened is None or "(" in text[start : opened.start()]:
            return None
        attributes = dict(_ATTRIBUTE.findall(opened[3] or ""))
        closing = re.compile(rf"</{opened[1]}\s*>", re.IGNORECASE)
        closed = closing.search(text, opened.end(), opened.end() + _LONGEST)
        body = text[opened.end() : closed.start()] if closed and not opened[4] else ""
        leaves = _leaves(body)
        match = _SAID.match(body)
        found = [
            values[n].strip()
            for values in (attributes, dict(leaves))
            for n in _TAGGED
            if n in values
        ]
        own = opened[1] if opened.re is _ANY_TAG else ""
        names = [own, opened[2] or "", *found, match[1] if match else ""]
        name = next((n.strip().rpartition(".")[2] for n in names if n), "")
        if not name.isidentifier():
            return None
        after = opened.end() if opened[4] else closed.end() if closed else end
        source = " ".join(text[opened.start() : after].split())
        if not opened[4] and closed is None:
            return Item(opened.start(), source).fault("its tag is never closed"), after
        given = [
            (k, v) for k, v in (*attributes.items(), *leaves) if k not in {*_TAGGED, *_REMARKS}
        ]
        args = [arg for key, value in given for arg in _args(key, html.unescape(value).strip())]
        if (found or opened[2]) and not leaves and "<" not in body:
            args += _args("input", html.unescape(body).strip()) if body.strip() else []
        return Item(opened.start(), source[:_LONGEST], keyworded(name, calls.kept(args))), after

    def fields(self, start: int, end: int, fenced: bool) -> tuple[list[Item], int] | None:
        """Read a step of lines such as `action: put` and `object: egg`, as in YAML and by ReAct.

        Returns it and where it ends, None if the line begins no such step.
        """
        text = self._text
        match = _FIELD.match(text, start, end)
        if match is None:
            return None
        key, value = _key(match[2]), match[3].strip().strip("`*'\"")
        listed = bool(match[1].strip())
        bracketed = _BRACKETED.fullmatch(value)
        whole, after = Node("map", match.start(2), end, keys=[], items=[]), end
        if key in _LEADING and bracketed:
            call = keyworded(bracketed[1], calls.kept(_args("input", bracketed[2])))
            return [Item(match.start(3), value, call)], end
        among, column = listed and self.listed, match.start(2) - start
        known = among or self._is_action(value)
        if (key in _LEADING or (key == "name" and known)) and _KEYWORD.fullmatch(value):
            whole.keys = ["action"]
            whole.items = [Node("string", match.start(3), end, value)]
            after = self._more_fields(whole, column, end)
            if after == end and not known:
                return None
        elif (
            (listed or fenced)
            and key not in _NO_ACTIONS
            and (among or self._is_action(match[2].strip()))
        ):
            inner, after = self._field_value(match.start(3), end, column)
            whole.keys, whole.items = [match[2].strip()], [inner]
            whole.end = after
            calling = self._naming(whole, among=True)
            if inner.text.count(" ") >= _FEW or not calling:
                return None
            self.listed = True
            return [*self._called(*calling, whole)], after
        else:
            return None
        whole.end = after
        items = list(self._steps(whole, planned=True))
        self.listed = True
        return (items, after) if items else None

    def _more_fields(self, node: Node, column: int, end: int) -> int:
        """Add the fields in the lines below that stand in the same column; returns their end."""
        while end < len(self._text):
            start, stop = end + 1, line_end(self._text, end + 1)
            match = _FIELD.match(self._text, start, stop)
            if match is None or match[1].strip(" >*_\"'") or match.start(2) - start != column:
                break
            key = _key(match[2])
            if key in (*_NAMED, "observation", "thought"):
                break
            value, end = self._field_value(match.start(3), stop, column)
            node.keys.append(key)
            node.items.append(value)
        return end

    def _field_value(self, pos: int, end: int, column: int) -> tuple[Node, int]:
        """Read a field's value: a literal, the lines below it that stand deeper, or plain text."""
        text = self._text[pos:end].strip()
        opening = pos + len(self._text[pos:end]) - len(self._text[pos:end].lstrip())
        if text[:1] in ("[", "{"):
            node, after = read_literal(self._text, opening)
            if node.end >= 0:
                return node, line_end(self._text, after)
        if text:
            plain = text.partition(" #")[0].strip("`*\"' ")
            return Node("string", opening, end, plain), end
        node = Node("map", pos, end)
        while end < len(self._text):
            start, stop = end + 1, line_end(self._text, end + 1)
            match = _DEEPER.match(self._text, start, stop)
            if match is None or match.start(2) - start <= column:
                break
            node.keys.append(match[2].strip(" :") if match[2].endswith(":") else "")
            node.items.append(Node("string", match.start(3), stop, match[3].strip(" \"'")))
            end = node.end = stop
        if not any(node.keys):
            node.kind, node.keys = "list", []
        return node, end

    def table(self, start: int, end: int) -> tuple[list[Item], int] | None:
        """Read a table with a column for the action; returns its steps and where it ends."""
        text = self._text
        rule = _RULE.match(text, end + 1)
        if rule is None or start < self._no_table_before or text[start:end].count("|") < 2:
            return None
        keys = [_key(cell) for cell, _ in _cells(text, start, end)]
        below = rule.end() + 1
        first = [cell for cell, _ in _cells(text, below, line_end(text, below))]
        at = next((n for n, key in enumerate(keys) if key in _NAMED), -1)
        at = at if at >= 0 else next((n for n, c in enumerate(first) if self._words.begins(c)), -1)
        at = at if at >= 0 else next((n for n, key in enumerate(keys) if key in _LEADING), -1)
        if at < 0:
            return None
        items: list[Item] = []
        end = rule.end()
        while text[end + 1 : end + 2] == "|" or _ROW.match(text, end + 1):
            start, end = end + 1, line_end(self._text, end + 1)
            cells = _cells(text, start, end)
            if len(cells) <= at:
                break
            given = [
                (k, c, p) for k, (c, p) in zip(keys, cells, strict=False)
                if c.lower() not in _EMPTY and not (p == cells[0][1] and c.isdigit())
            ]  # fmt: skip
            nodes = [Node("string", p, p + len(c), c.strip("`*")) for _, c, p in given]
            row = Node("map", cells[0][1], end, items=nodes, keys=[k for k, _, _ in given])
            if keys[at] in row.keys:
                row.keys[row.keys.index(keys[at])] = "action"
                items += self._steps(row, planned=True)
        self._no_table_before = end
        return (items, end) if items else None

    def script(self, start: int, content: int, end: int, fenced: bool) -> list[Item]:
        """Read a line of a program for a simulator or planner: `[WALK] <sink> (1)`, `(cut egg)`."""
        line = self._text[content:end]
        found: list[Item] = []
        at = start
        while match := _BRACKETS.match(self._text, at, end):
            if not (match[2].strip() or self._is_action(match[1]) or self._scripted):
                break
            self._scripted = self._scripted or bool(match[2].strip())
            args = tuple(name.strip() for name in re.findall(r"<([^<>]*)>", match[2]))
            name = self._words.proper(match[1].strip().lower().replace(" ", "_"))
            call = keyworded(name, [("", arg) for arg in args])
            one = Item(match.start(1) - 1, match[0].strip(" \t|"), call)
            found += [one] * count_of(match[3] or "1")
            at = match.end()
        if found and not self._text[at:end].strip():
            return found
        whole = _PDDL.fullmatch(line)
        if whole is None:
            return list(self._grouped(content, end)) if line.lstrip().startswith("(") else []
        found = []
        for part in _ATOM.finditer(self._text, content + whole.start(2), content + whole.end(2)):
            if not (fenced or whole[1] or self._is_action(part[1])):
                return []
            found.append(_step_of(part))
        return found

    def _grouped(self, start: int, end: int) -> Iterator[Item]:
        """Read the steps of a line of nested groups: `(seq (cut egg) (fry egg))`."""
        at, left, atoms = start, "", 0
        for atom in _ATOM.finditer(self._text, start, end):
            if atom[2].strip() and self._is_action(atom[1]):
                yield _step_of(atom)
                left, at, atoms = left + self._text[at : atom.start()], atom.end(), atoms + 1
        left += self._text[at:end]
        if atoms and not _IN_ORDER.fullmatch(left):
            text = shown(self._text[start:end].strip())
            message = (
                f"{text} has {shown(left.strip())} around its steps, which is no step of a plan"
            )
            yield Item(start, self._text[start:end].strip(), code="P103", message=message)


_IN_ORDER = re.compile(
    r"(?:[\s():,;]|->|→|\b(?:seq|sequence|sequential|progn|begin|do|plan|steps|actions)\b)*",
    re.IGNORECASE,
)
"""What may stand around steps that come one after the other."""

_TAGGED = ("action", "name", "tool_name", "function_name", "function", "tool", "ID")
_OPEN = re.compile(
    r"<(invoke|function_call|function|tool_call|tool_use|tool|call|action|step)\b"
    r"(?:=([\w.]+)|([^<>]*?))\s*(/?)>",
    re.IGNORECASE,
)
_ANY_TAG = re.compile(r"<([^\W\d]\w*)(?:=([\w.]+)|(\s[^<>]*?))\s*(/)>")
"""A tag that may be an action itself, as in a behaviour tree."""
_LEAF = re.compile(
    r"<(\w+)(?:=(\w+)|[^<>]*?\bname\s*=\s*[\"'](\w+)[\"'][^<>]*|[^<>]*)>([^<]*)</\1\s*>"
)
_SAID = re.compile(r"\s*([^\W\d]\w*)\s*(?=<)")
_ATTRIBUTE = re.compile(r"(\w+)\s*=\s*[\"']([^\"'<>]*)[\"']")
_FIELD = re.compile(
    r"([\s>*]*+(?:(?:[-•+]|\d{1,3}[.)])[ ]+)?[*\"']*+)"
    r"([^\W\d_][\w-]{0,40}+(?:[ ]\w{1,20}+)?(?:[ ]\d{1,3})?)"
    r"[*\"']*+[ ]*+:(?!:)[*_]*+((?:[ \t][^\n]*)?)"
)
_DEEPER = re.compile(r"([ \t]*)((?:-[ ]|[^\W\d]\w*:))[ \t]*([^\n]*)")
_BRACKETED = re.compile(r"([a-zA-Z]\w*)\[([^\[\]\n]*)\]")
_RULE = re.compile(r"[ \t]*\|?(?:[ \t]*:?-+:?[ \t]*\|)+(?:[ \t]*:?-+:?)?[ \t]*(?=\n|\Z)")
_ROW = re.compile(r"[ \t]+\|")
_BRACKETS = re.compile(
    r"[\s>]*(?:(?:[-*•]|\d+[.)]|<char\d+>)\s+)*\[([A-Za-z][\w ]*)\]"
    r"((?:\s*<[^<>\n]{1,80}>\s*(?:\([^()\n]*\))?)*)"
    rf"[\s,;.]*(?:\[[\d.]+\])?\s*(?:\(?({TIMES})\)?)?\s*(?:\||\Z)"
)
_ATOM = re.compile(r"\(\s*([A-Za-z][\w-]*)((?:\s+[\w.?-]+)*)\s*\)")
_PDDL = re.compile(
    r"((?:(?:step|time)?\s*\d+(?:\.\d+)?\s*:\s*)?)((?:\(\s*[A-Za-z][\w-]*(?:\s+[\w.?-]+)+\s*\)\s*)+)"
    r"(?:\[[\d.,\s]+\])?[\s;]*(?:;.*)?",
    re.IGNORECASE,
)


def _step_of(atom: re.Match[str]) -> Item:
    """The step of an action and its arguments in parentheses."""
    args = [("", arg) for arg in atom[2].split()]
    return Item(atom.start(), atom[0], keyworded(atom[1], args))


def _key(written: str) -> str:
    plain = re.sub(r"\s\d+$|\(.*", "", written.strip(" *_`").lower())
    return re.sub(r"[\s_-]+", "_", plain).strip("_")


def _cells(text: str, start: int, end: int) -> list[tuple[str, int]]:
    """Return the cells of a row of a table, each with where it stands."""
    found, at = [], start
    for cell in text[start:end].split("|"):
        found.append((cell.strip(), at + len(cell) - len(cell.lstrip())))
        at += len(cell) + 1
    lead = 0 if found[0][0] else 1
    return found[lead : len(found) if found[-1][0] else -1]


def _leaves(body: str) -> list[tuple[str, str]]:
    """Return the innermost elements by their names; `<arg_key>` names the `<arg_value>` behind."""
    leaves = [(m[2] or m[3] or m[1], m[4]) for m in _LEAF.finditer(body)]
    keys = ["", *(value.strip() if key == "arg_key" else "" for key, value in leaves)]
    pairs = zip(keys, leaves, strict=False)
    return [(key or name, value) for key, (name, value) in pairs if name != "arg_key"]


def _args(key: str, value: str) -> Args:
    if key.lower() not in _ARGS:
        return [(key, value)]
    found = flattened(Node("string", 0, text=value))
    return [("", value)] if found is None else found


def _rest_args(node: Node, name: Node, counting: Iterable[str]) -> Args | None:
    """Take as arguments what a step says besides its action, remarks aside."""
    found = [(k, v) for k, v in node.entries()
            if v is not name and k not in _REMARKS and k not in counting]  # fmt: skip
    keys, values = [k for k, _ in found], [v for _, v in found]
    return flattened(Node("map", node.start, node.end, items=values, keys=keys))


def flattened(node: Node) -> Args | None:
    """Flatten a value to arguments behind their names; None if an object stands where an argument
    should."""
    if node.kind == "string" and node.text.strip()[:1] in ("{", "["):
        inner, _ = read_literal(node.text.strip(), 0)
        return flattened(inner) if inner.end >= 0 else None
    if node.kind == "string" and "," in node.text:
        reading = calls.read_args(node.text + ")", 0)
        literal = any(how == "l" for _, _, how in reading.found)
        return None if reading.error or literal else [arg[:2] for arg in reading.found]
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
