"""One trial: one task in one arm, on a graph of its own."""

import json
import os
import random
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any, Protocol

from rdflib import XSD, Literal
from rdflib.term import Node

from adaptbot_cli import bounded
from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.planner import tokens
from adaptbot_cli.adapters.planner.budget import SECONDS, Asking, Budget, Limits
from adaptbot_cli.adapters.planner.choice import LIBRARY
from adaptbot_cli.adapters.planner.kept import KeptFirst, plan_of
from adaptbot_cli.adapters.planner.library import Library, LibraryPlan
from adaptbot_cli.adapters.planner.local import Board, model_file, on_board
from adaptbot_cli.adapters.planner.model import Model
from adaptbot_cli.adapters.planner.prompts import Part, Prompts, style_of
from adaptbot_cli.adapters.planner.scrub import secrets
from adaptbot_cli.adapters.planner.tokens import Recorded
from adaptbot_cli.adapters.simulated_person import SimulatedHuman
from adaptbot_cli.adapters.store.reading import load_kg, split
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.adapters.world.simulated import SimulatedHome
from adaptbot_cli.core.ask import teach
from adaptbot_cli.core.ask.learning import Lesson
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import ATTRIBUTES, STATES, Triple
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.plan import Finding, Task
from adaptbot_cli.core.refine.goals import check_goal
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.request.understand import understand
from adaptbot_cli.core.run import Plans
from adaptbot_cli.core.scene import Scene
from adaptbot_cli.core.turns import Planner, Proposal, Propose
from adaptbot_cli.core.tutor import Confirm, Policy, Turns, pursue
from adaptbot_cli.core.view.summary import findings
from adaptbot_cli.errors import ModelError, UsageError
from adaptbot_cli.evaluation import measures
from adaptbot_cli.evaluation.baseline import unaided
from adaptbot_cli.evaluation.measures import Trial
from adaptbot_cli.evaluation.recordings import Recording
from adaptbot_cli.resources import bundled
from adaptbot_cli.session.drive import Nowhere, Ports, drive


def plant(facts: Sequence[Triple], kg: Kg, share: float, seed: int) -> list[Triple]:
    """Return facts with errors in a share of the places and of the attributes.

    A wrong place is another one that something of the same class is kept in; an attribute of yes or
    no is missing or the other way round, one as often as the other. The same seed plants the same.
    """
    chance = random.Random(f"planted {seed}")
    locations = set(kg.domain.locations)
    kept: dict[Node, set[Node]] = {}
    for _, predicate, value in facts:
        if predicate in locations:
            kept.setdefault(predicate, set()).add(value)
    hands = set(kg.instances(k.iri for k in kg.domain.classes.values() if k.hand))
    planted = []
    for fact in sorted(facts):
        subject, predicate, value = fact
        places = sorted(kept.get(predicate, set()) - {value, subject} - hands, key=str)
        known = kg.domain.properties.get(predicate)  # type: ignore[call-overload]
        wrong = chance.random() < share
        if wrong and places:
            planted.append((subject, predicate, chance.choice(places)))
        elif wrong and known and known.graph != "state" and known.range == XSD.boolean:
            flipped = Literal(not value.toPython())  # type: ignore[attr-defined]
            planted += [(subject, predicate, flipped)] if chance.random() < 0.5 else []
        else:
            planted.append(fact)
    return planted


def repaired(result: Result, lost: frozenset[Triple]) -> tuple[int, int]:
    """Return how many of the facts that errors took away were put right: by the person who told
    them, and by what was seen of them."""
    found = {fact for lesson in result.lessons for fact in lesson.delta.added}
    surprise = result.outside.surprise if result.outside else Delta()
    seen = {fact[:2] for fact in surprise.removed | surprise.added}
    return len(lost & found), sum(fact[:2] in seen for fact in lost - found)


@dataclass(frozen=True, slots=True)
class Rules:
    """How trials are run. `human_error` is the probability of a wrong answer; `model` plans live,
    `LIBRARY` is the plan library; without one the rows' recorded answers plan. `api_base` is the
    address of the model's server, if it is not its provider's own. It is asked by the style
    `prompt`, without the parts to `leave_out`, and if `unseen` without the library's own plan of
    the task; it has `seconds` for a trial, and what it has answered is kept in `answers`.
    With `world` plans are carried
    out in the truth, which no arm sees whole, and judged there. With `keep` the person agrees to
    keep each plan that is offered to be kept; it comes first for its task, and is an example."""

    policy: Policy = "tutor"
    replans: int = 3
    human_error: float = 0.0
    seed: int = 0
    model: str | None = None
    api_base: str | None = None
    world: bool = False
    prompt: str = "auto"
    leave_out: frozenset[Part] = frozenset()
    unseen: bool = False
    seconds: float = SECONDS
    answers: "Answers | None" = None
    keep: bool = False


