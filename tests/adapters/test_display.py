"""What the person sees, at 80 and at 140 columns."""

import io
import re
from collections.abc import Callable

import pytest
from rdflib import RDF, RDFS, Literal, URIRef
from rich.cells import cell_len
from rich.console import Console, RenderableType

from adaptbot_cli.adapters.display.diff import diff_table
from adaptbot_cli.adapters.display.plan_table import plan_table
from adaptbot_cli.adapters.display.screen import Screen
from adaptbot_cli.cli.common import show_opening
from adaptbot_cli.core.ask import learning
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.ask.questions import EXISTS, Answer, Question
from adaptbot_cli.core.domain import Action, Parameter
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.plan import Call, Change, Finding, Step, Task
from adaptbot_cli.core.report import Outcome, Report, Result, Usage
from adaptbot_cli.core.turns import Ask, Checked, Executed, Learned, Propose, Review
from adaptbot_cli.core.visible import visible
from tests.worlds import W, workshop

TASK = Task("wooden_stool", ("board",))
TIMBER = Change("timber", "board", "hypernym", "WordNet: timber is a kind of board")
QUESTION = Question("existence", "clamp", 'Is there a "clamp"?')
HOSTILE = "[red]x[/red] :boom: \x1b[31mE\x07 \u202eR \x9b2J\n" + "長い🙂" * 60

NO_CLAMP = Finding("E201", "clamp is not in the knowledge graph", "clamp", 5, ("clasp", "lamp"))
STEPS = (
    Step(Call("take_part", ("board",)), 'take_part("timber")', 1, "changed", (TIMBER,)),
    Step(Call("open", ("cupboard",)), status="inserted", reason="the door must be open"),
    Step(Call("wait", ("5",)), status="inserted", reason="the door must be open"),
    Step(Call("put", ("board", "bench")), "put(board, bench)", 2, "ok"),
    Step(Call("take", ("clamp",)), 'take("clamp")', 3, "finding", codes=("E201",)),
    Step(Call("put", ("clamp",)), 'put("clamp")', 4, "finding", codes=("E201", "E102")),
    Step(Call("sing"), "sing()", 5, "dropped", reason="sing is not here"),
    Step(Call("charge", ("drill",)), "charge(drill)", 6, "ok", codes=("W602",)),
)
REPORT = Report(TASK, "text", STEPS, (NO_CLAMP, Finding("E201", NO_CLAMP.message, "clamp", 6)))
GOOD = Report(TASK, "text", STEPS[:4], ())


def node(name: str) -> URIRef:
    return URIRef(W + name)


def delta(*changes: str) -> Delta:
    """`-board in cupboard` and `+board drilled true`."""
    values = {"true": Literal(True), "false": Literal(False)}
    sides: dict[str, set[tuple[URIRef, URIRef, URIRef | Literal]]] = {"-": set(), "+": set()}
    for change in changes:
        subject, predicate, value = change[1:].split()
        sides[change[0]].add((node(subject), node(predicate), values.get(value, node(value))))
    return Delta(frozenset(sides["-"]), frozenset(sides["+"]))


DELTAS = (
    delta("-board in cupboard", "+arm holds board"),
    delta("-cupboard doorOpen false", "+cupboard doorOpen true"),
    delta("-arm holds board", "+board in bench"),
    delta("-cupboard doorOpen true", "+cupboard doorOpen false"),
    delta("+board glass true", "-drill charged false"),
)


def lesson(kg: Kg) -> Lesson:
    kind = next(k for k in kg.domain.classes.values() if k.iri == node("tool"))
    taught = learning.existence(kg, "clamp", kind)
    place = delta("+clamp in bench")
    both = Delta(added=taught.added | place.added)
    kg.learn(both)
    return Lesson(both, QUESTION, Answer(EXISTS), "there is clamp: tool")


def result(kg: Kg, report: Report = GOOD, **given: object) -> Result:
    defaults: dict[str, object] = {
        "outcome": Outcome(DELTAS),
        "usage": Usage(2, 812, 240, 0.0021, 1),
        "lessons": (lesson(kg),),
        "sizes": ((13, 38), (14, 41)),
    }
    return Result(report, **{**defaults, **given})  # type: ignore[arg-type]


