"""An experiment: what it is run on, and the one way to run it."""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, TextIO

from adaptbot_cli import __version__, bounded
from adaptbot_cli.adapters.planner.library import read_library
from adaptbot_cli.adapters.planner.prompts import style_of
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.reading import read_graphs
from adaptbot_cli.errors import UsageError
from adaptbot_cli.evaluation.cluster import cluster
from adaptbot_cli.evaluation.measures import Trial
from adaptbot_cli.evaluation.published import Series
from adaptbot_cli.evaluation.recordings import ARMS, Recording, row_of
from adaptbot_cli.evaluation.trial import Basis, Rules, first_answer, perform, plant
from adaptbot_cli.evaluation.workers import Ended, Lessons, Pool, processes, program
from adaptbot_cli.resources import bundled
from adaptbot_cli.workspace import Workspace

Json = dict[str, Any]

FORMAT = 1


@dataclass(slots=True)
class Results:
    """Trials on disk, one a line after a header; `done` are those there, by task and arm."""

    path: Path
    key: str
    done: dict[tuple[str, str], Json] = field(default_factory=dict)
    _file: TextIO | None = None

    @property
    def answers(self) -> Path:
        """Where the answers of a live model are kept, unless they have a file of their own."""
        return self.path.with_name(f"{self.path.name}.answers")

    def start(self) -> None:
        """Read what is there and open the file to go on.

        Raises:
            UsageError: the file belongs to another experiment, is damaged or cannot be written.
        """
        if self.path.exists() and not self.path.is_file():
            raise UsageError(f"cannot use {self.path} for results: it is no file")
        try:
            kept = self._read() if self.path.exists() else []
            self.path.parent.mkdir(parents=True, exist_ok=True)
            whole = self.path.with_name(f"{self.path.name}.new")
            lines = [{"adaptbot_eval": FORMAT, "key": self.key}, *kept]
            whole.write_text("".join(map(_line, lines)), encoding="utf-8")
            whole.replace(self.path)
            self._file = self.path.open("a", encoding="utf-8")
        except OSError as error:
            raise UsageError(f"cannot use {self.path} for results: {error.strerror}") from error

    def add(self, trial: Json) -> None:
        """Write a trial that has ended."""
        self._write({"trial": trial})
        self.done[trial["id"], trial["arm"]] = trial

    def kept(self) -> int:
        """Close the file; return the number of trials in it, wherever `add` was interrupted."""
        if self._file is not None:
            self.close(keep=True)
            self._read()
        return len(self.done)

    def close(self, keep: bool) -> None:
        """Close the file; remove it unless it is to be kept."""
        if self._file is not None:
            self._file.close()
            self._file = None
        if not keep:
            self.path.unlink(missing_ok=True)
            self.answers.unlink(missing_ok=True)

    def _write(self, line: Json) -> None:
        if self._file is not None:
            self._file.write(_line(line))
            self._file.flush()

    def _read(self) -> list[Json]:
        lines = bounded.read_text(self.path, bounded.GRAPH, UsageError).splitlines()
        found: list[Json] = []
        for number, line in enumerate(lines, start=1):
            try:
                name = f"{self.path}, line {number}: this"
                found.append(bounded.parse_json(line, name, UsageError))
            except UsageError:
                if number == len(lines):
                    break  # it was being written when the run ended: that trial is run again
                raise
        header = found[0] if found and isinstance(found[0], dict) else {}
        if lines and header.get("adaptbot_eval") != FORMAT:
            raise UsageError(f"{self.path} holds no results of `adaptbot eval`; name another file")
        if lines and header.get("key") != self.key:
            raise UsageError(
                f"{self.path} holds the results of another experiment (other settings, inputs or "
                "version); name another file, or delete it"
            )
        for record in found[1:]:
            if "trial" in record:
                self.done[record["trial"]["id"], record["trial"]["arm"]] = record["trial"]
        return found[1:]


