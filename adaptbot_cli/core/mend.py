"""What a person can be offered where no knowledge helps: steps to add, steps to leave out.

Neither is done unasked: a step that brings a required item into the dish changes the recipe, and
one that cannot be done may matter for more than the goal says.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from adaptbot_cli.core.additions import Addition, additions
from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.examine import examine
from adaptbot_cli.core.plan import Parsed
from adaptbot_cli.core.report import Report
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.terms import Triple

_ROUNDS = 3
"""How often a mended plan is looked at again for what else would mend it."""

_IMPOSSIBLE = frozenset({"E102", "E103", "E202", "E203", "E204", "E301", "E302"})
_TOO_EARLY = frozenset({"E401"})
"""The codes of a step that nothing makes possible, and of one that is not possible where it stands,
so that steps before it may yet make it so."""


@dataclass(frozen=True, slots=True)
class Mended:
    """A plan that is nearer to its goal: its text, and each change of the old one in words.

    `reaches` tells whether it reaches the goal; `supposed` are facts that are not known and must be
    so for that.
    """

    text: str
    changes: tuple[str, ...]
    reaches: bool = True
    supposed: tuple[Triple, ...] = ()


def mended(report: Report, scene: Scene, parse: Callable[[str], Parsed]) -> Mended | None:
    """Return a plan without the steps that cannot be done and with those that the goal lacks.

    None if that does not make it executable, or brings it no nearer to its goal.
    """
    changes: list[str] = []
    supposed: list[Triple] = []
    short = len(report.open)
    best: Mended | None = None
    with scene.kg.rehearsal():
        for _ in range(_ROUNDS):
            out = _failing(report, _IMPOSSIBLE)
            added = additions(report, scene)
            if not out and not added:
                out = _failing(report, _IMPOSSIBLE | _TOO_EARLY)
            if not out and not added:
                break
            changes += _told(report, out, added)
            new = dict.fromkeys(fact for a in added for fact in a.supposed)
            scene.kg.apply(Delta(added=frozenset(new)))
            supposed += new
            text = _written(report, out, added)
            report = examine(parse(text), text, scene)
            if report.executable and len(report.open) < short:
                short = len(report.open)
                best = Mended(text, tuple(dict.fromkeys(changes)), not short, tuple(supposed))
            if not short:
                break
    return best


def _told(report: Report, out: set[int], added: Sequence[Addition]) -> list[str]:
    left_out = [
        f"leave out {report.steps[n].call.render()}: {report.steps[n].reason}" for n in sorted(out)
    ]
    return left_out + [f"add {a.told} {a.where}: {a.reason}" for a in added]


def _failing(report: Report, codes: frozenset[str]) -> set[int]:
    """The steps that nothing but these codes is found of."""
    steps = enumerate(report.steps)
    return {n for n, s in steps if s.status == "finding" and s.codes and set(s.codes) <= codes}


def _written(report: Report, out: set[int], added: Sequence[Addition]) -> str:
    """The plan's own steps as a text, without some and with others; the rest is found again."""
    lines = []
    for n in range(len(report.steps) + 1):
        lines += [call for a in added if a.place == n for call in a.calls]
        if n < len(report.steps):
            step = report.steps[n]
            if n not in out and step.status not in ("inserted", "dropped"):
                lines.append(step.call)
    return "\n".join(call.render() for call in lines)
