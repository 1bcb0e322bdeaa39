"""Renders the prompts: files under prompts/, rendered strictly, naming only what a task needs.

A prompt has the paper's parts (sections III-A and IV-A): the agent's actions, one example with its
chain of thought, the classes of things and of each the things of this home that matter for the
task, and the task. Its size grows neither with the home nor with the actions.
"""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, islice
from pathlib import Path
from typing import Literal, get_args

import jinja2
from rdflib import RDF, URIRef

from adaptbot_cli.adapters.planner.forms import MARK, STYLES, PlanForm, Style
from adaptbot_cli.adapters.planner.library import LibraryPlan, nearest_plan, read_library, stems
from adaptbot_cli.core.domain import Action, ItemClass
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.names import words
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Call, Finding, Task
from adaptbot_cli.core.request.understand import excludes
from adaptbot_cli.core.turns import Propose

Part = Literal["items", "example", "memory"]
"""What an experiment may leave out of a prompt."""

BEST: Style = "cot"
"""The style that a small model meets most goals with (docs/models.md)."""

PARTS: tuple[Part, ...] = get_args(Part)

MOST_NAMES, MOST_OPEN = 12, 18
"""How many things of one class a prompt names at most; and where the task does not say which it is
to be made of, of a class that is not named otherwise."""

MOST_ACTIONS = 19
"""How many actions a prompt names at most."""

MOST_ITEMS = 4
"""Of how many ingredients the example is made at most: it shows the form."""

MOST_FINDINGS = 12
"""How many findings of the last plan a re-prompt lists."""

_NEAR = 3
"""How many plans of the library are looked into for what a task may need."""

_SCANNED = 500
"""A home with more things of a class is not searched for the rest that a prompt has room for."""

_NAMES_NEAR = frozenset({"E101", "E103", "E201", "E202"})
"""Findings whose candidates are names that a plan may use."""

_PHRASE = 3
"""Of how many words of a request the name of a thing consists at most."""

_HEADINGS = (
    ("E6", "This failed when the robot did it"),
    ("E504", "The person objects"),
    ("E5", "The plan does not reach its goal"),
    ("", "This cannot be done here"),
)
"""The headings of findings in a re-prompt, by the codes that they begin with."""

Message = dict[str, str]


def style_of(option: str) -> Style:
    """Return the style that `--prompt` means: `auto` is the one that was measured to be best."""
    return next((style for style in STYLES if style == option), BEST)


