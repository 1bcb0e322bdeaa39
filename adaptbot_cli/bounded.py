"""Bounded readers for files and answers of anyone: what is too large, too deep or endless is
refused in one sentence before it can take memory, time or the process.

Nothing here knows what a file means; the caller gives the name for messages and the kind of error.
"""

import errno
import json
import logging
import os
import re
import select
import stat
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from itertools import chain, islice
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, TextIO

from adaptbot_cli.core.visible import visible
from adaptbot_cli.errors import AdaptbotError, KnowledgeError, UsageError

_LOG = logging.getLogger(__name__)

KB, MB = 1_000, 1_000_000
SETTINGS, YAML, JSON, GRAPH, PLAN = 64 * KB, 4 * MB, 32 * MB, 100 * MB, 2 * MB
"""The most bytes of each kind of file."""

DEPTH = 100
"""How deep brackets, lists, mappings and elements may be nested."""

_YAML_PARTS = 100_000
"""How many nodes a YAML document may have, each alias counted as all that it stands for."""

_SMALL = 4_000
"""Characters of a YAML text that the slow loader may read too."""

_LONGEST_NUMBER = 100
_ENTITIES = 10 * MB
"""How many characters the entities of an XML file may stand for."""

Refusal = type[AdaptbotError]


def read_bytes(
    path: Path,
    most: int,
    error: Refusal = KnowledgeError,
    *,
    piped: bool = False,
    root: Path | None = None,
) -> bytes:
    """Return a file's bytes; with `piped`, a pipe or device that a person names is a file too;
    with a `root` that it lies below, it is reached from there through no link.

    Raises:
        `error`: it cannot be read, is no regular file, or has more than `most` bytes.
    """
    try:
        # Without O_NONBLOCK, to open a FIFO would wait for somebody to write.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        below = path.relative_to(root) if root is not None else None
        handle = unlinked(root, below) if root and below else os.open(path, flags)
        with os.fdopen(handle, "rb") as file:
            if not stat.S_ISREG(os.fstat(handle).st_mode):
                if not piped:
                    raise error(f"cannot read {path}: it is no regular file")
                _wait_for_data(handle, path)
            data = file.read(most + 1)
    except (OSError, ValueError) as problem:
        reason = problem.strerror if isinstance(problem, OSError) else problem
        raise error(f"cannot read {path}: {reason}") from problem
    except KnowledgeError as problem:
        raise error(str(problem)) from problem
    if len(data) > most:
        raise error(f"{path} is larger than {_size(most)}: so large a file is not read")
    return data


def _wait_for_data(handle: int, path: Path) -> None:
    """Wait until a pipe has data or its writer is gone; after a second that is logged."""
    pipe = select.poll()
    pipe.register(handle, select.POLLIN)
    if not pipe.poll(1_000):
        _LOG.warning("! waiting for somebody to write to %s", visible(str(path)))
        pipe.poll()
    os.set_blocking(handle, True)


@contextmanager
def folder(root: Path, path: str = "", make: bool = False) -> Iterator[int]:
    """Open a folder below `root`, step by step and through no link; give its descriptor.

    Raises:
        FileNotFoundError: it is not there, and not to be made.
        KnowledgeError: a step is a symbolic link or a file.
    """
    flags = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
    handle = os.open(root, flags)
    try:
        for part in PurePosixPath(path).parts:
            made = False
            if make:
                with suppress(FileExistsError):
                    os.mkdir(part, dir_fd=handle)
                    os.fsync(handle)
                    made = True
            try:
                below = os.open(part, flags | os.O_NOFOLLOW, dir_fd=handle)
            except OSError as error:
                if error.errno not in (errno.ELOOP, errno.ENOTDIR):
                    raise
                raise not_wanted(root / path, "folder", part, handle) from error
            if made:
                _shared(below, handle)
            os.close(handle)
            handle = below
        yield handle
    finally:
        os.close(handle)


def _shared(file: int, folder: int) -> None:
    """Let the group write what was made in a folder that it may write, whatever the umask."""
    group = os.fstat(folder).st_mode & (stat.S_IWGRP | stat.S_ISGID)
    made = os.fstat(file)
    if group & stat.S_IWGRP and made.st_uid == os.geteuid():
        more = group if stat.S_ISDIR(made.st_mode) else stat.S_IWGRP
        os.fchmod(file, stat.S_IMODE(made.st_mode | more))


