"""Each turn and its reply as one YAML document, and back."""

from typing import Any

import yaml

from adaptbot_cli.core.ask.edit import Edit, edited
from adaptbot_cli.core.ask.questions import LATER, Answer, Key, Reviewed
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import local
from adaptbot_cli.core.parse import parse
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.report import Result
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
    """Return a turn as a document, without its reply; None for one that is not recorded."""
    match turn:
        case Understood():
            return {"turn": "understood", "as": turn.reading.line}
        case Propose():
            findings = [finding_text(f) for f in turn.findings]
            about = {"task": turn.task.name, "attempt": turn.attempt}
            return {"turn": "propose", **about, "findings": findings}
        case Checked():
            return {
                "turn": "checked",
                "executable": turn.report.executable,
                "steps": [f"{step.status}: {step.call.render()}" for step in turn.report.steps],
                "findings": [finding_text(finding) for finding in turn.report.findings],
            }
        case Ask():
            asked = {**key_fields(turn.question.key), "text": turn.question.text}
            return {"turn": "ask", **asked, **_filled(notes=list(turn.question.notes))}
        case Amend():
            return {"turn": "edit"}
        case Offer():
            asks = [question.prop for question in turn.questions]
            return {"turn": "offer", "about": turn.questions[0].about, "asks": asks}
        case Given():
            return {"turn": "given", **key_fields(turn.question.key), "answer": turn.answer.value}
        case Learned():
            sentence, delta = turn.lesson.sentence, turn.lesson.delta
            return {"turn": "learned", "sentence": sentence, "facts": _facts(delta)}
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
            return {"turn": "believe", "facts": _facts(turn.delta)}
        case Stop():
            return {"turn": "stop", "why": turn.why}
        case Review() | Keep():
            kind = "review" if isinstance(turn, Review) else "keep"
            return {"turn": kind, "lessons": [lesson.sentence for lesson in turn.lessons]}
        case LookUp() | Trace():
            return None


def _filled(**fields: object) -> Document:
    """Return the fields that are not empty."""
    return {key: value for key, value in fields.items() if value}


def key_fields(key: Key) -> Document:
    """Return what identifies a question: its kind, what it is about, the property."""
    record = dict(zip(("kind", "about", "prop", "subject"), key, strict=True))
    return {k: v for k, v in record.items() if v and (k, v) != ("subject", "item")}


def key_of(reply: Any) -> Key | None:
    """Return the key that `key_fields` made a document of, None if it is none."""
    if not isinstance(reply, dict) or not {"kind", "about"} <= reply.keys():
        return None
    kind, about, prop = (str(reply.get(part, "")) for part in ("kind", "about", "prop"))
    return kind, about, prop, str(reply.get("subject", "item"))


def finding_text(finding: Finding) -> str:
    """Return a finding as a transcript has it."""
    return f"{finding.code} {finding.message}"


def _facts(delta: Delta) -> list[str]:
    """Return facts in short, each with its sign: `+ egg obj_location fridge`."""
    return [
        f"{sign} {' '.join(map(local, triple))}"
        for sign, triples in (("-", delta.removed), ("+", delta.added))
        for triple in sorted(triples)
    ]


