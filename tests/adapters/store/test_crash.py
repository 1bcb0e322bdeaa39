"""A process killed at any step of any command that commits leaves the old or the new, all of it:
files, HEAD and index, with the provenance, and nothing in the way of the next command."""

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pygit2
import pytest
from rdflib import Literal

from adaptbot_cli.adapters.lexicon import WordNet
from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.keeper import Keeper
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.session import additions, change, packs, queries, sources, sync
from adaptbot_cli.session.home import Home
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import ORIGIN, begun, ex, files, item, keeper
from tests.adapters.store.kills import SEED, at_one, chosen, killed_at, named

pytestmark = pytest.mark.skipif(os.name == "nt", reason="needs fork and SIGKILL")
EDIT = b'\nex:mug a ex:mreceptacle ; ex:rec_name "mug" .\n'
LEEK = "leek: {kind: object, obj_location: fridge, IsLiquid: no, IsSliceable: yes, IsBig: no}\n"
GIVEN = "<http://example.org/egg> <http://example.org/obj_location> <http://example.org/table> ."


def home(root: Path) -> Home:
    return Home(Workspace(root), "kitchen")


def _edited(root: Path) -> None:
    with (root / "kg/kitchen/attributes.ttl").open("ab") as file:
        file.write(EDIT)


def run(root: Path) -> None:
    Keeper(root, "kitchen", ORIGIN).keep(item("chard", "fridge"))


def apply(root: Path) -> None:
    old, new = ((ex("egg"), ex("IsBoiled"), Literal(value)) for value in (False, True))
    delta = Delta(frozenset({old}), frozenset({new}))
    Keeper(root, "kitchen", ORIGIN).apply("boiled egg", [delta])


def add(root: Path) -> None:
    additions.teach(home(root), "leek", root.parent / "answers.yaml", None, agreed=True)


def retract(root: Path) -> None:
    change.commit(home(root), change.retract(home(root), "okra"))


def revert(root: Path) -> None:
    change.commit(home(root), change.revert(home(root), "HEAD"))


def take_in(root: Path) -> None:
    given = queries.imported(home(root), [root.parent / "given.ttl"], False)[1]
    change.commit(home(root), given)


def update(root: Path) -> None:
    text = "DELETE { ex:egg ex:IsBoiled false } INSERT { ex:egg ex:IsBoiled true } WHERE {}"
    change.commit(home(root), queries.update(home(root), text))


def commit(root: Path) -> None:
    change.commit_edits(home(root), "a mug")


def new(root: Path) -> None:
    packs.start(Workspace(root), "garden")


def share(root: Path) -> None:
    sync.sync(Workspace(root), str(root.parent / "hub.git"), AbsentHuman())


VERBS: list[tuple[Callable[[Path], None], bool]] = [
    (run, True), (update, False), (commit, True), (new, False)]  # fmt: skip
