"""How long history takes at 10, 1,000 and 10,000 commits of one fact each, beside `git log -p`.

    pytest -n 0 tests/bench/bench_history.py

Times are of the processor. The cold ratio is to `git log -p` of the same paths, the warm ones to
the same at 10 commits. Nothing is asserted of the times.
"""

import re
import resource
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from adaptbot_cli.adapters.store.versions import Versions
from adaptbot_cli.session.change import revert
from adaptbot_cli.session.home import Home
from adaptbot_cli.session.knowledge import chapters, why
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import keeper
from tests.bench.table import Table

STATE = "kg/kitchen/state.ttl"
_warm: dict[str, float] = {}


def commits(text: str, head: str, count: int) -> Iterator[bytes]:
    """Give a stream for `git fast-import`: in each commit one fact of the state is the other."""
    places = [match.span() for match in re.finditer("false", text)]
    for number in range(count):
        start, end = places[number % len(places)]
        if text[start:end] == "false":
            text = f"{text[:start]}true {text[end:]}"
        else:
            text = f"{text[:start]}false{text[end:]}"
        message, data = b"update: one fact\n\nSource: update\n", text.encode()
        yield b"commit refs/heads/main\ncommitter A <a@example.org> %d +0000\n" % (10**9 + number)
        yield b"data %d\n%s\n" % (len(message), message)
        yield f"from {head}\n".encode() if number == 0 else b""
        yield b"M 100644 inline %s\ndata %d\n%s\n" % (STATE.encode(), len(data), data)


@pytest.mark.skipif(shutil.which("git") is None, reason="needs git, to compare with it")
@pytest.mark.parametrize("count", [10, 1_000, 10_000])
def test_history(count: int, table: Table, tmp_path: Path) -> None:
    keeper(tmp_path)
    head = Versions.of(tmp_path, "kitchen").repo.head() or ""
    stream = b"".join(commits((tmp_path / STATE).read_text(), head, count))
    subprocess.run(["git", "fast-import", "--quiet"], cwd=tmp_path, input=stream, check=True)

    def timed(work: Callable[[], object]) -> float:
        begun = time.process_time()
        work()
        return time.process_time() - begun

    def taught() -> None:
        found = list(Versions.of(tmp_path, "kitchen").taught())
        assert len(found) == count + 1 and all(len(one.added) == 1 for one in found[:-1])

    def home() -> Home:
        return Home(Workspace(tmp_path), "kitchen")

    def log() -> None:
        assert list(chapters(home(), "pot"))

    log_p = ["git", "log", "-p", "--", "kg/kitchen"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run(log_p, cwd=tmp_path, check=True, capture_output=True)
    git = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    table.add(f"history of {count:,} commits, cold", timed(taught), git, "3x of git log -p")
    works: dict[str, Callable[[], object]] = {
        "all of it, warm": taught,
        "kg why of a thing never changed, warm": lambda: why(home(), "avocado"),
        "kg why of a thing and a property, warm": lambda: why(home(), "egg", "boiled"),
        "kg log NAME, warm": log,
        "kg revert of the newest, proposed": lambda: revert(home(), "HEAD"),
    }
    for name, work in works.items():
        work()
        seconds = min(timed(work) for _ in range(3))
        table.add(
            f"  {name}",
            seconds,
            _warm.setdefault(name, seconds),
            "" if work is taught else "2x of 10 commits",
        )