@dataclass(frozen=True)
class Prompts:
    """The prompts of a domain. `folder` holds the templates, `library` names the folders of the
    example plans, if they are not below it; `kept` are plans of this home that go before those.

    For experiments `leave_out` are parts that the prompts lack, and with `unseen` the plan that the
    library has for a task itself is neither its example nor looked into.
    """

    folder: Path
    kg: Kg
    library: tuple[Path | LibraryPlan, ...] | None = None
    style: Style = "plain"
    leave_out: frozenset[Part] = frozenset()
    unseen: bool = False
    kept: tuple[LibraryPlan, ...] = ()

    def messages(self, turn: Propose) -> list[Message]:
        """Return the chat messages that ask for a plan, or for a better one.

        A model keeps nothing between two requests, and everything is paid for in each. To mend a
        plan it needs the actions and names, but its own plan shows the form and is the example.
        Raises PackError.
        """
        near = self._near(turn.task)
        example = () if turn.attempt else self._example(near)
        actions = self._actions(turn, near)
        rules = self._render(
            "plan.j2",
            purpose=self.kg.domain.purpose,
            actions=_signatures(actions, explained=not turn.attempt),
            style=self.style,
            mark=MARK,
        )
        task = self._render(
            "task.j2",
            things=[] if "items" in self.leave_out else list(self._things(turn, near)),
            task=turn.task.name,
            required=() if turn.attempt else turn.task.required,
            **_limits(turn.task),
        )
        asked = [*example, {"role": "user", "content": task}]
        asked[0] = {"role": "user", "content": f"{rules}\n\n{asked[0]['content']}"}
        if turn.attempt:
            previous = f"{MARK}\n{turn.previous}" if self.style == "cot" else turn.previous
            asked.append({"role": "assistant", "content": previous})
            asked.append({"role": "user", "content": self.again(turn)})
        return asked

    def form(self, turn: Propose) -> PlanForm:
        """Return what an answer may be, for a provider that can hold a model to it."""
        actions = self._actions(turn, self._near(turn.task))
        return PlanForm(tuple(actions), self.style == "cot", self.style == "schema")

    def hash(self, turn: Propose) -> str:
        """Return a digest of the messages of a prompt."""
        text = json.dumps(self.messages(turn), ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def again(self, turn: Propose) -> str:
        """Return the message that asks for a better plan."""
        wrong: dict[str, dict[str, None]] = {heading: {} for _, heading in _HEADINGS}
        for finding in turn.findings[:MOST_FINDINGS]:
            heading = next(h for code, h in _HEADINGS if finding.code.startswith(code))
            wrong[heading][_finding_line(finding)] = None
        before = () if "memory" in self.leave_out else turn.before
        return self._render(
            "replan.j2",
            wrong=[(heading, list(record)) for heading, record in wrong.items() if record],
            before=list(dict.fromkeys(finding.message for finding in before)),
            required=turn.task.required,
            excluded=_limits(turn.task)["excluded"],
            done=turn.done,
            seen=turn.seen,
        )

    def plans(self) -> list[LibraryPlan]:
        """Read the plans that examples are taken from. Raises PackError."""
        bundled = self.folder / "library" / self.kg.domain.name
        library = (bundled,) if self.library is None else self.library
        return [*self.kept, *read_library(*library)]

    def _render(self, name: str, **values: object) -> str:
        environment = jinja2.Environment(
            loader=jinja2.FileSystemLoader(self.folder),
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
            autoescape=False,
        )
        return environment.get_template(name).render(**values).strip()

    def _near(self, task: Task) -> list[LibraryPlan]:
        """The plans nearest to a task, nearest first: the one that the library itself would take,
        then those that share most words of their names and most ingredients with the task."""
        plans = self.plans()
        taken = nearest_plan(task.name, plans)
        if taken is not None and self.unseen:
            plans = [plan for plan in plans if plan is not taken[0]]
            taken = None
        ranked = sorted(plans, key=lambda p: (-_nearness(task, p), -self._usualness(p)))
        first = [taken[0]] if taken else []
        return [*first, *(plan for plan in ranked if plan not in first)][:_NEAR]

    def _example(self, near: Sequence[LibraryPlan]) -> list[Message]:
        """The nearest plan as an answer to its own task, with the thoughts that lead to it."""
        if not near or "example" in self.leave_out:
            return []
        plan = near[0]
        most = MOST_ITEMS // 2 if self.style == "schema" else MOST_ITEMS
        items = list(dict.fromkeys((*(plan.base or ()), *plan.ingredients)))[:most]
        text = _REMARK.sub("", plan.render(plan.names[0], items)).strip()
        calls = [written.call for written in parse(text).calls]
        used = [item for item in items if any(item in call.args for call in calls)]
        asked = self._render(
            "task.j2", things=[], task=plan.names[0], required=used, **_limits(Task(""))
        )
        if self.style != "plain":
            thought = self._thought(calls, used)
            text = f"{thought}\n{MARK}\n{text}"
            if self.style == "schema":
                steps = [{"action": call.action, "args": [*call.args]} for call in calls]
                record = {"reasoning": thought, "plan": steps}
                text = json.dumps(record, ensure_ascii=False, separators=(",", ":"))
        return [{"role": "user", "content": asked}, {"role": "assistant", "content": text}]

    def _thought(self, calls: Sequence[Call], items: Sequence[str]) -> str:
        """Which items a plan is about, in which state they are brought, and with what else."""
        states = self._states
        done = []
        for call in calls:
            action = self._named.get(call.action)
            effect = action.effect.predicates if action and action.effect else frozenset()
            if effect <= states and effect and call.args[0] in items:
                done.append(f"{call.action} {call.args[0]}")
        others = dict.fromkeys(arg for call in calls for arg in call.args if self.kg.find(arg))
        tools = ", ".join(name for name in others if name not in items)
        lines = {"Items": ", ".join(items), "To do": ", ".join(dict.fromkeys(done)), "With": tools}
        return "\n".join(f"{head}: {text or 'nothing'}" for head, text in lines.items())

    @cached_property
    def _states(self) -> frozenset[URIRef]:
        """The predicates of a state, places left out."""
        found = self.kg.domain.properties.values()
        return frozenset(p.iri for p in found if p.range not in self.kg.domain.classes)

    @cached_property
    def _named(self) -> dict[str, Action]:
        """The actions by all their names."""
        actions = self.kg.domain.actions.values()
        return {name: action for action in reversed([*actions]) for name in action.names}

    @cached_property
    def _usual(self) -> Counter[str]:
        """How many plans of the library use a name: of an action, or of a thing."""
        found: Counter[str] = Counter()
        for plan in self.plans():
            found.update({*_NAME.findall(plan.body), *_CALLED.findall(plan.body)})
            found.update({*plan.ingredients, *(plan.base or ())})
        return found

    def _usualness(self, plan: LibraryPlan) -> float:
        """How many plans use the ingredients of a plan, in the mean."""
        return sum(map(self._usual.__getitem__, plan.ingredients)) / (len(plan.ingredients) or 1)

    def _actions(self, turn: Propose, near: Sequence[LibraryPlan]) -> list[Action]:
        """The actions near a task: all, if they are few; else first those that plans near it and
        its own words name, then those that are used most. In the order of the domain."""
        actions = list(self.kg.domain.actions.values())
        if len(actions) <= MOST_ACTIONS:
            return actions
        used = chain(*(_CALLED.findall(plan.body) for plan in near), _CALLED.findall(turn.previous))
        names = {*words(turn.task.name), *words(turn.task.said)}
        wanted = {*used, *(name for action in actions for name in action.names if name in names)}
        ranked = sorted(
            actions,
            key=lambda a: (wanted.isdisjoint(a.names), -max(self._usual[n] for n in a.names)),
        )
        kept = {action.name for action in ranked[:MOST_ACTIONS]}
        return [action for action in actions if action.name in kept]

    def _things(
        self, turn: Propose, near: Sequence[LibraryPlan]
    ) -> Iterator[tuple[str, list[str]]]:
        """The classes, and of each the things that matter for a task: required ones, those that its
        words name, those of plans near it and of the last plan; then the commonest of the class."""
        task = turn.task
        matter = chain(
            task.required,
            _phrases(task),
            *(chain(plan.ingredients, _NAME.findall(plan.body)) for plan in near),
            _NAME.findall(turn.previous),
        )
        common = (name for name, _ in sorted(self._usual.items(), key=lambda e: (-e[1], e[0])))
        open_task = not task.required
        found: dict[URIRef, dict[str, None]] = {kind.iri: {} for kind in self.kg.domain.teachable}
        for iri, name in self._known(matter, task):
            found[iri].setdefault(name)
        for iri, name in self._known(common, task):
            if open_task or self.kg.domain.classes[iri].prompted:
                found[iri].setdefault(name)
        for kind in self.kg.domain.teachable:
            most = MOST_NAMES if kind.prompted or not open_task else MOST_OPEN
            if (kind.prompted or open_task) and len(found[kind.iri]) < most:
                found[kind.iri].update(dict.fromkeys(self._rest(kind, task)))
            names = list(found[kind.iri])[:most]
            if names:
                yield kind.label, sorted(names)

    def _known(self, names: Iterable[str], task: Task) -> Iterator[tuple[URIRef, str]]:
        """What this home has of some names, and the task allows: class and the home's own name."""
        teachable = [kind.iri for kind in self.kg.domain.teachable]
        for name in dict.fromkeys(names):
            for entity in self.kg.find(name)[:1]:
                kind = next((k for k in teachable if k in self.kg.classes(entity)), None)
                if kind is not None and not excludes(self.kg.name(entity), task, self.kg):
                    yield kind, self.kg.name(entity)

    def _rest(self, kind: ItemClass, task: Task) -> list[str]:
        """All things of a class that has few, by name."""
        kinds = [k.iri for k in self.kg.domain.classes.values() if kind.iri in k.superclasses]
        members = chain(*(self.kg.facts.subjects(RDF.type, iri) for iri in kinds))
        few = list(islice(members, _SCANNED + 1))
        if len(few) > _SCANNED:
            return []
        names = sorted(map(self.kg.name, few))
        return [name for name in names if not excludes(name, task, self.kg)]


_REMARK = re.compile(r"[ \t]+#[^\n\"']*$", re.MULTILINE)
"""A remark behind a call: it is for the authors of the library."""

_NAME = re.compile(r'"([^"\n{}]+)"')
_CALLED = re.compile(r"^\s*(\w+)\(", re.MULTILINE)


def _phrases(task: Task) -> Iterator[str]:
    """The names that a request may hold, longest first."""
    parts = words(f"{task.name} {task.said}")
    for length in range(_PHRASE, 0, -1):
        for at in range(len(parts) - length + 1):
            yield "_".join(parts[at : at + length])


def _nearness(task: Task, plan: LibraryPlan) -> float:
    names = set(stems(" ".join((task.name, *task.like))))
    named = max((_shared(names, set(stems(name))) for name in plan.names), default=0.0)
    return named + _shared(set(task.required), set(plan.ingredients))


def _shared(one: set[str], other: set[str]) -> float:
    """Jaccard's index: what two sets share, of all that they hold."""
    return len(one & other) / (len(one | other) or 1)


def _limits(task: Task) -> dict[str, object]:
    """What a task asks for besides: the person's words, what is excluded, how many, where to."""
    text = task.said if words(task.said) != words(task.name) else ""
    rules = (rule.message.format(item="what") for rule in task.rules)
    excluded = [name.replace("_", " ") for name in dict.fromkeys((*task.excluded, *rules))]
    return {"said": text, "excluded": excluded, "amount": task.amount, "place": task.place}


def _signatures(actions: Iterable[Action], explained: bool) -> list[str]:
    """One line for each action, or for those of a family that do the same to different things."""
    families: dict[tuple[str, str], list[Action]] = {}
    for action in actions:
        verb = action.explain.partition(" ")[0]
        families.setdefault((action.family or action.name, verb), []).append(action)
    lines = []
    for (_, verb), members in families.items():
        line = ", ".join(map(_signature, members))
        # An explanation that begins with the name adds nothing to it.
        more = explained and verb != words(members[0].name)[0]
        lines.append(f"{line}: {members[0].explain}" if more else line)
    return lines


def _signature(action: Action) -> str:
    parameters = [p.name + ("?" if p.optional or p.default else "") for p in action.visible]
    return f"{action.name}({', '.join(parameters)})"


def _finding_line(finding: Finding) -> str:
    where = f"line {finding.line}: " if finding.line else ""
    near = [name for name in finding.candidates if name not in finding.message]
    known = f" (known: {', '.join(near)})" if near and finding.code in _NAMES_NEAR else ""
    remedy = f"; {finding.remedy} would mend that" if finding.remedy else ""
    return f"{where}{finding.message}{known}{remedy}"
