"""The only wiring, and the only loop that performs turns."""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import (
    Ask,
    Execute,
    Executor,
    Human,
    Keep,
    Kept,
    LookUp,
    Observer,
    Planner,
    Proposal,
    Propose,
    Review,
    Store,
    Turn,
)
from adaptbot_cli.core.tutor import Policy, inspect, pursue
from adaptbot_cli.core.words import Lexicon
from adaptbot_cli.errors import ModelError
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from rich.console import Console

    from adaptbot_cli.adapters.display import Screen
    from adaptbot_cli.adapters.store.keeper import Keeper
    from adaptbot_cli.adapters.transcript import Recorder
    from adaptbot_cli.core.kg import Kg
    from adaptbot_cli.core.plan import Task


@dataclass(frozen=True, slots=True)
class Ports:
    """What the method's turns are performed with."""

    planner: Planner
    human: Human
    executor: Executor
    lexicon: Lexicon
    store: Store
    observers: Sequence[Observer] = ()


def drive(turns: Generator[Turn, Any, Result], ports: Ports) -> Result:
    """Perform every turn through the ports, show each to the observers, return the result."""
    reply: object = None
    while True:
        try:
            turn = turns.send(reply)
        except StopIteration as stop:
            result: Result = stop.value
            return result
        for observer in ports.observers:
            observer.asked(turn)
        reply = perform(turn, ports)
        for observer in ports.observers:
            observer.replied(turn, reply)


def perform(turn: Turn, ports: Ports) -> object:
    """Perform one turn through its port."""
    match turn:
        case Propose():
            return _proposal(turn, ports.planner)
        case LookUp():
            return {word: ports.lexicon.related(word, turn.fields) for word in turn.words}
        case Ask():
            return ports.human.ask(turn.question)
        case Execute():
            return ports.executor.execute(turn.report)
        case Review():
            return ports.human.review(turn.lessons)
        case Keep():
            return ports.store.keep(turn)
        case _:
            return None


def _proposal(turn: Propose, planner: Planner) -> Proposal:
    """Ask the planner; one that fails at a re-prompt ends the re-prompting, not the run, so that
    what the person has answered by then is kept."""
    try:
        return planner.propose(turn)
    except ModelError as error:
        if turn.attempt == 0:
            raise
        return Proposal(turn.previous, calls=0, failure=str(error))


@dataclass(frozen=True, slots=True)
class Request:
    """What a run is asked to do: the command line, read."""

    task: str
    domain: str
    model: str | None = None
    policy: Policy = "tutor"
    replans: int = 3
    requires: tuple[str, ...] = ()
    ask: bool = True
    answers: Path | None = None
    dry_run: bool = False
    apply: bool = False
    record: Path | None = None


@dataclass(slots=True)
class Session:
    """Everything that one run needs, wired. `revisions` are the workspace's, before and after;
    `state` is the one that holds the executed state, if it was kept."""

    request: Request
    kg: "Kg"
    task: "Task"
    ports: Ports
    planner: str
    screen: "Screen"
    replans: int
    keeper: "Keeper | None" = None
    recorder: "Recorder | None" = None
    edited: Sequence[str] = ()
    state: str | None = None
    revisions: list[str | None] = field(default_factory=lambda: [None, None])

    def run(self) -> Result:
        """Pursue the task; with `apply`, commit the state that the executed plan leaves."""
        request = self.request
        turns = pursue(self.task, self.kg, _parser(), request.policy, self.replans)
        result = drive(turns, self.ports)
        self.revisions[1] = result.revision or self.revisions[0]
        if request.apply and self.keeper and result.outcome and result.verdict == "executable":
            self.state = self.keeper.apply(self.task.name, result.outcome.deltas)
            self.revisions[1] = self.state
        if self.recorder is not None:
            self.recorder.finished(result)
        return result


class _Nowhere:
    """The store of a dry run: keeps nothing."""

    def keep(self, turn: Keep) -> Kept:
        return Kept(None)


