"""The only wiring: a command line, read, made into a run."""

import os
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, fields
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adaptbot_cli import __version__, bounded, trust
from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import CommitSource, Keeper
from adaptbot_cli.adapters.store.reading import read_graphs
from adaptbot_cli.core.ask.learning import safe_name
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.robots import acting_as
from adaptbot_cli.core.graph.validate import faults
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.plan import Finding
from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Human, Observer, Planner, Turn
from adaptbot_cli.core.tutor import Confirm, Policy, pursue_each
from adaptbot_cli.core.world import STOPPED
from adaptbot_cli.errors import KnowledgeError, ModelError, WorldError
from adaptbot_cli.resources import bundled, root_of
from adaptbot_cli.session.author import now, person, stamp
from adaptbot_cli.session.drive import Nowhere, Ports, drive
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.past_runs import content_of, guarded, remembering, spent
from adaptbot_cli.session.sources import EDITS, load, reader, started_on
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from rich.console import Console

    from adaptbot_cli.adapters.display.screen import Screen
    from adaptbot_cli.adapters.planner.choice import Chosen
    from adaptbot_cli.adapters.planner.library import LibraryPlan
    from adaptbot_cli.adapters.transcript.recorder import Recorder
    from adaptbot_cli.adapters.world.process import Process
    from adaptbot_cli.adapters.world.simulated import SimulatedHome
    from adaptbot_cli.session.exchange import Sharing


REHEARSAL, EXEC = "rehearsal", "exec:"
"""The kinds of world that `--world` names, beside a Turtle file."""

ACT_SECONDS = 60.0
"""How long a world may take for one step, unless it is said."""


@dataclass(frozen=True, slots=True)
class Request:
    """What a run is asked to do: the command line, read.

    `chosen` is who plans, if that is decided already: else it follows from `model` and `api_base`.
    `timeout` (seconds of waiting), `max_tokens` and `max_cost` (US dollars) limit the model.
    `prompt` says how it is asked for a plan: `auto`, or a style of `planner/prompts.py`.
    `full` has every attribute of a new thing asked; `edit` offers the plan for editing before it is
    executed; `resumes` is the transcript to go on with. `world` is what carries the plan out, None
    for a rehearsal: a Turtle file, in which steps slip with the probability `world_noise`, or
    `exec:COMMAND`, which has `act_timeout` seconds for a step; `confirm` says which steps the
    person agrees to; `robot` is the name of the one that acts, "" for the domain's own.
    """

    task: str
    domain: str
    model: str | None = None
    policy: Policy = "tutor"
    replans: int = 3
    requires: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    ask: bool = True
    answers: Path | None = None
    dry_run: bool = False
    apply: bool = False
    record: Path | None = None
    api_base: str | None = None
    timeout: float | None = None
    max_tokens: int | None = None
    max_cost: float | None = None
    temperature: float = 0.0
    seed: int = 0
    chosen: "Chosen | None" = None
    full: bool = False
    edit: bool = False
    resumes: Path | None = None
    world: str | None = None
    world_noise: float = 0.0
    act_timeout: float = ACT_SECONDS
    confirm: Confirm = "none"
    prompt: str = "auto"
    robot: str = ""


@dataclass(slots=True)
class Session:
    """Everything that one run needs, wired. `revisions` are the workspace's, before and after;
    `state` is the one that holds the executed state, if it was kept. `unused` returns which entries
    of a file of answers were not asked for; `library` is whether the plan library plans."""

    request: Request
    kg: Kg
    turns: Generator[Turn, Any, Result]
    ports: Ports
    screen: "Screen"
    keeper: Keeper | None
    recorder: "Recorder | None"
    transcript: Path | None
    unused: Callable[[], list[str]]
    root: Path
    library: bool
    revisions: tuple[str | None, str | None]
    state: str | None = None
    stopped: bool = False

    def run(self) -> Result:
        """Pursue the task; with `apply`, commit the state that the executed plan leaves."""
        try:
            result = drive(self.turns, self.ports)
        except ModelError as error:
            # The library has no plan the next time either: there is nothing to resume.
            if self.recorder is not None and self.library:
                self.recorder.planless(str(error))
            raise
        before, after = self.revisions[0], result.revision or self.revisions[0]
        for run in result.runs or (result,):
            if run.outside is not None or not self.request.apply or self.keeper is None:
                continue  # what was done outside is kept already, step by step
            if run.outcome and run.verdict == "executable":
                self.state = self.keeper.apply(run.report.task.name, run.outcome.deltas)
                after = self.state
        self.revisions = before, after
        last = result.outcome.error if result.outcome else None
        self.stopped = last is not None and is_stopped(last)
        if self.recorder is not None and not self.stopped:  # else it can be gone on with
            self.recorder.finished(result)
        return result

    @property
    def acted(self) -> bool:
        """Whether something was committed in this run before it ended."""
        return self.keeper is not None and _head(self.root) != self.revisions[0]


