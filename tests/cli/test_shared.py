"""`kg push` and `kg pull` with a SPARQL 1.1 server on loopback, whose store is Oxigraph's."""

import base64
import shutil
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs

import pyoxigraph
import pytest

from adaptbot_cli.adapters.answers import AnswersHuman
from adaptbot_cli.adapters.store.endpoint import Endpoint
from adaptbot_cli.adapters.terminal import AbsentHuman
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.session.change import commit
from adaptbot_cli.session.exchange import Served
from adaptbot_cli.session.home import Home as Known
from adaptbot_cli.session.knowledge import why
from adaptbot_cli.session.queries import update
from adaptbot_cli.workspace import Workspace
from tests.adapters.store.homes import begun, ex, item, keeper
from tests.cli.command import MOVED, SECOND, Home

HELD = (
    "DELETE { ex:egg ex:obj_location ?x } INSERT { ex:egg ex:obj_location ex:robot2_arm . "
    "ex:robot2 ex:obj_in_hand ex:egg } WHERE { ex:egg ex:obj_location ?x }"
)


class _Sparql(BaseHTTPRequestHandler):
    """The SPARQL 1.1 protocol by POST, and what is asked of it to go wrong."""

    server: "Server"

    def log_message(self, *args: object) -> None:
        pass

    def do_POST(self) -> None:
        self.server.requests += 1
        form = parse_qs(self.rfile.read(int(self.headers["Content-Length"])).decode())
        code, body = self.server.wrong or (200, b"")
        if self.server.password and self.headers.get("Authorization") != self.server.password:
            code = 401
        elif code == 200 and not body:
            body = self.server.answer(form)
        self.send_response(code)
        self.send_header("Content-Length", str(len(body)))
        if code in (302, 307):
            self.send_header("Location", "http://127.0.0.1:1/elsewhere")
        if code == 401:
            self.send_header("WWW-Authenticate", 'Basic realm="home"')
        self.end_headers()
        self.wfile.write(body)