def _line(record: Json) -> str:
    return json.dumps(record, ensure_ascii=False) + "\n"


Key = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Chain:
    """Trials that follow each other, as what one has learned is known in the next."""

    rows: tuple[Recording, ...]
    arm: str

    @property
    def keys(self) -> list[Key]:
        """The task and arm of each trial."""
        return [(row.id, self.arm) for row in self.rows]


def chains(rows: Sequence[Recording], arms: Sequence[str], cumulative: bool) -> list[Chain]:
    """Return the trials of an experiment: each on its own, or knowledge carried over."""
    if not cumulative:
        return [Chain((row,), arm) for row in rows for arm in arms]
    found: list[Chain] = []
    for series in dict.fromkeys(row.series for row in rows):
        those = sorted((r for r in rows if r.series == series), key=lambda row: row.index)
        for arm in arms:
            # Only the arm with a person learns: the trials of the others are on their own.
            split = [tuple(those)] if "human" in arm else [(row,) for row in those]
            found += [Chain(part, arm) for part in split]
    return found


def run(
    todo: Sequence[Chain], world: Basis, rules: Rules, pool: Pool | None = None
) -> Iterator[Trial]:
    """Run chains of trials, in a pool if there is one; yields each trial as it ends."""
    if pool is not None:
        yield from _in_pool(todo, pool)
        return
    for chain in todo:
        carried: Lessons = ()
        for row in chain.rows:
            trial, lessons = perform(row, chain.arm, world, rules, carried)
            carried = (*carried, *lessons)
            yield trial


_LOOK = 2.0
"""After how many seconds in which no trial has ended a pool is looked at."""


def _in_pool(todo: Sequence[Chain], pool: Pool) -> Iterator[Trial]:
    at: dict[Future[Ended], tuple[Chain, int, Lessons]] = {}

    def submit(chain: Chain, place: int, carried: Lessons) -> None:
        at[pool.submit(chain.rows[place], chain.arm, carried)] = (chain, place, carried)

    for chain in sorted(todo, key=lambda chain: -len(chain.rows)):
        submit(chain, 0, ())
    while at:
        ended = wait(at, _LOOK, FIRST_COMPLETED).done
        if not ended:
            pool.check()
        for future in ended:
            chain, place, carried = at.pop(future)
            trial, lessons = future.result()
            if place + 1 < len(chain.rows):
                submit(chain, place + 1, (*carried, *lessons))
            yield trial


@dataclass(frozen=True, slots=True)
class Setup:
    """What an experiment is asked to do: the command line, read.

    `kg` and `truth` are Turtle files; without `kg` the base is the workspace's own graph, without
    `truth` the person knows what the base knows. Trials are run by `jobs` processes, or by the
    workers of the Dask scheduler at the address `cluster`. `select` is a pattern of row ids;
    `planted` is the share of errors put into the base; `rules` are those of every trial.
    """

    domain: str
    rules: Rules = field(default_factory=Rules)
    kg: tuple[Path, ...] = ()
    truth: tuple[Path, ...] = ()
    arms: tuple[str, ...] = ARMS
    cumulative: bool = False
    jobs: int = 1
    cluster: str | None = None
    limit: int | None = None
    select: str | None = None
    planted: float = 0.0

    def as_json(self) -> Json:
        """Return what makes a difference to the figures, for the report."""
        rules = self.rules
        return {
            "domain": self.domain,
            "kg": [str(path) for path in self.kg],
            "truth": [str(path) for path in self.truth],
            "arms": list(self.arms),
            "policy": rules.policy,
            "replans": rules.replans,
            "cumulative": self.cumulative,
            "human_error": rules.human_error,
            "seed": rules.seed,
            "model": rules.model,
            **(self._asked() if rules.model else {}),
            **({"world": "truth"} if rules.world else {}),
            **({"planted": self.planted} if self.planted else {}),
            **({"keep_plans": True} if rules.keep else {}),
            "version": __version__,
        }

    def _asked(self) -> Json:
        """How a live model is asked."""
        rules = self.rules
        parts = {"leave_out": sorted(rules.leave_out)} if rules.leave_out else {}
        unseen = {"unseen": True} if rules.unseen else {}
        return {"prompt": style_of(rules.prompt), **parts, **unseen, "timeout": rules.seconds}


