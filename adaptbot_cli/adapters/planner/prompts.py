"""Renders the prompts: files under prompts/, rendered strictly, naming only what a task needs."""

from dataclasses import dataclass
from pathlib import Path

import jinja2

from adaptbot_cli.adapters.planner.library import nearest_plan, read_library
from adaptbot_cli.core.domain import Action, Kind
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.turns import Propose

MOST_NAMES = 12
"""How many things of one kind a prompt names at most, so that it does not grow with the graph."""

_NAMES_NEAR = frozenset({"E101", "E103", "E201", "E202"})
"""Findings whose candidates are names that a plan may use."""


@dataclass(frozen=True, slots=True)
class Prompts:
    """The prompts of a domain. `folder` holds plan.j2, replan.j2 and the plan library."""

    folder: Path
    kg: Kg

    def messages(self, turn: Propose) -> list[dict[str, str]]:
        """Return the chat messages that ask for a plan, or for a better one."""
        messages = [{"role": "user", "content": self._first(turn)}]
        if turn.attempt:
            messages.append({"role": "assistant", "content": turn.previous})
            messages.append({"role": "user", "content": self.again(turn)})
        return messages

    def _first(self, turn: Propose) -> str:
        domain = self.kg.domain
        return self._render(
            "plan.j2",
            purpose=domain.purpose,
            actions=[_signature(action) for action in domain.actions.values()],
            things=[(k.label, self._names(k)) for k in domain.teachable if k.prompted],
            example=self._example(turn),
            task=turn.task.name,
            required=turn.task.required,
        )

    def again(self, turn: Propose) -> str:
        """Return what is said after a plan that has findings."""
        findings = [_told(finding) for finding in turn.findings]
        return self._render(
            "replan.j2", findings=list(dict.fromkeys(findings)), required=turn.task.required
        )

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

    def _names(self, kind: Kind) -> list[str]:
        found = self.kg.instances([kind.iri])
        return [self.kg.name(entity) for entity in found[:MOST_NAMES]]

    def _example(self, turn: Propose) -> dict[str, str] | None:
        """The nearest plan of the library, for its form."""
        library = read_library(self.folder / "library" / self.kg.domain.name)
        found = nearest_plan(turn.task.name, library)
        plan = found[0] if found else min(library, key=lambda p: len(p.body), default=None)
        if plan is None:
            return None
        items = plan.ingredients
        return {"task": plan.names[0], "plan": plan.render(plan.names[0], items).strip()}


def _signature(action: Action) -> str:
    parameters = [p.name + ("?" if p.optional or p.default else "") for p in action.visible]
    return f"{action.name}({', '.join(parameters)}): {action.explain}"


def _told(finding: Finding) -> str:
    where = f"line {finding.line}: " if finding.line else ""
    near = [name for name in finding.candidates if name not in finding.message]
    known = f" (known: {', '.join(near)})" if near and finding.code in _NAMES_NEAR else ""
    return f"{where}{finding.message}{known}"
