"""A run as far as it has come, and how a plan's text is looked at in it."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from adaptbot_cli.core import teach
from adaptbot_cli.core.examine import examine, names_to_look_up, words_to_look_up
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.mend import with_remedies
from adaptbot_cli.core.plan import Parsed, Task
from adaptbot_cli.core.questions import Answer, Key, Question
from adaptbot_cli.core.report import Report, Usage
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Checked, LookUp, Proposal, Propose, Turn

Policy = Literal["tutor", "paper"]
Parse = Callable[[str], Parsed]


@dataclass(slots=True)
class Run:
    """A run as far as it has come. `full` has every attribute of a new thing asked, `offers` are
    the new things that the person was offered to tell more of; `to_edit` is set when the person
    wants to change the plan instead of answering, `edits` lead from a plan's text to what the
    person has made of it."""

    kg: Kg
    task: Task
    parse: Parse
    scene: Scene
    policy: Policy = "tutor"
    full: bool = False
    usage: Usage = field(default_factory=Usage)
    asked: dict[Key, tuple[Question, Answer]] = field(default_factory=dict)
    lessons: list[Lesson] = field(default_factory=list)
    offers: set[str] = field(default_factory=set)
    stopped: bool = False
    to_edit: bool = False
    edits: dict[str, str] = field(default_factory=dict)


def look_at(run: Run, text: str, tell: bool = True) -> Generator[Turn, Any, Report]:
    """Parse, check, refine and repair a text, looking up the words that the KG does not know."""
    parsed = run.parse(text)
    calls = [written.call for written in parsed.calls]
    items, actions = words_to_look_up(calls, run.scene)
    domain = run.kg.domain
    for words, fields in ((items, domain.noun_fields), (actions, domain.verb_fields)):
        if words:
            found = yield LookUp(tuple(sorted(words)), fields)
            run.scene.known.update({word: found.get(word, ()) for word in words})
    back = names_to_look_up(items, run.scene)
    if back:
        found = yield LookUp(tuple(sorted(back)), domain.noun_fields)
        run.scene.known.update({word: found.get(word, ()) for word in back})
    report = with_remedies(examine(parsed, text, run.scene), run.scene)
    if tell:
        yield Checked(report)
    return report


def propose(run: Run, turn: Propose) -> Generator[Turn, Proposal, str]:
    """Have a plan proposed; return its text, or what the person has made of it before."""
    proposal = yield turn
    used = run.usage
    cost = proposal.cost_usd
    run.usage = replace(
        used,
        model_calls=used.model_calls + proposal.calls,
        prompt_tokens=used.prompt_tokens + proposal.prompt_tokens,
        completion_tokens=used.completion_tokens + proposal.completion_tokens,
        cost_usd=used.cost_usd if cost is None else (used.cost_usd or 0.0) + cost,
    )
    return as_edited(run, proposal.text)


def as_edited(run: Run, text: str) -> str:
    """Return what the person has made of a plan's text."""
    while text in run.edits:
        text = run.edits[text]
    return text


def forget_all(run: Run) -> None:
    """Take back all that a run has learned."""
    for lesson in reversed(run.lessons):
        teach.forget(lesson, run.scene)
    run.lessons = []