# These take the steps of those above, some of them or all.
LONG = [(run, False), (apply, False), (add, False), (retract, False), (revert, False),
        (take_in, False), (share, False), (share, True)]  # fmt: skip


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace that has been used once."""
    top = tmp_path_factory.mktemp("first")
    WordNet().senses("pan")  # opened here, not in each process that is killed
    (top / "answers.yaml").write_text(LEEK)
    (top / "given.ttl").write_text(GIVEN)
    keeper(top / "home").keep(item("okra", "fridge"))
    # What another home has shared.
    pygit2.init_repository(str(top / "hub.git"), bare=True, initial_head="main")
    keeper(top / "other").keep(item("turnip", "fridge"))
    sync.sync(Workspace(top / "other"), str(top / "hub.git"), AbsentHuman())
    for number in range(256):  # git makes each on its first use: then no two commits step alike
        (top / f"home/.git/objects/{number:02x}").mkdir(exist_ok=True)
    return top


def content(root: Path) -> dict[str, bytes]:
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in root.glob("[kp]*/**/*.*")}


def killed(
    first: Path, tmp_path: Path, verb: Callable[[Path], None], edited: bool, long: bool
) -> None:
    """Kill a verb at each step, or at those of the short series, and look at what is left."""

    def copied(name: str) -> Path:
        shutil.copytree(first, tmp_path / name)
        if edited:
            _edited(tmp_path / name / "home")
        return tmp_path / name / "home"

    done = copied("done")
    old, old_head = content(done), Repo.open_or_init(done).head()
    verb(done)
    whole, commits = content(done), len(list(Repo.open_or_init(done).log()))
    assert at_one(done) and old_head != Repo.open_or_init(done).head()
    root = copied("killed")
    sources.load(Workspace(root), "kitchen")  # the pack of this place is in memory from here on
    names = named(lambda: verb(root))
    shutil.rmtree(root.parent)
    series = range(1, len(names) + 1) if long else chosen(names)
    outcomes = []
    for number, step in enumerate(series):
        root = copied("killed")
        assert killed_at(step, lambda root=root: verb(root)), step  # type: ignore[misc]
        if number % 10 == 0:
            begun(root)  # a run comes next
        elif number % 10 == 5:
            sources.load(Workspace(root), "kitchen")  # or a reader
        else:
            with Repo.open_or_init(root).writing():
                pass  # what any command that writes does first
        now = content(root)
        assert now in (old, whole), step
        made = len(list(Repo.open_or_init(root).log()))
        if now != old:
            assert made == commits, step
        with Repo.open_or_init(root).writing():
            pass
        assert at_one(root), step
        dirty = Repo.open_or_init(root).dirty([f"kg/kitchen/{name}" for name in files(root)])
        assert (dirty == []) or (now == old and edited), step
        outcomes.append(made)
        shutil.rmtree(root.parent)
    print(
        f"{verb.__name__}: {len(outcomes)} kills in {len(names)} steps, ADAPTBOT_CRASH_SEED={SEED}"
    )
    root = copied("killed")
    assert not killed_at(len(names) + 1, lambda: verb(root)), "the last kill was at the last step"
    assert len(names) > 60 and len(outcomes) > 30
    assert outcomes == sorted(outcomes), "once the change holds, it holds"
    assert outcomes[0] < commits == outcomes[-1], "killed before it held, and after"
    if shutil.which("git"):
        assert (
            subprocess.run(["git", "fsck", "--strict"], cwd=root, capture_output=True).returncode
            == 0
        )


def each(verbs: list[tuple[Callable[[Path], None], bool]]) -> pytest.MarkDecorator:
    names = [f"{verb.__name__}{' over edits' * edited}" for verb, edited in verbs]
    return pytest.mark.parametrize(("verb", "edited"), verbs, ids=names)


@each(VERBS)
def test_a_kill_where_something_begins_to_hold_leaves_the_old_or_the_new(
    first: Path, tmp_path: Path, verb: Callable[[Path], None], edited: bool
) -> None:
    killed(first, tmp_path, verb, edited, long=False)


@pytest.mark.slow
@each([*VERBS, *LONG])
def test_a_kill_at_any_step_leaves_the_old_or_the_new(
    first: Path, tmp_path: Path, verb: Callable[[Path], None], edited: bool
) -> None:
    killed(first, tmp_path, verb, edited, long=True)


@pytest.mark.parametrize("long", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_kill_in_a_first_use_leaves_nothing_in_its_way(tmp_path: Path, long: bool) -> None:
    keeper(tmp_path / "done")
    whole = content(tmp_path / "done")
    names = named(lambda: begun(tmp_path / "named"))
    assert len(names) > 30
    for step in range(1, len(names) + 1) if long else chosen(names):
        root = tmp_path / str(step)
        assert killed_at(step, lambda root=root: begun(root)), step  # type: ignore[misc]
        assert begun(root).revision and content(root) == whole, step
        assert at_one(root) and len(list(Repo.open_or_init(root).log())) == 1, step
    root = tmp_path / "last"
    assert not killed_at(len(names) + 1, lambda: begun(root))