@contextmanager
def build(
    request: Request,
    workspace: Workspace,
    environ: Mapping[str, str],
    console: "Console",
    prompts: "Console | None",
) -> Iterator[Session]:
    """Wire a run. `console` shows it; `prompts` is the terminal to ask at, None if there is none.

    Raises:
        UsageError, KnowledgeError, PackError: the domain or the workspace will not do.
    """
    from adaptbot_cli.adapters.display.cells import warn
    from adaptbot_cli.adapters.display.screen import Screen
    from adaptbot_cli.adapters.planner.choice import choose
    from adaptbot_cli.adapters.planner.kept import KeptFirst, find, kept_plans

    model, base = request.model, request.api_base
    chosen = request.chosen or choose(model, workspace.settings, environ, base)
    rejects = chosen.model is not None
    human = human_of(request.answers, prompts if request.ask else None, request.edit, rejects)
    sharing = None if request.dry_run else _sharing(request, workspace, human, console)
    start = None if request.dry_run else started_on(request.domain, workspace)
    kg = acting_as(start.kg if start else load(workspace, request.domain), request.robot)
    words = WordNet()
    # Read for the plans that are kept, and by the run: once.
    read = cache(reader(kg, workspace, request.requires, request.without, words))
    kept, broken = kept_plans(workspace.kept_plans(request.domain))
    planner = _planner(request, chosen, environ, kg, workspace, console, kept)
    # The library says the same however often it is asked: a re-prompt would tell it nothing.
    replans = 0 if chosen.model is None else request.replans
    transcript = request.record
    if transcript is None and not request.dry_run:
        name = f"{now():%Y%m%dT%H%M%S%f}-{safe_name(request.task)}.yaml"
        transcript = workspace.transcripts / name
    with ExitStack() as stack:
        if sharing is not None:
            sharing.inner, sharing.learn = planner, kg.learn
            planner = sharing
            stack.callback(sharing.send)
        if kept and any(find(task, kept) for task in read(request.task).tasks):
            planner = KeptFirst(kept, planner, chosen.model is not None)
            replans = replans or 1  # if it no longer serves, the other planner is asked after all
        keeper, before = None, None
        if start is not None:
            keeper = keeper_of(kg.domain, workspace, planner.name, transcript)
            before = start.revision
            left_out = map("left out: {}".format, broken.values())
            for text in (*_edits(start.edited, kg), *start.notes, *left_out):
                warn(console, text)
        elif workspace.has(request.domain):
            before = _head(workspace.root)
        unused: Callable[[], list[str]] = getattr(human, "unused", list)
        over: tuple[tuple[str, str], ...] = ()
        done: tuple[str, ...] = ()
        if request.resumes is not None:
            planner, human, over, done = remembering(request.resumes, planner, human)
        recorder = None
        if transcript is not None:
            graph = (before or "bundled") + (EDITS if start and start.edited else "")
            header = {
                **_header(request, chosen, kg.domain.robot, graph, replans, planner.name),
                **({"over": [list(each) for each in over]} if over else {}),
                **({"done": list(done)} if done else {}),
            }
            recorder = stack.enter_context(recording(transcript, kg, header))
        asks = prompts is not None and request.ask and request.answers is None
        screen = Screen(console, kg, asks, request.edit)
        world = world_of(request, kg)
        if world is not None:
            stack.callback(world.close)
            screen.world, screen.how = world.name, getattr(world, "how", "")
        observers: list[Observer] = [screen, *([recorder] if recorder else [])]
        turns = pursue_each(
            request.task,
            read,
            kg,
            parser(kg),
            request.policy,
            replans,
            request.full,
            request.confirm if world else None,
            done,
            over,
            "none" if start is None else "changed" if chosen.model is None else "any",
        )
        yield Session(
            request,
            kg,
            turns,
            Ports(planner, human, words, keeper or Nowhere(), observers, world),
            screen,
            keeper,
            recorder,
            transcript,
            unused,
            workspace.root,
            chosen.model is None,
            (before, None),
        )


