"""The plan library: generic, hand-written plans, adapted to a task's own ingredients."""

import re
import shlex
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from types import BuiltinMethodType
from typing import Any

import jinja2
from jinja2 import nodes
from jinja2.exceptions import SecurityError
from jinja2.sandbox import ImmutableSandboxedEnvironment
from jinja2.utils import Namespace
from jinja2.visitor import NodeTransformer

from adaptbot_cli import bounded
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import misspelt, normal, singulars, words
from adaptbot_cli.core.plan import Task
from adaptbot_cli.core.request.understand import excludes, usable
from adaptbot_cli.core.turns import Proposal, Propose
from adaptbot_cli.errors import ModelError, PackError
from adaptbot_cli.resources import root_of

_NODES = frozenset(
    """Template Output TemplateData Name NSRef Const List For If Assign Filter Test Compare Operand
    And Or Not Add Getattr Getitem Slice Call Keyword CondExpr""".split()  # noqa: SIM905
)
_FILTERS = frozenset(
    """count d default first last length list lower reject reverse select sort trim unique
    upper""".split()  # noqa: SIM905
)
_METHODS = frozenset(
    """split strip lower upper startswith endswith removeprefix removesuffix""".split()  # noqa: SIM905
)
"""What a template may use: nothing that makes long texts of short ones, or calls itself."""

_MOST_STEPS = 10_000
"""How often the loops of one template may go round, all together."""

_LONGEST = 1_000
"""How many entries or characters a list or text may have that a template puts together."""


@dataclass(slots=True)
class _LoopSteps:
    """Counts the steps of all loops of one rendering."""

    taken: int = 0

    def __call__(self, items: Iterable[Any]) -> Iterator[Any]:
        """Go through what a loop goes through. Raises SecurityError: there are too many steps."""
        for item in items:
            self.taken += 1
            if self.taken > _MOST_STEPS:
                raise SecurityError(f"its loops go round more than {_MOST_STEPS:,} times")
            yield item


class _Sandbox(ImmutableSandboxedEnvironment):
    """Renders a plan of anyone: it reaches nothing but what it is given, and comes to an end."""

    intercepted_binops = frozenset({"+"})

    def call_binop(self, context: Any, operator: str, left: Any, right: Any) -> Any:
        """Add, unless the sum is too long."""
        if sum(len(part) for part in (left, right) if hasattr(part, "__len__")) > _LONGEST:
            raise SecurityError("a list or text becomes too long")
        return super().call_binop(context, operator, left, right)

    def is_safe_callable(self, obj: Any) -> bool:
        """Whether a template may call it, whatever name it has given to it."""
        method = isinstance(obj, BuiltinMethodType) and obj.__name__ in _METHODS
        return method or isinstance(obj, _LoopSteps) or obj in (Namespace, self.flat)

    def flat(self, items: list[Any]) -> list[Any]:
        """Return a list that is written in a template: of words, not of lists of lists."""
        if any(isinstance(item, list | tuple | dict) for item in items):
            raise SecurityError("a list may hold no list")
        return items

    def read(self, source: str) -> jinja2.Template:
        """Compile a template. Raises TemplateError: it uses what no plan needs."""
        tree = self.parse(source)
        for node in tree.find_all(nodes.Node):
            used = type(node).__name__ if type(node).__name__ not in _NODES else ""
            if isinstance(node, nodes.For) and node.recursive:
                used = "recursive"
            elif isinstance(node, nodes.Filter) and node.name not in _FILTERS:
                used = f"the filter {node.name}"
            elif isinstance(node, nodes.Call):
                used = _called(node.node)
            elif isinstance(node, nodes.Name) and node.name.startswith("_"):
                used = node.name
            if used:
                raise jinja2.TemplateSyntaxError(f"a plan may not use {used}", node.lineno)
        return self.from_string(_Bounds().visit(tree))


def _called(node: nodes.Expr) -> str:
    """What a call calls, "" if a template may call it."""
    if isinstance(node, nodes.Getattr):
        return "" if node.attr in _METHODS else f"the method {node.attr}"
    name = getattr(node, "name", "")
    return "" if name == "namespace" else f"the function {name}"


class _Bounds(NodeTransformer):
    """Puts a counter around what each loop goes through, and a look into each list."""

    def visit_For(self, node: nodes.For) -> nodes.Node:
        self.generic_visit(node)
        node.iter = nodes.Call(nodes.Name("_step", "load"), [node.iter], [], None, None)
        return node.set_lineno(node.lineno)

    def visit_List(self, node: nodes.List) -> nodes.Node:
        self.generic_visit(node)
        flat = nodes.EnvironmentAttribute("flat")
        return nodes.Call(flat, [node], [], None, None).set_lineno(node.lineno)


def _shown(value: Any) -> Any:
    """Return what a template writes: a word or a number."""
    if isinstance(value, list | tuple | dict):
        raise SecurityError("a list stands where a word should")
    return value


