"""Large homes: a graph that is kept on disk, files that are divided; the answers are the same."""

import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rdflib import Literal

from adaptbot_cli.adapters.store import copies
from adaptbot_cli.adapters.store.files import read_files
from adaptbot_cli.adapters.store.filing import Filing
from adaptbot_cli.adapters.store.keeper import Held
from adaptbot_cli.adapters.store.reading import load_kg, parts_of
from adaptbot_cli.adapters.store.versions import facts_of
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.index import WORD
from adaptbot_cli.core.graph.kg import Kg
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.errors import KnowledgeError
from adaptbot_cli.resources import bundled
from tests.adapters.store.homes import ex
from tests.cli.command import MOVED, Home

PACK = read_files(bundled("kg") / "kitchen")
LARGE = "[kg]\nlarge = 10\n"
MOVE = ("kg", "query", "--update", MOVED.format("egg", "table"), "--yes")
LEEK = "leek: {existence: exists, kind: object, obj_location: fridge}\n"


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield tmp_path / "cache" / "adaptbot" / "graphs"
    shutil.rmtree(tmp_path / "cache", ignore_errors=True)


@pytest.fixture
def home(tmp_path: Path) -> Home:
    (tmp_path / "large").mkdir()
    return Home(tmp_path / "large")


def opened(files: dict[str, bytes]) -> Kg:
    return load_kg(files, "kg/kitchen", large=10)


def kept(cache: Path) -> list[Path]:
    return sorted(path for path in cache.iterdir() if "-" not in path.name)


def graph_of(kg: Kg) -> frozenset[Triple]:
    return frozenset(kg.facts)


# ------------------------------------------------------------------------------ a graph on disk


def test_a_large_home_is_read_once_and_known_from_its_copy_then(cache: Path) -> None:
    plain, first = load_kg(PACK, "kg/kitchen"), opened(PACK)
    [copy] = kept(cache)
    about = json.loads((copy / "about.json").read_text())
    (copy / "about.json").write_text(
        json.dumps(about | {"size": [7, 8]})
    )  # what no file says, so that its use is seen
    second = opened(PACK)

    assert graph_of(first) == graph_of(second) == graph_of(plain)
    assert (first.size(), second.size()) == (plain.size(), (7, 8))
    for name in ("egg", "Cutting Board", "eggs", "chopping_board", "nothing"):
        assert first.find(name) == second.find(name) == plain.find(name)
        assert second.alike(name, plain.domain.classes) == plain.alike(name, plain.domain.classes)


def test_what_is_tried_or_learned_on_a_copy_changes_no_copy(cache: Path) -> None:
    kg = opened(PACK)
    with kg.rehearsal():
        kg.apply(Delta(added=frozenset({(ex("egg"), ex("IsLiquid"), Literal(True))})))
    kg.learn(Delta(added=frozenset({(ex("egg"), ex("obj_name"), Literal("huevo"))})))

    assert kg.find("huevo") == (ex("egg"),)
    assert opened(PACK).find("huevo") == ()
    assert graph_of(opened(PACK)) == graph_of(load_kg(PACK, "kg/kitchen"))


NAMES = st.lists(st.sampled_from(["egg", "leek", "leek_2", "öse"]), max_size=3)