def _sharing(
    request: Request, workspace: Workspace, human: Human, console: "Console"
) -> "Sharing | None":
    """Return the exchange with the shared graph, if one is configured, once what the request names
    is fetched."""
    if not os.environ.get("ADAPTBOT_KG_ENDPOINT") and "kg.endpoint" not in workspace.settings:
        return None
    from adaptbot_cli.adapters.display.cells import warn
    from adaptbot_cli.session.exchange import Served, Sharing

    served = Served.of(Home(workspace, request.domain), human)
    found = Sharing(served, partial(warn, console))
    found.fetch(request.task)
    return found


def world_of(request: Request, kg: Kg) -> "Process | SimulatedHome | None":
    """Return what carries a plan out, None if it is only rehearsed.

    Raises:
        WorldError: there is no such world, or it cannot be read.
    """
    asked = request.world or REHEARSAL
    if asked == REHEARSAL:
        return None
    if asked.startswith(EXEC):
        from adaptbot_cli.adapters.world.process import Process

        process = Process(asked.removeprefix(EXEC).strip(), kg, request.act_timeout)
        process.find()
        return process
    from adaptbot_cli.adapters.world.simulated import SimulatedHome

    try:
        facts = read_graphs([Path(asked)]) or []
        return SimulatedHome.of(kg, facts, asked, request.world_noise, request.seed)
    except KnowledgeError as error:
        raise WorldError(
            f"{error}; --world takes {REHEARSAL}, a Turtle file or '{EXEC}COMMAND'"
        ) from error


def _planner(
    request: Request,
    chosen: "Chosen",
    environ: Mapping[str, str],
    kg: Kg,
    workspace: Workspace,
    console: "Console",
    kept: "Sequence[LibraryPlan]",
) -> Planner:
    library = workspace.library(request.domain)
    if chosen.model is None:
        from adaptbot_cli.adapters.planner.library import Library

        others = {n: workspace.library(n) for n in workspace.domains() if n != request.domain}
        return Library(library, kg.domain, others, kg)
    from adaptbot_cli.adapters.display.stream import Stream
    from adaptbot_cli.adapters.planner.budget import SECONDS, Asking, Budget, Limits
    from adaptbot_cli.adapters.planner.model import Model
    from adaptbot_cli.adapters.planner.prompts import Prompts, style_of
    from adaptbot_cli.adapters.planner.scrub import secrets

    limits = Limits(request.max_tokens, request.max_cost, request.timeout or SECONDS)
    return Model(
        chosen.model,
        Prompts(bundled("prompts"), kg, library, style_of(request.prompt), kept=tuple(kept)),
        Asking(request.temperature, request.seed, chosen.api_base),
        Budget(limits, spent(request.resumes) if request.resumes else []),
        secrets(environ, chosen.api_base),
        Stream(console, chosen.model),
    )


def human_of(
    answers: Path | None, prompts: "Console | None", edits: bool = False, rejects: bool = True
) -> Human:
    """Return who answers: a file, the person at the terminal `prompts`, or nobody.

    The person may have the plan to edit (`edits`), and a model's plan to reject (`rejects`).
    """
    from adaptbot_cli.adapters.answers import AnswersHuman, read_answers
    from adaptbot_cli.adapters.terminal import AbsentHuman, TerminalHuman

    if answers is not None:
        return AnswersHuman(read_answers(answers), person(), str(answers))
    if prompts is None:
        return AbsentHuman()
    return TerminalHuman(prompts, person(), stamp, edits=edits, rejects=rejects)


def keeper_of(
    domain: Domain, workspace: Workspace, planner: str, transcript: Path | None
) -> Keeper:
    """Return the store of a workspace's domain, with where what it keeps will come from."""
    from adaptbot_cli.adapters.planner.kept import plan_file

    name = ""
    if transcript is not None:
        inside = transcript.is_relative_to(workspace.transcripts)
        name = str(transcript.relative_to(workspace.transcripts)) if inside else transcript.name
    source = CommitSource(planner, name, now, domain.robot)
    return Keeper(workspace.root, domain.name, source, plan_file=plan_file, large=workspace.large)


