"""Domains that were read before: the same, read again where anything is not as it was."""

import os
import pickle
from pathlib import Path

import pytest

from adaptbot_cli import cache
from adaptbot_cli.adapters.store import reading
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import load_domain
from adaptbot_cli.core.domain import Domain
from adaptbot_cli.errors import PackError
from adaptbot_cli.resources import bundled

PACK = read_files(bundled("kg") / "kitchen")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "adaptbot" / "domains"


def again(files: dict[str, bytes] = PACK) -> Domain:
    """Read a pack as a new process does."""
    reading._examined.cache_clear()
    return load_domain(files, "kg/kitchen")


def times_read(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    read: list[object] = []
    examine = reading.examine_domain
    monkeypatch.setattr(
        reading, "examine_domain", lambda sources: (read.append(sources), examine(sources))[1]
    )
    return read


def test_a_pack_is_read_once_whatever_its_facts(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = times_read(monkeypatch)

    first = again()
    second = again({**PACK, "state.ttl": b""})
    other = again({**PACK, "tasks.ttl": b""})

    assert second == first != other
    assert len(read) == 2
    assert (folder.stat().st_mode & 0o077) == 0


@pytest.mark.parametrize(
    "data", [b"", b"nonsense", pickle.dumps((1, [])), pickle.dumps(("x",))[:9]]
)
def test_what_was_kept_and_is_no_domain_is_read_anew(folder: Path, data: bytes) -> None:
    first = again()
    [kept] = folder.iterdir()
    whole = kept.read_bytes()
    kept.write_bytes(data)

    assert again() == first
    assert kept.read_bytes() == whole


class Hostile:
    """Runs a command where it is read."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self.mark),)


def test_nothing_that_was_kept_is_executed(folder: Path, tmp_path: Path) -> None:
    first = again()
    [kept] = folder.iterdir()
    kept.write_bytes(pickle.dumps((Hostile(tmp_path / "mark"), [])))

    assert again() == first
    assert not (tmp_path / "mark").exists()


def test_a_pack_with_faults_is_refused_each_time(folder: Path) -> None:
    wrong = {**PACK, "tasks.ttl": PACK["tasks.ttl"].replace(b"ab:needs", b"ab:neds", 1)}

    for _ in range(2):
        with pytest.raises(PackError, match="neds"):
            again(wrong)
    assert not folder.exists()


def test_only_the_newest_are_kept(folder: Path) -> None:
    cache.write("domains", "old", b"", 3)
    os.utime(folder / "old", (1, 1))
    for number in range(3):
        cache.write("domains", str(number), b"", 3)

    assert len(list(folder.iterdir())) == 3
    assert not (folder / "old").exists()


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(folder: Path) -> None:
    folder.parent.mkdir(parents=True)
    folder.write_text("a file is in the way")

    assert again() == again()
