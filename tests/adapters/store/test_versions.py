"""What a commit taught is what the files before and after it say, read in full; kept in a cache
that is never believed where it does not fit."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adaptbot_cli.adapters.store.git import Repo
from adaptbot_cli.adapters.store.turtle import rewrite
from adaptbot_cli.adapters.store.versions import Versions, facts_of
from adaptbot_cli.core.graph.delta import Delta
from adaptbot_cli.core.graph.terms import Triple
from adaptbot_cli.errors import KnowledgeError
from tests.adapters.store.homes import ex, item, keeper, leek
from tests.adapters.store.test_turtle import PACK, documents, facts
from tests.properties import examples

STATE = (PACK / "state.ttl").read_text()
BY_HAND = [
    ("ex:sink ", "  ex:sink "),
    ("# From the tap.\n", "# From the tap. (cold)\n"),
    (" ;\n.\n\nex:", " .\nex:"),
    ("\n\nex:water ", "\nex:water "),
    ("ex:water ", "<http://example.org/water> "),
    ("\n\nex:water ", "\n\n@prefix ex: <urn:x:> .\n\nex:water "),
    ("\n\nex:water ", '\n\nex:a ex:b """\n\nex:c ex:d ex:e ;\n.\n\n""" .\n\nex:water '),
    ("false ;", "false ; # still"),
    ("ex:fridge", "[ ex:on ex:table ]"),
    ("\n", "\r\n"),
    (STATE[:9], f"\ufeff{STATE[:9]}"),
]


def changed(before: str, after: str) -> Delta:
    """What one version of a file says and another does not, read in full."""
    old, new = (facts_of({"state.ttl": text.encode()}) for text in (before, after))
    return Delta(old - new, new - old)


def told(before: str, after: str) -> Delta:
    """The same as the versions tell it."""
    versions = Versions("kitchen", None)  # type: ignore[arg-type]
    files = ({"state.ttl": text.encode()} for text in (before, after))
    return versions.between(*files).delta


@examples(120)
@given(documents() | st.just(STATE), st.lists(facts, max_size=5), st.lists(facts, max_size=5))
def test_a_change_is_what_the_whole_files_say(
    text: str, removed: list[Triple], added: list[Triple]
) -> None:
    after = rewrite(text, removed, added, "x.ttl")
    for before, now in ((text, after), (after, text)):
        assert told(before, now) == changed(before, now)


@pytest.mark.parametrize("old", [None, *BY_HAND])
@pytest.mark.parametrize("new", BY_HAND[:-1])
def test_so_is_what_was_edited_by_hand(old: tuple[str, str] | None, new: tuple[str, str]) -> None:
    """Every replacement in every 25th place where its text stands, over a file with another."""
    text = STATE.replace(*old, 1) if old else STATE
    places = [at for at in range(len(text)) if text.startswith(new[0], at)]
    for at in places[::25] or [None]:
        after = text if at is None else text[:at] + text[at:].replace(*new, 1)
        assert told(text, after) == changed(text, after)


def test_a_fact_that_still_stands_elsewhere_has_not_gone() -> None:
    twice = STATE + "\nex:water ex:obj_location ex:sink ;\n.\n"
    assert told(twice, STATE) == Delta()
    water = "ex:water ex:IsBoiled false ;\n    ex:obj_location"
    moved = told(twice, twice.replace(f"{water} ex:sink", f"{water} ex:table"))
    assert moved == Delta(added=frozenset({(ex("water"), ex("obj_location"), ex("table"))}))


def test_of_a_commit_of_very_many_facts_only_those_near_the_sought_are_read(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.keep(leek("fridge"))
    turns = [item(f"thing_{n:04}", "table") for n in range(1_000)]
    added = frozenset(t for turn in turns for t in turn.lessons[0].delta.added)
    one.change(Delta(added=added), "learn: very much")

    whole = list(Versions.of(tmp_path, "kitchen").taught())
    about = list(Versions.of(tmp_path, "kitchen").taught(str(ex("thing_0321"))))

    assert [each.changes for each in whole] == [
        each.changes for each in Versions.of(tmp_path, "kitchen").taught()
    ]
    assert len(whole[0].added) == len(added)
    [near] = about
    assert f"<{ex('thing_0321')}> <{ex('obj_location')}> <{ex('table')}>" in near.added
    assert len(near.added) < len(added)


def test_history_is_the_same_from_the_cache(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    one.keep(leek("fridge"))
    fresh = list(Versions.of(tmp_path, "kitchen").taught())
    [cache] = (tmp_path / ".git/adaptbot").glob("cache-kitchen*")
    written = cache.read_bytes()
    one.keep(item("chard", "table"))
    newer = list(Versions.of(tmp_path, "kitchen").taught())
    assert [t.changes for t in newer[1:]] == [t.changes for t in fresh]
    assert (ex("chard"), ex("obj_location"), ex("table")) in newer[0].changes.delta.added
    [about] = Versions.of(tmp_path, "kitchen").taught(str(ex("leek")))
    assert about.sha == fresh[0].sha
    for damaged in (b"", written[:-9], written.replace(b"leek", b"okra"), b"\0\xff\n[", written):
        cache.write_bytes(damaged)
        again = Versions.of(tmp_path, "kitchen").taught()
        assert [t.changes for t in again] == [t.changes for t in newer]


def test_history_is_that_of_the_branch(tmp_path: Path) -> None:
    one = keeper(tmp_path)
    first = one.keep(leek("fridge")).revision or ""
    one.keep(item("chard", "table"))
    assert len(list(Versions.of(tmp_path, "kitchen").taught())) == 3
    (tmp_path / ".git/refs/heads/main").write_text(f"{first}\n")
    back = Versions.of(tmp_path, "kitchen")
    assert next(t.sha for t in back.taught()) == first == Repo.open_or_init(tmp_path).head()
    assert list(back.taught(str(ex("chard")))) == []


@pytest.mark.parametrize("lost", ["kg/kitchen/state.ttl", "kg", ""])
def test_of_a_damaged_version_nothing_is_made_up(tmp_path: Path, lost: str) -> None:
    """What cannot be read is no file that somebody left as no Turtle, nor an empty folder."""
    one = keeper(tmp_path)
    for place in ("fridge", "table"):
        one.keep(item(place[0], place))
    tree = Repo.open_or_init(tmp_path).libgit2.revparse_single(f"HEAD~1:{lost}")
    (tmp_path / f".git/objects/{str(tree.id)[:2]}/{str(tree.id)[2:]}").unlink()
    for cache in (tmp_path / ".git/adaptbot").glob("cache-*"):
        cache.unlink()
    with pytest.raises(KnowledgeError, match="git fsck"):
        list(Versions.of(tmp_path, "kitchen").taught())
