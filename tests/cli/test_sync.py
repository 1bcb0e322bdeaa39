"""`adaptbot kg sync`: several homes share by real git repositories, on disk and over loopback."""

import base64
import os
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pygit2
import pytest

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.remote import Remote
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.errors import KnowledgeError, UsageError
from adaptbot_cli.session.sync import sync
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import files, keeper, leek
from tests.cli.command import MOVED, NEW, Home

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="makes repositories with git")


def git(folder: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", *arguments], cwd=folder, capture_output=True, check=True, text=True
    )
    return done.stdout.strip()


@pytest.fixture
def hub(tmp_path: Path) -> Path:
    git(tmp_path, "init", "-q", "--bare", "-b", "main", "hub.git")
    return tmp_path / "hub.git"


@pytest.fixture
def homes(tmp_path: Path) -> Callable[[str], Home]:
    def made(name: str) -> Home:
        (tmp_path / name).mkdir(exist_ok=True)
        return Home(tmp_path / name)

    return made


def update(home: Home, text: str) -> None:
    assert home.adaptbot("kg", "query", "--yes", "--update", text).code == 0


def state(home: Home) -> tuple[str | None, dict[str, bytes]]:
    files = {str(path): path.read_bytes() for path in home.workspace.glob("kg/*/*.ttl")}
    return Repo.open_or_init(home.workspace).head(), files


def test_two_homes_learn_and_each_knows_afterwards_who_taught_what(
    homes: Callable[[str], Home], hub: Path
) -> None:
    ann, bob = homes("ann"), homes("bob")
    leek = ann.write("leek.yaml", "leek: {kind: object, obj_location: fridge, IsLiquid: no}\n")
    assert ann.adaptbot("kg", "add", "leek", "--answers", leek, "--yes").code == 0
    update(bob, NEW.format("chard"))
    update(bob, MOVED.format("egg", "table"))
    for home in (ann, bob, ann):
        ended = home.adaptbot("kg", "sync", str(hub))
        assert (ended.code, ended.err) == (0, ""), ended.said
    assert state(ann)[0] == state(bob)[0] == git(hub, "rev-parse", "main")
    for home in (ann, bob):
        assert git(home.workspace, "status", "--short") == ""
        git(home.workspace, "fsck", "--strict")
        why = home.adaptbot("kg", "why", "leek", "--json").json()
        assert {fact["origin"]["source"] for fact in why["facts"]} >= {"answer"}
        assert 'Where is "leek" kept?' in str(why)
        assert "SPARQL update" in home.adaptbot("kg", "why", "egg").said
        assert home.adaptbot("kg", "validate").code == 0
    assert "nothing new" in ann.adaptbot("kg", "sync", str(hub)).said


def test_answers_that_cannot_both_stand_wait_for_a_person_and_nothing_changes_until_then(
    homes: Callable[[str], Home], hub: Path
) -> None:
    ann, bob = homes("ann"), homes("bob")
    for home, where in ((ann, "table"), (bob, "countertop")):
        update(home, MOVED.format("egg", where))
        update(home, NEW.format(f"{where}_cloth"))
    assert ann.adaptbot("kg", "sync", str(hub)).code == 0
    before, there = state(bob), git(hub, "rev-parse", "main")
    ended = bob.adaptbot("kg", "sync", str(hub))
    assert ended.code == 3 and "countertop (here" in ended.said and "table (there" in ended.said
    assert (state(bob), git(hub, "rev-parse", "main")) == (before, there)
    waiting = bob.adaptbot("pending", "--json").json()
    assert waiting["remote"] == str(hub)
    assert [each["prop"] for each in waiting["conflicts"]] == ["obj_location"]
    assert "1 conflict to settle" in bob.adaptbot("pending").said
    answers = bob.write("answers.yaml", "egg: {obj_location: table}\nleek: {kind: object}\n")
    ended = bob.adaptbot("kg", "sync", str(hub), "--answers", answers)
    assert ended.code == 0 and "leek was not asked for" in ended.said
    assert 'Where is "egg" kept?' in str(bob.trailers())
    assert "conflicts" not in bob.adaptbot("pending", "--json").json()
    assert ann.adaptbot("kg", "sync", str(hub)).code == 0
    for home in (ann, bob):
        told = home.adaptbot("kg", "export", "--format", "nt").out
        assert "/egg> <http://example.org/obj_location> <http://example.org/table>" in told
        assert "countertop_cloth" in told and "table_cloth" in told


def test_hand_edits_come_along_and_faulty_ones_stop_it(
    homes: Callable[[str], Home], hub: Path
) -> None:
    ann = homes("ann")
    update(ann, NEW.format("chard"))
    path = ann.workspace / "kg" / "kitchen" / "attributes.ttl"
    path.write_bytes(path.read_bytes() + b'\nex:mug a ex:mreceptacle ; ex:rec_name "mug" .\n')
    assert ann.adaptbot("kg", "sync", str(hub)).code == 0
    assert ann.subjects()[-1] == "hand edit: before a sync, kitchen"
    path.write_bytes(path.read_bytes() + b"\nex:cup a ex:nothing .\n")
    ended = ann.adaptbot("kg", "sync", str(hub))
    assert ended.code == 4 and "nothing is no class" in ended.said