@contextmanager
def recording(path: Path, kg: Kg, header: Mapping[str, Any]) -> Iterator["Recorder"]:
    """Begin a transcript. Raises KnowledgeError if it cannot be written."""
    from adaptbot_cli.adapters.planner.choice import LIBRARY
    from adaptbot_cli.adapters.transcript.recorder import Recorder

    try:
        file = bounded.open_text(path, root_of(path))
    except OSError as error:
        raise KnowledgeError(f"cannot write the transcript {path}: {error.strerror}") from error
    recorder = Recorder(file, kg)
    try:
        try:
            recorder.header({"version": __version__, **header})
        except KnowledgeError:  # a transcript without its header is none
            path.unlink(missing_ok=True)
            raise
        own = partial(trust.trust_own, path, content_of(header))
        if {**guarded(header), "model": header.get("model", LIBRARY)} == {"model": LIBRARY}:
            recorder.signed = own  # without model, world and answers there is nothing to trust
        else:
            own()
        yield recorder
    finally:
        with suppress(OSError):  # each turn was flushed; what failed then was raised then
            file.close()


OPTIONS = ("full", "edit", "apply", "world", "world_noise", "act_timeout", "confirm")
"""The options, as fields of a request, that a transcript's header has if they are not as usual."""

ASKED = ("prompt", "temperature", "seed")
"""How a model is asked: what the header of its run has besides, always."""

LIMITS = ("timeout", "max_tokens", "max_cost")

_USUAL: dict[str, Any] = {each.name: each.default for each in fields(Request)}


def recorded(header: Mapping[str, Any], own: bool) -> dict[str, Any]:
    """Return the options of a transcript's header, as fields of a request: those of a type that
    fits. Of a run that is not one's own nothing is applied; its world needs trust."""
    names = {"policy", *ASKED, *OPTIONS} - ({"world"} if own else {"world", "apply"})
    kinds = {name: type(_USUAL[name]) for name in names & header.keys()}
    fitting = {name: (int, float) if kind is float else kind for name, kind in kinds.items()}
    return {name: header[name] for name in kinds if isinstance(header[name], fitting[name])}


def _header(
    request: Request, chosen: "Chosen", robot: str, graph: str, replans: int, planner: str
) -> dict[str, Any]:
    """Return what a transcript says of its run, so that it can be gone on with as it began.

    An address that could hold a password is left out.
    """
    from adaptbot_cli.adapters.planner.choice import LIBRARY

    base = chosen.api_base or ""
    told: dict[str, Any] = {"model": LIBRARY}
    if chosen.model is not None:
        told = {"model": chosen.model, **{name: getattr(request, name) for name in ASKED}}
        limits = {name: getattr(request, name) for name in LIMITS}
        limits = {"api_base": base if not {"@", "?"} & set(base) else "", **limits}
        told |= {name: value for name, value in limits.items() if value not in (None, "")}
    options = {name: getattr(request, name) for name in OPTIONS}
    return {
        "task": request.task,
        "domain": request.domain,
        **({"robot": robot} if robot else {}),
        "graph": graph,
        "policy": request.policy,
        "replans": replans,
        "requires": list(request.requires),
        **({"without": list(request.without)} if request.without else {}),
        "planner": planner,
        **told,
        **{n: value for n, value in options.items() if value not in (_USUAL[n], REHEARSAL)},
        **({"resumes": request.resumes.stem} if request.resumes else {}),
    }


def is_stopped(error: Finding) -> bool:
    """Tell whether what ended a run is that the person pressed Ctrl-C."""
    return error.code == "E604" and error.prop == STOPPED


def _head(root: Path) -> str | None:
    repo = Repo.open(root)
    return repo.head() if repo is not None else None


def _edits(edited: Sequence[str], kg: Kg) -> Iterator[str]:
    if edited:
        yield f"edited by hand and not committed: {', '.join(edited)}; used as they are"
        for fault in faults(kg)[:1]:
            yield f"{fault}; see adaptbot kg validate --domain {kg.domain.name}"