class Seen:
    """A console of some width, and what is on it."""

    def __init__(self, width: int, terminal: bool = False, **options: bool) -> None:
        self.console = Console(
            file=io.StringIO(),
            width=width,
            force_terminal=terminal,
            color_system="truecolor" if terminal else None,
            **options,  # type: ignore[arg-type]
        )

    def show(self, renderable: RenderableType) -> "Seen":
        self.console.print(renderable)
        return self

    @property
    def raw(self) -> str:
        file = self.console.file
        assert isinstance(file, io.StringIO)
        return file.getvalue()

    @property
    def lines(self) -> list[str]:
        plain = re.sub(r"\x1b\[[\d;]*m", "", self.raw)
        return [line.rstrip() for line in plain.splitlines()]

    @property
    def text(self) -> str:
        return "\n".join(self.lines)


def screen(seen: Seen, kg: Kg, **options: bool) -> Screen:
    return Screen(seen.console, kg, **options)


def final(width: int, **given: object) -> Seen:
    seen, kg = Seen(width), workshop()
    screen(seen, kg).finish(result(kg, **given), "1a2b3c4d5e6f")  # type: ignore[arg-type]
    return seen


def test_a_plan_shows_what_was_written_what_it_became_and_the_verdict() -> None:
    seen = Seen(80).show(plan_table(REPORT, 80))

    assert seen.text.split("\n\n")[0] == "\n".join(
        (
            "Plan",
            '1  take_part("timber")            take_part("board")  ~ changed',
            '2  because the door must be open  open("cupboard")    + inserted',
            "3                                 wait(5)             + inserted",
            "4  put(board, bench)                                  ✓ ok",
            '5  take("clamp")                                      ✗ E201',
            '6  put("clamp")                                       ✗ E201 +1',
            "7  sing()                         sing is not here    − dropped",
            "8  charge(drill)                                      ! W602",
        )
    )


def test_a_substitution_is_told_once_with_its_evidence() -> None:
    again = Step(Call("put", ("board",)), "put(timber)", 2, "changed", (TIMBER,))
    human = Change("stick", "plank", "alias", "stick is plank", "human")
    other = Step(Call("put", ("plank",)), "put(stick)", 3, "changed", (human,))
    report = Report(TASK, "", (STEPS[0], again, other), ())

    text = Seen(80).show(plan_table(report, 80)).text

    assert "timber → board  WordNet: timber is a kind of board (2 steps)" in text
    assert "stick → plank   stick is plank, approved by a person (1 step)" in text


def test_findings_that_say_the_same_are_one_with_their_steps_and_candidates() -> None:
    advice = Finding("W601", "stove is left on")
    parse = Finding("P102", "the call does not end", line=7)
    lines = Seen(80).show(plan_table(REPORT, 80, (advice, parse))).lines

    told = lines[lines.index("Findings") + 1 :]
    assert " ".join(" ".join(told[:2]).split()) == (
        "✗ E201 steps 5 and 6 clamp is not in the knowledge graph; could be clasp and lamp"
    )
    assert told[2:] == [
        "! W601  plan           stove is left on",
        "✗ P102  line 7         the call does not end",
    ]


def test_a_remedy_of_several_steps_is_told_to_its_end() -> None:
    remedy = ", ".join(f'put("board_{n}", "bench")' for n in range(5)) + " at the end"
    unmet = Finding("E503", "the boards are not on the bench", remedy=remedy)
    seen = Seen(80).show(plan_table(GOOD, 80, (unmet,)))

    assert " ".join(seen.text.split()).endswith("at the end would mend that")


def test_the_changes_are_folded_to_what_differs_at_the_end() -> None:
    kg = workshop()
    seen = Seen(60).show(diff_table((), DELTAS, kg, 60, ("drill",)))

    assert seen.lines == [
        "State after the plan",
        "−  drill  charged        no",
        "~  board  place          cupboard → bench",
        "+         made of glass  yes",
    ]


def test_of_very_many_changes_the_first_are_listed() -> None:
    kg = workshop()
    moved = {(URIRef(f"urn:x:{n:03}"), RDFS.comment, Literal("moved")) for n in range(130)}
    shown = Seen(70).show(diff_table((), [Delta(added=frozenset(moved))], kg, 70))
    assert shown.lines[-1] == "and 30 more"
    assert len(shown.lines) == 1 + 100 + 1


def test_what_was_learned_is_shown_with_its_graph() -> None:
    kg = workshop()
    action = Action(node("glue"), "glue", "", (Parameter("part"), Parameter("tool")))
    absent = Lesson(learning.absence(kg.domain, "dragon", "item"), QUESTION, Answer("absent"), "")
    taught = Lesson(Delta(added=frozenset({(node("glue"), RDF.type, node("x"))})), QUESTION,
                    Answer(EXISTS), "", action, notes=("glue(part, tool)",))  # fmt: skip
    lessons = (lesson(kg), absent, taught)

    lines = Seen(70).show(diff_table(lessons, None, kg, 70)).lines

    assert lines == [
        "Learned",
        "+  clamp   kind     tool  attribute",
        "+          called   clamp  attribute",
        "+          place    bench  state",
        "+  dragon  is here  no",
        "+  glue    action   glue(part, tool)",
        "",
        "State after the plan",
        "not executed",
    ]