def test_clients_that_share_at_once_lose_nothing(homes: Callable[[str], Home], hub: Path) -> None:
    each = [homes(f"home{number}") for number in range(4)]
    for number, home in enumerate(each):
        update(home, NEW.format(f"thing{number}"))
    with ExitStack() as stack:
        begun = [stack.enter_context(home.begun("kg", "sync", str(hub))) for home in each]
        ended = [one.ends() for one in begun]
    assert [one.code for one in ended] == [0] * 4, [one.said for one in ended]
    assert each[0].adaptbot("kg", "sync", str(hub)).code == 0
    known = each[0].adaptbot("kg", "export", "--format", "nt").out
    assert all(f"thing{number}" in known for number in range(4))


def _tree(repo: pygit2.Repository, path: str, sha: pygit2.Oid, mode: int) -> pygit2.Oid:
    """A tree with one thing at a path, beside what the first commit has."""
    parts = path.split("/")
    builder = repo.TreeBuilder()
    builder.insert(parts[-1], sha, mode)
    made = builder.write()
    for part in parts[-2::-1]:
        builder = repo.TreeBuilder()
        builder.insert(part, made, 0o040000)
        made = builder.write()
    return made


@pytest.mark.parametrize(
    ("path", "mode", "told"),
    [
        ("kg/kitchen/state.ttl", 0o120000, "symbolic link"),
        ("kg", 0o120000, "symbolic link"),
        ("kg/garden", 0o160000, "submodule"),
        ("kg/a\\b.ttl", 0o100644, "name that no file"),
        ("/".join(["kg"] * 30), 0o100644, "name that no file"),
        ("kg/kitchen/state.ttl", 0o100644, "no valid Turtle"),
        ("kg/garden/domain.ttl", 0o100644, "lacks"),
    ],
)
def test_what_a_stranger_s_repository_holds_is_looked_at_before_anything_is_taken(
    tmp_path: Path, hub: Path, path: str, mode: int, told: str
) -> None:
    keeper(tmp_path / "home").keep(leek("fridge"))
    home = Workspace(tmp_path / "home")
    sync(home, str(hub), AbsentHuman())
    repo = pygit2.Repository(str(hub))
    blob = repo.create_blob(b"/etc/passwd")
    sha = pygit2.Oid(hex=git(hub, "rev-parse", "main")) if mode == 0o160000 else blob
    tree = _tree(repo, path, sha, mode)
    if path.endswith("state.ttl") and mode == 0o100644:  # beside all the others
        index = pygit2.Index()
        index.read_tree(repo[git(hub, "rev-parse", "main")].tree)  # type: ignore[union-attr]
        index.add(pygit2.IndexEntry(path, blob, pygit2.enums.FileMode.BLOB))
        tree = index.write_tree(repo)
    who = pygit2.Signature("mallory", "m@example.org", 1, 0)
    head = repo.references["refs/heads/main"].target
    made = repo.create_commit("refs/heads/main", who, who, "x", tree, [head])
    head, before = Repo.open_or_init(home.root).head(), files(home.root)
    with pytest.raises(KnowledgeError, match=told):
        sync(home, str(hub), AbsentHuman())
    assert (Repo.open_or_init(home.root).head(), files(home.root)) == (head, before)
    assert git(hub, "rev-parse", "main") == str(made)


@pytest.mark.parametrize(
    ("remote", "kind"),
    [
        ("ext::sh -c touch% /tmp/pwned", UsageError),
        ("fd::17", UsageError),
        ("ftp://example.org/home.git", UsageError),
        ("no-such-remote", UsageError),
        ("git://127.0.0.1:1/home.git", KnowledgeError),
        ("http://ann:secret@127.0.0.1:1/home.git", KnowledgeError),
        ("/", KnowledgeError),
    ],
)
def test_what_is_no_repository_to_share_with_is_one_sentence(
    tmp_path: Path, remote: str, kind: type[Exception]
) -> None:
    with pytest.raises(kind) as told:
        sync(Workspace(tmp_path / "home"), remote, AbsentHuman())
    assert 20 < len(str(told.value)) < 400 and "secret" not in str(told.value)


def test_a_workspace_inside_another_repository_is_not_shared(tmp_path: Path, hub: Path) -> None:
    git(tmp_path, "init", "-q")
    (tmp_path / "home").mkdir()
    with pytest.raises(KnowledgeError, match="is a part of the repository"):
        sync(Workspace(tmp_path / "home"), str(hub), AbsentHuman())


