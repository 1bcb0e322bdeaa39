"""`adaptbot` without arguments, at a terminal: one thing after the other, in one process.

Every line is a command of the command line, by a shorter name, or a task. The pack and the word
knowledge that one line has read serve the next.
"""

import re
import shlex
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

SHORT = {
    "teach": ("kg", "add"),
    "set": ("kg", "set"),
    "show": ("kg", "show"),
    "why": ("kg", "why"),
    "log": ("kg", "log"),
    "plan": ("run", "--dry-run"),
    "undo": ("undo",),
}
"""What a first word stands for; all of these take a domain."""

_ASKED = re.compile(
    r"(?:where|what)(?:'s|s| is| are) (?:(?:the|a|an|my|our|your) )?(.+?)[\s?]*", re.IGNORECASE
)
"""A question for what is known: "where is the egg?"."""

_OTHERWISE = re.compile(r"(?:what|how|who|which|when|why(?=\?))\b(?! about\b).*\?", re.IGNORECASE)
"""A question for anything else, which is no task: "what can you do?"."""

_HELP = (
    ("make omelette", "any task, in your own words"),
    ("plan TASK", "plan it, and keep nothing"),
    ("teach THING", "tell what there is, where it is kept and what is true of it"),
    ("set THING PROPERTY VALUE", "say what is true of it now: set egg place cabinet"),
    ("show, show NAME", "what is known: all, one thing, place, action or task"),
    ("show --tasks", "what tasks there are"),
    ("where is NAME?", "what is known of one, asked as people ask"),
    ("why NAME", "who taught it"),
    ("log", "what was taught, newest first"),
    ("undo", "take back the last thing learned"),
    ("plans", "the plans that are kept for tasks"),
    ("domain NAME", "go on in another domain"),
    ("robot NAME", "go on as another robot of this home"),
    ("runs, resume, pending, …", "every command of `adaptbot --help`"),
    ("quit", "or Ctrl-D"),
)


def converse(carry_out: Callable[[list[str]], None], commands: Iterable[str]) -> None:
    """Read lines and carry each out until the person quits; an error ends a line, not the session.

    `carry_out` is given a command's arguments and may raise SystemExit; `commands` are the names of
    all commands.
    """
    from adaptbot_cli.cli.common import console, domain_name, workspace
    from adaptbot_cli.errors import AdaptbotError

    home = workspace(None)
    known, domain, robot = frozenset(commands), domain_name(None, home), ""
    out = console(stderr=True)
    message = f"help shows what to say · knowledge in {home.root}"
    out.print(message, style="dim", markup=False, soft_wrap=True)
    lines = _Lines(out, lambda: _names(domain))
    while True:
        line = lines.read(f"{domain} as {robot}" if robot else domain)
        if line is None or line in ("quit", "exit"):
            return
        words = _words(line)
        if line in ("help", "?") or (_OTHERWISE.fullmatch(line) and not _ASKED.fullmatch(line)):
            for phrase, what in _HELP:
                out.print(f"  {phrase:<26} {what}", markup=False, highlight=False)
        elif words[:1] == ["domain"] and len(words) == 2 and words[1] in home.domains():
            domain, robot = words[1], ""
        elif words[:1] == ["robot"] and len(words) == 2:
            try:
                robot = _robot(words[1], domain)
            except AdaptbotError as error:
                out.print(f"error: {error}", markup=False, soft_wrap=True)
        elif words and (meant := _misspelt(words[0], known)):
            out.print(f"there is no command {words[0]}; did you mean {meant}?", markup=False)
        elif words:
            with suppress(SystemExit):  # what went wrong was said
                carry_out(arguments_of(line, domain, known, robot))


def arguments_of(line: str, domain: str, commands: frozenset[str], robot: str = "") -> list[str]:
    """Return the arguments that a line stands for: a command's, or a task to be run."""
    if asked := _ASKED.fullmatch(line):
        line = f"show {shlex.quote(asked[1])}"
    words = _words(line)
    acting = ["--robot", robot] if robot else []
    if words[0] in SHORT:
        own = acting if SHORT[words[0]][0] == "run" else []
        return [*SHORT[words[0]], *words[1:], "--domain", domain, *own]
    if words[0] in commands:
        return words
    return ["run", "--domain", domain, *acting, "--", line]


def _robot(name: str, domain: str) -> str:
    """The name of a robot of this home, "" for the domain's own.

    Raises:
        AdaptbotError: there is none such, or the home cannot be read.
    """
    from adaptbot_cli.cli.common import workspace
    from adaptbot_cli.session import sources

    return sources.load(workspace(None), domain, robot=name).domain.robot


def _misspelt(word: str, commands: frozenset[str]) -> str:
    """The command that a line's first word is a slip for, "" if it may begin a task."""
    from adaptbot_cli.adapters.lexicon import WordNet
    from adaptbot_cli.cli.help import nearest

    known = {*SHORT, *commands, "domain", "robot", "help", "quit", "exit"}
    near = None if word in known else nearest(word, sorted(known), 0.75)
    return near if near and not WordNet().senses(word) else ""


def _words(line: str) -> list[str]:
    """A line as a shell would part it; one with an odd quotation mark, by its spaces."""
    try:
        return shlex.split(line)
    except ValueError:
        return line.split()


def _names(domain: str) -> list[str]:
    """The names to complete: tasks and things of the domain, short names of commands."""
    from adaptbot_cli.cli.common import workspace
    from adaptbot_cli.cli.completion import index
    from adaptbot_cli.errors import AdaptbotError

    own = [*SHORT, "domain", "robot", "help", "quit"]
    try:
        named = index(workspace(None), domain)
    except AdaptbotError:  # told by whatever command comes next
        return own
    return [*own, *(name.replace("_", " ") for name in named["task"]), *named["thing"]]


class _Lines:
    """Reads lines at the terminal, with history and completion; plainly where it can do no more."""

    def __init__(self, out: Any, names: Callable[[], Sequence[str]]) -> None:
        from adaptbot_cli.adapters.terminal.canvas import is_plain, terminal

        self.out = out
        self.session: Any = None
        if is_plain(out):
            return
        from platformdirs import user_state_path
        from prompt_toolkit import PromptSession
        from prompt_toolkit.completion import FuzzyCompleter, WordCompleter
        from prompt_toolkit.history import FileHistory, History, InMemoryHistory

        folder = user_state_path("adaptbot", appauthor=False)
        history: History = InMemoryHistory()
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            history = FileHistory(str(folder / "history"))
        except OSError:  # a home that cannot be written has no history
            pass
        completer = FuzzyCompleter(WordCompleter(names, sentence=False))
        self.session = PromptSession(
            history=history,
            completer=completer,
            complete_while_typing=False,
            **terminal(out),
        )

    def read(self, prompt: str) -> str | None:
        """Return the next line, None at the end of input; Ctrl-C empties the line."""
        import sys

        while True:
            try:
                if self.session is None:
                    self.out.print(f"{prompt}> ", end="", markup=False)
                    typed = sys.stdin.readline()
                    if not typed:
                        return None
                else:
                    typed = self.session.prompt(f"{prompt}> ")
            except EOFError:
                return None
            except KeyboardInterrupt:
                continue
            if typed.strip():
                return typed.strip()
