"""What a transcript tells of each turn, as one YAML document."""

from typing import Any

import yaml

from adaptbot_cli.core.delta import Delta
from adaptbot_cli.core.editing import Edit, edited
from adaptbot_cli.core.kg import Kg
from adaptbot_cli.core.learning import Lesson
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Finding, Step
from adaptbot_cli.core.questions import LATER, Answer, Key, Question, Reviewed
from adaptbot_cli.core.report import Report, Result
from adaptbot_cli.core.terms import Triple, local
from adaptbot_cli.core.turns import (
    Act,
    Amend,
    Ask,
    Begin,
    Believe,
    Checked,
    Executed,
    Given,
    Keep,
    Kept,
    Learned,
    LookUp,
    Offer,
    Proposal,
    Propose,
    Review,
    Stop,
    Surprised,
    Trace,
    Turn,
    Understood,
)
from adaptbot_cli.core.world import Seen, fact_of, named, sentences

Document = dict[str, Any]
FORMAT = 1


class _Dumper(yaml.SafeDumper):
    """Writes texts of several lines as blocks, so that a plan reads as a plan."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = "|" if "\n" in text else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Dumper.add_representer(str, _text)


def dump(document: Document) -> str:
    """Write one document of a transcript."""
    return "---\n" + yaml.dump(
        document, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100
    )


def describe(turn: Turn, kg: Kg) -> Document | None:
    """Return a turn as a document, without its reply; None for what a transcript does not tell."""
    match turn:
        case Understood():
            return {"turn": "understood", "as": turn.reading.line}
        case Propose():
            findings = [finding_text(f) for f in turn.findings]
            about = {"task": turn.task.name, "attempt": turn.attempt}
            return {"turn": "propose", **about, "findings": findings}
        case Checked():
            return {"turn": "checked", **_report(turn.report)}
        case Ask():
            return {"turn": "ask", **_question(turn.question)}
        case Amend():
            return {"turn": "edit"}
        case Offer():
            asks = [question.prop for question in turn.questions]
            return {"turn": "offer", "about": turn.questions[0].about, "asks": asks}
        case Given():
            return {"turn": "given", **key_fields(turn.question.key), "answer": turn.answer.value}
        case Learned():
            return {"turn": "learned", **_lesson(turn.lesson, kg)}
        case Executed():
            outcome = turn.outcome
            error = finding_text(outcome.error) if outcome.error else None
            unmet = [finding_text(f) for f in outcome.unmet]
            steps = len(turn.report.live)
            return {"turn": "execute", "steps": steps, "error": error, "unmet": unmet}
        case Begin():
            return {"turn": "begin"}
        case Act():
            return {"turn": "act", "n": turn.number, "does": turn.step.call.render()}
        case Surprised():
            return {"turn": "surprised", "seen": sentences(turn.surprise, kg)}
        case Believe():
            return {"turn": "believe", "facts": _facts(turn.delta, kg)}
        case Stop():
            return {"turn": "stop", "why": turn.why}
        case Review():
            return {"turn": "review", "lessons": [lesson.sentence for lesson in turn.lessons]}
        case Keep():
            return {"turn": "keep", "lessons": [lesson.sentence for lesson in turn.lessons]}
        case LookUp() | Trace():
            return None


def _question(question: Question) -> Document:
    notes = {"notes": list(question.notes)} if question.notes else {}
    return {**key_fields(question.key), "text": question.text, **notes}


def key_fields(key: Key) -> Document:
    """Return what tells a question from others: its kind, what it is about, the property."""
    record = dict(zip(("kind", "about", "prop", "subject"), key, strict=True))
    return {k: v for k, v in record.items() if v and (k, v) != ("subject", "item")}


def key_of(reply: Any) -> Key | None:
    """Return the key that `told_of_key` told, None if it is none."""
    if not isinstance(reply, dict) or not {"kind", "about"} <= reply.keys():
        return None
    kind, about, prop = (str(reply.get(part, "")) for part in ("kind", "about", "prop"))
    return kind, about, prop, str(reply.get("subject", "item"))


def answer_text(value: object) -> str:
    """Return an answer as it is meant: YAML reads a bare yes as true."""
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def finding_text(finding: Finding) -> str:
    """Return a finding as a transcript tells it."""
    return f"{finding.code} {finding.message}"


def _report(report: Report) -> Document:
    return {
        "executable": report.executable,
        "steps": [_step(step) for step in report.steps],
        "findings": [finding_text(finding) for finding in report.findings],
    }


def _step(step: Step) -> str:
    return f"{step.status}: {step.call.render()}"


def _lesson(lesson: Lesson, kg: Kg) -> Document:
    return {"sentence": lesson.sentence, "facts": _facts(lesson.delta, kg)}


def _facts(delta: Delta, kg: Kg) -> list[str]:
    removed = [f"- {fact(triple, kg)}" for triple in sorted(delta.removed)]
    return removed + [f"+ {fact(triple, kg)}" for triple in sorted(delta.added)]


def fact(triple: Triple, kg: Kg) -> str:
    """Write a fact in short: `egg obj_location fridge`."""
    return " ".join(local(node) for node in triple)


def reply_fields(turn: Turn, reply: object, kg: Kg) -> Document:
    """Return what a document tells of a turn's reply."""
    match reply:
        case Proposal():
            tokens = {"prompt": reply.prompt_tokens, "completion": reply.completion_tokens}
            cost = {} if reply.cost_usd is None else {"cost_usd": reply.cost_usd}
            calls = {} if reply.calls == 1 else {"calls": reply.calls}
            spent = {"tokens": tokens} if any(tokens.values()) else {}
            failed = {"failure": reply.failure} if reply.failure else {}
            thought = {"reasoning": reply.reasoning} if reply.reasoning else {}
            prompt = {"prompt": reply.prompt} if reply.prompt else {}
            prompt |= {"source": reply.source} if reply.source else {}
            return {**prompt, **thought, "reply": reply.text, **calls, **spent, **cost, **failed}
        case Answer():
            to = {"to": key_fields(reply.to)} if reply.to is not None else {}
            taken = {"suggestion": reply.suggestion} if reply.suggestion else {}
            return {"answer": reply.value, **taken, **to, **_last(reply), **_by(reply)}
        case Edit():
            return _edit(turn, reply)
        case tuple() if isinstance(turn, Offer):
            return _offered(turn, reply)
        case Reviewed():
            if reply.back is not None:
                return {"back": key_fields(reply.back)}
            left_out = [key_fields(key) for key in sorted(reply.left_out)]
            return {"kept": True, **({"left_out": left_out} if left_out else {})}
        case Seen():
            return _seen(reply, kg)
        case Kept():
            return {"revision": reply.revision}
        case bool():
            return {"kept": reply}
        case _:
            return {}


