"""`adaptbot eval --cluster`: a real Dask cluster, each part of it a process on loopback."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

import adaptbot_cli
from tests.cli import forking
from tests.cli.command import ROOT, Begun, Home
from tests.cli.test_check import TEA
from tests.cli.test_eval import rows
from tests.loopback import says, serving

pytest.importorskip("distributed")

SITE = Path(sysconfig.get_path("purelib"))


def within(seconds: float) -> dict[str, str]:
    """How long a command waits for a scheduler and for a first worker."""
    return {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": f"{seconds} s"}


WRONG = TEA.replace("boil", "simmer")


@dataclass
class Cluster:
    """A scheduler and workers, processes that are gone when the test is."""

    home: Home
    address: str = ""
    parts: dict[str, forking.Process] = field(default_factory=dict)

    def start(self, name: str, what: str, *arguments: str, entry: str = "", **env: str) -> Path:
        """Start a part; return the file of what it writes."""
        log = self.home.folder / f"{name}.log"
        with log.open("wb") as out, Path(os.devnull).open("rb") as nothing:
            self.parts[name] = forking.start(
                [*arguments, "--no-dashboard"], self.home.folder, self.home.environment(**env),
                (nothing.fileno(), out.fileno(), out.fileno()),
                entry=entry or f"distributed.cli.dask_{what}:main",
            )  # fmt: skip
        return log

    def scheduler(self, *arguments: str, **env: str) -> None:
        """Start the scheduler."""
        told = self.home.folder / "scheduler.json"
        where = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(told)]
        log = self.start("scheduler", "scheduler", *where, *arguments, **env)
        self.until("scheduler", lambda: "Scheduler at:" in log.read_text())
        self.until("scheduler", lambda: told.exists() and told.read_text().endswith("}"))
        self.address = json.loads(told.read_text())["address"]

    def workers(self, *names: str, **how: str) -> None:
        """Start workers of one thread, and wait until the scheduler has them."""
        told = [self.address, "--no-nanny", "--nthreads", "1", "--memory-limit", "0"]
        logs = {name: self.start(name, "worker", *told, **how) for name in names}
        for name, log in logs.items():
            self.until(name, lambda log=log: "Registered to:" in log.read_text())

    def left(self) -> int:
        """Return how many workers have left the scheduler."""
        return (self.home.folder / "scheduler.log").read_text().count("Remove worker")

    def until(self, name: str, seen: Any) -> None:
        """Wait for an event, as long as a part of the cluster lives."""
        while not seen():
            log = (self.home.folder / f"{name}.log").read_text()
            assert self.parts[name].runs, log
            time.sleep(0.02)

    def kill(self, name: str, number: signal.Signals = signal.SIGKILL) -> None:
        """End a part of the cluster, by its own process id."""
        process = self.parts.pop(name)
        process.kill(number)
        process.wait()


@contextmanager
def cluster(
    home: Home, *workers: str, arguments: Sequence[str] = (), **env: str
) -> Iterator[Cluster]:
    """Start a cluster."""
    with ExitStack() as stack:
        made = Cluster(home)
        stack.callback(lambda: [made.kill(name) for name in list(made.parts)])
        made.scheduler(*arguments, **env)
        made.workers(*workers, **env)
        yield made


def many(home: Home, n: int = 8) -> list[str]:
    """The command for some trials, half of which need another answer."""
    lines = [rows(n, WRONG, TEA).splitlines()[k] if k % 2 else rows(n).splitlines()[k]
             for k in range(n)]  # fmt: skip
    path = home.write("many.jsonl", "\n".join(lines))
    return ["eval", path, "--domain", "kitchen"]


def timeless(value: Any) -> Any:
    """A report without the seconds that were measured."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key != "seconds"}
    return [timeless(each) for each in value] if isinstance(value, list) else value


def text(report: str) -> str:
    return json.dumps(timeless(json.loads(report)))


def lines(results: Path) -> list[str]:
    return results.read_text().splitlines() if results.exists() else []


def begun_trials(running: Begun, results: Path, n: int = 4) -> None:
    """Wait until some trials have ended."""
    while len(lines(results)) <= n:
        assert running.process.runs, running.ends()
        time.sleep(0.02)


@pytest.mark.parametrize(
    "more", [["--cumulative", "--plot", "drawn.svg"], pytest.param([], marks=pytest.mark.slow)]
)
def test_a_worker_killed_in_the_middle_changes_nothing_of_the_report(
    more: list[str], home: Home
) -> None:
    command = [*many(home), "--json", *more]
    one = home.folder / "one.jsonl"
    alone = home.adaptbot(*command, "--jobs", "1", "--results", str(one))
    assert alone.code == 0, alone.err
    drawn = home.folder / "drawn.svg"
    before = drawn.read_bytes() if more else b""
    two = home.folder / "two.jsonl"
    with cluster(home, "one", "two", "three") as those:
        at = ["--cluster", those.address, "--results", str(two)]
        with home.begun(*command, *at) as running:
            begun_trials(running, two)
            those.kill("two")
            ended = running.ends()
    assert (ended.code, ended.err) == (0, "")
    assert text(ended.out) == text(alone.out)
    assert [sorted(text(line) for line in lines(path)) for path in (one, two)] == [
        sorted(text(line) for line in lines(one))
    ] * 2
    assert (drawn.read_bytes() if more else b"") == before


