"""The folder in which a home's knowledge lives, and how it is found (docs/store.md)."""

import difflib
import os
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from adaptbot_cli import bounded, trust
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.resources import bundled

CONFIG = "adaptbot.toml"
_FIRST_CONFIG = """\
# The settings of this workspace. Every one can be given on the command line as well.
# Model, address, limits and world count once you have said `adaptbot trust`, until this changes.

# model = "ollama_chat/llama3.2"  # any litellm model name; without one the plan library is used
# api_base = "http://127.0.0.1:8000/v1"   # of a server of your own
# timeout = 300                 # seconds of waiting for the model in one run
# max_tokens = 20000            # of prompts and answers in one run
# max_cost = 0.10               # US dollars in one run
# temperature = 0
# seed = 0
# domain = "kitchen"
# policy = "tutor"              # or "paper"
# replans = 3
# world = "exec:python robot.py"  # what carries a plan out; without one it is only rehearsed
# act_timeout = 60              # seconds that the world may take for one step
# confirm = "irreversible"      # or "each", "none": the steps that you agree to first
# [kg]
# large = 50000                 # lines of facts from which on the graph is kept on disk as well
# endpoint = "https://example.org/sparql"  # a SPARQL 1.1 server that several workspaces share
"""


def _number(value: Any) -> bool:
    return type(value) in (int, float) and 0 <= value < float("inf")


def _address(value: Any) -> bool:
    return isinstance(value, str) and value.startswith(("http://", "https://"))


def _iri(value: Any) -> bool:
    whole = r"[A-Za-z][A-Za-z0-9+.-]*:[^\x00-\x20<>\"{}|^`\\]+"
    return isinstance(value, str) and re.fullmatch(whole, value) is not None


@dataclass(frozen=True, slots=True)
class Setting:
    """What an adaptbot.toml may say: what kind of value, which values fit, and what holds without.

    `variable` of the environment says the same; it goes before a workspace's file if `first`, and
    before the user's own in any case.
    """

    kind: str
    fits: Callable[[Any], bool]
    default: Any = None
    variable: str = ""
    first: bool = True


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _one_of(*values: str) -> Setting:
    named = ", ".join(f'"{value}"' for value in values[:-1])
    kind = f'{named} or "{values[-1]}"'
    return Setting(kind, lambda value: value in values, values[0])


SETTINGS: dict[str, Setting] = {
    "model": Setting("a text", _text, None, "ADAPTBOT_MODEL", first=False),
    "api_base": Setting("an address such as http://127.0.0.1:8000/v1", _address),
    "kg.endpoint": Setting(
        "an address such as https://example.org/sparql", _address, None, "ADAPTBOT_KG_ENDPOINT"
    ),
    "kg.update_endpoint": Setting(
        "an address such as https://example.org/update",
        _address,
        None,
        "ADAPTBOT_KG_UPDATE_ENDPOINT",
    ),
    "kg.large": Setting(
        "a number of lines", lambda value: type(value) is int and value > 0, 50_000
    ),
    **dict.fromkeys(("kg.attributes", "kg.state", "kg.log"), Setting("an IRI", _iri)),
    "timeout": Setting("a number of seconds", lambda value: _number(value) and value > 0),
    "max_tokens": Setting("a number of tokens", lambda value: type(value) is int and value > 0),
    "max_cost": Setting("an amount in US dollars", _number),
    "temperature": Setting("a number from 0 to 2", lambda v: _number(v) and v <= 2, 0.0),
    "seed": Setting("a whole number", lambda value: type(value) is int, 0),
    "domain": Setting("a text", lambda value: _text(value) and value != "", "kitchen"),
    "policy": _one_of("tutor", "paper"),
    "world": Setting("a text", lambda value: _text(value) and value != ""),
    "act_timeout": Setting("a number of seconds", lambda v: _number(v) and v > 0, 60.0),
    "confirm": _one_of("none", "each", "irreversible"),
    "replans": Setting(
        "a number from 0 to 20", lambda value: type(value) is int and 0 <= value <= 20, 3
    ),
}
"""Every setting there is. Commands take what holds of one from `Workspace.setting`."""
_IGNORED = "/transcripts/\n/.adaptbot/\n"