def test_git_s_own_daemon_serves_a_home(homes: Callable[[str], Home], hub: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ann, bob = homes("ann"), homes("bob")
    update(ann, NEW.format("chard"))
    command = ["git", "daemon", "--listen=127.0.0.1", f"--port={port}", "--export-all",
               "--reuseaddr", "--enable=receive-pack", f"--base-path={hub.parent}"]  # fmt: skip
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, process_group=0) as daemon:
        try:
            for _ in range(200):
                with socket.socket() as trial:
                    if trial.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.05)
            for home in (ann, bob):
                ended = home.adaptbot("kg", "sync", f"git://127.0.0.1:{port}/hub.git")
                assert ended.code == 0, ended.said
        finally:
            os.killpg(daemon.pid, 15)
    assert bob.adaptbot("kg", "show", "chard").code == 0


class _Backend(BaseHTTPRequestHandler):
    """Git's own HTTP program behind a password."""

    def log_message(self, *args: object) -> None:
        pass

    def do_GET(self) -> None:
        wanted = "Basic " + base64.b64encode(b"ann:secret").decode()
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        while self.headers.get("Transfer-Encoding") == "chunked":
            size = int(self.rfile.readline(), 16)
            body += self.rfile.read(size + 2)[:size]
            if not size:
                break
        if self.headers.get("Authorization") != wanted:
            self.send_response(401)
            self.send_header("WWW-Authenticate", 'Basic realm="home"')
            self.send_header("Content-Length", "0")
            self.end_headers()
            return
        path, _, query = self.path.partition("?")
        environment = {
            "PATH": os.environ["PATH"],
            "GIT_PROJECT_ROOT": str(self.server.root),  # type: ignore[attr-defined]
            "GIT_HTTP_EXPORT_ALL": "1",
            "REMOTE_USER": "ann",
            "PATH_INFO": path,
            "QUERY_STRING": query,
            "REQUEST_METHOD": self.command,
            "CONTENT_TYPE": self.headers.get("Content-Type", ""),
            "CONTENT_LENGTH": str(len(body)),
        }
        done = subprocess.run(
            ["git", "http-backend"], input=body, env=environment, capture_output=True, check=True
        )
        head, _, content = done.stdout.partition(b"\r\n\r\n")
        fields = [line.decode().split(": ", 1) for line in head.split(b"\r\n")]
        status = next((value for name, value in fields if name == "Status"), "200 OK")
        self.send_response(int(status.split()[0]))
        for name, value in fields:
            if name != "Status":
                self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    do_POST = do_GET


@contextmanager
def _served(root: Path) -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), _Backend)
    server.root = root  # type: ignore[attr-defined]
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://ann:wrong@127.0.0.1:{server.server_address[1]}/hub.git"
    finally:
        server.shutdown()
        server.server_close()


def test_a_password_comes_from_the_environment_and_is_never_shown(
    homes: Callable[[str], Home], hub: Path
) -> None:
    git(hub, "config", "http.receivepack", "true")
    ann = homes("ann")
    update(ann, NEW.format("chard"))
    with _served(hub.parent) as url:
        url = url.replace("ann:wrong@", "")
        nobody = ann.adaptbot("kg", "sync", url)
        assert nobody.code == 4 and "ADAPTBOT_SYNC_PASSWORD" in nobody.said
        wrong = {"ADAPTBOT_SYNC_USER": "ann", "ADAPTBOT_SYNC_PASSWORD": "wr0ng"}
        denied = ann.adaptbot("kg", "sync", url, **wrong)
        assert denied.code == 4 and "denied" in denied.said and "wr0ng" not in denied.said
        right = {**wrong, "ADAPTBOT_SYNC_PASSWORD": "secret"}
        ended = ann.adaptbot("kg", "sync", url, **right)
        assert ended.code == 0, ended.said
    assert git(hub, "rev-parse", "main") == state(ann)[0]


def test_what_was_pushed_between_the_look_and_the_push_is_not_pushed_over(
    homes: Callable[[str], Home], hub: Path
) -> None:
    ann, bob = homes("ann"), homes("bob")
    update(bob, NEW.format("chard"))
    repo = Repo.open_or_init(bob.workspace)
    link = Remote.of(repo, str(hub))
    branch, seen = link.fetch()
    update(ann, NEW.format("leek"))
    assert ann.adaptbot("kg", "sync", str(hub)).code == 0
    there, ours = git(hub, "rev-parse", "main"), repo.head()
    assert seen is None and ours
    assert not link.push(branch, ours, seen)
    assert git(hub, "for-each-ref", "--format=%(objectname) %(refname)") == f"{there} {branch}"
    assert bob.adaptbot("kg", "sync", str(hub)).code == 0
    git(hub, "merge-base", "--is-ancestor", there, "main")


def test_an_address_of_a_file_is_read_as_one_and_leaves_nothing_behind(
    homes: Callable[[str], Home], hub: Path
) -> None:
    there = hub.rename(hub.with_name("our hub.git"))
    ann, bob = homes("ann"), homes("bob")
    for number, home in enumerate((ann, bob)):
        update(home, NEW.format(f"thing{number}"))
        assert home.adaptbot("kg", "sync", there.as_uri()).code == 0
    assert git(there, "for-each-ref", "--format=%(refname)") == "refs/heads/main"
    git(there, "merge-base", "--is-ancestor", str(Repo.open_or_init(ann.workspace).head()), "main")