def test_what_was_done_is_kept_when_the_cluster_or_its_user_goes(home: Home) -> None:
    command = many(home, 20)
    results = home.folder / "kept.jsonl"
    with cluster(home, "one") as those:
        at = [*command, "--cluster", those.address, "--results", str(results), "--json"]

        def ends(event: Any) -> Any:
            n = len(lines(results))
            with home.begun(*at, **within(3)) as running:
                begun_trials(running, results, n + 2)
                event(running)
                ended = running.ends()
            assert "Traceback" not in ended.err and "distributed" not in ended.err
            return ended

        ended = ends(lambda running: running.process.kill(signal.SIGINT))
        kept = len(lines(results)) - 1
        assert ended.code == 130
        assert f"{kept} of 60 trials are kept: the same command goes on" in ended.err

        ended = ends(lambda running: those.kill("one"))
        assert (ended.code, ended.json()["error"]["code"]) == (1, "adaptbot")
        assert "has had no worker for 3 s; start some with `dask worker tcp://" in ended.err

        those.workers("one")
        ended = ends(lambda running: those.kill("scheduler"))
        assert ended.code == 1 and "was lost: its scheduler" in ended.err
        assert ended.json()["error"]["remedy"].startswith("start it again, and the same command")
    whole = home.adaptbot(*command, "--results", str(results), "--json")
    assert whole.code == 0 and whole.json()["arms"]["llm"]["n"] == 20
    assert len(lines(results)) == 61, "no trial was run twice"


def test_a_trial_that_workers_die_of_is_given_up(home: Home) -> None:
    with cluster(home, "worker") as those:
        command = [*many(home, 60), "--cluster", those.address]
        with home.begun(*command) as running:
            while running.process.runs:
                those.workers("next")
                those.kill("worker")
                those.parts["worker"] = those.parts.pop("next")
            ended = running.ends()
    assert ended.code == 1 and "a trial was given up: 4 workers" in ended.err


def test_ctrl_c_is_heard_while_nothing_answers(home: Home) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        with home.begun(*many(home), "--cluster", address) as running:
            _connection = server.accept()
            running.process.kill(signal.SIGINT)
            ended = running.ends()
    assert (ended.code, "0 of 24 trials are kept" in ended.err) == (130, True)


def test_what_is_no_cluster_is_said(used: Home) -> None:
    command = many(used)
    with socket.socket() as closed, cluster(used) as those, serving() as other:
        closed.bind(("127.0.0.1", 0))  # it does not listen
        port = closed.getsockname()[1]
        password = ["--model", "openai/x", "--api-base", "http://a:b@c/"]
        wrong = [
            ("here", [], 2, '"here" is no address of a Dask scheduler'),
            ("http://127.0.0.1:1", [], 2, "is no address of a Dask scheduler"),
            (those.address, ["--jobs", "2"], 2, "has its own workers"),
            (f"127.0.0.1:{port}", [], 1, "start it with `dask scheduler`"),
            (other.url.split("/")[2], [], 1, "no Dask scheduler answers"),
            (those.address.replace("tcp", "tls"), [], 1, "takes these certificates"),
            (those.address, ["--model", "local"], 2, "a model on board is"),
            (those.address, password, 2, "holds a password"),
        ]
        asked = [[*command, "--cluster", address, *more] for address, more, *_ in wrong]
        for (*_, code, said), ended in zip(
            wrong, used.adaptbots(asked, **within(0.5)), strict=True
        ):
            assert (ended.code, said in ended.said) == (code, True), ended
            assert "Traceback" not in ended.err
        alone = used.adaptbot(*command, "--cluster", those.address, **within(3))
        assert alone.code == 1 and "has had no worker for 3 s" in alone.said


def of_another_place() -> None:
    """Be a worker that has only the packages of PYTHONPATH."""
    worker = ["-S", "-m", "distributed.cli.dask_worker", *sys.argv[1:]]
    os.execv(sys.executable, [sys.executable, *worker])


def without_adaptbot(folder: Path) -> Path:
    """Return a folder with all installed packages but this one."""
    folder.mkdir()
    for entry in SITE.iterdir():
        if "adaptbot" not in entry.name:
            (folder / entry.name).symlink_to(entry)
    return folder