def _seen(seen: Seen, kg: Kg) -> Document:
    """What a world answered; facts by the home's names."""
    record = {
        "failed": seen.failed,
        "observed": [list(named(fact, kg)) for fact in sorted(seen.observed)],
        "gone": [list(named(fact, kg)) for fact in sorted(seen.gone)],
        "odd": list(seen.odd),
        "over": seen.over,
    }
    goal = {} if seen.goal is None else {"goal": seen.goal}
    return {**{key: value for key, value in record.items() if value}, **goal}


def seen_of(document: Document, kg: Kg) -> Seen:
    """Return what a world answered, from a document that tells it. Raises ValueError."""
    observed, gone = (
        frozenset(fact_of(fact, kg) for fact in document.get(key) or ())
        for key in ("observed", "gone")
    )
    odd = tuple(map(str, document.get("odd") or ()))
    failed, over = str(document.get("failed", "")), str(document.get("over", ""))
    goal = document.get("goal")
    return Seen(failed, observed, gone, odd, over, goal if isinstance(goal, bool) else None)


def _edit(turn: Turn, edit: Edit) -> Document:
    text = "reason" if edit.kind == "reject" else "call"
    record = {"edit": edit.kind, "step": edit.step, "to": edit.to, text: edit.text}
    document = {**{key: value for key, value in record.items() if value}, **_by(edit)}
    if isinstance(turn, Amend) and edit.kind != "reject":
        document["plan"] = edited(edit, turn.report, parse)
    return document


def edit_of(document: Document) -> Edit:
    """Return the edit that a document tells."""
    kind = document["edit"]
    text = document.get("reason" if kind == "reject" else "call", "")
    by, at = str(document.get("by", "")), str(document.get("at", ""))
    return Edit(kind, document.get("step", 0), document.get("to", 0), str(text), by, at)


def _last(*answers: Answer) -> Document:
    return {"last": True} if any(answer.last for answer in answers) else {}


def _by(answer: Answer | Edit) -> Document:
    return {key: value for key, value in (("by", answer.by), ("at", answer.at)) if value}


def _offered(turn: Offer, answers: tuple[Answer, ...]) -> Document:
    """What was told of an offer; that the person went back or stopped is told once."""
    for answer in answers:
        if answer.to is not None:
            return {"answers": {}, "back": key_fields(answer.to)}
    given = [
        (question.prop, answer)
        for question, answer in zip(turn.questions, answers, strict=False)
        if answer.value != LATER.value
    ]
    by = _by(given[0][1]) if given else {}
    taken = {prop: answer.suggestion for prop, answer in given if answer.suggestion}
    return {
        "answers": {prop: answer.value for prop, answer in given},
        **({"suggestions": taken} if taken else {}),
        **_last(*answers),
        **by,
    }


def suggestion_of(document: Document, prop: str = "") -> str:
    """Return why an answer was suggested that was taken as it stood, "" if the person gave it; of
    an offer, the answer for a property."""
    taken = document.get("suggestions")
    found = taken.get(prop) if isinstance(taken, dict) else document.get("suggestion")
    return str(found or "")


def finished(result: Result) -> Document:
    """Return the last document: what the run came to."""
    return {"turn": "finished", "outcome": result.verdict, "goal_met": result.goal_met}
