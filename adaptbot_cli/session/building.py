"""The only wiring: a command line, read, made into a run."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from adaptbot_cli.core.report import Result
from adaptbot_cli.core.turns import Human, Observer, Planner, Store
from adaptbot_cli.core.tutor import Policy, pursue
from adaptbot_cli.session.driving import Nowhere, Ports, drive
from adaptbot_cli.session.loading import EDITS, load
from adaptbot_cli.workspace import Workspace

if TYPE_CHECKING:
    from rich.console import Console

    from adaptbot_cli.adapters.display import Screen
    from adaptbot_cli.adapters.store.keeper import Keeper
    from adaptbot_cli.adapters.transcript import Recorder
    from adaptbot_cli.core.kg import Kg
    from adaptbot_cli.core.plan import Task


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
        from adaptbot_cli.core.parsing import parse

        request = self.request
        turns = pursue(self.task, self.kg, parse, request.policy, self.replans)
        result = drive(turns, self.ports)
        self.revisions[1] = result.revision or self.revisions[0]
        if request.apply and self.keeper and result.outcome and result.verdict == "executable":
            self.state = self.keeper.apply(self.task.name, result.outcome.deltas)
            self.revisions[1] = self.state
        if self.recorder is not None:
            self.recorder.finished(result)
        return result


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
        store: Store = Nowhere()
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
    from adaptbot_cli.adapters.planner.local.found import on_board
    from adaptbot_cli.adapters.planner.model import Model
    from adaptbot_cli.adapters.planner.prompts import Prompts

    if on_board(chosen.model):
        from adaptbot_cli.adapters.planner.local.prompts import BoardPrompts

        board = BoardPrompts(chosen.model, folder, kg)
        return Model(board.model, board), chosen.why
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
            "graph": (session.revisions[0] or "bundled") + (EDITS if session.edited else ""),
            "policy": request.policy,
            "replans": session.replans,
            "requires": list(request.requires),
            "planner": session.planner,
        }
    )
    return recorder


def _head(workspace: Workspace) -> str | None:
    from adaptbot_cli.adapters.store.history import head

    return head(workspace.root)


def _tell_edits(console: "Console", edited: Sequence[str]) -> None:
    if edited:
        from rich.text import Text

        told = f"! edited by hand and not committed: {', '.join(edited)}; used as they are"
        console.print(Text(told, "yellow"))