@given(NAMES, NAMES)
def test_after_any_change_the_copy_is_what_the_files_say(
    tmp_path_factory: pytest.TempPathFactory, named: list[str], less: list[str]
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("cache")
        patch.setenv("XDG_CACHE_HOME", str(folder))
        held = Held.of(PACK, "kg/kitchen", 10)
        added = {(ex(f"thing_{n}"), ex("obj_name"), Literal(n)) for n in named}
        removed = {t for n in less for t in held.kg.facts.triples((ex(n), None, None))}
        change = Delta(frozenset(removed), frozenset(added))
        held.learn(change, held.after(change))
        copies.keep_copy(held.kg, parts_of(held.files))
        copy, plain = opened(held.files), load_kg(held.files, "kg/kitchen")

        assert len(kept(folder / "adaptbot" / "graphs")) == 1 + bool(change)
        assert graph_of(copy) == graph_of(plain)
        assert copy.size() == plain.size()
        assert {copy.find(n) for n in named} == {plain.find(n) for n in named}
        shutil.rmtree(folder, ignore_errors=True)


def truncated(copy: Path) -> None:
    for path in (copy / "graph").glob("*.sst"):
        os.truncate(path, path.stat().st_size // 2)


@pytest.mark.parametrize(
    "damage",
    [
        truncated,
        lambda copy: shutil.rmtree(copy / "graph"),
        lambda copy: (copy / "graph" / "CURRENT").write_bytes(b"nonsense"),
        lambda copy: (copy / "names").write_bytes(b"nonsense" * 999),
        lambda copy: (copy / "names").unlink(),
        lambda copy: (copy / "names").write_bytes(b""),
        lambda copy: [path.unlink() for path in (copy / "graph").iterdir()],
        lambda copy: (copy / "about.json").write_text("[]"),
        lambda copy: (copy / "about.json").write_text("{"),
        lambda copy: (copy / "about.json").unlink(),
    ],
)
def test_a_damaged_copy_is_made_anew(cache: Path, damage: Callable[[Path], None]) -> None:
    opened(PACK)
    [copy] = kept(cache)
    damage(copy)

    kg = opened(PACK)

    assert graph_of(kg) == graph_of(load_kg(PACK, "kg/kitchen"))
    assert kg.spellings.things(WORD, "egg")
    about = json.loads((copy / "about.json").read_text())
    (copy / "about.json").write_text(json.dumps(about | {"size": [7, 8]}))
    assert opened(PACK).size() == (7, 8)
    assert graph_of(opened(PACK)) == graph_of(kg)


def test_of_facts_in_the_wrong_file_no_copy_is_kept(cache: Path) -> None:
    astray = b"\nex:egg ex:obj_location ex:table .\n"
    held = Held.of({**PACK, "attributes.ttl": PACK["attributes.ttl"] + astray}, "kg/kitchen", 10)
    copies.keep_copy(held.kg, parts_of(held.files))
    assert kept(cache) == []
    assert opened(held.files).strays == held.kg.strays != frozenset()


def test_without_a_place_for_copies_all_works_as_it_does_for_small_homes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert graph_of(opened(PACK)) == graph_of(load_kg(PACK, "kg/kitchen"))


def test_a_faulty_file_is_told_as_ever_and_nothing_is_kept(cache: Path) -> None:
    with pytest.raises(KnowledgeError, match=r"state\.ttl, line 1"):
        opened({**PACK, "state.ttl": b"nonsense"})
    assert kept(cache) == []


def test_few_copies_are_kept_and_what_killed_processes_leave_is_removed(cache: Path) -> None:
    opened(PACK)
    left = cache / "own-0-7"
    shutil.copytree(kept(cache)[0], left)
    os.utime(left, (0, 0))

    for number in range(7):
        opened({**PACK, "state.ttl": PACK["state.ttl"] + b"# %d\n" % number})

    assert len(kept(cache)) == 4
    assert not left.exists()


def test_commands_say_the_same_of_a_home_that_is_kept_on_disk(tmp_path: Path) -> None:
    homes = []
    for name, settings in (("small", ""), ("large", LARGE)):
        (tmp_path / name).mkdir()
        homes.append(Home(tmp_path / name))
        homes[-1].write("robot/adaptbot.toml", settings)
        homes[-1].write("answers.yaml", LEEK)
        homes[-1].write("plan.txt", 'pick_up_obj("onoin")\nslice("onion", "knife")\n')
    commands = [
        ("kg", "add", "leek", "--answers", "answers.yaml", "--yes"),
        ("kg", "set", "egg", "obj_location", "table", "--yes"),
        ("kg", "show", "leek", "--json"),
        ("kg", "show", "leeek", "--json"),
        ("kg", "stats", "--json"),
        ("check", "plan.txt", "--json"),
        ("run", "make omelette", "--no-human", "--dry-run"),
        ("kg", "validate"),
        ("kg", "query", "SELECT ?s WHERE { ?s ex:obj_location ex:table }", "--json"),
    ]
    for command in commands:
        small, large = (home.adaptbot(*command) for home in homes)
        told = [re.sub(r"as [0-9a-f]{7}|\"seconds.*", "", ended.out) for ended in (small, large)]
        assert (large.code, told[1]) == (small.code, told[0]), command

    graphs = Path(f"{homes[1].folder}.cache") / "adaptbot" / "graphs"
    assert kept(graphs)
    assert not (Path(f"{homes[0].folder}.cache") / "adaptbot" / "graphs").exists()


def test_a_process_that_ends_leaves_nothing_but_the_copy(home: Home) -> None:
    home.write("robot/adaptbot.toml", LARGE)
    assert home.python("-m", "adaptbot_cli", "kg", "show", "egg").code == 0
    graphs = Path(f"{home.folder}.cache") / "adaptbot" / "graphs"
    assert [path.name for path in graphs.iterdir()] == [path.name for path in kept(graphs)]


# -------------------------------------------------------------------------------- divided files


def divided(files: dict[str, bytes] = PACK) -> dict[str, bytes]:
    new = Filing(files, load_kg(files, "kg/kitchen")).split()
    return {name: data for name, data in {**files, **new}.items() if data is not None}


def test_dividing_the_files_changes_no_fact_and_dividing_them_again_no_file() -> None:
    files = divided()
    assert facts_of(files) == facts_of(PACK)
    assert {"attributes/object-1.ttl", "state/object-1.ttl", "state.ttl"} <= files.keys()
    assert divided(files) == files


def test_a_full_file_is_followed_by_another() -> None:
    more = b"".join(
        b'\nex:thing_%05d rdf:type ex:object ;\n    ex:obj_name "thing %d" ;\n.\n' % (n, n)
        for n in range(6_000)
    )
    files = divided({**PACK, "attributes.ttl": PACK["attributes.ttl"] + more})
    assert {"attributes/object-1.ttl", "attributes/object-2.ttl"} <= files.keys()


def test_an_entry_without_a_name_is_not_divided() -> None:
    blank = PACK["state.ttl"] + b"\n[] ex:obj_location ex:fridge .\n"
    with pytest.raises(KnowledgeError, match="blank node"):
        divided({**PACK, "state.ttl": blank})


def test_the_pack_says_by_what_files_are_divided() -> None:
    rule = b"    ab:agent ex:robot ;\n"
    assert rule in PACK["domain.ttl"]
    domain = PACK["domain.ttl"].replace(rule, rule + b"    ab:filedBy ex:obj_location ;\n")
    files = divided({**PACK, "domain.ttl": domain})
    assert "state/fridge-1.ttl" in files
    assert b"ex:egg " in files["state/fridge-1.ttl"]


@given(NAMES, NAMES)
def test_a_change_of_divided_files_is_the_change_of_whole_ones(
    named: list[str], less: list[str]
) -> None:
    whole, parts = Held.of(PACK, "whole"), Held.of(divided(), "parts")
    added = {(ex(f"thing_{n}"), ex("obj_name"), Literal(n)) for n in named}
    added |= {(ex(n), ex("obj_location"), ex("table")) for n in named}
    removed = {t for n in less for t in whole.kg.facts.triples((ex(n), None, None))}
    change = Delta(frozenset(removed), frozenset(added))
    after = [{**held.files, **held.after(change)} for held in (whole, parts)]
    assert facts_of(after[0]) == facts_of(after[1])


def test_a_thing_that_was_moved_to_another_file_by_hand_is_changed_there() -> None:
    files = divided()
    start = files["state/object-1.ttl"].index(b"ex:egg ")
    end = files["state/object-1.ttl"].index(b"\n.\n", start) + 3
    block = files["state/object-1.ttl"][start:end]
    for written in (block, block.replace(b"ex:egg ", b"<http://example.org/egg>   ")):
        moved = files | {
            "state/object-1.ttl": files["state/object-1.ttl"].replace(block, b""),
            "state/mine.ttl": files["state.ttl"] + b"\n" + written,
        }
        held = Held.of(moved, "kg/kitchen")
        fact = next(held.kg.facts.triples((ex("egg"), ex("obj_location"), None)))
        changed = held.after(Delta(removed=frozenset({fact})))
        assert changed.keys() == {"state/mine.ttl"}
        assert facts_of(PACK) - facts_of({**moved, **changed}) == {fact}


def test_commands_on_divided_files(home: Home, tmp_path: Path) -> None:
    home.write("answers.yaml", LEEK)
    assert home.adaptbot(*MOVE).code == 0
    assert "committed" in home.adaptbot("kg", "split").said
    assert "already" in home.adaptbot("kg", "split").said
    assert home.adaptbot("kg", "add", "leek", "--answers", "answers.yaml", "--yes").code == 0

    assert home.adaptbot("kg", "show", "leek", "--json").json()["place"] == "fridge"
    assert home.adaptbot("kg", "validate").code == 0
    assert "leek" in home.adaptbot("kg", "diff").said
    assert "came with the kitchen pack" in home.adaptbot("kg", "why", "egg", "place").said
    edited = home.workspace / "kg" / "kitchen" / "state" / "object-1.ttl"
    edited.write_text(
        edited.read_text().replace("ex:obj_location ex:table", "ex:obj_location ex:fridge")
    )
    assert "state/object-1.ttl" in home.adaptbot("kg", "status").said
    refused = home.adaptbot("kg", "split")
    assert refused.code == 4
    assert "not committed" in refused.said
    assert home.adaptbot("kg", "commit", "-m", "the egg is cold again").code == 0
    assert home.adaptbot("undo", "--yes").code == 0
    assert home.subjects()[-3:-1] == [
        "learn: there is leek (ingredient or object) (and 1 more)",
        "the egg is cold again",
    ]


def test_a_linked_folder_of_facts_is_refused(home: Home, tmp_path: Path) -> None:
    assert home.adaptbot(*MOVE).code == 0
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "a.ttl").write_text("nonsense")
    (home.workspace / "kg" / "kitchen" / "state").symlink_to(tmp_path / "elsewhere")
    refused = home.adaptbot("kg", "show", "egg")
    assert refused.code == 4
    assert "link" in refused.said


def test_a_thing_with_entries_in_several_files_is_changed_in_each() -> None:
    for written in (
        "@prefix e: <http://example.org/> .\n  e:egg e:obj_location e:table .\n",
        "PREFIX e: <http://example.org/> e:egg\n e:obj_location e:table .\n",
        "@base <http://example.org/> .\n<egg><obj_location><table>.\n",
        "<http://example.org/e\\u0067g> <http://example.org/obj_location> <urn:table> .\n",
    ):
        held = Held.of(divided() | {"state/mine.ttl": written.encode()}, "kg/kitchen")
        places = frozenset(held.kg.facts.triples((ex("egg"), ex("obj_location"), None)))
        assert len(places) == 2
        changed = held.after(Delta(removed=places))
        assert changed.keys() == {"state/mine.ttl", "state/object-1.ttl"}
        assert facts_of(held.files) - facts_of(held.files | changed) == places


def test_files_are_not_divided_into_more_than_are_read() -> None:
    rule = b"    ab:agent ex:robot ;\n"
    domain = PACK["domain.ttl"].replace(rule, rule + b"    ab:filedBy ex:obj_name ;\n")
    more = b"".join(b'\nex:t%d rdf:type ex:object ;\n    ex:obj_name "t%d" ;\n.\n' % (n, n)
                    for n in range(10_001))  # fmt: skip
    attributes = PACK["attributes.ttl"] + more
    with pytest.raises(KnowledgeError, match="10,1.. files, of which a home has 20,000 at most"):
        divided({**PACK, "domain.ttl": domain, "attributes.ttl": attributes})


def test_a_new_file_written_by_hand_is_an_edit_by_hand(home: Home) -> None:
    assert home.adaptbot(*MOVE).code == 0
    assert home.adaptbot("kg", "split").code == 0
    state = home.workspace / "kg" / "kitchen" / "state"
    (state / "object-1.ttl").rename(state / "mine.ttl")
    assert home.adaptbot("kg", "set", "egg", "obj_location", "fridge", "--yes").code == 0
    assert home.subjects()[-2:] == ["hand edit: mine.ttl, object-1.ttl", "learn: egg: place fridge"]


def test_a_file_whose_name_nobody_can_read_is_refused(home: Home) -> None:
    assert home.adaptbot(*MOVE).code == 0
    assert home.adaptbot("kg", "split").code == 0
    state = home.workspace / "kg" / "kitchen" / "state"
    for name in (b"\xff.ttl", b"a\x1b[31m.ttl", "a\u202elt.ttl".encode()):
        odd = state / os.fsdecode(name)
        odd.write_bytes(b"")
        for command in (("kg", "show", "egg"), ("kg", "status")):
            refused = home.adaptbot(*command)
            assert refused.code == 4
            assert "rename it" in refused.said
        odd.unlink()