def load(
    workspace: Workspace, domain: str, facts: Sequence[Path] = (), at: str | None = None
) -> "Kg":
    """Load a domain's graph: the workspace's or the bundled one.

    `facts` are Turtle files to take the facts from instead; `at` is a revision of the workspace.
    What a killed run left half written is finished or undone first.

    Raises:
        UsageError, KnowledgeError, PackError: what is asked for is not there or makes no sense.
    """
    from adaptbot_cli.adapters.store.files import settle
    from adaptbot_cli.adapters.store.reading import load_kg, read_graphs

    settle(workspace.root)
    folder = workspace.folder(domain)
    if at is not None:
        return load_kg(_files_at(workspace, domain, at), f"kg/{domain} at {at}")
    return load_kg(workspace.files(domain), str(folder), read_graphs(facts))


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
    from adaptbot_cli.adapters.display import Screen
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.planner.library import Library
    from adaptbot_cli.core.execute import Rehearsal
    from adaptbot_cli.core.tasks import task_for

    kg = load(workspace, request.domain)
    task = task_for(request.task, kg, request.requires)
    planner, why = _planner(request, workspace, environ, kg)
    with ExitStack() as stack:
        human = _human(request, prompts)
        asks = prompts is not None and request.ask and request.answers is None
        screen = Screen(console, kg, task, f"{planner.name} ({why})", asks)
        nobody: Any = None
        # The library says the same however often it is asked: a re-prompt would tell it nothing.
        replans = 0 if isinstance(planner, Library) else request.replans
        session = Session(request, kg, task, nobody, planner.name, screen, replans)
        transcript = _transcript(request, workspace)
        store: Store = _Nowhere()
        if not request.dry_run:
            store = session.keeper = _keeper(request, workspace, kg, planner.name, transcript)
            session.revisions[0] = session.keeper.start()
            session.edited = session.keeper.edited()
            _tell_edits(console, session.edited)
        elif workspace.has(request.domain):
            session.revisions[0] = _head(workspace)
        if transcript is not None:
            session.recorder = _recorder(stack, transcript, session)
        observers: list[Observer] = [screen]
        observers += [session.recorder] if session.recorder else []
        session.ports = Ports(planner, human, Rehearsal(kg), WordNet(), store, observers)
        yield session


def _planner(
    request: Request,
    workspace: Workspace,
    environ: Mapping[str, str],
    kg: "Kg",
) -> tuple[Planner, str]:
    from adaptbot_cli.adapters.planner.choice import choose
    from adaptbot_cli.adapters.planner.library import Library
    from adaptbot_cli.resources import bundled

    chosen = choose(request.model, workspace.settings, environ)
    folder = bundled("prompts")
    if chosen.model is None:
        return Library(folder / "library" / kg.domain.name, kg.domain), chosen.why
    from adaptbot_cli.adapters.planner.model import Model
    from adaptbot_cli.adapters.planner.prompts import Prompts

    return Model(chosen.model, Prompts(folder, kg)), chosen.why


def _human(request: Request, prompts: "Console | None") -> Human:
    from adaptbot_cli.adapters.answers import AnswersHuman, read_answers
    from adaptbot_cli.adapters.terminal import AbsentHuman, TerminalHuman

    if request.answers is not None:
        return AnswersHuman(read_answers(request.answers), _person(), str(request.answers))
    if prompts is None or not request.ask:
        return AbsentHuman()
    return TerminalHuman(prompts, _person(), lambda: _now().isoformat(timespec="seconds"))


def _person() -> str:
    import getpass

    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return ""


def _now() -> datetime:
    return datetime.now(UTC)


def _parser() -> Callable[[str], Any]:
    from adaptbot_cli.core.parsing import parse

    return parse


def _transcript(request: Request, workspace: Workspace) -> Path | None:
    """Where the run's transcript goes: where it is asked for, else into the workspace."""
    if request.record is not None or request.dry_run:
        return request.record
    from adaptbot_cli.core.learning import safe_name

    name = f"{_now():%Y%m%dT%H%M%S%f}-{safe_name(request.task)}.yaml"
    return workspace.transcripts / name


def _keeper(
    request: Request, workspace: Workspace, kg: "Kg", planner: str, transcript: Path | None
) -> "Keeper":
    from adaptbot_cli.adapters.store.keeper import Keeper, Origin

    origin = Origin(planner, transcript.name if transcript else "", _now)
    first = partial(workspace.first_files, request.domain)
    return Keeper(workspace.root, request.domain, kg, origin, first)


