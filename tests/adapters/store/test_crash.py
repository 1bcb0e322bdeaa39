"""A process killed at any moment of a commit leaves the old or the new graph, whole, with its
provenance, and nothing in the way of the next one."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper
from tests.adapters.store.homes import ORIGIN, begun, ex, files, item, keeper

pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs fork and SIGKILL")
KILLS = 200
SEED = int(os.environ.get("ADAPTBOT_CRASH_SEED", random.SystemRandom().randrange(10**6)))
PATHS = ["kg/kitchen/attributes.ttl", "kg/kitchen/state.ttl"]


def child(work: Callable[[], object], ready: int) -> int:
    """Fork a warm process that says it is ready and works; return its id."""
    pid = os.fork()
    if pid == 0:
        try:
            os.write(ready, b".")
            work()
        finally:
            os._exit(0)
    return pid


def killed_after(seconds: float, work: Callable[[], object]) -> bool:
    """Let a process work and kill it after some time; tell whether that was in time."""
    listen, ready = os.pipe()
    pid = child(work, ready)
    os.read(listen, 1)
    time.sleep(seconds)
    os.kill(pid, signal.SIGKILL)
    os.close(listen)
    os.close(ready)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == -signal.SIGKILL


def killed_at(step: int, work: Callable[[], object]) -> bool:
    """Let a process work and kill itself before its `step`th change on the disk."""

    def counting() -> None:
        left = [step]

        def hook(event: str, arguments: tuple[object, ...]) -> None:
            changing = event == "open" and isinstance(arguments[2], int) and arguments[2] & 3
            if changing or event in ("os.rename", "os.remove", "os.link", "os.mkdir", "os.chmod"):
                left[0] -= 1
                if left[0] == 0:
                    os.kill(os.getpid(), signal.SIGKILL)

        sys.addaudithook(hook)
        work()

    listen, ready = os.pipe()
    pid = child(counting, ready)
    os.close(listen)
    os.close(ready)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == -signal.SIGKILL


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace that has been used once."""
    root = tmp_path_factory.mktemp("first") / "home"
    keeper(root).keep(item("leek", "fridge"))
    return root


@pytest.fixture
def root(first: Path, tmp_path: Path) -> Iterator[Path]:
    """A copy of it; afterwards git itself finds nothing wrong with it."""
    root = tmp_path / "home"
    shutil.copytree(first, root)
    yield root
    if shutil.which("git"):
        found = subprocess.run(
            ["git", "fsck", "--strict"], cwd=root, capture_output=True, text=True
        )
        assert found.returncode == 0, found.stderr
        status = subprocess.run(
            ["git", "status", "--porcelain"], cwd=root, capture_output=True, text=True
        )
        assert status.stdout == ""


def whole(root: Path, before: dict[str, bytes], name: str) -> bool:
    """Check what a kill has left when `name` was being kept; tell whether it has been."""
    start = begun(root)
    after = files(root)
    holds = bool(start.kg.find(name))
    if holds:
        about = {predicate for _, predicate, _ in start.kg.facts.triples((ex(name), None, None))}
        assert {ex("obj_name"), ex("obj_location")} < about
    else:
        assert after == before
    repo = Repo.open_or_init(root)
    assert start.edited == () and repo.dirty(PATHS) == []
    newest = next(repo.log(PATHS))
    told = [value for key, value in newest.trailers if key.startswith("Fact")]
    assert (f"+ {name} obj_location fridge" in told) == holds
    left = [p for p in root.rglob("*.*") if p.is_file() and p.suffix in (".lock", ".adaptbot")]
    assert left == []
    return holds


def test_a_kill_at_any_time_leaves_the_old_or_the_new(root: Path) -> None:
    """200 kills at random times of a commit, each followed by a look, some by another commit."""
    print(f"ADAPTBOT_CRASH_SEED={SEED}")
    rng = random.Random(SEED)
    one = Keeper(root, "kitchen", ORIGIN)
    one.keep(item("warm", "fridge"))
    usual = 0.0
    in_time = kept = 0
    for number in range(5 * KILLS):
        if number % 5 == 0:  # measured anew: what else this machine does comes and goes
            started = time.perf_counter()
            assert one.keep(item(f"after_{number}", "fridge")).revision
            usual = time.perf_counter() - started
        before, name = files(root), f"thing_{number}"
        turn = item(name, "fridge")
        in_time += killed_after(rng.uniform(0, 1.2 * usual), lambda turn=turn: one.keep(turn))
        kept += whole(root, before, name)
        if in_time == KILLS:
            break
    assert in_time == KILLS, "most kills came too late to prove anything"
    assert 0 < kept <= number, "some kills come before the change holds, some after it"


def test_a_kill_before_any_step_leaves_the_old_or_the_new(root: Path) -> None:
    """A kill before each single change on the disk that a commit makes."""
    one = Keeper(root, "kitchen", ORIGIN)
    one.keep(item("warm", "fridge"))
    for number in range(256):  # git makes each on its first use: then no two commits step alike
        (root / f".git/objects/{number:02x}").mkdir(exist_ok=True)
    outcomes = []
    for step in range(1, 400):
        before, name = files(root), f"thing_{step}"
        turn = item(name, "fridge")
        if not killed_at(step, lambda turn=turn: one.keep(turn)):
            break
        outcomes.append(whole(root, before, name))
    assert len(outcomes) > 30
    assert outcomes == sorted(outcomes), "once the change holds, it holds"
    assert outcomes[0] is False and outcomes[-1] is True