def test_a_wide_screen_shows_plan_and_changes_side_by_side() -> None:
    lines = final(140).lines

    assert re.fullmatch(r"Plan {20,}Learned", lines[1])
    assert any("~ changed" in line and "clamp" in line for line in lines)


@pytest.mark.parametrize("width", [80, 109])
def test_a_narrow_screen_stacks_them(width: int) -> None:
    lines = final(width).lines

    assert lines.index("Plan") < lines.index("Learned") < lines.index("State after the plan")


def test_changes_that_would_wrap_beside_the_plan_stand_below_it() -> None:
    long = delta("-board in cupboard", "+board in a_rather_long_shelf" + "_and_longer" * 4)
    lines = final(140, outcome=Outcome((long,)), lessons=()).lines

    assert lines.index("Plan") < lines.index("State after the plan")


def test_a_call_without_spaces_is_broken_between_its_names() -> None:
    call = Call("put_down", ("large_measuring_cup", "kitchen_countertop"))
    step = Step(call, 'put_down("large_measuring_cup","kitchen_countertop")', 1)
    seen = Seen(48).show(plan_table(Report(TASK, "", (step,), ()), 48))

    assert [line.split("  ")[1].strip() for line in seen.lines[1:3]] == [
        'put_down("large_measuring_cup",',
        '"kitchen_countertop")',
    ]


def test_the_last_lines_say_what_the_run_came_to() -> None:
    assert final(80).lines[-3:] == [
        "✓ executable, goal met",
        "  graph: 13 → 14 nodes, 38 → 41 edges · 1 lesson committed as 1a2b3c4",
        "  2 answers · 812 prompt + 240 completion tokens · $0.0021 · 1 question answered",
    ]


def test_a_goal_that_is_not_met_says_what_is_missing() -> None:
    unmet = (Finding("E503", "board does not end on the bench", "board"),)
    seen = final(80, outcome=Outcome(DELTAS, None, unmet, ("board",)))

    assert (
        "✗ executable, but the goal is not met: board does not end on the bench; missing:\nboard"
        in seen.text
    )
    assert "✗ E503  plan  board does not end on the bench" in seen.text


def test_findings_that_remain_and_nothing_learned_are_said() -> None:
    seen = final(
        80, report=REPORT, outcome=None, lessons=(), usage=Usage(), sizes=((13, 38), (13, 38))
    )

    assert seen.lines[-2:] == [
        "✗ not executable: clamp is not in the knowledge graph",
        "  graph: 13 nodes, 38 edges · nothing learned",
    ]
    assert "Learned" not in seen.lines


def test_no_plan_is_said() -> None:
    seen = final(80, report=Report(TASK, "", (), ()), outcome=None, usage=Usage())

    assert "no step could be read from it" in seen.lines
    assert "✗ no plan: no step could be read from the text" in seen.lines


def test_a_run_is_told_in_lines_and_the_plan_before_the_first_question_only() -> None:
    seen, kg = Seen(100), workshop()
    shown = screen(seen, kg)
    shown.asked(Propose(TASK))
    shown.replied(Checked(REPORT), None)
    shown.asked(Propose(TASK, 1, "text", REPORT.findings))
    for turn in (Ask(QUESTION), Ask(QUESTION)):
        shown.asked(turn)
    shown.replied(Learned(lesson(kg)), None)
    shown.replied(Checked(GOOD), None)
    shown.replied(Checked(GOOD), None)
    shown.replied(Executed(GOOD, Outcome((), None, (NO_CLAMP,))), None)
    shown.asked(Review(()))

    lines = [line for line in seen.lines if line and line[0] in "PF!·✓"]
    assert lines == [
        "! checked: 8 steps, 1 changed, 2 inserted, 1 dropped, 1 finding",
        "· asking for another plan: 1 finding still open",
        "Plan",
        "Findings",
        "✓ noted: there is clamp: tool",
        "· checked: 4 steps, 1 changed, 2 inserted, nothing open",
        "! rehearsed on a copy of the state: the goal is not met (1 condition)",
    ]


def test_one_blank_line_sets_questions_off() -> None:
    seen, kg = Seen(80), workshop()
    shown = screen(seen, kg)
    shown.replied(Learned(lesson(kg)), None)
    shown.asked(Review(()))
    seen.show("keep it? yes")
    shown.replied(Review(()), True)
    shown.finish(result(kg), None)

    assert seen.text.count("\n\n\n") == 0
    assert "clamp: tool\n\nkeep it? yes\n\nPlan\n" in seen.text


