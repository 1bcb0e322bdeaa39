"""Renders the prompts: files under prompts/, rendered strictly, naming only what a task needs."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import jinja2

from adaptbot_cli.adapters.planner.library import LibraryPlan, nearest_plan, read_library
from adaptbot_cli.core.domain import Action, Kind
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.names import words
from adaptbot_cli.core.plan import Finding, Task
from adaptbot_cli.core.turns import Propose

MOST_NAMES = 12
"""How many things of one kind a prompt names at most, so that it does not grow with the graph."""

MOST_ITEMS = 4
"""Of how many ingredients the example is made at most: it shows the form."""

_NAMES_NEAR = frozenset({"E101", "E103", "E201", "E202"})
"""Findings whose candidates are names that a plan may use."""


@dataclass(frozen=True, slots=True)
class Prompts:
    """The prompts of a domain. `folder` holds plan.j2 and replan.j2, `library` names the example
    plans' folders, if they are not below it.
    """

    folder: Path
    kg: Kg
    library: tuple[Path, ...] = ()

    def messages(self, turn: Propose) -> list[dict[str, str]]:
        """Return the chat messages that ask for a plan, or for a better one.

        A model keeps nothing between two requests, and everything is paid for in each. To mend a
        plan it needs the actions and names, but its own plan shows the form and is the example.
        """
        messages = [{"role": "user", "content": self._first(turn)}]
        if turn.attempt:
            messages.append({"role": "assistant", "content": turn.previous})
            messages.append({"role": "user", "content": self.again(turn)})
        return messages

    def _first(self, turn: Propose) -> str:
        domain = self.kg.domain
        example = self._example(turn)
        near = example["plan"] if example else ""
        told = frozenset(words(f"{turn.task.name} {near} {turn.previous}"))
        return self._render(
            "plan.j2",
            purpose=domain.purpose,
            actions=_signatures(domain.actions.values(), explained=not turn.attempt),
            things=[(k.label, self._names(k, told)) for k in domain.teachable if k.prompted],
            example=None if turn.attempt else example,
            task=turn.task.name,
            required=() if turn.attempt else turn.task.required,
            **_limits(turn.task),
        )

    def again(self, turn: Propose) -> str:
        """Return what is said after a plan that has findings."""
        findings = [_told(finding) for finding in turn.findings]
        return self._render(
            "replan.j2",
            findings=list(dict.fromkeys(findings)),
            required=turn.task.required,
            excluded=_limits(turn.task)["excluded"],
            done=turn.done,
            seen=turn.seen,
        )

    def plans(self) -> list[LibraryPlan]:
        """Read the plans that examples are taken from. Raises PackError."""
        bundled = self.folder / "library" / self.kg.domain.name
        return read_library(*(self.library or (bundled,)))

    def _render(self, name: str, **values: object) -> str:
        loader = jinja2.FileSystemLoader(self.folder)
        environment = jinja2.Environment(
            loader=loader,
            undefined=jinja2.StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
            autoescape=False,
        )
        return environment.get_template(name).render(**values).strip()

    def _names(self, kind: Kind, told: frozenset[str]) -> list[str]:
        """The things of a kind; of many, first those that the task and the plans near it name."""
        found = map(self.kg.name, self.kg.instances([kind.iri]))
        ranked = sorted(found, key=lambda name: not told.issuperset(words(name)))
        return sorted(ranked[:MOST_NAMES])

    def _example(self, turn: Propose) -> dict[str, str] | None:
        """The nearest plan of the library, for its form."""
        library = self.plans()
        found = nearest_plan(turn.task.name, library)
        plan = found[0] if found else min(library, key=lambda p: len(p.body), default=None)
        if plan is None:
            return None
        items = list(dict.fromkeys((*(plan.base or ()), *plan.ingredients)))[:MOST_ITEMS]
        text = _REMARK.sub("", plan.render(plan.names[0], items))
        return {"task": plan.names[0], "plan": text.strip()}


_REMARK = re.compile(r"[ \t]+#[^\n\"']*$", re.MULTILINE)
"""A remark behind a call: it is for the authors of the library."""


def _limits(task: Task) -> dict[str, object]:
    """What a task asks for besides: the person's words, what is excluded, how many, where to."""
    said = task.said if words(task.said) != words(task.name) else ""
    rules = (rule.message.format(item="what") for rule in task.rules)
    excluded = [name.replace("_", " ") for name in dict.fromkeys((*task.excluded, *rules))]
    return {"said": said, "excluded": excluded, "amount": task.amount, "place": task.place}


def _signatures(actions: Iterable[Action], explained: bool) -> list[str]:
    """One line for each action, or for those of a family that do the same to different things."""
    families: dict[tuple[str, str], list[Action]] = {}
    for action in actions:
        verb = action.explain.partition(" ")[0]
        families.setdefault((action.family or action.name, verb), []).append(action)
    lines = []
    for members in families.values():
        line = ", ".join(map(_signature, members))
        lines.append(f"{line}: {members[0].explain}" if explained and _needed(members[0]) else line)
    return lines


def _needed(action: Action) -> bool:
    """Whether an explanation tells more than the name, with which those begin that do not."""
    return action.explain.partition(" ")[0] != words(action.name)[0]


def _signature(action: Action) -> str:
    parameters = [p.name + ("?" if p.optional or p.default else "") for p in action.visible]
    return f"{action.name}({', '.join(parameters)})"


def _told(finding: Finding) -> str:
    where = f"line {finding.line}: " if finding.line else ""
    near = [name for name in finding.candidates if name not in finding.message]
    known = f" (known: {', '.join(near)})" if near and finding.code in _NAMES_NEAR else ""
    remedy = f"; {finding.remedy} would mend that" if finding.remedy else ""
    return f"{where}{finding.message}{known}{remedy}"