class Server(ThreadingHTTPServer):
    """A server of one store; `wrong` is what it answers instead."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Sparql)
        self.store = pyoxigraph.Store()
        self.requests = 0
        self.wrong: tuple[int, bytes] | None = None
        self.password = ""
        self.lock = threading.Lock()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/"

    def answer(self, form: dict[str, list[str]]) -> bytes:
        with self.lock:
            if "update" in form:
                self.store.update(form["update"][0])
                return b""
            graphs = [pyoxigraph.NamedNode(name) for name in form.get("default-graph-uri", [])]
            found = self.store.query(form["query"][0], default_graph=graphs or None)
            return found.serialize(format=pyoxigraph.QueryResultsFormat.JSON) or b""  # type: ignore[union-attr]


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    server = Server()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setenv("ADAPTBOT_KG_ENDPOINT", server.url)
    yield server
    server.shutdown()
    server.server_close()


def known(root: Path) -> Known:
    return Known(Workspace(root), "kitchen")


def served(root: Path, **answers: dict[str, object]) -> Served:
    return Served.of(known(root), AnswersHuman(dict(answers), "ann") if answers else AbsentHuman())


def change(root: Path, text: str) -> None:
    commit(known(root), update(known(root), text))


def test_what_one_home_learns_the_other_knows_with_who_taught_it(
    server: Server, tmp_path: Path
) -> None:
    ann, bob = tmp_path / "ann", tmp_path / "bob"
    keeper(ann).keep(item("leek", "fridge"))
    assert len(served(ann).push().sent.added) > 1000
    came = served(bob).pull().came
    assert (ex("leek"), ex("obj_location"), ex("fridge")) in came.added
    [told] = {o.question for t, o in why(known(bob), "leek").facts.items()}
    assert told == "Is there leek?"
    change(bob, MOVED.format("egg", "table"))
    keeper(bob).keep(item("chard", "fridge"))
    assert len(served(bob).push().sent.added) == 4
    assert (ex("chard"), ex("obj_location"), ex("fridge")) in served(ann).pull(["chard"]).came.added
    assert served(ann).pull(everything=True).came.added == {
        (ex("egg"), ex("obj_location"), ex("table"))
    }
    assert known(ann).facts == known(bob).facts
    assert not served(ann).push().sent


def test_two_answers_are_put_to_a_person_and_the_update_is_refused_until_then(
    server: Server, tmp_path: Path
) -> None:
    ann, bob = tmp_path / "ann", tmp_path / "bob"
    begun(ann)
    served(ann).push()
    served(bob).pull()
    change(ann, MOVED.format("egg", "table"))
    change(bob, MOVED.format("egg", "countertop"))
    keeper(bob).keep(item("chard", "fridge"))
    assert served(ann).push().sent
    [asked] = served(bob).push().open
    assert [choice.value for choice in asked.choices[:2]] == ["countertop", "table"]
    came = served(bob, egg={"obj_location": "countertop"}).push()
    assert (ex("egg"), ex("obj_location"), ex("countertop")) in came.sent.added
    served(ann).pull(everything=True)
    assert known(ann).facts == known(bob).facts


def test_a_change_that_rests_on_what_is_no_longer_so_is_not_made(
    server: Server, tmp_path: Path
) -> None:
    begun(tmp_path / "ann")
    ann = served(tmp_path / "ann")
    ann.push()
    old, new = ((ex("egg"), ex("obj_location"), ex(place)) for place in ("fridge", "table"))
    before = ann.shared.about([ex("egg"), ex("table")]).facts
    server.store.update(
        "PREFIX ex: <http://example.org/> "
        "INSERT DATA { GRAPH <urn:adaptbot:home:kitchen:state> { ex:egg ex:obj_location ex:sink } }"
    )
    change_ = Delta(frozenset({old}), frozenset({new}))
    assert not ann.shared.write(change_, before, [])
    gone = "DELETE WHERE { GRAPH ?g { <http://example.org/egg> ?p ?o } }"
    server.store.update(gone)
    assert not ann.shared.write(change_, before, [])
    assert ann.shared.about([ex("egg")]).facts == frozenset()


def test_ten_that_teach_at_once_lose_nothing(server: Server, tmp_path: Path) -> None:
    homes = [tmp_path / f"home{number}" for number in range(10)]
    begun(homes[0])
    served(homes[0]).push()
    for number, root in enumerate(homes):
        if number:
            shutil.copytree(homes[0], root)
        keeper(root).keep(item(f"thing{number}", "fridge"))
    failed: list[BaseException] = []

    def push(root: Path) -> None:
        try:
            served(root).push()
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=push, args=(root,)) for root in homes]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    facts = served(homes[0]).shared.everything().facts
    assert {(ex(f"thing{n}"), ex("obj_location"), ex("fridge")) for n in range(10)} <= facts


def test_a_run_fetches_what_it_touches_in_few_calls_and_sends_what_it_learned(
    server: Server, tmp_path: Path
) -> None:
    (tmp_path / "home").mkdir()
    home = Home(tmp_path / "home")
    begun(tmp_path / "other")
    served(tmp_path / "other").push()
    there = {"ADAPTBOT_KG_ENDPOINT": server.url}
    assert home.adaptbot("kg", "pull", **there).code == 0
    server.requests = 0
    answers = home.write(
        "answers.yaml", "chives: {existence: exists, kind: object, obj_location: fridge}\n"
    )
    ended = home.adaptbot("run", "make omelette", "--answers", answers, **there)
    assert ended.code == 0 and server.requests <= 10, (ended.said, server.requests)
    assert (ex("chives"), ex("obj_location"), ex("fridge")) in served(tmp_path / "other").pull(
        ["chives"]
    ).came.added
    away = {"ADAPTBOT_KG_ENDPOINT": "http://127.0.0.1:1/"}
    ended = home.adaptbot("run", "make omelette", "--no-human", **away)
    assert ended.code == 0 and "adaptbot kg push sends it" in ended.said


def test_two_robots_at_one_server_at_once_keep_their_own_hands_and_places(
    server: Server, tmp_path: Path
) -> None:
    """One makes tea, the other a fruit salad; then each knows where the other is and what it
    holds."""
    there = {"ADAPTBOT_KG_ENDPOINT": server.url}
    homes = [Home(tmp_path / name) for name in ("first", "second")]
    for home in homes:
        home.folder.mkdir()
    begun(homes[0].workspace)
    change(homes[0].workspace, SECOND)
    served(homes[0].workspace).push()
    served(homes[1].workspace).pull()
    asked = (("make tea", "robot"), ("make fruit salad", "robot2"))
    with ExitStack() as stack:
        at_work = [
            stack.enter_context(
                home.begun("run", task, "--robot", robot, "--apply", "--no-human", **there)
            )
            for home, (task, robot) in zip(homes, asked, strict=True)
        ]
        for ended in [each.ends() for each in at_work]:
            assert ended.code == 0 and "goal met" in ended.said, ended.said
    for home in homes:
        served(home.workspace).pull(everything=True)
    facts = known(homes[0].workspace).facts
    assert facts == known(homes[1].workspace).facts
    near = {(s, o) for s, p, o in facts if p == ex("agent_near")}
    assert {s for s, _ in near} == {ex("robot"), ex("robot2")} and len(near) == 2
    # What the one picks up is in its own hand, and the other is told so by its next run.
    change(homes[1].workspace, HELD)
    served(homes[1].workspace).push()
    ended = homes[0].adaptbot("run", "make omelette", "--no-human", "--json", **there)
    assert ended.code == 3
    assert "robot2 holds egg" in {found["message"] for found in ended.json()["findings"]}


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ((200, b"<html>hello</html>"), "none to a SPARQL query"),
        ((200, b'{"head": {"vars": ["n"]}, "results": {"bindings": [{"n": '), "none to a SPARQL"),
        ((404, b"not here"), "it answers 404: not here"),
        ((500, b"\x1b[31mout of memory"), "it answers 500"),
        ((307, b""), "redirects are not followed"),
        ((403, b""), "access is denied"),
        ((200, b'{"head": {}, "boolean": true}'), "yes or no"),
    ],
)
def test_a_server_that_answers_wrongly_is_one_sentence_and_nothing_is_lost(
    server: Server, tmp_path: Path, wrong: tuple[int, bytes], told: str
) -> None:
    keeper(tmp_path / "home").keep(item("leek", "fridge"))
    before = known(tmp_path / "home").facts
    server.wrong = wrong
    for work in (served(tmp_path / "home").pull, served(tmp_path / "home").push):
        with pytest.raises(KnowledgeError, match=told):
            work()
    assert known(tmp_path / "home").facts == before
    server.wrong = None
    assert served(tmp_path / "home").push().sent


def test_what_the_domain_does_not_allow_is_left_out(server: Server, tmp_path: Path) -> None:
    begun(tmp_path / "home")
    served(tmp_path / "home").push()
    server.store.update(
        "PREFIX ex: <http://example.org/> INSERT DATA { GRAPH <urn:adaptbot:home:kitchen:attribute>"
        " { ex:x a ex:nothing . ex:egg ex:odd 1 . ex:egg ex:IsLiquid 'maybe' . ex:ok a ex:object ;"
        " ex:obj_name 'ok' . _:b a ex:object } }"
    )
    came = served(tmp_path / "home").pull(everything=True)
    assert {subject for subject, _, _ in came.came.added} == {ex("ok")}
    assert len(came.notes) >= 3


def test_a_password_goes_where_it_was_asked_for_and_is_never_shown(
    server: Server, tmp_path: Path
) -> None:
    server.password = "Basic " + base64.b64encode(b"ann:secret").decode()
    at = Endpoint(server.url.replace("//", "//x:y@"), server.url, {})
    with pytest.raises(KnowledgeError, match="access is denied") as told:
        at.ask("ASK {}")
    assert "x:y" not in str(told.value)
    given = {"ADAPTBOT_KG_USER": "ann", "ADAPTBOT_KG_PASSWORD": "secret"}
    assert Endpoint(server.url, server.url, given).ask("ASK {}") is True


def test_a_stranger_s_workspace_names_no_server(tmp_path: Path) -> None:
    (tmp_path / "home" / "robot").mkdir(parents=True)
    home = Home(tmp_path / "home")
    home.write("robot/adaptbot.toml", '[kg]\nendpoint = "http://127.0.0.1:1/"\n')
    ended = home.adaptbot("kg", "pull")
    assert ended.code == 2 and "kg.endpoint ignored" in ended.said
    home.write("robot/adaptbot.toml", '[kg]\nendpoint = "gopher://x"\n')
    assert home.adaptbot("kg", "pull").code == 4