@dataclass(frozen=True)
class Basis:
    """What trials start from: a domain pack's files, the facts of the base graph, the truth.

    `base` and `truth` replace the facts of the pack, where they are given; `library` are its plans;
    `planted` are the facts that are wrong or missing in the base on purpose.
    """

    files: Mapping[str, bytes]
    where: str
    base: Sequence[Triple] | None = None
    truth: Sequence[Triple] | None = None
    library: tuple[LibraryPlan, ...] = ()
    planted: frozenset[Triple] = frozenset()

    @cached_property
    def _first(self) -> Kg:
        return load_kg(self.files, self.where, self.base)

    @cached_property
    def _facts(self) -> tuple[list[Triple], list[Triple]]:
        kg = self._first
        if self.base is not None:
            return split(self.base, kg.domain)
        return list(kg.graph(ATTRIBUTES)), list(kg.graph(STATES))

    @property
    def domain(self) -> Domain:
        """The domain of the pack."""
        return self._first.domain

    @cached_property
    def true(self) -> Kg:
        """The graph that knows the truth."""
        return load_kg(self.files, self.where, self.truth)

    def warm(self, models: Iterable[str]) -> None:
        """Load what trials need, so that processes forked from this one find it loaded."""
        self._facts, self.true  # noqa: B018 - both are worked out once, when first asked for
        words().related("thing", self.domain.noun_fields)
        for model in models:
            tokens.encoding_name(model)

    def __reduce__(self) -> tuple[object, ...]:
        """Give another process the sources: graphs live in an engine that cannot be sent."""
        given = (self.files, self.where, self.base, self.truth, self.library, self.planted)
        return (Basis, given)

    def home(self) -> Kg:
        """Return the truth as a home to act in, a new one each time."""
        true = self.true
        return Kg.load(true.domain, true.graph(ATTRIBUTES), true.graph(STATES))

    def fresh(self, carried: Sequence[Lesson] = ()) -> Kg:
        """Return the base graph, a new one each time, with lessons carried over."""
        kg = Kg.load(self._first.domain, *self._facts)
        scene = Scene(kg, Task(""))
        for lesson in carried:
            teach.accept(lesson, scene)
        return kg


@cache
def words() -> WordNet:
    """Return the word knowledge, loaded once for all worlds."""
    return WordNet()


@dataclass(slots=True)
class Listening:
    """A planner that remembers what another one said, and what it said before."""

    planner: Planner
    texts: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """The other planner's name."""
        return self.planner.name

    def propose(self, turn: Propose) -> Proposal:
        """Pass the turn on."""
        proposal = self.planner.propose(turn)
        self.texts.append(proposal.text)
        return proposal


class Answers(Protocol):
    """Where the answers of a live model are kept, by model and prompt."""

    def known(self) -> Mapping[str, dict[str, Any]]:
        """Return the answers that there are, by their keys."""

    def keep(self, record: dict[str, Any]) -> None:
        """Keep one more, an object with `key`, `seconds` and `answer`."""


@dataclass(frozen=True, slots=True)
class AnswersFile:
    """Answers in a file, one a line. Several processes may write to it."""

    path: Path

    def known(self) -> dict[str, dict[str, Any]]:
        """Read the answers; a last line that is not whole is no answer. Raises UsageError."""
        if not self.path.exists():
            return {}
        found = {}
        for line in bounded.read_text(self.path, bounded.GRAPH, UsageError).splitlines():
            with suppress(UsageError, KeyError, TypeError):
                reply = bounded.parse_json(line, str(self.path), UsageError)
                found[reply["key"]] = reply["answer"]
        return found

    def keep(self, record: dict[str, Any]) -> None:
        """Write an answer."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record, ensure_ascii=False) + "\n")


@dataclass(slots=True)
class Remembering:
    """A model whose answers are kept: it is asked nothing twice.

    So an experiment that was interrupted goes on in the middle of a trial, and one with other
    settings asks only what differs.
    """

    model: Model
    answers: Answers

    @property
    def name(self) -> str:
        """The model's name."""
        return self.model.name

    def propose(self, turn: Propose) -> Proposal:
        """Return the answer that was given to this prompt, or ask for it and keep it."""
        parts = [self.model.name, self.model.prompts.style, self.model.prompts.hash(turn)]
        key = " ".join(parts)
        kept = self.answers.known().get(key)
        if kept is not None:
            return Proposal(**kept)
        started = time.monotonic()
        proposal = self.model.propose(turn)
        seconds = round(time.monotonic() - started, 1)
        self.answers.keep({"key": key, "seconds": seconds, "answer": asdict(proposal)})
        return proposal