def test_no_plan_is_shown_on_the_way_where_nobody_is_asked() -> None:
    seen, kg = Seen(80), workshop()
    shown = screen(seen, kg, asks=False)
    shown.replied(Checked(REPORT), None)
    shown.asked(Ask(QUESTION))

    assert "Plan" not in seen.lines


def test_an_execution_that_stops_says_where() -> None:
    seen = Seen(80)
    error = Finding("E401", "the hand must be free", step=3)
    screen(seen, workshop()).replied(Executed(GOOD, Outcome((), error)), None)

    assert seen.lines == ["✗ execution stopped at step 3: the hand must be free"]


def test_no_color_leaves_no_colour_and_a_pipe_no_code_at_all() -> None:
    def raw(**options: bool) -> str:
        seen, kg = Seen(140, **options), workshop()
        screen(seen, kg).finish(result(kg, REPORT), None)
        return seen.raw

    assert re.search(r"\x1b\[3\dm", raw(terminal=True))
    assert not re.search(r"\x1b\[(\d;)*[34]\d", raw(terminal=True, no_color=True))
    assert "\x1b" not in raw()


def hostile_report() -> Report:
    change = Change(HOSTILE, HOSTILE, "alias", HOSTILE)
    steps = (
        Step(Call("put", (HOSTILE,)), HOSTILE, 1, "changed", (change,)),
        Step(Call(HOSTILE), HOSTILE, 2, "dropped", reason=HOSTILE),
        Step(Call(HOSTILE), status="inserted", reason=HOSTILE),
        Step(Call("put", (HOSTILE, "z" * 300)), f"put({'z' * 300})", 4, "finding", codes=("E201",)),
    )
    findings = tuple(Finding("E201", f"{HOSTILE}{n}", HOSTILE, n, (HOSTILE,)) for n in (1, 2))
    return Report(Task(HOSTILE, (HOSTILE,)), HOSTILE, steps, findings, missing=(HOSTILE,))


def hostile_run(seen: Seen) -> None:
    kg, report = workshop(), hostile_report()
    known = Lesson(
        Delta(added=frozenset({(node("board"), URIRef(W + "called"), Literal(HOSTILE))})),
        QUESTION,
        Answer(HOSTILE, HOSTILE),
        HOSTILE,
    )
    kg.learn(known.delta)
    shown = Screen(seen.console, kg)
    show_opening(seen.console, HOSTILE, HOSTILE, HOSTILE, HOSTILE)
    shown.asked(Propose(report.task))
    shown.replied(Checked(report), None)
    shown.replied(Learned(known), None)
    shown.asked(Ask(Question("existence", HOSTILE, HOSTILE)))
    shown.replied(Executed(report, Outcome((), Finding("E401", HOSTILE))), None)
    shown.finish(result(kg, report, lessons=(known,), outcome=Outcome(DELTAS)), HOSTILE)


@pytest.mark.parametrize("width", [40, 80, 110, 140])
def test_text_from_outside_does_nothing_but_show(width: int) -> None:
    seen = Seen(width, terminal=True)
    hostile_run(seen)

    assert "[red]x[/red] :boom: ␛[31mE␇ �R �2J" in seen.text.replace("\n", " ") or width == 40
    for code in ("\x1b[31mE", "\x07", "\u202e", "\x9b"):
        assert code not in seen.raw


@pytest.mark.parametrize("width", [40, 80, 110, 140])
@pytest.mark.parametrize("run", [hostile_run, None])
def test_no_line_is_wider_than_the_screen(width: int, run: Callable[[Seen], None] | None) -> None:
    seen = Seen(width)
    if run is None:
        kg = workshop()
        screen(seen, kg).finish(result(kg, REPORT), "1a2b3c4")
    else:
        run(seen)

    assert max(cell_len(line) for line in seen.lines) <= width


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain 長い 🙂 👩‍🍳 é", "plain 長い 🙂 👩‍🍳 é"),
        ("\x1b[31m\x00\x07\x7f", "␛[31m␀␇␡"),
        ("a\tb\nc\r\nd\u2028e\u00a0f", "a b c  d e f"),
        ("\x85\x9b\u202a\u202e\u2066\u2069\u200b\ufeff\U000e0041\ud800", " " + "�" * 9),
    ],
)
def test_characters_that_control_are_made_visible(text: str, shown: str) -> None:
    assert visible(text) == shown