@dataclass(slots=True)
class Experiment:
    """Rows, a world and rules, ready to run; `skipped` counts the rows of other domains."""

    setup: Setup
    rows: list[Recording]
    world: Basis
    skipped: Counter[str] = field(default_factory=Counter)

    @property
    def size(self) -> int:
        """The number of trials."""
        return len(self.rows) * len(self.setup.arms)

    def settings(self) -> Json:
        """Return the settings for the report, with the graphs that are meant where none is named.

        `kg` are the files or the pack that trials start from, `truth` those that the person knows.
        """
        record = self.setup.as_json()
        base = record["kg"] or [self.world.where]
        return {**record, "kg": base, "truth": record["truth"] or base}

    def key(self) -> str:
        """Return what tells this experiment from others, its inputs included."""
        graphs = (self.world.base or (), self.world.truth or ())
        contents = [repr(row).encode() for row in self.rows]
        contents += [self.world.files[name] for name in sorted(self.world.files)]
        contents += [repr(sorted(graph)).encode() for graph in graphs]
        contents += [repr(plan).encode() for plan in self.world.library]
        found = hashlib.sha256(json.dumps(self.setup.as_json(), sort_keys=True).encode())
        for content in (*contents, program().encode()):
            found.update(hashlib.sha256(content).digest())
        return found.hexdigest()[:16]

    def workers(self, results: Results) -> AbstractContextManager[Pool | None]:
        """Return who runs what is left beside this process, as a context that starts and ends it.

        It is nobody for one job, or if nothing is left.
        """
        left, rules = self.left(results), self.setup.rules
        if self.setup.cluster and left:
            return cluster(self.setup.cluster, self.world, rules)
        jobs = min(self.setup.jobs, left)
        if jobs <= 1:
            return nullcontext()
        self.world.warm(dict.fromkeys(row.model for row in self.rows))
        return processes(self.world, rules, jobs)

    def run(
        self,
        results: Results,
        ended: Callable[[Json], None] = lambda trial: None,
        pool: Pool | None = None,
    ) -> list[Json]:
        """Run what `results` does not hold yet; returns all trials, in the order of the rows.

        Of a live model the answers to the tasks come first: all arms start from them.

        Raises:
            ModelError: a live model gave no first answer.
        """
        self._first_answers()
        todo = [chain for chain in self._chains() if not self._is_done(chain, results)]
        for trial in run(todo, self.world, self.setup.rules, pool):
            record = trial.as_json()
            results.add(record)
            ended(record)
        order = [(row.id, arm) for row in self.rows for arm in self.setup.arms]
        return [results.done[key] for key in order]

    def _first_answers(self) -> None:
        rules = self.setup.rules
        if rules.model is None or rules.keep:  # what was kept is shown to the model
            return
        for n, row in enumerate(self.rows):
            first = first_answer(row, self.world, rules)
            self.rows[n] = replace(row, answers={ARMS[0]: (first,)})

    def left(self, results: Results) -> int:
        """Return the number of trials that are still to be run."""
        chains = (chain for chain in self._chains() if not self._is_done(chain, results))
        return sum(len(chain.rows) for chain in chains)

    def _chains(self) -> list[Chain]:
        return chains(self.rows, self.setup.arms, self.setup.cumulative)

    def _is_done(self, chain: Chain, results: Results) -> bool:
        # A chain that was interrupted starts again: what it had learned is not on disk.
        return all(key in results.done for key in chain.keys)


