"""A person at a terminal is asked one thing, and what they say is written to standard output."""

import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from rdflib import RDF, Literal, URIRef
from rich.console import Console

from adaptbot_cli.adapters.terminal import TerminalHuman, canvas
from adaptbot_cli.adapters.terminal.picker import Picker
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import (
    ABSENT,
    EXISTS,
    UNKNOWN,
    Answer,
    Choice,
    Follows,
    Names,
    Question,
    Reviewed,
    Suggestion,
    yes_no,
)
from adaptbot_cli.core.graph.delta import Delta

EXISTENCE = (
    Choice("is", "it is another name for something you know", key="a"),
    Choice("instead", "use something else instead", "this time only", "u"),
    Choice(ABSENT, "no, there is none", "2 steps left out " * 6 + "for ever", "n"),
    Choice(EXISTS, "yes, there is", key="y"),
    Choice("later", "ask me later", key="l"),
)
KNOWN = Names(("spanner", "span_rope", *(f"part_{n}" for n in range(120)), "green_box", "öse"))
HOSTILE = "[red]x[/red] \x1b[31mESC <b>b</b> {x} %s \u202eright \x9b2J " + "y" * 300


def existence(about: str = "spaner", text: str = "", known: Names = KNOWN) -> Question:
    text = text or f'I do not know "{about}". Is there one?'
    near = known[:2]
    context = f'take("{about}")'
    return Question("existence", about, text, "", "item", EXISTENCE, known, near, (), context)


def boolean(prop: str, likely: str = "", **more: Any) -> Question:
    suggested = Suggestion(likely, "as for board") if likely else None
    text = f"Is plank {prop}?"
    return Question(
        "attribute", "plank", text, prop, "item", yes_no(), label=prop, suggested=suggested, **more
    )


FORM = Question(
    "place",
    "plank",
    "Where is plank kept?",
    "in",
    choices=(Choice("rack", "rack"), Choice("green_box", "green_box"), Choice(UNKNOWN, "?")),
    known=Names(("saw",)),
    label="place",
    context="drill(plank)",
    suggested=Suggestion("rack", "as for board"),
    together=(boolean("drillable", "yes"),),
    offered=(
        boolean("glass", "no"),
        boolean("heavy"),
        boolean("dry", follows=(Follows("glass", "yes", "yes"),)),
    ),
)

DRILLABLE = Question("attribute", "plank", "Can one drill plank?", "drillable", "item", yes_no())
KINDS = (Choice("part", "part"), Choice("tool", "tool"))
PLACES = (*(Choice(name, name) for name in KNOWN), Choice(UNKNOWN, "I don't know"))

QUESTIONS = {
    "existence": existence(),
    "nothing known": existence(known=Names()),
    "attribute": DRILLABLE,
    "kind": Question("kind", "spaner", "What is spaner?", choices=KINDS),
    "place": Question("place", "spaner", "Where is spaner kept?", "in", choices=PLACES),
    "value": Question("value", "spaner", "How long is it?", number="whole number"),
    "back": replace(
        DRILLABLE, answered=((Question("kind", "plank", "What is plank?"), Answer("part")),)
    ),
    "new place": Question(
        "kind",
        "crate",
        "What is crate?",
        choices=KINDS,
        context="Where is plank kept?",
        answered=((Question("place", "plank", "Where is plank kept?"), Answer("new crate")),),
    ),
    "form": FORM,
    "hostile": existence(HOSTILE, f"Is there {HOSTILE}?", (HOSTILE, "spanner")),
}


def lesson(key: tuple[str, str], sentence: str, *facts: Any) -> Lesson:
    question = Question(key[0], "shelf", "?", key[1])  # type: ignore[arg-type]
    return Lesson(Delta(added=frozenset(facts)), question, Answer("yes"), sentence)


STEPS = tuple(Choice(n, f"{n}  pick_up(part_{n})") for n in ("12", "2", "23", "31"))
SHELF, PLANK, IN = (URIRef(f"http://example.org/w#{name}") for name in ("shelf", "plank", "in"))
LESSONS = (
    lesson(("kind", ""), "there is shelf", (SHELF, RDF.type, URIRef("urn:w:furniture"))),
    lesson(("attribute", "open"), "shelf: open yes", (SHELF, URIRef("urn:w:open"), Literal(True))),
    Lesson(
        Delta(frozenset({(PLANK, IN, Literal("box"))}), frozenset({(PLANK, IN, Literal("rack"))})),
        QUESTIONS["place"],
        Answer("rack"),
        "plank is kept in the [bold]rack\x1b[2J",
    ),
)


def main() -> None:
    """Ask what the first argument names, not before the file `HOLD` is there, if that is set."""
    while "HOLD" in os.environ and not Path(os.environ["HOLD"]).exists():
        time.sleep(0.02)
    human = TerminalHuman(Console(stderr=True), "ann", lambda: "2030-01-02T03:04:05+00:00")
    try:
        said = said_of(human, sys.argv[1])
    except KeyboardInterrupt:
        sys.exit(130)
    if isinstance(said, Reviewed):
        said = [sorted(map(list, said.left_out)), said.back and list(said.back)]
    print(json.dumps(said))


def said_of(human: TerminalHuman, what: str) -> Any:
    """Ask; return what was said."""
    if what == "review":
        return human.review(LESSONS)
    if what == "steps":
        said = canvas.ask(Picker("Which?", "back", choices=STEPS, numbered=True), human.console)
        return said and said.value
    if what == "offer":
        return [answer.value for answer in human.offer(QUESTIONS["form"].offered)]
    question = QUESTIONS[what]
    answer = human.ask(question)
    if not (answer.to or question.together or question.offered):
        return [answer.value, answer.by, answer.at]
    later = question.together
    asked = [
        replace(each, together=later[n + 1 :], offered=question.offered)
        for n, each in enumerate(later)
    ]
    rest = [human.ask(each).value for each in asked]
    if question.offered:
        rest += [each.value for each in human.offer(question.offered)]
    return [answer.value, list(answer.to)] if answer.to else [answer.value, *rest]