def test_a_machine_with_another_program_is_named(home: Home) -> None:
    command = many(home, 1)
    bare = without_adaptbot(home.folder / "bare")
    metadata = next(SITE.glob("adaptbot_cli-*.dist-info"))
    changed = without_adaptbot(home.folder / "changed")
    (changed / metadata.name).symlink_to(metadata)
    code = changed / "adaptbot_cli"
    shutil.copytree(Path(adaptbot_cli.__file__).parent, code)
    for kind in ("kg", "prompts"):
        (code / "bundled").mkdir(exist_ok=True)
        (code / "bundled" / kind).symlink_to(ROOT / kind)
    (code / "more.py").write_text("")
    older = without_adaptbot(home.folder / "older")
    (older / "adaptbot_cli-0.0.1.dist-info").mkdir()
    (older / "adaptbot_cli-0.0.1.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: adaptbot-cli\nVersion: 0.0.1\n"
    )
    with cluster(home) as those:
        for place, said in (
            (bare, "has adaptbot-cli (not installed), and here it is"),
            (older, "has adaptbot-cli 0.0.1, and here it is"),
            (changed, "runs another state of the program; install the same there"),
        ):
            odd = place.name
            entry = "tests.cli.test_cluster:of_another_place"
            those.workers(odd, entry=entry, PYTHONPATH=str(place))
            ended = home.adaptbot(*command, "--cluster", those.address)
            assert (ended.code, "Traceback" in ended.err) == (1, False), ended
            assert "the worker at tcp://127.0.0.1:" in ended.said and said in ended.said
            left = those.left()
            those.kill(odd)
            those.until("scheduler", lambda left=left: those.left() > left)  # type: ignore[misc]
    ended = home.python("-S", "-m", "adaptbot_cli", *command, "--cluster", "127.0.0.1:1",
                        PYTHONPATH=f"{ROOT}:{without_dask(home.folder / 'base')}")  # fmt: skip
    assert ended.code == 2 and "pip install 'adaptbot-cli[cluster]'" in ended.said


def without_dask(folder: Path) -> Path:
    folder = without_adaptbot(folder)
    (folder / "distributed").unlink()
    return folder


@dataclass
class Wire:
    """A way to a scheduler on which everything that is sent is seen."""

    port: int
    address: str = ""
    seen: bytearray = field(default_factory=bytearray)


@contextmanager
def wire(address: str) -> Iterator[Wire]:
    """Lay one."""
    port = int(address.rpartition(":")[2])
    with socket.create_server(("127.0.0.1", 0)) as server:
        found = Wire(port, f"tcp://127.0.0.1:{server.getsockname()[1]}")

        def carry(source: socket.socket, to: socket.socket) -> None:
            with suppress(OSError):
                while data := source.recv(1 << 16):
                    found.seen.extend(data)
                    to.sendall(data)
            with suppress(OSError):
                to.shutdown(socket.SHUT_WR)

        def accept() -> None:
            with suppress(OSError):
                while True:
                    near, _ = server.accept()
                    far = socket.create_connection(("127.0.0.1", port))
                    for ends in ((near, far), (far, near)):
                        threading.Thread(target=carry, args=ends, daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        yield found


def test_a_worker_asks_with_its_own_key_and_its_answers_are_kept_here(home: Home) -> None:
    path = home.write("tasks.txt", "make tea: tea\nmake toast: bread\n")
    kept = home.folder / "answers.jsonl"
    ours, theirs = "sk-ours-0123456789abcdef", "sk-theirs-0123456789abcdef"
    with (
        serving(says('boil("unicorn")')) as model,
        cluster(home, "one", OPENAI_API_KEY=theirs) as those,
        wire(those.address) as way,
    ):
        command = ["eval", path, "--domain", "kitchen", "--model", "openai/planner", "--json",
                   "--policy", "paper", "--replans", "1", "--api-base", model.url,
                   "--answers", str(kept)]  # fmt: skip
        ended = home.adaptbot(*command, "--cluster", way.address, OPENAI_API_KEY=ours)
        assert ended.code == 0, ended.err
        asked = [each.headers["authorization"].split()[1] for each in model.asked]
        assert asked[:2] == [ours, ours] and set(asked[2:]) == {theirs}
        assert len(kept.read_text().splitlines()) == len(asked)
        again = home.adaptbot(*command, "--jobs", "1", OPENAI_API_KEY=ours)
        assert len(model.asked) == len(asked), "what a worker was answered is not asked again"
    assert text(again.out) == text(ended.out)
    assert b"make toast" in way.seen and ours.encode() not in way.seen
    written = [f.read_bytes() for f in home.folder.rglob("*") if f.is_file()]
    assert not any(key.encode() in data for data in written for key in (ours, theirs))


def test_tls(home: Home) -> None:
    if shutil.which("openssl") is None:
        pytest.skip("no openssl to make certificates with")
    key, cert = str(home.folder / "key.pem"), str(home.folder / "cert.pem")
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-keyout", key,
         "-out", cert, "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"],
        check=True, capture_output=True, env={"PATH": os.environ["PATH"]},
    )  # fmt: skip
    tls = {"DASK_DISTRIBUTED__COMM__TLS__CA_FILE": cert}
    for who in ("CLIENT", "SCHEDULER", "WORKER"):
        tls[f"DASK_DISTRIBUTED__COMM__TLS__{who}__KEY"] = key
        tls[f"DASK_DISTRIBUTED__COMM__TLS__{who}__CERT"] = cert
    with cluster(home, "one", arguments=["--protocol", "tls"], **tls) as those:
        assert those.address.startswith("tls://")
        ended = home.adaptbot(*many(home, 2), "--json", "--cluster", those.address, **tls)
    assert ended.code == 0, ended.err
    assert ended.json()["arms"]["llm"]["n"] == 2
