"""Trials on many machines: the workers of a Dask cluster as the pool that runs them.

What is sent: the rows, the domain pack, the graphs, the plans of the library, the rules and the
answers that a model has given. Code is not sent: each machine has the program itself, the same one.
Nor is any key: a worker that asks a model takes its key from its own environment.
"""

import asyncio
import logging
import pickle
import sys
import threading
import time
import uuid
import warnings
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from adaptbot_cli.adapters.planner.local import on_board
from adaptbot_cli.adapters.planner.scrub import in_address
from adaptbot_cli.errors import AdaptbotError, UsageError
from adaptbot_cli.evaluation.recordings import Recording
from adaptbot_cli.evaluation.trial import Basis, Rules, perform
from adaptbot_cli.evaluation.workers import Ended, Lessons, Pool, program

if TYPE_CHECKING:
    from distributed import Client

_PACKAGE = "adaptbot-cli"
_GO_ON = "and the same command goes on from what was done"


def check(address: str | None, rules: Rules) -> None:
    """Raise UsageError at once if trials cannot be run on the cluster at an address."""
    if address is None:
        return
    if find_spec("distributed") is None:
        raise UsageError("--cluster needs Dask: pip install 'adaptbot-cli[cluster]'")
    if not _names_a_port(address):
        raise UsageError(
            f'--cluster: "{address}" is no address of a Dask scheduler; it prints its own when it '
            "starts, such as tcp://192.168.0.10:8786"
        )
    if on_board(rules.model):
        raise UsageError(
            "a model on board is this machine's own; leave out --cluster, or name a server that "
            "all workers reach with --api-base"
        )
    if any(in_address(rules.api_base or "")):
        raise UsageError(
            "the address of the model's server holds a password or a query, which would be sent to "
            "the cluster; name it without, and set the key where the workers run"
        )


def _names_a_port(address: str) -> bool:
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        there = parts.hostname and parts.port and not (parts.path or parts.username)
    except ValueError:
        return False
    return bool(there) and parts.scheme in ("tcp", "tls")


@contextmanager
def cluster(address: str, world: Basis, rules: Rules) -> Iterator[Pool]:
    """Connect to a cluster's scheduler; yields its workers as a pool.

    Connecting, and waiting for workers while there are none, take no longer than Dask's own
    `distributed.comm.timeouts.connect` (30 s if nothing else is configured).

    Raises:
        AdaptbotError: there is no such cluster, it has no workers, it is lost, or the program is
            another one there.
    """
    from dask import config
    from dask.utils import parse_timedelta
    from distributed import KilledWorker

    seconds = parse_timedelta(config.get("distributed.comm.timeouts.connect"), "s")
    client = None
    logging.disable(logging.CRITICAL)  # Dask tells in its own words what is raised here
    try:
        client = _connected(address, seconds)
        watch = _Watch(client, address, seconds)
        watch.wait()
        _same_everywhere(client, address, seconds)
        given, topic = rules, f"{_PACKAGE} {uuid.uuid4()}"
        if rules.answers is not None:
            keep = rules.answers.keep
            given = replace(rules, answers=_RelayedAnswers(topic, dict(rules.answers.known())))
            client.subscribe_topic(topic, lambda event: keep(event[1]))
        # The result of a task, not scattered: where its worker dies, another one works it out.
        data = pickle.dumps((world, given, _state()))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that a large graph is sent, once
            place = client.submit(pickle.loads, data, pure=False)
        yield Pool(partial(client.get_executor(pure=False).submit, _there, place), watch.look)
    except CancelledError as error:
        raise _lost(address) from error
    except KilledWorker as error:
        raise AdaptbotError(
            f"a trial was given up: {error.allowed_failures + 1} workers of the cluster at "
            f"{address} died while they ran it, the last at {error.last_worker.address}; see what "
            f"it wrote (no memory left? another program?), {_GO_ON}"
        ) from error
    finally:
        if client is not None:
            with suppress(Exception):  # it may be lost; what is said is what happened before
                client.close(timeout=2)
        logging.disable(logging.NOTSET)


def _connected(address: str, seconds: float) -> "Client":
    from distributed import Client

    try:
        # A client waits for ever for what is no scheduler, and closes itself with a traceback.
        asyncio.run(asyncio.wait_for(_reached(address, seconds), seconds))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # versions that differ: said of what matters
            return Client(address, timeout=seconds, set_as_default=False)
    except Exception as error:
        text = f"no Dask scheduler answers at {address} within {seconds:g} s"
        remedy = "start it with `dask scheduler`, or correct the address"
        if address.startswith("tls:"):
            text += ", or none that takes these certificates"
            remedy += ", or name its certificates in Dask's configuration (distributed.comm.tls)"
        raise AdaptbotError(f"{text}; {remedy}") from error