_JINJA = _Sandbox(
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    autoescape=False,
    finalize=_shown,
)
_JINJA.globals = {"namespace": Namespace}

_A_SLIP = 0.75
"""How similar a request must be to a task's name to be asked about."""

_NAMED = re.compile(r"\"([^\"]*)\"")
"""A name in a line of a plan, as templates write it."""

_SLIPS = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What an expression of a template may raise by itself."""


@dataclass(frozen=True, slots=True)
class LibraryPlan:
    """One plan of the library: the names it serves, its usual ingredients, its template.

    One that was `kept` for a task (planner/kept.py) has where it comes from, and what was `asked`
    beside the name; its text is no template. `before` the template stand so many lines of the file.
    """

    path: Path
    names: tuple[str, ...]
    base: tuple[str, ...] | None
    ingredients: tuple[str, ...]
    roles: dict[str, list[str]]
    body: str
    asked: dict[str, list[str]] = field(default_factory=dict)
    kept: dict[str, str] = field(default_factory=dict)
    before: int = 0

    def render(self, task: str, items: Iterable[str], asked: Task | None = None) -> str:
        """Write the plan for a task's items, one call a line. Raises PackError.

        What was `asked` gives the template the `place` to bring things to and what is to be
        `inside` which vessel.
        """
        if self.kept:
            return self.body
        asks: dict[str, Any] = {"place": asked.place, "inside": dict(asked.inside)} if asked else {}
        try:
            template = _JINJA.read(self.body)
            given = {"task": task, "items": list(items), "roles": self.roles}
            given |= {"place": "", "inside": {}, **asks}
            return template.render(given, _step=_LoopSteps())
        except (jinja2.TemplateError, RecursionError, *_SLIPS) as error:
            line = getattr(error, "lineno", None)
            where = f"{self.path}, line {line + self.before}" if line else str(self.path)
            text = str(getattr(error, "message", None) or error).rstrip(".")
            if isinstance(error, RecursionError):
                text = "it is nested too deep"
            raise PackError(f"{where}: {text}; correct the template there") from error


def read_library(*library: Path | LibraryPlan) -> list[LibraryPlan]:
    """Read every plan of some folders; one that has been read already is taken as it is.

    Raises PackError.
    """
    read = [plan for plan in library if isinstance(plan, LibraryPlan)]
    folders = (folder for folder in library if isinstance(folder, Path))
    return [*read, *(read_plan(path) for path in library_files(*folders))]


def names_in(*folders: Path) -> list[str]:
    """Return the names that the plans of some folders serve; none if one of them has faults."""
    try:
        return [name for plan in read_library(*folders) for name in plan.names]
    except PackError:  # raised again when a plan is wanted
        return []


def library_files(*folders: Path) -> list[Path]:
    """Return the files of a library: folder by folder, by name, a name once only.

    So a plan in an earlier folder stands for one of the same file name in a later folder.
    """
    found: dict[str, Path] = {}
    for folder in folders:
        for path in sorted(folder.glob("*.plan")):
            found.setdefault(path.name, path)
    return list(found.values())


def read_plan(path: Path) -> LibraryPlan:
    """Read one plan, unless it has been read before and not been changed. Raises PackError."""
    try:
        return _read(path, path.stat().st_mtime_ns)
    except OSError as error:
        raise PackError(f"{path}: cannot be read: {error.strerror}") from error


@lru_cache(maxsize=512)
def _read(path: Path, _changed: int) -> LibraryPlan:
    parts = _text(path).split("---\n", 2)
    if len(parts) != 3:
        remedy = "write YAML between two lines of ---, then the plan"
        raise PackError(f"{path}: has no front matter; {remedy}")
    try:
        [front] = bounded.parse_yaml(parts[1], f"{path}: its front matter", PackError)
        return LibraryPlan(
            path,
            _words(front, "names", needed=True),
            _words(front, "base") if "base" in front else None,
            _words(front, "ingredients"),
            {str(role): list(_words(front["roles"], role)) for role in front.get("roles") or ()},
            parts[2],
            {str(key): list(_words(front["asked"], key)) for key in front.get("asked") or ()},
            {str(key): str(value) for key, value in (front.get("kept") or {}).items()},
            2 + parts[0].count("\n") + parts[1].count("\n"),
        )
    except (KeyError, AttributeError, TypeError, ValueError) as error:
        text = " ".join(str(error).split())
        remedy = "see the plan library in docs/domains.md"
        raise PackError(f"{path}: its front matter lacks or garbles {text}; {remedy}") from error


def _text(path: Path) -> str:
    data = bounded.read_bytes(path, bounded.SETTINGS, PackError, root=root_of(path))
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise PackError(f"{path}: is no UTF-8 text; save it as UTF-8") from error


def _words(front: Any, key: str, needed: bool = False) -> tuple[str, ...]:
    """The list of words at a key. Raises TypeError."""
    value = front.get(key) or ()
    if not isinstance(value, list | tuple) or (needed and not value):
        raise TypeError(f"`{key}`, which is a list: [one, another]")
    return tuple(map(str, value))


def nearest_plan(task: str, library: Iterable[LibraryPlan]) -> tuple[LibraryPlan, str] | None:
    """Return the plan with the longest name whose words the task all has, and that name."""
    asked = set(stems(task))
    served = [(plan, name) for plan in library for name in plan.names]
    fitting = [(plan, name) for plan, name in served if asked.issuperset(stems(name))]
    return max(fitting, key=lambda f: (len(set(stems(f[1]))), len(f[1])), default=None)


def _serves(folders: tuple[Path, ...], task: str) -> bool:
    try:
        return nearest_plan(task, read_library(*folders)) is not None
    except PackError:  # raised again when that domain is used
        return False


def stems(text: str) -> list[str]:
    """Return the words of a name, each in the singular."""
    return [(singulars(word) or (word,))[0] for word in words(text)]


@dataclass(frozen=True, slots=True)
class Library:
    """Plans without a model: the nearest plan of the library, with the task's own items.

    The library is that of `folders`, an earlier one before a later one, or plans that were read
    from them; `others` are those of the domains that a task may be of instead. What a task
    excludes, or what on this home's graph may be something that it excludes, is left out.
    """

    folders: tuple[Path | LibraryPlan, ...]
    domain: Domain
    others: Mapping[str, tuple[Path, ...]] = field(default_factory=dict)
    kg: Kg | None = None
    name: str = "plan library"

    def propose(self, turn: Propose) -> Proposal:
        """Return the nearest plan's text; for a re-prompt the last plan, with why it stays.

        Raises:
            ModelError: nothing in the library is near the task.
        """
        if turn.attempt:
            text = "the plan library has no other plan for this task; the plan stays as it is"
            return Proposal(turn.previous, calls=0, failure=text)
        found = nearest_plan(turn.task.name, read_library(*self.folders))
        if found is None:
            raise ModelError(
                f'The plan library of {self.domain.name} has nothing near "{turn.task.name}"'
                f"{self._meant(turn)}, and no model is configured. {self._elsewhere(turn)}Name a "
                "model with --model (any litellm name, such as ollama/llama3.2 or gpt-4o), in "
                "adaptbot.toml or in ADAPTBOT_MODEL, or set a provider's key (OPENAI_API_KEY)."
            )
        plan, name = found
        text = plan.render(turn.task.name, self._items(plan, name, turn), turn.task)
        # What names something excluded is left out.
        lines = (
            line
            for line in text.splitlines()
            if all(self._usable(name, turn) for name in _NAMED.findall(line))
        )
        return Proposal("\n".join(lines), calls=0)

    def _usable(self, name: str, turn: Propose) -> bool:
        """Whether a name may stand in a plan: one that is required and unsure is asked about."""
        if self.kg is None:
            return True
        asked = any(set(self.kg.find(name)) & set(self.kg.find(n)) for n in turn.task.required)
        return not excludes(name, turn.task, self.kg) if asked else usable(name, turn.task, self.kg)

    def _meant(self, turn: Propose) -> str:
        """The listed task that a slip of the pen in a task's name may mean, for a sentence."""
        text = " ".join(w for w in words(turn.task.name) if w not in self.domain.fillers)
        near = misspelt(text, [" ".join(words(n)) for n in self.domain.task_names], _A_SLIP)
        return f' (is it "{near}" that you mean?)' if near else ""

    def _elsewhere(self, turn: Propose) -> str:
        """The domains that have a plan for the task, or else all others, for a sentence."""
        able = [name for name, folders in self.others.items() if _serves(folders, turn.task.name)]
        if able:
            return f"For the plan of {' or '.join(able)}: {self._command(turn, able[0])}. "
        if not self.others:
            return ""
        others = [*self.others]
        return f"If it is a task of {' or '.join(others)}: {self._command(turn, others[0])}. "

    @staticmethod
    def _command(turn: Propose, domain: str) -> str:
        return f"adaptbot run {shlex.quote(turn.task.said or turn.task.name)} --domain {domain}"

    def _items(self, plan: LibraryPlan, name: str, turn: Propose) -> list[str]:
        """The task's items; of a task that is not listed, the usual ones and what was asked for."""
        parts = turn.task.required
        judged = self.domain.task_classes.get(normal(turn.task.judged_by))
        own = set(parts) - {*(judged.required if judged else ())}
        usual = plan.base if own and plan.base is not None else plan.ingredients
        found = dict.fromkeys(parts if turn.task.known else (*usual, *parts))
        return [item for item in found if item in parts or self._usable(item, turn)]