@dataclass(frozen=True, slots=True)
class Workspace:
    """A workspace: `root`, and the settings that hold in it: its adaptbot.toml's, then the user's.

    `files_of` says which file each is from, `ignored` are those of its adaptbot.toml that the user
    has not trusted; `named_by` says how the folder was found; `passed_over` are files of other
    accounts that would have made another folder the workspace.
    """

    root: Path
    settings: Mapping[str, Any] = field(default_factory=dict)
    files_of: Mapping[str, Path] = field(default_factory=dict)
    ignored: Mapping[str, Any] = field(default_factory=dict)
    named_by: str = "--workspace"
    passed_over: tuple[Path, ...] = ()

    def setting(self, name: str, given: Any = None) -> Any:
        """Return what holds of a setting: what is `given` on the command line, what a file says, or
        the default."""
        return given if given is not None else self.settings.get(name, SETTINGS[name].default)

    def origin(self, name: str, environ: Mapping[str, str]) -> tuple[Any, str]:
        """Return what holds of a setting unless a command line says otherwise, and from where: a
        file, a variable of the environment, or "" for the default."""
        setting, given = SETTINGS[name], environ.get(SETTINGS[name].variable, "")
        if given and (setting.first or name not in self.settings):
            return given, setting.variable
        file = self.files_of.get(name)
        return self.setting(name), "" if file is None else str(file)

    @property
    def large(self) -> int:
        """From how many lines on the files of a domain are a large home's, kept on disk."""
        return int(self.setting("kg.large"))

    @property
    def exists(self) -> bool:
        """Whether anything has been written here yet."""
        return (self.root / CONFIG).is_file()

    @property
    def transcripts(self) -> Path:
        """The folder with the transcripts of its runs.

        Raises:
            KnowledgeError: it is a symbolic link, or no folder.
        """
        return self._folder("transcripts")

    def domains(self) -> list[str]:
        """The names of the domains to choose from: its own and the bundled ones."""
        folders = [self._folder("kg"), bundled("kg")]
        found = {p.parent.name for f in folders if f.is_dir() for p in f.glob("*/*.ttl")}
        return sorted(found)

    def has(self, domain: str) -> bool:
        """Whether the workspace holds files of this domain, rather than only the bundle."""
        return any(self._folder(f"kg/{domain}").glob("*.ttl"))

    def _folder(self, path: str) -> Path:
        """Where a folder is or will be. Raises KnowledgeError: a link, none, or not to be read."""
        from adaptbot_cli.adapters.store.files import refusing

        found = self.root / path
        with refusing(found, "read"), suppress(FileNotFoundError), bounded.folder(self.root, path):
            pass
        return found

    def files(self, domain: str) -> dict[str, bytes]:
        """Return the files of a domain: the workspace's, or else the bundled ones.

        Raises:
            UsageError: there is no such domain.
            KnowledgeError: the files cannot be read.
        """
        from adaptbot_cli.adapters.store.files import read_files

        folder = self.folder(domain)
        return read_files(folder, self.root if folder.is_relative_to(self.root) else None)

    def folder(self, domain: str) -> Path:
        """Return where a domain's files are read from. Raises UsageError."""
        if domain not in self.domains():
            known = ", ".join(self.domains())
            raise UsageError(f'there is no domain "{domain}"; there is {known}')
        root = self.root if self.has(domain) else bundled("kg").parent
        return root / "kg" / domain

    def library(self, domain: str) -> tuple[Path, ...]:
        """Return the folders of a domain's plan library: the workspace's, then the bundled one."""
        return tuple(
            prompts / "library" / domain for prompts in (self.root / "prompts", bundled("prompts"))
        )

    def kept_plans(self, domain: str) -> Path:
        """Return the folder of the plans that were kept for tasks of a domain."""
        return self.root / "plans" / domain

    def own_files(self) -> dict[str, bytes]:
        """Return the files that every workspace has, those that are not there yet."""
        files = {} if self.exists else {CONFIG: _FIRST_CONFIG.encode()}
        if not (self.root / ".gitignore").exists():
            files[".gitignore"] = _IGNORED.encode()
        return files

    def first_files(self, domain: str) -> dict[str, bytes]:
        """Return what a first use writes: the settings and the bundled pack of a domain.

        Nothing that is there already is among it; hold the workspace's lock to rely on that.
        """
        files = self.own_files()
        if not self.has(domain):
            pack = self.files(domain)
            files |= {f"kg/{domain}/{name}": data for name, data in pack.items()}
        return files