async def _reached(address: str, seconds: float) -> None:
    """Raise OSError if it is no scheduler that answers there."""
    from distributed import Security, rpc

    how = Security().get_connection_args("client")
    async with rpc(address, timeout=seconds, connection_args=how) as server:
        if (await server.identity())["type"] != "Scheduler":
            raise OSError("another part of a cluster")


@dataclass(slots=True)
class _Watch:
    """Sees to it that nobody waits for ever for a cluster that is gone, or has no workers."""

    client: "Client"
    address: str
    seconds: float
    alone: float | None = None

    def look(self) -> None:
        """Raise AdaptbotError: the scheduler is lost, or there is no worker for too long."""
        scheduler: Any = self.client.scheduler
        try:
            asked = partial(scheduler.identity, n_workers=-1)
            workers = self.client.sync(asked, callback_timeout=self.seconds)["workers"]
        except (OSError, AttributeError) as error:  # it is None in a client that has given up
            raise _lost(self.address) from error
        if workers:
            self.alone = None
        elif self.alone is None:
            self.alone = time.monotonic()
        elif time.monotonic() - self.alone > self.seconds:
            raise AdaptbotError(
                f"the cluster at {self.address} has had no worker for {self.seconds:g} s; start "
                f"some with `dask worker {self.address}`, {_GO_ON}"
            )

    def wait(self) -> None:
        """Wait for the first worker. Raises AdaptbotError."""
        self.look()
        while self.alone is not None:
            time.sleep(0.1)
            self.look()


def _lost(address: str) -> AdaptbotError:
    return AdaptbotError(
        f"the cluster at {address} was lost: its scheduler has ended or is not reached; start it "
        f"again, {_GO_ON}"
    )


def _same_everywhere(client: "Client", address: str, seconds: float) -> None:
    """Raise AdaptbotError if a machine has another adaptbot or Python than this one, or none."""
    from distributed.versions import get_versions

    scheduler: Any = client.scheduler
    asked = {"packages": [_PACKAGE]}
    message = {"op": "versions", **asked}
    everyone = partial(scheduler.broadcast, msg=message, on_error="ignore")
    try:
        versions = {
            "the scheduler": client.sync(
                partial(scheduler.versions, **asked), callback_timeout=seconds
            )
        }
        workers = client.sync(everyone, callback_timeout=seconds)
    except OSError as error:
        raise AdaptbotError(
            f"not every worker of the cluster at {address} answers within {seconds:g} s; stop "
            "those that do not"
        ) from error
    versions |= {f"the worker at {worker}": workers[worker] for worker in workers}
    ours = _versions(get_versions(**asked))
    for who, theirs in versions.items():
        for name, version in _versions(theirs).items():
            if version != ours[name]:
                raise AdaptbotError(
                    f"{who} has {name} {version}, and here it is {ours[name]}; install the same "
                    "everywhere, or stop what differs"
                )


def _versions(found: dict[str, Any]) -> dict[str, str]:
    packages = found["packages"]
    python = ".".join(packages["python"].split(".")[:2])
    return {"Python": python, _PACKAGE: packages[_PACKAGE] or "(not installed)"}


@dataclass(slots=True)
class _RelayedAnswers:
    """Answers on a worker: those known at the start and its own, which the client is told of."""

    topic: str
    found: dict[str, dict[str, Any]] = field(default_factory=dict)

    def known(self) -> dict[str, dict[str, Any]]:
        """Return the answers known here."""
        return self.found

    def keep(self, record: dict[str, Any]) -> None:
        """Tell the client, which writes it down."""
        from distributed import get_worker

        self.found[record["key"]] = record["answer"]
        get_worker().log_event(self.topic, record)


_ONE = threading.Lock()
"""A worker may have several threads; they would share graphs and one interpreter lock."""


State = tuple[str, tuple[int, int]]


def _state() -> State:
    """The program and the Python that run here."""
    return program(), sys.version_info[:2]


def _there(place: tuple[Basis, Rules, State], row: Recording, arm: str, carried: Lessons) -> Ended:
    """Run a trial on a worker. Raises AdaptbotError: the program is another one here."""
    world, rules, wanted = place
    if _state() != wanted:  # of one that has come later, too
        from distributed import get_worker

        raise AdaptbotError(
            f"the worker at {get_worker().address} runs another state of the program; install the "
            f"same there, {_GO_ON}"
        )
    with _ONE:
        return perform(row, arm, world, rules, carried)