def not_wanted(path: Path, wanted: str, name: str, handle: int) -> KnowledgeError:
    """Return the error of something that is not what is wanted, below an open folder."""
    link = stat.S_ISLNK(os.stat(name, dir_fd=handle, follow_symlinks=False).st_mode)
    if link:
        text = f"{name} is a symbolic link, and links in a workspace are not followed"
        return KnowledgeError(f"{path} is not used: {text}; put the {wanted} itself there.")
    return KnowledgeError(f"{path} is not used: {name} is no {wanted}; move it away.")


def unlinked(root: Path, path: PurePath, flags: int = os.O_RDONLY, make: bool = False) -> int:
    """Open a regular file below `root`, step by step and through no link; return its descriptor.

    Raises:
        OSError: it is not there, or cannot be opened.
        KnowledgeError: it is reached through a link, or is no regular file.
    """
    with folder(root, str(path.parent), make) as handle:
        flags |= os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        try:
            file = os.open(path.name, flags, 0o666, dir_fd=handle)
        except OSError as error:
            if error.errno not in (errno.ELOOP, errno.ENXIO):
                raise
            raise not_wanted(root / path, "file", path.name, handle) from error
        if not stat.S_ISREG(os.fstat(file).st_mode):
            os.close(file)
            raise not_wanted(root / path, "file", path.name, handle)
        if make:
            _shared(file, handle)
        return file


def open_text(path: Path, root: Path | None) -> TextIO:
    """Open a text file to be written anew; below a `root`, reached through no link.

    Raises:
        OSError, KnowledgeError: as `unlinked` does.
    """

    def opener(_: str, flags: int) -> int:
        if root is None:
            return os.open(path, flags, 0o666)
        return unlinked(root, path.relative_to(root), flags, make=True)

    if root is None:
        path.parent.mkdir(parents=True, exist_ok=True)
    return open(path, "w", encoding="utf-8", newline="\n", opener=opener)


def _size(most: int) -> str:
    return f"{most // MB} MB" if most >= MB else f"{most // KB} KB"


def read_text(
    path: Path, most: int, error: Refusal = KnowledgeError, *, piped: bool = False
) -> str:
    """Return a file's text. Raises `error`, also where it is no UTF-8."""
    return decode(read_bytes(path, most, error, piped=piped), path, error)