def task_of(row: Recording, kg: Kg) -> Task:
    """Return what a row asks for: its own items, and the goal that the domain lists for it.

    A row names its task itself, so nothing of the reading is in doubt; where no goal is known for
    it, it is judged by the items it requires. One that names several is judged by them all.
    """
    known = _together(understand(row.task, kg, words()).confirmed().tasks) or Task(row.task)
    name = known.name if known.excluded else row.task  # a name holds nothing that is excluded
    required = row.required or known.required
    return replace(known, name=name or row.task, required=required, thin=False)


def _together(tasks: Sequence[Task]) -> Task | None:
    """One task that is done if all are, each goal asked of the items of its own task."""
    if not tasks[1:]:
        return tasks[0] if tasks else None
    goals = (
        replace(goal, items=task.required) if goal.classes else goal
        for task in tasks
        for goal in task.goals
    )
    return replace(
        tasks[0],
        name=" and ".join(task.name for task in tasks),
        required=tuple(dict.fromkeys(name for task in tasks for name in task.required)),
        goals=tuple(goals),
        known=all(task.known for task in tasks),
        amount=max(task.amount for task in tasks),
        inside=tuple(pair for task in tasks for pair in task.inside),
        states=tuple(pair for task in tasks for pair in task.states),
    )


def perform(
    row: Recording, arm: str, basis: Basis, rules: Rules, carried: Sequence[Lesson] = ()
) -> tuple[Trial, tuple[Lesson, ...]]:
    """Run one trial; returns it with what was learned, to carry over."""
    started = time.perf_counter()
    kg = basis.fresh(carried)
    task = task_of(row, kg)
    kept = tuple(plan_of(lesson) for lesson in reversed(carried) if lesson.plan)
    planner = Listening(KeptFirst(kept, _planner(row, arm, rules, basis, kg, kept)))
    person = SimulatedHuman(basis.true, rules.human_error, f"{rules.seed}|{row.id}")
    human = person if arm == "llm+kg+human" else AbsentHuman()
    home = SimulatedHome(kg, basis.home(), "truth", seed=rules.seed) if rules.world else None
    ports = Ports(planner, human, words(), Nowhere(), (), home)
    result = drive(_turns(arm, task, kg, rules, home), ports)
    seconds = time.perf_counter() - started
    trial = _measured(row, arm, result, kg, person, seconds)
    if home is not None:
        trial = _in_world(trial, result, home, basis)
    parts = tuple(planner.texts) if rules.model else ()
    return replace(trial, answers=parts), result.lessons


def first_answer(row: Recording, basis: Basis, rules: Rules) -> str:
    """Ask a live model for the plan that all arms start from. Raises ModelError."""
    kg = basis.fresh()
    try:
        return live(rules, basis, kg).propose(Propose(task_of(row, kg))).text
    except ModelError as error:
        if not error.spent[0]:
            raise
        return ""  # it has answered, and that was no plan


def live(rules: Rules, basis: Basis, kg: Kg) -> Planner:
    """Return the planner that the rules name: a model, or the plan library."""
    if rules.model in (None, LIBRARY):
        return Library(basis.library, kg.domain, kg=kg)
    return _asked(rules, _model(rules, basis, kg))


def _planner(
    row: Recording, arm: str, rules: Rules, basis: Basis, kg: Kg, kept: tuple[LibraryPlan, ...]
) -> Planner:
    if rules.model == LIBRARY:
        return live(rules, basis, kg)  # it says the same each time, and costs nothing
    if rules.model is None:
        return Recorded(row.model, row.replies(arm), _prompts(basis, kg, rules))
    model = _model(rules, basis, kg, kept)
    if not row.answers:
        return _asked(rules, model)
    return Recorded(row.model, row.replies(arm), model.prompts, _asked(rules, model))


