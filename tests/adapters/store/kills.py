"""Kills a process at each step that changes something on the disk, one after the other.

The long series (`-m slow`) kills at every step, a short one where something begins to hold, and at
some of the other steps, which a seed chooses.
"""

import gc
import json
import os
import random
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.reading import paths_of

_AUDITED = {"os.rename", "os.remove", "os.link", "os.mkdir", "os.rmdir", "os.chmod", "os.utime",
            "os.truncate", "fcntl.flock"}  # fmt: skip
_CALLED = {"fsync", "write", "truncate", "flush", "create_blob", "create_commit", "write_tree",
           "init_repository"}  # fmt: skip
SEED = int(os.environ.get("ADAPTBOT_CRASH_SEED", random.SystemRandom().randrange(10**6)))
_HOLDS = {"fsync", "os.rename", "os.link", "create_commit"}


def killed_at(step: int, work: Callable[[], object]) -> bool:
    """Let a process work and kill itself before its `step`th change; tell whether it came so far.

    A step is a call of the system's that changes a file or a folder, or one of libgit2's, which
    makes its own. Raises AssertionError if the work failed by itself.
    """
    left = step

    def counted(name: str) -> None:
        nonlocal left
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    ended, _ = _apart(counted, work)
    return ended == -signal.SIGKILL


def named(work: Callable[[], object]) -> list[str]:
    """Let a process work to its end; return the names of its steps, in their order."""
    ended, names = _apart(lambda name: None, work)
    assert ended == 0
    return names


def _apart(before: Callable[[str], None], work: Callable[[], object]) -> tuple[int, list[str]]:
    """Let a process work that says the name of each step before it takes it."""
    listen, tell = os.pipe()
    pid = os.fork()
    if pid == 0:
        gc.freeze()  # what is here already is shared with the parent, and never garbage
        names = []

        def step(name: str) -> None:
            names.append(name)
            before(name)

        def audited(event: str, arguments: tuple[object, ...]) -> None:
            writing = event == "open" and isinstance(arguments[2], int)
            if event in _AUDITED or (writing and arguments[2] & (os.O_WRONLY | os.O_RDWR)):  # type: ignore[operator]
                step(event)

        def called(frame: FrameType, event: str, argument: object) -> None:
            name = getattr(argument, "__name__", "")
            if event == "c_call" and (name in _CALLED or name.startswith("git_index_write")):
                step(name)

        code = 1
        try:
            sys.addaudithook(audited)
            sys.setprofile(called)
            work()
            sys.setprofile(None)
            os.write(tell, json.dumps(names).encode())
            code = 0
        finally:
            os._exit(code)
    os.close(tell)
    with os.fdopen(listen, "rb") as pipe:
        names = json.loads(pipe.read() or b"[]")
    ended = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    assert ended in (0, -signal.SIGKILL), "the work failed by itself"
    return ended, names


def chosen(names: Sequence[str], seed: int = SEED, sample: int = 6) -> list[int]:
    """Choose the steps that a short series kills at, of some work whose steps are so called.

    They are the first and the last; those before and after each that makes something hold (synced,
    renamed, linked, committed); and one of each even part of the rest, by the seed.
    """
    last = len(names)
    found = {1, last}
    for number, name in enumerate(names, start=1):
        if name in _HOLDS or name.startswith("git_index_write"):
            found |= {number, min(number + 1, last)}
    rest = [number for number in range(1, last + 1) if number not in found]
    rng = random.Random(seed)
    parts = [rest[len(rest) * n // sample : len(rest) * (n + 1) // sample] for n in range(sample)]
    return sorted(found | {rng.choice(part) for part in parts if part})


def at_one(root: Path, domain: str = "kitchen") -> bool:
    """Tell whether index and HEAD say the same, and nothing is left lying about."""
    repo = Repo.open_or_init(root)
    head = repo.head() or ""
    same = all(repo.staged(path) == repo.read(path, head) for path in paths_of(domain))
    left = [p for p in root.rglob("*") if p.suffix in (".lock", ".adaptbot")]
    left = [p for p in left if not p.name.startswith(".cache-")]
    held = list((root / ".git" / "adaptbot").glob("held-*"))
    return same and not left and not held and not repo.interrupted()
