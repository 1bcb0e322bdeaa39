"""Plans in structures: JSON, tuples, tags, fields such as YAML's, tables, scripts and PDDL plans.

Each is read into the same values (`Node`), and what a value says as a step is decided in one place.
"""

import html
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

from adaptbot_cli.core.english import REPETITIONS, TIMES, count_of
from adaptbot_cli.core.parse import calls
from adaptbot_cli.core.parse.calls import LEFT_OUT, PROSE, SAID, Item, Line, line_end, shown
from adaptbot_cli.core.parse.code import is_step
from adaptbot_cli.core.parse.phrases import Vocabulary
from adaptbot_cli.core.parse.tree import KEYWORD, Args, Node, flattened, read_literal
from adaptbot_cli.core.plan import keyworded

_LONGEST = 4_000
_LOOKED_AT = 50
_FEW = 2
"""How many spaces make a text more than an argument."""

_KEYS = calls.read_table("""
named: action function action_name function_name tool_name primitive skill verb
named_with_args: name tool call command operation op step
args: args arguments parameters params kwargs argument input inputs action_input tool_input
  tool_args arg param value objects items targets
plans: plan steps actions action_sequence actionsequence sequence calls commands do body then
  substeps tool_calls toolcalls function_calls task_plan plan_steps tasks
texts: content text answer output response result
conditions: if condition unless while until for_each foreach
optional: optional skip skipped disabled
instead: alternative alternatives fallback fallbacks backup on_failure on_error
answers: choices candidates
described: step instruction description task text name
remarks: step id index number type thought reason reasoning comment # no comments description note
  notes explanation order purpose status n nr
empty: null none false true - – — n/a
tagged: action name tool_name function_name function tool ID
""")
_NAMED, _NAMED_WITH_ARGS, _ARGS, _PLANS, _TEXTS, _CONDITIONS, *_BESIDE = _KEYS.values()
_OPTIONAL, _INSTEAD, _ANSWERS, _DESCRIBED, _REMARKS, _, _TAGGED = _BESIDE
_CONDITIONS += _OPTIONAL
_REMARKS += _CONDITIONS
_EMPTY = ("", *_KEYS["empty"])
_LEADING = (*_NAMED, "tool", "command")
"""Keys that name an action where they begin a line or head a column."""
_NO_ACTIONS = {
    *_PLANS, *_TEXTS, *_REMARKS, *REPETITIONS, *_NAMED, *_NAMED_WITH_ARGS, *_ARGS, *_INSTEAD,
    *_ANSWERS,
}  # fmt: skip