def find(option: Path | None) -> Workspace:
    """Find the workspace: --workspace, ADAPTBOT_WORKSPACE, the nearest adaptbot.toml above that
    belongs to this account, or the user's data folder.

    Raises:
        KnowledgeError: its adaptbot.toml, or the user's own, is no valid TOML, or a setting cannot
            be meant.
    """
    root, others = option or _from_environment(), list[Path]()
    named_by = "--workspace" if option else "ADAPTBOT_WORKSPACE"
    if root is None:
        here = Path.cwd()
        found = [p for p in (here, *here.parents) if (p / CONFIG).is_file()]
        root = next((p for p in found if trust.is_ours(p / CONFIG)), None)
        others = [p / CONFIG for p in found[: found.index(root) if root else None]]
        named_by = f"the nearest {CONFIG}" if root else "your data folder"
        root = root or _user_folder()
        refuse_another_owner(root)
    settings, ignored = settings_of(root / CONFIG)
    mine = trust.own_settings_file()
    own, _ = settings_of(mine, own=True)
    for name in [name for name in own if os.environ.get(SETTINGS[name].variable)]:
        del own[name]
    files = dict.fromkeys(own, mine) | dict.fromkeys(settings, root / CONFIG)
    return Workspace(root, {**own, **settings}, files, ignored, named_by, tuple(others))


def settings_of(path: Path, own: bool = False) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the settings of a file that hold, and those that are ignored for want of trust.

    Raises:
        KnowledgeError: it is no valid TOML, or a setting cannot be meant.
    """
    try:
        path.lstat()
    except FileNotFoundError:
        return {}, {}
    except OSError as error:
        raise KnowledgeError(f"cannot read {path}: {error.strerror}") from error
    content = bounded.read_bytes(path, bounded.SETTINGS)
    settings = _settings(path, content)
    if own or trust.is_trusted(path, content):
        return settings, {}
    ignored = {name: settings.pop(name) for name in trust.GUARDED if name in settings}
    return settings, ignored


def refuse_another_owner(root: Path) -> None:
    """Make sure that a workspace that nobody has named is the user's own, as git does.

    Raises:
        KnowledgeError: it, its settings or its repository belong to somebody else.
    """
    if not hasattr(os, "geteuid"):
        return
    owners = {os.geteuid()}
    if 0 in owners and os.environ.get("SUDO_UID", "").isdigit():
        owners.add(int(os.environ["SUDO_UID"]))
    git = next((p / ".git" for p in (root, *root.parents) if (p / ".git").exists()), None)
    own = (root / name for name in (CONFIG, "kg", "plans", "transcripts"))
    for path in (root, *own, *([git] if git else [])):
        try:
            owner = path.lstat().st_uid
        except OSError:
            continue
        if owner not in owners:
            raise KnowledgeError(
                f"{path} belongs to another user, so the workspace {root} is not used by itself; "
                f"if you trust it, name it: --workspace {root}"
            )


def _from_environment() -> Path | None:
    named = os.environ.get("ADAPTBOT_WORKSPACE")
    return Path(named) if named else None


def _user_folder() -> Path:
    from platformdirs import user_data_path

    return user_data_path("adaptbot", appauthor=False)


def _settings(path: Path, content: bytes) -> dict[str, Any]:
    settings: dict[str, Any] = {}
    for name, value in bounded.parse_toml(content, path).items():
        table = value if name == "kg" and isinstance(value, dict) else {}
        settings |= {f"{name}.{key}": each for key, each in table.items()} or {name: value}
    for name in sorted(settings.keys() - SETTINGS.keys()):
        raise KnowledgeError(f"{path}: there is no setting {name!r}; {meant(name)}")
    for name, setting in SETTINGS.items():
        if name in settings and not setting.fits(settings[name]):
            called = "the API base" if name == "api_base" else name
            raise KnowledgeError(f"{path}: {called} must be {setting.kind}, not {settings[name]!r}")
    return settings


def meant(name: str) -> str:
    """Return the setting that a name is nearest to, or all of them, as a hint."""
    near = difflib.get_close_matches(name, SETTINGS, 1)
    return f"did you mean {near[0]}?" if near else f"there are {', '.join(SETTINGS)}"
