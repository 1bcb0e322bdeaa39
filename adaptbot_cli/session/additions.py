"""Teaching a thing without a task."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

from adaptbot_cli import bounded
from adaptbot_cli.core.ask.learning import Lesson, is_absent, safe_name
from adaptbot_cli.core.ask.new_thing import teach_thing
from adaptbot_cli.core.ask.questions import STOP
from adaptbot_cli.core.names import normal
from adaptbot_cli.core.parse import parser
from adaptbot_cli.core.turns import Ask, Human, Turn
from adaptbot_cli.errors import Interrupted, KnowledgeError, UsageError
from adaptbot_cli.resources import root_of
from adaptbot_cli.session.author import person
from adaptbot_cli.session.build import human_of
from adaptbot_cli.session.change import keeper
from adaptbot_cli.session.drive import Noting, drive, without_planner
from adaptbot_cli.session.home import Home

if TYPE_CHECKING:
    from rich.console import Console


def teach(
    home: Home,
    name: str,
    answers: Path | None,
    prompts: "Console | None",
    agreed: bool = False,
    dry_run: bool = False,
) -> tuple[Sequence[Lesson], str | None]:
    """Ask all about a thing, have it reviewed, commit it; return what was taught and the revision,
    None if nothing was kept.

    `prompts` is the terminal to ask at. What a file of answers teaches is reviewed there too,
    unless it is `agreed` to; with `dry_run` nothing is kept. An interruption leaves the answers
    given so far in a file from which they can be given again.

    Raises:
        UsageError: there is nobody to ask, or the name says nothing.
        KnowledgeError: what was taught cannot be kept.
        Interrupted: the person pressed Ctrl-C; the message names the file with the answers.
    """
    if not normal(name):
        raise UsageError("say what there is: adaptbot kg add NAME")
    if is_absent(home.kg, name, "item"):
        raise UsageError(
            f"{name} is not here, as a person has said; adaptbot kg retract {quote(name)} takes "
            "that back first"
        )
    human = _human(answers, prompts, agreed or dry_run)
    store = None if dry_run else keeper(home)
    given: dict[str, dict[str, str]] = {}

    def note(turn: Turn, reply: Any) -> None:
        if isinstance(turn, Ask) and reply.value not in ("back", STOP.value):
            question = turn.question
            given.setdefault(question.about, {})[question.prop or question.kind] = reply.value

    ports = without_planner(human, store, [Noting(note)])
    try:
        return drive(teach_thing(name, home.kg, parser(home.kg)), ports)
    except (KeyboardInterrupt, KnowledgeError) as stopped:
        kept = _save(home, name, given) if given else None
        again = f"adaptbot kg add {quote(name)} --answers {quote(str(kept))}"
        hint = f"; what you answered is kept: go on with `{again}`" if kept else ""
        if isinstance(stopped, KeyboardInterrupt):
            raise Interrupted(f"interrupted; nothing was committed{hint}") from None
        raise KnowledgeError(f"{stopped}{hint}") from stopped


def _human(answers: Path | None, prompts: "Console | None", agreed: bool) -> Human:
    from adaptbot_cli.adapters.answers import AnswersHuman, read_answers

    if answers is not None and agreed:
        return human_of(answers, None)
    if prompts is None:
        wanted = "--yes, or --dry-run" if answers else "--answers FILE"
        raise UsageError(f"there is no terminal to ask at: say {wanted}")
    terminal = human_of(None, prompts)
    if answers is None:
        return terminal
    return AnswersHuman(read_answers(answers), person(), str(answers), reviewer=terminal.review)


def _save(home: Home, name: str, given: dict[str, dict[str, str]]) -> Path | None:
    """Write what was answered as a file of answers; None if that cannot be done either."""
    import yaml

    path = home.workspace.transcripts / f"add-{safe_name(name)}.answers"
    try:
        with bounded.open_text(path, root_of(path)) as file:
            yaml.safe_dump(given, file, allow_unicode=True)
    except (OSError, ValueError, KnowledgeError):
        return None
    return path
