"""The codes of findings: what each means and whether it keeps a plan from being executable."""

from dataclasses import dataclass

from adaptbot_cli.core.plan import Finding


@dataclass(frozen=True, slots=True)
class Code:
    """A kind of finding: a title people read, whether it keeps the plan from being executed, and
    whether it is open until the plan or the knowledge changes (a goal that is not met is)."""

    title: str
    blocks: bool = True
    open: bool = True


CODES: dict[str, Code] = {
    "P101": Code("the text holds no plan"),
    "P102": Code("a call that cannot be read"),
    "P103": Code("a step under a condition"),
    "P104": Code("the plan is repeated", blocks=False, open=False),
    "P105": Code("text among the calls is left out", blocks=False, open=False),
    "P106": Code("a call that is not to be run", blocks=False, open=False),
    "E101": Code("unknown action"),
    "E102": Code("wrong number of arguments"),
    "E103": Code("not a value that the action takes"),
    "E201": Code("unknown item"),
    "E202": Code("wrong kind of item"),
    "E203": Code("a result of the plan, not an item of the home"),
    "E204": Code("a word for several items"),
    "E301": Code("attribute unknown"),
    "E302": Code("attribute rules it out"),
    "E401": Code("condition not met at this point"),
    "E402": Code("another robot holds it"),
    "E501": Code("required item missing from the plan", blocks=False),
    "E502": Code("required item lost by a new plan", blocks=False),
    "E503": Code("goal not met", blocks=False),
    "E504": Code("rejected by the person"),
    "E505": Code("something that the request excludes"),
    "E506": Code("an amount that the plan does not serve", blocks=False),
    "E601": Code("a step failed in the world"),
    "E602": Code("the world can no longer be asked"),
    "E603": Code("the world says that the goal is not met", blocks=False),
    "E604": Code("stopped before its end"),
    "W601": Code("something is left in the wrong state", blocks=False, open=False),
    "W602": Code("runs, but misses its point", blocks=False, open=False),
    "W603": Code("a step that cannot be done is not needed", blocks=False, open=False),
    "W604": Code("words of the request are not understood", blocks=False),
    "W605": Code("a missing step undoes an earlier one", blocks=False, open=False),
    "W606": Code("no goal is known for the task", blocks=False),
}
"""Every code a finding can have. P: the text; E1 to E4: the plan cannot be executed; E5: it misses
its goal; E6: the world disagrees; W: it runs. W604 and W606 are open until a person has
confirmed what is meant."""

OF_THE_REQUEST = frozenset({"W604", "W606"})
"""The codes of what only a person can mend: no other plan would."""


def blocks(finding: Finding) -> bool:
    """Tell whether a finding keeps the plan from being executed."""
    return finding.blocking or CODES[finding.code].blocks


def is_open(finding: Finding) -> bool:
    """Tell whether a finding stays until the plan or the knowledge changes."""
    return finding.blocking or CODES[finding.code].open