def _recorder(stack: ExitStack, path: Path, session: Session) -> "Recorder":
    from adaptbot_cli import __version__
    from adaptbot_cli.adapters.transcript import Recorder
    from adaptbot_cli.errors import KnowledgeError

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = stack.enter_context(path.open("w", encoding="utf-8", newline="\n"))
    except OSError as error:
        raise KnowledgeError(f"cannot write the transcript {path}: {error.strerror}") from error
    recorder = Recorder(file, session.kg)
    request = session.request
    recorder.header(
        {
            "version": __version__,
            "task": request.task,
            "domain": request.domain,
            "graph": (session.revisions[0] or "bundled") + (_EDITS if session.edited else ""),
            "policy": request.policy,
            "replans": session.replans,
            "requires": list(request.requires),
            "planner": session.planner,
        }
    )
    return recorder


def check(text: str, task: "Task", kg: "Kg") -> Result:
    """Check a plan's text on a graph, without model or human. Nothing in the world changes."""
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.terminal import AbsentHuman
    from adaptbot_cli.core.execute import Rehearsal

    nobody: Any = None
    ports = Ports(nobody, AbsentHuman(), Rehearsal(kg), WordNet(), _Nowhere())
    return drive(inspect(task, kg, _parser(), text), ports)


def replay(path: Path, workspace: Workspace, observers: Sequence[Observer] = ()) -> Result:
    """Replay a transcript: no key, no network, no change of the workspace.

    Raises:
        ReplayError: the run differs from the transcript; the message says at which turn and how.
    """
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.adapters.transcript import Player, read
    from adaptbot_cli.core.execute import Rehearsal
    from adaptbot_cli.core.tasks import task_for

    header, turns = read(path)
    kg = _kg_of(header, path, workspace)
    task = task_for(str(header.get("task", "")), kg, header.get("requires") or ())
    player = Player(path, kg, turns)
    ports = Ports(player, player, Rehearsal(kg), WordNet(), player, [player, *observers])
    policy, replans = header.get("policy", "tutor"), int(header.get("replans", 3))
    result = drive(pursue(task, kg, _parser(), policy, replans), ports)
    player.end(result)
    return result


_EDITS = " with edits"
"""Marks in a transcript that the graph was no revision: such a run cannot be played again."""


def _head(workspace: Workspace) -> str | None:
    from adaptbot_cli.adapters.store.history import head

    return head(workspace.root)


def _tell_edits(console: "Console", edited: Sequence[str]) -> None:
    if edited:
        from rich.text import Text

        told = f"! edited by hand and not committed: {', '.join(edited)}; used as they are"
        console.print(Text(told, "yellow"))


def _kg_of(header: Mapping[str, Any], path: Path, workspace: Workspace) -> "Kg":
    """The graph that a transcript was made on: the bundled one, or a revision of the workspace."""
    from adaptbot_cli.adapters.store.reading import load_kg, read_files
    from adaptbot_cli.errors import UsageError
    from adaptbot_cli.resources import bundled

    domain, graph = str(header.get("domain", "")), str(header.get("graph", "bundled"))
    if graph.endswith(_EDITS):
        raise UsageError(f"{path} was made on hand-edited files that were not committed: no replay")
    if graph == "bundled":
        folder = bundled("kg") / domain
        if not domain or not (folder / "domain.ttl").is_file():
            raise UsageError(f'{path}: there is no bundled domain "{domain}"')
        return load_kg(read_files(folder), f"kg/{domain}")
    return load_kg(_files_at(workspace, domain, graph), f"kg/{domain} at {graph[:10]}")


def _files_at(workspace: Workspace, domain: str, revision: str) -> dict[str, bytes]:
    from adaptbot_cli.adapters.store.history import files_at
    from adaptbot_cli.errors import KnowledgeError

    if not workspace.exists:
        raise KnowledgeError(f"no workspace is at {workspace.root}, so no revision {revision}")
    return files_at(workspace.root, domain, revision)