def _asked(rules: Rules, model: Model) -> Planner:
    """A model that is not asked again what it has answered."""
    return model if rules.answers is None else Remembering(model, rules.answers)


@cache
def _board(name: str) -> Board:
    """A model on board, started once for all trials of a process."""
    return Board(model_file(name))


def _model(rules: Rules, basis: Basis, kg: Kg, kept: tuple[LibraryPlan, ...] = ()) -> Model:
    name = rules.model or LIBRARY
    return Model(
        name,
        _prompts(basis, kg, rules, kept),
        Asking(api_base=rules.api_base),
        Budget(Limits(seconds=rules.seconds)),
        secrets(os.environ, rules.api_base),
        board=_board(name) if on_board(name) else None,
    )


def _prompts(basis: Basis, kg: Kg, rules: Rules, kept: tuple[LibraryPlan, ...] = ()) -> Prompts:
    how = style_of(rules.prompt), rules.leave_out, rules.unseen
    return Prompts(bundled("prompts"), kg, basis.library, *how, kept)


def _turns(arm: str, task: Task, kg: Kg, rules: Rules, home: SimulatedHome | None) -> Turns:
    replans = 0 if rules.model == LIBRARY else rules.replans
    if arm == "llm":  # what it names is what the world has of that name
        here = home.truth if home else kg
        return unaided(task, here, parser(here), replans)
    world: Confirm | None = "none" if home else None
    plans: Plans = "any" if rules.keep else "none"
    return pursue(task, kg, parser(kg), rules.policy, replans, world=world, plans=plans)


def _in_world(trial: Trial, result: Result, home: SimulatedHome, basis: Basis) -> Trial:
    """The trial with what the world says of it, whatever the arm believes."""
    outcome, outside = result.outcome, result.outside
    if trial.arm == "llm":  # each of its tries starts from the same state, and is taken back
        met = outcome is not None and outcome.error is None and not outcome.unmet
        failed, recovered = trial.model_calls - 1 + (not trial.executable), 0
    else:
        met = outside is not None and not check_goal(Scene(home.truth, result.report.task))[0]
        failed, recovered = (outside.failed, outside.recovered) if outside else (0, 0)
    count, seen = repaired(result, basis.planted)
    return replace(
        trial,
        world_goal_met=met,
        steps_failed=failed,
        recovered=recovered,
        repaired_by_person=count,
        repaired_by_seeing=seen,
    )


def _reported(arm: str, result: Result) -> tuple[Finding, ...]:
    """What an arm says of its own result: a model alone has nothing but the error that stops it."""
    if arm != "llm":
        return findings(result)
    error = result.outcome.error if result.outcome else None
    return (error,) if error else ()


def _measured(
    row: Recording, arm: str, result: Result, kg: Kg, person: SimulatedHuman, seconds: float
) -> Trial:
    required = result.report.task.required
    seen = measures.seen(result, required, _reported(arm, result), kg)
    usage = result.usage
    return Trial(
        id=row.id,
        arm=arm,
        task=row.task,
        model=row.model,
        domain=row.domain,
        index=row.index,
        outcome=result.verdict,
        executable=result.verdict == "executable",
        goal_met=result.goal_met,
        overlap=measures.share(seen.used, required),
        effective_overlap=measures.share(seen.worked, required),
        required_lost=len(seen.lost),
        model_calls=usage.model_calls,
        prompt_tokens=usage.prompt_tokens,
        completion_tokens=usage.completion_tokens,
        questions=len(person.about),
        prompts=person.prompts,
        person_seconds=round(person.seconds, 2),
        nodes=(result.sizes[0][0], result.sizes[1][0]),
        edges=(result.sizes[0][1], result.sizes[1][1]),
        seconds=round(seconds, 4),
        required=required,
        unused=tuple(name for name in required if name not in seen.used),
        unworked=tuple(name for name in required if name not in seen.worked),
        lost=seen.lost,
        findings=measures.codes(result),
        messages=measures.messages(result),
        substitutions=measures.substitutions(result),
        asked=measures.asked(result),
        taught=measures.taught(result),
        recorded=dict(row.recorded.get(arm, {})),
    )