_JSON = re.compile(
    r"[^\[{\"'(]*+(?:(?<=\w)'(?=\w)[^\[{\"'(]*+)*(?:\[[A-Z_]+\]\s*(?=[\[{]))?([\[{]|(?<!\w)\()\s*(?:[\[{\"'\]}(]|\w+\s*:|\Z)"
)
_WORDS = (PROSE, SAID)
_BEFORE_MAP = re.compile(r"([^\W\d]\w*):?[ ]?\Z")
_NUMBERED = calls.worded(r"(?:step|action)?[\s_#-]*\d{1,3}")
_SHAPED = re.compile(r"[^\W\d]\w*(?:[_-]|(?<=[a-z])(?=[A-Z]))\w+|[A-Z]{3,}")
_OPEN = calls.worded(
    r"<(invoke|function_call|function|tool_call|tool_use|tool|call|action|step)\b"
    r"(?:=([\w.]+)|([^<>]*?))\s*(/?)>"
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
_ROW = re.compile(r"[ \t]*\|")
_BRACKETS = re.compile(
    r"[\s>]*(?:(?:[-*•]|\d+[.)]|<char\d+>)\s+)*\[([A-Za-z][\w ]*)\]"
    r"((?:\s*<[^<>\n]{1,80}>\s*(?:\([^()\n]*\))?)*)"
    rf"[\s,;.]*(?:\[[\d.]+\])?\s*(?:\(?({TIMES})\)?)?\s*(?:\||\Z)"
)
_ATOM = re.compile(r"\(\s*([A-Za-z][\w-]*)((?:\s+[\w.?-]+)*)\s*\)")
_PDDL = calls.worded(
    r"((?:(?:step|time)?\s*\d+(?:\.\d+)?\s*:\s*)?)((?:\(\s*[A-Za-z][\w-]*(?:\s+[\w.?-]+)+\s*\)\s*)+)"
    r"(?:\[[\d.,\s]+\])?[\s;]*(?:;.*)?"
)
_BLOCK = 1_000
"""How many characters before and behind a line of atoms are looked at for others."""

_IN_ORDER = calls.worded(
    r"(?:[\s():,;]|->|→|\b(?:seq|sequence|sequential|progn|begin|do|plan|steps|actions)\b)*"
)
"""What may stand around steps that come one after the other."""

Found = tuple[list[Item], int]
"""The items of a structure, and where it ends."""


@dataclass(slots=True)
class Structures:
    """Reads the steps in the structures of a text.

    `_string_items` reads a text that stands in one, `_spend` bounds the effort.
    """

    _text: str
    _string_items: Callable[[str], Sequence[Item]]
    _words: Vocabulary
    _spend: Callable[[int], None]
    _listed: bool = False
    _scripted: bool = False
    _no_json_before: int = 0
    _no_table_before: int = 0

    def read(self, start: int, content: int, end: int, line: Line) -> Found | None:
        """Read the structure that begins in a line by the first form that fits, if one does.

        `content` is where the marks of a list end.
        """
        return (
            self._literal(start, end, line.marked)
            or self._tag(start, end)
            or self._fields(start, end, line.fenced)
            or self._table(start, end)
            or self._script(start, end)
            or self._atoms(content, end, line.fenced)
        )

    def _literal(self, start: int, end: int, marked: bool) -> Found | None:
        """Read a list or an object as a plan, unless it is none, however well-formed it may be."""
        text = self._text
        match = _JSON.match(text, start, end) if start >= self._no_json_before else None
        if match is None or text[start : match.start(1)].rstrip().endswith("plan("):
            return None
        pos = match.start(1)
        node, after = read_literal(text, pos)
        named = _BEFORE_MAP.search(text, max(0, pos - _LOOKED_AT), pos)
        if named and node.kind == "map" and node.end >= 0 and self._is_action(named[1]):
            items = self._performed(node, Node("word", pos, text=named[1]), node)
        elif text[pos] == "(" and not self._action(node):
            items, after = [], pos + 1
        else:
            items = list(self._steps(node, planned=False))
        if node.end < 0 and items and not items[-1].code:
            rest = text[after : after + 200].strip()
            message = f"The JSON breaks off at {shown(rest) if rest else 'the end of the text'}."
            items.append(Item(after, "", code="P102", message=message))
        self._spend(2 + (after - pos) // 16)
        self._no_json_before = self._no_json_before if items else after
        self._listed |= marked and bool(items)
        return (items, after) if items else None

    def _steps(self, node: Node, planned: bool, among: bool = False) -> Iterator[Item]:
        """Yield the steps in a value, as often as it says and unless under a condition.

        `planned` tells that it is a part of a plan, `among` that it stands among steps.
        """
        action = self._action(node, among)
        often = 1
        if action or any(key in _PLANS for key, _ in node.entries()):
            name = action[0].text if action else ""
            for key, value in node.entries():
                counts = value.plain and key in REPETITIONS and not self._words.takes(name, key)
                says = value.text.lower()
                empty = value.plain and says in _EMPTY
                empty &= not (says == "true" and key in _OPTIONAL)
                if empty or not (counts or key in _CONDITIONS):
                    continue
                often = count_of(value.text) if counts else 0
                if not often:
                    rule = value.text or self._quoted(value)
                    yield Item(node.start, self._quoted(node)).conditional(f"{key} {rule}")
                    return
        if node.plain:
            found = self._string(node) if planned else []
        elif action:
            found = self._performed(node, *action)
        elif node.kind == "map":
            found = list(self._map_steps(node, planned))
        else:
            found = list(self._list_steps(node, planned))
        yield from found * min(often, _LOOKED_AT)

    def _list_steps(self, node: Node, planned: bool) -> Iterator[Item]:
        """Yield the steps in a list. In a list of steps, whatever is none is told of."""
        heads = node.items[:_LOOKED_AT]
        rows = any(item.kind == "list" and self._action(item) for item in heads)
        planned = planned or any(map(self._action, heads))
        maps = planned or all(i.kind == "map" and self._action(i, among=True) for i in heads)
        for item in node.items:
            found = list(self._steps(item, planned, rows if item.kind == "list" else maps))
            yield from found
            if found or not planned:
                continue
            said = item.get(*_TEXTS)
            if self._words.ordered(item.text):
                yield Item(item.start, item.text, code=SAID)
            elif said:
                yield Item(said.start, said.text, code=LEFT_OUT)
            elif item.kind != "list" or item.items:
                yield self._unread(item, "this is not a step")

    def _map_steps(self, node: Node, planned: bool) -> Iterator[Item]:
        """Yield the steps in a map that is none itself: in a description of one, or in a plan."""
        for key, value in node.entries():
            if planned and key in _DESCRIBED and self._words.begins(value.text):
                yield from self._string(value)
                return
        numbered = all(_NUMBERED.fullmatch(key) for key in node.keys)
        for key, value in node.entries():
            never = bool(calls.FORBIDS.match(key))
            plan = numbered or never or key in _INSTEAD + _PLANS
            plan = plan or (value.kind == "string" and key in _TEXTS)
            if not plan and value.plain:
                continue
            found = list(self._steps(value, planned=plan))
            first = next(iter(value.items), value)
            for item in found:
                if not is_step(item):
                    yield item
                elif never:
                    yield item.conditional(key)
                elif key in _INSTEAD or (key in _ANSWERS and item.start > first.end >= 0):
                    yield item.told(LEFT_OUT)
                else:
                    yield item

    def _string(self, node: Node) -> list[Item]:
        """Read what a string holds, placed where the string stands."""
        items = [replace(item, start=node.start) for item in self._string_items(node.text)]
        if all(item.code in _WORDS for item in items) and not self._words.begins(node.text):
            return []
        source = self._quoted(node)
        return [
            replace(item, code=SAID) if item.code in _WORDS
            else item if item.code == LEFT_OUT else replace(item, source=source)
            for item in items
        ]  # fmt: skip

    def _is_action(self, name: str) -> bool:
        return bool(_SHAPED.fullmatch(name)) or self._words.knows(name)

    def _action(self, node: Node, among: bool = False) -> tuple[Node, Node] | None:
        """Return what names the action and what its arguments are, of a value that is a step.

        A text may be one, and a map that has a key for it, or no more than these: `("move",
        ["fridge"])`, `[1, "move", "fridge"]` and `{"move": {"place": "fridge"}}`; `among` others
        of the kind the name need not look like an action's.
        """
        if node.plain:
            called = "(" in node.text and any(
                i.code not in _WORDS for i in self._string_items(node.text)
            )
            says = node.kind == "string" and (called or self._words.begins(node.text))
            return (node, node) if says else None
        knows, plans = self._words.knows, any(key in _PLANS for key, _ in node.entries())
        name = None if plans else node.get(*_NAMED, *_NAMED_WITH_ARGS)
        if name and name.kind == "map":
            nested = name.get(*_NAMED, *_NAMED_WITH_ARGS)
            return self._action(name) or ((nested, name) if nested else None)
        if name and name.plain and ("(" in name.text or node.get(*_NAMED, *_ARGS)):
            return name, node
        if node.end < 0 or not node.items:
            return None
        if node.kind == "list":
            name, *rest = node.items[node.items[0].text.isdigit() :] or node.items
            flat = [inner for item in rest for inner in item.items or [item]]
            fits = name.kind == "string" and self._is_action(name.text) and not any(
                i.kind == "map" or "(" in i.text or knows(i.text) for i in flat
            ) and (bool(flat) or knows(name.text))  # fmt: skip
            fits = fits or (among and bool(KEYWORD.fullmatch(name.text)))
            return (name, Node("list", node.start, node.end, items=rest)) if fits else None
        own = [n for n, (key, _) in enumerate(node.entries())
               if key not in REPETITIONS and key not in _CONDITIONS] or [0]  # fmt: skip
        key, value = node.keys[own[0]], node.items[own[0]]
        if own[1:] or key.lower() in _NO_ACTIONS or not KEYWORD.fullmatch(key):
            return None
        plain = all(inner.plain and not self._action(inner) for inner in value.items)
        fits = self._is_action(key) or (among and value.text.count(" ") < _FEW)
        return (Node("word", node.start, text=key), value) if plain and fits else None

    def _performed(self, node: Node, name: Node, given: Node) -> list[Item]:
        """Read a step; its arguments stand under a key of what is given, or beside the action."""
        source = self._quoted(node)
        if node.end < 0:
            return [self._unread(node, "it breaks off")]
        if "(" in name.text:
            found = [
                replace(i, start=node.start, source=source) for i in self._string_items(name.text)
            ]
            return found or [self._unread(node, "its action cannot be read")]
        values = given.get(*_ARGS) if name in given.items else given
        spare = [
            key
            for key, value in given.entries()
            if values is not None and name in given.items and value not in (name, values)
            and key not in (*_REMARKS, *REPETITIONS)
            and (value.items or value.text.lower() not in _EMPTY)
        ]  # fmt: skip
        if values is None:
            values = Node("map", node.start, node.end)
            for key, value in given.entries():
                counts = key in REPETITIONS and not self._words.takes(name.text, key)
                if value is not name and key not in _REMARKS and not counts:
                    values.add(value, key)
        args = flattened(values)
        if args is None:
            return [self._unread(node, "an argument is an object")]
        action = name.text.strip().rpartition(".")[2]
        joined = re.sub(r"[\s-]+", "_", action)
        known = self._words.knows(joined)
        if known or action.isidentifier() or (action and given.get(*_ARGS)):
            call = keyworded(
                joined if known and not action.isidentifier() else action, calls.kept(args)
            )
            step = Item(node.start, source, call)
            message = f"`{', '.join(spare)}` in {shown(source)} is left out: it is no argument."
            return [step, *([step.told(LEFT_OUT, message)] if spare else [])]
        if not (self._words.begins(action) or self._words.ordered(action)):
            return [self._unread(node, "its action is not a name")]
        found = self._string(name) or [Item(name.start, action, code=SAID)]
        other = [arg for _, arg in args if arg.lower() not in action.lower()]
        if other:
            message = f"`{', '.join(other)}` beside {shown(action)} is left out."
            found.append(Item(name.start, action, code=LEFT_OUT, message=message))
        return found

    def _unread(self, node: Node, why: str) -> Item:
        message = f"The step {shown(self._source(node))} cannot be read: {why}."
        return Item(node.start, self._quoted(node), code="P102", message=message)

    def _source(self, node: Node) -> str:
        return self._text[node.start : node.end if node.end >= 0 else node.start + 200]

    def _quoted(self, node: Node) -> str:
        return shown(self._source(node))[1:-1]

    def _tag(self, start: int, end: int) -> Found | None:
        """Read the tool call whose tag opens in a line."""
        text = self._text
        opened = _OPEN.search(text, start, end) or next(
            (tag for tag in _ANY_TAG.finditer(text, start, end) if self._words.knows(tag[1])), None
        )
        if opened is None or "(" in text[start : opened.start()]:
            return None
        closing = re.compile(rf"</{opened[1]}\s*>", re.IGNORECASE)
        closed = closing.search(text, opened.end(), opened.end() + _LONGEST)
        closed = None if opened[4] else closed
        body = text[opened.end() : closed.start()] if closed else ""
        attributes = dict(_ATTRIBUTE.findall(opened[3] or ""))
        leaves = _leaves(body)
        match = _SAID.match(body)
        found = [values[n] for values in (attributes, dict(leaves)) for n in _TAGGED if n in values]
        own = opened[1] if opened.re is _ANY_TAG else ""
        names = (n.strip() for n in (own, opened[2] or "", *found, match[1] if match else ""))
        name = next(filter(None, names), "").rpartition(".")[2]
        if not name.isidentifier():
            return None
        after = closed.end() if closed else opened.end() if opened[4] else end
        item = Item(opened.start(), " ".join(text[opened.start() : after].split()))
        if not (closed or opened[4]):
            return [item.fault("its tag is never closed")], after
        given = [
            (key, value)
            for key, value in (*attributes.items(), *leaves)
            if key not in _TAGGED + _REMARKS or (key == "tool" and value != name)
        ]
        if (found or opened[2]) and not leaves and "<" not in body and body.strip():
            given.append(("input", body))
        args = [arg for key, value in given for arg in _args(key, html.unescape(value).strip())]
        call = keyworded(name, calls.kept(args))
        return [replace(item, source=item.source[:_LONGEST], call=call)], after

    def _fields(self, start: int, end: int, fenced: bool) -> Found | None:
        """Read a step of lines such as `action: put` and `object: egg`, as in YAML and by ReAct."""
        match = _FIELD.match(self._text, start, end)
        if match is None:
            return None
        key, value = _key(match[2]), match[3].strip().strip("`*'\"")
        bracketed = _BRACKETED.fullmatch(value) if key in _LEADING else None
        if bracketed:
            call = keyworded(bracketed[1], calls.kept(_args("input", bracketed[2])))
            return [Item(match.start(3), value, call)], end
        listed, column = bool(match[1].strip()), match.start(2) - start
        among = listed and self._listed
        known = among or self._is_action(value)
        node, after = Node("map", match.start(2)), end
        if (key in _LEADING or (key == "name" and known)) and KEYWORD.fullmatch(value):
            node.add(Node("string", match.start(3), end, value), "action")
            after = self._more_fields(node, column, end)
            if after == end and not known:
                return None
        elif (
            (listed or fenced) and key not in _NO_ACTIONS
            and (among or self._is_action(match[2].strip()))
        ):  # fmt: skip
            inner, after = self._field_value(match.start(3), end, column)
            node.add(inner, match[2].strip())
        else:
            return None
        node.end = after
        if node.items[0].text.count(" ") >= _FEW or not self._action(node, among=True):
            return None
        self._listed = True
        items = list(self._steps(node, planned=True, among=True))
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
            node.add(value, key)
        return end

    def _field_value(self, pos: int, end: int, column: int) -> tuple[Node, int]:
        """Read a field's value: a literal, the lines below it that stand deeper, or plain text."""
        written = self._text[pos:end]
        text, opening = written.strip(), pos + len(written) - len(written.lstrip())
        if text[:1] in ("[", "{"):
            node, after = read_literal(self._text, opening)
            if node.end >= 0:
                return node, line_end(self._text, after)
        if text:
            return Node("string", opening, end, text.partition(" #")[0].strip("`*\"' ")), end
        node = Node("map", pos, end)
        while end < len(self._text):
            start, stop = end + 1, line_end(self._text, end + 1)
            match = _DEEPER.match(self._text, start, stop)
            if match is None or match.start(2) - start <= column:
                break
            key = match[2].strip(" :") if match[2].endswith(":") else ""
            node.add(Node("string", match.start(3), stop, match[3].strip(" \"'")), key)
            end = node.end = stop
        if not any(node.keys):
            node.kind, node.keys = "list", []
        return node, end

    def _table(self, start: int, end: int) -> Found | None:
        """Read a table with a column for the action."""
        text = self._text
        if start < self._no_table_before or text.count("|", start, end) < 2:
            return None
        rule = _RULE.match(text, end + 1)
        if rule is None:
            return None
        keys = [_key(cell) for cell, _ in _cells(text, start, end)]
        below = rule.end() + 1
        first = _cells(text, below, line_end(text, below))
        heads = [n for n, key in enumerate(keys) if key in _NAMED]
        heads += [n for n, (cell, _) in enumerate(first) if self._words.begins(cell)]
        heads += [n for n, key in enumerate(keys) if key in _LEADING]
        items: list[Item] = []
        end = rule.end()
        while heads and _ROW.match(text, end + 1):
            start, end = end + 1, line_end(text, end + 1)
            cells = _cells(text, start, end)
            if len(cells) <= heads[0]:
                break
            row = Node("map", cells[0][1], end)
            for n, (key, (cell, at)) in enumerate(zip(keys, cells, strict=False)):
                if cell.lower() not in _EMPTY and not (n == 0 and cell.isdigit()):
                    value = Node("string", at, at + len(cell), cell.strip("`*"))
                    row.add(value, "action" if n == heads[0] else key)
            if "action" in row.keys:
                items += self._steps(row, planned=True)
        self._no_table_before = end
        return (items, end) if items else None

    def _script(self, start: int, end: int) -> Found | None:
        """Read a line of a program for a simulator: `[WALK] <sink> (1)`."""
        found: list[Item] = []
        while match := _BRACKETS.match(self._text, start, end):
            if not (match[2].strip() or self._is_action(match[1]) or self._scripted):
                break
            self._scripted = self._scripted or bool(match[2].strip())
            args = [("", name.strip()) for name in re.findall(r"<([^<>]*)>", match[2])]
            name = self._words.proper(match[1].strip().lower().replace(" ", "_"))
            item = Item(match.start(1) - 1, match[0].strip(" \t|"), keyworded(name, args))
            found += [item] * count_of(match[3] or "1")
            start = match.end()
        return (found, end) if found and not self._text[start:end].strip() else None

    def _among_atoms(self, start: int, end: int) -> bool:
        """Whether a line of atoms stands in a block of such lines, one of which is an action."""
        before = reversed(self._text[max(start - _BLOCK, 0) : start].splitlines())
        after = self._text[end : end + _BLOCK].splitlines()
        return any(
            self._is_action(atom[1])
            for lines in (before, after)
            for line in takewhile(_PDDL.fullmatch, filter(str.strip, lines))
            for atom in _ATOM.finditer(line)
        )

    def _atoms(self, start: int, end: int, fenced: bool) -> Found | None:
        """Read the steps of a planner's line, or in groups: `(seq (cut egg) (fry egg))`."""
        text = self._text
        whole = _PDDL.fullmatch(text, start, end)
        if whole is None and not text[start:end].lstrip().startswith("("):
            return None
        found: list[Item] = []
        left, at, stop = "", start, whole.end(2) if whole else end
        sure = whole and (fenced or whole[1] or self._among_atoms(start, end))
        for atom in _ATOM.finditer(text, start, stop):
            if sure or (atom[2].strip() and self._is_action(atom[1])):
                args, rest = self._words.fitting(atom[1], atom[2].split())
                item = Item(atom.start(), atom[0], keyworded(atom[1], [("", arg) for arg in args]))
                found.append(item)
                if rest:
                    why = f"{shown(', '.join(rest))} in {shown(atom[0])} is left out"
                    message = f"{why}: {atom[1]} takes at most {len(args)}."
                    found.append(item.told(LEFT_OUT, message))
                left, at = left + text[at : atom.start()], atom.end()
            elif whole:
                return None
        left += text[at:end]
        if found and not whole and not _IN_ORDER.fullmatch(left):
            line = text[start:end].strip()
            why = f"{shown(line)} has {shown(left.strip())} around its steps"
            found.append(Item(start, line).told("P103", f"{why}, which is no step of a plan"))
        return (found, end) if found else None


def _key(written: str) -> str:
    plain = re.sub(r"\s\d+$|\(.*", "", written.strip(" *_`").lower())
    return re.sub(r"[\s_-]+", "_", plain).strip("_")


def _cells(text: str, start: int, end: int) -> list[tuple[str, int]]:
    """Return the cells of a row of a table, each with where it stands."""
    found, at = [], start
    for cell in text[start:end].split("|"):
        found.append((cell.strip(), at + len(cell) - len(cell.lstrip())))
        at += len(cell) + 1
    return found[not found[0][0] : len(found) if found[-1][0] else -1]


def _leaves(body: str) -> list[tuple[str, str]]:
    """Return the innermost elements by their names; `<arg_key>` names the `<arg_value>` behind."""
    leaves = [(m[2] or m[3] or m[1], m[4]) for m in _LEAF.finditer(body)]
    keys = ["", *(value.strip() if key == "arg_key" else "" for key, value in leaves)]
    pairs = zip(keys, leaves, strict=False)
    return [(key or name, value) for key, (name, value) in pairs if name != "arg_key"]


def _args(key: str, value: str) -> Args:
    found = flattened(Node("string", 0, text=value)) if key.lower() in _ARGS else [(key, value)]
    return [("", value)] if found is None else found