def reply_fields(turn: Turn, reply: object, kg: Kg) -> Document:
    """Return the part of a document that records the reply to a turn."""
    match reply:
        case Proposal():
            tokens = {"prompt": reply.prompt_tokens, "completion": reply.completion_tokens}
            return {
                **_filled(prompt=reply.prompt, source=reply.source, reasoning=reply.reasoning),
                "reply": reply.text,
                **({} if reply.calls == 1 else {"calls": reply.calls}),
                **_filled(tokens=tokens if any(tokens.values()) else None),
                **({} if reply.cost_usd is None else {"cost_usd": reply.cost_usd}),
                **_filled(failure=reply.failure),
            }
        case Answer():
            to = reply.to and key_fields(reply.to)
            more = _filled(suggestion=reply.suggestion, to=to, last=reply.last)
            return {"answer": reply.value, **more, **_filled(by=reply.by, at=reply.at)}
        case Edit():
            text = "reason" if reply.kind == "reject" else "call"
            fields = {"edit": reply.kind, "step": reply.step, "to": reply.to, text: reply.text}
            document = _filled(**fields, by=reply.by, at=reply.at)
            if isinstance(turn, Amend) and reply.kind != "reject":
                document["plan"] = edited(reply, turn.report, parse)
            return document
        case tuple() if isinstance(turn, Offer):
            return _offered(turn, reply)
        case Reviewed():
            if reply.back is not None:
                return {"back": key_fields(reply.back)}
            return {"kept": True, **_filled(left_out=[*map(key_fields, sorted(reply.left_out))])}
        case Seen():
            return {
                **_filled(
                    failed=reply.failed,
                    observed=[list(named(fact, kg)) for fact in sorted(reply.observed)],
                    gone=[list(named(fact, kg)) for fact in sorted(reply.gone)],
                    odd=list(reply.odd),
                    over=reply.over,
                ),
                **({} if reply.goal is None else {"goal": reply.goal}),
            }
        case Kept():
            return {"revision": reply.revision}
        case bool():
            return {"kept": reply}
        case _:
            return {}


def _offered(turn: Offer, answers: tuple[Answer, ...]) -> Document:
    """The answers to an offer; that the person went back or stopped is written once."""
    to = next((answer.to for answer in answers if answer.to is not None), None)
    if to is not None:
        return {"answers": {}, "back": key_fields(to)}
    pairs = zip(turn.questions, answers, strict=False)
    given = {q.prop: answer for q, answer in pairs if answer.value != LATER.value}
    first = next(iter(given.values()), LATER)
    taken = {prop: answer.suggestion for prop, answer in given.items() if answer.suggestion}
    last = any(answer.last for answer in answers)
    return {
        "answers": {prop: answer.value for prop, answer in given.items()},
        **_filled(suggestions=taken, last=last),
        **(_filled(by=first.by, at=first.at) if given else {}),
    }


def answer_text(value: object) -> str:
    """Return an answer as it is meant: YAML reads a bare yes as true."""
    return {True: "yes", False: "no"}[value] if isinstance(value, bool) else str(value)


def answer_of(document: Document, prop: str = "") -> Answer:
    """Return the answer in a document; of an offer, the one for a property."""
    value = document["answers"][prop] if prop else document.get("answer", LATER.value)
    taken = document.get("suggestions")
    suggestion = taken.get(prop) if isinstance(taken, dict) else document.get("suggestion")
    by, at = str(document.get("by", "")), str(document.get("at", ""))
    return Answer(answer_text(value), by, at, suggestion=str(suggestion or ""))


def edit_of(document: Document) -> Edit:
    """Return the edit in a document."""
    kind = document["edit"]
    text = document.get("reason" if kind == "reject" else "call", "")
    by, at = str(document.get("by", "")), str(document.get("at", ""))
    return Edit(kind, document.get("step", 0), document.get("to", 0), str(text), by, at)


def seen_of(document: Document, kg: Kg) -> Seen:
    """Return what a world answered, from its document. Raises ValueError."""
    observed, gone = (
        frozenset(fact_of(fact, kg) for fact in document.get(key) or ())
        for key in ("observed", "gone")
    )
    odd = tuple(map(str, document.get("odd") or ()))
    failed, over = str(document.get("failed", "")), str(document.get("over", ""))
    goal = document.get("goal")
    return Seen(failed, observed, gone, odd, over, goal if isinstance(goal, bool) else None)


def finished(result: Result) -> Document:
    """Return the last document: what the run came to."""
    return {"turn": "finished", "outcome": result.verdict, "goal_met": result.goal_met}