def decode(data: bytes, name: object, error: Refusal = KnowledgeError) -> str:
    """Return UTF-8 as text, without a byte order mark. Raises `error`."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        raise error(f"{name} is no UTF-8 text ({problem}); save it as UTF-8") from problem


def parse_yaml(text: str, name: object, error: Refusal = UsageError) -> list[Any]:
    """Return the documents of a YAML text, empty ones left out. Raises `error`."""
    import yaml

    parts = sum(map(text.count, ",\n:[{-?"))  # each node but the first stands behind one of these
    if len(text) > YAML or parts > 2 * _YAML_PARTS:
        raise error(f"{name} is no valid YAML: it is too large")
    try:
        try:
            return _documents(text, fast=True)
        except yaml.YAMLError:
            if len(text) > _SMALL:
                raise
            return _documents(text, fast=False)
    except RecursionError as problem:
        raise error(f"{name} is no valid YAML: it is nested too deep") from problem
    except (yaml.YAMLError, ValueError) as problem:
        raise error(f"{name} is no valid YAML: {' '.join(str(problem).split())}") from problem
    except (ArithmeticError, AttributeError, LookupError, TypeError) as problem:
        raise error(f"{name} is no valid YAML: a value does not fit its tag") from problem


def _documents(text: str, fast: bool) -> list[Any]:
    import yaml

    documents = yaml.load_all(text, Loader=_loader(fast))
    return [document for document in documents if document is not None]


@lru_cache(maxsize=2)
def _loader(fast: bool) -> Any:
    """The loader in C, or the slow one, which takes more of what people write (`{a: :b}`)."""
    import yaml

    class Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader) if fast else yaml.SafeLoader):  # type: ignore[misc]
        """Measures a document before anything is made of it."""

        def construct_document(self, node: Any) -> Any:
            measure(node, _yaml_parts, _YAML_PARTS)
            return super().construct_document(node)

    return Loader


def _yaml_parts(node: Any) -> Iterable[Any]:
    """The nodes below a node of YAML."""
    if isinstance(node.value, str):
        # 1:1:1:… is a number in base 60, worked out digit by digit.
        if len(node.value) > _LONGEST_NUMBER and node.tag.endswith((":int", ":float")):
            raise ValueError("it has a number of too many digits")
        return ()
    if node.id == "mapping":
        return chain.from_iterable(node.value)
    return node.value  # type: ignore[no-any-return]


def parse_toml(data: bytes, name: object, error: Refusal = KnowledgeError) -> dict[str, Any]:
    """Return the table of a TOML file. Raises `error`."""
    try:
        text = data.decode("utf-8-sig")
        if any(line.count(".") > DEPTH for line in text.splitlines()):
            raise RecursionError  # a key of so many parts would be read in quadratic time
        return tomllib.loads(text)
    except RecursionError as problem:
        raise error(f"{name} is no valid TOML: it is nested too deep") from problem
    except ValueError as problem:
        raise error(f"{name} is no valid TOML: {problem}") from problem


def parse_json(text: str | bytes, name: object, error: Refusal = KnowledgeError) -> Any:
    """Return the value of a JSON text. Raises `error`."""
    try:
        value = json.loads(text)
        measure(value, _json_parts)
    except RecursionError as problem:
        raise error(f"{name} is no valid JSON: it is nested too deep") from problem
    except ValueError as problem:
        raise error(f"{name} is no valid JSON: {problem}") from problem
    return value


def _json_parts(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, list) else ()


def measure(root: Any, parts: Callable[[Any], Iterable[Any]], most: int | None = None) -> None:
    """Raise ValueError for a tree that is nested deeper than `DEPTH`, or has more than `most`
    nodes. `parts` gives the nodes below a node; a node that is met again counts again."""
    level, count = [root], 1
    for _ in range(DEPTH):
        below = chain.from_iterable(map(parts, level))
        level = list(below if most is None else islice(below, most + 1 - count))
        count += len(level)
        if not level:
            return
        if most is not None and count > most:
            raise ValueError(f"it comes to more than {most:,} entries")
    raise ValueError(f"it is nested more than {DEPTH} deep")


_TURTLE = re.compile(
    rb'"""(?:[^"\\]|\\.|"(?!""))*(?:""")?|'
    rb"'''(?:[^'\\]|\\.|'(?!''))*(?:''')?|"
    rb'"(?:[^"\\\n\r]|\\.)*"?|'
    rb"'(?:[^'\\\n\r]|\\.)*'?|"
    rb'<(?:[^<>"{}|^`\\\x00-\x20]|\\.)*>|\\.|#[^\n\r]*|(?P<open>[\[({]|<<)|(?P<close>[\])}]|>>)',
    re.DOTALL,
)
_XML = re.compile(
    rb"<!--(?:.*?-->|.*)|<!\[CDATA\[(?:.*?\]\]>|.*)|<\?(?:.*?\?>|.*)|<!|(?P<close></)|"
    rb"(?P<open><)(?:\"[^\"<]*\"|'[^'<]*'|[^>\"'<])*?(?P<empty>/>|>|(?=<)|\Z)",
    re.DOTALL,
)
_ENTITY = re.compile(r"<!ENTITY\s+(?:%\s*)?([^\s\"']+)\s+(?:\"([^\"]*)\"|'([^']*)')")


def check_graph(data: bytes, name: object, xml: bool = False) -> None:
    """Make sure that an engine written for well-meant graphs can read this one: Turtle and what is
    like it (N-Triples, JSON-LD), or RDF/XML. What is invalid is left for the engine to say.

    Raises:
        KnowledgeError: it is nested too deep, or its entities stand for too much.
    """
    problem = ""
    if len(data) > GRAPH:
        problem = f"it is larger than {_size(GRAPH)}"
    elif xml:
        problem = _entities(data) or _deep(data, _XML)
    elif sum(map(data.count, (b"[", b"(", b"{", b"<<"))) > DEPTH:
        problem = _deep(data, _TURTLE)
    if problem:
        raise KnowledgeError(f"{name}: {problem}: so large a graph is not read")


def _deep(data: bytes, tokens: re.Pattern[bytes]) -> str:
    """Say that brackets or elements are nested too deep, "" if they are not."""
    depth = 0
    for token in tokens.finditer(data):
        kind = token.lastgroup
        depth += {"open": 1, "close": -1, "empty": 1}.get(kind or "", 0)
        if kind == "empty" and token["empty"] == b"/>":
            depth -= 1
        if depth > DEPTH:
            return f"it is nested more than {DEPTH} deep"
    return ""


def _entities(data: bytes) -> str:
    """Say that the entities of an XML file stand for too much, "" if they do not."""
    if b"<!ENTITY" not in data:
        return ""
    text = data.decode("utf-8", "replace")
    made = 0
    for entity, double, single in _ENTITY.findall(text):
        value = double or single
        if "&" in re.sub(r"&(?:#\w+|lt|gt|amp|quot|apos);", "", value):
            return f"its entity {entity} is made of other entities"
        made += len(value) * text.count(f"&{entity};")
        if made > _ENTITIES:
            return "its entities stand for too much text"
    return ""