def prepare(setup: Setup, rows: Sequence[Recording], workspace: Workspace) -> Experiment:
    """Choose the rows and load what trials start from.

    Raises:
        UsageError: no row is left to run, or there is no such domain.
        KnowledgeError: a graph cannot be read.
    """
    world = _planted(
        Basis(
            workspace.files(setup.domain),
            str(workspace.folder(setup.domain)),
            read_graphs(setup.kg),
            read_graphs(setup.truth) or read_graphs(setup.kg),
            tuple(read_library(*workspace.library(setup.domain))),
        ),
        setup,
    )
    ours, skipped = _of_domain(rows, world)
    chosen = [row for row in ours if fnmatchcase(row.id, setup.select or "*")]
    if not chosen:
        raise UsageError(_nothing_left(setup, rows, ours))
    return Experiment(setup, chosen[: setup.limit], world, skipped)


def _planted(basis: Basis, setup: Setup) -> Basis:
    """The same with errors planted in what trials start from; the truth stays as it is."""
    if not setup.planted:
        return basis
    facts = list(basis.fresh().facts)
    wrong = plant(facts, basis.fresh(), setup.planted, setup.rules.seed)
    truth = basis.truth if basis.truth is not None else facts
    return replace(basis, base=wrong, truth=truth, planted=frozenset(facts) - frozenset(wrong))


def of_published(series: Sequence[Series], setup: Setup, workspace: Workspace) -> list[Experiment]:
    """Return an experiment for each of the authors' series, on its own graphs.

    Raises:
        UsageError: no row is left to run, or no domain knows the name of theirs.
        KnowledgeError: a graph cannot be read.
    """
    found = []
    for each in series:
        rows = [row_of(row, row["id"]) for row in each.rows]
        if not any(fnmatchcase(row.id, setup.select or "*") for row in rows):
            continue
        domain = _domain_called(each.domain, workspace)
        own = replace(setup, domain=domain, kg=(each.initial,), truth=(each.after,))
        found.append(prepare(own, rows, workspace))
    if not found:
        raise UsageError(f'no recording\'s id matches "{setup.select}"')
    return found


def _domain_called(name: str, workspace: Workspace) -> str:
    """The domain that recordings call by a name."""
    for domain in workspace.domains():
        known = _names(Basis(workspace.files(domain), domain)) | _names_in_bundle(domain)
        if name in known:
            return domain
    raise UsageError(f'no domain is called "{name}": give one this name, as ab:alias in domain.ttl')


def _of_domain(rows: Sequence[Recording], world: Basis) -> tuple[list[Recording], Counter[str]]:
    """The rows that are of the world's domain, and how many are of each other one."""
    names = {"", *_names(world)}
    if not any(row.domain in names for row in rows):
        # A workspace may be older than the names in the pack that it was made from.
        names |= _names_in_bundle(world.domain.name)
    ours = [row for row in rows if row.domain in names]
    return ours, Counter(row.domain for row in rows if row.domain not in names)


def _names(world: Basis) -> set[str]:
    return {world.domain.name, *world.domain.aliases}


def _names_in_bundle(domain: str) -> set[str]:
    folder = bundled("kg") / domain
    return _names(Basis(read_files(folder), domain)) if folder.is_dir() else set()


def _nothing_left(setup: Setup, rows: Sequence[Recording], ours: Sequence[Recording]) -> str:
    if ours:
        return f'no recording\'s id matches "{setup.select}"; the first is "{ours[0].id}"'
    found = ", ".join(sorted({row.domain for row in rows}))
    return (
        f"no recording is of the domain {setup.domain}; there are some of {found}. If one of "
        f"these is meant, its name is an ab:alias in kg/{setup.domain}/domain.ttl"
    )


def together(experiments: Sequence[Experiment]) -> Json:
    """Return the settings of several experiments: lists of domains, of bases and of truths."""
    each = [experiment.settings() for experiment in experiments]
    lists = {name: [record[name] for record in each] for name in ("domain", "kg", "truth")}
    return {**each[0], **lists}
